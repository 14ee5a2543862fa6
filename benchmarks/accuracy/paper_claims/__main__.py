"""The paper's statements, each measured anew: numbers, and whether it is confirmed, refuted or open.

python -m benchmarks.accuracy.paper_claims NAME …   some of them
python -m benchmarks.accuracy.paper_claims --list   their names
python -m benchmarks.accuracy.paper_claims --all    all of them, and docs/paper.md with paper_claims.csv
"""

from __future__ import annotations

import logging
import sys

import growthx as gx
from benchmarks.accuracy.paper_claims.claim import Claim
from benchmarks.accuracy.paper_claims.page import CLAIMS, MODULE, PAGE, named, page, write_numbers
from benchmarks.shared import command
from benchmarks.shared.reporting import progress


def show(claim: Claim, numbers: dict[str, float]) -> None:
    """Print a statement, its numbers and the verdict."""
    word, why = claim.verdict(numbers)
    print(f"{claim.name} ({claim.place}): {claim.statement}")
    for label, value in numbers.items():
        print(f"  {label}: {value:.6g}")
    print(f"  {word}: {why}")


def main() -> None:
    """Measure what is asked for."""
    parser = command.parser(MODULE, __doc__ or "")
    parser.add_argument("names", nargs="*", metavar="NAME", help="statements to be measured")
    parser.add_argument("--list", action="store_true", help="print the names of all")
    parser.add_argument("--all", action="store_true", help="measure all, and write the page")
    options = parser.parse_args()
    command.require_one_rank("would measure each the same")
    logging.getLogger("growthx").setLevel(logging.ERROR)  # models that are not well posed are a part of it
    chosen = CLAIMS if options.all else [named(name) for name in options.names]
    for name, claim in zip(options.names, chosen, strict=False):
        if claim is None:
            raise gx.InputError(f"there is no statement '{name}': one of those that --list prints would be right")
    if not chosen or options.list:
        print("\n".join(f"{claim.name}: {claim.statement}" for claim in CLAIMS))
        return
    found = {}
    with progress("statements", len(chosen)) as begin:
        for claim in filter(None, chosen):
            begin(claim.name)
            found[claim.name] = claim.measure()
            show(claim, found[claim.name])
            sys.stdout.flush()
    if options.all:
        write_numbers(found)
        PAGE.write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    raise SystemExit(gx.guarded(main))
