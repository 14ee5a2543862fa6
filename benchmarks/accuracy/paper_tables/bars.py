"""Both bars in all discretisations: the numbers of the paper's tables beside ours, and how many of them agree."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import growthx as gx
from benchmarks.accuracy.paper_tables.paper import CLOSER, DIGITS, ELEMENTS, VARIANTS, closely, papers, to_print
from benchmarks.shared.reporting import RESULTS, Table, read_rows
from growthx import scenes
from growthx.scenes.bar import (
    CONTINUOUS,
    PROBLEMS,
    Problem,
    end_displacement,
    equilibrium,
    midpoint_axis_density_change,
    midpoint_density_change,
)

if TYPE_CHECKING:
    from growthx.discretisation.discretisation import Discretisation

TITLES = {"discontinuous": "Discontinuous bar", "continuous": "Tapered bar"}


@dataclass(frozen=True)
class Reading:
    """What the paper's tables tell of a bar; the density on the axis, too."""

    variant: str
    elements: int
    dofs: int
    points: int
    density_change: float
    axis_density_change: float
    end_displacement: float

    def number(self, quantity: str) -> float:
        """By our rule: "density" or "displacement"."""
        return self.density_change if quantity == "density" else self.end_displacement


@dataclass(frozen=True)
class Compared:
    """A number of the paper's beside ours."""

    problem: str
    variant: str
    elements: int
    quantity: str
    ours: float
    paper: float

    @property
    def to_print(self) -> bool:
        """Whether both are the same in print, but for one unit of the last digit."""
        return to_print(self.ours, self.paper, self.quantity)

    @property
    def closely(self) -> bool:
        """Whether both are the same but for the paper's tolerance."""
        return self.to_print or closely(self.ours, self.paper)


@cache
def bar_problem(problem: Problem, elements: int, variant: gx.Variant) -> Discretisation:
    """A bar at the end of its run."""
    return gx.solve(scenes.bar(problem, elements), variant).problem


def bars(begin: Callable[[str], None]) -> dict[str, list[Reading]]:
    """Readings of both bars, by the names of their problems."""
    found: dict[str, list[Reading]] = {name: [] for name in PROBLEMS}
    for name, problem in PROBLEMS.items():
        for variant in VARIANTS:
            for elements in ELEMENTS:
                begin(f"{variant.name}, {elements} elements, {name}")
                found[name].append(_reading(bar_problem(problem, elements, variant), elements))
    return found


def _reading(done: Discretisation, elements: int) -> Reading:
    return Reading(
        done.variant.name,
        elements,
        done.dofs,
        done.points,
        midpoint_density_change(done),
        midpoint_axis_density_change(done),
        end_displacement(done),
    )


def bar_file(problem: str, folder: Path) -> Path:
    """Where the numbers of a bar are, in full."""
    return folder / f"bar_{problem}.csv"


def read_bars(folder: Path = RESULTS) -> dict[str, list[Reading]]:
    """Of both problems, from their files."""
    return {name: read_rows(bar_file(name, folder), Reading) for name in PROBLEMS}


def compared(readings: dict[str, list[Reading]]) -> list[Compared]:
    """All numbers that the paper prints of its bars."""
    return [
        Compared(
            problem,
            r.variant,
            r.elements,
            quantity,
            r.number(quantity),
            papers(problem, r.variant, r.elements, quantity),
        )
        for problem, rows in readings.items()
        for r in rows
        for quantity in DIGITS
    ]


def counts_table(numbers: Sequence[Compared]) -> Table:
    """How many numbers agree, by problem and quantity."""
    rows = []
    groups = [(problem, quantity) for problem in PROBLEMS for quantity in DIGITS]
    for problem, quantity in groups:
        group = [each for each in numbers if (each.problem, each.quantity) == (problem, quantity)]
        rows.append([f"{TITLES[problem]}, {quantity}", *_counts(group)])
    rows.append(["all", *_counts(numbers)])
    return Table(
        "How many numbers agree",
        ("", "numbers", "to the last printed digit", CLOSER, "left"),
        rows,
        [
            "*To the last printed digit*: ours, rounded as the paper's, differs by one unit of that digit at most "
            "(density 10⁻⁶, displacement 10⁻⁵).",
            f"*{CLOSER.capitalize()}*: those, and what differs by no more than the paper's own tolerance may leave.",
        ],
    )


def _counts(numbers: Sequence[Compared]) -> list[str]:
    close = sum(each.closely for each in numbers)
    return [f"{len(numbers)}", f"{sum(each.to_print for each in numbers)}", f"{close}", f"{len(numbers) - close}"]


def bar_table(problem: str, readings: Sequence[Reading]) -> Table:
    """Ours beside the paper's, with deviations and what they are in print."""
    rows = []
    for r in readings:
        density, displacement = (papers(problem, r.variant, r.elements, quantity) for quantity in DIGITS)
        rows.append(
            [
                *(r.variant, f"{r.elements}", f"{r.dofs}", f"{r.points}"),
                *(f"{r.density_change:.6f}", f"{r.axis_density_change:.6f}", f"{density:.6f}"),
                _apart(r.density_change, density, "density"),
                *(f"{r.end_displacement:.5f}", f"{displacement:.5f}"),
                _apart(r.end_displacement, displacement, "displacement"),
            ]
        )
    header = ("", "elements", "dofs", "points", "density change", "on the axis", "paper", "apart")
    return Table(
        f"{TITLES[problem]}: density change at mid-length and end displacement at t = 6",
        (*header, "end displacement", "paper", "apart"),
        rows,
        _notes(problem),
    )


def _apart(ours: float, paper: float, quantity: str) -> str:
    """Ours less the paper's; = where they agree to the last printed digit."""
    return "=" if to_print(ours, paper, quantity) else f"{ours - paper:+.1e}"


def _notes(problem: str) -> list[str]:
    notes = ["*apart*: density change less the paper's; = to the last printed digit."]
    if problem == CONTINUOUS.name:
        scene = scenes.bar(CONTINUOUS, 10)
        exact = equilibrium(scene, CONTINUOUS, 0.5).density / scene.material.reference_density - 1
        notes.append(f"The narrowest section alone, under uniform uniaxial stress, would have {exact:.6f}.")
    return notes
