# %% [markdown]
# # Your own growth law
#
# A stimulus of your own is a class of a few lines. Its tangents follow by themselves, and it goes into every
# discretisation, from one density for each cell to continuous ones.

# %%
from dataclasses import dataclass, replace

import growthx as gx

# %% [markdown]
# ## The law
#
# With S = [ρ/ρ\*]ᵏ D(Ψ₀ⁿᵉᵒ), mass grows by R₀ = c [S − attractor]. `power` is k; `drive` is D, a function of the
# energy per volume that the material would have at its reference density. Here more energy than Ψₘ raises the
# stimulus no further, as if cells were saturated.


# %%
@dataclass(frozen=True)
class Saturated(gx.GrowthLaw):
    """A stimulus that more energy than Ψₘ raises no further."""

    most: float = 1.0  # Ψₘ, energy per volume

    def power(self, material):
        return material.density_exponent - 3

    def drive(self, elastic_energy, material):
        return elastic_energy / (1 + elastic_energy / self.most)


# %% [markdown]
# ## A scene with it
#
# Scenes are frozen; `replace` takes one that is there with another law. The plate is the unit problem of the tests,
# clamped at its left end.

# %%
plate = gx.scenes.plate(8)
attractor, rate = plate.growth.attractor, plate.growth.rate
laws = {
    "the paper's": plate.growth,
    "saturated at 1": Saturated(attractor=attractor, rate=rate, most=1.0),
    "saturated at 0.01": Saturated(attractor=attractor, rate=rate, most=0.01),
}
masses = {}
for name, law in laws.items():
    for variant in (gx.Q1P0, gx.Q1, gx.Q1Q1):
        result = gx.solve(replace(plate, growth=law), variant)
        masses[name, variant.name] = result.problem.mass()
        print(f"{name:18} {variant.name:5} mass {masses[name, variant.name]:.5f}")

# %% [markdown]
# The three discretisations agree but for their errors, and the lower Ψₘ is, the less mass there is.
#
# ## Is it well posed?
#
# A law whose stimulus rises with the density has no unique answer. Two numbers judge a state: the lowest 1 − Δt
# ∂R₀/∂ρ of all points, and the negative pivots of the tangent for long times.

# %%
print(gx.wellposedness.check(result))

# %% [markdown]
# **Vary it.** `bounds` keep the density between two values, and a `dead_zone` leaves small differences without
# growth; [growth laws](../docs/models.md) has these and the laws that are there, [the theory](../docs/theory.md)
# sources of another form (`gx.MassSource`) and [stored energies](../docs/energies.md) of your own.

# %%
for variant in ("Q1P0", "Q1", "Q1Q1"):
    paper, at_1, at_001 = (masses[name, variant] for name in laws)
    assert paper > at_1 > at_001
