"""The codes, and one run of each in a process of its own."""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from dataclasses import dataclass

import growthx as gx
from benchmarks.shared.command import program

OURS = "growthx"
VARIANTS = {"Q1": "ip-Q1", "Q1P0": "Q1P0", "Q1Q1": "Q1Q1", "P1P0": "P1P0"}  # and what the peers' scripts call them
SINGLE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
PACKAGES = ("ngsolve", "scikit-fem", "felupe", "numpy", "scipy", "pypardiso", "pyamg")
ASK_VERSIONS = (
    "import json; from importlib.metadata import version; import ngsolve, skfem, felupe, pypardiso, pyamg; "
    f"print(json.dumps({{name: version(name) for name in {PACKAGES}}}))"
)


@dataclass(frozen=True)
class Body:
    """A scene that all codes have.

    cells: in words, with {n} over the height.  rehearsal: a small number of them.  sizes: those of the page.
    variants: discretisations that are compared.  answers: what must agree.
    """

    name: str
    cells: str
    rehearsal: int
    sizes: tuple[int, ...]
    variants: tuple[str, ...]
    answers: tuple[str, ...]


EXTREMES = ("rho_min", "rho_max")
BODIES = {
    body.name: body
    for body in (
        Body("plate", "2 x {n} x {n} cells", 8, (128,), ("Q1", "Q1P0", "Q1Q1"), ("u_tip", "rho_probe", *EXTREMES)),
        Body("block", "2 x {n} x {n} x {n} cells", 2, (8, 14, 26), ("Q1", "Q1P0", "P1P0"), ("u_tip", *EXTREMES)),
    )
}


@dataclass(frozen=True)
class Peer:
    """Another code: its script, its package, and the discretisations it has."""

    script: str
    package: str
    variants: tuple[str, ...]


PEERS = {
    "NGSolve": Peer("peer_ngsolve.py", "ngsolve", ("Q1", "Q1P0", "Q1Q1", "P1P0")),
    "felupe": Peer("peer_felupe.py", "felupe", ("Q1", "Q1Q1", "P1P0")),
    "scikit-fem": Peer("peer_skfem.py", "scikit-fem", ("Q1", "Q1P0", "Q1Q1", "P1P0")),
}


@dataclass(frozen=True)
class Run:
    """One run without its compilation: seconds of all of it and of its set-up, what Newton's method did, the answers.

    Set-up is mesh, spaces, supports and loads; the symbolic factorisation is part of solving in every code.
    compilation: seconds that it took beside, little where it was cached.  memory: MB of the process at most.
    answers: u_y at the middle of the loaded end, mean density of a cell (of the plate), density's extremes.
    """

    whole: float
    setup: float
    compilation: float
    memory: float
    iterations: int
    factorisations: int
    answers: dict[str, float]

    @property
    def solving(self) -> float:
        """Seconds without set-up."""
        return self.whole - self.setup


def codes_with(variant: str) -> list[str]:
    """Growthx and the peers that have a discretisation."""
    return [OURS, *(code for code, peer in PEERS.items() if variant in peer.variants)]


# -- running -----------------------------------------------------------------------------------------------------------


def run(code: str, body: Body, variant: str, n: int, options: argparse.Namespace) -> Run:
    """One run of a code in a process of its own."""
    if code == OURS:
        command = [*program("benchmarks.speed.peers"), "--ours", variant, "--scene", body.name, "--n", f"{n}"]
    else:
        script = options.peers / PEERS[code].script
        command = [options.python, f"{script}", "--scene", body.name, "--variant", VARIANTS[variant], "--n", f"{n}"]
        command += ["--threads", "1"]
    lines = output(command, f"{code} with {variant} on the {body.name} and N = {n}").splitlines()
    return read(lines[-1] if lines else "", code, body)


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


def read(line: str, code: str, body: Body) -> Run:
    """A run from its line of JSON."""
    try:
        found = json.loads(line)
        results = found["results"]
        return Run(
            whole=found["wall_s"] - found["jit_s"],
            setup=max(found["setup_s"] - found["jit_s"], 0.0),
            compilation=found["jit_s"],
            memory=found["peak_mb"],
            iterations=found["newton_total"],
            factorisations=found.get("factorisations", found["newton_total"]),  # full Newton: one for each
            answers={name: float(results[name]) for name in body.answers},
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
