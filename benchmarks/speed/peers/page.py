"""What is kept: ratios alone, as CSV and as a page."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from benchmarks.shared.command import write_page
from benchmarks.shared.reporting import RESULTS, Table, read_rows, write_rows
from benchmarks.speed.peers.codes import BODIES, OURS, PEERS, VARIANTS
from benchmarks.speed.peers.comparison import Row

CSV = RESULTS / "peers.csv"
INTRODUCTION = """\
# The plate and the block in other codes

Made by `python -m benchmarks.speed.peers` and, in space, `… --scene block`. NGSolve, felupe and scikit-fem solve the
same scene on the same mesh, with the same fixed time steps and to the same tolerance, each in its best configuration
found: on the plate PARDISO with one analysis, a factor in every Newton iteration; on the block conjugate gradients with
PARDISO's factor of an older tangent up to 15 000 unknowns, with smoothed aggregation (pyamg) beyond, kept as long as
they do; closed form of the density, static condensation where the code has it, generated C++ in NGSolve. All answers –
end displacement, density's extremes, of the plate the density of a cell, too – agree to 9 digits, or there would be no
table.

Times are those of the code over growthx', medians in one run on one thread, with the lowest and highest of the single
rounds: 4 says that growthx takes a quarter. *Whole* is set-up (mesh, spaces, supports, loads) and solving, *solving*
is without set-up; imports and compilation are left out of both, for all. *Set-up* is its share of the code's own whole,
*memory* that of the process at most, *factors* those that were made, of an iterative method its preconditioners.
Measured on two cores of a shared machine, one code after the other; rows of growthx 0.1.0 are of a program that was
slower than now.

"""


def table(rows: list[Row]) -> Table:
    """All codes and discretisations on one mesh."""
    cells = []
    for row in rows:
        whole, solving = (
            "1" if row.code == OURS else f"{ratio:.2f} ({low:.2f}–{high:.2f})"
            for ratio, low, high in (
                (row.whole, row.whole_low, row.whole_high),
                (row.solving, row.solving_low, row.solving_high),
            )
        )
        memory = f"{row.memory:.0f} MB" if row.memory == row.memory else ""
        counts = (memory, f"{row.iterations}", f"{row.factorisations}", f"{row.repeats}")
        cells.append([row.variant, f"{row.code} {row.version}", whole, solving, f"{row.setup:.1%}", *counts])
    header = ("", "code", "whole", "solving", "set-up", "memory", "iterations", "factors", "rounds")
    body = BODIES[rows[0].scene]
    return Table(f"The {body.name} of {body.cells.format(n=rows[0].n)}", header, cells)


def fastest(rows: list[Row]) -> str:
    """A sentence on the fastest of the others, for each discretisation."""
    parts = []
    for variant in VARIANTS:
        others = [row for row in rows if row.variant == variant and row.code != OURS]
        if others:
            first = min(others, key=lambda row: row.whole)
            parts.append(f"{variant} {first.whole:.1f} ({first.code})")
    return f"The fastest of the others takes, in units of growthx' whole time: {', '.join(parts)}."


def store(rows: Iterable[Row]) -> None:
    """Write all that has been measured, and the page."""
    order, codes, bodies = list(VARIANTS), [OURS, *PEERS], list(BODIES)
    rows = sorted(
        rows, key=lambda row: (bodies.index(row.scene), row.n, order.index(row.variant), codes.index(row.code))
    )
    write_rows(CSV, rows)
    write_page(RESULTS, "peers", page())


def page(folder: Path = RESULTS) -> str:
    """The page, from the CSV file of a folder."""
    rows = read_rows(folder / CSV.name, Row)
    meshes = [[row for row in rows if (row.scene, row.n) == each] for each in dict.fromkeys(map(mesh_of, rows))]
    return INTRODUCTION + "\n".join(f"{table(these).markdown()}{fastest(these)}\n" for these in meshes)


def mesh_of(row: Row) -> tuple[str, int]:
    """The scene and the cells over its height."""
    return row.scene, row.n
