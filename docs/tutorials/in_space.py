# %% [markdown]
# # Three dimensions, and many cores
#
# A body in space needs nothing that a plane one does not: another mesh, and vectors of three. What it needs more of is
# time, and cores. This page grows a block in space, looks inside, and runs the same script on two cores.

# %%
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

import growthx as gx

# %% [markdown]
# ## A scene in space
#
# `block` is the plate of the other pages in space: clamped on the left, loaded downwards on the right. Its cells are
# hexahedra, with the same names of discretisations as quadrilaterals; tetrahedra have those of triangles, `gx.P1P0` and
# its kin.

# %%
block = gx.scenes.block(6)
print(block)

# %%
result = gx.solve(block, gx.Q1P0)
last = result.steps[-1]
print(f"mass {last.mass:.6f}, ρ from {last.min_density:.3f} to {last.max_density:.3f}")

# %% [markdown]
# ## Looking inside
#
# A picture of a body in space shows its outside, and a slice; `gx.plots.slices` takes planes by a point and a normal.
# The normal points to you.

# %%
planes = [((1.0, 0.5, 0.5), (0.0, 0.0, 1.0)), ((0.25, 0.5, 0.5), (1.0, 0.0, 0.0))]
gx.plots.slices(result, "block.png", planes)

# %% [markdown]
# ![Two slices through the block: along it, and across it near the clamped end](block.png)
#
# Bone stays above and below, where bending strains it most (left and right in the second slice), and goes in between.
#
# ## On two cores
#
# In parallel there is nothing to be changed either: `mpirun -n 2 python script.py` starts the script twice, and each of
# the two **ranks** owns a part of the mesh. Three things are good to know:
#
# - all ranks must make the same calls of growthx, since each waits for the others: no `if rank == 0:` around them;
# - what a scene tells of the whole body (masses, steps, files) is the same on all ranks; arrays such as
#   `problem.density.x.array` are those of the rank's own part;
# - `print` is called on each rank: `gx.report.say(result, text)` says it once.

# %%
SCRIPT = """
import json
import growthx as gx

result = gx.solve(gx.scenes.block(6), gx.Q1P0)
problem = result.problem
told = {"ranks": problem.comm.size, "cells": problem.comm.gather(len(problem.scene.mesh.owned_cells))}
if problem.comm.rank == 0:
    told |= {"mass": result.steps[-1].mass, "highest": result.steps[-1].max_density}
    print(json.dumps(told))
"""


def run(ranks):
    """What the script prints on so many ranks."""
    with tempfile.TemporaryDirectory() as folder:
        script = Path(folder) / "script.py"
        script.write_text(SCRIPT, encoding="utf-8")
        command = ["mpirun", "-n", str(ranks), sys.executable, str(script)]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


both = run(2)
print(both)

# %% [markdown]
# The mass is that of one core, but for round-off: sums in another order.

# %%
print(f"difference {both['mass'] / last.mass - 1:.1e}")
assert both["ranks"] == 2 and sum(both["cells"]) == block.mesh.cell_count
assert abs(both["mass"] / last.mass - 1) < 1e-10
assert abs(both["highest"] / last.max_density - 1) < 1e-8
assert np.isclose(last.mass, result.problem.mass(), rtol=1e-12)

# %% [markdown]
# How many cores pay? A rank should have some ten thousand unknowns; with less, they mostly wait for one another.
# Threads beside ranks do harm: growthx sets `OMP_NUM_THREADS=1` where you have set nothing.
#
# **Vary it.** `mpirun -n 4 growthx femur3d --size 6 --out femur` is the femur in space on four cores: [a femur in
# space](../docs/femur3d.md) tells of its loads and zones. Solvers change by themselves with the size, see [what makes
# growthx fast](../docs/speed.md).
