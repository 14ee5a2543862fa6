"""The plate against NGSolve, felupe and scikit-fem: same mesh, same tolerance, same answers to 9 digits, in one run.

    ./run python benchmarks/peers.py --peers FOLDER --python PYTHON --n 128 --repeats 3

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
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterable
from dataclasses import astuple, dataclass, fields
from pathlib import Path
from statistics import median

import numpy as np
from mpi4py import MPI
from reporting import RESULTS, Table, progress, read_rows, write_rows

import growthx as gx
from growthx.scenes.plate import tip_displacement

CSV = RESULTS / "peers.csv"
OURS = "growthx"
VARIANTS = {"Q1": "ip-Q1", "Q1P0": "Q1P0", "Q1Q1": "Q1Q1"}  # and what the peers' scripts call them
DIGITS = 1e-9  # relative, to which all answers must agree
REHEARSAL = 8  # cells over the height
PROBE = (0.05, 0.95)  # the mean density of the cell that holds it is compared
SINGLE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
PACKAGES = ("ngsolve", "scikit-fem", "felupe", "numpy", "scipy", "pypardiso")
ASK_VERSIONS = (
    "import json; from importlib.metadata import version; import ngsolve, skfem, felupe, pypardiso; "
    f"print(json.dumps({{name: version(name) for name in {PACKAGES}}}))"
)


@dataclass(frozen=True)
class Peer:
    """Another code: its script, its package, and the discretisations it has."""

    script: str
    package: str
    variants: tuple[str, ...]


PEERS = {
    "NGSolve": Peer("peer_ngsolve.py", "ngsolve", ("Q1", "Q1P0", "Q1Q1")),
    "felupe": Peer("peer_felupe.py", "felupe", ("Q1", "Q1Q1")),
    "scikit-fem": Peer("peer_skfem.py", "scikit-fem", ("Q1", "Q1P0", "Q1Q1")),
}


@dataclass(frozen=True)
class Answers:
    """What must agree: u_y at the middle of the loaded end, mean density of the probed cell, density's extremes."""

    tip: float
    probe: float
    lowest: float
    highest: float


@dataclass(frozen=True)
class Run:
    """One run without its compilation: seconds of all of it and of its set-up, what Newton's method did, the answers.

    Set-up is mesh, spaces, supports and loads; the symbolic factorisation is part of solving in every code.
    """

    whole: float
    setup: float
    iterations: int
    factorisations: int
    answers: Answers

    @property
    def solving(self) -> float:
        """Seconds without set-up."""
        return self.whole - self.setup


@dataclass(frozen=True)
class Row:
    """A code on one mesh with one discretisation: its time over growthx' in the same run, and the counts.

    whole, solving: with and without set-up, the ratio of the medians; low and high: of the single rounds.
    setup: share of the whole.
    """

    n: int
    variant: str
    code: str
    version: str
    repeats: int
    whole: float
    whole_low: float
    whole_high: float
    solving: float
    solving_low: float
    solving_high: float
    setup: float
    iterations: int
    factorisations: int
    tip: float
    probe: float
    lowest: float
    highest: float


# -- running -----------------------------------------------------------------------------------------------------------


def run_ours(variant: str, n: int) -> None:
    """One run of growthx in this process; prints a line of JSON with the names that the peers' scripts use."""
    from petsc4py import PETSc

    PETSc.Log.begin()
    start = time.perf_counter()
    scene = gx.scenes.plate(n)
    meshing = time.perf_counter() - start
    result = gx.solve(scene, gx.variants.named(variant))
    setup = meshing + result.setup_s + result.compile_s
    factorisations = sum(PETSc.Log.Event(name).getPerfInfo()["count"] for name in ("MatLUFactorNum", "MatCholFctrNum"))
    line = {
        "wall_s": setup + result.solve_s,
        "setup_s": setup,
        "jit_s": result.compile_s,
        "newton_total": result.newton_iterations,
        "factorisations": factorisations,
        "results": {
            "u_tip": tip_displacement(result.problem),
            "rho_probe": probe_density(result, n),
            "rho_min": result.steps[-1].min_density,
            "rho_max": result.steps[-1].max_density,
        },
    }
    print(json.dumps(line))


def probe_density(result: gx.Result, n: int) -> float:
    """Mean density of the probed cell: over its quarters, each of which holds one of 2 × 2 integration points."""
    corner = np.floor(np.array(PROBE) * n + 1e-9)
    quarters = np.array([[0.25, 0.25], [0.75, 0.25], [0.25, 0.75], [0.75, 0.75]])
    return float(result.problem.sample_density((corner + quarters) / n).mean())


