"""The femur under its daily loads, on the 658-cell mesh: what a picture of it shows, in numbers."""

from functools import cache

import pytest

import growthx as gx
from growthx import meshing, scenes, zones
from growthx.scenes.femur import zones as anatomical_zones
from growthx.variants import CATALOGUE

variants = pytest.mark.parametrize("variant", CATALOGUE.values(), ids=CATALOGUE)


@cache
def run(variant):
    """The run to t = 160 and its zone means."""
    result = gx.solve(scenes.femur(meshing.locate("femur_658.msh")), variant)
    return result, zones.area_means(result.problem, anatomical_zones())


@variants
def test_the_run_is_the_papers_size_and_reaches_its_end(variant):
    """658 cells, 725 nodes, no step in trouble, mass balanced to round-off."""
    result, _ = run(variant)
    assert result.scene.mesh.cell_count == 658
    assert result.problem.dofs == {"Q1Q1": 2175, "Q1P0": 1450, "Q1": 1450}[variant.name]
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
    """Three discretisations of one law on one mesh: their zone means differ by their errors only."""
    _, mean = run(variant)
    _, reference = run(gx.Q1P0)
    assert mean == pytest.approx(reference, rel=0.08)


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
    "Q1P0": (6703.446744447, 0.212858665137, 2.456690753466),
    "Q1": (6594.697897922, 0.177909000703, 2.860886779813),
}


@variants
def test_any_number_of_ranks_gives_the_same_numbers(variant):
    """Run serially and under mpirun, this compares the two: to 1e-8, as rounding alone allows."""
    problem = run(variant)[0].problem
    assert (problem.mass(), *problem.density_range()) == pytest.approx(COMMITTED[variant.name], rel=1e-8)
