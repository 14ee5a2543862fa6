"""The record of a run tells of laws, loads and supports that do not act everywhere, and of nothing else."""

import logging
from dataclasses import replace

import numpy as np
import pytest
import ufl
from blocks import ROLLERS, block, cube, square

import growthx as gx
from growthx.common.errors import GrowthxError
from growthx.discretisation.forms.momentum import Momentum
from growthx.discretisation.variants import CATALOGUE
from growthx.stepping import witness

variants = pytest.mark.parametrize("variant", CATALOGUE.values(), ids=CATALOGUE)
KINDS = (gx.Q1, gx.Q1P0, gx.Q1sri, gx.Q1Q1, gx.P2P1)
kinds = pytest.mark.parametrize("variant", KINDS, ids=lambda variant: variant.name)


def said(caplog):
    """What the witness has said."""
    return [record.getMessage() for record in caplog.records if "not to be trusted" in record.getMessage()]


@variants
def test_a_right_run_has_nothing_against_it(variant, caplog):
    """Distorted cells, several loads, a law with a dead zone and bounds: what is off is round-off or tolerance."""
    mesh = square(3, 0.08, shape=variant.cells[0])
    scene = block(
        mesh,
        growth=gx.EnergyDrivenGrowth(0.01, rate=5.0, dead_zone=0.002, bounds=(0.9, 1.5)),
        loads=(
            gx.Traction("right", (0.1, -0.02)),
            gx.DistributedForce("top", (0.01, 0.02), weight=lambda x: x[0], history=lambda t: t**2),
            gx.BodyForce((0.0, -0.01), region="bone"),
        ),
    )
    result = gx.solve(scene, variant)
    assert max(step.force_defect for step in result.steps) < 1e-9
    assert max(step.mass_defect for step in result.steps) < 1e-9
    assert not said(caplog)


@pytest.mark.parametrize("variant", [gx.Q1, gx.Q1P0, gx.Q1Q1, gx.P1, gx.P1P1], ids=lambda variant: variant.name)
def test_in_space_too(variant, caplog):
    """Areas of quadrilaterals and triangles in space, whose tractions must add up to what the nodes get."""
    scene = block(cube(2, 0.05, shape=variant.cells[1]))
    result = gx.solve(scene, variant)
    assert max(step.force_defect for step in result.steps) < 1e-9
    assert not said(caplog)


LOADED = {
    "pressure": {"loads": (gx.Pressure("right", 0.05),)},
    "springs": {"loads": (gx.OpenTraction("right", lambda u, rho, x: ufl.as_vector([0.05, 0.0]) - 0.1 * u),)},
    "weight": {"loads": (gx.OpenBodyForce(lambda u, rho, x: ufl.as_vector([0.0, -0.02 * rho])),)},
    "inertia": {"inertia": gx.Inertia()},
    "cases": {
        "loads": (),
        "cases": (
            gx.LoadCase("pull", 2.0, (gx.Traction("right", (0.1, 0.0)),)),
            gx.LoadCase("bend", 1.0, (gx.Traction("right", (0.0, 0.03)), gx.Pressure("top", 0.01))),
        ),
    },
    "adaptive": {},
}


@pytest.mark.parametrize("name", LOADED)
@kinds
def test_loads_that_depend_on_the_state_count(variant, name, caplog):
    """The reactions are to be compared with them, too."""
    scene = block(square(3, 0.05, shape=variant.cells[0]), **LOADED[name])
    stepping = gx.AdaptiveSteps(1e-3) if name == "adaptive" else None
    result = gx.solve(scene, variant, stepping=stepping)
    assert max(step.force_defect for step in result.steps) < (1e-3 if stepping else 1e-8)
    assert not said(caplog)


@kinds
def test_a_source_that_the_density_does_not_follow_is_told(variant, caplog, monkeypatch):
    """As it was when a law of one's own was obeyed by the mass source alone."""
    problem = gx.discretise(block(square(2, shape=variant.cells[0])), variant)
    rate = problem.mass_rate
    monkeypatch.setattr(problem, "mass_rate", lambda: rate() + 0.01)
    list(gx.march(problem.scene, variant, problem))
    (sentence,) = said(caplog) or [""]  # once, on rank 0
    if problem.comm.rank == 0:
        assert "the mass gained is not what source and boundaries gave: off by" in sentence


