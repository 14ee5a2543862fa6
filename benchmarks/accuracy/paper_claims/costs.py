"""Sections 5.4 and 7: what the strategies and the elements cost, by the paper's own Newton method.

Times are ratios of such that are measured in turn, and medians of these: another machine, or another day, has others.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from functools import cache
from statistics import median

import growthx as gx
from benchmarks.accuracy.paper_claims.bars import MESHES, distance
from benchmarks.accuracy.paper_claims.claim import OPEN, Claim, Numbers, decide, row, values
from benchmarks.accuracy.paper_claims.counts import CELLS
from growthx.scenes.bar import CONTINUOUS, bar

ROUNDS = 3
UNTIL = 20.0  # of the femur: its ramp, where both strategies take as many steps
PAIRS = ((gx.Q1Q1, gx.Q1), (gx.S2Q1, gx.S2fri), (gx.Q2Q2, gx.Q2))
ABOUT_THE_SAME = 1.5
NOISE = 1.1  # factor by which ratios of times vary from run to run
SAME_ERROR = {gx.Q1: 100, gx.Q1sri: 100, gx.Q2: 38, gx.S2fri: 52}  # elements of the tapered bar: 0.17 % off


def _seconds(scene: gx.Scene, variant: gx.Variant) -> float:
    problem = gx.discretise(scene, variant)
    start = time.perf_counter()
    for _ in gx.march(scene, variant, problem, full_newton=True):
        pass
    return time.perf_counter() - start


def _ratios(cases: Sequence[tuple[gx.Scene, gx.Variant]], rounds: int = ROUNDS) -> list[float]:
    """Of each case's time over that of the last."""
    found = []
    for _ in range(rounds):
        times = [_seconds(*case) for case in cases]
        found.append([each / times[-1] for each in times])
    return [median(ratios) for ratios in zip(*found, strict=True)]


@cache
def _on_bars() -> dict[str, float]:
    found = {}
    for nodal, local in PAIRS:
        for n in MESHES:
            scene = bar(CONTINUOUS, n)
            found[f"{nodal.name} over {local.name}: bar of {n}"] = _ratios(((scene, nodal), (scene, local)))[0]
    return found


@cache
def _on_femurs() -> dict[str, float]:
    found = {}
    for nodal, local in PAIRS:
        for refine in (1, 2):
            scene = gx.scenes.femur(refine=refine, until=UNTIL)
            ratio = _ratios(((scene, nodal), (scene, local)))[0]
            found[f"{nodal.name} over {local.name}: femur of {CELLS[refine]}"] = ratio
    return found


def _rises(numbers: Numbers, by: float) -> bool:
    """Whether each ratio is larger on the finest mesh than on the coarsest, by more than a factor."""
    ratios = [row(numbers, f"{nodal.name} over {local.name}") for nodal, local in PAIRS]
    return all(each[-1] > by * each[0] for each in ratios)


def _told(numbers: Numbers) -> str:
    return "; ".join(
        f"{nodal.name} over {local.name} "
        + ", ".join(f"{value:.1f}" for value in row(numbers, f"{nodal.name} over {local.name}"))
        for nodal, local in PAIRS
    )


def _by_element() -> dict[str, float]:
    scene = gx.scenes.femur(until=UNTIL)
    elements = gx.Q1sri, gx.Q2, gx.S2fri
    found = _ratios([*((scene, variant) for variant in elements), (scene, gx.Q1)])
    return {f"{variant.name} over Q1: femur of 658": ratio for variant, ratio in zip(elements, found[:-1], strict=True)}


def _same_error() -> dict[str, float]:
    cases = [(bar(CONTINUOUS, n), variant) for variant, n in reversed(SAME_ERROR.items())]
    found = {}
    for (_, variant), ratio in zip(cases, _ratios(cases), strict=True):
        n = SAME_ERROR[variant]
        found[f"{variant.name} of {n}: % off"] = 100 * distance(CONTINUOUS, n, variant)
        found[f"{variant.name} of {n}: time over Q1's"] = ratio
    return found


CLAIMS = (
    Claim(
        "linear-are-cheapest",
        "§5.4",
        "Q1 and Q1sri are the cheapest of the integration-point elements.",
        _by_element,
        decide(
            lambda numbers: (
                max(1.0, row(numbers, "Q1sri over Q1")[0])
                < min(row(numbers, "Q2 over Q1")[0], row(numbers, "S2fri over Q1")[0])
            ),
            "on the same mesh both take less time than Q2 and S2fri",
            "on the same mesh Q2 or S2fri takes less time than one of them",
        ),
        quick=False,
        timed=True,
    ),
    Claim(
        "q1-preferred",
        "§5.4",
        "Q1 is to be preferred among the integration-point elements.",
        _same_error,
        decide(
            lambda numbers: min(values(numbers, "time")) > 0.95,
            "for the same error on the tapered bar none takes less time; bodies in the plane are compared on "
            "[the page on errors and times](../benchmarks/results/error_vs_runtime.md)",
            "for the same error on the tapered bar another takes less time; bodies in the plane are compared on "
            "[the page on errors and times](../benchmarks/results/error_vs_runtime.md)",
        ),
        quick=False,
        timed=True,
    ),
    Claim(
        "small-problems-cost-the-same",
        "§7",
        "Small problems take about the same time by both strategies.",
        _on_bars,
        decide(
            lambda numbers: (
                max(row(numbers, f"{nodal.name} over {local.name}")[0] for nodal, local in PAIRS) < ABOUT_THE_SAME
            ),
            lambda numbers: f"on the bar of 10 none takes 1.5 times as long as the other: {_told(numbers)}",
            lambda numbers: f"on the bar of 10 one takes 1.5 times as long as the other: {_told(numbers)}",
        ),
        quick=False,
        timed=True,
    ),
    Claim(
        "node-based-falls-behind-on-bars",
        "§7",
        "Node-based falls behind on refinement: bars.",
        _on_bars,
        decide(
            lambda numbers: _rises(numbers, NOISE),
            lambda numbers: f"the ratio rises from 10 to 100 elements: {_told(numbers)}",
            lambda numbers: f"the ratio does not rise from 10 to 100 elements: {_told(numbers)}",
        ),
        quick=False,
        timed=True,
    ),
    Claim(
        "node-based-behind-on-femurs",
        "§7",
        "Node-based takes longer on larger problems: femur.",
        _on_femurs,
        decide(
            lambda numbers: min(numbers.values()) > ABOUT_THE_SAME,
            lambda numbers: f"by more than 1.5 times on either mesh: {_told(numbers)}",
            lambda numbers: f"not by more than 1.5 times on either mesh: {_told(numbers)}",
        ),
        quick=False,
        timed=True,
    ),
    Claim(
        "node-based-falls-behind-on-femurs",
        "§7",
        "Node-based falls behind on refinement: femur.",
        _on_femurs,
        decide(
            lambda numbers: _rises(numbers, NOISE),
            lambda numbers: f"the ratio rises from 658 to 2632 elements: {_told(numbers)}",
            lambda numbers: (
                f"from 658 to 2632 elements not every ratio rises by more than a tenth, which times vary by: "
                f"{_told(numbers)}"
            ),
            OPEN,
        ),
        quick=False,
        timed=True,
    ),
)
