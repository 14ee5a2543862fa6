# %% [markdown]
# # A bar, against the paper
#
# Section 4.4 of the paper pulls a bar of length 1 whose attractor stimulus Ψ₀\* changes in steps along its length.
# Each piece grows until its stimulus meets the attractor, so the density in equilibrium is known, but for one
# equation that a root finder solves. That makes the bar the first thing to try.
#
# In the repository, `./run python docs/tutorials/bar.py` runs this page.

# %%
import growthx as gx
from growthx.scenes.bar import (
    DISCONTINUOUS,
    equilibrium,
    lower_edge,
    midpoint_density_change,
)

# %% [markdown]
# A scene is all of the problem but its discretisation: mesh, material, growth law, supports, loads, program.

# %%
bar = gx.scenes.bar(DISCONTINUOUS, elements=40)
print(bar.name, "with", bar.mesh.cell_count, "cells")
print(bar.material)
print(bar.program)

# %% [markdown]
# `gx.solve` runs it to its end, here by three discretisations: one density for each cell (Q1P0), one for each point
# of integration (Q1), and a continuous one (Q1Q1). The paper reads [ρ − ρ\*]/ρ\* at mid-length.

# %%
results = {}
for variant in (gx.Q1P0, gx.Q1, gx.Q1Q1):
    result = results[variant.name] = gx.solve(bar, variant)
    change = midpoint_density_change(result.problem)
    lowest = result.steps[-1].min_density
    print(f"{variant.name:5} at mid-length {change:.4f}, ρ from {lowest:.4f}")

# %% [markdown]
# The dashed line of the picture is the density in equilibrium.


# %%
def exact(x):
    return equilibrium(bar, DISCONTINUOUS, x).density


gx.plots.along_length(
    results,
    "bar.png",
    lower_edge(DISCONTINUOUS, 200),
    exact={"in equilibrium": exact},
)

# %% [markdown]
# ![Density over the length of the bar, by three discretisations and in equilibrium](bar.png)
#
# Densities of cells and points follow each step; the continuous one overshoots beside it, as the paper says. The
# clamped end, on the left, cannot contract, which the equation of the dashed line leaves out. [The paper, statement
# by statement](../docs/paper.md) has each of its claims with its numbers, and [the
# tables](../benchmarks/results/paper_tables.md) what agrees to which digit.
#
# **Vary it.** `gx.scenes.bar("continuous")` is the tapered bar of section 5.4; `elements=10` is the paper's coarse
# mesh; `growthx bar --elements 10 --variant Q1` does the same on the command line.

# %%
for result in results.values():
    assert 0.29 < midpoint_density_change(result.problem) < 0.31