@kinds
def test_reactions_that_do_not_balance_are_told(variant, caplog, monkeypatch):
    """A support whose force is lost in the record."""
    problem = gx.discretise(block(square(2, shape=variant.cells[0])), variant)
    reactions = problem.reactions
    monkeypatch.setattr(problem, "reactions", lambda: {name: 0.99 * force for name, force in reactions().items()})
    list(gx.march(problem.scene, variant, problem))
    if problem.comm.rank == 0:
        assert len(said(caplog)) == 1 and "the reactions do not balance the loads" in said(caplog)[0]


def test_a_load_that_does_not_reach_the_nodes_ends_the_run(monkeypatch):
    """As tractions on inner facets were dropped without a word."""
    scene = block(square(2))
    problem = gx.discretise(scene, gx.Q1)
    problem.system.loads.nodal_load *= 0.5
    with pytest.raises(GrowthxError, match="a load is lost"):
        gx.march(scene, gx.Q1, problem)


@pytest.mark.parametrize("shape", ["quadrilateral", "triangle", "hexahedron", "tetrahedron"])
def test_areas_and_volumes_are_those_of_the_geometry(shape):
    """Of a distorted body whose sides stay plane."""
    make = square if shape in ("quadrilateral", "triangle") else cube
    mesh = make(3, 0.05, shape=shape)
    assert witness._area(mesh, "right", 2) == pytest.approx(1.0, rel=1e-12)
    assert witness._volume(mesh, None) == pytest.approx(1.0, rel=1e-3 if make is cube else 1e-12)


@pytest.mark.parametrize("variant", [gx.Q1, gx.Q2], ids=lambda variant: variant.name)
def test_warped_sides_are_as_large_as_their_loads_say(variant):
    """Their area is no polynomial: another rule than that of the load finds another one, and a load was said lost."""
    mesh = cube(2)
    x = mesh.domain.geometry.x
    x[:, 0] += 0.2 * x[:, 0] * x[:, 1] * x[:, 2]
    steps = list(gx.march(block(mesh), variant))
    assert max(step.force_defect for step in steps) < 1e-9


def test_small_loads_are_balanced_as_well_as_full_ones(caplog):
    """Newton's method measures forces by the full load: a millionth of it may be balanced a million times as badly."""
    scene = block(square(2), program=gx.Program(step=1e-6, until=2e-6, ramp=1.0))
    problem = gx.discretise(scene, gx.Q1)
    steps = list(gx.march(scene, gx.Q1, problem))
    assert not said(caplog)
    heard = witness.Witness(problem, 1e-10)
    heard.defects(steps[-1].reactions)
    for defect, warns in ((1e-3, False), (1.0, True)):
        heard.hear(replace(steps[-1], force_defect=defect))
        assert bool(said(caplog)) == (warns and problem.comm.rank == 0)


def test_a_scene_without_open_loads_compiles_nothing_for_it(monkeypatch):
    """Dead loads are sums of what is there."""
    problem = gx.discretise(block(square(2)), gx.Q1)
    monkeypatch.setattr(Momentum, "inside", lambda *arguments: pytest.fail("forms were made"))
    witness.Witness(problem, 1e-10)


def test_unloaded_and_prescribed_bodies(caplog):
    """Nothing to balance, or a displacement alone: no division by nothing."""
    pulled = block(square(2), loads=(), supports=(*ROLLERS, gx.Support("right", (0.1, None))))
    for scene in (replace(pulled, supports=ROLLERS), pulled):
        result = gx.solve(scene, gx.Q1)
        assert np.isfinite([step.force_defect for step in result.steps]).all()
    assert not said(caplog)


def test_what_is_said_once_is_not_said_in_each_step(caplog, monkeypatch):
    """A log of a thousand like lines tells no more."""
    problem = gx.discretise(block(square(2)), gx.Q1)
    monkeypatch.setattr(problem, "mass_rate", lambda: 1.0)
    with caplog.at_level(logging.WARNING, "growthx"):
        assert len(list(gx.march(problem.scene, gx.Q1, problem))) == 4
    assert len(said(caplog)) == (problem.comm.rank == 0)


