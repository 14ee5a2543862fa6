"""Densities smoothed to the corners of the cells: exact for what is linear, and a mean of all cells around."""

import dolfinx
import numpy as np
import pytest
from blocks import COMM, block, gathered, square

import growthx as gx
from growthx.discretisation.variants import CATALOGUE
from growthx.post.smoothing import smoothed_density


def at_corners(function):
    """(x, y, value) of the owned corners."""
    space = function.function_space
    owned = space.dofmap.index_map.size_local
    return gathered(np.column_stack([space.tabulate_dof_coordinates()[:owned, :2], function.x.array[:owned]])).T


@pytest.mark.parametrize("variant", CATALOGUE.values(), ids=CATALOGUE)
def test_a_constant_stays(variant):
    """Weights that do not sum to one would brighten or darken the edge of a picture."""
    problem = gx.discretise(block(square(3, 0.05, shape=variant.cells[0]), initial_density=1.7), variant)
    assert at_corners(smoothed_density(problem))[2] == pytest.approx(1.7, rel=1e-14)


@pytest.mark.parametrize("name", ["Q1Q1", "Q2Q2", "Q1", "Q2", "S2fri", "P2", "P1P1", "P2P2"])
def test_a_linear_density_is_extrapolated_to_the_corners(name):
    """Where a cell has enough points for it, also at the edge of the body, where nothing is averaged."""
    variant = gx.variants.named(name)
    scene = block(square(3, shape=variant.cells[0]), initial_density=lambda x: 1 + 0.5 * x[0] - 0.2 * x[1])
    x, y, rho = at_corners(smoothed_density(gx.discretise(scene, variant)))
    assert rho == pytest.approx(1 + 0.5 * x - 0.2 * y, rel=1e-12)


@pytest.mark.parametrize("name", ["Q1P0", "P1P0", "Q1sri", "P1"])
def test_one_value_per_cell_is_averaged(name):
    """At a corner, the mean of the cells around it: here of ones and threes."""
    variant = gx.variants.named(name)
    scene = block(square(4, shape=variant.cells[0]), initial_density={"bone": 1.0, "implant": 3.0})
    x, _, rho = at_corners(smoothed_density(gx.discretise(scene, variant)))
    assert rho[x < 0.5 - 1e-9] == pytest.approx(1.0) and rho[x > 0.5 + 1e-9] == pytest.approx(3.0)
    between = rho[np.abs(x - 0.5) < 1e-9]
    assert np.all((between > 1.2) & (between < 2.8))


def test_what_is_computed_with_stays_raw():
    """Smoothing is for the eye: the problem's density is what it was."""
    problem = gx.solve(block(), gx.Q1).problem
    before = problem.density.x.array.copy()
    smooth = smoothed_density(problem)
    assert np.array_equal(problem.density.x.array, before)
    spread = COMM.allreduce(float(np.ptp(smooth.x.array))), COMM.allreduce(float(np.ptp(before)))
    assert isinstance(smooth, dolfinx.fem.Function) and 0 < spread[0] != spread[1]
