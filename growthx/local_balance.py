"""The balance of mass at one point or in one cell: implicit Euler for the density at a given energy, for whole arrays.

    r(ρ) = ρ − ρₙ − Δt R₀(ρ, Ψ₀ⁿᵉᵒ) = 0

Without a dead zone the source is R₀ = c { [ρ/ρ*]^k D − S* }, of several points as of their mean: `power_balance` has
its root.  With one, a Newton iteration (the paper's section 5.2) is kept in an interval with that root and no other.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from growthx.bracketed_newton import quick_root, root_between
from growthx.local_path import bracket_on_path, follows
from growthx.power_balance import PowerBalance

if TYPE_CHECKING:
    from growthx.arrays import Floats, Indices
    from growthx.fields import Law
    from growthx.growth import GrowthLaw
    from growthx.material import Material

ROUND_OFF = 8 * np.finfo(float).eps
AT_REST = 1e-12  # energy below zero by round-off, as share of Young's modulus


@dataclass(frozen=True)
class LocalSource:
    """The mass source of each density as a function of that density alone, at given elastic energies.

    growth, material: laws whose varying parameters are arrays of shape (densities,).
    elastic_energy: Ψ₀ⁿᵉᵒ, shape (densities,), or at several points for each density, (densities, points).
    weights: shares of those points in the mean source of a density, (densities, points), each row with the sum one.
    """

    growth: GrowthLaw
    material: Material
    elastic_energy: Floats
    weights: Floats | None = None

    @property
    def power(self) -> float:
        """The exponent k of the relative density in the stimulus."""
        return self.growth.power(self.material)

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
        stimulus is to the attractor.
        """
        rates, factors, excesses, slopes = [], [], [], []
        for density in (one, other):
            growth, rho, material = self._beside_points(density)
            stimulus = growth.stimulus(rho, self.elastic_energy, material)
            excesses.append(stimulus - growth.attractor)
            response, slope = growth.response_and_slope(excesses[-1])
            rates.append(self._mean(growth.rate * response))
            factors.append(growth.rate * self.power * stimulus / rho)
            slopes.append(slope)
        through_attractor = excesses[0] * excesses[1] < 0
        flattest = np.where(through_attractor, growth.response_and_slope(0.0)[1], np.minimum(*slopes))
        bounds = np.minimum(*factors) * flattest, np.maximum(*factors) * np.maximum(*slopes)
        return rates[0], rates[1], self._mean(bounds[0]), self._mean(bounds[1])

    def gain_and_loss(self, time: float, dead_zone: float = 0.0) -> tuple[Floats, Floats]:
        """Δt c D ρ*^(−k) and Δt c S*, (densities,) each: without a dead zone, Δt R₀ = gain ρᵏ − loss.

        dead_zone: added to S*; with one of half-width w, Δt R₀ is at least that for w here and at most that for −w.
        """
        growth, material = self.growth, self.material
        drive = growth.drive(self.elastic_energy, material if self.weights is None else _columns(material))
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

    def _beside_points(self, density: Floats) -> tuple[GrowthLaw, Floats, Material]:
        """Parameters and densities to stand beside the energies: as columns where these are rows of several points."""
        if self.weights is None:
            return self.growth, density, self.material
        return _columns(self.growth), density[:, np.newaxis], _columns(self.material)

    def _mean(self, at_points: Floats) -> Floats:
        return np.asarray(at_points if self.weights is None else (self.weights * at_points).sum(axis=1))


def solve_density(
    source: LocalSource,
    old_density: Floats,
    time_step: float,
    guess: Floats,
) -> Floats:
    """Densities at the end of the time step; NaN where no positive one is continuous with the old density.

    All arrays have the shape (densities,).  guess: where an iteration starts, if there is one.
    A root counts only if it is reached from ρₙ as Δt grows from 0: r rises there, 1 − Δt ∂_ρR₀ > 0, and R₀(ρₙ)
    points to it.  The others, which exist for m < n, are not physical.  A root below the round-off of ρₙ counts as
    none.  Where the way from ρₙ to the root meets a bound of density, the density is that bound.
    The old density of a later stage of a step may be below zero: for m ≥ n there is no other root to take for the one;
    for m < n there is none then.
    """
    balance = LocalBalance(_with_energies_that_are_some(source), old_density, time_step)
    with np.errstate(all="ignore"):
        whole = source.growth.dead_zone == 0
        density = balance.power_balance().root(guess) if whole else balance.root(guess)
        lost = ~((density > ROUND_OFF * np.abs(old_density)) & (density < np.inf))
        if lost.any():
            density[lost] = np.nan
        if not source.growth.is_bounded:
            return density
        nowhere = np.flatnonzero(lost)
        density[nowhere] = balance.at(nowhere).end_without_root(source.growth.limits)
    return np.clip(density, *source.growth.limits)


