"""The mass source of each density as a function of that density alone, for whole arrays."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from growthx.common.arrays import changed
from growthx.constitutive.growth import GrowthLaw

if TYPE_CHECKING:
    from growthx.common.arrays import Floats, Indices, Law
    from growthx.constitutive.energies import Elasticity
    from growthx.constitutive.sources import MassSource

# Where on the way between two densities slopes of a source of any form are looked at.
SAMPLES = np.linspace(0.0, 1.0, 5)
BETWEEN = 0.25  # of the range of these slopes, by which others between them may lie beyond it


@dataclass(frozen=True)
class LocalSource:
    """The mass source of each density as a function of that density alone, at given elastic energies.

    growth, material: laws whose varying parameters are arrays of shape (densities,).
    elastic_energy: Ψ₀ⁿᵉᵒ, shape (densities,), or at several points for each density, (densities, points).
    weights: shares of those points in the mean source of a density, (densities, points), each row with the sum one.
    """

    growth: MassSource
    material: Elasticity
    elastic_energy: Floats
    weights: Floats | None = None

    @property
    def law(self) -> GrowthLaw:
        """The mass source, which must have the form c { [ρ/ρ*]^k D − S* }."""
        assert isinstance(self.growth, GrowthLaw)
        return self.growth

    @property
    def is_of_a_power(self) -> bool:
        """Whether the stimulus goes with a power of the density, which tells where roots are."""
        return isinstance(self.growth, GrowthLaw) and self.material.is_of_a_power

    @property
    def power(self) -> float | Floats:
        """The exponent k of the relative density in the stimulus: one for all or, where n varies, one for each."""
        power: float | Floats = self.law.power(self.material)
        return power

    @property
    def may_rise(self) -> bool:
        """Whether the source may rise with the density: that of a power, for k > 0 in all, exponents that are alike."""
        return not self.is_of_a_power or bool(np.all(self.power > 0))

    @property
    def resting_rate(self) -> Floats:
        """What rates of density are measured against, density per time."""
        return np.asarray(self.growth.resting_rate(self.material))

    def rate(self, density: Floats) -> Floats:
        """R₀, shape (densities,)."""
        growth, rho, material = self._beside_points(density)
        return self._mean(growth.mass_source(rho, self.elastic_energy, material))

    def rate_and_slope(self, density: Floats) -> tuple[Floats, Floats]:
        """R₀ and ∂_ρ R₀, shape (densities,) each."""
        growth, rho, material = self._beside_points(density)
        rate, slope = growth.mass_source_and_slope(rho, self.elastic_energy, material)
        return self._mean(rate), self._mean(slope)

    def between(self, one: Floats, other: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """R₀ at two densities, and numbers that ∂_ρ R₀ lies between from one to the other, shape (densities,) each.

        For k > 0 and a dead zone: S/ρ is monotonic in the density, and the response is the flatter the nearer the
        stimulus is to the attractor.  Of any other source they are an estimate from samples.
        """
        if not self.is_of_a_power:
            return self._between_by_samples(one, other)
        rates, factors, excesses, slopes = [], [], [], []
        for density in (one, other):
            _, rho, material = self._beside_points(density)
            growth = self.law if self.weights is None else columns(self.law)
            stimulus = growth.stimulus(rho, self.elastic_energy, material)
            excesses.append(stimulus - growth.attractor)
            response, slope = growth.response_and_slope(excesses[-1])
            rates.append(self._mean(growth.rate * response))
            factors.append(growth.rate * growth.power(material) * stimulus / rho)
            slopes.append(slope)
        through_attractor = excesses[0] * excesses[1] < 0
        flattest = np.where(through_attractor, growth.response_and_slope(0.0)[1], np.minimum(*slopes))
        bounds = np.minimum(*factors) * flattest, np.maximum(*factors) * np.maximum(*slopes)
        return rates[0], rates[1], self._mean(bounds[0]), self._mean(bounds[1])

    def _between_by_samples(self, one: Floats, other: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        found = [self.rate_and_slope(one + share * (other - one)) for share in SAMPLES]
        slopes = np.array([slope for _, slope in found])
        flattest, steepest = slopes.min(axis=0), slopes.max(axis=0)
        beyond = BETWEEN * (steepest - flattest)
        return found[0][0], found[-1][0], flattest - beyond, steepest + beyond

    def gain_and_loss(self, time: float, dead_zone: float = 0.0) -> tuple[Floats, Floats]:
        """Δt c D ρ*^(−k) and Δt c S*, (densities,) each: without a dead zone, Δt R₀ = gain ρᵏ − loss.

        dead_zone: added to S*; with one of half-width w, Δt R₀ is at least that for w here and at most that for −w.
        """
        growth, material = self.law, self.material
        # A drive may depend on any of its law's parameters.
        law, beside = (growth, material) if self.weights is None else (columns(growth), columns(material))
        drive = law.drive(self.elastic_energy, beside)
        gain = self._mean(drive) * (time * growth.rate * material.reference_density**-self.power)
        return gain, np.broadcast_to(time * growth.rate * (growth.attractor + dead_zone), gain.shape)

    def at(self, some: Indices) -> LocalSource:
        """The sources of some of the densities."""
        return LocalSource(
            _at(self.growth, some),
            _at(self.material, some),
            self.elastic_energy[some],
            None if self.weights is None else self.weights[some],
        )

    def _beside_points(self, density: Floats) -> tuple[MassSource, Floats, Elasticity]:
        """Parameters and densities to stand beside the energies: as columns where these are rows of several points."""
        if self.weights is None:
            return self.growth, density, self.material
        return columns(self.growth), density[:, np.newaxis], columns(self.material)

    def _mean(self, at_points: Floats) -> Floats:
        return np.asarray(at_points if self.weights is None else (self.weights * at_points).sum(axis=1))


def _at(law: Law, points: Indices) -> Law:
    """The law at some of the points, where its parameters are arrays over all of them."""
    return changed(law, lambda value: value[points] if isinstance(value, np.ndarray) else value)


def columns(law: Law) -> Law:
    """The law with its varying parameters as columns, to stand beside rows of points."""
    return changed(law, lambda value: value[:, np.newaxis] if isinstance(value, np.ndarray) else value)
