"""The page, from the CSV files of all tables."""

from __future__ import annotations

from pathlib import Path

from benchmarks.accuracy.paper_tables.bars import bar_table, compared, counts_table, read_bars
from benchmarks.accuracy.paper_tables.femur import femur_tables
from benchmarks.accuracy.paper_tables.inputs import input_tables
from benchmarks.accuracy.paper_tables.nearest import close_table, left_table, read_readings, rules_table
from benchmarks.accuracy.paper_tables.newton import newton_table, read_norms
from benchmarks.shared.reporting import RESULTS, Table

INTRODUCTION = """\
# The paper's tables and pictures, recomputed

Made by `python -m benchmarks.accuracy.paper_tables`. The numbers in full are in the CSV files beside this page.

One rule reads every bar: the density in the cell to the right of x = 0.5, at the point nearest to x = 0.5 in the
outermost row ("edge"), and the axial displacement of a corner of the loaded end. Beside it is the density of the same
cell and column nearest to the axis. `growthx bar` tells all three. *dofs* counts the unknowns of the global system,
*points* those at which the stress is evaluated, *densities* the values of density in all.

The elements (the paper's Figs. 1 and 4):

![Where each element has displacements, densities and integration points](elements.png)
"""
# Below each table.
COMMENTS = (
    "",
    """\
![The discontinuous bar](bar_discontinuous.png)

As in the paper's Figs. 2 and 5. Nodal densities overshoot at the steps of the stimulus; densities at integration points
or per cell do not. Q1P0 (driven by the cell's mean source) and Q1sri (by the source at the midpoint) differ in the end
displacement, as in the paper. Dofs and points are the paper's, but for the points of Q1P0: its table counts nine in a
cell, its text 2 × 2.
""",
    """\
![The tapered bar](bar_continuous.png)

As in Figs. 3 and 6. The kink is at mid-length, where the density is read: a reading half a cell away, or a mean over a
cell, is of first order there, and so is the deviation of the linear elements and of those that read a point beside it.
The edge has a corner there, too, and the stress around it is not quite uniaxial: Q2Q2, which reads the corner itself,
finds more than the section alone would have, and the more so the finer the mesh. The paper's Q2Q2 is on the axis at 10
and 40 elements, and on the edge at 100.
""",
    """\
All readings of all bars, by the same names for every element, are in `bar_readings.csv`. *Columns* of densities in a
cell are counted from mid-length, the *edge* is the outermost row and the *axis* the innermost (of two rows, or of one,
the same). A cell's densities are *extrapolated* by the bilinear function nearest to them, or by the polynomial through
all, to the cell's end nearer to mid-length; means of the right and the left cell are nodal averages there. A nearest
reading without = explains nothing, and one with it the less, the more readings (*of*) there were to choose from.
""",
    "",
    """\
No one reading is the paper's everywhere. Either cell beside mid-length serves about as well as the other.
""",
    """\
![Norms of the residual over iterations](newton.png)

Both strategies end quadratically, as the paper says of its consistent tangents: the density solved for beside the
displacement (Q1Q1), and eliminated at the integration points (Q1).
""",
    """\
Cells, dofs and points are those of the paper's Table 14. Node-based (Fig. 9, which has Q1P0 among them), as [ρ −
ρ*]/ρ*, with the scale of ρ beside it:

![The femur, node-based](femur_nodes.png)

Integration-point based (Fig. 10), raw: constant over the part of a cell that belongs to an integration point.

![The femur, integration-point based](femur_points.png)

The same extrapolated from the integration points to the corners of the cells and averaged there (Fig. 11; for the eye
alone: an extrapolated density may lie outside the range of those computed):

![The femur, smoothed](femur_smoothed.png)
""",
    """\
The paper's element in its Fig. 8.
""",
    """\
As by `growthx femur --refine 2` and `--refine 3`:

![The femur on finer meshes](femur_meshes.png)

With m = 0 (Remark 6.1, Fig. 12) the runs end by themselves. In their last good states cells have emptied while the
cortex goes on to grow; checkerboards are not to be seen yet. Between bounds the runs go on to a field of zeros, ones
and checkerboards: [the page on the remark](zero_one.md).

![The femur with m = 0 in its last good state](femur_collapse.png)
""",
    """\
The joint's force is distributed over 70° of the head's arc by a cosine, about the direction that it comes from; the
abductors' over their insertion by half a sine. The distal end is fixed, and the plane model is 30 mm thick: tractions
are forces over thickness. *average* is the sum of the forces with these weights, in one displacement field,
*superposed* their plain sum; with *stimulus* each load case has its own displacement under its full forces, and the
weights are those of their energies in the mean that drives the growth.

![The load cases at their full forces](femur_loads.png)

The load cases at their full forces (Fig. 7), on the femur that *stimulus* grows.
""",
    """\
With Q1P0; *chosen* is the average of the load cases on 30 mm, and each column changes one thing. The thickness scales
all tractions alike: the zones change by nearly the same share, and the pattern stays. How the cases combine, and which
there are, makes the pattern: gait alone has the strut and the dense calcar, and cases on their own have full weight.
""",
)


def tables(folder: Path = RESULTS) -> list[Table]:
    """All tables, from the CSV files of a folder."""
    bars, readings = read_bars(folder), read_readings(folder)
    numbers = compared(bars)
    return [
        counts_table(numbers),
        *(bar_table(problem, rows) for problem, rows in bars.items()),
        left_table(numbers, readings),
        close_table(numbers, readings),
        rules_table(readings),
        newton_table(read_norms(folder)),
        *femur_tables(folder),
        *input_tables(folder),
    ]


def page(folder: Path = RESULTS) -> str:
    """The page, from the CSV files of a folder."""
    parts = [
        text for table, comment in zip(tables(folder), COMMENTS, strict=True) for text in (table.markdown(), comment)
    ]
    return "\n".join([INTRODUCTION, *filter(None, parts)])
