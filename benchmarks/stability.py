"""Numerical stability: which exponents, histories, time steps, loads, cells and units the discretisations survive.

    ./run python benchmarks/stability.py [--parts exponents uniqueness …] [--again]

Bar, plate and femur with every discretisation of quadrilaterals.  Parts:

    exponents       m and n: the end of the march, checkerboards, resorbed shares, what the mesh changes
    uniqueness      the equilibrium from random densities and under other histories of load
    time_steps      implicit and explicit Euler with Δt from 10⁻³ to 10⁶
    explicit_limit  the longest stable explicit step, found by bisection and by the linearised problem
    extremes        loads, stretches, compression, incompressibility, contrasts of density, distorted cells
    units           the same in N, mm, MPa and in SI
    collapse        the paper's Remark 6.1: the femur with m = 0

Every case is kept as soon as it is done, and not run again (--again begins anew).  Leaves stability.md, stability.png
and stability_*.csv in benchmarks/results; takes about twenty minutes, and some more for compiling the first time.
"""

from __future__ import annotations

import argparse
import logging
import time
from pathlib import Path

import stability_page
import stability_picture
from mpi4py import MPI
from reporting import RESULTS

import growthx as gx


def parser() -> argparse.ArgumentParser:
    """The options."""
    found = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    names = [part.name for part in stability_page.PARTS]
    found.add_argument("--parts", nargs="*", choices=names, default=names, help="what to run (all)")
    found.add_argument("--again", action="store_true", help="run also what is known")
    found.add_argument("--out", type=Path, default=RESULTS, help="folder for the results (default: %(default)s)")
    return found


def main() -> None:
    """Run what is missing, and write the page and the picture."""
    options = parser().parse_args()
    if MPI.COMM_WORLD.size > 1:
        raise gx.InputError(f"{MPI.COMM_WORLD.size} ranks would write the same rows: one rank would be right")
    logging.getLogger("growthx").setLevel(logging.ERROR)  # that m ≤ n is ill-posed is what is shown here
    for part in stability_page.PARTS:
        if part.name in options.parts:
            start = time.perf_counter()
            part.complete(options.out, options.again)
            print(f"{part.name}: {time.perf_counter() - start:.0f} s")
    results = stability_page.Results.read(options.out)
    stability_page.write(results, options.out / "stability.md")
    stability_picture.draw(results, options.out / "stability.png")


if __name__ == "__main__":
    raise SystemExit(gx.guarded(main))
