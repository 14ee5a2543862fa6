"""Runs of the femur with m = 0, between bounds and without any, on several meshes and in steps of several lengths."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache
from typing import TYPE_CHECKING

import growthx as gx
from benchmarks.shared.integrals import relative
from benchmarks.stability.study import March, Part, cell_means, march, means_over, named
from growthx.baselines import checkerboard_index, high_frequency_index

if TYPE_CHECKING:
    from growthx.common.arrays import Floats
    from growthx.discretisation.discretisation import Discretisation
    from growthx.stepping.record import Step

VARIANTS = ("Q1P0", "Q1sri", "Q1", "Q1Q1")
BOUNDS = (0.12, 2.4)  # g/cm³: a tenth of ρ* and twice ρ*
UNTIL = 800.0
STEP = 4.0
EVERY = 20.0  # of time, in the history
ILL, WELL = 0.0, 3.0  # m, below and above n = 2


@dataclass(frozen=True)
class Case:
    """A discretisation, an exponent, whether density has bounds, parts of each side of the 658 cells, and Δt."""

    variant: str
    m: float
    bounded: int
    refine: int
    step: float


@dataclass(frozen=True)
class Row:
    """A run at its end.

    low, high: shares of the volume at the bounds or, without bounds, beyond their values.  jump, noise: checkerboard
    and high-frequency index.  apart: distance of the means of the 658 cells from those of the run on these in steps of
    4, root mean square, relative; NaN where one of the two did not come to its end.
    """

    variant: str
    m: float
    bounded: int
    refine: int
    step: float
    ended: str
    time: float
    rejected: int
    lowest: float
    highest: float
    low: float
    high: float
    mean: float
    jump: float
    noise: float
    apart: float
    why: str


@dataclass(frozen=True)
class Moment:
    """The shares of the volume at or beyond the bounds at a time."""

    variant: str
    m: float
    bounded: int
    time: float
    low: float
    high: float


def scene_of(case: Case) -> gx.Scene:
    """The femur."""
    scene = gx.scenes.femur(m=case.m, refine=case.refine, step=case.step, until=UNTIL)
    scene = replace(scene, program=gx.Program(step=case.step, until=UNTIL, ramp=5 * STEP))
    return replace(scene, growth=replace(scene.growth, bounds=BOUNDS)) if case.bounded else scene


def shares(problem: Discretisation) -> tuple[float, float]:
    """Of the volume, at or beyond each bound, to round-off."""
    dofs, volumes = problem.growing_dofs, problem.volumes
    density = problem.density.x.array[dofs]
    whole = volumes[dofs].sum()
    low, high = density <= BOUNDS[0] * (1 + 1e-9), density >= BOUNDS[1] * (1 - 1e-9)
    return float(volumes[dofs] @ low / whole), float(volumes[dofs] @ high / whole)


@cache
def marched(case: Case) -> tuple[March, tuple[Moment, ...]]:
    """A run, and the shares on its way."""
    history: list[Moment] = []

    def remember(step: Step, problem: Discretisation) -> None:
        number = step.time / EVERY
        if abs(number - round(number)) < 1e-6:
            history.append(Moment(case.variant, case.m, case.bounded, step.time, *shares(problem)))

    found = march(scene_of(case), named(case.variant), patience=5 * round(UNTIL / case.step), watch=remember)
    return found, tuple(history)


@cache
def _base(case: Case) -> tuple[March, Floats, Floats]:
    found = marched(replace(case, refine=1, step=STEP))[0]
    return found, *cell_means(found.problem)


def _apart(case: Case, found: March) -> float:
    base, means, volumes = _base(case)
    if not (found.finished and base.finished):
        return math.nan
    own, own_volumes = cell_means(found.problem)
    if case.refine > 1:
        own = means_over(base.problem.scene.mesh, found.problem.scene.mesh, own, own_volumes)
    return relative(own, means, volumes)


def run(case: Case) -> list[Row]:
    """One run."""
    found, _ = marched(case)
    problem = found.problem
    return [
        Row(
            *(case.variant, case.m, case.bounded, case.refine, case.step),
            *(found.ended, found.time, found.rejected),
            *problem.density_range(),
            *shares(problem),
            problem.mean_density(),
            checkerboard_index(problem),
            high_frequency_index(problem),
            _apart(case, found),
            found.why,
        )
    ]


def cases() -> list[Case]:
    """Of each discretisation: meshes at one Δt, steps on one mesh; and the well-posed model in the same way."""
    ways = [(1, STEP), (2, STEP), (3, STEP), (1, 1.0), (1, 2.0), (1, 8.0)]
    models = [(ILL, 1), (ILL, 0), (WELL, 1)]
    return [
        Case(variant, m, bounded, refine, step)
        for variant in VARIANTS
        for m, bounded in models
        for refine, step in ways
    ]


PART = Part("zero_one", Row, cases, run)
