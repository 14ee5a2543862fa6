"""What is run: scenes on their meshes, ways through time, and what is compared at equal error."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from typing import TYPE_CHECKING

import growthx as gx

if TYPE_CHECKING:
    from growthx.stepping.control import Stepping

VARIANTS = tuple(variant.name for variant in gx.variants.suited("quadrilateral"))
EULER, TR_BDF2, ADAPTIVE = "implicit Euler", "TR-BDF2", "adaptive"


# -- scenes ------------------------------------------------------------------------------------------------------------


def bar(elements: int, until: float = 6.0) -> gx.Scene:
    """The bar with discontinuous stimulus; beyond 100 elements its cells stay square, in several rows."""
    rows = max(1, elements // 100)
    scene = gx.scenes.bar(elements=elements // rows, until=until)
    if rows == 1:
        return scene
    bar_geo = gx.meshing.locate("bar.geo")
    return replace(scene, mesh=gx.meshing.read(bar_geo, elements=elements // rows, refine=rows))


def femur(refine: int) -> gx.Scene:
    """The femur, each of its 658 cells split into refine × refine."""
    return gx.scenes.femur(refine=refine)


@dataclass(frozen=True)
class Run:
    """A discretisation on a mesh; adaptive steps of that tolerance where it is a reference."""

    variant: str
    mesh: int
    tolerance: float

    def __str__(self) -> str:
        return f"{self.variant}, mesh {self.mesh}, {self.tolerance:g}"


@dataclass(frozen=True)
class Plan:
    """What is run of a scene in the first study.

    unit: what the mesh numbers count.  linear, quadratic: meshes for displacements of that degree.
    clock: the mesh of the run that others are measured in: Q1P0 with the program's fixed steps.
    first, second: references; the second, of another kind, shows how good the first is.
    """

    name: str
    scene: Callable[[int], gx.Scene]
    unit: str
    linear: tuple[int, ...]
    quadratic: tuple[int, ...]
    clock: int
    first: Run
    second: Run

    def meshes(self, variant: str) -> tuple[int, ...]:
        """The meshes for a discretisation."""
        return self.linear if gx.variants.named(variant).displacement.degree == 1 else self.quadratic


PLANS = (
    Plan(
        "bar",
        cache(bar),
        "cells along the bar",
        (10, 20, 40, 100, 200),
        (10, 20, 40, 100),
        40,
        Run("S2fri", 600, 1e-4),
        Run("Q2", 600, 1e-3),
    ),
    Plan(
        "plate",
        cache(gx.scenes.plate),
        "cells over the height",
        (8, 16, 32, 64),
        (4, 8, 16, 32),
        16,
        Run("S2fri", 96, 1e-5),
        Run("Q2", 96, 1e-4),
    ),
    Plan(
        "femur",
        cache(femur),
        "parts of each side of 658 cells",
        (1, 2, 3),
        (1, 2),
        1,
        Run("S2fri", 6, 1e-4),
        Run("Q2", 5, 1e-3),
    ),
)
QUICK = (
    replace(
        PLANS[0], linear=(10, 20), quadratic=(10,), clock=10, first=Run("S2fri", 200, 1e-3), second=Run("Q2", 200, 1e-2)
    ),
    replace(PLANS[1], linear=(4, 8), quadratic=(4,), clock=8, first=Run("S2fri", 24, 1e-4), second=Run("Q2", 24, 1e-3)),
    replace(PLANS[2], linear=(1,), quadratic=(1,), clock=1, first=Run("S2fri", 3, 1e-3), second=Run("Q2", 2, 1e-2)),
)


# -- ways through time -------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Way:
    """A scheme, and its number of steps in the load ramp, which go on to the end, or its tolerance."""

    scheme: str
    setting: float

    def through(self, scene: gx.Scene) -> tuple[gx.Scene, Stepping]:
        """The scene with its steps: the ramp stays as it is, and steps end where it does."""
        if self.scheme == ADAPTIVE:
            return scene, gx.AdaptiveSteps(self.setting)
        program = replace(scene.program, step=scene.program.ramp / self.setting)
        scheme = gx.TR_BDF2 if self.scheme == TR_BDF2 else gx.IMPLICIT_EULER
        return replace(scene, program=program), gx.FixedSteps(scheme=scheme)

    def __str__(self) -> str:
        return f"{self.scheme}, {self.setting:.1e}" if self.scheme == ADAPTIVE else f"{self.scheme}, {self.setting:g}"


WAYS = (
    *(Way(EULER, parts) for parts in (1, 2, 5)),
    *(Way(TR_BDF2, parts) for parts in (1, 2)),
    *(Way(ADAPTIVE, tolerance) for tolerance in (3e-2, 1e-2, 1e-3)),
)
CLOCK = Way(EULER, 5)


# -- adaptive steps against the paper's scheme -------------------------------------------------------------------------


@dataclass(frozen=True)
class Case:
    """Adaptive steps against the paper's scheme on one mesh, at equal errors; targets: least ratio wanted at 1e-3."""

    name: str
    scene: Callable[[], gx.Scene]
    errors: tuple[float, ...]
    target: float


CASES = (
    Case("bar of 40 cells, to t = 1.5", lambda: bar(40, until=1.5), (1e-2, 1e-3, 1e-4), 5),
    Case("bar of 40 cells, to t = 6", lambda: bar(40), (1e-3,), 5),
    Case("plate, N = 16", lambda: gx.scenes.plate(16), (1e-2, 1e-3, 1e-4), 10),
    Case("plate, N = 64", lambda: gx.scenes.plate(64), (1e-2, 1e-3), 10),
    Case("femur of 658 cells", lambda: femur(1), (1e-2, 1e-3, 1e-4), 10),
    Case("femur of 2632 cells", lambda: femur(2), (1e-2, 1e-3), 10),
)
QUICK_CASES = (
    Case("bar of 40 cells, to t = 1.5", lambda: bar(40, until=1.5), (1e-2,), 5),
    Case("plate, N = 8", lambda: gx.scenes.plate(8), (1e-2,), 10),
)
COMPARED = ("Q1P0", "Q1", "Q1Q1")
