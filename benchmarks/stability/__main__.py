"""Numerical stability: which exponents, histories, time steps, loads, cells and units the discretisations survive.

    ./run python -m benchmarks.stability [--parts exponents uniqueness …] [--again]

Bar, plate and femur with every discretisation of quadrilaterals.  Parts:

    exponents       m and n: the end of the march, checkerboards, resorbed shares, what the mesh changes
    uniqueness      the equilibrium from random densities and under other histories of load
    time_steps      implicit and explicit Euler with Δt from 10⁻³ to 10⁶
    explicit_limit  the longest stable explicit step, found by bisection and by the linearised problem
    extremes        loads, stretches, compression, incompressibility, contrasts of density, distorted cells
    units           the same in N, mm, MPa and in SI
    collapse        the paper's Remark 6.1: the femur with m = 0
    strains         from finite strains to far below those of bone, also on simplices and in space

Every case is kept as soon as it is done, and not run again (--again begins anew).  Leaves stability.md, stability.png,
stability_strains.png and stability_*.csv in benchmarks/results; takes about twenty minutes, and some more for compiling
the first time.
"""

from __future__ import annotations

import argparse
import logging
import time

import growthx as gx
from benchmarks.shared import command
from benchmarks.stability import page, picture, strains


def parser() -> argparse.ArgumentParser:
    """The options."""
    found = command.parser("benchmarks.stability", __doc__)
    names = [part.name for part in page.PARTS]
    found.add_argument("--parts", nargs="*", choices=names, default=names, help="what to run (all)")
    found.add_argument("--again", action="store_true", help="run also what is known")
    command.add_out(found)
    return found


def main() -> None:
    """Run what is missing, and write the page and the picture."""
    options = parser().parse_args()
    command.require_one_rank("would write the same rows")
    logging.getLogger("growthx").setLevel(logging.ERROR)  # that m ≤ n is ill-posed is what is shown here
    for part in page.PARTS:
        if part.name in options.parts:
            start = time.perf_counter()
            part.complete(options.out, options.again)
            print(f"{part.name}: {time.perf_counter() - start:.0f} s")
    page.write_meshes(options.out)
    command.write_page(options.out, "stability", page.page(options.out))
    results = page.Results.read(options.out)
    picture.draw(results, options.out / "stability.png")
    strains.draw(results.strains, options.out / "stability_strains.png")


if __name__ == "__main__":
    raise SystemExit(gx.guarded(main))
