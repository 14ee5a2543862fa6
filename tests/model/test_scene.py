"""The scene's parts: times hit exactly, loads and supports as given, one sentence for everything unusable."""

import math
from dataclasses import replace

import numpy as np
import pytest
from blocks import block, square

import growthx as gx
from growthx.common.errors import InputError
from growthx.model.loads import DistributedForce, Traction
from growthx.model.program import Program
from growthx.model.supports import Support

POINTS = np.array([[0.0, 0.5, 1.0], [0.0, 0.2, 0.4], [0.0, 0.0, 0.0]])


@pytest.fixture(scope="module")
def scene():
    """A clamped block; replacing its parts checks them."""
    return block(square(cells=2))


@pytest.mark.parametrize(
    ("step", "until", "count"),
    [
        (0.1, 6.0, 60),
        (4.0, 160.0, 40),
        (0.1, 0.3, 3),
        (1 / 3, 1.0, 3),
        (0.3, 1.0, 4),
        (2.0, 1.0, 1),
        (1.0, 1.0, 1),
        (1e-3, 0.7, 700),
        (0.1, 0.1 + 0.2, 3),
    ],
)
def test_times_are_multiples_of_the_step_then_the_end(step, until, count):
    """Requested times are hit exactly, without a sliver of a last step where division does not come out even."""
    times = Program(step, until).times()
    assert len(times) == count and times[-1] == until
    assert np.array_equal(times[:-1], step * np.arange(1, count))
    gaps = np.diff(times, prepend=0.0)
    assert gaps.min() > 1e-3 * min(step, until) and gaps.max() <= step * (1 + 1e-9)


def test_the_ramp_is_linear_and_ends_at_one():
    """Step k of the bar carries k/10 of the load; a rounding error must not leave 0.9999999999999999 of it."""
    program = Program(0.1, 6.0, ramp=1.0)
    assert program.amplitude(0.0) == 0.0
    assert np.allclose([program.amplitude(t) for t in program.times()[:10]], np.arange(1, 11) / 10, rtol=1e-14)
    assert program.amplitude(math.fsum([0.1] * 10) - 2e-16) == 1.0 == program.amplitude(6.0)
    assert Program(0.1, 0.9, ramp=0.3).amplitude(3 * 0.1) == 1.0


def test_without_a_ramp_the_load_is_there_at_once():
    """Division by a ramp of zero must not reach the user."""
    assert Program(0.1, 1.0).amplitude(0.0) == 1.0 == Program(0.1, 1.0).amplitude(0.1)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ((0.0, 1.0), "the time step Δt is 0: a positive number would be right"),
        ((-0.1, 1.0), "the time step Δt is -0.1: a positive number would be right"),
        ((float("nan"), 1.0), "the time step Δt is nan: a positive number would be right"),
        ((None, 1.0), "the time step Δt is None: a positive number would be right"),
        ((0.1, 0.0), "the end time is 0: a positive number would be right"),
        ((0.1, float("inf")), "the end time is inf: a positive number would be right"),
        ((0.1, 1.0, -1.0), "the duration of the load ramp is -1: a number of at least 0 would be right"),
        (
            (1e-9, 1.0),
            "the time step Δt is 1e-09 for an end time of 1: more than ten million steps, and a longer step would be "
            "right",
        ),
    ],
)
def test_impossible_programs_are_refused(arguments, sentence):
    """Each would loop for ever, or not at all."""
    with pytest.raises(InputError) as caught:
        Program(*arguments)
    assert str(caught.value) == sentence


@pytest.mark.parametrize(
    ("displacement", "held"),
    [
        (None, [(0, 0.0), (1, 0.0)]),
        ((0.0, None), [(0, 0.0)]),
        ((None, 0.25), [(1, 0.25)]),
        ((None, None), []),
        ((1, 2), [(0, 1.0), (1, 2.0)]),
    ],
)
def test_a_support_holds_the_directions_it_names(displacement, held):
    """None is free and 0 is held: mixing them up would turn a roller into a clamp."""
    assert Support("left", displacement).components(2) == held


@pytest.mark.parametrize("value", [float("nan"), "0", True], ids=repr)
def test_a_support_takes_numbers_only(value):
    """A NaN there would show as a failed Newton iteration."""
    with pytest.raises(InputError, match=r"^the displacement of the support 'left' is .*: a finite number would be "):
        Support("left", (value, None)).components(2)


