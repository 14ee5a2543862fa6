# %% [markdown]
# # Your own mesh and load cases
#
# Bone that carries two loads in turn becomes another one than bone that carries their sum. This page makes a mesh
# from arrays, names its boundaries, and lets two load cases act on it.

# %%
import numpy as np

import growthx as gx

# %% [markdown]
# ## A mesh
#
# Arrays will do: nodes, and the nodes of each cell, here a column of 12 × 24 quadrilaterals. In their place may be a
# file, `gx.meshing.read("mine.msh")`: [meshes](../docs/meshes.md) has the formats, and `growthx mesh mine.msh` tells
# what a file holds before a script is written.

# %%
columns, rows = 12, 24
across = np.linspace(0.0, 1.0, columns + 1)
along = np.linspace(0.0, 2.0, rows + 1)
x, y = np.meshgrid(across, along)
points = np.column_stack([x.ravel(), y.ravel()])
first = np.add.outer(np.arange(rows) * (columns + 1), np.arange(columns)).ravel()
above = first + columns + 1
cells = np.column_stack([first, first + 1, above + 1, above])
mesh = gx.meshing.from_arrays(points, cells)

# %% [markdown]
# Boundaries have names. A file brings its own; others are told by a function of position, which is asked for the
# corners of the sides.

# %%
mesh = mesh.named(
    {
        "foot": lambda x: np.isclose(x[1], 0.0),
        "left half": lambda x: np.isclose(x[1], 2.0) & (x[0] < 0.51),
        "right half": lambda x: np.isclose(x[1], 2.0) & (x[0] > 0.49),
    }
)

# %% [markdown]
# ## Load cases
#
# Each case has its displacement; the density grows by the mean of their energies, weighted by daily cycles. Loads are
# in the units of Young's modulus.

# %%
left = gx.DistributedForce("left half", (0.01, -0.03))
right = gx.DistributedForce("right half", (-0.01, -0.03))


def column(loads=(), cases=()):
    """The column under loads, which act together, or under load cases; a scene may have either, or both."""
    return gx.Scene(
        name="column",
        mesh=mesh,
        material=gx.Material(young=1.0, poisson=0.3),
        growth=gx.EnergyDrivenGrowth(attractor=0.002, rate=10.0),
        supports=(gx.Support("foot"),),
        program=gx.Program(step=0.5, until=10.0, ramp=1.0),
        loads=loads,
        cases=cases,
    )


cases = gx.LoadCase("left", 0.5, (left,)), gx.LoadCase("right", 0.5, (right,))
in_turn = column(cases=cases)
together = column(loads=(left, right))

# %% [markdown]
# ## The run
#
# `stepping=gx.AdaptiveSteps(1e-2)` chooses the time steps by the error of density in each. A run that meets trouble
# says when, where and why; a wrong name or value ends it with a sentence before it begins.

# %%
results = {}
for name, scene in {"in turn": in_turn, "together": together}.items():
    results[name] = gx.solve(scene, gx.Q1P0, stepping=gx.AdaptiveSteps(1e-2))
    last = results[name].steps[-1]
    low, high = last.min_density, last.max_density
    print(f"{name:9} mass {last.mass:.4f}, ρ from {low:.3f} to {high:.3f}")

# %%
gx.plots.densities(results, "column.png")

# %% [markdown]
# ![Density of the column under loads in turn and together](column.png)
#
# Loads that act in turn bend the column to one side and the other, and its edges grow at the foot; together, they only
# press it.
#
# **Vary it.** `gx.solve(…, out="results/column", frames=20)` leaves fields for ParaView and [the states on the
# way](../docs/states.md); [loads](../docs/loads.md) has muscles, moments, pressures and springs;
# `gx.meshing.from_arrays(…, regions={"implant": …})` names parts of the body, and `growing=("bone",)` of a scene lets
# others rest.

# %%
foot = {name: result.steps[-1].max_density for name, result in results.items()}
assert foot["in turn"] > 1.2 > foot["together"]
