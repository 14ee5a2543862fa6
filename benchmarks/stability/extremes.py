"""Loads, strains, incompressibility, contrasts of density and cells far from what anybody would choose."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

import growthx as gx
from benchmarks.shared.loads import times
from benchmarks.stability.study import BODIES, VARIANTS, Part, at_once, march
from growthx.scenes.plate import tip_displacement

if TYPE_CHECKING:
    from growthx.common.arrays import Floats
    from growthx.discretisation.discretisation import Discretisation

CELLS = 6  # over the height of the plate
FINE = 24  # … of the plate that Poisson's ratios are measured on, with Q2


# -- scenes ------------------------------------------------------------------------------------------------------------


def plate(cells: int = CELLS) -> gx.Scene:
    """The benchmark plate with its own program."""
    return gx.scenes.plate(cells)


def loaded(body: str) -> Callable[[float], gx.Scene]:
    """A body by the factor of its load."""

    def scene(factor: float) -> gx.Scene:
        base = BODIES[body].scene(1)
        return replace(base, loads=tuple(times(load, factor) for load in base.dead_loads))

    return scene


def stretched(stretch: float) -> gx.Scene:
    """The plate with both ends clamped, the right one moved until the plate is so many times as long."""
    moved = gx.Support("right", (2 * (stretch - 1), 0.0))
    return _displaced(plate(), (gx.Support("left"), moved))


def compressed(volume: float) -> gx.Scene:
    """The plate between rollers, its length reduced to that share."""
    sides = (gx.Support("left", (0.0, None)), gx.Support("bottom", (None, 0.0)), gx.Support("top", (None, 0.0)))
    mesh = plate().mesh
    places = {"left": (0, 0.0), "right": (0, 2.0), "bottom": (1, 0.0), "top": (1, 1.0)}
    mesh = gx.Mesh.with_names(
        mesh.domain, {name: lambda x, i=i, at=at: np.isclose(x[i], at) for name, (i, at) in places.items()}
    )
    return _displaced(replace(plate(), mesh=mesh), (*sides, gx.Support("right", (2 * (volume - 1), None))))


def _displaced(base: gx.Scene, supports: tuple[gx.Support, ...]) -> gx.Scene:
    """Driven by displacements over twenty steps, with an attractor that differs by half from end to end."""
    growth = replace(base.growth, attractor=lambda x: 0.02 * (0.75 + x[0] / 4))
    program = gx.Program(step=0.1, until=4.0, ramp=2.0)
    return replace(base, supports=supports, loads=(), growth=growth, program=program)


def contrasted(highest: float) -> Callable[[float], gx.Scene]:
    """The plate stretched by a tenth, its initial density in waves, by the orders of magnitude of their range.

    highest: density, as a power of ten, over the orders.
    """

    def scene(orders: float) -> gx.Scene:
        def density(x: Floats) -> Floats:
            wave = (np.sin(np.pi * x[0]) * np.cos(2 * np.pi * x[1]) - 1) / 2  # from −1 to 0
            return np.asarray(10 ** (orders * (wave + highest)))

        return replace(stretched(1.1), initial_density=density)

    return scene


def incompressible(cells: int, rate: float) -> Callable[[float], gx.Scene]:
    """The plate by Poisson's ratio."""

    def scene(poisson: float) -> gx.Scene:
        base = plate(cells)
        return replace(base, material=replace(base.material, poisson=poisson), growth=replace(base.growth, rate=rate))

    return scene


def graded(aspect: float) -> gx.Scene:
    """The plate with its cells at the clamped end so many times as high as long; the next ones grow in proportion."""
    columns = 2 * CELLS

    def place(x: Floats) -> Floats:
        return 2 * (ratio**x - 1) / (ratio**columns - 1) if ratio > 1 else 2 * x / columns

    low, high = 1.0, 1e3
    for _ in range(200):  # bisection for the ratio that gives the first column its length
        ratio = math.sqrt(low * high)
        low, high = (ratio, high) if place(np.array(1.0)) > 1 / CELLS / aspect else (low, ratio)
    return _moved(lambda x: np.column_stack([place(x[:, 0] * columns / 2) if aspect > 1 else x[:, 0], x[:, 1]]))


def degenerate(closeness: float) -> gx.Scene:
    """The plate with a corner of every other cell moved along its diagonal; at one, the cell is a triangle."""

    def moved(x: Floats) -> Floats:
        column, row = np.round(x[:, 0] * CELLS).astype(int), np.round(x[:, 1] * CELLS).astype(int)
        inner = (column % 2 == 1) & (row % 2 == 1)
        return x - np.outer(inner, (1.0, 1.0)) * closeness / 2 / CELLS

    return _moved(moved)


def shaken(seed: int) -> Callable[[float], gx.Scene]:
    """The plate with the nodes inside moved at random, by up to a share of the cell size in each direction."""

    def scene(share: float) -> gx.Scene:
        def moved(x: Floats) -> Floats:
            order = np.lexsort(np.round(x.T, 9))  # the same nodes whatever their numbering
            shift = np.empty_like(x)
            shift[order] = np.random.default_rng(seed).uniform(-share / CELLS, share / CELLS, x.shape)
            inside = ((x > 1e-9) & (x < np.array([2.0, 1.0]) - 1e-9)).all(axis=1)
            return x + shift * inside[:, np.newaxis]

        return _moved(moved)

    return scene


