"""The same scenes in two systems of units: N, mm, MPa, g/cm³, d and SI."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

import growthx as gx
from benchmarks.shared.integrals import relative
from benchmarks.stability.study import BODIES, VARIANTS, BodyCase, Part, march

if TYPE_CHECKING:
    from growthx.common.arrays import Floats

LENGTH, STRESS, DENSITY, TIME = 1e-3, 1e6, 1e3, 86400.0  # SI units in a mm, a MPa, a g/cm³ and a day


@dataclass(frozen=True)
class Row:
    """How far apart the answers are, as relative root mean squares, and the steps taken."""

    body: str
    variant: str
    ended: str
    ended_si: str
    steps: int
    steps_si: int
    density: float
    displacement: float


def in_si(scene: gx.Scene) -> gx.Scene:
    """A scene in N, mm, MPa, g/cm³ and days (of two dimensions, forces per mm) in kg, m and s."""
    material, growth = scene.material, scene.growth
    return replace(
        scene,
        material=replace(
            material, young=STRESS * material.young, reference_density=DENSITY * material.reference_density
        ),
        growth=replace(
            growth,
            attractor=_scaled(growth.attractor, STRESS),
            rate=growth.rate * DENSITY / STRESS / TIME,
        ),
        loads=tuple(_load(load) for load in scene.dead_loads),
        program=gx.Program(
            step=TIME * scene.program.step, until=TIME * scene.program.until, ramp=TIME * scene.program.ramp
        ),
        mesh=_mesh(scene.mesh),
    )


def _mesh(mesh: gx.Mesh) -> gx.Mesh:
    """In metres; the mesh is changed."""
    mesh.domain.geometry.x[:] *= LENGTH
    return mesh


def _load(load: Any) -> Any:
    if isinstance(load, gx.Traction):
        return replace(load, value=tuple(STRESS * component for component in load.value))
    weight = load.weight and partial(_in_mm, load.weight)
    return replace(load, force=tuple(STRESS * LENGTH * component for component in load.force), weight=weight)


def _scaled(value: Any, factor: float) -> Any:
    """A number, or a function of position in mm."""
    return (lambda x: factor * value(x / LENGTH)) if callable(value) else factor * value


def _in_mm(function: Any, x: Floats) -> Floats:
    return np.asarray(function(x / LENGTH))


def run(case: BodyCase) -> list[Row]:
    """Both systems."""
    body, variant = BODIES[case.body], gx.variants.named(case.variant)
    scene = body.scene.__wrapped__(1)  # a mesh of its own, which is then made smaller
    one = march(scene, variant)
    density, volumes = one.problem.density.x.array.copy(), np.abs(one.problem.volumes)
    displacement = one.problem.displacement.x.array.copy()
    two = march(in_si(scene), variant)
    apart = two.problem.displacement.x.array / LENGTH - displacement
    return [
        Row(
            *vars(case).values(),
            one.ended,
            two.ended,
            one.steps,
            two.steps,
            relative(two.problem.density.x.array / DENSITY, density, volumes),
            float(np.linalg.norm(apart) / np.linalg.norm(displacement)),
        )
    ]


def cases() -> list[BodyCase]:
    """All of them."""
    return [BodyCase(*these) for these in product(BODIES, VARIANTS)]


PART = Part("units", Row, cases, run)
