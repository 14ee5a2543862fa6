"""The paper's tables and pictures beside ours: both bars and the femur, in all eight discretisations.

    python -m benchmarks.accuracy.paper_tables

Prints tables and leaves them as CSV and Markdown, with pictures, in benchmarks/results.
"""

from __future__ import annotations

from mpi4py import MPI

import growthx as gx
from benchmarks.accuracy.paper_tables.bars import bar_file, bars
from benchmarks.accuracy.paper_tables.femur import REFINED, REFINEMENTS, run_femurs
from benchmarks.accuracy.paper_tables.inputs import choices, run_inputs
from benchmarks.accuracy.paper_tables.nearest import all_readings, readings_file
from benchmarks.accuracy.paper_tables.newton import RUNS, newton_file, norms
from benchmarks.accuracy.paper_tables.page import page, tables
from benchmarks.accuracy.paper_tables.paper import ELEMENTS, VARIANTS
from benchmarks.accuracy.paper_tables.pictures import draw
from benchmarks.shared import command
from benchmarks.shared.reporting import RESULTS, progress, write_rows
from growthx.scenes.bar import PROBLEMS

COMM = MPI.COMM_WORLD


def main() -> None:
    """Run everything, print the tables, write them and draw."""
    command.parser("benchmarks.accuracy.paper_tables", __doc__).parse_args()
    runs = len(PROBLEMS) * (len(VARIANTS) * len(ELEMENTS) + 1) + RUNS
    runs += len(VARIANTS) + len(REFINED) * len(REFINEMENTS) + len(choices())
    with progress("the paper's tables", runs) as begin:
        files = {bar_file(problem, RESULTS): readings for problem, readings in bars(begin).items()}
        files[readings_file(RESULTS)] = all_readings(begin)
        files[newton_file(RESULTS)] = norms(begin)
        run_femurs(begin)
        run_inputs(begin)
    if COMM.rank == 0:
        for file, rows in files.items():
            write_rows(file, rows)
    COMM.barrier()
    for table in tables():
        table.show()
    command.write_page(RESULTS, "paper_tables", page())
    draw()


if __name__ == "__main__":
    raise SystemExit(gx.guarded(main))
