"""The balance of mass at one point or in one cell: implicit Euler for the density at a given energy, for whole arrays.

    r(ρ) = ρ − ρₙ − Δt R₀(ρ, Ψ₀ⁿᵉᵒ) = 0

It is a quadratic for n − m = −1 and a scalar Newton iteration otherwise (the paper's section 5.2).
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from growthx.arrays import Floats, Indices, Marks
    from growthx.fields import Law
    from growthx.growth import EnergyDrivenGrowth
    from growthx.material import Material

MAXIMUM_ITERATIONS = 100
CLOSE = 1e-9  # a Newton step of this size, relative to the density, leaves an error of its square
ROUND_OFF = 8 * np.finfo(float).eps


def solve_density(
    growth: EnergyDrivenGrowth,
    material: Material,
    old_density: Floats,
    elastic_energy: Floats,
    time_step: float,
    guess: Floats,
) -> Floats:
    """Densities at the end of the time step; NaN where no positive one is continuous with the old density.

    All arrays have the shape (densities,).  A root counts only if it is reached from ρₙ as Δt grows from 0: r rises
    there, 1 − Δt ∂_ρR₀ > 0, and R₀(ρₙ) points to it.  The others, which exist for m < n, are not physical.  A root
    below the round-off of ρₙ counts as none.
    """
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        density = np.where(np.isfinite(guess) & (guess > 0), guess, old_density)
        open_: Indices = np.arange(len(density))
        for _ in range(MAXIMUM_ITERATIONS):
            density[open_], over = _newton_step(
                _at(growth, open_),
                _at(material, open_),
                old_density[open_],
                elastic_energy[open_],
                time_step,
                density[open_],
            )
            open_ = open_[~over]
            if len(open_) == 0:
                break
        density[open_] = np.nan
        direction = np.sign(growth.mass_source(old_density, elastic_energy, material))
        density[direction * (density - old_density) < -CLOSE * old_density] = np.nan
        return density


def _newton_step(
    growth: EnergyDrivenGrowth,
    material: Material,
    old: Floats,
    energy: Floats,
    time_step: float,
    rho: Floats,
) -> tuple[Floats, Marks]:
    """The next densities, and for which of them the iteration is over: found, or lost and NaN."""

    def slope_at(density: Floats) -> Floats:
        return np.asarray(1 - time_step * growth.mass_source_slope(density, energy, material))

    residual = rho - old - time_step * growth.mass_source(rho, energy, material)
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
    varying = {name: getattr(law, name) for name in law.coefficients}
    return replace(law, **{name: value[points] for name, value in varying.items() if isinstance(value, np.ndarray)})
