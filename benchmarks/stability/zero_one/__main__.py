"""The paper's Remark 6.1: the femur with m = 0, to a field of zeros and ones, and what mesh and time step make of it.

    python -m benchmarks.stability.zero_one [--again]

Every case is kept as soon as it is done, and not run again (--again begins anew).  Leaves zero_one.md, zero_one.png,
zero_one_*.png, zero_one_history.csv and stability_zero_one.csv in benchmarks/results.
"""

from __future__ import annotations

import logging

import growthx as gx
from benchmarks.shared import command
from benchmarks.shared.reporting import write_rows
from benchmarks.stability.zero_one.page import MODELS, draw_femurs, draw_history, history_file, page
from benchmarks.stability.zero_one.runs import PART, STEP, VARIANTS, Case, marched


def main() -> None:
    """Run what is missing, and write the page and the pictures."""
    parser = command.parser("benchmarks.stability.zero_one", __doc__)
    parser.add_argument("--again", action="store_true", help="run also what is known")
    command.add_out(parser)
    options = parser.parse_args()
    command.require_one_rank("would write the same rows")
    logging.getLogger("growthx").setLevel(logging.ERROR)  # that m ≤ n is ill-posed is what is shown here
    PART.complete(options.out, options.again)
    moments, problems = [], {}
    for name, (m, bounded, _) in MODELS.items():
        found = {variant: marched(Case(variant, m, bounded, 1, STEP)) for variant in VARIANTS}
        moments += [moment for _, history in found.values() for moment in history]
        problems[name] = {variant: done.problem for variant, (done, _) in found.items()}
    write_rows(history_file(options.out), moments)
    draw_history(options.out)
    draw_femurs(problems, options.out)
    command.write_page(options.out, "zero_one", page(options.out))


if __name__ == "__main__":
    raise SystemExit(gx.guarded(main))
