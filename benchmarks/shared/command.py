"""What the benchmarks' command lines have in common."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from mpi4py import MPI

import growthx as gx
from benchmarks.shared.reporting import RESULTS


def parser(module: str, doc: str) -> argparse.ArgumentParser:
    """Of a benchmark that is run as a module, described by the first line of its docstring."""
    return argparse.ArgumentParser(prog=f"python -m {module}", description=doc.partition("\n")[0], allow_abbrev=False)


def add_out(found: argparse.ArgumentParser) -> None:
    """An option for another folder than that of the pages."""
    found.add_argument("--out", type=Path, default=RESULTS, help="folder for the results (default: %(default)s)")


def program(module: str) -> list[str]:
    """The words that run a benchmark in a process of its own; it begins where this one did."""
    return [sys.executable, "-m", module]


def require_one_rank(why: str) -> None:
    """Raise InputError on more; why: what several of them would do."""
    if MPI.COMM_WORLD.size > 1:
        raise gx.InputError(f"{MPI.COMM_WORLD.size} ranks {why}: one rank would be right")


def require_counts(**counts: int) -> None:
    """Raise InputError unless all options of these names are whole numbers from 1."""
    if min(counts.values()) < 1:
        words = " and ".join(f"--{name}" for name in counts)
        told = "is a count: a whole number" if len(counts) == 1 else "are counts: whole numbers"
        raise gx.InputError(f"{words} {told} from 1 would be right")


def write_page(folder: Path, name: str, text: str) -> None:
    """Leave a page, on rank 0."""
    if MPI.COMM_WORLD.rank == 0:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / f"{name}.md").write_text(text, encoding="utf-8")