def _moved(move: Callable[[Floats], Floats]) -> gx.Scene:
    """The plate with its nodes elsewhere."""
    scene = plate()
    x = scene.mesh.domain.geometry.x
    x[:, :2] = move(x[:, :2].copy())
    return scene


# -- what is measured --------------------------------------------------------------------------------------------------


def deflection(problem: Discretisation) -> float:
    """Of the plate's loaded end, downwards (length)."""
    return -tip_displacement(problem)


def principal_stretches(problem: Discretisation) -> Floats:
    """At the integration points, shape (points, 2)."""
    import ufl

    points = problem.variant.integration_points("quadrilateral")
    F = ufl.Identity(2) + ufl.grad(problem.displacement)
    entries = [problem.evaluate(F[i, j], points).ravel() for i in range(2) for j in range(2)]
    return np.linalg.svd(np.array(entries).T.reshape(-1, 2, 2), compute_uv=False)


def largest_stretch(problem: Discretisation) -> float:
    """No unit."""
    return float(principal_stretches(problem).max())


def smallest_volume(problem: Discretisation) -> float:
    """J, no unit."""
    return float(principal_stretches(problem).prod(axis=1).min())


def contrast(problem: Discretisation) -> float:
    """Orders of magnitude between the lowest and the highest density."""
    low, high = problem.density_range()
    return math.log10(high / low)


@dataclass(frozen=True)
class Study:
    """One thing that is driven to extremes.

    setting: what the settings are.  measured: what is measured.  tolerance: of Newton's method.
    at_once: everything comes before the density can change, in place of a ramp.
    """

    setting: str
    settings: tuple[float, ...]
    scene: Callable[[float], gx.Scene]
    measured: str
    measure: Callable[[Discretisation], float]
    variants: tuple[str, ...] = VARIANTS
    tolerance: float = 1e-10
    at_once: bool = False


LOADS, RATIOS, SHAKES = (0.01, 0.1, 1.0, 10.0, 100.0), (0.3, 0.45, 0.49, 0.499), (0.0, 0.1, 0.2, 0.3)
ORDERS = (2.0, 4.0, 6.0, 8.0)
ELASTIC, GROWN = "locking, elastic", "locking, grown"


def _locking(cells: int, rate: float, variants: tuple[str, ...] = VARIANTS) -> Study:
    """Deflections by Poisson's ratio; near 1/2 the default tolerance is below the round-off of the forces."""
    scene = incompressible(cells, rate)
    return Study("ν", RATIOS, scene, "deflection", deflection, variants, tolerance=1e-6)


def _contrast(highest: float) -> Study:
    """Ranges of the initial density, of a body that is stretched before it grows."""
    return Study("orders of density", ORDERS, contrasted(highest), "orders at the end", contrast, at_once=True)


STUDIES = {
    **{
        f"load on the {name}": Study("load ×", LOADS, loaded(name), "largest stretch", largest_stretch)
        for name in BODIES
    },
    "stretch": Study("stretch", (2.0, 5.0, 10.0), stretched, "largest stretch", largest_stretch),
    "compression": Study("J", (0.7, 0.5, 0.3, 0.1), compressed, "smallest J", smallest_volume),
    "contrast below ρ*": _contrast(0.0),
    "contrast about ρ*": _contrast(0.5),
    "contrast about ρ*, tolerance 1e-6": replace(_contrast(0.5), tolerance=1e-6),
    "contrast below ρ*, loads from zero": replace(_contrast(0.0), at_once=False),
    "aspect": Study("aspect of cells", (1.0, 10.0, 100.0, 1000.0), graded, "deflection", deflection),
    "degenerate": Study("closeness", (0.0, 0.9, 0.99, 0.999, 0.9999), degenerate, "deflection", deflection),
    **{f"shaken {seed}": Study("share", SHAKES, shaken(seed), "deflection", deflection) for seed in (1, 2, 3)},
    "incompressible": Study("ν", (*RATIOS, 0.4999), incompressible(CELLS, 10.0), "deflection", deflection),
    ELASTIC: _locking(CELLS, 0.0),
    GROWN: _locking(CELLS, 10.0),
    f"{ELASTIC}, reference": _locking(FINE, 0.0, ("Q2",)),
    f"{GROWN}, reference": _locking(FINE, 10.0, ("Q2",)),
}


@dataclass(frozen=True)
class Case:
    """A setting of a study and a discretisation."""

    study: str
    setting: float
    variant: str


@dataclass(frozen=True)
class Row:
    """How a march under extreme conditions went; measured: in its last good state; why: the reason of an early end."""

    study: str
    setting: float
    variant: str
    ended: str
    time: float
    rejected: int
    lowest: float
    highest: float
    measured: float
    why: str


def run(case: Case) -> list[Row]:
    """One march."""
    study = STUDIES[case.study]
    scene, stepping = study.scene(case.setting), None
    if study.at_once:
        program = scene.program
        scene, stepping = at_once(scene, BODIES["plate"], program.step, round(program.until / program.step))
    variant = gx.variants.named(case.variant)
    each = march(scene, variant, stepping=stepping, tolerance=study.tolerance)
    measured = study.measure(each.problem)
    how = each.ended, each.time, each.rejected, *each.problem.density_range()
    return [Row(*vars(case).values(), *how, measured, each.why)]


def cases() -> list[Case]:
    """All of them."""
    return [
        Case(name, setting, variant)
        for name, study in STUDIES.items()
        for setting, variant in product(study.settings, study.variants)
    ]


PART = Part("extremes", Row, cases, run)
