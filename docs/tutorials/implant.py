# %% [markdown]
# # An implant
#
# Bone beside a stiff implant carries less, and goes: stress shielding. This page grows a femur, puts a stem of titanium
# into it, and measures what each zone of Gruen loses. All that it does goes for a screw, a plate or a cage as well.

# %%
import growthx as gx
from growthx.scenes.stem import TITANIUM, scaled

# %% [markdown]
# ## Bone before
#
# An implant meets bone that is in equilibrium with its loads, not a uniform density. So the first run is one without
# it, to an end at which nothing changes any more.

# %%
steps = gx.AdaptiveSteps(1e-2, equilibrium=1e-3)
intact = gx.solve(gx.scenes.femur(until=1000.0), gx.Q1P0, stepping=steps)
print(f"in equilibrium at t = {intact.time:.0f}, after {len(intact.steps)} steps")

# %% [markdown]
# ## A mesh with two regions
#
# `gx.scenes.stem_mesh` draws a stem into the outline of the femur; a mesh of your own would have the regions "bone"
# and "stem", by any names. The density of the first run is carried into it: `gx.transfer` finds for each new place what
# was there, keeps the mass, and takes `outside` where nothing was, as in the head of the stem.

# %%
mesh = gx.scenes.stem_mesh()
carried = gx.transfer(intact, mesh, gx.Q1P0, outside=1.2)
print(mesh)

# %% [markdown]
# ## The scene
#
# Two things make the region an implant: `growing=("bone",)`, which leaves all other regions without growth, and a
# Young's modulus per region. `gx.scenes.stem` sets both. The loads are there from the start (`ramp=0` in its
# program), because in a ramp bone would be resorbed that is needed at its end.
#
# The plane model's bone has 500 MPa at ρ\* = 1.2 g/cm³ where real cortical bone has 17 000; `scaled` makes the metal as
# many times stiffer in the model as it is in truth.

# %%
after = gx.scenes.stem(mesh, carried, young=scaled(TITANIUM), until=600.0)
print(after.growing, after.material.young, after.program.ramp)

# %% [markdown]
# `gx.discretise` makes the state at the start without a step, to be compared with.

# %%
start = gx.discretise(after, gx.Q1P0)
result = gx.solve(after, gx.Q1P0, stepping=steps)
before, now = (gx.zones.area_means(problem, after.zones) for problem in (start, result))
for zone in after.zones:
    print(f"{zone}: {before[zone]:.3f} → {now[zone]:.3f} g/cm³, {now[zone] / before[zone] - 1:+.1%}")

# %%
found = gx.compare(result, carried, picture="stem.png", labels=("with the stem", "intact"))
print(f"of all bone: correlation {found.pearson:.3f}, mean change {found.bias:+.3f} g/cm³")

# %% [markdown]
# ![Density around the stem, of the intact bone, and their difference](stem.png)
#
# ## Is it the stem?
#
# A result of a simulation needs a control: the same mesh, with a "stem" as stiff as the bone that it replaces, and the
# head of the bone's own shape. If that changed the bone, the mesh or the transfer would be to blame.

# %%
own = gx.scenes.stem_mesh(natural=True)
control_scene = gx.scenes.stem(own, gx.transfer(intact, own, gx.Q1P0, outside=1.2), head_radius=24.0, until=600.0)
control = gx.solve(control_scene, gx.Q1P0, stepping=steps)
at_first, at_last = (
    gx.zones.area_means(problem, control_scene.zones) for problem in (gx.discretise(control_scene, gx.Q1P0), control)
)
for zone in after.zones:
    lost, control_lost = now[zone] / before[zone] - 1, at_last[zone] / at_first[zone] - 1
    print(f"{zone}: titanium {lost:+.1%}, as stiff as bone {control_lost:+.1%}")

# %%
change = {zone: now[zone] / before[zone] - 1 for zone in after.zones}
assert change["Gruen 7"] < -0.1 < change["Gruen 3"]  # the calcar loses, beside the tip there is next to nothing
assert all(abs(at_last[zone] / at_first[zone] - 1) < 0.02 for zone in after.zones)

# %% [markdown]
# **Vary it.** `COBALT_CHROMIUM` is stiffer; a stem's `width`, `tip` and `head` are in mm; [bone around a
# stem](../docs/stem.md) has both metals on a finer mesh, and what not to read from a plane model. There is no contact:
# the stem is bonded to the bone.
