"""Mass sources with a stimulus that is a power of the density times a function of the elastic energy."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

from growthx.constitutive.energies import Elasticity
from growthx.constitutive.expressions import exact_exponent
from growthx.constitutive.functions import sqrt
from growthx.constitutive.sources import MassSource

REST = 1e-10  # strain below which an equivalent strain, whose slope at rest is infinite, is rounded


@dataclass(frozen=True)
class StimulusDriven(MassSource, ABC, replaceable=()):
    """A mass source driven by a stimulus S = [ρ/ρ*]^k D(Ψ₀ⁿᵉᵒ), by its `power` k and its `drive` D."""

    @abstractmethod
    def power(self, material: Elasticity) -> Any:
        """The exponent k of the relative density in the stimulus: a number, or as n an array or UFL."""

    @abstractmethod
    def drive(self, elastic_energy: Any, material: Elasticity) -> Any:
        """The stimulus D at the reference density, of the elastic energy Ψ₀ⁿᵉᵒ (energy per reference volume)."""

    def stimulus(self, density: Any, elastic_energy: Any, material: Elasticity) -> Any:
        """S = [ρ/ρ*]^k D(Ψ₀ⁿᵉᵒ)."""
        relative = density / material.reference_density
        return relative ** exact_exponent(self.power(material)) * self.drive(elastic_energy, material)


def equivalent_strain(elastic_energy: Any, material: Elasticity) -> Any:
    """√(2 Ψ₀ⁿᵉᵒ/E), the strain of a bar of the same elastic energy, rounded at rest; no unit.

    With s its square, s/√(s + r²): at a strain of 1e-6, far below those of bone, it is smaller by 5e-9 of it.
    """
    square = 2 * elastic_energy / material.stiffness
    return square / sqrt(square + REST**2)
