"""The choice of steps after failures, which must neither try the same again at once nor creep on without end."""

import pytest

import growthx as gx

PROGRAM = gx.Program(step=1.0, until=1000.0)
TOLERANCE = 1e-3


def adaptive(**options):
    return gx.AdaptiveSteps(TOLERANCE, **options).control(PROGRAM)


def creep(control, share, limit=500):
    """Failures of which each is followed by a step of a share of the nominal one; how many until the run ends."""
    for failures in range(limit):
        if control.hopeless:
            return failures
        control.failed(2 * share)
        control.cut = share  # of fixed steps
        assert control.accepts(share, 0.0)
    return limit


def test_what_failed_is_not_tried_again_at_once():
    """A step that was solved after a failure tells nothing for a longer one; the one after it may be longer again."""
    control = adaptive()
    control.failed(1.0)
    first = control.end(0.0, 1000.0)
    control.accepts(first, 0.0)
    second = control.end(first, 1000.0) - first
    control.accepts(second, 0.0)
    third = control.end(first + second, 1000.0) - first - second
    assert first == second == 0.25
    assert third == pytest.approx(5 * second)


def test_steps_that_cannot_be_solved_end_a_run_however_they_shrank():
    """An error that would allow the whole step says that it was failures which made the steps short: no way on."""
    control = adaptive()
    step, failed = 1.0, 0
    while not control.too_short:
        for _ in range(2):
            control.failed(step)
            step, failed = control.end(0.0, 1000.0), failed + 1
        control.accepts(step, 0.0)
        assert failed < 20
    assert 1e-5 < step < 1e-3


def test_steps_may_be_as_short_as_their_errors_ask():
    """However far below the nominal step that is, and a failure beside them ends nothing."""
    control = adaptive()
    step = 1.0
    while step > 1e-9:
        assert not control.accepts(step, 1e6)
        step = control.end(0.0, 1000.0)
    assert control.accepts(step, TOLERANCE / 2)
    control.failed(step)
    assert not control.hopeless


@pytest.mark.parametrize("control", [gx.FixedSteps().control(PROGRAM), adaptive()], ids=["fixed", "adaptive"])
def test_a_run_that_hardly_gains_time_between_failures_ends_soon(control):
    """At a thousandth of a step for each failure; ever deeper cuts are allowed, and so is a tenth of a step."""
    assert 15 <= creep(control, 1e-3) <= 25
    control.begin_anew()
    assert creep(control, 0.1) > 60


@pytest.mark.parametrize("control", [gx.FixedSteps().control(PROGRAM), adaptive()], ids=["fixed", "adaptive"])
def test_the_deepest_cut_is_allowed_twice(control):
    """A place that is hard to pass ends no run that has come to it by whole steps, and neither does a second one."""
    for _ in range(2):
        for _ in range(12 if hasattr(control, "cut") else 6):
            control.failed(control.end(0.0, 1000.0))
        assert not control.hopeless
        for _ in range(15):
            assert control.accepts(control.end(0.0, 1000.0), TOLERANCE / 2)


def test_a_control_remembers_how_it_came_on():
    """One that goes on from a checkpoint gives up where the first one does."""
    control, other = adaptive(), adaptive()
    creep(control, 1e-3, 12)
    other.recall(control.memory())
    assert creep(control, 1e-3) == creep(other, 1e-3)
    assert control.memory().numbers == other.memory().numbers
