"""How fast this machine is: its BLAS, and a run of about two seconds whose result and time are known."""

from __future__ import annotations

import os
import time
from dataclasses import dataclass

CELLS = 48  # over the height of the plate
RUNS = 3  # of which the fastest counts
# Known from one core of an AMD EPYC server, otherwise idle, with OpenBLAS on one thread.
MASS = 1.3262969710
SECONDS = 0.34  # of the solver
BLAS_GFLOPS = 61.0  # product of two matrices of 1000 rows, in double precision
SIZE = 1000
SLOW = 2.0  # so many times as slow is worth a remark


@dataclass(frozen=True)
class Speed:
    """What was measured: GFLOPS of one core, seconds of the solver, and the run's numbers."""

    gflops: float
    solve_s: float
    mass: float

    @property
    def right(self) -> bool:
        """Whether the run came out as known, to the digits that do not depend on the machine."""
        return abs(self.mass / MASS - 1) < 1e-7


def cores() -> int:
    """How many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def blas() -> float:
    """GFLOPS of the BLAS behind numpy, best of three."""
    import numpy as np

    matrix = np.full((SIZE, SIZE), 0.5)
    times = []
    for _ in range(3):
        begin = time.perf_counter()
        matrix @ matrix
        times.append(time.perf_counter() - begin)
    return 2e-9 * SIZE**3 / min(times)


def measure() -> Speed:
    """Solve the plate, on all ranks (collective)."""
    from growthx.discretisation.variants import Q1P0
    from growthx.run import solve
    from growthx.scenes.plate import plate

    solve(plate(4), Q1P0)  # compiles what is not in the cache
    results = [solve(plate(CELLS), Q1P0) for _ in range(RUNS)]
    return Speed(blas(), min(result.solve_s for result in results), results[0].problem.mass())
