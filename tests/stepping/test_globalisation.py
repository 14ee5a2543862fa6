"""Large steps: solved by way of easier ones, not mistaken for what is no solution, refused without a trace."""

from dataclasses import replace

import numpy as np
import pytest
from blocks import COMM, block, densities, displacements, run, square

import growthx as gx
from growthx.discretisation.variants import CATALOGUE
from growthx.solvers.newton import Newton
from growthx.stepping import continuation, integration
from growthx.stepping.continuation import Continuation
from growthx.stepping.control import MOST_FAILURES
from growthx.stepping.failure import take_back
from growthx.stepping.integration import Integrator

variants = pytest.mark.parametrize("variant", CATALOGUE.values(), ids=CATALOGUE)
KINDS = (gx.Q1Q1, gx.Q1, gx.Q1sri, gx.S2fri, gx.P2P1)
kinds = pytest.mark.parametrize("variant", KINDS, ids=lambda variant: variant.name)
SYMMETRIC = (gx.Q1P0, gx.Q1, gx.S2fri, gx.P2)
symmetric = pytest.mark.parametrize("variant", SYMMETRIC, ids=lambda variant: variant.name)
PULL = (gx.Traction("right", (0.1, -0.02)),)


def at_once(variant, length, loads=PULL, cells=2, **changes):
    """The block from rest to the end of one step under its full load."""
    program = gx.Program(step=length, until=length)
    return block(square(cells, shape=variant.cells[0]), loads=loads, program=program, **changes)


@variants
@pytest.mark.parametrize("length", [1e-3, 1.0, 1e6])
def test_a_step_of_any_length_is_solved_at_once(variant, length):
    """Implicit Euler is stable for every Δt, so no Δt may need a cut; mass is balanced, and all solutions are one."""
    (step,), problem = run(at_once(variant, length), variant)
    assert (step.time, step.rejected) == (length, 0)
    assert step.mass_defect < 1e-9 * max(1.0, problem.measures.resorption() * length)  # what it is measured against
    if length == 1e6:  # biological equilibrium, which can be found without a step
        equilibrium = gx.homeostasis(at_once(variant, 1.0), variant)
        assert densities(problem)[:, 2] == pytest.approx(densities(equilibrium)[:, 2], rel=1e-4)


@variants
def test_tenfold_load_at_once_is_the_load_in_steps_without_time(variant):
    """The solution in parts is that of the step: the one that small rises of the load at frozen density lead to."""
    loads = (gx.Traction("right", (1.0, -0.2)),)
    (step,), problem = run(at_once(variant, 1e6, loads), variant)
    assert step.rejected == 0
    slow = gx.discretise(at_once(variant, 1e6, loads), variant)
    newton = Newton(slow.system)
    for load in np.linspace(0.0, 1.0, 21)[1:]:
        slow.system.begin_step(1e-9, load)
        assert newton.solve().converged
    for length in np.logspace(-3, 6, 19):
        slow.system.begin_step(length, 1.0)
        assert newton.solve().converged
    newton.destroy()
    slow.system.accept_step()
    assert densities(problem)[:, 2] == pytest.approx(densities(slow)[:, 2], rel=1e-6)
    assert displacements(problem) == pytest.approx(displacements(slow), rel=1e-6, abs=1e-6)


@variants
def test_without_the_parts_the_same_steps_fail(variant, monkeypatch):
    """Else the tests above would show nothing: at rest a long step leaves no positive density."""
    monkeypatch.setattr(Continuation, "solve", lambda self, most: False)
    scene = at_once(variant, 1e6)
    problem = gx.discretise(scene, variant)
    newton = Newton(problem.system)
    assert not Integrator(problem, newton, gx.IMPLICIT_EULER).step(0.0, 1e6).newton.converged
    newton.destroy()


@kinds
def test_ordinary_steps_take_no_parts(variant, monkeypatch):
    """What Newton's method solves well costs nothing more."""

    def never(self, most):
        raise AssertionError("an ordinary step was solved in parts")

    monkeypatch.setattr(Continuation, "solve", never)
    steps, _ = run(block(square(4, 0.05, shape=variant.cells[0])), variant)
    assert len(steps) == 4


def slender(variant, load, cells=6):
    """A strip that a load pulls or presses along its axis."""
    mesh = square(cells, shape=variant.cells[0])
    mesh.domain.geometry.x[:, 1] *= 0.05
    scene = block(mesh, loads=(gx.Traction("right", (load, 0.0)),), program=gx.Program(step=0.1, until=0.1))
    return replace(scene, name="strip")


@symmetric
def test_a_balance_that_is_not_stable_is_refused(variant):
    """Pressed too much a strip stays straight in theory only, which Newton's method does not know, but the pivots do.

    The critical load of a cantilever is E' π² h³ / (48 L²): 2.7e-5 here, 5e-4 over the height.
    """
    for load, stable in ((2e-4, True), (-2e-4, True), (-2e-2, False)):
        problem = gx.discretise(slender(variant, load), variant)
        newton = Newton(problem.system)
        problem.system.begin_step(0.1, 1.0)
        report = newton.solve()
        newton.destroy()
        assert report.converged == stable
        assert stable or report.reason.startswith("the balance that was found is not stable: the body gives way in")


