"""The way through time: steps from error, the times they must end at, and the end at biological equilibrium."""

from dataclasses import replace

import numpy as np
import pytest
from blocks import block, densities, run, square

import growthx as gx
from growthx.discretisation.variants import CATALOGUE
from growthx.stepping.continuation import Continuation

variants = pytest.mark.parametrize("variant", CATALOGUE.values(), ids=CATALOGUE)
KINDS = (gx.Q1Q1, gx.Q1, gx.Q1sri, gx.S2fri, gx.P2P1)
kinds = pytest.mark.parametrize("variant", KINDS, ids=lambda variant: variant.name)
both = pytest.mark.parametrize("variant", [gx.Q1, gx.Q1Q1], ids=lambda variant: variant.name)


def body(variant, **program):
    return block(
        square(3, 0.05, shape=variant.cells[0]),
        program=gx.Program(**{"step": 0.1, "until": 4.0, "ramp": 0.4, **program}),
    )


@variants
def test_the_error_follows_the_tolerance(variant):
    """A tenth of the tolerance must give a smaller error, no larger than a few tolerances, by few steps."""
    _, exact = run(body(variant, step=0.01), variant, stepping=gx.FixedSteps(scheme=gx.TR_BDF2))
    rho, errors, counts = densities(exact)[:, 2], [], []
    for tolerance in (1e-3, 1e-4):
        steps, problem = run(body(variant), variant, stepping=gx.AdaptiveSteps(tolerance))
        errors.append(np.linalg.norm(densities(problem)[:, 2] - rho) / np.linalg.norm(rho))
        counts.append(len(steps))
        assert all(step.error <= tolerance for step in steps)
        assert errors[-1] < 3 * tolerance
    assert errors[1] < errors[0]
    assert counts[0] < counts[1] < 40
    assert max(step.mass_defect for step in steps) < 1e-2 * tolerance


@kinds
def test_steps_end_where_they_must(variant):
    """The end of the ramp, requested times and the end, to the bit; in between no slivers."""
    steps, _ = run(body(variant, requested=(1.0, 2.5)), variant, stepping=gx.AdaptiveSteps(1e-2))
    times = [step.time for step in steps]
    assert {0.4, 1.0, 2.5, 4.0} <= set(times)
    assert times == sorted(times) and times[-1] == 4.0
    assert min(step.time_step for step in steps) > 0.01


@both
def test_fixed_steps_end_at_requested_times_too(variant):
    """A time that is no multiple of Δt is one more to hit; one that is, is not hit twice."""
    steps, _ = run(body(variant, until=0.4, requested=(0.25, 0.3)), variant)
    assert [step.time for step in steps] == pytest.approx([0.1, 0.2, 0.25, 0.3, 0.4], rel=1e-12)
    assert steps[2].time == 0.25


@both
def test_no_step_is_longer_than_the_longest(variant):
    """For a load that changes behind the estimate's back."""
    steps, _ = run(body(variant), variant, stepping=gx.AdaptiveSteps(1e-2, longest=0.3))
    assert max(step.time_step for step in steps) == pytest.approx(0.3, rel=1e-9)


@both
def test_steps_grow_towards_equilibrium(variant):
    """Near biological equilibrium nothing happens: a hundred times the time costs a few steps more."""
    short, _ = run(body(variant, until=40.0), variant, stepping=gx.AdaptiveSteps(1e-3))
    long, _ = run(body(variant, until=4000.0), variant, stepping=gx.AdaptiveSteps(1e-3))
    assert len(long) < len(short) + 12
    assert max(step.time_step for step in long) > 400.0


@both
def test_a_run_ends_at_biological_equilibrium_when_asked(variant):
    """Once the rate is a small share of resorption: the state is then that of the equilibrium solved for directly."""
    scene = body(variant, until=1e5)
    steps, problem = run(scene, variant, stepping=gx.AdaptiveSteps(1e-3, equilibrium=1e-6))
    assert steps[-1].time < 1e4
    equilibrium = gx.homeostasis(scene, variant)
    assert densities(problem)[:, 2] == pytest.approx(densities(equilibrium)[:, 2], rel=1e-4)
    fixed, _ = run(body(variant, until=1e3), variant, stepping=gx.FixedSteps(equilibrium=0.5))
    assert fixed[-1].time < 1e3
    assert fixed[-1].load == 1.0


