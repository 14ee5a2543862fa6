"""Remodelling with a lazy zone, rates of its own for formation and resorption, and what they saturate at.

    R₀ = A(ρ) { c₊ ⟨S − S* − w⟩ − c₋ ⟨S* − w − S⟩ },        w = w₀ + s S*

S: stimulus, S*: set point, w: half-width of the lazy zone, ⟨·⟩: positive part, A: what the rate takes from the density.
"""

from __future__ import annotations

from abc import ABC
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
import ufl

from growthx.common.arrays import Field, is_uniform
from growthx.common.checks import require, require_kind, require_number
from growthx.constitutive.energies import Elasticity
from growthx.constitutive.functions import is_symbolic, positive_part, smaller
from growthx.constitutive.laws.rates import RateFactor
from growthx.constitutive.sources import STEP
from growthx.constitutive.stimulus import StimulusDriven


@dataclass(frozen=True)
class Remodelling(
    StimulusDriven,
    ABC,
    replaceable=("coefficients",),
    final=("mass_source", "mass_source_slope", "resting_rate", "linear"),
):
    """A mass source that answers a stimulus yet to be stated by different rates above and below a lazy zone.

    A law of one's own states `power` and `drive`, as of a `GrowthLaw`, and names parameters of its own that may vary in
    space in `coefficients`.

    set_point: S*, a positive number or a field, in the unit of the stimulus.
    formation, resorption: c₊ and c₋ (density per time and per stimulus), numbers or fields.
    lazy_zone: w₀, in the unit of the stimulus.  relative_zone: s, a share of the set point, below one.
    most_formation, most_resorption: rates (density per time, before A) that are approached where the stimulus is far
    from the zone, x/[1 + x/most]; None: no such limit.
    rounding: share of the set point outside each edge of the zone over which the corner is rounded; beyond, the law is
    as it is written, and in the zone the source is zero.  The rate is off by 0.15 c rounding S* there at most.
    factor: A(ρ), a `MartinSurface` or a `PowerOfDensity`; None: one.
    memory: time τ over which the set point follows the stimulus, τ Ṡ* = S − S*, from the one that is given: cells
    become used to what they bear (Turner 1999, J. Biomech. 32, 399); None: it stays.
    bounds: see `MassSource`.

    Example:
        >>> class Saturated(gx.Remodelling):
        ...     def power(self, material):
        ...         return material.density_exponent - 3
        ...     def drive(self, elastic_energy, material):
        ...         return elastic_energy / (1 + elastic_energy)
        >>> print(f"{Saturated(0.5, formation=2.0, relative_zone=0.1).mass_source(1.0, 3.0, gx.Material(1.0)):.4f}")
        0.4000
    """

    set_point: Field
    formation: Field = 1.0
    resorption: Field = 1.0
    lazy_zone: float = field(default=0.0, kw_only=True)
    relative_zone: float = field(default=0.0, kw_only=True)
    most_formation: float | None = field(default=None, kw_only=True)
    most_resorption: float | None = field(default=None, kw_only=True)
    rounding: float = field(default=0.02, kw_only=True)
    factor: RateFactor | None = field(default=None, kw_only=True)
    memory: float | None = field(default=None, kw_only=True)

    coefficients: ClassVar = ("set_point", "formation", "resorption")

    def __post_init__(self) -> None:
        require(self.set_point, "the set point S*", "a positive number", lambda S: S > 0)
        require(self.formation, "the rate of formation", "a number of at least 0", lambda c: c >= 0)
        require(self.resorption, "the rate of resorption", "a number of at least 0", lambda c: c >= 0)
        require_number(self.lazy_zone, "the lazy zone's half-width", "a number of at least 0", lambda w: w >= 0)
        share = "the lazy zone's half-width as a share of the set point"
        require_number(self.relative_zone, share, "a number of at least 0 and below 1", lambda s: 0 <= s < 1)
        require_number(self.rounding, "the rounding of the lazy zone", "a share in (0, 1)", lambda r: 0 < r < 1)
        for most, what in ((self.most_formation, "formation"), (self.most_resorption, "resorption")):
            if most is not None:
                require_number(most, f"the most {what}", "a positive number or None", lambda rate: rate > 0)
        if self.memory is not None:
            require_number(self.memory, "the time of the memory", "a positive number or None", lambda time: time > 0)
        wanted = "a MartinSurface, a PowerOfDensity or None"
        require_kind(self.factor, (RateFactor, type(None)), "what the rate takes from the density", wanted)
        super().__post_init__()

    def response(self, stimulus: Any) -> Any:
        """What the stimulus S is answered by, density per time, before A(ρ)."""
        excess, soft = stimulus - self.set_point, self.rounding * self.set_point
        width, gain, loss = self.lazy_zone + self.relative_zone * self.set_point, self.formation, self.resorption
        gained, lost = positive_part(excess - width, soft), positive_part(-excess - width, soft)
        if self.lazy_zone == self.relative_zone == 0 and self.most_formation is None and self.most_resorption is None:
            common = smaller(gain, loss)  # has no corner
            return common * excess + (gain - common) * gained - (loss - common) * lost
        return _saturated(gain * gained, self.most_formation) - _saturated(loss * lost, self.most_resorption)

    def rate_factor(self, density: Any, material: Elasticity) -> Any:
        """A(ρ); 1 without a factor."""
        return 1.0 if self.factor is None else self.factor.factor(density, material)

    def mass_source(self, density: Any, elastic_energy: Any, material: Elasticity) -> Any:
        """R₀, density per time."""
        response = self.response(self.stimulus(density, elastic_energy, material))
        return response if self.factor is None else self.rate_factor(density, material) * response

    def restoring_slope(self, density: Any, elastic_energy: Any, material: Elasticity) -> Any:
        """∂_ρ R₀ at the same A(ρ), per time: a factor above zero moves no equilibrium and makes none unstable."""
        factor = self.rate_factor(density, material)
        if is_symbolic(density):
            rho = ufl.variable(density)
            return factor * ufl.diff(ufl.as_ufl(self.response(self.stimulus(rho, elastic_energy, material))), rho)
        step = STEP * np.abs(density)
        stimulus = self.stimulus(density + 1j * step, elastic_energy, material)
        return factor * np.imag(self.response(stimulus)) / step

    def resting_rate(self, material: Elasticity) -> Any:
        """The resorption without a stimulus or a zone at the reference density, density per time."""
        return self.rate_factor(material.reference_density, material) * self.resorption * self.set_point

    @property
    def remembers(self) -> bool:
        """Whether the set point follows the stimulus."""
        return self.memory is not None

    @property
    def is_still(self) -> bool:
        """Whether both rates are zero everywhere."""
        return all(is_uniform(rate) and rate == 0 for rate in (self.formation, self.resorption))


def _saturated(rate: Any, most: float | None) -> Any:
    return rate if most is None else rate / (1 + rate / most)
