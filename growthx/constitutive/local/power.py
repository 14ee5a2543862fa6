"""The balance of mass of a law without a dead zone: density, less a loss, plus a gain with a power of the density.

    r(ρ) = ρ − ρₙ + l − g ρᵏ = 0,        l, g ≥ 0

Its root is the one that is reached from ρₙ as Δt, and with it l and g, grow from 0.  On the way ρ moves in the
direction of g ρₙᵏ − l, and r rises at it.  That tells it from all others, since ρᵏ is convex or concave:

- k ≤ 0: r rises everywhere and has one root.
- 0 < k < 1: r is convex, falls to its bottom and rises from there.  Of its two roots the upper one is meant.
- k > 1: r is concave, rises to its top and falls from there.  The lower one is meant.
- k = 1: r rises everywhere or nowhere.

So ρₙ and a point between the two roots bound an interval that holds this root and no other; without a change of sign on
it there is none.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from growthx.constitutive.local.bracketed_newton import root_between

if TYPE_CHECKING:
    from growthx.common.arrays import Floats, Indices, Marks

QUICK_ITERATIONS = 4
# A step of Halley's method of this size, corrected by that much, leaves an error below round-off.
CLOSE, CORRECTION = 1e-6, 1e-5
ROUND_OFF = 8 * np.finfo(float).eps
MARGIN = 1e-9  # of intervals, well above round-off


def alike(exponents: Floats) -> list[Indices]:
    """The exponents in groups, as indices, in each of which the same is to be done: see above, and closed forms."""
    bounds = np.array([-1.0, 0.0, 1.0])
    kinds = np.searchsorted(bounds, exponents, "left") + np.searchsorted(bounds, exponents, "right")
    return [np.flatnonzero(kinds == kind) for kind in np.unique(kinds)]


def at_some(exponent: float | Floats, some: Indices | Marks) -> float | Floats:
    """Some of the exponents, or the one for all."""
    return exponent[some] if isinstance(exponent, np.ndarray) else exponent


@dataclass(frozen=True)
class PowerBalance:
    """Balances ρ = ρₙ − l + g ρᵏ.

    old: ρₙ, positive where k > 0.  loss, gain: l and g ≥ 0.  All have the shape (densities,).
    exponent: k, a number or an array of `alike` ones.
    """

    old: Floats
    loss: Floats
    gain: Floats
    exponent: float | Floats

    def at(self, some: Indices | Marks) -> PowerBalance:
        """Some of the balances."""
        return PowerBalance(self.old[some], self.loss[some], self.gain[some], at_some(self.exponent, some))

    @property
    def base(self) -> Floats:
        """ρₙ − l."""
        return self.old - self.loss

    def root(self, guess: Floats) -> Floats:
        """The roots, shape (densities,); where there is none, NaN or no positive number.  guess: where to start."""
        k = self.exponent
        if np.all(k == -1):
            return self._root_of_quadratic()
        if np.all(k == 0):
            return np.asarray(self.old + (self.gain - self.loss))
        if np.all(k == 1):
            return np.where(self.gain < 1, self.base / (1 - self.gain), np.nan)
        return self.iterated_root(guess)

    def iterated_root(self, guess: Floats) -> Floats:
        """The same without a closed form, for any k but 0 and 1."""
        density, found = self._quick_root(guess)
        missed = np.flatnonzero(~found)
        if len(missed):
            some = self.at(missed)
            density[missed] = root_between(some, *some.bracket(), guess[missed])
        return density

    def linearised(self, density: Floats) -> tuple[Floats, Floats]:
        """Residual r and its derivative."""
        power = self.gain * density**self.exponent
        return density - self.base - power, 1 - self.exponent * power / density

    def size(self, density: Floats) -> Floats:
        """Size of the largest terms in r near its root."""
        return np.asarray(density + np.abs(self.base))

    def bracket(self) -> tuple[Floats, Floats]:
        """An interval that holds the root and no other, r changing sign from − to +; (NaN, NaN) if there is no root."""
        if np.all(self.exponent < 0):
            return self._bracket_of_the_only_root()
        k, base, direction = self.exponent, self.base, self._direction()
        if np.all(k < 1):
            even = self.gain ** (1 / (1 - k))  # where ρ = g ρᵏ; from there r rises by 1 − k at least
            bottom = (k * self.gain) ** (1 / (1 - k))
            up = (self.old, np.maximum(np.maximum(base, even) + np.maximum(base, 0) / (1 - k), self.old))
            down = (np.maximum(bottom, base), self.old)
            exists = np.where(direction > 0, True, (bottom <= self.old) & ((base > 0) | (self._residual(bottom) <= 0)))
        else:
            between = base * k / (k - 1)  # the two roots, where there are two; top of r/ρᵏ
            up, down = (self.old, between), (base, self.old)
            exists = np.where(direction > 0, (between >= self.old) & (self._residual(between) >= 0), base > 0)
        low, high = np.where(direction > 0, up, down)
        still = direction == 0
        low[still] = high[still] = self.old[still]
        exists[still] = self._slope(self.old[still], still) > 0
        low[~exists] = high[~exists] = np.nan
        return low, high

    def _bracket_of_the_only_root(self) -> tuple[Floats, Floats]:
        """For k < 0: the larger two of the terms ρ, |base| and g ρᵏ are no more than twice one another."""
        k, base, gain = self.exponent, self.base, self.gain
        even = gain ** (1 / (1 - k))  # where ρ = g ρᵏ
        low = np.maximum(base, even)
        high = base + gain * low**k
        below = np.flatnonzero(base < 0)
        if len(below):  # high powers for small k, which make much of round-off
            deficit, gain, even, power = -base[below], gain[below], even[below], -1 / at_some(k, below)
            high[below] = np.minimum((gain / deficit * (1 + ROUND_OFF)) ** power, even)
            low[below] = (gain / (deficit + high[below]) * (1 - ROUND_OFF)) ** power
        return np.maximum(low * (1 - MARGIN), np.finfo(float).tiny), high * (1 + MARGIN)

    def _quick_root(self, guess: Floats) -> tuple[Floats, Marks]:
        """What Halley's method finds in a few iterations, and where that is the root: nearly everywhere."""
        k, base = self.exponent, self.base
        density = np.where(guess > 0, guess, self.old)
        for _ in range(QUICK_ITERATIONS):
            power = self.gain * density**k
            slope = density - k * power  # both times the density
            step = (density - base - power) / slope
            correction = step * power
            correction /= slope
            correction *= k * (1 - k) / 2
            close = (np.abs(step) <= CLOSE) & (np.abs(correction) <= CORRECTION) & (slope < np.inf)
            density = density - density * (step / (1 - correction))
            if close.all():
                break
        if np.all(k > 0):
            onward = self._direction() * (density - self.old) >= -ROUND_OFF * self.old
            close &= (slope > 0) & onward
        return density, close & (density > 0)

    def _direction(self) -> Floats:
        """To which side of ρₙ the root lies, for k > 0; NaN where ρₙ is not positive."""
        old = np.where(self.old > 0, self.old, np.nan)
        return np.sign(self.gain * old**self.exponent - self.loss)

    def _residual(self, density: Floats) -> Floats:
        return density - self.base - self.gain * density**self.exponent

    def _slope(self, density: Floats, some: Marks) -> Floats:
        k = at_some(self.exponent, some)
        return np.asarray(1 - k * self.gain[some] * density ** (k - 1))

    def _root_of_quadratic(self) -> Floats:
        """The positive root of ρ² − base ρ − g = 0."""
        half = self.base
        half /= 2
        density = np.square(half)
        density += self.gain
        np.sqrt(density, out=density)
        density += np.abs(half)
        eaten = half < 0  # where the difference of two numbers of the same sign would lose digits
        if eaten.any():
            density = np.where(eaten, self.gain / density, density)
        return density
