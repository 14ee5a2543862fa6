"""Runs that begin under their load: from an equilibrium, where nothing may change, and beside parts that are stiff."""

from dataclasses import replace

import numpy as np
import pytest
from blocks import COMM, block, cube, densities, displacements, square

import growthx as gx
from growthx import baselines
from growthx.discretisation.variants import CATALOGUE
from growthx.stepping import continuation, integration

AT_ONCE = gx.Program(step=4.0, until=8.0, ramp=0.0)
STIFF = {"bone": 500.0, "implant": 110000.0}


def beside_an_implant(mesh, load, **changes):
    """Bone that is clamped, with an implant at its end on which the load acts: it turns, and must not stretch for it.

    The set point is of the order of the energy.
    """
    stress = max(map(abs, load))
    growth = gx.EnergyDrivenGrowth(stress**2 / 500.0, 0.025 / (stress**2 / 500.0))
    loads = (gx.Traction("right", load[: mesh.dim]),)
    scene = block(mesh, material=gx.Material(STIFF, 0.3, 1.2), growth=growth, loads=loads, program=AT_ONCE)
    return replace(scene, **changes)


@pytest.mark.parametrize("variant", [gx.Q1, gx.Q1P0, gx.Q1Q1], ids=lambda variant: variant.name)
def test_an_equilibrium_stays(variant):
    """A ramp would resorb what the load holds: under the load from the start, the least density does not fall."""
    loads = (gx.Traction("right", (0.2, -0.02)),)
    scene = block(square(3), loads=loads, program=gx.Program(step=2.0, until=400.0, ramp=4.0))
    grown = gx.solve(scene, variant, stepping=gx.FixedSteps(equilibrium=1e-6))
    assert grown.ended == "equilibrium"
    start = densities(grown.problem)
    after = replace(scene, initial_density=grown.problem.density, program=gx.Program(step=2.0, until=20.0))
    going_on = gx.solve(after, variant)
    assert densities(going_on.problem) == pytest.approx(start, rel=1e-4)
    assert min(step.min_density for step in going_on.steps) > grown.steps[-1].min_density * (1 - 1e-5)
    assert displacements(going_on.problem) == pytest.approx(displacements(grown.problem), rel=1e-4, abs=1e-6)
    ramped = gx.solve(replace(after, program=gx.Program(step=2.0, until=20.0, ramp=10.0)), variant)
    assert min(step.min_density for step in ramped.steps) < 0.99 * grown.steps[-1].min_density


@pytest.mark.parametrize("load", [(150.0, 0.0), (50.0, -50.0), (0.0, 50.0), (150.0, -150.0)], ids=str)
@pytest.mark.parametrize("variant", CATALOGUE.values(), ids=CATALOGUE)
def test_all_of_the_load_at_once_beside_a_stiff_part(variant, load):
    """Where it turns, steps that lower the residual are tiny ones: the run ended at t = 0, whatever the step."""
    scene = beside_an_implant(square(4, shape=variant.cells[0]), load)
    for growing in (None, ("bone",)):
        steps = list(gx.march(replace(scene, growing=growing), variant))
        assert steps[0].time == 4.0 and steps[-1].time == 8.0
        assert sum(step.newton_iterations for step in steps) < 200


@pytest.mark.parametrize("full_newton", [False, True])
@pytest.mark.parametrize("shape", ["hexahedron", "tetrahedron"])
def test_it_does_so_in_space(shape, full_newton):
    """Six motions of a rigid body, by either kind of Newton's method."""
    variant = gx.variants.default(shape)
    scene = beside_an_implant(cube(2, shape=shape), (50.0, -50.0, 30.0))
    assert [step.time for step in gx.march(scene, variant, full_newton=full_newton)] == [4.0, 8.0]


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q2, gx.Q1Q1], ids=lambda variant: variant.name)
def test_the_way_there_does_not_matter(variant):
    """Full steps go far astray on the way: where they end, slow loading ends, too."""
    for load in ((50.0, -50.0), (0.0, 50.0)):
        still = gx.EnergyDrivenGrowth(1.0, rate=0.0)
        scene = beside_an_implant(square(4), load, growth=still, program=gx.Program(step=1.0, until=1.0))
        ends = []
        for program in (gx.Program(step=1.0, until=1.0), gx.Program(step=0.02, until=1.0, ramp=1.0)):
            problem = gx.discretise(replace(scene, program=program), variant)
            for _ in gx.march(problem.scene, variant, problem):
                pass
            ends.append(displacements(problem))
        assert np.abs(ends[1][:, 2:]).max() > 0.2
        assert ends[0] == pytest.approx(ends[1], abs=1e-7)


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1Q1], ids=lambda variant: variant.name)
def test_nor_does_it_where_the_body_grows(variant, monkeypatch):
    """The density that full steps find is the one that hundreds of small parts lead to."""
    scene = beside_an_implant(square(4), (50.0, -50.0), program=gx.Program(step=4.0, until=4.0))
    solved, ends = continuation.Continuation._solved, []
    for most, allowed in ((50, (False, True)), (3000, (False,))):
        part = lambda *point, allowed=allowed: point[-1] in allowed and solved(*point)  # noqa: E731
        monkeypatch.setattr(continuation.Continuation, "_solved", part)
        monkeypatch.setattr(integration, "MOST", most)
        problem = gx.discretise(scene, variant)
        assert [step.rejected for step in gx.march(scene, variant, problem)] == [0]
        ends.append(densities(problem))
    assert ends[0] == pytest.approx(ends[1], abs=1e-9)


def test_updates_and_equilibria_get_there_too():
    """They solve for the displacement at a density that does not change, and know no shorter steps."""
    scene = beside_an_implant(square(4), (50.0, -50.0), growing=("bone",))
    assert [step.time for step in baselines.update(scene, gx.Q1P0)] == [4.0, 8.0]
    assert gx.homeostasis(scene, gx.Q1P0, load_steps=1).density_range()[0] > 0


@pytest.mark.parametrize(("ramp", "told"), [(0.0, True), (1e-3, True), (0.3, False)])
def test_a_load_that_is_too_much_at_once_names_the_ramp(ramp, told):
    """What might help is said where the run cannot begin; later, or on a ramp, it would be no help."""
    load = (gx.Traction("right", (-50.0, 0.0)),)
    scene = block(square(2), loads=load, program=gx.Program(step=0.1, until=0.4, ramp=ramp))
    with pytest.raises(gx.EndedEarly) as caught:
        list(gx.march(scene, gx.Q1))
    said = str(caught.value)
    assert said.startswith("the run ended at t = ") and "did not help" in said
    assert ("ramp" in said) == told
    if told:
        assert said.endswith(
            f": with a ramp of {ramp:g} all of the load is there at once, and one over several steps may help"
        )
    assert len(set(COMM.allgather(said))) == 1
