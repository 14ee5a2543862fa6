"""Whether a body begins beyond the bounds of its density: the first step moves it there, which is said."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from growthx.discretisation.discretisation import Discretisation

ROUND_OFF = 1e-12  # of a bound


def warn_if_beyond_bounds(problem: Discretisation) -> None:
    """Say on rank 0 what share of the volume that grows has an initial density beyond the law's bounds (collective)."""
    growth, spaces = problem.scene.growth, problem.spaces
    if not growth.is_bounded:
        return
    low, high = growth.limits
    density, weights = problem.density.x.array[spaces.growing], np.abs(spaces.volumes[spaces.growing])
    beyond = (density < low * (1 - ROUND_OFF)) | (density > high * (1 + ROUND_OFF))
    share, volume = spaces.comm.allreduce(np.array([weights @ beyond, weights.sum()]))
    lowest, highest = problem.density_range()
    if share > 0 and spaces.comm.rank == 0:
        logging.getLogger("growthx").warning(
            "growthx: the initial density of '%s', %.4g to %.4g, is beyond its bounds, %.4g to %.4g, in %.3g %% of the "
            "volume that grows: the first step moves it to them, and makes or takes the mass",
            problem.scene.name,
            lowest,
            highest,
            low,
            high,
            100 * share / volume,
        )
