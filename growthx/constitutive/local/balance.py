"""The balance of mass at one point or in one cell: implicit Euler for the density at a given energy, for whole arrays.

    r(ρ) = ρ − ρₙ − Δt R₀(ρ, Ψ₀ⁿᵉᵒ) = 0

For R₀ = c { [ρ/ρ*]^k D − S* }, of several points as of their mean, `power` has its root.  With a dead zone, and
for any other source, a Newton iteration (the paper's section 5.2) is kept in an interval with that root and no other.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from growthx.constitutive.local.bracketed_newton import quick_root, root_between
from growthx.constitutive.local.path import bracket_on_path, follows
from growthx.constitutive.local.power import PowerBalance, alike
from growthx.constitutive.local.source import LocalSource, columns

if TYPE_CHECKING:
    from growthx.common.arrays import Floats, Indices


ROUND_OFF = 8 * np.finfo(float).eps
AT_REST = 1e-14  # energy below zero by round-off, as share of the stiffness


def solve_density(
    source: LocalSource,
    old_density: Floats,
    time_step: float,
    guess: Floats,
) -> Floats:
    """Densities at the end of the time step; NaN where no positive one is continuous with the old density.

    All arrays have the shape (densities,).  guess: where an iteration starts, if there is one.
    Exponents k that vary are solved for in a few groups of like ones.
    A root counts only if it is reached from ρₙ as Δt grows from 0: r rises there, 1 − Δt ∂_ρR₀ > 0, and R₀(ρₙ)
    points to it.  The others, which exist for m < n, are not physical.  A root below the round-off of ρₙ counts as
    none.  Where the way from ρₙ to the root meets a bound of density, the density is that bound.
    The old density of a later stage of a step may be below zero: for m ≥ n there is no other root to take for the one;
    for m < n, and for sources of other forms, there is none then.
    Of a source of another form slopes are known at samples alone: what is said of the way from ρₙ holds for sources
    that are smooth at the scale of a stride, which is chosen by what the samples say.
    """
    power = source.power if source.is_of_a_power else 0.0
    if not isinstance(power, np.ndarray):
        return _solve_alike(source, old_density, time_step, guess)
    density = np.empty_like(old_density)
    for some in alike(power):
        density[some] = _solve_alike(source.at(some), old_density[some], time_step, guess[some])
    return density


def _solve_alike(source: LocalSource, old_density: Floats, time_step: float, guess: Floats) -> Floats:
    """The same for one exponent k, or for such as are alike."""
    balance = LocalBalance(_with_energies_that_are_some(source), old_density, time_step)
    with np.errstate(all="ignore"):
        whole = source.is_of_a_power and source.law.dead_zone == 0
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
    stiffness = (source.material if source.weights is None else columns(source.material)).stiffness
    rest = np.where(energy < -AT_REST * stiffness, np.nan, 0.0)
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
        return np.asarray(density + np.abs(self.old) + self.time_step * self.source.resting_rate)

    def power_balance(self, dead_zone: float = 0.0) -> PowerBalance:
        """The balances without the dead zone; dead_zone: see `LocalSource.gain_and_loss`."""
        gain, loss = self.source.gain_and_loss(self.time_step, dead_zone)
        return PowerBalance(self.old, loss, gain, self.source.power)

    def root(self, guess: Floats) -> Floats:
        """The roots, shape (densities,); where there is none, NaN or no positive number.  guess: where to start."""
        density, found = quick_root(self, np.where(guess > 0, guess, self.old))
        rises = self.source.may_rise
        if rises:
            found &= follows(self.source, self.old, self.time_step, density)
        missed = np.flatnonzero(~found)
        if len(missed):
            safely = LocalBalance.root_on_path if rises else LocalBalance.only_root
            density[missed] = safely(self.at(missed), guess[missed])
        return density

    def root_on_path(self, guess: Floats) -> Floats:
        """The roots for k > 0, or of a source of any form, of which there may be several."""
        return root_between(self, *bracket_on_path(self.source, self.old, self.time_step, guess), guess)

    def only_root(self, guess: Floats) -> Floats:
        """The roots for k ≤ 0, where r rises everywhere."""
        reference = self.source.material.reference_density + np.zeros_like(self.old)
        density = self.old + self.change(reference)  # the roots where the source does not depend on the density
        width = self.source.law.dead_zone
        slow, fast = self.power_balance(width), self.power_balance(-width)
        depends = np.flatnonzero(~(slow.gain == 0))
        if np.all(self.source.power < 0) and len(depends):
            low, high = slow.at(depends).bracket()[0], fast.at(depends).bracket()[1]
            density[depends] = root_between(self.at(depends), low, high, guess[depends])
        return density

    def end_without_root(self, limits: tuple[float, float]) -> Floats:
        """The bounds that densities without a root run into, one for each; NaN where there is none."""
        direction = np.sign(self.change(self.old)) if self.source.may_rise else -1.0
        bound = np.where(direction > 0, limits[1], limits[0]) + np.zeros_like(self.old)
        # Still on the way there.
        beyond = direction * (bound - self.old - self.change(bound)) < 0
        return np.where(beyond & (bound > 0) & (bound < np.inf), bound, np.nan)
