"""Both bars against the paper's tables and the semi-analytic solution, read as spec §3 says."""

import numpy as np
import pytest

import growthx as gx
from growthx import scenes
from growthx.scenes.bar import CONTINUOUS, DISCONTINUOUS, end_displacement, equilibrium, midpoint_density_change
from growthx.variants import CATALOGUE

# The paper's values at 40 elements: density change at mid-length, end displacement.
PAPER = {"Q1Q1": (0.297437, 2.37135), "Q1P0": (0.306185, 2.37122), "Q1": (0.306185, 2.37122)}
DOFS = {"Q1Q1": {10: 66, 40: 246, 100: 606}, "Q1P0": {10: 44, 40: 164, 100: 404}, "Q1": {10: 44, 40: 164, 100: 404}}

variants = pytest.mark.parametrize("variant", CATALOGUE.values(), ids=CATALOGUE)


def numbers(problem, elements, variant):
    """Density change at mid-length and end displacement of one run."""
    done = gx.solve(scenes.bar(problem, elements), variant).problem
    return midpoint_density_change(done), end_displacement(done)


@variants
def test_the_papers_discontinuous_bar(variant):
    """At 40 elements displacements agree to the printed digit, densities to 2·10⁻⁵."""
    density, displacement = numbers(DISCONTINUOUS, 40, variant)
    assert density == pytest.approx(PAPER[variant.name][0], abs=2e-5)
    assert displacement == pytest.approx(PAPER[variant.name][1], abs=1e-5)


@variants
@pytest.mark.parametrize("elements", [10, 40, 100])
def test_unknowns_are_the_papers(variant, elements):
    """Its table 1 counts them; local densities cost none."""
    assert gx.discretise(scenes.bar(DISCONTINUOUS, elements), variant).dofs == DOFS[variant.name][elements]


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1], ids=["Q1P0", "Q1"])
def test_the_discontinuous_bar_reaches_its_equilibrium(variant):
    """Local densities see the jump: at mid-length they take the semi-analytic value to six digits."""
    exact = equilibrium(scenes.bar(DISCONTINUOUS, 100), DISCONTINUOUS, 0.5).density - 1
    density, displacement = numbers(DISCONTINUOUS, 100, variant)
    assert exact == pytest.approx(0.306171, abs=5e-7)
    assert density == pytest.approx(exact, abs=1e-6)
    assert displacement == pytest.approx(2.371652, abs=2.5e-4)  # the clamp's part: it holds back the first 0.01


@variants
def test_the_tapered_bar_converges_to_the_semi_analytic_density(variant):
    """The stimulus is an energy of the slope of u, hence first order in h at the kink; the limit is the sharp part."""
    scene = scenes.bar(CONTINUOUS, 10)
    exact = equilibrium(scene, CONTINUOUS, 0.5).density - 1
    coarse, fine = (numbers(CONTINUOUS, elements, variant)[0] for elements in (40, 100))
    assert (exact - coarse) / (exact - fine) == pytest.approx(100 / 40, rel=0.05)
    limit = fine + (fine - coarse) * 40 / 60
    assert limit == pytest.approx(exact, abs=0.03 * abs(exact - fine))


def test_a_density_per_cell_is_that_of_the_cells_middle():
    """Q1P0's deviation at mid-length is where it is read: half a cell off it is second order."""
    scene = scenes.bar(CONTINUOUS, 10)
    errors = [
        numbers(CONTINUOUS, k, gx.Q1P0)[0] - (equilibrium(scene, CONTINUOUS, 0.5 + 0.5 / k).density - 1)
        for k in (40, 100)
    ]
    assert abs(errors[0]) < 2e-5
    assert abs(errors[1]) < 6e-6


@variants
def test_the_tapered_bars_end_displacement(variant):
    """∫ (λ − 1) dx over free cross-sections; what is left is the clamp's part."""
    scene = scenes.bar(CONTINUOUS, 10)
    middles = (np.arange(100) + 0.5) / 100
    exact = np.mean([equilibrium(scene, CONTINUOUS, x).stretch - 1 for x in middles])
    _, displacement = numbers(CONTINUOUS, 100, variant)
    assert displacement == pytest.approx(exact, abs=2.5e-4)
