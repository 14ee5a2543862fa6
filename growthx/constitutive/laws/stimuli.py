"""Remodelling by the stimuli of the literature: energy per volume or mass, strain, daily stress of the tissue."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from growthx.common.checks import require_number
from growthx.constitutive.energies import Elasticity
from growthx.constitutive.laws.remodelling import Remodelling
from growthx.constitutive.stimulus import equivalent_strain


@dataclass(frozen=True)
class EnergyRemodelling(Remodelling, replaceable=()):
    """Driven by the energy per volume, S = [ρ/ρ*]^(−m) Ψ₀ (the paper's stimulus, with another response).

    set_point: energy per reference volume.  exponent: m (no unit); the model is well posed for m > n.

    Example:
        >>> law = gx.EnergyRemodelling(0.02, formation=10.0, resorption=5.0, relative_zone=0.1)
        >>> print(f"{law.mass_source(1.0, 0.05, gx.Material(1.0)):.4f}")  # at a density and an energy per volume
        0.2800
    """

    exponent: float = 3.0

    def __post_init__(self) -> None:
        super().__post_init__()
        require_number(self.exponent, "the exponent m", "a number of at least 0", lambda m: m >= 0)

    def power(self, material: Elasticity) -> Any:
        """The exponent n − m."""
        return material.density_exponent - self.exponent

    def drive(self, elastic_energy: Any, material: Elasticity) -> Any:
        """Ψ₀ⁿᵉᵒ."""
        return elastic_energy


@dataclass(frozen=True)
class SpecificEnergyRemodelling(Remodelling, replaceable=()):
    """Driven by the energy per mass, S = Ψ₀/ρ, about a set point k with a lazy zone [1 ± s] k.

    Huiskes et al. 1987 (J. Biomech. 20, 1135); Weinans et al. 1992 without a zone.  set_point: energy per mass, of each
    region if it is a mapping.

    Example:
        >>> law = gx.SpecificEnergyRemodelling(0.02, formation=10.0, relative_zone=0.1)
        >>> print(f"{law.mass_source(1.0, 0.05, gx.Material(1.0)):.4f}")  # at a density and an energy per volume
        0.2800
    """

    def power(self, material: Elasticity) -> Any:
        """The exponent n − 1: the model is well posed for n < 1 alone."""
        return material.density_exponent - 1

    def drive(self, elastic_energy: Any, material: Elasticity) -> Any:
        """Ψ₀ⁿᵉᵒ/ρ*, energy per mass."""
        return elastic_energy / material.reference_density


@dataclass(frozen=True)
class StrainRemodelling(Remodelling, replaceable=()):
    """Driven by an equivalent strain, S = [ρ/ρ*]^(−m) √(2 Ψ₀ⁿᵉᵒ/E): a mechanostat (Frost 1987) for m = 0.

    set_point: no unit.  exponent: m (no unit); at m = 0 the strain does not fall with the density by itself.

    Example:
        >>> law = gx.StrainRemodelling(0.1, formation=10.0, most_formation=2.0, exponent=0.0)
        >>> print(f"{law.mass_source(1.0, 0.05, gx.Material(1.0)):.4f}")  # at a density and an energy per volume
        1.0390
    """

    exponent: float = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        require_number(self.exponent, "the exponent m", "a number of at least 0", lambda m: m >= 0)

    def power(self, material: Elasticity) -> Any:
        """The exponent −m."""
        return -self.exponent

    def drive(self, elastic_energy: Any, material: Elasticity) -> Any:
        """√(2 Ψ₀ⁿᵉᵒ/E), rounded at rest."""
        return equivalent_strain(elastic_energy, material)


@dataclass(frozen=True)
class DailyStressRemodelling(Remodelling, replaceable=()):
    """Driven by the daily stress of the tissue, ψ = [Σ nᵢ σᵢᵐ]^(1/m), σᵢ = [ρₜ/ρ]^q √(2 E [ρ/ρ*]ⁿ Ψ₀ᵢ).

    Carter, Fyhrie & Whalen 1987 (J. Biomech. 20, 785), Beaupré, Orr & Carter 1990 (J. Orthop. Res. 8, 651) and Jacobs
    et al. 1995.  E [ρ/ρ*]ⁿ is the stiffness that the density has made; of several load cases nᵢ is `cycles` times the
    share of the case's weight in all weights.

    set_point: ψ* (stress).  cycles: Σ nᵢ per day.  exponent: m (no unit), at least 1.  tissue_density: ρₜ (density).
    concentration: q (no unit), from stress of the continuum to that of the tissue; well posed for q > n.

    Example:
        >>> law = gx.DailyStressRemodelling(0.5, cycles=3000.0, exponent=4.0, lazy_zone=0.1)
        >>> print(f"{law.mass_source(1.0, 0.05, gx.Material(1.0)):.4f}")  # at a density and an energy per volume
        8.0275
    """

    cycles: float = 1.0
    exponent: float = 4.0
    tissue_density: float = 1.92
    concentration: float = 2.0

    def __post_init__(self) -> None:
        super().__post_init__()
        require_number(self.cycles, "the number of cycles per day", "a positive number", lambda n: n > 0)
        require_number(self.exponent, "the exponent m of the daily stress", "a number of at least 1", lambda m: m >= 1)
        require_number(self.tissue_density, "the density of tissue ρₜ", "a positive number", lambda rho: rho > 0)
        require_number(
            self.concentration, "the exponent q of the tissue's stress", "a number of at least 0", _not_below
        )

    @property
    def mean_exponent(self) -> float:
        """m/2: of energies, whose root the stress is."""
        return self.exponent / 2

    def power(self, material: Elasticity) -> Any:
        """The exponent n − q."""
        return material.density_exponent - self.concentration

    def drive(self, elastic_energy: Any, material: Elasticity) -> Any:
        """[Σ nᵢ]^(1/m) [ρₜ/ρ*]^q √(2 E Ψ₀ⁿᵉᵒ), rounded at rest (stress)."""
        tissue = (self.tissue_density / material.reference_density) ** self.concentration
        often = self.cycles ** (1 / self.exponent)
        return often * tissue * material.stiffness * equivalent_strain(elastic_energy, material)


def _not_below(value: float) -> bool:
    return value >= 0
