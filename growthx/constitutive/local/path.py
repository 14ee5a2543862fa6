"""The way of a density from ρₙ to its root as Δt grows from 0, where the source rises with the density (k > 0).

A root ρ of ρ − ρₙ = Δt R₀(ρ) is passed at Δt(ρ) = [ρ − ρₙ]/R₀(ρ).  It goes on as Δt grows for as long as Δt(ρ) rises,
which it does where, with the direction d = ±1 of R₀(ρₙ),

    d N(ρ) > 0,        N(ρ) = R₀(ρ) − [ρ − ρₙ] ∂_ρR₀(ρ).

With a dead zone R₀ is neither convex nor concave, and N may change its sign more than once.  So the way is gone in
strides over which N is bounded: if the slope of R₀ lies between s₁ and s₂ from p to q, then so long

    d N ≥ d R₀(p) − |p − ρₙ| s₂ − |q − p| [s₂ − s₁].

A source of a form that is not known is gone along in the same way, with slopes from samples.  It mostly falls with the
density, or rises slowly: where Δt s₂ < 1, the way cannot end before Δt.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from growthx.common.arrays import Floats, Marks
    from growthx.constitutive.local.source import LocalSource

MAXIMUM_STRIDES = 1000
LEAST_STRIDE = np.finfo(float).eps  # all strides are relative to the density
UNGUESSED_STRIDE = 0.1
BEYOND_GUESS = 1.01, 1e-6  # the first stride goes so much further, by a factor and by a length


def bracket_on_path(source: LocalSource, old: Floats, time_step: float, guess: Floats) -> tuple[Floats, Floats]:
    """An interval of densities that holds the root which continues ρₙ, and no other; NaN where there is no such root.

    All arrays have the shape (densities,).  guess: where the root may be; it changes the strides, not the answer.
    """
    rate, slope = source.rate_and_slope(old)
    low, high = np.full((2, len(old)), np.nan)
    still = (old > 0) & (rate == 0) & (time_step * slope < 1)
    low[still] = high[still] = old[still]
    open_ = np.flatnonzero((old > 0) & np.isfinite(rate) & (rate != 0))
    source, start, here, direction = source.at(open_), old[open_], old[open_], np.sign(rate[open_])
    stride = _first_strides(start, guess[open_])
    for _ in range(MAXIMUM_STRIDES):
        there = here * np.exp(direction * stride)
        certain, _, rate = _stride(source, start, time_step, here, there)
        # Beyond an equilibrium on the way the source points back.
        reached = certain & (np.abs(there - start) >= time_step * direction * rate)
        low[open_[reached]] = np.minimum(here, there)[reached]
        high[open_[reached]] = np.maximum(here, there)[reached]
        here, stride = np.where(certain, there, here), np.where(certain, 2 * stride, stride / 2)
        # No root: where N vanishes, strides do, too; and density must not run into zero or to infinity.
        rest = np.flatnonzero(~reached & (stride > LEAST_STRIDE) & (here > LEAST_STRIDE * start) & (here < np.inf))
        if len(rest) == 0:
            break
        if len(rest) < len(open_):
            open_, source = open_[rest], source.at(rest)
            start, here, direction, stride = (each[rest] for each in (start, here, direction, stride))
    return low, high


def follows(source: LocalSource, old: Floats, time_step: float, density: Floats) -> Marks:
    """Where one stride from ρₙ to a root of r is enough to tell that it continues ρₙ, shape (densities,)."""
    certain, rate, _ = _stride(source, old, time_step, old, density)
    onward = (rate * (density - old) > 0) | ((rate == 0) & (density == old))
    return certain & onward & (old > 0)


def _stride(
    source: LocalSource, start: Floats, time_step: float, here: Floats, there: Floats
) -> tuple[Marks, Floats, Floats]:
    """Where the way to Δt does not end in a stride, and R₀ at its start and end."""
    rate, rate_there, flattest, steepest = source.between(here, there)
    least = np.abs(rate) - np.abs(here - start) * steepest - np.abs(there - here) * (steepest - flattest)
    certain = least > 0
    if not source.is_of_a_power:
        certain |= time_step * steepest < 1
    return certain, rate, rate_there


def _first_strides(start: Floats, guess: Floats) -> Floats:
    """Logarithms of the densities' ratios from the start to somewhat beyond the guess."""
    factor, length = BEYOND_GUESS
    stride = factor * np.abs(np.log(guess / start)) + length
    return np.where(np.isfinite(stride), stride, UNGUESSED_STRIDE)
