"""Homogeneous states, against which the discretisations are compared: biological equilibrium of a bar in tension."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from growthx.errors import require

if TYPE_CHECKING:
    from growthx.growth import GrowthLaw
    from growthx.material import Material


@dataclass(frozen=True)
class Equilibrium:
    """A homogeneous state: density and stretches along the load and across it (plane strain out of plane)."""

    density: float
    stretch: float
    transverse_stretch: float


def uniaxial_equilibrium(material: Material, growth: GrowthLaw, traction: float) -> Equilibrium:
    """Uniaxial tension in plane strain with R₀ = 0, for uniform parameters and a stimulus that the density enters.

    The density follows from [ρ/ρ*]^k D = S*, with the energy-driven law [ρ/ρ*]^(n−m) Ψ₀ⁿᵉᵒ = Ψ₀* (6), the transverse
    stretch from P̄₂₂ = 0, and the stretch from P̄₁₁ = traction (force per reference area, positive).
    """
    from scipy.optimize import brentq  # costly to import, and asked for by few

    require(traction, "the traction", "a positive number", lambda t: t > 0)
    exponent = -1 / growth.power(material)

    def state(stretch: float) -> Equilibrium:
        across = brentq(lambda s: material.principal_stresses((stretch, s, 1.0), 1.0)[1], 1e-6, 2.0, xtol=1e-15)
        energy = material.elastic_energy(stretch**2 + across**2 + 1, stretch * across)
        relative = (growth.drive(energy, material) / growth.attractor) ** exponent
        return Equilibrium(material.reference_density * relative, stretch, across)

    def excess(stretch: float) -> float:
        at = state(stretch)
        return material.principal_stresses((at.stretch, at.transverse_stretch, 1.0), at.density)[0] - traction

    return state(brentq(excess, 1 + 1e-9, 1e3, xtol=1e-14))
