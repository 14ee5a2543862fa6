"""The paper's stored energy and the stress derived from it; knows nothing of growth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from growthx.common.arrays import Field
from growthx.common.checks import require
from growthx.constitutive.energies import Elasticity
from growthx.constitutive.functions import ln1p, ln1p_excess
from growthx.constitutive.kinematics import principal_changes, shape_change, volume_change


@dataclass(frozen=True)
class Material(
    Elasticity,
    replaceable=("elastic_energy", "lame", "coefficients"),
    final=("stiffness", "energy_at", "principal_energy", "principal_stresses"),
):
    """Neo-Hookean material weighted by relative density, Ψ₀ = [ρ/ρ*]ⁿ Ψ₀ⁿᵉᵒ (the paper's section 2.3).

    young: Young's modulus E (stress), a number or a field.
    poisson: Poisson's ratio ν (no unit), -1 < ν < 1/2.
    reference_density: ρ* (density).
    density_exponent: n (no unit), a number or a field; where nothing grows there is no weight, whatever n is.
    """

    young: Field
    poisson: float = 0.2
    reference_density: float = 1.0
    density_exponent: Field = 2.0

    coefficients: ClassVar = ("young", "poisson", "reference_density", "density_exponent")

    def __post_init__(self) -> None:
        require(self.young, "Young's modulus E", "a positive number", lambda E: E > 0)
        require(self.poisson, "Poisson's ratio ν", "a number above -1 and below 0.5", lambda nu: (nu > -1) & (nu < 0.5))
        self._check_weight()

    @property
    def lame(self) -> tuple[Any, Any]:
        """Lamé's parameters (λ, μ), in the unit of E."""
        E, nu = self.young, self.poisson
        return E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu))

    def elastic_energy(self, shape_change: Any, volume_change: Any) -> Any:
        """Ψ₀ⁿᵉᵒ = ½ λ ln²J + ½ μ [I₁ − 3 − 2 ln J], energy per reference volume, without the weight.

        Of I₁ − 3 − 2 [J − 1] and J − 1, see `kinematics`: exact to round-off at any strain, floats, arrays or UFL.
        """
        lam, mu = self.lame
        log_J, excess = ln1p(volume_change), ln1p_excess(volume_change)
        return lam / 2 * log_J * log_J + mu / 2 * (shape_change + 2 * excess)

    @property
    def stiffness(self) -> Any:
        """E."""
        return self.young

    @property
    def scales(self) -> tuple[str, ...]:
        """E alone."""
        return ("young",)

    def energy_at(self, H: Any) -> Any:
        """Ψ₀ⁿᵉᵒ as a UFL expression of the displacement gradient H = ∇u."""
        return self.elastic_energy(shape_change(H), volume_change(H))

    def principal_energy(self, extensions: tuple[Any, Any, Any]) -> Any:
        """Ψ₀ⁿᵉᵒ at principal stretches less one, λᵢ − 1: numbers, complex ones too, or arrays."""
        return self.elastic_energy(*principal_changes(extensions))

    def principal_stresses(self, extensions: tuple[float, float, float], density: float) -> list[float]:
        """Reduced momentum fluxes P̄ᵢ = [ρ/ρ*]ⁿ ∂Ψ₀ⁿᵉᵒ/∂λᵢ at the principal stretches less one, λᵢ − 1, for numbers.

        Differentiates the energy by a complex step, which is exact to round-off.
        """
        step = 1e-30
        stresses = []
        for i in range(3):
            moved = [extension + (step * 1j if i == k else 0) for k, extension in enumerate(extensions)]
            energy = self.principal_energy((moved[0], moved[1], moved[2]))
            stresses.append(float(self.weight(density) * energy.imag / step))
        return stresses
