"""How long a time step may be: implicit and explicit Euler towards equilibrium, and the limit of the explicit one."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise, product
from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse.linalg import LinearOperator, eigs

import growthx as gx
from benchmarks.stability.study import BODIES, FINISHED, STUCK, VARIANTS, Body, BodyCase, Part, at_once, march, to_rest
from growthx.baselines import frozen, update

if TYPE_CHECKING:
    from growthx.common.arrays import Floats
    from growthx.discretisation.discretisation import Discretisation
    from growthx.stepping.record import Step

IMPLICIT, EXPLICIT = "implicit", "explicit"
STEPS = tuple(10.0**power for power in range(-3, 7))  # Δt
COUNT = 20  # of them
SMALLEST = 1e-6  # of ρ*, the floor of explicit updates, so low that it changes no limit
EXACT = 1e-12  # tolerance of equilibrium in what is differenced
NUDGE = 1e-6  # of the densities' root mean square


# -- steps of any length -----------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Case:
    """A body, a discretisation, a scheme and a time step."""

    body: str
    variant: str
    scheme: str
    step: float


@dataclass(frozen=True)
class Row:
    """Steps of one length under full load, from the uniform initial density.

    first, last: distance from equilibrium at the start and at the end, relative root mean square.
    worst: largest ratio of the distance after a step to that before; below one, the approach is monotone.
    """

    body: str
    variant: str
    scheme: str
    step: float
    ended: str
    steps: int
    rejected: int
    first: float
    last: float
    worst: float
    lowest: float


@cache
def equilibrium(body: str, variant: str) -> Discretisation:
    """The body at rest, with that discretisation."""
    scene, stepping = to_rest(BODIES[body].scene(1), BODIES[body], BODIES[body].scene(1).program.ramp)
    return march(scene, gx.variants.named(variant), stepping=stepping).problem


class Approach:
    """Distances from equilibrium, step by step from where all of the load has come."""

    def __init__(self, rest: Discretisation, start: Discretisation, loaded: float) -> None:
        self._rest, self._loaded = rest, loaded
        self.distances = [self._distance(start)]

    def __call__(self, step: Step, problem: Discretisation) -> None:
        """Note a step."""
        if step.time > self._loaded:
            self.distances.append(self._distance(problem))

    def _distance(self, problem: Discretisation) -> float:
        exact, size = self._rest.density.x.array, self._rest.measures.root_mean_square
        return size(problem.density.x.array - exact) / size(exact)

    @property
    def worst(self) -> float:
        """The largest ratio of one distance to the one before it."""
        known = [each for each in self.distances if each > ROUND_OFF]
        return max((after / before for before, after in pairwise(known)), default=0.0)


ROUND_OFF = 1e-8  # distances that mean nothing: equilibrium itself is known so well


def run(case: Case) -> list[Row]:
    """One scheme with one step."""
    body, variant = BODIES[case.body], gx.variants.named(case.variant)
    scene, stepping = at_once(body.scene(1), body, case.step, COUNT)
    rest = equilibrium(case.body, case.variant)
    if case.scheme == IMPLICIT:
        problem = gx.discretise(scene, variant)
        approach = Approach(rest, problem, stepping.loaded)
        result = march(scene, variant, stepping=stepping, problem=problem, watch=approach)
        ended, steps, rejected = result.ended, result.steps, result.rejected
    else:
        problem = loaded(body, variant, case.step, COUNT)
        approach = Approach(rest, problem, 0.0)
        ended, steps, rejected = FINISHED, 0, 0
        try:
            for step in updates(body, problem):
                approach(step, problem)
                steps += 1
        except gx.EndedEarly:
            ended = STUCK
    distances = approach.distances
    lowest = problem.density_range()[0]
    return [Row(*vars(case).values(), ended, steps, rejected, distances[0], distances[-1], approach.worst, lowest)]


def loaded(body: Body, variant: gx.Variant, step: float, count: int, density: Floats | None = None) -> Discretisation:
    """A problem for so many updates after equilibrium, under full load at a density, by default the initial one."""
    scene, stepping = at_once(body.scene(1), body, body.scene(1).program.ramp, 1)
    before = frozen(scene, variant)
    if density is not None:
        before.system.set_density(density)
    result = march(before.scene, variant, stepping=stepping, problem=before)
    if not result.finished:
        raise gx.EndedEarly(result.why)
    problem = frozen(replace(scene, program=gx.Program(step=step, until=count * step)), variant)
    problem.system.recall(before.system.memory())
    return problem


def updates(body: Body, problem: Discretisation, tolerance: float = 1e-10) -> Iterator[Step]:
    """Explicit steps through the program of a loaded problem."""
    scene = replace(body.scene(1), program=problem.scene.program)
    floor = SMALLEST * scene.material.reference_density
    return update(scene, problem.variant, problem, floor=floor, tolerance=tolerance)


def cases() -> list[Case]:
    """All of them."""
    return [Case(*these) for these in product(BODIES, VARIANTS, (IMPLICIT, EXPLICIT), STEPS)]


PART = Part("time_steps", Row, cases, run)


# -- the limit of explicit steps ---------------------------------------------------------------------------------------


@dataclass(frozen=True)
class LimitRow:
    """The longest stable step of explicit Euler about equilibrium.

    at_stress, at_strain: 2 ρ/(k c Ψ₀*) of the lowest density, with k = m + n where the stress does not follow the
    density and k = m − n where the strain does not.
    eigenvalue: of the linearised problem with equilibrium of momentum, the one of the largest modulus, per time.
    linearised: 2/|eigenvalue|.  found: by bisection.
    """

    body: str
    variant: str
    lowest: float
    at_stress: float
    at_strain: float
    eigenvalue: float
    linearised: float
    found: float


def run_limit(case: BodyCase) -> list[LimitRow]:
    """Eigenvalue and bisection."""
    body = BODIES[case.body]
    rest = equilibrium(case.body, case.variant)
    at_stress, at_strain = _pointwise(rest)
    eigenvalue = _eigenvalue(body, rest, at_stress)
    found = _bisect(lambda step: _grows(body, rest, step), at_stress / 4)
    lowest = rest.density_range()[0]
    return [LimitRow(case.body, case.variant, lowest, at_stress, at_strain, eigenvalue, 2 / abs(eigenvalue), found)]


def _pointwise(rest: Discretisation) -> tuple[float, float]:
    """The limits that one density has by itself: the lowest of the body, each with its own attractor."""
    growth, n = rest.scene.growth, rest.scene.material.density_exponent
    attractor = rest.evaluate(rest.growth.attractor * rest.growth.rate, np.full((1, 2), 0.5)).max()
    slowest = rest.density_range()[0] / float(attractor)
    return 2 * slowest / (growth.exponent + n), 2 * slowest / (growth.exponent - n)


def _eigenvalue(body: Body, rest: Discretisation, step: float) -> float:
    """Of the largest modulus, of ∂R₀/∂ρ with the displacement in equilibrium, by Arnoldi's method on differences."""
    exact = rest.density.x.array.copy()
    problem = loaded(body, rest.variant, step, MATVECS, exact)
    steps = updates(body, problem, EXACT)
    size = NUDGE * rest.measures.root_mean_square(exact)

    def rate(density: Floats) -> Floats:
        problem.system.set_density(density)
        next(steps)
        return np.asarray((problem.density.x.array - density) / step)

    at_rest = rate(exact)

    def derivative(direction: Floats) -> Floats:
        scale = size / np.sqrt(np.mean(np.square(direction)))
        return (rate(exact + scale * direction.ravel()) - at_rest) / scale

    operator = LinearOperator((len(exact), len(exact)), matvec=derivative, dtype=float)
    start = np.random.default_rng(0).normal(size=len(exact))
    return float(eigs(operator, k=1, which="LM", tol=1e-3, v0=start, return_eigenvectors=False)[0].real)


