"""The plate of Weinans: its data, the solution that is known and not stable, and what becomes of it."""

import json

import numpy as np
import pytest
from blocks import COMM

import growthx as gx
from growthx import baselines, scenes
from growthx.cli import main
from growthx.common.errors import InputError
from growthx.scenes import weinans
from growthx.scenes.weinans import SMALL, column_density, shares_at_bounds


def test_the_smooth_solution():
    """Its mean is the known one, and in a column that bears its load alone no density changes."""
    x = (np.arange(100_000) + 0.5) / 100_000
    assert column_density(x).mean() == pytest.approx(0.7326, abs=5e-5)
    assert column_density(x) == pytest.approx((1.82 * (1 - x) ** 2) ** (1 / 3))
    scene = scenes.weinans_plate(2)
    pull = 10 * SMALL * (1 - 0.3)
    stretch, across = _strains(scene.material, pull, column_density(0.3))
    energy = scene.material.principal_energy((stretch, across, 0.0))
    rate = scene.growth.mass_source(column_density(0.3), energy, scene.material)
    assert abs(rate) < 1e-3 * scene.growth.resting_rate(scene.material)


def _strains(material, pull, density):
    from scipy.optimize import root

    def forces(at):
        stresses = material.principal_stresses((at[0] * SMALL, at[1] * SMALL, 0.0), float(density))
        return [(stresses[0] - pull) / SMALL, stresses[1] / SMALL]

    return root(forces, [0.1, -0.05], tol=1e-12).x * SMALL


def test_strains_are_small_enough_to_be_linear(monkeypatch):
    """A tenth of them changes no density by more than a few thousandths in three steps."""
    ends = []
    for share in (SMALL, SMALL / 10):
        monkeypatch.setattr(weinans, "SMALL", share)
        (*_, last) = baselines.update(scenes.weinans_plate(4, until=3.0), gx.Q1P0)
        ends.append((last.mass, last.min_density, last.max_density))
    assert ends[0] == pytest.approx(ends[1], rel=3e-3)
    assert ends[0][1] < 0.5 and 0.8 < ends[0][2] <= 1.74


def test_columns_to_zero_and_to_one():
    """By the element-based update most of the plate is at one of the bounds; averaged sources make it no other."""
    scene = scenes.weinans_plate(10)
    shares = {}
    for name, average in (("bare", None), ("averaged", baselines.NonLocal(0.1))):
        problem = baselines.frozen(scene, gx.Q1P0)
        for _ in baselines.update(scene, gx.Q1P0, problem, source_average=average):
            pass
        # Of the frozen problem, whose law has no bounds, by its densities.
        density, volumes = problem.density.x.array[problem.growing_dofs], problem.volumes[problem.growing_dofs]
        at = volumes[(density < 0.0101) | (density > 1.739)].sum(), volumes.sum()
        shares[name] = np.divide(*COMM.allreduce(np.array(at)))
        assert problem.density_range() == pytest.approx((0.01, 1.74))
    assert shares["bare"] > 0.8 and shares["averaged"] > 0.5


def test_the_implicit_solver_says_that_it_is_not_well_posed(caplog):
    """Before it solves anything, and of a state, on request."""
    scene = scenes.weinans_plate(6, until=2.0)
    problem = gx.discretise(scene, gx.Q1P0)
    if COMM.rank == 0 and caplog.records:  # it is said once in a process
        assert "the model is not well posed" in caplog.text
    for _ in gx.march(scene, gx.Q1P0, problem):
        pass
    found = gx.wellposedness.check(problem)
    assert not found.exponents and str(found).startswith("not well posed (m is not above n)")
    low, high = shares_at_bounds(problem)
    assert 0 <= low <= 1 and 0 <= high <= 1 and 0.5 < problem.mean_density() < 0.9


@pytest.mark.serial
def test_the_command(capfd):
    """Its readings as JSON."""
    assert main(["weinans", "--n", "6", "--until", "2", "--json"]) == 0
    found = json.loads(capfd.readouterr().out)
    assert {"mean_density", "share_at_lowest", "share_at_highest"} <= set(json.dumps(found).replace('"', " ").split())


@pytest.mark.parametrize("cells", [0, 2.5, True, 10**6])
def test_bad_counts(cells):
    """One sentence."""
    with pytest.raises(InputError, match=r"the number of cells along the plate's sides is .*: a whole number from 1"):
        scenes.weinans_plate(cells)