def run(code: str, variant: str, n: int, options: argparse.Namespace) -> Run:
    """One run of a code in a process of its own."""
    if code == OURS:
        command = [sys.executable, __file__, "--ours", variant, "--n", f"{n}"]
    else:
        script = options.peers / PEERS[code].script
        command = [options.python, f"{script}", "--scene", "plate", "--variant", VARIANTS[variant], "--n", f"{n}"]
        command += ["--threads", "1"]
    lines = output(command, f"{code} with {variant} and N = {n}").splitlines()
    return read(lines[-1] if lines else "", code)


def output(command: list[str], what: str) -> str:
    """What a program prints; GrowthxError with its last word if it fails or cannot be started."""
    environment = os.environ | SINGLE_THREAD
    if command[0] != sys.executable:
        environment.pop("PYTHONPATH", None)
    try:
        done = subprocess.run(command, env=environment, capture_output=True, text=True)
    except OSError as error:
        raise gx.InputError(
            f"{command[0]} does not start here ({error.strerror}): the Python of a virtual environment with "
            f"{', '.join(PACKAGES)} would be right, itself below the home folder, /opt or /tmp where ./run uses a tree"
        ) from error
    if done.returncode:
        said = (done.stderr.strip() or done.stdout.strip() or "nothing said").splitlines()[-1]
        raise gx.GrowthxError(f"{what} failed with exit status {done.returncode}: {said}")
    return done.stdout


def read(line: str, code: str) -> Run:
    """A run from its line of JSON."""
    try:
        found = json.loads(line)
        results = found["results"]
        return Run(
            whole=found["wall_s"] - found["jit_s"],
            setup=found["setup_s"] - found["jit_s"],
            iterations=found["newton_total"],
            factorisations=found.get("factorisations", found["newton_total"]),  # full Newton: one for each
            answers=Answers(*(float(results[name]) for name in ("u_tip", "rho_probe", "rho_min", "rho_max"))),
        )
    except (ValueError, KeyError, TypeError) as error:
        raise gx.GrowthxError(
            f"{code} did not end with the line of JSON that its script should print: {line[:60]!r}"
        ) from error


def versions(options: argparse.Namespace) -> dict[str, str]:
    """Version of each code; says what is missing before anything is run."""
    if not options.peers.is_dir():
        raise gx.InputError(f"there is no folder {options.peers}: the one with the peers' scripts would be right")
    for peer in PEERS.values():
        if not (options.peers / peer.script).is_file():
            raise gx.InputError(
                f"{options.peers} has no {peer.script}: the folder of the peers' scripts would be right"
            )
    found = json.loads(
        output([options.python, "-c", ASK_VERSIONS], f"importing {', '.join(PACKAGES)} by {options.python}")
    )
    return {OURS: gx.__version__, **{code: found[peer.package] for code, peer in PEERS.items()}}


# -- measuring ---------------------------------------------------------------------------------------------------------


def codes_with(variant: str) -> list[str]:
    """Growthx and the peers that have a discretisation."""
    return [OURS, *(code for code, peer in PEERS.items() if variant in peer.variants)]


def measure(variant: str, n: int, options: argparse.Namespace, begin: Callable[[str], None]) -> dict[str, list[Run]]:
    """The runs of each code with one discretisation, round by round, after a rehearsal."""
    runs: dict[str, list[Run]] = {code: [] for code in codes_with(variant)}
    rehearsed = {}
    for code in runs:
        begin(f"{variant}, rehearsal of {code}")
        rehearsed[code] = [run(code, variant, REHEARSAL, options)]
    require_agreement(rehearsed, variant, REHEARSAL)
    for turn in range(1, options.repeats + 1):
        for code, found in runs.items():
            begin(f"{variant}, round {turn} of {options.repeats}, {code}")
            found.append(run(code, variant, n, options))
    require_agreement(runs, variant, n)
    return runs


def require_agreement(runs: dict[str, list[Run]], variant: str, n: int) -> None:
    """Raise GrowthxError where an answer of a code is not that of the others."""
    for quantity in (field.name for field in fields(Answers)):
        found = {code: [getattr(each.answers, quantity) for each in these] for code, these in runs.items()}
        middle = median(values[0] for values in found.values())
        for code, values in found.items():
            worst = max(values, key=lambda value: abs(value - middle))
            if not abs(worst - middle) <= DIGITS * abs(middle):
                raise gx.GrowthxError(
                    f"{code} disagrees: with {variant} and N = {n} its '{quantity}' is {worst:.12g}, where the codes' "
                    f"median is {middle:.12g}"
                )


