"""Newton's method for many scalar equations at once, each kept between two numbers that its root lies between."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import numpy as np

if TYPE_CHECKING:
    from growthx.common.arrays import Floats, Indices, Marks

QUICK_ITERATIONS = 5
MAXIMUM_ITERATIONS = 200  # bisections alone would need 64 to tell any two numbers apart
CLOSE = 1e-9  # a Newton step of this size, relative to the root, leaves an error of its square
ROUND_OFF = 4 * np.finfo(float).eps
FLAT = 1e-7  # slope of r at a double root, from round-off


class Equations(Protocol):
    """Scalar equations r(x) = 0, x > 0."""

    def at(self, some: Indices) -> Equations:
        """Some of them."""
        ...

    def linearised(self, x: Floats) -> tuple[Floats, Floats]:
        """Residual r and its derivative."""
        ...

    def size(self, x: Floats) -> Floats:
        """Size of the largest terms in r near its root, to which round-off is relative."""
        ...


def quick_root(equations: Equations, guess: Floats) -> tuple[Floats, Marks]:
    """What a few plain steps of Newton's method find, and where that is a root at which r rises."""
    x = guess
    for _ in range(QUICK_ITERATIONS):
        residual, slope = equations.linearised(x)
        step = residual / slope
        found = (np.abs(step) < CLOSE * x) & _rises(slope)
        x = x - step
        if found.all():
            break
    return x, found


def root_between(equations: Equations, low: Floats, high: Floats, guess: Floats) -> Floats:
    """The roots between `low`, where r ≤ 0, and `high`, where r ≥ 0; NaN where these are not numbers above zero.

    All arrays have the shape (equations,).  guess: where to start, if it lies between.
    A step that leaves the interval, or is not half as long as the last but one, is a bisection (of the logarithm)
    instead: the iteration cannot cycle, creep or leave the root that the interval holds.  Where r falls is none.
    """
    root = np.full(len(guess), np.nan)
    open_ = np.flatnonzero((low > 0) & (low <= high) & (high < np.inf))
    low, high = low[open_], high[open_]
    x: Floats = np.fmin(np.fmax(guess[open_], low), high)
    last: Floats = np.full(len(x), np.inf)
    before_last = last
    equations = equations.at(open_)
    for _ in range(MAXIMUM_ITERATIONS):
        residual, slope = equations.linearised(x)
        newton = x - residual / slope
        vanishing = (np.abs(residual) <= ROUND_OFF * equations.size(x)) & (slope > -FLAT)
        found = vanishing | ((np.abs(newton - x) <= CLOSE * x) & _rises(slope))
        root[open_[found]] = np.where(vanishing, x, newton)[found]
        rest = np.flatnonzero(~(found | np.isnan(residual) | (low == high)))
        if len(rest) == 0:
            break
        if len(rest) < len(x):
            open_, equations = open_[rest], equations.at(rest)
            x, low, high, residual, newton = (each[rest] for each in (x, low, high, residual, newton))
            last, before_last = last[rest], before_last[rest]
        low, high = np.where(residual < 0, x, low), np.where(residual > 0, x, high)
        short = 2 * _distance(x, newton) <= before_last
        following = np.where((newton > low) & (newton < high) & short, newton, np.sqrt(low) * np.sqrt(high))
        last, before_last = _distance(x, following), last
        x = following
    return root


def _rises(slope: Floats) -> Marks:
    """Where r rises; a slope that has overflown says nothing."""
    return (slope > 0) & (slope < np.inf)


def _distance(one: Floats, other: Floats) -> Floats:
    """Between two positive numbers, relative to the larger one."""
    return np.abs(one - other) / np.maximum(one, other)