@kinds
def test_a_rate_is_told_from_what_newton_leaves(variant):
    """Rough steps that are to end at a small share of resorption are solved to it: they end there, and it is exact."""
    scene = replace(
        body(variant, step=1.0, ramp=1.0, until=1e6),
        material=gx.Material(lambda x: 1.0 + 2.0 * (x[0] > 0.5), 0.0, density_exponent=lambda x: 3.0 - (x[0] > 0.5)),
        growth=gx.EnergyDrivenGrowth(0.5, rate=1.0, exponent=4.0),
        loads=(gx.Traction("right", (1.0, 0.0)),),
    )
    steps, problem = run(scene, variant, stepping=gx.AdaptiveSteps(1e-2, equilibrium=1e-8))
    assert steps[-1].time < 1e4
    expected = densities(gx.homeostasis(scene, variant))[:, 2]
    assert densities(problem)[:, 2] == pytest.approx(expected, rel=1e-7)
    fixed, problem = run(scene, variant, tolerance=1e-3, stepping=gx.FixedSteps(equilibrium=1e-8))
    assert fixed[-1].time < 1e4
    assert densities(problem)[:, 2] == pytest.approx(expected, rel=1e-7)


def test_equilibrium_needs_a_resorption_to_be_measured_against():
    """Without one no share of it can be reached."""
    scene = block(growth=gx.EnergyDrivenGrowth(attractor=0.0, rate=5.0))
    with pytest.raises(gx.InputError, match="zero everywhere"):
        run(scene, gx.Q1, stepping=gx.FixedSteps(equilibrium=1e-3))


@kinds
def test_what_cannot_be_solved_is_cut(variant, monkeypatch):
    """Pushed in by more than a cell at once: where no parts do, shorter steps lead through, and they grow again."""
    monkeypatch.setattr(Continuation, "solve", lambda self, most: False)
    pushed = (gx.Support("left"), gx.Support("right", (-0.45, 0.1)))
    scene = block(
        square(3, shape=variant.cells[0]), supports=pushed, loads=(), program=gx.Program(step=0.1, until=0.4, ramp=0.1)
    )
    steps, _ = run(scene, variant, stepping=gx.AdaptiveSteps(1e-1))
    assert sum(step.rejected for step in steps) > 0
    assert steps[-1].time == 0.4


@both
def test_steps_from_error_begin_as_short_as_they_must(variant):
    """Bone that has nearly vanished grows a million times per step when it is loaded: that is no reason to give up."""
    scene = block(
        square(2, shape=variant.cells[0]),
        initial_density=0.05,
        material=gx.Material(young=1e5, reference_density=1.0),
        growth=gx.EnergyDrivenGrowth(attractor=1e-8, rate=1e7, exponent=4.0),
        loads=(gx.Traction("right", (0.1, 0.0)),),
        program=gx.Program(step=1.0, until=2.0),
    )
    steps, _ = run(scene, variant, stepping=gx.AdaptiveSteps(1e-3))
    assert steps[0].time_step < 2.0**-13
    assert steps[-1].time == 2.0


@both
def test_a_hopeless_run_says_when_where_and_why(variant):
    """Resorption without bound: steps from error end like fixed ones, with the place and the last good state."""
    falling = gx.EnergyDrivenGrowth(attractor=lambda x: np.where(x[0] > 0.75, 3.0, 0.01), rate=5.0)
    scene = block(square(4), growth=falling, loads=(), program=gx.Program(step=0.05, until=1.0))
    good = []
    with pytest.raises(gx.EndedEarly, match=r"the run ended at t = 0\.\d+ of 1: ") as ended:
        for step in gx.march(scene, variant, stepping=gx.AdaptiveSteps(1e-2)):
            good.append(step.time)
    assert f"t = {good[-1]:g}" in str(ended.value)
    assert good[-1] < 0.08 + 1e-9


@pytest.mark.parametrize(
    ("wrong", "what"),
    [
        (lambda: gx.AdaptiveSteps(0.0), "the tolerance of density is 0"),
        (lambda: gx.AdaptiveSteps(float("nan")), "the tolerance of density is nan"),
        (lambda: gx.AdaptiveSteps("fine"), "the tolerance of density is 'fine'"),
        (lambda: gx.AdaptiveSteps(longest=-1.0), "the longest time step is -1"),
        (lambda: gx.FixedSteps(equilibrium=0.0), "the share of equilibrium is 0"),
        (lambda: gx.Program(step=0.1, until=1.0, requested=(2.0,)), "a requested time is 2"),
        (lambda: gx.Program(step=0.1, until=1.0, requested=(0.0,)), "a requested time is 0"),
    ],
)
def test_what_cannot_be_meant_is_refused(wrong, what):
    """Before the run, with the value and what would be right."""
    with pytest.raises(gx.InputError, match=what):
        wrong()
