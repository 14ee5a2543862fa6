# %% [markdown]
# # Long runs with checkpoints
#
# Machines go down, queues have limits, and somebody closes the lid. This page kills a run in its middle, goes on with
# it, and shows that the result is the same to the last bit as if nothing had happened.

# %%
import csv
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import growthx as gx

# %% [markdown]
# ## A script that may be started again
#
# `checkpoint=5` keeps the state in the folder `out`, at the start and after every five steps; of these files the last
# two are kept. `resume="out"` goes on from the last one in a folder. So one script serves both for the first start and
# for all others.

# %%
SCRIPT = """
from pathlib import Path
import growthx as gx

scene = gx.scenes.plate(24)
started = any(Path("out").glob("checkpoint-*.npz"))
result = gx.solve(scene, gx.Q1P0, out="out", checkpoint=5, frames=5, resume="out" if started else None)
print("went on from a checkpoint" if started else "from the beginning", "to t =", result.time)
"""
folder = tempfile.TemporaryDirectory()
for name in ("undisturbed", "killed"):
    (Path(folder.name) / name).mkdir()
    (Path(folder.name) / name / "run.py").write_text(SCRIPT, encoding="utf-8")


def start(name):
    """Start the script in its folder."""
    return subprocess.Popen([sys.executable, "run.py"], cwd=Path(folder.name) / name, stdout=subprocess.PIPE, text=True)


print(start("undisturbed").communicate()[0])

# %% [markdown]
# ## Killed
#
# The second run is killed by SIGKILL, which no program hears, as soon as it has left the checkpoint after ten steps.

# %%
run = start("killed")
out = Path(folder.name) / "killed" / "out"
while not (out / "checkpoint-000010.npz").exists() and run.poll() is None:
    time.sleep(0.001)
os.kill(run.pid, signal.SIGKILL)
print("exit status", run.wait())
print(*sorted(path.name for path in out.iterdir() if path.suffix in (".csv", ".npz", ".pvd", ".zip")), sep="\n")
killed_at = len((out / "history.csv").read_text(encoding="utf-8").splitlines()) - 1
print("steps in the history:", killed_at)

# %% [markdown]
# All that is there is whole: the history up to the last step, states for ParaView up to that moment. What is missing is
# `density.zip`, the density at the end.
#
# ## Gone on with

# %%
print(start("killed").communicate()[0])

# %% [markdown]
# ## Equal?
#
# Beyond a checkpoint's step all is computed anew. History and density must be those of the run that nobody has
# disturbed, in every bit; only seconds and megabytes differ.


# %%
def history(name):
    """The rows of a history as they are written, without what they cost."""
    with (Path(folder.name) / name / "out" / "history.csv").open(encoding="utf-8") as file:
        return [
            {key: row[key] for key in row if key not in ("wall_s", "peak_memory_mb")} for row in csv.DictReader(file)
        ]


one, two = history("undisturbed"), history("killed")
print(len(one), "steps of", len(one[0]), "columns, equal:", one == two)
assert one == two and killed_at < len(one)

# %% [markdown]
# `density.zip` is a zip of NumPy arrays, the density of all cells among them.

# %%
ends = [np.load(Path(folder.name) / name / "out" / "density.zip") for name in ("undisturbed", "killed")]
for array in ends[0].files:
    assert np.array_equal(ends[0][array], ends[1][array]), array
print("equal to the last bit:", *ends[0].files)

# %% [markdown]
# `frames=5` has left five states and the start, as if nothing had happened: `growthx movie out` draws them.

# %%
gx.plots.movie(Path(folder.name) / "killed" / "out", "killed.gif")
folder.cleanup()

# %% [markdown]
# ![The plate as it grows](killed.gif)
#
# ## What else there is
#
# - Ctrl-C, and the SIGTERM of a scheduler, let a step end and save the state; then the exit status is 130 or 143, and
#   `resume` goes on from there. mpirun forwards SIGUSR1 to its ranks, which does the same.
# - A run may go on to a later end, `until=` of a scene or `--until` on the command line; on another number of ranks it
#   is equal but for round-off.
# - A checkpoint is one of *this* run: with another mesh, law or variant it is refused. To begin another run where one
#   has ended there is `gx.transfer(gx.read_density("out"), mesh, variant)`.
#
# **Vary it.** The same on the command line: `growthx plate --out out --checkpoint 5`, then `growthx plate --out out
# --checkpoint 5 --resume`; `--until 5` goes on beyond its end. [When a run meets trouble](../docs/robustness.md) tells
# what a run does about steps that fail.
