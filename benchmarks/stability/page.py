"""The page on stability, from the CSV files of all parts."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from benchmarks.shared.reporting import RESULTS, item, read_rows, write_rows
from benchmarks.stability import collapse, exponents, extremes, strains, time_steps, uniqueness, units
from benchmarks.stability.findings.exponents import about_exponents, exponents_table, variants_table
from benchmarks.stability.findings.extremes import (
    about_extremes,
    locking_table,
    lost_table,
    shapes_table,
    survival_table,
)
from benchmarks.stability.findings.scales import (
    about_collapse,
    about_strains,
    about_units,
    collapse_table,
    strains_table,
)
from benchmarks.stability.findings.time_steps import about_time_steps, limits_table, steps_table
from benchmarks.stability.findings.uniqueness import about_uniqueness, uniqueness_table
from benchmarks.stability.study import BODIES, Part

PARTS: tuple[Part, ...] = (
    exponents.PART,
    uniqueness.PART,
    time_steps.PART,
    time_steps.LIMIT,
    extremes.PART,
    units.PART,
    collapse.PART,
    strains.PART,
)
MESHES = "stability_meshes.csv"


@dataclass(frozen=True)
class Results:
    """All rows that there are."""

    exponents: list[exponents.Row]
    uniqueness: list[uniqueness.Row]
    time_steps: list[time_steps.Row]
    limits: list[time_steps.LimitRow]
    extremes: list[extremes.Row]
    units: list[units.Row]
    collapse: list[collapse.Row]
    strains: list[strains.Row]

    @classmethod
    def read(cls, folder: Path) -> Results:
        """From the CSV files."""
        return cls(*(part.rows(folder) for part in PARTS))


INTRODUCTION = """\
# Numerical stability

Made by `python -m benchmarks.stability` on one rank; the rows are in `stability_*.csv`. The paper's claim is that a
well-posed model, m > n, integrated by implicit steps is stable in every discretisation, and that the instabilities of
the literature come from the continuous model. Bar, plate and femur, of {cells} cells and, where meshes are
compared, with every cell in four; all discretisations of quadrilaterals. No density is bounded, averaged or smoothed
unless said so.

![The map](stability.png)

Above: high-frequency part of the checkerboard index over exponents and discretisations; a cross is a march that did not
come to its end, the frame is m > n. Middle: densities. Below: steps, the explicit limit, locking.

*Checkerboard index*: mean jump of density between neighbours over the mean of the two. Its *high-frequency part*, the
noise, is what a linear function of position around each neighbour does not explain. Densities at points enter as means
of their cell; patterns inside cells are not seen.

![Small strains](stability_strains.png)

From the finite strains of the paper to far below those of bone (grey): Newton iterations, the largest density, and what
is left of the digits of the energy.

## What the numbers say

"""


@dataclass(frozen=True)
class MeshRow:
    """How many cells a body's coarse mesh has, which versions of gmsh do not agree on."""

    body: str
    cells: int


def write_meshes(folder: Path) -> None:
    """The cells of all bodies, as a CSV file."""
    write_rows(folder / MESHES, [MeshRow(body.name, body.scene(1).mesh.cell_count) for body in BODIES.values()])


def page(folder: Path = RESULTS) -> str:
    """The page, from the CSV files of a folder."""
    results = Results.read(folder)
    sentences = [
        *about_exponents(results.exponents),
        *about_uniqueness(results.uniqueness),
        *about_time_steps(results.time_steps, results.limits),
        *about_extremes(results.extremes),
        *about_units(results.units),
        *about_collapse(results.collapse),
        *about_strains(results.strains),
    ]
    tables = [
        (results.exponents, exponents_table),
        (results.exponents, variants_table),
        (results.uniqueness, uniqueness_table),
        (results.time_steps, steps_table),
        (results.limits, limits_table),
        (results.extremes, survival_table),
        (results.extremes, lost_table),
        (results.extremes, locking_table),
        (results.extremes, shapes_table),
        (results.collapse, collapse_table),
        (results.strains, strains_table),
    ]
    made = [table(rows).markdown() for rows, table in tables if rows]
    *first, last = (row.cells for row in read_rows(folder / MESHES, MeshRow))
    introduction = INTRODUCTION.format(cells=f"{', '.join(map(str, first))} and {last}")
    return introduction + "\n".join(map(item, sentences)) + "\n\n" + "\n".join(made)
