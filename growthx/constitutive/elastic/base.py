"""Energies by Young's modulus and Poisson's ratio, which the paper's shares with those beside it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

from growthx.common.arrays import Field
from growthx.common.checks import require
from growthx.constitutive.elastic.invariants import Invariants
from growthx.constitutive.energies import Elasticity

STEP = 1e-30  # of a complex step, which leaves no difference to lose digits in


@dataclass(frozen=True)
class ByModuli(Elasticity, ABC, replaceable=()):
    """An isotropic energy that at small strains is Hooke's, weighted by relative density.

    young: Young's modulus E (stress), a number or a field.
    poisson: Poisson's ratio ν (no unit), -1 < ν < 1/2, a number or a field.
    reference_density: ρ* (density), a number or a field.
    density_exponent: n (no unit), a number or a field, or a `DensityWeight`; where nothing grows there is no weight.
    """

    young: Field
    poisson: Field = 0.2
    reference_density: Field = 1.0
    density_exponent: Field = 2.0

    coefficients: ClassVar[tuple[str, ...]] = ("young", "poisson", "reference_density", "density_exponent")

    def __post_init__(self) -> None:
        require(self.young, "Young's modulus E", "a positive number", lambda E: E > 0)
        require(self.poisson, "Poisson's ratio ν", "a number above -1 and below 0.5", lambda nu: (nu > -1) & (nu < 0.5))
        self._check_weight()

    @property
    def lame(self) -> tuple[Any, Any]:
        """Lamé's parameters (λ, μ), in the unit of E."""
        E, nu = self.young, self.poisson
        return E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu))

    @abstractmethod
    def energy_of(self, invariants: Invariants) -> Any:
        """Ψ₀ᵉˡ, energy per reference volume, without the weight, exact to round-off at small strains, too."""

    @property
    def stiffness(self) -> Any:
        """E."""
        return self.young

    @property
    def scales(self) -> tuple[str, ...]:
        """E alone."""
        return ("young",)

    def energy_at(self, H: Any) -> Any:
        """Ψ₀ᵉˡ as a UFL expression of the displacement gradient H = ∇u."""
        return self.energy_of(Invariants.of_gradient(H))

    def principal_energy(self, extensions: tuple[Any, Any, Any]) -> Any:
        """Ψ₀ᵉˡ at principal stretches less one, λᵢ − 1: numbers, complex ones too, or arrays."""
        return self.energy_of(Invariants.of_extensions(extensions))

    def principal_stresses(self, extensions: tuple[float, float, float], density: float) -> list[float]:
        """Reduced momentum fluxes P̄ᵢ = [ρ/ρ*]ⁿ ∂Ψ₀ᵉˡ/∂λᵢ at the principal stretches less one, λᵢ − 1, for numbers.

        Differentiates the energy by a complex step, which is exact to round-off.
        """
        weight = self.weight(density)
        return [float(weight * slope) for slope in slopes(self.principal_energy, extensions)]


def slopes(energy: Callable[[Any], Any], extensions: tuple[float, float, float]) -> list[float]:
    """The derivatives of an energy of three numbers, complex ones too."""
    found = []
    for i in range(3):
        moved = [extension + (STEP * 1j if i == k else 0) for k, extension in enumerate(extensions)]
        found.append(float(energy((moved[0], moved[1], moved[2])).imag / STEP))
    return found