TURNING = (
    gx.Traction("right", (0.1, -0.02)),
    gx.DistributedForce("top", (0.01, 0.02), weight=lambda x: x[0], history=lambda t: t**2),
    gx.Moment("right", 0.01),
    gx.PointForce((1.0, 0.5), (0.0, 0.01)),
    gx.BodyForce((0.0, -0.01), region="bone"),
)


@variants
def test_moments_of_reactions_and_loads_balance(variant, caplog):
    """About the middle of the deformed body, in distorted cells, of every kind of dead load."""
    result = gx.solve(block(square(3, 0.08, shape=variant.cells[0]), loads=TURNING), variant)
    assert max(step.moment_defect for step in result.steps) < 1e-9
    assert not said(caplog)


@pytest.mark.parametrize("variant", [gx.Q1, gx.Q1Q1, gx.P1], ids=lambda variant: variant.name)
def test_moments_in_space(variant, caplog):
    """Three of them, of bending and torsion."""
    loads = (gx.Traction("right", (0.1, -0.02, 0.01)), gx.Moment("right", (0.02, 0.0, -0.01)))
    result = gx.solve(block(cube(2, 0.05, shape=variant.cells[1]), loads=loads), variant)
    assert max(step.moment_defect for step in result.steps) < 1e-9
    assert not said(caplog)


def test_moments_of_each_case_at_small_strains_and_of_none_that_is_known(caplog):
    """With the arms at rest where the material is of small strains; loads of the state are not told."""
    scene = block(square(2), **LOADED["cases"])
    assert np.isnan(gx.solve(scene, gx.Q1P0).steps[-1].moment_defect)
    dead = tuple(replace(case, loads=case.loads[:1]) for case in scene.cases)
    for material in (scene.material, gx.LinearElasticity(1.0, 0.25, 1.2)):
        result = gx.solve(replace(scene, cases=dead, material=material), gx.Q1P0)
        assert max(step.moment_defect for step in result.steps) < 1e-9
    assert not said(caplog)


def test_a_wrong_moment_ends_the_run():
    """A hundredth too much of what the scene says: nodal forces whose resultant is right, and whose moment is not."""
    scene = block(square(2), loads=(gx.Moment("right", 0.01),))
    problem = gx.discretise(scene, gx.Q1)
    problem.system.loads.nodal_load *= 1.01
    with pytest.raises(GrowthxError, match=r"have the moment .* and their nodal forces .*: a load is lost"):
        gx.march(scene, gx.Q1, problem)
    in_space = block(cube(2), loads=(gx.Moment("right", (0.01, 0.0, 0.0)),))
    problem = gx.discretise(in_space, gx.Q1)
    problem.system.loads.nodal_load *= 1.01
    with pytest.raises(GrowthxError, match="have the moment"):
        gx.march(in_space, gx.Q1, problem)


def test_a_force_at_another_place_ends_the_run():
    """Of the right size, which the balance of forces does not notice."""
    load = gx.PointForce((1.0, 0.5), (0.01, 0.0))
    scene = block(square(2), loads=(load,))
    problem = gx.discretise(scene, gx.Q1P0)
    moved = gx.discretise(block(square(2), loads=(replace(load, point=(1.0, 0.75)),)), gx.Q1P0)
    problem.system.loads.nodal_load[:] = moved.system.loads.nodal_load
    with pytest.raises(GrowthxError, match="have the moment"):
        gx.march(scene, gx.Q1P0, problem)


@kinds
def test_moments_of_supports_that_do_not_balance_are_told(variant, caplog, monkeypatch):
    """A support whose moment is lost in the record, while its force is not."""
    problem = gx.discretise(block(square(2, shape=variant.cells[0])), variant)
    supports = problem.system.supports
    moments = supports.moments

    def wrong(*values):
        return {name: 0.99 * moment for name, moment in moments(*values).items()}

    monkeypatch.setattr(supports, "moments", wrong)
    list(gx.march(problem.scene, variant, problem))
    if problem.comm.rank == 0:
        assert len(said(caplog)) == 1 and "the moments of the reactions do not balance" in said(caplog)[0]
