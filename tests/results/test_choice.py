"""Which states are kept: what is asked for is met exactly, and changes no more of a run than it must."""

from dataclasses import replace

import numpy as np
import pytest
from blocks import COMM, block

import growthx as gx
from growthx.common.errors import InputError
from growthx.results.states.choice import choose, with_landmarks
from growthx.stepping.control import AdaptiveSteps, FixedSteps

PROGRAM = gx.Program(step=0.1, until=1.0, ramp=0.25)
ADAPTIVE = AdaptiveSteps(1e-4)


def chosen(stepping, every=None, times=None, frames=None, program=PROGRAM):
    """The choice, and the times that the program is asked for besides its own."""
    choice = choose(every, times, frames, program, stepping)
    return choice, with_landmarks(program, choice, stepping).requested


def test_frames_change_no_fixed_step():
    """They are the ends of steps that come nearest; all different, with the end."""
    choice, requested = chosen(FixedSteps(), frames=4)
    assert choice.times == pytest.approx((0.3, 0.5, 0.8, 1.0), abs=0.1001) and len(choice.times) == 4
    assert set(choice.times) <= set(PROGRAM.times()) and choice.times[-1] == 1.0
    assert requested == () and choice.start
    assert chosen(FixedSteps(), frames=10)[0].times == pytest.approx(PROGRAM.times(), rel=1e-15)


def test_frames_of_steps_of_any_length_are_evenly_spread():
    """Where steps have no times of their own, each frame has its own."""
    choice, requested = chosen(ADAPTIVE, frames=4)
    assert choice.times == (0.25, 0.5, 0.75, 1.0)
    assert requested == (0.5, 0.75)  # at the others, the ends of the ramp and of the run, a step ends anyway


def test_times_next_to_those_of_the_program_are_these():
    """Two ends a rounding error apart would be a step of no length."""
    program = replace(PROGRAM, requested=(0.7,))
    times = (0.0, 0.25 * (1 + 1e-15), 0.1 + 0.2 + 0.4, 0.3)
    choice, requested = chosen(ADAPTIVE, times=times, program=program)
    assert choice.times == (0.25, 0.3, 0.7) and choice.start
    assert requested == (0.7, 0.3)
    _, requested = chosen(FixedSteps(), times=times, program=program)
    assert requested == (0.7, 0.25 * (1 + 1e-15))  # no end of a fixed step, though it is one of the ramp


def test_what_is_due():
    """Steps are counted from the start, times are met but for rounding errors."""
    choice, _ = chosen(FixedSteps(), every=3, times=(0.5,))
    due = [number for number, time in enumerate(PROGRAM.times(), start=1) if choice.is_due(number, time)]
    assert due == [3, 5, 6, 9]
    nothing, _ = chosen(FixedSteps())
    assert not nothing and not any(nothing.is_due(number, 0.5) for number in (1, 2))


@pytest.mark.parametrize(
    ("wrong", "sentence"),
    [
        ({"every": 0}, r"^every, the number of steps .*, is 0: a whole number from 1 would be right$"),
        ({"every": 2.5}, r"is 2.5: a whole number from 1 would be right$"),
        ({"frames": 0}, r"^frames, the number of states .*, is 0: a whole number from 1 would be right$"),
        ({"frames": 5}, r"^5 frames are to be kept of a run of 4 steps of fixed length: at most 4, or AdaptiveSteps, "),
        ({"every": 2, "frames": 3}, r"after every 2 steps and as 3 frames evenly spread: one of the two would be "),
        (
            {"times": (0.1, 0.5)},
            r"^a time at which a state is to be kept is 0.5: one from 0 to the end, 0.4, would be ",
        ),
        ({"times": (-0.1,)}, r"is -0.1: one from 0 to the end, 0.4, would be right$"),
        ({"times": (float("nan"),)}, r"is nan: one from 0 to the end, 0.4, would be right$"),
        ({"times": ("0.1",)}, r"is '0.1': one from 0 to the end, 0.4, would be right$"),
        ({"times": 0.1}, r"^times, at which states are to be kept, is 0.1: a tuple of times would be right$"),
        ({"times": ()}, r"are \(\): one or more would be right$"),
    ],
    ids=repr,
)
def test_what_cannot_be_meant_is_refused(wrong, sentence, shared_folder):
    """Before anything is computed, and before there is a folder."""
    with pytest.raises(InputError, match=sentence):
        gx.solve(block(), gx.Q1P0, out=shared_folder / "out", **wrong)
    assert not (shared_folder / "out").exists()
    COMM.barrier()


@pytest.mark.parametrize("wrong", [{"every": 2}, {"times": (0.1,)}, {"frames": 3}], ids=repr)
def test_states_need_a_folder(wrong):
    """Else a movie would be missed only when the run is over."""
    with pytest.raises(InputError, match=r"^states are to be kept by \w+ = .*, but nowhere: a folder to write to is "):
        gx.solve(block(), gx.Q1P0, **wrong)


def steps_of(result):
    """Ends of steps and masses."""
    return np.array([(step.time, step.mass) for step in result.steps])


@pytest.mark.parametrize("kept", [{"every": 2}, {"frames": 3}, {"times": (0.2, 0.3)}], ids=repr)
def test_keeping_states_changes_no_step_that_ends_there_anyway(kept, shared_folder):
    """To the bit: looking on must not disturb."""
    alone = gx.solve(block(), gx.Q1P0)
    seen = gx.solve(block(), gx.Q1P0, out=shared_folder / "out", **kept)
    assert np.array_equal(steps_of(seen), steps_of(alone))


def test_landmarks_cost_adaptive_steps_little(shared_folder):
    """Each is met exactly, by a step cut short; those after it are as long as they were, and the results as good."""
    scene = block(program=gx.Program(step=0.05, until=4.0, ramp=0.2), growth=gx.EnergyDrivenGrowth(0.01, rate=1.0))
    stepping = AdaptiveSteps(1e-4)
    alone = gx.solve(scene, gx.Q1P0, stepping=stepping)
    times = (0.5, 1.7, 3.3)
    seen = gx.solve(scene, gx.Q1P0, stepping=stepping, out=shared_folder / "out", times=times)
    assert set(times) <= {step.time for step in seen.steps}
    assert len(seen.steps) <= len(alone.steps) + 2 * len(times)
    assert seen.steps[-1].mass == pytest.approx(alone.steps[-1].mass, rel=1e-4)
    assert all(step.error <= 1e-4 for step in seen.steps)
