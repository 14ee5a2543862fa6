"""What the rate of a growth law takes from the density: the surface that there is to remodel, or a power."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from growthx.common.checks import require_number
from growthx.common.overrides import Sealed
from growthx.common.renamed import renamed_fields
from growthx.constitutive.functions import between

if TYPE_CHECKING:
    from growthx.constitutive.energies import Elasticity

# S_v of the porosity p, in mm²/mm³ (R. B. Martin 1984, CRC Crit. Rev. Biomed. Eng. 10, 179): p, p², …, p⁵.
MARTIN = (32.3, -93.9, 134.0, -101.0, 28.8)


class RateFactor(Sealed, ABC, replaceable=()):
    """A factor of the mass source that depends on the density alone, at least 0."""

    @abstractmethod
    def factor(self, density: Any, material: Elasticity) -> Any:
        """The factor, of floats, arrays and UFL."""


@renamed_fields(unit="length_unit")
@dataclass(frozen=True)
class MartinSurface(RateFactor, replaceable=(), final=("factor",)):
    """S_v(p) ρₜ: surface per volume by Martin's polynomial of the porosity p = 1 − ρ/ρₜ, times the density of tissue.

    With it the rates of a law are those at which a surface moves: length per time and per stimulus.
    tissue_density: ρₜ (density), of bone without pores; a denser one has no surface.
    length_unit: how many millimetres there are in the unit of length.

    Example:
        >>> surface = gx.MartinSurface()
        >>> [f"{surface.factor(density, gx.Material(1.0)):.2f}" for density in (0.5, 1.0, 1.92)]
        ['5.55', '7.80', '0.00']
    """

    tissue_density: float = 1.92
    length_unit: float = 1.0

    def __post_init__(self) -> None:
        require_number(self.tissue_density, "the density of tissue ρₜ", "a positive number", lambda rho: rho > 0)
        require_number(
            self.length_unit, "the unit of length in millimetres", "a positive number", lambda length: length > 0
        )

    def factor(self, density: Any, material: Elasticity) -> Any:
        """S_v ρₜ, density per length."""
        porosity = between(1 - density / self.tissue_density, 0.0, 1.0)
        surface: Any = 0.0
        for coefficient in reversed(MARTIN):
            surface = porosity * (coefficient + surface)
        return surface * (self.length_unit * self.tissue_density)


@dataclass(frozen=True)
class PowerOfDensity(RateFactor, replaceable=(), final=("factor",)):
    """[ρ/ρ*]^q: the rate of a law in proportion to a power of the density.  exponent: q (no unit).

    Example:
        >>> gx.PowerOfDensity(exponent=2.0).factor(0.5, gx.Material(1.0))
        0.25
    """

    exponent: float = 1.0

    def __post_init__(self) -> None:
        require_number(self.exponent, "the exponent q of the rate", "a finite number", lambda _: True)

    def factor(self, density: Any, material: Elasticity) -> Any:
        """[ρ/ρ*]^q, no unit."""
        return (density / material.reference_density) ** self.exponent
