"""The page, from the CSV files of all tables."""

from __future__ import annotations

from pathlib import Path

from benchmarks.accuracy.paper_tables.bars import Reading, bar_file, continuous_table, discontinuous_table
from benchmarks.accuracy.paper_tables.femur import FEMUR_TITLES, read_femur_table
from benchmarks.shared.reporting import RESULTS, Table, read_rows
from growthx.scenes.bar import CONTINUOUS, DISCONTINUOUS

INTRODUCTION = """\
# The paper's tables and pictures, recomputed

Made by `python -m benchmarks.accuracy.paper_tables`. The numbers in full are in the CSV files beside this page.

Readings: the density in the cell to the right of x = 0.5, at the point nearest to x = 0.5 in the outermost row; the
axial displacement of a corner of the loaded end. *dofs* counts the unknowns of the global system, *points* those at
which the stress is evaluated, *densities* the values of density in all.

What agrees: the end displacements of Q2Q2, S2Q1, Q2 and S2fri at all three meshes and of all eight elements at 40
elements, within one of the last printed digit; the densities of S2Q1 at all three, to the last printed digit. What does
not is marked with what we know of the reason. Q1P0 (driven by the cell's mean source) and Q1sri (by the source at the
midpoint) differ in the end displacement, as in the paper: 2.37122 and 2.37135 at 40 elements.
"""
# Below each table.
COMMENTS = (
    """\
![The discontinuous bar](bar_discontinuous.png)

Nodal densities overshoot at the steps of the stimulus; densities at integration points or per cell do not.

""",
    """\
![The tapered bar](bar_continuous.png)

The kink is at mid-length, where the density is read: a reading half a cell away, or a mean over a cell, is of first
order there, and so is the deviation of the linear elements and of those that read a point beside it. The edge has a
corner there, too, and the stress around it is not quite uniaxial: Q2Q2, which reads the corner itself, finds more than
the section alone would have, and the more so the finer the mesh.

""",
    """\
Raw densities: constant over the part of a cell that belongs to an integration point, or continuous where the density is
nodal.

![The femur, raw](femur_raw.png)

The same extrapolated from the integration points to the corners of the cells and averaged there (for the eye alone: an
extrapolated density may lie outside the range of those computed):

![The femur, smoothed](femur_smoothed.png)

""",
    """\
As by `growthx femur --refine 2` and `--refine 3`:

![The femur on finer meshes](femur_meshes.png)
""",
)


def tables(folder: Path = RESULTS) -> list[Table]:
    """All tables, from the CSV files of a folder."""
    bars = discontinuous_table, continuous_table
    return [
        *(
            table(read_rows(bar_file(problem, folder), Reading))
            for table, problem in zip(bars, (DISCONTINUOUS, CONTINUOUS), strict=True)
        ),
        *(read_femur_table(name, folder) for name in FEMUR_TITLES),
    ]


def page(folder: Path = RESULTS) -> str:
    """The page, from the CSV files of a folder."""
    parts = zip(tables(folder), COMMENTS, strict=True)
    return "\n".join([INTRODUCTION, *(text for table, comment in parts for text in (table.markdown(), comment))])
