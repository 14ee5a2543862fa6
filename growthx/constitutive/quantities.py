"""What a stored energy says at one point of a body, as people look for it: energies, stresses, strains, stiffness.

In UFL, of H = ∇u in the dimensions of the mesh or, by `kinematics.in_space`, in space: in the plane the stress then has
its entry out of the plane, too.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from growthx.constitutive.energies import Elasticity


def strain_energy(material: Elasticity, density: Any, H: Any) -> Any:
    """Ψ₀ = [ρ/ρ*]ⁿ Ψ₀ᵉˡ, energy per reference volume."""
    return material.weight(density) * material.energy_at(H)


def first_piola_stress(material: Elasticity, density: Any, H: Any) -> Any:
    """The reduced momentum flux P̄ = ∂Ψ₀/∂F (7), force per reference area, of the shape of H."""
    return material.stress(H, density)


def cauchy_stress(material: Elasticity, density: Any, H: Any) -> Any:
    """σ = P̄ Fᵀ/J, force per deformed area, of the shape of H; of a law of small strains, its one stress."""
    return material.true_stress(H, density)


def thickness_stretch(material: Elasticity, density: Any, H: Any) -> Any:
    """λ₃ of a plane body, no unit: H of shape (3, 3)."""
    return 1 + H[2, 2]


def green_lagrange_strain(material: Elasticity, density: Any, H: Any) -> Any:
    """½ [Fᵀ F − I], no unit, of the shape of H; of a law of small strains sym H."""
    return material.strain(H)


def stiffness(material: Elasticity, density: Any) -> Any:
    """[ρ/ρ*]ⁿ E, Young's modulus as the density has made it (stress)."""
    return material.weight(density) * material.stiffness
