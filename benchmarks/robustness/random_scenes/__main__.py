"""Random scenes in the plane and in space, each made from its number: does each end with a right solution or a reason?

    python -m benchmarks.robustness.random_scenes [--first 0] [--count 1000] [--folder FOLDER] [--workers 1]

Bodies of a few cells with slivers, contrasts of stiffness and density over orders of magnitude, loads over six decades,
exponents, set points, dead zones, bounds, load cases, flux, and all discretisations.  Each solution is checked by an
assembly of its own in NumPy.  Rows are appended to scenes.csv in FOLDER and added at the end to those that are kept
with the page, in random_scenes of its folder; numbers that are in either are not run again.  Each worker is a process
of its own, and a scene that crashes it, or takes longer than --limit seconds, is counted.
--only NUMBER runs one scene here and tells all of it; --again runs those that have failed once more, --these NUMBERS
some of any outcome; --add runs none, and adds what is in FOLDER, also of a run that still goes on.

Leaves random_scenes.md, random_scenes*.csv and random_scenes/*.csv.xz in benchmarks/results, from all rows kept there.
"""

from __future__ import annotations

import argparse
import logging
from collections import Counter
from dataclasses import asdict
from pathlib import Path

import growthx as gx
from benchmarks.robustness.random_scenes import kept, page, running, scenes, storing, working
from benchmarks.shared import command
from benchmarks.shared.reporting import progress


def parser() -> argparse.ArgumentParser:
    """The options."""
    found = command.parser("benchmarks.robustness.random_scenes", __doc__)
    found.add_argument("--first", type=int, default=0, help="number of the first scene (%(default)s)")
    found.add_argument("--count", type=int, default=1000, help="how many (%(default)s)")
    found.add_argument("--folder", type=Path, default=Path("random-scenes"), help="for their rows (%(default)s)")
    found.add_argument("--workers", type=int, default=1, help="processes (%(default)s)")
    found.add_argument("--limit", type=float, default=300.0, help="seconds for one scene (%(default)g)")
    found.add_argument("--only", type=int, help="one scene, here, with all that is known of it")
    found.add_argument("--again", action="store_true", help="run what has failed once more")
    found.add_argument("--these", type=int, nargs="+", default=[], metavar="NUMBER", help="run these once more")
    found.add_argument("--add", action="store_true", help="run nothing: keep the rows of FOLDER, write the page")
    command.add_out(found)
    return found


def tell(seed: int) -> None:
    """Run one scene, and print what it is and what came of it."""
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    each = scenes.trial(seed)
    print(each.scene)
    print(f"  variant: {each.variant.name}\n  recipe: {each.recipe}\n  steps: {each.stepping}")
    print(f"  tolerance: {each.tolerance:g}{', full Newton' if each.full_newton else ''}")
    for name, value in asdict(running.run(seed)).items():
        print(f"  {name}: {value}")


def run(options: argparse.Namespace) -> None:
    """Run what is missing."""
    done = {row.seed: row.outcome for row in [*kept.read(options.out), *storing.read(options.folder)]}
    seeds = [seed for seed in range(options.first, options.first + options.count) if seed not in done]
    if options.again:
        seeds = [seed for seed, outcome in done.items() if outcome in running.FAILURES] + seeds
    seeds = options.these or seeds
    rows, counter = storing.Appending(options.folder), Counter[str]()
    with progress("Random scenes", len(seeds)) as begin:
        for row in working.rows(seeds, options.workers, options.limit, options.folder / "said.log"):
            rows.add(row)
            counter[row.outcome] += 1
            begin(", ".join(f"{count} {outcome}" for outcome, count in counter.most_common()))
    rows.close()


def main() -> None:
    """Run what is missing, and write the page."""
    options = parser().parse_args()
    command.require_one_rank("would run the same scenes")
    command.require_counts(count=options.count, workers=options.workers)
    if options.only is not None:
        tell(options.only)
        return
    if not options.add:
        run(options)
    kept.add(options.out, storing.read(options.folder))
    storing.summarise(kept.read(options.out), options.out)
    command.write_page(options.out, "random_scenes", page.page(options.out))


if __name__ == "__main__":
    raise SystemExit(gx.guarded(main))
