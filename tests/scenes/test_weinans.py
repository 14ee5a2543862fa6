"""The plate of Weinans: its data, the solution that is known and not stable, and what becomes of it."""

import json
from dataclasses import replace

import numpy as np
import pytest
from blocks import COMM

import growthx as gx
from growthx import baselines, scenes
from growthx.cli import main
from growthx.common.errors import InputError
from growthx.scenes.weinans import column_density, shares_at_bounds


def test_the_smooth_solution():
    """Its mean is the known one, and in a column that bears its load alone no density changes."""
    x = (np.arange(100_000) + 0.5) / 100_000
    assert column_density(x).mean() == pytest.approx(0.7326, abs=5e-5)
    assert column_density(x) == pytest.approx((1.82 * (1 - x) ** 2) ** (1 / 3))
    scene = scenes.weinans_plate(2)
    pressure, density = 10 * (1 - 0.3), float(column_density(0.3))
    shortening = (1 - 0.3**2) * pressure / (100 * density**2)
    across = 0.3 / (1 - 0.3) * shortening
    stresses = scene.material.principal_stresses((across, -shortening, 0.0), density)
    assert stresses[:2] == pytest.approx([0.0, -pressure], abs=1e-12)
    energy = scene.material.principal_energy((across, -shortening, 0.0))
    assert scene.growth.mass_source(density, energy, scene.material) == pytest.approx(0.0, abs=1e-14)


def test_linear_elasticity_is_the_limit_of_small_strains():
    """By the paper's energy at a thousandth of the load, and a set point smaller by its square: the same densities."""
    small, scene = 1e-3, scenes.weinans_plate(4, until=3.0)
    alike = replace(
        scene,
        material=gx.Material(100.0, 0.3, 1.0, 2.0),
        growth=replace(scene.growth, attractor=0.25 * small**2, rate=1 / small**2),
        loads=(gx.Traction("top", lambda x: np.stack([0 * x[0], -10 * small * (1 - x[0])])),),
    )
    ends = []
    for each in (scene, alike):
        *_, last = baselines.update(each, gx.Q1P0)
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
    assert shares["bare"] > 0.7 and shares["averaged"] > 0.5


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
    assert main(["weinans", "--elements", "6", "--until", "2", "--json"]) == 0
    found = json.loads(capfd.readouterr().out)
    assert {"mean_density", "share_at_lowest", "share_at_highest"} <= set(json.dumps(found).replace('"', " ").split())


@pytest.mark.parametrize("cells", [0, 2.5, True, 10**6])
def test_bad_counts(cells):
    """One sentence."""
    with pytest.raises(InputError, match=r"the number of cells along the plate's sides is .*: a whole number from 1"):
        scenes.weinans_plate(cells)