def test_a_uniform_traction_is_the_same_everywhere():
    """A vector given once must reach every point, one column each."""
    assert np.array_equal(Traction("right", (2.0, -1)).intensity(POINTS), [[2.0] * 3, [-1.0] * 3])
    assert Traction("right", (2.0, -1)).resultant is None


def test_a_traction_may_be_a_function_of_position():
    """It is taken as it is, not scaled."""
    load = Traction("right", lambda x: np.stack([x[0], 2 * x[1]]))
    assert np.array_equal(load.intensity(POINTS), [POINTS[0], 2 * POINTS[1]]) and load.resultant is None


def test_a_distributed_force_is_parallel_to_its_resultant():
    """The weight may only change the size of the traction: else the resultant could not be met by one factor."""
    load = DistributedForce("right", (3.0, -4.0), lambda x: x[0])
    assert np.array_equal(load.intensity(POINTS), [[0, 1.5, 3], [0, -2, -4]]) and load.resultant == (3.0, -4.0)
    assert np.array_equal(DistributedForce("right", (3.0, -4.0)).intensity(POINTS), [[3.0] * 3, [-4.0] * 3])


@pytest.mark.parametrize("load", [Traction, DistributedForce])
@pytest.mark.parametrize("value", [float("nan"), float("inf"), None, "1"], ids=repr)
def test_loads_take_finite_numbers_only(load, value):
    """The sentence names the boundary, since a scene has many loads."""
    with pytest.raises(InputError, match=r"^a component of the .* on 'right' is .*: a finite number would be right$"):
        load("right", (1.0, value))


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        (
            {"supports": ()},
            "the scene 'block' has no support: without one the body is free to move, and a gx.Support among its "
            "supports would be right",
        ),
        (
            {"supports": (Support("lft"),)},
            "the mesh has no boundary named 'lft'; it has 'bottom', 'left', 'right', 'top'",
        ),
        (
            {"loads": (Traction("rght", (1.0, 0.0)),)},
            "the mesh has no boundary named 'rght'; it has 'bottom', 'left', 'right', 'top'",
        ),
        ({"growing": ("bne",)}, "the mesh has no region named 'bne'; it has 'bone', 'implant'"),
        ({"growing": ()}, "no region of the scene 'block' grows: name one, or None for the whole body"),
        ({"growing": "bone"}, "growing is 'bone': names in a tuple, ('bone',), would be right"),
        (
            {"supports": (Support("left", (0.0, 0.0, 0.0)),)},
            "the displacement (0.0, 0.0, 0.0) of the support 'left' has 3 entries: the mesh needs 2",
        ),
        ({"loads": (Traction("right", (1.0, 0, 0)),)}, "the load on 'right' has 3 entries: the mesh needs 2"),
        ({"loads": (Traction("right", lambda x: x),)}, "the load on 'right' has 3 entries: the mesh needs 2"),
        ({"loads": (DistributedForce("right", (1.0,)),)}, "the load on 'right' has 1 entries: the mesh needs 2"),
        ({"initial_density": 0.0}, "the initial density ρ(0) is 0: a positive number would be right"),
        (
            {"initial_density": {"bone": 1.0, "implant": float("nan")}},
            "the initial density ρ(0) of 'implant' is nan: a positive number would be right",
        ),
    ],
)
def test_impossible_scenes_are_refused(scene, changes, sentence):
    """All of it is known before anything is computed, so it must be said then, in one sentence."""
    with pytest.raises(InputError) as caught:
        replace(scene, **changes)
    assert str(caught.value) == sentence


def test_growth_starts_from_the_reference_density(scene):
    """The paper's ρ(0) = ρ*, unless the user says otherwise."""
    assert scene.start_density == scene.material.reference_density == 1.2
    assert replace(scene, initial_density=0.7).start_density == 0.7


def test_scenes_cannot_be_changed(scene):
    """A scene is shared by variants and results: changing it half-way would falsify both."""
    with pytest.raises(AttributeError):
        scene.program = gx.Program(1.0, 1.0)


def test_what_holds_densities_is_no_density(scene):
    """A result, or a scan, taken for what it has: the sentence names what makes a density of it."""
    for given in (gx.Result, "density.zip", object()):
        with pytest.raises(
            InputError, match=r"a positive number, .* gx\.transfer\(…\) or .*\(…\) give, would be right$"
        ):
            replace(scene, initial_density=given)
