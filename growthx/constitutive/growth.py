"""Mass sources of the form R₀ = c { S − S* }, written once for floats, arrays and UFL.

A stimulus S meets its attractor S*.  The stimulus is a power of the density times a function of the elastic energy,

    S = [ρ/ρ*]^k D(Ψ₀ⁿᵉᵒ),

which each law states by its `power` k and its `drive` D.  For sources of other forms see `sources`.
"""

from __future__ import annotations

from abc import ABC
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

from growthx.common.arrays import Field, is_uniform
from growthx.common.checks import require, require_number
from growthx.constitutive.energies import Elasticity
from growthx.constitutive.functions import sqrt
from growthx.constitutive.sources import MassSource
from growthx.constitutive.stimulus import StimulusDriven, equivalent_strain

ROUNDING = 0.1  # share of a dead zone's half-width over which each of its edges is rounded


@dataclass(frozen=True)
class GrowthLaw(
    StimulusDriven,
    ABC,
    replaceable=("linear", "coefficients"),
    final=("mass_source", "mass_source_slope", "resting_rate"),
):
    """A mass source R₀ = c { S − S* } with a stimulus S yet to be stated.

    A law of one's own states `power`, of a material with a number n, and `drive`, `linear` if the drive is proportional
    to the energy, and names parameters of its own that may vary in space in `coefficients`.  Raises InputError, when
    the class is made, if it replaces anything else: see `overrides`.

    attractor: attractor stimulus S*, a number or a field, in the unit of the stimulus.
    rate: c (density per time and per stimulus), a number or a field.
    dead_zone: half-width of the zone about the attractor without a response (Carter's lazy zone), a number in the unit
    of the stimulus; its edges are rounded, so that the source is smooth.
    bounds: see `MassSource`.

    Example:
        >>> class Saturated(gx.GrowthLaw):
        ...     def power(self, material):
        ...         return material.density_exponent - 3
        ...     def drive(self, elastic_energy, material):
        ...         return elastic_energy / (1 + elastic_energy)
        >>> round(Saturated(attractor=0.5, rate=2.0).mass_source(1.0, 3.0, gx.Material(1.0)), 6)
        0.5
    """

    attractor: Field
    rate: Field = 1.0
    dead_zone: float = field(default=0.0, kw_only=True)

    coefficients: ClassVar = ("attractor", "rate")
    linear: ClassVar[bool] = False  # whether the drive is proportional to the elastic energy
    _linear_part = "drive"

    def __post_init__(self) -> None:
        require(self.attractor, "the attractor stimulus Ψ₀*", "a number of at least 0", lambda psi: psi >= 0)
        require(self.rate, "the growth rate c", "a number of at least 0", lambda c: c >= 0)
        require_number(self.dead_zone, "the dead zone's half-width", "a number of at least 0", lambda w: w >= 0)
        super().__post_init__()

    @property
    def is_linear(self) -> bool:
        """Whether the drive is proportional to the elastic energy, and there is no dead zone."""
        return self.linear and self.dead_zone == 0

    @property
    def at_points_alike(self) -> tuple[str, ...]:
        """The rate: attractors of the points of a cell have their mean where the drives have theirs."""
        return ("rate",)

    def without_growth(self) -> MassSource:
        """The law at a rate of zero."""
        return replace(self, rate=0.0, bounds=(None, None))

    @property
    def is_still(self) -> bool:
        """Whether the rate is zero everywhere."""
        return is_uniform(self.rate) and bool(self.rate == 0)

    def resting_rate(self, material: Elasticity) -> Any:
        """The resorption c S* without a stimulus, density per time."""
        return self.rate * self.attractor

    def rests_uniformly(self, material: Elasticity) -> bool:
        """Whether rate and attractor are numbers."""
        return is_uniform(self.rate) and is_uniform(self.attractor)

    def mass_source(self, density: Any, elastic_energy: Any, material: Elasticity) -> Any:
        """R₀ (6), density per time."""
        return self.rate * self._response(self.stimulus(density, elastic_energy, material) - self.attractor)

    def mass_source_slope(self, density: Any, elastic_energy: Any, material: Elasticity) -> Any:
        """∂_ρ R₀ = c k S/ρ, times the slope of the response at a dead zone, per time."""
        return self.mass_source_and_slope(density, elastic_energy, material)[1]

    def mass_source_and_slope(self, density: Any, elastic_energy: Any, material: Elasticity) -> tuple[Any, Any]:
        """R₀ and ∂_ρ R₀, whose stimulus is computed once."""
        stimulus = self.stimulus(density, elastic_energy, material)
        excess, slope = stimulus - self.attractor, self.rate * self.power_at(density, material) * stimulus / density
        if self.dead_zone == 0:
            return self.rate * excess, slope
        response, response_slope = self.response_and_slope(excess)
        return self.rate * response, slope * response_slope

    def _response(self, excess: Any) -> Any:
        """The excess of the stimulus over the attractor; with a dead zone, what of it lies outside."""
        return excess if self.dead_zone == 0 else self.response_and_slope(excess)[0]

    def response_and_slope(self, excess: Any) -> tuple[Any, Any]:
        """The response with a dead zone, odd in the excess x, and its slope, above 0, below 1, and rising with |x|.

        ½ [x − w + √((x − w)² + ε²)] − ½ [−x − w + √((x + w)² + ε²)], without the difference of the two roots.
        """
        width, soft = self.dead_zone, (ROUNDING * self.dead_zone) ** 2
        inner, outer = excess - width, excess + width
        root_inner, root_outer = sqrt(inner**2 + soft), sqrt(outer**2 + soft)
        response = excess * (1 - 2 * width / (root_inner + root_outer))
        return response, (inner / root_inner - outer / root_outer) / 2 + 1


