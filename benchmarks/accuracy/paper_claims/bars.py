"""Runs of the bars that several statements share, and what is measured on them."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np

import growthx as gx
from growthx.scenes.bar import CONTINUOUS, DISCONTINUOUS, Problem, bar, equilibrium, lower_edge

if TYPE_CHECKING:
    from growthx.common.arrays import Floats

MESHES = (10, 40, 100)
NODAL = (gx.Q1Q1, gx.Q2Q2, gx.S2Q1)
LOCAL = (gx.Q1, gx.Q2, gx.Q1sri, gx.S2fri)
INNER = (0.25, 0.75)  # of the length: the clamped end is not felt there


@cache
def solved(problem: Problem, elements: int, variant: gx.Variant) -> gx.Result:
    """A bar at the end of its run."""
    return gx.solve(bar(problem, elements), variant)


@cache
def _levels(x: float) -> float:
    return float(equilibrium(bar(DISCONTINUOUS, 10), DISCONTINUOUS, x).density)


def profile(elements: int, variant: gx.Variant) -> tuple[Floats, Floats, Floats]:
    """Places, densities and semi-analytic ones along the inner part of the stepped bar."""
    places = lower_edge(DISCONTINUOUS)
    places = places[(places[:, 0] > INNER[0]) & (places[:, 0] < INNER[1])]
    density = solved(DISCONTINUOUS, elements, variant).problem.sample_density(places)
    exact = np.array([_levels(float(np.floor(x * 10) / 10 + 0.05)) for x in places[:, 0]])
    return places[:, 0], density, exact


def overshoot(elements: int, variant: gx.Variant) -> float:
    """Highest density over the highest plateau, relative to ρ*; at least zero."""
    _, density, exact = profile(elements, variant)
    return max(float(density.max() - exact.max()), 0.0)


def jump_error(elements: int, variant: gx.Variant) -> float:
    """Distance from the semi-analytic plateaus over the inner part: root mean square, relative."""
    _, density, exact = profile(elements, variant)
    return float(np.linalg.norm(density - exact) / np.linalg.norm(exact))


def front_width(elements: int, variant: gx.Variant) -> float:
    """Width of the front at x = 0.4: the step between its levels over the steepest slope."""
    x, density, exact = profile(elements, variant)
    here = (x > 0.35) & (x < 0.45)
    step = exact[here].max() - exact[here].min()
    return float(step / np.abs(np.gradient(density[here], x[here])).max())


def smooth_error(elements: int, variant: gx.Variant) -> float:
    """Distance of the tapered bar's density from Q2's on 400 cells along the lower edge: root mean square, relative.

    Without the ends, where the clamp and the load's edge are singular.
    """
    places = lower_edge(CONTINUOUS)
    places = places[(places[:, 0] > 0.05) & (places[:, 0] < 0.95)]
    density, exact = (
        solved(CONTINUOUS, *of).problem.sample_density(places) for of in ((elements, variant), (400, gx.Q2))
    )
    return float(np.linalg.norm(density - exact) / np.linalg.norm(exact))
