"""The demo of soft tissue: the wall of a tube against its radial balance, solved by SciPy."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

import growthx as gx


@pytest.fixture(scope="module")
def demo():
    """The demo as a module."""
    path = Path(__file__).parents[2] / "demos" / "tube.py"
    spec = importlib.util.spec_from_file_location("tube", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_radial_solution_is_one(demo):
    """Its stresses are in balance by differences, not by its own slopes, and it bears the pressure."""
    at = demo.radial_solution()
    R, step = np.linspace(demo.INSIDE + 0.01, demo.OUTSIDE - 0.01, 7), 1e-4

    def along_and_around(R):
        r, radial, _ = at(R)
        return demo.stresses(radial, r / R)[:2]

    along, around = along_and_around(R)
    slope = (along_and_around(R + step)[0] - along_and_around(R - step)[0]) / (2 * step)
    assert slope + (along - around) / R == pytest.approx(0.0, abs=1e-5 * np.abs(slope).max())
    r, radial, density = at(np.array([demo.INSIDE]))
    assert demo.stresses(radial, r / demo.INSIDE)[0] == pytest.approx(-demo.PRESSURE * r / demo.INSIDE, rel=1e-6)
    assert density[0] > 1.6


@pytest.mark.parametrize("variant", [gx.Q1Q1, gx.Q1], ids=lambda variant: variant.name)
def test_the_wall_in_equilibrium(demo, variant):
    """Displacements and densities over the wall; on twice as many cells, nearer."""
    errors = []
    for cells in (4, 8):
        problem = gx.solve(demo.tube(cells), variant).problem
        moved, exact, density, known = demo.compared(problem).T
        errors.append((np.abs(moved / exact - 1).max(), np.abs(density / known - 1).max()))
    assert errors[1][0] < 2e-3 and errors[1][0] < 0.5 * errors[0][0]
    if variant is gx.Q1Q1:  # of densities at points places between them say less
        assert errors[1][1] < 5e-3 < 2e-2 > errors[0][1] > errors[1][1]


def test_two_rates_have_the_same_equilibrium(demo):
    """A vessel that is resorbed more slowly comes to the same end."""
    law = gx.EnergyRemodelling(demo.LAW.attractor, 100.0, 20.0)
    one, other = (gx.homeostasis(demo.tube(3, each), gx.Q1) for each in (law, demo.LAW))
    assert one.mean_density() == pytest.approx(other.mean_density(), rel=1e-6)