def _with_energies_that_are_some(source: LocalSource) -> LocalSource:
    """At rest an energy may be below zero by round-off; what is further below is none: NaN."""
    energy = source.elastic_energy
    if energy.min(initial=0.0) == 0:
        return source
    young = source.material.young if source.weights is None else _columns(source.material).young
    rest = np.where(energy < -AT_REST * young, np.nan, 0.0)
    return replace(source, elastic_energy=np.where(energy < 0, rest, energy))


@dataclass(frozen=True)
class LocalBalance:
    """Balances of mass, one for each density: `bracketed_newton.Equations`.  old: ρₙ, shape (densities,)."""

    source: LocalSource
    old: Floats
    time_step: float

    def at(self, some: Indices) -> LocalBalance:
        """Some of the balances."""
        return LocalBalance(self.source.at(some), self.old[some], self.time_step)

    def change(self, density: Floats) -> Floats:
        """Δt R₀."""
        return self.time_step * self.source.rate(density)

    def linearised(self, density: Floats) -> tuple[Floats, Floats]:
        """Residual r and its derivative."""
        rate, slope = self.source.rate_and_slope(density)
        return density - self.old - self.time_step * rate, 1 - self.time_step * slope

    def size(self, density: Floats) -> Floats:
        """Size of the largest terms in r near its root."""
        growth = self.source.growth
        return np.asarray(density + np.abs(self.old) + self.time_step * growth.rate * growth.attractor)

    def power_balance(self, dead_zone: float = 0.0) -> PowerBalance:
        """The balances without the dead zone; dead_zone: see `LocalSource.gain_and_loss`."""
        gain, loss = self.source.gain_and_loss(self.time_step, dead_zone)
        return PowerBalance(self.old, loss, gain, self.source.power)

    def root(self, guess: Floats) -> Floats:
        """The roots, shape (densities,); where there is none, NaN or no positive number.  guess: where to start."""
        density, found = quick_root(self, np.where(guess > 0, guess, self.old))
        if self.source.power > 0:
            found &= follows(self.source, self.old, density)
        missed = np.flatnonzero(~found)
        if len(missed):
            safely = LocalBalance.root_on_path if self.source.power > 0 else LocalBalance.only_root
            density[missed] = safely(self.at(missed), guess[missed])
        return density

    def root_on_path(self, guess: Floats) -> Floats:
        """The roots for k > 0, of which there may be several."""
        return root_between(self, *bracket_on_path(self.source, self.old, self.time_step, guess), guess)

    def only_root(self, guess: Floats) -> Floats:
        """The roots for k ≤ 0, where r rises everywhere."""
        reference = self.source.material.reference_density + np.zeros_like(self.old)
        density = self.old + self.change(reference)  # the roots where the source does not depend on the density
        width = self.source.growth.dead_zone
        slow, fast = self.power_balance(width), self.power_balance(-width)
        depends = np.flatnonzero(~(slow.gain == 0))
        if self.source.power < 0 and len(depends):
            low, high = slow.at(depends).bracket()[0], fast.at(depends).bracket()[1]
            density[depends] = root_between(self.at(depends), low, high, guess[depends])
        return density

    def end_without_root(self, limits: tuple[float, float]) -> Floats:
        """The bounds that densities without a root run into, one for each; NaN where there is none."""
        direction = np.sign(self.change(self.old)) if self.source.power > 0 else -1.0
        bound = np.where(direction > 0, limits[1], limits[0]) + np.zeros_like(self.old)
        # Still on the way there.
        beyond = direction * (bound - self.old - self.change(bound)) < 0
        return np.where(beyond & (bound > 0) & (bound < np.inf), bound, np.nan)


def _at(law: Law, points: Indices) -> Law:
    """The law at some of the points, where its parameters are arrays over all of them."""
    return replace(law, **{name: value[points] for name, value in _arrays(law).items()})


def _columns(law: Law) -> Law:
    """The law with its varying parameters as columns, to stand beside rows of points."""
    return replace(law, **{name: value[:, np.newaxis] for name, value in _arrays(law).items()})


def _arrays(law: Law) -> dict[str, Floats]:
    varying = {name: getattr(law, name) for name in law.coefficients}
    return {name: value for name, value in varying.items() if isinstance(value, np.ndarray)}
