"""The paper's stored energy and the stress derived from it; knows nothing of growth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from growthx.constitutive.elastic.base import ByModuli
from growthx.constitutive.elastic.invariants import Invariants
from growthx.constitutive.functions import ln1p, ln1p_excess


def neo_hooke(lame: tuple[Any, Any], shape_change: Any, volume_change: Any) -> Any:
    """½ λ ln²J + ½ μ [I₁ − 3 − 2 ln J] of I₁ − 3 − 2 [J − 1] and J − 1: exact to round-off at any strain."""
    lam, mu = lame
    log_J, excess = ln1p(volume_change), ln1p_excess(volume_change)
    return lam / 2 * log_J * log_J + mu / 2 * (shape_change + 2 * excess)


@dataclass(frozen=True)
class Material(
    ByModuli,
    replaceable=("elastic_energy", "lame", "coefficients"),
    final=("stiffness", "energy_of", "energy_at", "principal_energy", "principal_stresses"),
):
    """Neo-Hookean material weighted by relative density, Ψ₀ = [ρ/ρ*]ⁿ Ψ₀ⁿᵉᵒ (the paper's section 2.3).

    young: Young's modulus E (stress), a number or a field.
    poisson: Poisson's ratio ν (no unit), -1 < ν < 1/2, a number or a field.
    reference_density: ρ* (density), a number or a field.
    density_exponent: n (no unit), a number or a field, or a `DensityWeight`; where nothing grows there is no weight.

    Example:
        >>> bone = gx.Material(young=500.0, density_exponent=2.0)
        >>> [round(stress, 2) for stress in bone.principal_stresses((0.01, 0.0, 0.0), 0.5)]
        [1.38, 0.35, 0.35]
    """

    def elastic_energy(self, shape_change: Any, volume_change: Any) -> Any:
        """Ψ₀ⁿᵉᵒ = ½ λ ln²J + ½ μ [I₁ − 3 − 2 ln J], energy per reference volume, without the weight.

        Of I₁ − 3 − 2 [J − 1] and J − 1, see `kinematics`: exact to round-off at any strain, floats, arrays or UFL.
        """
        return neo_hooke(self.lame, shape_change, volume_change)

    def energy_of(self, invariants: Invariants) -> Any:
        """The same of invariants."""
        return self.elastic_energy(invariants.shape, invariants.volume)
