# %% [markdown]
# # Your own material
#
# How stiff bone is follows from its density: Ψ₀ = [ρ/ρ\*]ⁿ Ψ₀ᵉˡ. This page changes all three parts of that sentence,
# Young's modulus and the exponent n from region to region, the elastic energy Ψ₀ᵉˡ, and at last writes one of its own.
#
# The body is a strip that is pulled lengthwise and may contract: its state is homogeneous, so that an equation for one
# point tells what must come out.

# %%
import numpy as np
import ufl

import growthx as gx
from growthx.constitutive.homogeneous import uniaxial_equilibrium

# %% [markdown]
# ## A strip of two regions
#
# Cells 0 to 15 are called "spongy", the others "cortical". Names of regions come from a mesh's file or, as here, from
# the numbers of cells.

# %%
nodes_x, nodes_y = np.meshgrid(np.linspace(0, 2, 9), np.linspace(0, 1, 5), indexing="ij")
number = np.arange(nodes_x.size).reshape(nodes_x.shape)
around = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
mesh = gx.meshing.from_arrays(
    np.column_stack([nodes_x.ravel(), nodes_y.ravel()]),
    np.column_stack([corner.ravel() for corner in around]),
    regions={"spongy": range(16), "cortical": range(16, 32)},
).named(
    {
        "left": lambda x: np.isclose(x[0], 0),
        "right": lambda x: np.isclose(x[0], 2),
        "bottom": lambda x: np.isclose(x[1], 0),
    }
)
print(mesh)

# %% [markdown]
# A support holds the directions that have a number and leaves free those with `None`: the left end may contract, and
# the lower edge may slide.

# %%
PULL = 1.0  # force per area, in the unit of Young's modulus
law = gx.EnergyDrivenGrowth(attractor=0.5, rate=1.0, exponent=4)


def strip(material):
    """The pulled strip, of a material."""
    return gx.Scene(
        name="strip",
        mesh=mesh,
        material=material,
        growth=law,
        supports=(gx.Support("left", (0.0, None)), gx.Support("bottom", (None, 0.0))),
        loads=(gx.Traction("right", (PULL, 0.0)),),
        program=gx.Program(step=1.0, until=400.0, ramp=1.0),
    )


# %% [markdown]
# ## Values per region
#
# Any parameter of the material or of the law may be a number, a function of position, or a dictionary with a value for
# each region. A Poisson's ratio of zero lets no region hold the contraction of the other, so that each is as it would
# be alone. `equilibrium=1e-8` ends the run when nothing changes any more.

# %%
bone = gx.Material(
    young={"spongy": 1.0, "cortical": 3.0},
    poisson=0.0,
    density_exponent={"spongy": 3.0, "cortical": 2.0},
)
steps = gx.AdaptiveSteps(1e-2, equilibrium=1e-8)
result = gx.solve(strip(bone), gx.Q1P0, stepping=steps)
print(result)

# %% [markdown]
# Is it right? `uniaxial_equilibrium` solves the equation of one point, for parameters that are numbers.

# %%
for region, young, n in (("spongy", 1.0, 3.0), ("cortical", 3.0, 2.0)):
    found = result.problem.mean_density(region)
    exact = uniaxial_equilibrium(gx.Material(young, 0.0, density_exponent=n), law, PULL).density
    print(f"{region:9} ρ = {found:.6f}, of one point {exact:.6f}")
    assert abs(found / exact - 1) < 1e-6

# %% [markdown]
# The stiffer region needs less bone to come to the same stimulus.
#
# ## Another stored energy
#
# All energies are Hooke's law at small strains, and differ at large ones. The strain here is large.

# %%
kinds = gx.Material, gx.MooneyRivlin, gx.LinearElasticity
densities = {}
for kind in kinds:
    material = kind(1.0, 0.3)  # E, ν; ρ* = 1 and n = 2 where nothing else is said
    ended = gx.solve(strip(material), gx.Q1P0, stepping=steps)
    densities[kind.__name__] = ended.problem.mean_density()
    exact = uniaxial_equilibrium(material, law, PULL).density
    print(f"{kind.__name__:17} ρ = {densities[kind.__name__]:.6f}, of one point {exact:.6f}")
    assert abs(densities[kind.__name__] / exact - 1) < 1e-6

# %% [markdown]
# ## One of your own
#
# A subclass of `gx.StoredEnergy` has the energy as UFL of the deformation gradient F, 3 × 3, and a stiffness, a modulus
# that forces are measured against. Stress and tangents follow by themselves, in every discretisation. This one pays
# for a change of volume by its square, where the paper takes that of its logarithm.


# %%
class SquareVolume(gx.StoredEnergy):
    """½ λ [J − 1]² + ½ μ [I₁ − 3 − 2 ln J]."""

    lam, mu = 0.3 / (1.3 * 0.4), 1 / 2.6  # of E = 1 and ν = 0.3
    stiffness = 1.0

    def energy(self, F):
        J = ufl.det(F)
        return self.lam / 2 * (J - 1) ** 2 + self.mu / 2 * (ufl.inner(F, F) - 3 - 2 * ufl.ln(J))


own = gx.solve(strip(SquareVolume()), gx.Q1, stepping=steps)
exact = uniaxial_equilibrium(SquareVolume(), law, PULL).density
print(f"ρ = {own.problem.mean_density():.6f}, of one point {exact:.6f}")
assert abs(own.problem.mean_density() / exact - 1) < 1e-6

# %%
gx.plots.densities({"E and n per region": result, "an energy of one's own": own}, "strip.png")

# %% [markdown]
# ![The pulled strip with two regions, and with an energy of one's own](strip.png)
#
# **Vary it.** `gx.FibredNeoHooke` has a direction; [stored energies](../docs/energies.md) tells what each is good for;
# on the command line, `growthx bar --energy linear` takes another one. Parameters of your own class that are to vary in
# space are fields of a dataclass, named in `coefficients = (*gx.StoredEnergy.coefficients, "mu")`. An energy that makes
# no sense, or a parameter that a class does not declare, is refused before the run with a sentence that says why.
