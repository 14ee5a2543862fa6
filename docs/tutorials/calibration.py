# %% [markdown]
# # Calibration
#
# A law has parameters that nobody measures: the attractor stimulus, the rate. They are found so that a run comes to a
# density that was measured. This page fits them to a target whose parameters are known, so that one sees whether they
# are found again, and asks first which of them can be found at all.

# %%
from dataclasses import replace

import numpy as np
from scipy.optimize import brentq, least_squares

import growthx as gx

# %% [markdown]
# ## The model as a function
#
# A calibration runs the model many times. So the mesh is coarse and made once, and what the model gives are a few
# numbers that can be measured, too: here the mean density of four quarters of a bent plate, at three times, say at
# three visits of a patient. `watch` is called after every step with the result so far. Strains are small, some
# thousandths, as they are in bone.

# %%
plate = gx.scenes.plate(4)  # under a traction of 0.02 MPa
QUARTERS = {
    f"quarter {k + 1}": np.array([(k / 2, 0), (k / 2 + 0.5, 0), (k / 2 + 0.5, 1), (k / 2, 1)]) for k in range(4)
}
VISITS = 0.5, 1.0, 2.5


def model(attractor, rate=500.0, young=50.0):
    """The plate with other parameters."""
    return replace(
        plate,
        material=replace(plate.material, young=young),
        growth=replace(plate.growth, attractor=attractor, rate=rate),
    )


def densities(*parameters, **others):
    """Mean densities of the quarters at each visit, shape (12,)."""
    seen = []

    def watch(result):
        if any(np.isclose(result.time, VISITS)):
            seen.extend(gx.zones.area_means(result, QUARTERS).values())

    gx.solve(model(*parameters, **others), gx.Q1P0, watch=watch)
    return np.array(seen)


# %% [markdown]
# ## One parameter, one number
#
# The mean density at the end falls as the attractor rises, so that a root finder is enough.

# %%
TRUE = {"attractor": 4e-4, "rate": 500.0}
target = densities(**TRUE)
last = slice(-4, None)
attractor = brentq(lambda each: (densities(each) - target)[last].mean(), 2e-4, 1e-3, rtol=1e-6)
print(f"attractor {attractor:.6f}, true {TRUE['attractor']}")
assert abs(attractor / TRUE["attractor"] - 1) < 1e-4

# %% [markdown]
# ## What can be found at all?
#
# Change each parameter by one per cent and look at what the densities do: the columns of a matrix S. Its singular
# values tell how well combinations of parameters can be told apart. If the smallest is next to zero, there is a
# combination that no measurement of this kind sees, and no optimiser finds it.

# %%
names = "attractor", "rate", "young"
middle = np.array([4e-4, 500.0, 50.0])
S = np.column_stack(
    [(densities(*(middle * np.exp(+e))) - densities(*(middle * np.exp(-e)))) / 0.02 for e in 0.01 * np.eye(3)]
)
_, sizes, directions = np.linalg.svd(S)
for size, direction in zip(sizes, directions, strict=True):
    parts = (f"{value:+.2f} {name}" for value, name in zip(direction, names, strict=True))
    print(f"{size / sizes[0]:8.5f}", ", ".join(parts))

# %% [markdown]
# The third combination is not seen: E times a factor, the attractor divided by it, and the rate times it. For small
# strains the energy under given forces goes as 1/E, and so ρ̇ = c { [ρ/ρ\*]^(−m) Ψ₀ − Ψ₀\* } stays what it is. So E must
# come from elsewhere; attractor and rate may be fitted, if there are measurements **on the way**: an equilibrium does
# not know the rate at all.

# %%
weakest = directions[2] / directions[2][2]
print(f"E times 2 goes with attractor times {2 ** weakest[0]:.2f} and rate times {2 ** weakest[1]:.2f}")
assert sizes[2] < 2e-3 * sizes[0] and sizes[1] > 0.02 * sizes[0]
assert np.allclose(weakest, (-1, 1, 1), atol=0.05)

# %% [markdown]
# ## Two parameters, twelve numbers with errors
#
# Positive parameters are fitted by their logarithms. Measurements have errors, here of one per cent; the covariance
# tells what they leave of certainty.

# %%
ERROR = 0.01
measured = target * (1 + ERROR * np.random.default_rng(7).normal(size=target.size))
fit = least_squares(lambda p: (densities(*np.exp(p)) / measured - 1) / ERROR, np.log([8e-4, 250.0]), diff_step=1e-3)
found, spread = np.exp(fit.x), np.sqrt(np.diag(np.linalg.inv(fit.jac.T @ fit.jac)))
for name, value, share in zip(TRUE, found, spread, strict=True):
    print(f"{name:9} {value:8.3g} ± {share:.1%}, true {TRUE[name]}")
print(f"{fit.nfev} evaluations, χ² = {2 * fit.cost:.1f} of {len(measured) - 2} expected")
assert all(abs(np.log(found / np.array(list(TRUE.values())))) < 3 * spread)

# %%
ended = {name: gx.solve(model(*each), gx.Q1P0) for name, each in (("true", TRUE.values()), ("fitted", found))}
gx.plots.densities(ended, "fitted.png")

# %% [markdown]
# ![Density of the plate with the true and with the fitted parameters](fitted.png)
#
# **Vary it.** A target from a scan is `scan.density(…)`, compared by `gx.compare(result, density).zones`, see [CT
# scans](ct.ipynb). A function of a parameter that jumps cannot be fitted by slopes: fixed steps, as here, keep it
# smooth, adaptive ones do not. Runs with m ≤ n have no unique answer, and nothing can be fitted to them.