@dataclass(frozen=True)
class _TemperedGrowth(GrowthLaw, replaceable=()):
    """A mass source with a stimulus of the weighted energy, tempered by [ρ/ρ*]^(−m)."""

    exponent: float = 3.0

    def __post_init__(self) -> None:
        super().__post_init__()
        require_number(self.exponent, "the exponent m", "a number of at least 0", lambda m: m >= 0)

    def power(self, material: Elasticity) -> Any:
        """The exponent n − m."""
        return material.density_exponent - self.exponent


@dataclass(frozen=True)
class EnergyDrivenGrowth(_TemperedGrowth, replaceable=()):
    """Mass source driven by the free energy, R₀ = c { [ρ/ρ*]^(−m) Ψ₀ − Ψ₀* } (6).

    attractor: attractor stimulus Ψ₀* (energy per reference volume).  rate: c (density per time and per energy per
    volume).  exponent: m (no unit); the model is well posed for m > n.

    Example:
        >>> law = gx.EnergyDrivenGrowth(attractor=0.02, rate=10.0)
        >>> print(f"{law.mass_source(1.0, 0.05, gx.Material(1.0)):.4f}")  # at a density and an energy per volume
        0.3000
    """

    linear = True

    def drive(self, elastic_energy: Any, material: Elasticity) -> Any:
        """Ψ₀ⁿᵉᵒ."""
        return elastic_energy


@dataclass(frozen=True)
class SpecificEnergyDrivenGrowth(GrowthLaw, replaceable=()):
    """Mass source driven by the energy per mass, R₀ = c { Ψ₀/ρ − k } (Huiskes 1987, Weinans 1992): the case m = 1.

    attractor: k (energy per mass).  rate: c (density per time and per energy per mass).

    Example:
        >>> law = gx.SpecificEnergyDrivenGrowth(attractor=0.02, rate=10.0)
        >>> print(f"{law.mass_source(1.0, 0.05, gx.Material(1.0)):.4f}")  # at a density and an energy per volume
        0.3000
    """

    linear = True

    def power(self, material: Elasticity) -> Any:
        """The exponent n − 1."""
        return material.density_exponent - 1

    def drive(self, elastic_energy: Any, material: Elasticity) -> Any:
        """Ψ₀ⁿᵉᵒ/ρ*, energy per mass."""
        return elastic_energy / material.reference_density


@dataclass(frozen=True)
class StrainDrivenGrowth(_TemperedGrowth, replaceable=()):
    """Mass source driven by an equivalent strain, R₀ = c { [ρ/ρ*]^(−m) ε − ε* }.

    ε = √(2 Ψ₀ⁿᵉᵒ/E) is the strain of a bar of the same elastic energy.
    attractor: ε* (no unit).  rate: c (density per time).  exponent: m (no unit).

    Example:
        >>> law = gx.StrainDrivenGrowth(attractor=0.1, rate=10.0)
        >>> print(f"{law.mass_source(1.0, 0.05, gx.Material(1.0)):.4f}")  # at a density and an energy per volume
        2.1623
    """

    exponent: float = 1.0

    linear = False

    def power(self, material: Elasticity) -> Any:
        """The exponent −m."""
        return -self.exponent

    def drive(self, elastic_energy: Any, material: Elasticity) -> Any:
        """√(2 Ψ₀ⁿᵉᵒ/E), rounded at rest."""
        return equivalent_strain(elastic_energy, material)


@dataclass(frozen=True)
class StressDrivenGrowth(_TemperedGrowth, replaceable=()):
    """Mass source driven by an equivalent stress, R₀ = c { [ρ/ρ*]^(−m) σ − σ* } (Carter, Beaupré 1987).

    σ = [ρ/ρ*]ⁿ √(2 E Ψ₀ⁿᵉᵒ) is the stress of a bar of the same elastic energy and density.
    attractor: σ* (stress).  rate: c (density per time and per stress).  exponent: m (no unit).

    Example:
        >>> law = gx.StressDrivenGrowth(attractor=0.1, rate=10.0)
        >>> print(f"{law.mass_source(1.0, 0.05, gx.Material(1.0)):.4f}")  # at a density and an energy per volume
        2.1623
    """

    linear = False

    def drive(self, elastic_energy: Any, material: Elasticity) -> Any:
        """√(2 E Ψ₀ⁿᵉᵒ), rounded at rest."""
        return material.stiffness * equivalent_strain(elastic_energy, material)
