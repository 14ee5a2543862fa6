# %% [markdown]
# # Load cases
#
# A day has many loads: steps, stairs, chairs. Bone does not feel their sum, which never acts, but one after the other.
# This page takes the proximal femur of the paper under three loads of the hip, combines them in three ways, and looks
# at what each leaves in the bone.

# %%
import growthx as gx
from growthx.scenes.femur import AVERAGE, LOAD_CASES, SUPERPOSED, loaded_arcs

# %% [markdown]
# ## The loads
#
# Midstance of gait, extreme abduction and extreme adduction, with their number of cycles a day. Each is a force of the
# joint on the head and one of the abductors on the greater trochanter.

# %%
for case in LOAD_CASES:
    joint, abductors = ((round(x), round(y)) for x, y in (case.joint_force, case.abductor_force))
    print(f"{case.name}: joint {joint} N, abductors {abductors} N")
print("by daily cycles", AVERAGE, "and as a plain sum", SUPERPOSED)

# %% [markdown]
# ## Three ways to combine them
#
# - **average**: one displacement, under the mean of the forces, weighted by daily cycles: the cheapest;
# - **superposed**: one displacement, under the plain sum of the forces;
# - **stimulus**: a displacement for each load, under its full forces; what drives the growth is the mean of their
#   energies, weighted. `separate=True` asks for this one, and it is what is meant by load cases elsewhere.
#
# Cells of 6 mm are coarse, and quick.

# %%
ways = {
    "average": gx.scenes.femur(size=6.0),
    "superposed": gx.scenes.femur(size=6.0, weights=SUPERPOSED),
    "stimulus": gx.scenes.femur(size=6.0, separate=True),
}
print(ways["stimulus"])

# %% [markdown]
# `gx.AdaptiveSteps` chooses the steps by their error, and a run for each way follows.

# %%
results = {name: gx.solve(femur, gx.Q1P0, stepping=gx.AdaptiveSteps(1e-2)) for name, femur in ways.items()}
gx.plots.densities(results, "cases.png")

# %% [markdown]
# ![Density of the femur by three ways to combine the load cases](cases.png)
#
# ## Numbers
#
# `scene.zones` are polygons with names; `gx.zones.area_means` has the mean density of each.

# %%
means = {name: gx.zones.area_means(result, ways[name].zones) for name, result in results.items()}
print(f"{'mean density (g/cm³)':24}", *(f"{name:>11}" for name in means))
for zone in ways["average"].zones:
    print(f"{zone:24}", *(f"{mean[zone]:11.3f}" for mean in means.values()))

# %% [markdown]
# The plain sum makes the most bone. The mean of the forces makes the least: energy is a convex function of the load, so
# that the mean of energies is never below the energy of the mean. What differs most is bone that one load presses and
# another one pulls: in the mean of the forces these cancel, in life they do not.
#
# ## Which load makes which bone?
#
# A weight of zero leaves a load out. Then one asks by how much a zone changes.

# %%
gait = gx.solve(gx.scenes.femur(size=6.0, weights=(AVERAGE[0], 0.0, 0.0), separate=True), gx.Q1P0)
alone = gx.zones.area_means(gait, ways["stimulus"].zones)
for zone, mean in means["stimulus"].items():
    print(f"{zone:24} gait alone {alone[zone] - mean:+.3f} g/cm³")

# %% [markdown]
# ## Does every newton arrive?
#
# Forces act on arcs of the boundary, so the first thing to check of a mesh is that they do. The second: what holds the
# body is the opposite of what loads it, in each step, but for what Newton's method leaves of the forces.

# %%
for arc in loaded_arcs(ways["average"]):
    print(f"{arc.case}, {arc.force}: {arc.newtons:.0f} N on {arc.length:.1f} mm of '{arc.on}'")
for name, result in results.items():
    defect = max(step.force_defect for step in result.steps)
    print(f"{name}: forces balance to {defect:.0e} of their sum")
    assert defect < 1e-4
assert all(means["stimulus"][zone] > mean for zone, mean in means["average"].items())

# %% [markdown]
# **Vary it.** Your own cases are `gx.LoadCase("stairs", 0.2, loads)` in a scene's `cases`, as in [your own mesh and
# load cases](own_mesh.ipynb); the weights are daily cycles by their sum, or any shares. On the command line, `growthx
# femur --size 6 --combination stimulus --weights 0.6 0.2 0.2 --json` prints the zones.
