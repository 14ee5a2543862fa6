"""The march through time: requested times, cut-back and regrowth, the end of a hopeless run, what a step tells."""

import gc
import weakref
from dataclasses import replace

import numpy as np
import pytest
from blocks import COMM, block, densities, displacements, run, square

import growthx as gx
from growthx.discretisation.variants import CATALOGUE
from growthx.solvers.newton import Newton
from growthx.stepping.continuation import Continuation
from growthx.stepping.integration import Integrator

variants = pytest.mark.parametrize("variant", CATALOGUE.values(), ids=CATALOGUE)
# One for each way to come by a density, and higher orders on either shape: enough where the time loop is at stake.
KINDS = (gx.Q1Q1, gx.Q1, gx.Q1sri, gx.S2fri, gx.P2P1)
kinds = pytest.mark.parametrize("variant", KINDS, ids=lambda variant: variant.name)

# Pushed in by more than a cell within one step: the first iterate inverts the cells at the moved side, half a push
# does not.
PUSHED = {
    "supports": (gx.Support("left"), gx.Support("right", (-0.45, 0.1))),
    "loads": (),
    "program": gx.Program(step=0.1, until=0.4, ramp=0.1),
}


@pytest.fixture
def undivided(monkeypatch):
    """No step is solved in parts: what Newton's method does not solve at once must be cut."""
    monkeypatch.setattr(Continuation, "solve", lambda self, most: False)


@variants
def test_requested_times_are_hit_exactly(variant):
    """Multiples of Δt and the end, which is none: to the bit, since users look states up by time."""
    scene = block(square(2, shape=variant.cells[0]), program=gx.Program(step=0.1, until=0.35, ramp=0.2))
    steps, _ = run(scene, variant)
    assert [step.time for step in steps] == [0.1, 0.2, 0.1 * 3, 0.35]
    assert [step.load for step in steps] == pytest.approx([0.5, 1.0, 1.0, 1.0])
    assert steps[-1].time_step == pytest.approx(0.05, rel=1e-12)


@kinds
def test_a_failed_step_is_cut_and_grows_again(variant, undivided):
    """The cut shows in `rejected`, no requested time is missed, and the nominal step comes back by doubling."""
    steps, _ = run(block(square(3, shape=variant.cells[0]), **PUSHED), variant)
    times = [step.time for step in steps]
    assert sum(step.rejected for step in steps) > 0
    assert set(PUSHED["program"].times()) <= set(times)
    assert len(times) > 4
    assert min(step.time_step for step in steps) < 0.06
    assert steps[-1].time_step == pytest.approx(0.1, rel=1e-9)
    assert np.cumsum([step.time_step for step in steps]) == pytest.approx(times, rel=1e-12)
    allowed = 0.1
    for step in steps:
        allowed /= 2**step.rejected
        # Equal pieces that end on a requested time are a whole number of them: at most half longer than allowed.
        assert step.time_step <= min(0.1, 1.5 * allowed) * (1 + 1e-9)
        allowed = min(0.1, 2 * allowed)


@kinds
def test_cutting_does_not_change_where_a_run_goes(variant, undivided):
    """After cut-backs the state is that of a march that took those very steps from the start."""
    scene = block(square(3, shape=variant.cells[0]), **PUSHED)
    steps, problem = run(scene, variant)
    same = gx.discretise(scene, variant)
    newton = Newton(same.system)
    integrator = Integrator(same, newton, gx.IMPLICIT_EULER)
    for step in steps:
        assert integrator.step(step.time - step.time_step, step.time).newton.converged
        integrator.accept()
    newton.destroy()
    assert densities(same) == pytest.approx(densities(problem), rel=1e-8)


@kinds
def test_a_hopeless_run_says_when_where_and_why(variant):
    """Resorption without bound at one end: the error names time, place and cause; the state is the last good one."""
    falling = gx.EnergyDrivenGrowth(attractor=lambda x: np.where(x[0] > 0.75, 3.0, 0.01), rate=5.0)
    scene = block(square(4, shape=variant.cells[0]), growth=falling, loads=(), program=gx.Program(step=0.05, until=1.0))
    problem = gx.discretise(scene, variant)
    good = []
    with pytest.raises(gx.EndedEarly) as ended:
        for step in gx.march(scene, variant, problem):
            good.append((step, problem.displacement.x.array.copy(), problem.density.x.array.copy()))
    message = str(ended.value)
    last = good[-1][0].time
    assert message.startswith(f"the run ended at t = {last:g} of 1: no positive density balances the mass at (")
    assert "a time step cut from 0.05 to" in message
    x = float(message.split("at (")[1].split(",")[0])
    assert x > 0.7
    assert 0.0 < last < 1.2 / 15.0 + 1e-9
    assert np.array_equal(problem.displacement.x.array, good[-1][1])
    assert np.array_equal(problem.density.x.array, good[-1][2])
    assert problem.system.densities.iterate() == pytest.approx(good[-1][2], rel=0, abs=0)
    assert ended.value.exit_status == 3
    assert len(set(COMM.allgather(message))) == 1


