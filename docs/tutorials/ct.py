# %% [markdown]
# # Beginning with a CT scan
#
# A scan tells the density that a patient's bone has. This page makes a scan, so that the truth behind it is known;
# calibrates it, begins a run with it, and says how far the bone then goes from it. Yours would be a file:
# `scan = gx.ct.read("scan.nii.gz")`.

# %%
from dataclasses import replace

import numpy as np

import growthx as gx

# %% [markdown]
# ## A scan
#
# The truth is a femur that has grown under its loads. Its density is sampled at the centres of voxels of 1 mm, turned
# into Hounsfield units (HU) and given the noise of a scanner. A scan is an array of HU and an affine, the 4 × 4 matrix
# that takes the indices of a voxel to its place in mm; every library that reads DICOM or NIfTI has both.

# %%
steps = gx.AdaptiveSteps(1e-2, equilibrium=1e-3)  # to the end of all change
truth = gx.solve(gx.scenes.femur(size=6.0, until=1000.0), gx.Q1P0, stepping=steps)
A, B = 0.05, 0.0008  # ρ = A + B HU, from a phantom that was scanned with the patient

low, high = np.array([-50.0, -10.0]), np.array([80.0, 160.0])  # mm
shape = np.round(high - low).astype(int) + 1
x, y = np.meshgrid(low[0] + np.arange(shape[0]), low[1] + np.arange(shape[1]), indexing="ij")
density = truth.problem.sample_density(np.column_stack([x.ravel(), y.ravel()])).reshape(shape)

# %% [markdown]
# Outside the body there is no density, which `sample_density` tells by `nan`. A scanner sees soft tissue there.

# %%
noise = np.random.default_rng(1).normal(0.0, 25.0, shape)
units = np.where(np.isnan(density), 40.0, (density - A) / B) + noise
affine = np.eye(4)
affine[:2, 3] = low
scan = gx.ct.from_array(np.stack([units, units], axis=2), affine)  # two slices: voxels have an extent in z
print(scan)

# %% [markdown]
# ## From HU to density
#
# `scan.density` is a field that goes wherever a scene takes one. `a` and `b` are those of the calibration. A plane body
# lies in a slice at `z`. With `by="mean"`, each cell gets the mean over its voxels, which takes out most of the noise
# and keeps the mass; densities that came out below `floor`, of voxels half outside the bone, are lifted to it, and a
# line says how many they are.

# %%
scanned = scan.density(a=A, b=B, z=0.5, by="mean", floor=0.05)
femur = gx.scenes.femur(size=5.0, until=1000.0)  # another mesh than the truth's
patient = replace(femur, initial_density=scanned, program=replace(femur.program, ramp=0.0))

# %% [markdown]
# Scenes are frozen: `replace` takes one that is there with other values. `ramp=0` has the loads there from the start,
# as the bone in the scan was under them.
#
# Before a run, look at what it begins with: is the bone where it should be, and is it as dense?

# %%
start = gx.discretise(patient, gx.Q1P0)
mass = start.mass() / truth.problem.mass()
print(f"mass {mass:.3f} of the truth, ρ from {start.density_range()[0]:.2f} to {start.density_range()[1]:.2f} g/cm³")
before = gx.compare(start, truth)
print(f"beside the truth: correlation {before.pearson:.3f}, rmse {before.rmse:.3f}, bias {before.bias:+.3f} g/cm³")

# %% [markdown]
# What is missing is at the border: voxels half outside the bone have a density between bone and tissue, as in every
# scan.
#
# ## The run
#
# Bone that is in equilibrium with its loads stays as it is. How far it goes from the scan tells how well loads, law and
# scan agree, which no number of a model by itself does.

# %%
result = gx.solve(patient, gx.Q1P0, stepping=steps)
found = gx.compare(result, scanned, zones=dict(patient.zones), picture="scan.png", labels=("after", "in the scan"))
print(f"beside the scan: correlation {found.pearson:.3f}, rmse {found.rmse:.3f}, bias {found.bias:+.3f} g/cm³")
for name, zone in found.zones.items():
    print(f"{name:20} {zone.other:.3f} in the scan, {zone.mean:.3f} after")

# %% [markdown]
# ![Density after the run, in the scan, and their difference](scan.png)

# %%
afterwards = gx.compare(result, truth)
print(f"beside the truth: correlation {afterwards.pearson:.3f}, rmse {afterwards.rmse:.3f} g/cm³")
assert 0.9 < mass < 1.1
assert before.pearson > 0.95 and afterwards.pearson > 0.95

# %% [markdown]
# With the loads that made it, the bone stays what it was, but for its mesh. Try other loads, `weights=(1.0, 0.0, 0.0)`,
# and it does not.
#
# **Vary it.** `gx.ct.write(result, "after.nii.gz", spacing=1.0)` makes an image of a run, which needs nibabel, as
# `gx.ct.read` does; `growthx femur --mesh mine.msh --ct scan.nii.gz --hu 0.05,0.0008 --ct-slice coronal -22` begins
# with a scan on the command line. [Density from CT](../docs/ct.md) has frames (RAS or LPS), ash densities, and how to
# keep stiffness instead of mass.
