"""The mass source, written once for floats, arrays and UFL; knows nothing of meshes and solvers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from growthx.errors import require, require_number
from growthx.fields import Field
from growthx.material import Material, exact_exponent


@dataclass(frozen=True)
class EnergyDrivenGrowth:
    """Mass source driven by the free energy, R₀ = c { [ρ/ρ*]^(−m) Ψ₀ − Ψ₀* } (6).

    attractor: attractor stimulus Ψ₀* (energy per reference volume), a number or a field.
    rate: c (density per time and per energy per volume).
    exponent: m (no unit); the model is well posed for m > n.
    """

    attractor: Field
    rate: float = 1.0
    exponent: float = 3.0

    coefficients: ClassVar = ("attractor", "rate")

    def __post_init__(self) -> None:
        require(self.attractor, "the attractor stimulus Ψ₀*", "a number of at least 0", lambda psi: psi >= 0)
        require(self.rate, "the growth rate c", "a number of at least 0", lambda c: c >= 0)
        require_number(self.exponent, "the exponent m", "a number of at least 0", lambda m: m >= 0)

    def stimulus(self, density: Any, elastic_energy: Any, material: Material) -> Any:
        """[ρ/ρ*]^(−m) Ψ₀ = [ρ/ρ*]^(n−m) Ψ₀ⁿᵉᵒ, energy per reference volume."""
        exponent = exact_exponent(material.density_exponent - self.exponent)
        return (density / material.reference_density) ** exponent * elastic_energy

    def mass_source(self, density: Any, elastic_energy: Any, material: Material) -> Any:
        """R₀ (6), density per time."""
        return self.rate * (self.stimulus(density, elastic_energy, material) - self.attractor)

    def mass_source_slope(self, density: Any, elastic_energy: Any, material: Material) -> Any:
        """∂_ρ R₀ = c [n−m]/ρ · [ρ/ρ*]^(n−m) Ψ₀ⁿᵉᵒ, per time."""
        exponent = material.density_exponent - self.exponent
        return self.rate * exponent * self.stimulus(density, elastic_energy, material) / density