def test_the_result_of_a_hopeless_run_holds_its_history():
    """What was reached is not lost: steps, time and reason come with the error."""
    scene = block(growth=gx.EnergyDrivenGrowth(3.0, rate=5.0), loads=(), program=gx.Program(step=0.05, until=1.0))
    with pytest.raises(gx.RunEndedEarly) as ended:
        gx.solve(scene, gx.Q1P0)
    result = ended.value.result
    assert not result.converged
    assert result.time == result.steps[-1].time > 0
    assert result.reason == str(ended.value)
    assert result.problem.density_range()[0] == result.steps[-1].min_density > 0


def test_a_run_that_fails_at_once_says_so():
    """No step was accepted: the time is zero and the state the initial one."""
    through = (gx.Support("left"), gx.Support("right", (-1.5, 0.0)))  # at once: a shorter step does not help
    scene = block(supports=through, loads=(), program=gx.Program(step=0.1, until=0.1))
    with pytest.raises(
        gx.RunEndedEarly, match=r"^the run ended at t = 0 of 0.1: det F ≤ 0 in the cell at \(0.8"
    ) as ended:
        gx.solve(scene, gx.Q1)
    result = ended.value.result
    assert (result.steps, result.time) == ([], 0.0)
    assert densities(result.problem)[:, 2] == pytest.approx(1.2, rel=0, abs=0)
    assert not np.any(displacements(result.problem)[:, 2:])


@pytest.mark.parametrize("variant", [gx.P2P2, gx.Q2Q2], ids=lambda variant: variant.name)
def test_a_quadratic_density_that_is_negative_between_its_nodes_is_named(variant):
    """Beside a cliff a parabola through positive values dips below zero, where a broken exponent gives no number."""
    material = gx.Material(young=1.0, density_exponent=1.5)
    cliff = {"material": material, "initial_density": lambda x: np.where(x[0] < 0.7, 1e-3, 10.0)}
    with pytest.raises(gx.RunEndedEarly, match=r"the density falls below zero between the nodes of the cell at \(0\."):
        gx.solve(block(square(4, shape=variant.cells[0]), **cliff), variant)


@kinds
def test_steps_begin_where_the_last_one_points(variant):
    """Where the load goes on as it went, a linear continuation saves iterations and leads to the same state."""
    scene = block(square(4, 0.05, shape=variant.cells[0]), program=gx.Program(step=0.02, until=0.4, ramp=0.1))
    foretold, problem = run(scene, variant, tolerance=1e-12)
    plain, same = run(scene, variant, tolerance=1e-12, stepping=gx.FixedSteps(predicted=False))
    iterations = [sum(step.newton_iterations for step in steps) for steps in (foretold, plain)]
    assert iterations[0] < iterations[1]
    assert densities(problem) == pytest.approx(densities(same), rel=1e-10)


@variants
def test_mass_is_balanced_to_round_off(variant):
    """What is gained is what the source has given, also where the mesh is distorted and a region rests."""
    for growing in (None, ("bone",)):
        steps, _ = run(block(square(4, 0.05, shape=variant.cells[0]), growing=growing), variant, tolerance=1e-12)
        assert steps[-1].mass != steps[0].mass
        assert max(step.mass_defect for step in steps) < 1e-13


@variants
def test_the_mass_defect_would_show_a_loss(variant):
    """It is not zero by construction: a density changed behind the march's back shows in the next step."""
    scene = block(square(2, shape=variant.cells[0]))
    problem = gx.discretise(scene, variant)
    march = gx.march(scene, variant, problem)
    assert next(march).mass_defect < 1e-10
    problem.state.accepted_density *= 1.001
    assert next(march).mass_defect == pytest.approx(1e-3, rel=0.1)


@variants
def test_reactions_balance_the_loads(variant):
    """The supports bear the ramped load at each step, force by force."""
    steps, _ = run(block(square(4, 0.05, shape=variant.cells[0])), variant)
    for step in steps:
        assert step.reactions["left"] == pytest.approx([-0.1 * step.load, 0.02 * step.load], abs=1e-11)
    assert [step.load for step in steps] == pytest.approx([0.5, 1.0, 1.0, 1.0])


@variants
def test_extremes_and_mass_are_those_of_the_whole_body(variant):
    """A number that is local to a rank would look right in serial."""
    steps, problem = run(block(square(4, shape=variant.cells[0])), variant)
    rho = densities(problem)[:, 2]
    assert (steps[-1].min_density, steps[-1].max_density) == (rho.min(), rho.max())
    assert COMM.allgather(steps[-1].mass) == [steps[-1].mass] * COMM.size


def test_a_run_that_was_left_early_can_be_followed_by_another():
    """Users break out of the loop: the solver's memory is freed, and the state is the one they saw."""
    scene = block()
    problem = gx.discretise(scene, gx.Q1)
    for step in gx.march(scene, gx.Q1, problem):
        if step.time >= 0.2:
            break
    assert step.mass == problem.mass()
    assert len(run(replace(scene, name="again"), gx.Q1)[0]) == 4


def test_a_march_that_is_left_frees_its_solver_at_once():
    """In the hands of the collector of cycles it would go at other times on other ranks, which then wait for ever."""
    scene = block(square(2))
    march = gx.march(scene, gx.Q1)
    next(march)
    gone = weakref.ref(march)
    gc.disable()
    try:
        del march
        assert gone() is None
    finally:
        gc.enable()
