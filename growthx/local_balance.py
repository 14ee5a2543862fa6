"""The balance of mass at one point or in one cell: implicit Euler for the density at a given energy, for whole arrays.

    r(ρ) = ρ − ρₙ − Δt R₀(ρ, Ψ₀ⁿᵉᵒ) = 0

Where the source is R₀ = c { [ρ/ρ*]^(−1) D − S* }, as for n − m = −1, this is a quadratic with a root in closed form;
otherwise, a scalar Newton iteration (the paper's section 5.2).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from growthx.arrays import Floats, Indices, Marks
    from growthx.fields import Law
    from growthx.growth import GrowthLaw
    from growthx.material import Material

MAXIMUM_ITERATIONS = 100
CLOSE = 1e-9  # a Newton step of this size, relative to the density, leaves an error of its square
ROUND_OFF = 8 * np.finfo(float).eps


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

    def rate(self, density: Floats) -> Floats:
        """R₀, shape (densities,)."""
        if self.weights is None:
            return np.asarray(self.growth.mass_source(density, self.elastic_energy, self.material))
        growth, rho, material = self._beside_points(density)
        return self._mean(growth.mass_source(rho, self.elastic_energy, material))

    def slope(self, density: Floats) -> Floats:
        """∂_ρ R₀, shape (densities,)."""
        if self.weights is None:
            return np.asarray(self.growth.mass_source_slope(density, self.elastic_energy, self.material))
        growth, rho, material = self._beside_points(density)
        return self._mean(growth.mass_source_slope(rho, self.elastic_energy, material))

    @property
    def has_one_root(self) -> bool:
        """Whether the source nowhere rises with the density, so that the balance has one root at most."""
        return self.growth.power(self.material) <= 0

    @property
    def is_reciprocal(self) -> bool:
        """Whether R₀ = gain/ρ − loss."""
        return self.growth.power(self.material) == -1 and self.growth.dead_zone == 0

    def gain_and_loss(self) -> tuple[Floats, Floats]:
        """Gain c D ρ*, shape (densities,), and loss c S* of such a source."""
        growth, material = self.growth, self.material
        if self.weights is None:
            drive = growth.drive(self.elastic_energy, material)
        else:
            drive = self._mean(growth.drive(self.elastic_energy, _columns(material)))
        return drive * (growth.rate * material.reference_density), growth.rate * growth.attractor

    def at(self, some: Indices) -> LocalSource:
        """The sources of some of the densities."""
        return LocalSource(
            _at(self.growth, some),
            _at(self.material, some),
            self.elastic_energy[some],
            None if self.weights is None else self.weights[some],
        )

    def _beside_points(self, density: Floats) -> tuple[GrowthLaw, Floats, Material]:
        """One density for all its points: columns, to stand beside the rows of energies."""
        return _columns(self.growth), density[:, np.newaxis], _columns(self.material)

    def _mean(self, at_points: Floats) -> Floats:
        return np.asarray((self.weights * at_points).sum(axis=1))


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
    The old density of a later stage of a step may be below zero: for m ≥ n there is no other root to take for the one.
    """
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        if source.is_reciprocal:
            density = _root_of_quadratic(source, old_density, time_step)
        else:
            density = _iterate(source, old_density, time_step, guess)
        if not source.growth.is_bounded:
            return density
        direction = -1.0 if source.has_one_root else np.sign(source.rate(old_density))
        return _stopped(density, direction, source.growth.limits)


def _root_of_quadratic(source: LocalSource, old: Floats, time_step: float) -> Floats:
    """The positive root of ρ² − [ρₙ − Δt loss] ρ − Δt gain = 0; NaN if there is none above the round-off of ρₙ.

    The residual rises for all positive densities: there is no other root to take it for.
    """
    gain, loss = source.gain_and_loss()
    left = old - time_step * loss
    doubled = np.square(left)
    doubled += (4 * time_step) * gain
    np.sqrt(doubled, out=doubled)
    doubled += np.abs(left)
    density = doubled / 2
    eaten = left < 0  # where the difference of two numbers of the same sign would lose digits
    if eaten.any():
        density = np.where(eaten, 2 * time_step * gain / doubled, density)
    lost = ~((density > ROUND_OFF * np.abs(old)) & (density < np.inf))
    if lost.any():
        density[lost] = np.nan
    return density


def _stopped(density: Floats, direction: Floats | float, limits: tuple[float, float]) -> Floats:
    """Densities that have stopped at a bound which their way meets; without a root, the way leads on and on."""
    low, high = limits
    nowhere = np.isnan(density)
    density[nowhere & (direction < 0) & (low > 0)] = low
    density[nowhere & (direction > 0) & (high < np.inf)] = high
    return np.clip(density, low, high)


def _iterate(source: LocalSource, old: Floats, time_step: float, guess: Floats) -> Floats:
    """The roots that Newton's method finds in the direction of the source; NaN where it finds none."""
    density = np.where(np.isfinite(guess) & (guess > 0), guess, old)
    open_: Indices = np.arange(len(density))
    for _ in range(MAXIMUM_ITERATIONS):
        density[open_], over = _newton_step(source.at(open_), old[open_], time_step, density[open_])
        open_ = open_[~over]
        if len(open_) == 0:
            break
    density[open_] = np.nan
    if not source.has_one_root:
        density[~(np.sign(source.rate(old)) * (density - old) >= -CLOSE * old)] = np.nan
    return density


def _newton_step(source: LocalSource, old: Floats, time_step: float, rho: Floats) -> tuple[Floats, Marks]:
    """The next densities, and for which of them the iteration is over: found, or lost and NaN."""

    def slope_at(density: Floats) -> Floats:
        return np.asarray(1 - time_step * source.slope(density))

    residual = rho - old - time_step * source.rate(rho)
    slope = slope_at(rho)
    step = residual / slope
    # Newton, but not below half the density: r may fall down there.  Where it falls, towards where it rises.
    following = np.maximum(rho - step, rho / 2)
    falling = slope <= 0
    if falling.any():
        uphill = np.where(slope_at(rho / 2) > slope, rho / 2, 2 * rho)
        following = np.where(falling, uphill, following)
    found = ~falling & ((np.abs(step) <= CLOSE * rho) | (np.abs(residual) <= ROUND_OFF * old))
    lost = ~np.isfinite(residual) | (following < ROUND_OFF * old)
    return np.where(lost, np.nan, following), found | lost


def _at(law: Law, points: Indices) -> Law:
    """The law at some of the points, where its parameters are arrays over all of them."""
    return replace(law, **{name: value[points] for name, value in _arrays(law).items()})


def _columns(law: Law) -> Law:
    """The law with its varying parameters as columns, to stand beside rows of points."""
    return replace(law, **{name: value[:, np.newaxis] for name, value in _arrays(law).items()})


def _arrays(law: Law) -> dict[str, Floats]:
    varying = {name: getattr(law, name) for name in law.coefficients}
    return {name: value for name, value in varying.items() if isinstance(value, np.ndarray)}
