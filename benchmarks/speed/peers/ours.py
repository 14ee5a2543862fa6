"""One run of growthx, which answers as the peers' scripts do."""

from __future__ import annotations

import json
import resource
import time

import numpy as np

import growthx as gx
from benchmarks.speed.peers.codes import Body
from growthx.scenes.plate import tip_displacement

PROBE = (0.05, 0.95)  # the mean density of the cell that holds it is compared


def run_ours(body: Body, variant: str, n: int) -> None:
    """One run of growthx in this process; prints a line of JSON with the names that the peers' scripts use."""
    start = time.perf_counter()
    scene = getattr(gx.scenes, body.name)(n, **({"shape": "tetrahedron"} if variant.startswith("P") else {}))
    meshing = time.perf_counter() - start
    result = gx.solve(scene, gx.variants.named(variant))
    setup, last = meshing + result.setup_s + result.compile_s, result.steps[-1]
    found = {"u_tip": tip_displacement(result.problem), "rho_min": last.min_density, "rho_max": last.max_density}
    line = {
        "wall_s": setup + result.solve_s,
        "setup_s": setup,
        "jit_s": result.compile_s,
        "peak_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
        "newton_total": result.newton_iterations,
        "factorisations": sum(step.newton.factorisations for step in result.steps),
        "results": found | ({"rho_probe": probe_density(result, n)} if "rho_probe" in body.answers else {}),
    }
    print(json.dumps(line))


def probe_density(result: gx.Result, n: int) -> float:
    """Mean density of the probed cell: over its quarters, each of which holds one of 2 × 2 integration points."""
    corner = np.floor(np.array(PROBE) * n + 1e-9)
    quarters = np.array([[0.25, 0.25], [0.75, 0.25], [0.25, 0.75], [0.75, 0.75]])
    return float(result.problem.sample_density((corner + quarters) / n).mean())
