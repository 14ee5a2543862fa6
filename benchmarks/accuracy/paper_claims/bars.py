"""Runs of the bars that several statements share, and what is measured on them.

Densities are compared with the semi-analytic ones, which the tapered bar's meet to 2e-6 away from its kink, between
the clamped end and the loaded one, neither of which these know.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np

import growthx as gx
from growthx.scenes.bar import CONTINUOUS, DISCONTINUOUS, Problem, bar, equilibrium, lower_edge

if TYPE_CHECKING:
    from growthx.common.arrays import Floats

MESHES = (10, 40, 100)
FINE = (*MESHES, 400)
NODAL = (gx.Q1Q1, gx.Q2Q2, gx.S2Q1)
LOCAL = (gx.Q1, gx.Q2, gx.Q1sri, gx.S2fri)
INNER = {DISCONTINUOUS.name: (0.25, 0.75), CONTINUOUS.name: (0.05, 0.95)}  # of the length
SAMPLES = 8000


@cache
def solved(problem: Problem, elements: int, variant: gx.Variant) -> gx.Result:
    """A bar at the end of its run."""
    return gx.solve(bar(problem, elements), variant)


@cache
def places(problem: Problem) -> Floats:
    """Those on the lower edge of the inner part."""
    edge = lower_edge(problem, SAMPLES if problem is DISCONTINUOUS else SAMPLES // 4)
    low, high = INNER[problem.name]
    return edge[(edge[:, 0] > low) & (edge[:, 0] < high)]


@cache
def exact(problem: Problem) -> Floats:
    """Semi-analytic densities there."""
    x, scene = places(problem)[:, 0], bar(problem, 10)
    if problem is CONTINUOUS:  # smooth from either end to mid-length, so that few places tell it to 1e-9
        nearer, at = 0.5 - np.abs(x - 0.5), 0.25 * (1 - np.cos(np.pi * (np.arange(16) + 0.5) / 16))
        known = [float(equilibrium(scene, problem, float(each)).density) for each in at]
        return np.asarray(np.polynomial.Chebyshev.fit(at, known, 15, domain=[0, 0.5])(nearer))
    levels = {each: equilibrium(scene, problem, (each + 0.5) / 10).density for each in range(10)}
    return np.array([levels[int(each)] for each in np.floor(10 * x)])


@cache
def density(problem: Problem, elements: int, variant: gx.Variant) -> Floats:
    """Computed densities there."""
    return solved(problem, elements, variant).problem.sample_density(places(problem))


def distance(problem: Problem, elements: int, variant: gx.Variant) -> float:
    """From the semi-analytic density, in L², relative."""
    right = exact(problem)
    return float(np.linalg.norm(density(problem, elements, variant) - right) / np.linalg.norm(right))


def overshoot(elements: int, variant: gx.Variant) -> float:
    """Highest density over the highest plateau, relative to ρ*, among the values that are solved for and those between.

    At least zero.
    """
    done = solved(DISCONTINUOUS, elements, variant).problem
    low, high = INNER[DISCONTINUOUS.name]
    x = done.density_positions()[:, 0]
    values = done.density.x.array[(x > low) & (x < high)]
    highest = max(float(values.max()), float(density(DISCONTINUOUS, elements, variant).max()))
    return max(highest - float(exact(DISCONTINUOUS).max()), 0.0)


def needless_variation(elements: int, variant: gx.Variant) -> float:
    """Ups and downs of the density beyond those of the plateaus, over those: what oscillates."""
    ours, right = (
        np.abs(np.diff(each)).sum() for each in (density(DISCONTINUOUS, elements, variant), exact(DISCONTINUOUS))
    )
    return float(ours / right - 1)


def front(elements: int, variant: gx.Variant) -> tuple[float, float]:
    """The front at x = 0.4, in cells: its step over the steepest slope, and the length that is off by a tenth of it."""
    x = places(DISCONTINUOUS)[:, 0]
    here = (x > 0.35) & (x < 0.45)
    values, right = density(DISCONTINUOUS, elements, variant)[here], exact(DISCONTINUOUS)[here]
    step, spacing = float(np.ptp(right)), 1 / SAMPLES
    steepest = float(np.abs(np.diff(values)).max()) / spacing
    off = float((np.abs(values - right) > 0.1 * step).sum()) * spacing
    return elements * step / steepest, elements * off


def order(coarse: float, fine: float, ratio: float) -> float:
    """At which power of the cell's length an error falls."""
    return float(np.log(coarse / fine) / np.log(ratio))