MATVECS = 2000
DISTURBED, WATCHED = 1e-4, 40  # relative size of a random disturbance of equilibrium, and steps until it has grown


def _grows(body: Body, rest: Discretisation, step: float) -> bool:
    """Whether what alternates from step to step, as an instability does, grows."""
    exact = rest.density.x.array
    random = np.random.default_rng(0).normal(size=len(exact))
    problem = loaded(body, rest.variant, step, WATCHED, exact)
    problem.system.set_density(exact * (1 + DISTURBED * random))
    states = [problem.density.x.array.copy()]
    try:
        for _ in updates(body, problem, EXACT):
            states.append(problem.density.x.array.copy())
    except gx.EndedEarly:
        return True
    alternating = [np.linalg.norm(each) for each in np.diff(states, 2, axis=0)]
    # Far above the limit it has long grown to what the law lets it be, and grows no more.
    return bool(alternating[-1] > min(alternating[len(alternating) // 2], 2 * alternating[0]))


def _bisect(grows: Callable[[float], bool], low: float) -> float:
    """The step at which growth begins, above a low one, within half a per cent; NaN if the low one grows already."""
    if grows(low):
        return math.nan
    high = 2 * low
    while not grows(high):
        low, high = high, 2 * high
    while high / low > 1.005:
        middle = math.sqrt(low * high)
        low, high = (low, middle) if grows(middle) else (middle, high)
    return math.sqrt(low * high)


def limit_cases() -> list[BodyCase]:
    """All of them."""
    return [BodyCase(*these) for these in product(BODIES, VARIANTS)]


LIMIT = Part("explicit_limit", LimitRow, limit_cases, run_limit)
