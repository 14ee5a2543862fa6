"""Runs of these cases, what they took, and their seconds measured in turn."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

import growthx as gx
from benchmarks.accuracy.error_vs_runtime.cases import Way

LONG = 3.0  # seconds of one setting after which it is not run again: long runs scatter less
Name = TypeVar("Name")


def solve(scene: gx.Scene, variant: str, way: Way, **options: Any) -> gx.Result:
    """Run a scene to its end, or to where a step cannot be solved; options as of `growthx.solve`."""
    timed, stepping = way.through(scene)
    try:
        return gx.solve(timed, gx.variants.named(variant), **{"stepping": stepping, **options})
    except gx.RunEndedEarly as ended:
        return ended.result


@dataclass(frozen=True)
class Work:
    """What a run took: accepted steps, and Newton iterations, residuals and factorisations in them."""

    steps: int
    iterations: int
    residuals: int
    factorisations: int


def work(result: gx.Result) -> Work:
    """Counts of a run."""
    reports = [step.newton for step in result.steps]
    names = ("iterations", "residuals", "factorisations")
    return Work(len(reports), *(sum(getattr(report, name) for report in reports) for name in names))


def in_turn(
    runs: dict[Name, Callable[[], gx.Result]], repeats: int, look: Callable[[Name, gx.Result], None]
) -> dict[Name, list[float]]:
    """Seconds of solving of several runs, round by round, so that what else happens meets all.

    A rehearsal, which compiles, comes before; its results are looked at.  Where it was long, it counts as the only one.
    """
    seconds: dict[Name, list[float]] = {}
    for name, run in runs.items():
        result = run()
        look(name, result)
        seconds[name] = [result.solve_s]
    short = [name for name, (rehearsal,) in seconds.items() if rehearsal < LONG]
    seconds.update({name: [] for name in short})
    for _ in range(repeats):
        for name in short:
            seconds[name].append(runs[name]().solve_s)
    return seconds
