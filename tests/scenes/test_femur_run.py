"""The femur under its daily loads, on the mesh of the paper's size: what a picture of it shows, in numbers."""

from functools import cache

import pytest

import growthx as gx
from growthx import scenes, zones
from growthx.discretisation.variants import CATALOGUE
from growthx.scenes.femur import zones as anatomical_zones

# Unknowns at the paper's 658 cells and 725 nodes.
DOFS = {
    "Q1Q1": 2175,
    "Q2Q2": 8295,
    "S2Q1": 4939,
    "Q1P0": 1450,
    "Q1": 1450,
    "Q2": 5530,
    "Q1sri": 1450,
    "S2fri": 4214,
}
variants = pytest.mark.parametrize(
    "variant",
    [pytest.param(CATALOGUE[name], marks=pytest.mark.slow if name == "Q2Q2" else ()) for name in DOFS],
    ids=DOFS,
)


@cache
def run(variant):
    """The run to t = 160 and its zone means."""
    # 1e-11: where hardly any bone is left, densities follow the last digits of the balance
    result = gx.solve(scenes.femur(shape=variant.cells[0]), variant, tolerance=1e-11)
    return result, zones.area_means(result.problem, anatomical_zones())


@pytest.mark.parametrize("name", DOFS)
def test_unknowns_are_the_papers(name):
    """Corners, edges and cells of its mesh are counted by these eight sums: 725, 1382 and 658."""
    assert gx.discretise(scenes.femur(), CATALOGUE[name]).dofs == DOFS[name]


@pytest.mark.parametrize(("refine", "cells"), [(1, 658), (2, 2632), (3, 5922)])
def test_cells_are_the_papers_on_all_its_meshes(refine, cells):
    """Its finer meshes are splits of the first."""
    assert scenes.femur(refine=refine).mesh.cell_count == cells


@variants
def test_the_run_is_the_papers_size_and_reaches_its_end(variant):
    """658 cells, no step in trouble, mass balanced to round-off."""
    result, _ = run(variant)
    assert result.scene.mesh.cell_count == 658
    assert result.converged
    assert (result.time, len(result.steps)) == (160.0, 40)
    assert not any(step.rejected for step in result.steps)
    assert max(step.mass_defect for step in result.steps) < 1e-11


@variants
def test_the_structures_are_seen(variant):
    """Dense cortices and calcar, the strut, the arcuate system, then Ward's triangle and the hollow canal."""
    _, mean = run(variant)
    dense = min(mean[zone] for zone in ("med_cortex", "calcar", "lat_cortex"))
    assert dense > 1.25 * mean["strut"]
    assert mean["strut"] > 1.2 * mean["arcuate"]
    assert mean["arcuate"] > 1.2 * mean["ward"]
    assert mean["ward"] > 1.2 * mean["canal"]
    assert mean["canal"] < 0.6
    assert dense > 1.2 > mean["head_superolateral"]


@variants
def test_the_variants_agree(variant):
    """Discretisations of one law on one mesh: their zone means differ by their errors only."""
    _, mean = run(variant)
    _, reference = run(gx.Q1P0)
    assert mean == pytest.approx(reference, rel=0.08)


@pytest.mark.parametrize(("variant", "tolerance"), [(gx.P1P0, 0.1), (gx.P2, 0.06)], ids=["P1P0", "P2"])
def test_triangles_show_the_same_femur(variant, tolerance):
    """Another mesh of other cells: linear triangles are stiff, quadratic ones as good as the quadrilaterals."""
    result, mean = run(variant)
    _, reference = run(gx.Q1P0)
    assert result.scene.mesh.cell_name == "triangle" and result.converged
    assert not any(step.rejected for step in result.steps)
    assert mean == pytest.approx(reference, rel=tolerance)


@variants
def test_the_reactions_carry_the_daily_loads(variant):
    """The distal end bears 0.6, 0.2, 0.2 of the cases' forces, per 30 mm of thickness."""
    from growthx.scenes.femur import AVERAGE, LOAD_CASES

    result, _ = run(variant)
    total = [
        sum(
            weight * (case.joint_force[i] + case.abductor_force[i])
            for case, weight in zip(LOAD_CASES, AVERAGE, strict=True)
        )
        for i in (0, 1)
    ]
    assert result.steps[-1].reactions["distal"] == pytest.approx([-force / 30.0 for force in total], rel=1e-8)


# Serial runs of this code (DOLFINx 0.9): mass, lowest and highest density.
COMMITTED = {
    "Q1Q1": (6632.008878700, 0.143203134322, 3.208731427775),
    "Q2Q2": (6646.745070302, 0.0694127001470, 3.369805990272),
    "S2Q1": (6653.004196084, 0.00692147145751, 3.162273185860),
    "Q1P0": (6703.446744447, 0.212858665137, 2.456690753466),
    "Q1": (6594.697897922, 0.177909000703, 2.860886779813),
    "Q2": (6646.487125046, 0.0909174635150, 3.053298798680),
    "Q1sri": (6689.517051974, 0.212174971856, 2.429207724525),
    "S2fri": (6652.271855266, 0.0820800663733, 2.820732809698),
}


@variants
def test_any_number_of_ranks_gives_the_same_numbers(variant):
    """Run serially and under mpirun, this compares the two: to 1e-8, as rounding alone allows."""
    problem = run(variant)[0].problem
    assert (problem.mass(), *problem.density_range()) == pytest.approx(COMMITTED[variant.name], rel=1e-8)
