"""The paper's tables and pictures beside ours: both bars and the femur, in all eight discretisations.

    python -m benchmarks.accuracy.paper_tables

Prints tables and leaves them as CSV and Markdown, with pictures, in benchmarks/results.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from mpi4py import MPI

import growthx as gx
from benchmarks.accuracy.paper_tables.bars import ELEMENTS, VARIANTS, Reading, bar_file, draw_bars, reading
from benchmarks.accuracy.paper_tables.femur import FEMUR_TITLES, REFINEMENTS, femur_problem, femur_table
from benchmarks.accuracy.paper_tables.page import page, tables
from benchmarks.shared import command
from benchmarks.shared.reporting import RESULTS, progress, write_csv, write_rows
from growthx import plots
from growthx.scenes.bar import PROBLEMS

if TYPE_CHECKING:
    from growthx.discretisation.discretisation import Discretisation

COMM = MPI.COMM_WORLD


def bars(begin: Callable[[str], None]) -> dict[str, list[Reading]]:
    """Readings of both bars, by the names of their problems."""
    found: dict[str, list[Reading]] = {problem.name: [] for problem in PROBLEMS.values()}
    for problem in PROBLEMS.values():
        for variant in VARIANTS:
            for elements in ELEMENTS:
                begin(f"{variant.name}, {elements} elements, {problem.name}")
                found[problem.name].append(reading(problem, elements, variant))
    return found


def femurs(begin: Callable[[str], None]) -> tuple[dict[str, Discretisation], dict[str, Discretisation]]:
    """The femur in all discretisations, and on all meshes."""
    by_variant, by_mesh = {}, {}
    for variant in VARIANTS:
        begin(f"{variant.name}, femur")
        by_variant[variant.name] = femur_problem(variant)
    for refine, cells in REFINEMENTS.items():
        begin(f"Q1P0, femur of {cells} cells")
        by_mesh[f"{cells} cells"] = femur_problem(gx.Q1P0, refine)
    return by_variant, by_mesh


def draw(by_variant: dict[str, Discretisation], by_mesh: dict[str, Discretisation]) -> None:
    """All pictures of the page."""
    for problem in PROBLEMS.values():
        draw_bars(problem, RESULTS / f"bar_{problem.name}.png")
    local = {name: problem for name, problem in by_variant.items() if problem.variant.density.local}
    unit = "density (g/cm³)"
    plots.densities(by_variant, RESULTS / "femur_raw.png", title=unit)
    plots.densities(local, RESULTS / "femur_smoothed.png", title=unit, smoothed=True, columns=5)
    plots.densities(by_mesh, RESULTS / "femur_meshes.png", title=unit)


def main() -> None:
    """Run everything, print the tables, write them and draw."""
    command.parser("benchmarks.accuracy.paper_tables", __doc__).parse_args()
    runs = len(PROBLEMS) * len(VARIANTS) * len(ELEMENTS) + len(VARIANTS) + len(REFINEMENTS)
    with progress("the paper's tables", runs) as begin:
        readings = bars(begin)
        by_variant, by_mesh = femurs(begin)
    comparisons = femur_table(by_variant, "Q1P0"), femur_table(by_mesh, f"{REFINEMENTS[1]} cells")
    if COMM.rank == 0:
        for problem in PROBLEMS.values():
            write_rows(bar_file(problem, RESULTS), readings[problem.name])
        for name, (header, rows) in zip(FEMUR_TITLES, comparisons, strict=True):
            write_csv(RESULTS / f"{name}.csv", header, rows)
    COMM.barrier()
    for table in tables():
        table.show()
    command.write_page(RESULTS, "paper_tables", page())
    draw(by_variant, by_mesh)


if __name__ == "__main__":
    raise SystemExit(gx.guarded(main))
