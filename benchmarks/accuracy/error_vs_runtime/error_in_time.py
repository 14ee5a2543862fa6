"""The second study, time integration alone: adaptive steps against the paper's scheme at equal error."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import astuple, dataclass
from functools import cache
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING

import growthx as gx
from benchmarks.accuracy.error_vs_runtime.cases import ADAPTIVE, COMPARED, EULER, Case, Way
from benchmarks.accuracy.error_vs_runtime.runs import Work, in_turn, solve, work
from benchmarks.shared.reporting import progress, read_rows, write_rows

if TYPE_CHECKING:
    from growthx.discretisation.discretisation import Discretisation

STEPPING = "error_vs_runtime_stepping.csv"

IN_TIME = 1e-6  # tolerance of the reference in time
PER_DECADE = 8  # tolerances that are tried
COARSEST, TIGHTEST = 1, 6  # negative powers of ten
TRIALS = 8  # of Δt, until one just reaches the error
PAPERS = {"stepping": gx.FixedSteps(predicted=False), "full_newton": True}


@dataclass(frozen=True)
class Comparison:
    """A case at one error: that is wanted; the paper's scheme, the same steps with a kept factor, and adaptive steps.

    parts: steps of the paper's scheme in the ramp.  kept, ratio: the paper's time over that of the other two.
    """

    case: str
    variant: str
    wanted: float
    parts: int
    paper_error: float
    paper_steps: int
    paper_iterations: int
    paper_residuals: int
    paper_factorisations: int
    kept_residuals: int
    kept_factorisations: int
    kept: float
    tolerance: float
    error: float
    steps: int
    iterations: int
    residuals: int
    factorisations: int
    ratio: float
    low: float
    high: float


def error_in_time(result: gx.Result, exact: Discretisation) -> float:
    """Of the final density, relative, against another way through time with the same mesh and discretisation."""
    if not result.converged:
        return math.inf
    gap = exact.density.x.array - result.problem.density.x.array
    return exact.measures.root_mean_square(gap) / exact.measures.root_mean_square(exact.density.x.array)


def fewest_parts(error: Callable[[int], float], wanted: float) -> int:
    """Steps in the ramp with which implicit Euler just reaches an error, which goes with Δt."""
    known: dict[int, float] = {}
    parts = 1
    while parts not in known and len(known) < TRIALS:
        known[parts] = error(parts)
        parts = max(1, math.ceil(parts * known[parts] / wanted)) if known[parts] < math.inf else 2 * parts
    return min((parts for parts, error in known.items() if error <= wanted), default=max(known))


def loosest_tolerance(error: Callable[[float], float], wanted: float) -> float:
    """The loosest tolerance with which adaptive steps reach an error, on a logarithmic scale, by bisection."""

    def tolerance(notch: int) -> float:
        return float(f"{10 ** (-notch / PER_DECADE):.3g}")

    loose, tight = PER_DECADE * COARSEST - 1, PER_DECADE * TIGHTEST
    while tight - loose > 1:
        middle = (loose + tight) // 2
        loose, tight = (loose, middle) if error(tolerance(middle)) <= wanted else (middle, tight)
    return tolerance(tight)


def compare(case: Case, variant: str, wanted: Sequence[float], repeats: int) -> list[Comparison]:
    """The comparisons of a case with one discretisation."""
    scene = case.scene()
    exact = solve(scene, variant, Way(ADAPTIVE, IN_TIME)).problem

    @cache
    def error(way: Way) -> float:
        return error_in_time(solve(scene, variant, way), exact)

    results = []
    for each in wanted:
        euler = Way(EULER, fewest_parts(lambda parts: error(Way(EULER, parts)), each))
        adaptive = Way(ADAPTIVE, loosest_tolerance(lambda tolerance: error(Way(ADAPTIVE, tolerance)), each))
        results.append(at_equal_error(case, scene, variant, each, euler, adaptive, error, repeats))
    return results


def at_equal_error(
    case: Case,
    scene: gx.Scene,
    variant: str,
    wanted: float,
    euler: Way,
    adaptive: Way,
    error: Callable[[Way], float],
    repeats: int,
) -> Comparison:
    """The paper's scheme, its steps with a kept factor and adaptive steps, timed in turn."""
    done: dict[str, Work] = {}
    seconds = in_turn(
        {
            "paper": lambda: solve(scene, variant, euler, **PAPERS),
            "kept": lambda: solve(scene, variant, euler),
            "adaptive": lambda: solve(scene, variant, adaptive),
        },
        repeats,
        lambda name, result: done.update({name: work(result)}),
    )
    paper = median(seconds["paper"])
    ratios = (paper / median(seconds["adaptive"]), paper / max(seconds["adaptive"]), paper / min(seconds["adaptive"]))
    return Comparison(
        case.name,
        variant,
        wanted,
        int(euler.setting),
        float(f"{error(euler):.3e}"),
        *astuple(done["paper"]),
        done["kept"].residuals,
        done["kept"].factorisations,
        round(paper / median(seconds["kept"]), 2),
        adaptive.setting,
        float(f"{error(adaptive):.3e}"),
        *astuple(done["adaptive"]),
        *(round(ratio, 2) for ratio in ratios),
    )


def stepping_study(cases: Sequence[Case], folder: Path, again: bool, repeats: int) -> None:
    """Run what is missing, a case with one discretisation at a time."""
    results = [] if again else read_rows(folder / STEPPING, Comparison)
    done = {(each.case, each.variant, each.wanted) for each in results}
    jobs = {
        (case, variant): wanted
        for case in cases
        for variant in COMPARED
        if (wanted := [error for error in case.errors if (case.name, variant, error) not in done])
    }
    with progress("time integration", len(jobs)) as begin:
        for (case, variant), wanted in jobs.items():
            begin(f"{case.name}: {variant}")
            results += compare(case, variant, wanted, repeats)
            write_rows(folder / STEPPING, results)