@kinds
def test_a_failed_attempt_leaves_the_last_good_state_to_the_bit(variant, monkeypatch):
    """Whatever was tried: the march goes on from it, and users read it."""
    monkeypatch.setattr(integration, "MOST", 6)
    inwards = (gx.Support("left"), gx.Support("right", (-1.5, 0.0)))
    program = gx.Program(step=0.1, until=1.0, ramp=1.0)
    scene = block(square(3, shape=variant.cells[0]), supports=inwards, loads=(), program=program)
    problem = gx.discretise(scene, variant)
    newton = Newton(problem.system)
    integrator = Integrator(problem, newton, gx.IMPLICIT_EULER)
    assert integrator.step(0.0, 0.1).newton.converged
    integrator.accept()
    good = state(problem)
    failed = integrator.step(0.1, 1.0).newton
    assert not failed.converged
    assert any(not np.array_equal(one, other) for one, other in zip(good, state(problem), strict=True))
    assert len(set(COMM.allgather(take_back(problem, failed)))) == 1
    assert all(np.array_equal(one, other) for one, other in zip(good, state(problem), strict=True))
    newton.destroy()


def state(problem):
    """All that is state: copies."""
    fields = (problem.system.unknown, problem.displacement, problem.density)
    numbers = [
        problem.amplitude,
        problem.time,
        float(problem.state.time_step.value),
        float(problem.state.share.value),
    ]
    return [*(field.x.array.copy() for field in fields), problem.state.accepted_density.copy(), np.array(numbers)]


@symmetric
def test_a_refusal_says_what_stands_in_the_way(variant, monkeypatch):
    """The part that failed last tells more than the start, where there is no density for so long a step."""
    monkeypatch.setattr(integration, "MOST", 8)
    problem = gx.discretise(slender(variant, -2e-2), variant)
    newton = Newton(problem.system)
    failed = Integrator(problem, newton, gx.IMPLICIT_EULER).step(0.0, 1e6).newton
    newton.destroy()
    assert not take_back(problem, failed).startswith("no positive density")


@pytest.mark.parametrize("steps", [gx.FixedSteps(), gx.AdaptiveSteps()], ids=["fixed", "adaptive"])
def test_a_run_that_creeps_is_given_up(steps):
    """Failures that keep coming end a run even where each of them is followed by a step that can be solved."""
    control = steps.control(gx.Program(step=1.0, until=100.0))
    attempts = 0
    while not control.hopeless:
        control.failed(1.0)
        control.accepts(1.0, 1e-9)
        attempts += 1
        assert attempts < 1000
    assert attempts > MOST_FAILURES


def test_fewer_parts_are_tried_the_more_often_they_fail(monkeypatch):
    """A hopeless run must end soon."""
    allowed = []

    def fail(self, most):
        allowed.append(most)
        return False

    monkeypatch.setattr(continuation.Continuation, "solve", fail)
    with pytest.raises(gx.EndedEarly):
        run(at_once(gx.Q1, 1e6), gx.Q1)
    assert allowed == sorted(allowed, reverse=True)
    assert sum(allowed) < 200


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1Q1], ids=lambda variant: variant.name)
def test_what_was_reached_by_parts_is_gone_on_from(variant, monkeypatch):
    """A step from error whose load is there at once is tried again and again, ever shorter: one way there is enough."""
    ways, solve = [], continuation.Continuation.solve

    def count(self, most):
        ways.append(most)
        return solve(self, most)

    monkeypatch.setattr(continuation.Continuation, "solve", count)
    program = gx.Program(step=1.0, until=1.0, ramp=0.0)
    loads = (gx.Traction("right", (-1.0, 0.2)),)
    scene = block(square(2, shape=variant.cells[0]), loads=loads, program=program)
    first = next(gx.march(scene, variant, stepping=gx.AdaptiveSteps(1e-4)))
    assert first.rejected > 1
    assert len(ways) == 1


@pytest.mark.parametrize("variant", [gx.Q1Q1, gx.P2P2], ids=lambda variant: variant.name)
def test_newton_steps_leave_nodal_densities_positive(variant):
    """The largest share that does is found at once, not by halves, and is the same on all ranks."""
    problem = gx.discretise(at_once(variant, 1.0), variant)
    position = problem.system.unknown.x.array[: problem.system.owned]
    step = np.zeros_like(position)
    assert problem.system.largest_share(position, step) == 1.0
    densities = problem.system.unknowns.density_part
    dofs = densities[densities < len(step)]
    step[dofs[0]] = -10 * position[dofs[0]] * (COMM.rank + 1)
    share = problem.system.largest_share(position, step)
    assert share == pytest.approx(0.99 / (10 * COMM.size), rel=1e-12)
    assert np.all((position + share * step)[dofs] > 0)


@pytest.mark.slow
@variants
@pytest.mark.parametrize("load", [1, 10, -10])
@pytest.mark.parametrize("length", [4.0, 1e6])
def test_the_femur_bears_ten_times_its_load_at_once(variant, load, length):
    """The issue's own measure, on the paper's mesh: in one step, without a cut."""
    shape = variant.cells[0]
    scene = gx.scenes.femur(shape=shape)
    loads = tuple(replace(each, force=tuple(load * component for component in each.force)) for each in scene.loads)
    (step,), _ = run(replace(scene, loads=loads, program=gx.Program(step=length, until=length)), variant)
    assert step.rejected == 0
