"""What a stored energy says at one point of a body, as people look for it: energies, stresses, strains, stiffness.

In UFL, of H = ∇u in the dimensions of the mesh or, by `kinematics.in_space`, in space: in the plane the stress then has
its entry out of the plane, too.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import ufl

from growthx.constitutive.kinematics import volume_change

if TYPE_CHECKING:
    from growthx.constitutive.energies import Elasticity


def strain_energy(material: Elasticity, density: Any, H: Any) -> Any:
    """Ψ₀ = [ρ/ρ*]ⁿ Ψ₀ᵉˡ, energy per reference volume."""
    return material.weight(density) * material.energy_at(H)


def first_piola_stress(material: Elasticity, density: Any, H: Any) -> Any:
    """The reduced momentum flux P̄ = ∂Ψ₀/∂F (7), force per reference area, of the shape of H."""
    return material.stress(H, density)


def cauchy_stress(material: Elasticity, density: Any, H: Any) -> Any:
    """σ = P̄ Fᵀ/J, force per deformed area, of the shape of H."""
    F = ufl.Identity(H.ufl_shape[0]) + H
    return material.stress(H, density) * F.T / (1 + volume_change(H))


def green_lagrange_strain(material: Elasticity, density: Any, H: Any) -> Any:
    """½ [Fᵀ F − I] = sym H + ½ Hᵀ H, no unit, of the shape of H: no identity takes the digits of small strains."""
    return ufl.sym(H) + H.T * H / 2


def stiffness(material: Elasticity, density: Any) -> Any:
    """[ρ/ρ*]ⁿ E, Young's modulus as the density has made it (stress)."""
    return material.weight(density) * material.stiffness
