"""The balance of mass at one point or in one cell: implicit Euler for the density at a given energy, for whole arrays.

    r(ρ) = ρ − ρₙ − Δt R₀(ρ, Ψ₀ⁿᵉᵒ) = 0

It is a quadratic for n − m = −1 and a scalar Newton iteration otherwise (the paper's section 5.2).
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from growthx.arrays import Floats, Indices
    from growthx.growth import EnergyDrivenGrowth
    from growthx.material import Material

MAXIMUM_ITERATIONS = 100
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

    All arrays have the shape (densities,).  A root is accepted only where r rises, 1 − Δt ∂_ρR₀ > 0: the others, which
    exist for m < n, are not reached from ρₙ as Δt grows from 0.
    """
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        density = np.where(np.isfinite(guess) & (guess > 0), guess, old_density)
        open_ = np.arange(len(density))
        for _ in range(MAXIMUM_ITERATIONS):
            rho, old, energy = density[open_], old_density[open_], elastic_energy[open_]
            law = _at(growth, open_)
            residual = rho - old - time_step * law.mass_source(rho, energy, material)
            slope = 1 - time_step * law.mass_source_slope(rho, energy, material)
            step = residual / slope
            # Never below half the density in one step: r need not be defined, or fall, down there.
            density[open_] = np.maximum(rho - step, rho / 2)
            falling = slope <= 0
            if falling.any():
                slope_below = 1 - time_step * law.mass_source_slope(rho / 2, energy, material)
                density[open_] = np.where(falling, np.where(slope_below > slope, rho / 2, 2 * rho), density[open_])
            done = ~falling & (np.abs(step) <= ROUND_OFF * rho)
            lost = ~np.isfinite(residual) | (rho < ROUND_OFF * old)
            density[open_[lost]] = np.nan
            open_ = open_[~(done | lost)]
            if len(open_) == 0:
                return density
        density[open_] = np.nan
        return density


def _at(growth: EnergyDrivenGrowth, points: Indices) -> EnergyDrivenGrowth:
    """The law at some of the points, where its parameters are arrays over all of them."""
    values: dict[str, Any] = {name: getattr(growth, name) for name in growth.coefficients}
    here: dict[str, Any] = {name: value[points] for name, value in values.items() if isinstance(value, np.ndarray)}
    return replace(growth, **here)
