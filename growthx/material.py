"""The stored energy and the stress derived from it; knows nothing of growth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import ufl

from growthx.errors import require, require_number
from growthx.fields import Field
from growthx.kinematics import first_invariant, volume_ratio


def ln(x: Any) -> Any:
    """Natural logarithm of a float, an array or a UFL expression."""
    return ufl.ln(x) if isinstance(x, ufl.core.expr.Expr) else np.log(x)


def sqrt(x: Any) -> Any:
    """Square root of a float, an array or a UFL expression."""
    return ufl.sqrt(x) if isinstance(x, ufl.core.expr.Expr) else np.sqrt(x)


def exact_exponent(value: float) -> float | int:
    """The exponent as an integer where it is one: compilers turn integer powers into products."""
    return int(value) if float(value).is_integer() else float(value)


@dataclass(frozen=True)
class Material:
    """Neo-Hookean material weighted by relative density, Ψ₀ = [ρ/ρ*]ⁿ Ψ₀ⁿᵉᵒ (the paper's section 2.3).

    young: Young's modulus E (stress), a number or a field.
    poisson: Poisson's ratio ν (no unit), -1 < ν < 1/2.
    reference_density: ρ* (density).
    density_exponent: n (no unit).
    """

    young: Field
    poisson: float = 0.2
    reference_density: float = 1.0
    density_exponent: float = 2.0

    coefficients: ClassVar = ("young", "poisson", "reference_density")

    def __post_init__(self) -> None:
        require(self.young, "Young's modulus E", "a positive number", lambda E: E > 0)
        require(self.poisson, "Poisson's ratio ν", "a number above -1 and below 0.5", lambda nu: (nu > -1) & (nu < 0.5))
        require(self.reference_density, "the reference density ρ*", "a positive number", lambda rho: rho > 0)
        require_number(self.density_exponent, "the density exponent n", "a number of at least 0", lambda n: n >= 0)

    @property
    def lame(self) -> tuple[Any, Any]:
        """Lamé's parameters (λ, μ), in the unit of E."""
        E, nu = self.young, self.poisson
        return E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu))

    def elastic_energy(self, I1: Any, J: Any) -> Any:
        """Ψ₀ⁿᵉᵒ = ½ λ ln²J + ½ μ [I₁ − 3 − 2 ln J], energy per reference volume, without the weight."""
        lam, mu = self.lame
        return lam / 2 * ln(J) ** 2 + mu / 2 * (I1 - 3 - 2 * ln(J))

    def weight(self, density: Any) -> Any:
        """[ρ/ρ*]ⁿ, no unit."""
        return (density / self.reference_density) ** exact_exponent(self.density_exponent)

    def energy(self, F: Any) -> Any:
        """Ψ₀ⁿᵉᵒ as a UFL expression of the deformation gradient F."""
        return self.elastic_energy(first_invariant(F), volume_ratio(F))

    def stress(self, F: Any, density: Any) -> Any:
        """Reduced momentum flux P̄ = [ρ/ρ*]ⁿ ∂Ψ₀ⁿᵉᵒ/∂F (7), UFL of shape (dim, dim), force per reference area."""
        F = ufl.variable(F)
        return self.weight(density) * ufl.diff(self.energy(F), F)

    def principal_stresses(self, stretches: tuple[float, float, float], density: float) -> list[float]:
        """Reduced momentum fluxes P̄ᵢ = [ρ/ρ*]ⁿ ∂Ψ₀ⁿᵉᵒ/∂λᵢ at the principal stretches λᵢ, for numbers.

        Differentiates the energy by a complex step, which is exact to round-off.
        """
        step = 1e-30
        stresses = []
        for i in range(3):
            lam = [stretch + (step * 1j if i == k else 0) for k, stretch in enumerate(stretches)]
            energy = self.elastic_energy(sum(s * s for s in lam), lam[0] * lam[1] * lam[2])
            stresses.append(float(self.weight(density) * energy.imag / step))
        return stresses