def compare(runs: dict[str, list[Run]], variant: str, n: int, version: dict[str, str]) -> list[Row]:
    """The codes' times over ours."""
    rows = []
    for code, found in runs.items():
        whole = ratios([each.whole for each in found], [each.whole for each in runs[OURS]])
        solving = ratios([each.solving for each in found], [each.solving for each in runs[OURS]])
        setup = round(median(each.setup for each in found) / median(each.whole for each in found), 4)
        last = found[-1]
        counts = last.iterations, last.factorisations
        answers = (float(f"{value:.12g}") for value in astuple(last.answers))
        rows.append(Row(n, variant, code, version[code], len(found), *whole, *solving, setup, *counts, *answers))
    return rows


def ratios(theirs: list[float], ours: list[float]) -> tuple[float, float, float]:
    """The ratio of the medians, and the lowest and highest of the rounds'."""
    rounds = [one / other for one, other in zip(theirs, ours, strict=True)]
    return round(median(theirs) / median(ours), 3), round(min(rounds), 3), round(max(rounds), 3)


def seconds_table(runs: dict[str, list[Run]], variant: str, n: int) -> Table:
    """Seconds, for the terminal."""
    rows = []
    for code, found in runs.items():
        whole = [each.whole for each in found]
        setup, solving = median(each.setup for each in found), median(each.solving for each in found)
        numbers = (median(whole), min(whole), max(whole), setup, solving)
        rows.append([code, *(f"{seconds:.2f}" for seconds in numbers)])
    header = ("", "whole (median)", "lowest", "highest", "set-up", "solving")
    return Table(f"{variant} on the plate of 2 x {n} x {n} cells: seconds without compilation", header, rows)


# -- what is kept ------------------------------------------------------------------------------------------------------

INTRODUCTION = """\
# The plate in other codes

Made by `python benchmarks/peers.py`. NGSolve, felupe and scikit-fem solve the same scene on the same mesh, with the
same fixed time steps and to the same tolerance, each in its best configuration found: PARDISO with one analysis, closed
form of the density, static condensation where the code has it, generated C++ in NGSolve. They refactorise in every
Newton iteration. All answers – end displacement, density of a cell, its extremes – agree to 9 digits, or there would be
no table.

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
    meshes = [[row for row in rows if row.n == n] for n in sorted({row.n for row in rows})]
    page = INTRODUCTION + "\n".join(f"{table(these).markdown()}{fastest(these)}\n" for these in meshes)
    (RESULTS / "peers.md").write_text(page, encoding="utf-8")


# -- the command -------------------------------------------------------------------------------------------------------


def parser() -> argparse.ArgumentParser:
    """The options."""
    found = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    found.add_argument("--peers", type=Path, metavar="FOLDER", help="folder of the peers' scripts")
    found.add_argument("--python", metavar="PYTHON", help="Python of the virtual environment with the peers' packages")
    found.add_argument("--n", type=int, default=128, help="cells over the height (128)")
    found.add_argument("--repeats", type=int, default=3, help="rounds (3)")
    found.add_argument("--variants", nargs="+", choices=VARIANTS, default=[*VARIANTS], help="discretisations (all)")
    found.add_argument("--again", action="store_true", help="measure anew what has been measured for this N")
    found.add_argument(
        "--ours", choices=VARIANTS, help="one run of growthx alone: prints a line of JSON as the peers do"
    )
    return found


def main() -> None:
    """Measure what is missing, one discretisation at a time, and keep each at once."""
    options = parser().parse_args()
    if options.ours:
        return run_ours(options.ours, options.n)
    if not (options.peers and options.python):
        raise gx.InputError(
            "the peers are missing: --peers FOLDER with their scripts and --python PYTHON would be right"
        )
    if MPI.COMM_WORLD.size > 1:
        raise gx.InputError(f"{MPI.COMM_WORLD.size} ranks would measure one another: one rank would be right")
    if options.n < 1 or options.repeats < 1:
        raise gx.InputError("--n and --repeats are counts: whole numbers from 1 would be right")
    version = versions(options)
    known = {(row.n, row.variant) for row in read_rows(CSV, Row)}
    wanted = [variant for variant in options.variants if options.again or (options.n, variant) not in known]
    jobs = sum(len(codes_with(variant)) * (1 + options.repeats) for variant in wanted)
    seconds = []
    with progress("the plate", jobs) as begin:
        for variant in wanted:
            runs = measure(variant, options.n, options, begin)
            seconds.append(seconds_table(runs, variant, options.n))
            kept = [row for row in read_rows(CSV, Row) if (row.n, row.variant) != (options.n, variant)]
            store(kept + compare(runs, variant, options.n, version))
    for each in seconds:
        each.show()
    table([row for row in read_rows(CSV, Row) if row.n == options.n]).show()


if __name__ == "__main__":
    raise SystemExit(gx.guarded(main))
