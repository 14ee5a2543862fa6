"""Observed orders of convergence in h and Δt of every discretisation on every shape of cells, next to theory.

    python -m benchmarks.accuracy.convergence [--coarse]
    mpirun -n 2 python -m benchmarks.accuracy.convergence

In h: the manufactured solution of `manufactured.py`.  In Δt: a block in homogeneous tension, whose density solves an
ordinary differential equation.  Prints tables and leaves convergence.csv and .md, with pictures, in benchmarks/results.
"""

from __future__ import annotations

import growthx as gx
from benchmarks.accuracy.convergence.page import tables, write
from benchmarks.accuracy.convergence.study import study
from benchmarks.shared import command


def main() -> None:
    """Run the study."""
    parser = command.parser("benchmarks.accuracy.convergence", __doc__)
    parser.add_argument("--coarse", action="store_true", help="leave out the finest meshes and time steps")
    command.add_out(parser)
    options = parser.parse_args()
    curves = study(options.coarse)
    for table in tables(curves):
        table.show()
    write(curves, options.out)


if __name__ == "__main__":
    raise SystemExit(gx.guarded(main))
