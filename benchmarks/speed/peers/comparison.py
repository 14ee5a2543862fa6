"""The codes side by side: rounds in turn, answers that must agree, and times over ours."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from dataclasses import dataclass
from statistics import median

import growthx as gx
from benchmarks.shared.reporting import Table
from benchmarks.speed.peers.codes import OURS, Body, Run, codes_with, run

ANSWERS = ("u_tip", "rho_probe", "rho_min", "rho_max")
DIGITS = 1e-9  # relative, to which all answers must agree


@dataclass(frozen=True)
class Row:
    """A code on one mesh with one discretisation: its time over growthx' in the same run, and the counts.

    whole, solving: with and without set-up, the ratio of the medians; low and high: of the single rounds.
    setup: share of the whole.  memory: MB of the process.  probe: NaN where no cell is probed.
    """

    scene: str
    n: int
    variant: str
    code: str
    version: str
    repeats: int
    whole: float
    whole_low: float
    whole_high: float
    solving: float
    solving_low: float
    solving_high: float
    setup: float
    memory: float
    iterations: int
    factorisations: int
    tip: float
    probe: float
    lowest: float
    highest: float


def measure(
    body: Body, variant: str, n: int, options: argparse.Namespace, begin: Callable[[str], None]
) -> dict[str, list[Run]]:
    """The runs of each code with one discretisation, round by round, after a rehearsal."""
    runs: dict[str, list[Run]] = {code: [] for code in codes_with(variant)}
    rehearsed = {}
    for code in runs:
        begin(f"{variant}, rehearsal of {code}")
        rehearsed[code] = [run(code, body, variant, body.rehearsal, options)]
    require_agreement(rehearsed, body, variant, body.rehearsal)
    for turn in range(1, options.repeats + 1):
        for code, found in runs.items():
            begin(f"{variant}, round {turn} of {options.repeats}, {code}")
            found.append(run(code, body, variant, n, options))
    require_agreement(runs, body, variant, n)
    return runs


def require_agreement(runs: dict[str, list[Run]], body: Body, variant: str, n: int) -> None:
    """Raise GrowthxError where an answer of a code is not that of the others."""
    for quantity in body.answers:
        found = {code: [each.answers[quantity] for each in these] for code, these in runs.items()}
        middle = median(values[0] for values in found.values())
        for code, values in found.items():
            worst = max(values, key=lambda value: abs(value - middle))
            if not abs(worst - middle) <= DIGITS * abs(middle):
                raise gx.GrowthxError(
                    f"{code} disagrees: with {variant} on the {body.name} and N = {n} its '{quantity}' is "
                    f"{worst:.12g}, where the codes' median is {middle:.12g}"
                )


def compare(runs: dict[str, list[Run]], body: Body, variant: str, n: int, version: dict[str, str]) -> list[Row]:
    """The codes' times over ours."""
    rows = []
    for code, found in runs.items():
        whole = ratios([each.whole for each in found], [each.whole for each in runs[OURS]])
        solving = ratios([each.solving for each in found], [each.solving for each in runs[OURS]])
        setup = round(median(each.setup for each in found) / median(each.whole for each in found), 4)
        last, memory = found[-1], max(each.memory for each in found)
        answers = (float(f"{last.answers.get(name, math.nan):.12g}") for name in ANSWERS)
        shares = *whole, *solving, setup, memory
        rows.append(
            Row(
                body.name,
                n,
                variant,
                code,
                version[code],
                len(found),
                *shares,
                last.iterations,
                last.factorisations,
                *answers,
            )
        )
    return rows


def ratios(theirs: list[float], ours: list[float]) -> tuple[float, float, float]:
    """The ratio of the medians, and the lowest and highest of the rounds'."""
    rounds = [one / other for one, other in zip(theirs, ours, strict=True)]
    return round(median(theirs) / median(ours), 3), round(min(rounds), 3), round(max(rounds), 3)


def seconds_table(runs: dict[str, list[Run]], body: Body, variant: str, n: int) -> Table:
    """Seconds, for the terminal."""
    rows = []
    for code, found in runs.items():
        whole = [each.whole for each in found]
        rest = (median(getattr(each, name) for each in found) for name in ("setup", "solving", "compilation"))
        numbers = (median(whole), min(whole), max(whole), *rest)
        rows.append([code, *(f"{seconds:.2f}" for seconds in numbers)])
    header = ("", "whole (median)", "lowest", "highest", "set-up", "solving", "compilation beside")
    return Table(f"{variant} on the {body.name} of {body.cells.format(n=n)}: seconds", header, rows)
