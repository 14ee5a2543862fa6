"""One run of growthx, which answers as the peers' scripts do."""

from __future__ import annotations

import json
import time

import numpy as np

import growthx as gx
from growthx.scenes.plate import tip_displacement

PROBE = (0.05, 0.95)  # the mean density of the cell that holds it is compared


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
