"""What is kept: ratios alone, as CSV and as a page."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from benchmarks.shared.command import write_page
from benchmarks.shared.reporting import RESULTS, Table, read_rows, write_rows
from benchmarks.speed.peers.codes import OURS, PEERS, VARIANTS
from benchmarks.speed.peers.comparison import Row

CSV = RESULTS / "peers.csv"
INTRODUCTION = """\
# The plate in other codes

Made by `python -m benchmarks.speed.peers`. NGSolve, felupe and scikit-fem solve the same scene on the same mesh, with
the same fixed time steps and to the same tolerance, each in its best configuration found: PARDISO with one analysis,
closed form of the density, static condensation where the code has it, generated C++ in NGSolve. They refactorise in
every Newton iteration. All answers – end displacement, density of a cell, its extremes – agree to 9 digits, or there
would be no table.

Times are those of the code over growthx', medians in one run on one thread, with the lowest and highest of the single
rounds: 4 says that growthx takes a quarter. *Whole* is set-up (mesh, spaces, supports, loads) and solving, *solving*
is without set-up; imports and compilation are left out of both, for all. *Set-up* is its share of the code's own whole.

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
        counts = (f"{row.iterations}", f"{row.factorisations}", f"{row.repeats}")
        cells.append([row.variant, f"{row.code} {row.version}", whole, solving, f"{row.setup:.1%}", *counts])
    header = ("", "code", "whole", "solving", "set-up", "iterations", "factorisations", "rounds")
    return Table(f"2 x {rows[0].n} x {rows[0].n} cells", header, cells)


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
    order = list(VARIANTS)
    codes = [OURS, *PEERS]
    rows = sorted(rows, key=lambda row: (row.n, order.index(row.variant), codes.index(row.code)))
    write_rows(CSV, rows)
    write_page(RESULTS, "peers", page())


def page(folder: Path = RESULTS) -> str:
    """The page, from the CSV file of a folder."""
    rows = read_rows(folder / CSV.name, Row)
    meshes = [[row for row in rows if row.n == n] for n in sorted({row.n for row in rows})]
    return INTRODUCTION + "\n".join(f"{table(these).markdown()}{fastest(these)}\n" for these in meshes)
