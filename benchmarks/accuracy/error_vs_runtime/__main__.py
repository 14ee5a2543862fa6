"""Error against run time: all discretisations of quadrilaterals on several meshes, with fixed and adaptive time steps.

    ./run python -m benchmarks.accuracy.error_vs_runtime [--scenes bar plate femur] [--again]

Two studies.  The first runs bar, plate and femur with every discretisation, mesh and way through time, and measures the
final state against an over-resolved one: which choices lie on the Pareto front of error and time?  The second keeps
mesh and discretisation, measures the error of time integration alone and compares adaptive steps with the paper's
scheme at equal error.  Rows of the CSV files are not run again; every group of runs is kept as soon as it is done.
`--quick` is a rehearsal on coarse meshes and wants a folder of its own, `--out`.

Times are those of solving, without set-up and compilation, as ratios to a run of the same scene measured in turn with
them; the seconds of that run are on the terminal.  Leaves error_vs_runtime.md, .png, .csv, _references.csv and
_stepping.csv in benchmarks/results.
"""

from __future__ import annotations

import argparse

import growthx as gx
from benchmarks.accuracy.error_vs_runtime.cases import CASES, PLANS, QUICK, QUICK_CASES
from benchmarks.accuracy.error_vs_runtime.error_in_time import stepping_study
from benchmarks.accuracy.error_vs_runtime.page import page
from benchmarks.accuracy.error_vs_runtime.picture import draw
from benchmarks.accuracy.error_vs_runtime.whole_error import ROWS, Row, error_study
from benchmarks.shared import command
from benchmarks.shared.reporting import RESULTS, read_rows


def parser() -> argparse.ArgumentParser:
    """The options."""
    found = command.parser("benchmarks.accuracy.error_vs_runtime", __doc__)
    names = [plan.name for plan in PLANS]
    found.add_argument("--scenes", nargs="*", choices=names, default=names, help="of the first study (all)")
    found.add_argument("--repeats", type=int, default=3, help="rounds (3)")
    found.add_argument("--again", action="store_true", help="run also what is known")
    found.add_argument("--quick", action="store_true", help="a rehearsal on coarse meshes; wants --out")
    command.add_out(found)
    return found


def main() -> None:
    """Run what is missing, and write the page."""
    options = parser().parse_args()
    command.require_one_rank("would measure one another")
    command.require_counts(repeats=options.repeats)
    if options.quick and options.out == RESULTS:
        raise gx.InputError("a rehearsal would mix with the results: a folder of its own, --out FOLDER, would be right")
    plans, cases = (QUICK, QUICK_CASES) if options.quick else (PLANS, CASES)
    error_study([plan for plan in plans if plan.name in options.scenes], options.out, options.again, options.repeats)
    stepping_study(cases, options.out, options.again, options.repeats)
    command.write_page(options.out, "error_vs_runtime", page(options.out, plans, cases))
    if rows := read_rows(options.out / ROWS, Row):
        draw(plans, rows, options.out / "error_vs_runtime.png")


if __name__ == "__main__":
    raise SystemExit(gx.guarded(main))
