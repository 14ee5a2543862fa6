"""NGSolve, felupe and scikit-fem beside growthx: same mesh, same tolerance, same answers to 9 digits, in one run.

    ./run python -m benchmarks.speed.peers --peers FOLDER --python PYTHON --n 128 --repeats 3
    ./run python -m benchmarks.speed.peers --peers FOLDER --python PYTHON --scene block --n 14

FOLDER holds the scripts peer_ngsolve.py, peer_felupe.py and peer_skfem.py, which are measuring tools and no part of
growthx; PYTHON is that of a virtual environment with their packages.  It is started beside growthx, hence inside
Docker or the Debian tree where ./run uses one: there, an environment starts whose own Python is somewhere under the
home folder, /opt or /tmp (pyenv, uv, conda), but not one made by the host's /usr/bin/python3.

Every run is a process of its own on one thread.  In each round all codes run one after the other, so that what else
happens on the machine meets all of them; a small rehearsal before shows what fails, and warms the caches.  Compilation
and imports are left out.  One discretisation is measured at a time and then kept: a second call with the same N goes on
where the first was stopped (--again measures anew).  Leaves peers.csv and peers.md in benchmarks/results, with ratios
alone; the seconds are on the terminal.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import growthx as gx
from benchmarks.shared import command
from benchmarks.shared.reporting import progress, read_rows
from benchmarks.speed.peers.codes import BODIES, VARIANTS, codes_with, versions
from benchmarks.speed.peers.comparison import Row, compare, measure, seconds_table
from benchmarks.speed.peers.ours import run_ours
from benchmarks.speed.peers.page import CSV, mesh_of, store, table


def parser() -> argparse.ArgumentParser:
    """The options."""
    found = command.parser("benchmarks.speed.peers", __doc__)
    found.add_argument("--peers", type=Path, metavar="FOLDER", help="folder of the peers' scripts")
    found.add_argument("--python", metavar="PYTHON", help="Python of the virtual environment with the peers' packages")
    found.add_argument("--scene", choices=BODIES, default="plate", help="plate, or block in space (plate)")
    found.add_argument("--n", type=int, help="cells over the height (plate 128, block 8)")
    found.add_argument("--repeats", type=int, default=3, help="rounds (3)")
    found.add_argument("--variants", nargs="+", choices=VARIANTS, help="discretisations (all of the scene)")
    found.add_argument("--again", action="store_true", help="measure anew what has been measured for this N")
    found.add_argument(
        "--ours", choices=VARIANTS, help="one run of growthx alone: prints a line of JSON as the peers do"
    )
    return found


def main() -> None:
    """Measure what is missing, one discretisation at a time, and keep each at once."""
    options = parser().parse_args()
    body = BODIES[options.scene]
    n = body.sizes[0] if options.n is None else options.n
    if options.ours:
        return run_ours(body, options.ours, n)
    if not (options.peers and options.python):
        raise gx.InputError(
            "the peers are missing: --peers FOLDER with their scripts and --python PYTHON would be right"
        )
    command.require_one_rank("would measure one another")
    command.require_counts(n=n, repeats=options.repeats)
    asked = options.variants or body.variants
    if strange := set(asked) - set(body.variants):
        raise gx.InputError(f"the {body.name} is not compared with {strange.pop()}: {', '.join(body.variants)} are")
    version = versions(options)
    known = {(*mesh_of(row), row.variant) for row in read_rows(CSV, Row)}
    wanted = [variant for variant in asked if options.again or (body.name, n, variant) not in known]
    jobs = sum(len(codes_with(variant)) * (1 + options.repeats) for variant in wanted)
    seconds = []
    with progress(f"the {body.name}", jobs) as begin:
        for variant in wanted:
            runs = measure(body, variant, n, options, begin)
            seconds.append(seconds_table(runs, body, variant, n))
            kept = [row for row in read_rows(CSV, Row) if (*mesh_of(row), row.variant) != (body.name, n, variant)]
            store(kept + compare(runs, body, variant, n, version))
    for each in seconds:
        each.show()
    table([row for row in read_rows(CSV, Row) if mesh_of(row) == (body.name, n)]).show()


if __name__ == "__main__":
    raise SystemExit(gx.guarded(main))
