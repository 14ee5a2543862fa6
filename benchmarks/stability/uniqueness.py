"""Whether the equilibrium depends on how it was reached: from random densities, and under other histories of load."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

import growthx as gx
from benchmarks.shared.integrals import relative
from benchmarks.stability.study import (
    BODIES,
    VARIANTS,
    Body,
    March,
    Part,
    march,
    share,
    to_rest,
    with_exponents,
)
from growthx.baselines import high_frequency_index
from growthx.model.exponents import is_well_posed

if TYPE_CHECKING:
    from growthx.common.arrays import Floats, Marks
    from growthx.discretisation.discretisation import Discretisation
    from growthx.model.loads import DistributedForce, Load

EXPONENTS = (3.0, 0.0)  # m, with n = 2
BOUNDS = (0.1, 2.0)  # of ρ*, between which a density that is not well posed finds an end
SCATTER = 0.5  # of the initial density, uniformly distributed to either side
OVERLOAD = 1.5
SEEDS = (1, 2)
SHORT_STEPS, ENOUGH = 30, 10.0  # per, and in, times of resorption: what is not well posed allows no long steps
SLOW = 1e-6  # of unloaded resorption: a rate of density at which such a march may end, too

REFERENCE = "uniform, ramp"
RANDOM = tuple(f"random {seed}, ramp" for seed in SEEDS)
ONE_STEP, OVERLOADED, IN_TURN, REVERSED = "one step", "overload and back", "loads in turn", "in reversed order"


@dataclass(frozen=True)
class Case:
    """A body, the exponent m and a discretisation."""

    body: str
    m: float
    variant: str


@dataclass(frozen=True)
class Row:
    """One way to equilibrium, compared with the first: a uniform density under a ramp of the load.

    apart, farthest: distance of its densities from that one's over the root mean square of those, as root mean square
    and at most; NaN where one of the two did not come to an end.  noise: high-frequency index.
    at_bounds: share of the volume, of a density with bounds.
    """

    body: str
    m: float
    variant: str
    way: str
    ended: str
    time: float
    rejected: int
    lowest: float
    highest: float
    apart: float
    farthest: float
    noise: float
    at_bounds: float


@dataclass(frozen=True)
class Way:
    """A way to equilibrium: the loads in time, how long they change, and the seed of a random initial density."""

    name: str
    loads: Callable[[gx.Scene], tuple[Load, ...]]
    ramps: float = 1.0
    seed: int | None = None


def scene_of(body: Body, m: float) -> gx.Scene:
    """The body on its coarse mesh; the plate with a second load, so that there is an order of loads."""
    scene = body.scene(1)
    if body.name == "plate":
        scene = replace(scene, loads=(*scene.loads, gx.Traction("right", (0.02, 0.0))))
    reference = scene.material.reference_density
    bounds = (None, None) if m > scene.material.density_exponent else tuple(reference * bound for bound in BOUNDS)
    return with_exponents(scene, scene.material.density_exponent, m, bounds=bounds)


def ways(scene: gx.Scene) -> list[Way]:
    """All ways for a scene: loads in turn where there are several, an overload where more marches are not too many."""
    found = [
        Way(REFERENCE, _as_they_are),
        *(Way(name, _as_they_are, seed=seed) for name, seed in zip(RANDOM, SEEDS, strict=True)),
        Way(ONE_STEP, _as_they_are, ramps=0.0),
    ]
    groups = len(_groups(scene))
    if is_well_posed(scene):
        found.append(Way(OVERLOADED, _overloaded, ramps=3.0))
    if groups > 1:
        found += [
            Way(IN_TURN, lambda scene: _in_turn(scene, _groups(scene)), ramps=groups),
            Way(REVERSED, lambda scene: _in_turn(scene, _groups(scene)[::-1]), ramps=groups),
        ]
    return found


def _as_they_are(scene: gx.Scene) -> tuple[Load, ...]:
    return scene.dead_loads


def _overloaded(scene: gx.Scene) -> tuple[Load, ...]:
    """Up to the overload in one time of the ramp, held for another, and back."""
    ramp = scene.program.ramp
    times, shares = ramp * np.arange(4), (0.0, OVERLOAD, OVERLOAD, 1.0)
    return tuple(replace(load, history=lambda time: float(np.interp(time, times, shares))) for load in scene.dead_loads)


def _in_turn(scene: gx.Scene, groups: Sequence[tuple[Load, ...]]) -> tuple[Load, ...]:
    """One group after another, each in one time of the ramp."""
    ramp = scene.program.ramp
    return tuple(
        replace(load, history=lambda time, start=number * ramp: min(max((time - start) / ramp, 0.0), 1.0))
        for number, group in enumerate(groups)
        for load in group
    )


def _groups(scene: gx.Scene) -> list[tuple[Load, ...]]:
    """Loads that come together: the forces of one load case of the femur, else each its own."""
    cases: dict[str, list[DistributedForce]] = {}
    for number, load in enumerate(scene.dead_loads):
        cases.setdefault(getattr(load, "case", f"load {number}"), []).append(load)
    return [tuple(group) for group in cases.values()]


def reach(body: Body, scene: gx.Scene, variant: str, way: Way) -> March:
    """March a way to its end."""
    changed = replace(scene, loads=way.loads(scene))
    loaded = way.ramps * scene.program.ramp
    if way.ramps == 0:
        loaded = scene.program.step
        changed = replace(changed, program=replace(scene.program, ramp=0.0))
    if is_well_posed(scene):
        changed, stepping = to_rest(changed, body, loaded)
    else:
        step = body.resorption / SHORT_STEPS
        program = replace(changed.program, step=step, until=loaded + ENOUGH * body.resorption)
        changed, stepping = replace(changed, program=program), gx.FixedSteps(equilibrium=SLOW)
    problem = gx.discretise(changed, gx.variants.named(variant))
    if way.seed is not None:
        random = np.random.default_rng(way.seed).uniform(1 - SCATTER, 1 + SCATTER, len(problem.density.x.array))
        problem.system.set_density(scene.material.reference_density * random)
    return march(changed, problem.variant, stepping=stepping, problem=problem)


def run(case: Case) -> list[Row]:
    """All ways."""
    body = BODIES[case.body]
    scene = scene_of(body, case.m)
    marches = {way.name: reach(body, scene, case.variant, way) for way in ways(scene)}
    return [_row(case, name, each, marches[REFERENCE]) for name, each in marches.items()]


def _row(case: Case, name: str, each: March, reference: March) -> Row:
    apart = farthest = math.nan
    if each.finished and reference.finished:
        one, other = (these.problem.density.x.array for these in (each, reference))
        volumes = np.abs(reference.problem.volumes)
        apart = relative(one, other, volumes)
        farthest = float(np.abs(one - other).max() / reference.problem.measures.root_mean_square(other))
    return Row(
        *(case.body, case.m, case.variant, name, each.ended, each.time, each.rejected),
        *each.problem.density_range(),
        apart,
        farthest,
        high_frequency_index(each.problem),
        share(each.problem, partial(_at_bounds, each.problem)),
    )


def _at_bounds(problem: Discretisation, density: Floats) -> Marks:
    """Which densities are at a bound of the law, to round-off."""
    low, high = problem.scene.growth.limits
    return np.asarray((density < low * (1 + 1e-9)) | (density > high * (1 - 1e-9)))


def cases() -> list[Case]:
    """All of them."""
    return [Case(*these) for these in product(BODIES, EXPONENTS, VARIANTS)]


PART = Part("uniqueness", Row, cases, run)
