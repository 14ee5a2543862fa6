"""Mass sources with a stimulus that is a power of the density times a function of the elastic energy."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import Any

from growthx.common.errors import InputError
from growthx.constitutive.energies import Elasticity
from growthx.constitutive.expressions import exact_exponent
from growthx.constitutive.functions import sqrt
from growthx.constitutive.sources import MassSource

REST = 1e-10  # strain below which an equivalent strain, whose slope at rest is infinite, is rounded
DIGITS, EXACT = 12, 1e-9  # of differences of powers, and how well three of them lie on a line


@dataclass(frozen=True)
class StimulusDriven(MassSource, ABC, replaceable=()):
    """A mass source driven by a stimulus S = [ρ/ρ*]^k D(Ψ₀ⁿᵉᵒ), by its `power` k and its `drive` D.

    Of a weight w that is no power [ρ/ρ*]ⁿ, k = a n + b becomes wᵃ [ρ/ρ*]^b.
    """

    @abstractmethod
    def power(self, material: Elasticity) -> Any:
        """The exponent k of the relative density in the stimulus: a number, or as n an array or UFL."""

    @abstractmethod
    def drive(self, elastic_energy: Any, material: Elasticity) -> Any:
        """The stimulus D at the reference density, of the elastic energy Ψ₀ⁿᵉᵒ (energy per reference volume)."""

    def stimulus(self, density: Any, elastic_energy: Any, material: Elasticity) -> Any:
        """S = [ρ/ρ*]^k D(Ψ₀ⁿᵉᵒ)."""
        relative = density / material.reference_density
        if material.is_of_a_power:
            return relative ** exact_exponent(self.power(material)) * self.drive(elastic_energy, material)
        of_weight, of_density = self.powers(material)
        factor = relative ** exact_exponent(of_density)
        if of_weight != 0:
            factor = material.weight(density) ** exact_exponent(of_weight) * factor
        return factor * self.drive(elastic_energy, material)

    def powers(self, material: Elasticity) -> tuple[float, float]:
        """The a and b of k = a n + b, for any weight; InputError for a power k that depends on n in another way."""
        known = self.__dict__.get("_powers")
        if known is None or known[0] is not material:  # else asked for at each evaluation, of few points a third of it
            known = material, self._looked_for(material)
            object.__setattr__(self, "_powers", known)
        found: tuple[float, float] = known[1]
        return found

    def _looked_for(self, material: Elasticity) -> tuple[float, float]:
        at = [float(self.power(replace(material, density_exponent=n))) for n in (0.0, 1.0, 2.0)]
        of_weight = at[1] - at[0]
        if not abs(at[2] - at[1] - of_weight) <= EXACT:
            raise InputError(
                f"the power of {type(self).__name__} is {at[0]:g}, {at[1]:g} and {at[2]:g} for n = 0, 1 and 2, and the "
                f"material has {type(material.density_exponent).__name__} in place of n: a power a n + b, or a number "
                "n, would be right"
            )
        return round(of_weight, DIGITS), at[0]

    def power_at(self, density: Any, material: Elasticity) -> Any:
        """K at a density: ∂ ln S/∂ ln ρ, with which its slope is k S/ρ."""
        if material.is_of_a_power:
            return self.power(material)
        of_weight, of_density = self.powers(material)
        return of_weight * material.exponent_at(density) + of_density if of_weight else of_density


def equivalent_strain(elastic_energy: Any, material: Elasticity) -> Any:
    """√(2 Ψ₀ⁿᵉᵒ/E), the strain of a bar of the same elastic energy, rounded at rest; no unit.

    With s its square, s/√(s + r²): at a strain of 1e-6, far below those of bone, it is smaller by 5e-9 of it.
    """
    square = 2 * elastic_energy / material.stiffness
    return square / sqrt(square + REST**2)
