"""Turned boundaries, moments and springs, against what is known of them in closed form."""

from dataclasses import replace

import numpy as np
import pytest
from blocks import (
    ROLLERS,
    assert_tangent_matches_differences,
    block,
    boundary_size,
    cube,
    displacements,
    run,
    set_iterate,
    square,
    tangent,
)

import growthx as gx
from growthx.common.errors import InputError

STILL = gx.EnergyDrivenGrowth(attractor=0.0, rate=0.0)
KINDS = (gx.Q1P0, gx.Q1, gx.Q1Q1, gx.S2Q1, gx.P2P1)
kinds = pytest.mark.parametrize("variant", KINDS, ids=lambda variant: variant.name)


def energy(problem):
    """Stored in the body, by the points of the cells' own rule."""
    import dolfinx

    psi = problem.mean_energy() * problem.spaces.whole_volume
    return problem.comm.allreduce(dolfinx.fem.assemble_scalar(problem.compile.form(psi)))


@kinds
def test_a_body_turned_at_both_ends_turns_as_a_whole(variant):
    """By a radian, about a place beside it: no stress, no reaction, each point where the rotation takes it."""
    turn = {"angle": 1.0, "about": (0.3, -0.2)}
    scene = block(
        square(2, 0.05, shape=variant.cells[0]),
        growth=STILL,
        supports=(gx.Rotation("left", **turn), gx.Rotation("right", **turn)),
        loads=(),
    )
    for step in gx.march(scene, variant, problem := gx.discretise(scene, variant)):
        x, y, u, v = displacements(problem).T
        c, s = np.cos(step.load), np.sin(step.load)
        assert u == pytest.approx((c - 1) * (x - 0.3) - s * (y + 0.2), abs=1e-9)
        assert v == pytest.approx(s * (x - 0.3) + (c - 1) * (y + 0.2), abs=1e-9)
        assert np.array(list(step.reactions.values())) == pytest.approx(np.zeros((2, 2)), abs=1e-8)


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1Q1, gx.P2P1], ids=lambda variant: variant.name)
def test_torsion_in_space_stores_its_work(variant):
    """Half of moment times angle, where it is small; the other end bears the moment, and nothing else."""
    angle = 1e-3
    scene = block(
        cube(2, shape=variant.cells[1]),
        growth=STILL,
        material=gx.Material(young=1.0, poisson=0.3),
        supports=(gx.Support("front"), gx.Rotation("back", angle, axis=(0.0, 0.0, 1.0), free=(2,))),
        loads=(),
        program=gx.Program(step=1.0, until=1.0),
    )
    _, problem = run(scene, variant, tolerance=1e-12)
    moments = problem.reaction_moments((0.5, 0.5, 0.5))
    assert moments["back"][2] > 0.01 * angle
    # The free side does without forces along the axis, and so both are in balance about it alone.
    assert moments["front"] + moments["back"] == pytest.approx(np.zeros(3), abs=1e-6 * moments["back"][2])
    assert moments["back"][2] * angle / 2 == pytest.approx(energy(problem), rel=1e-4)


@kinds
def test_the_moment_of_a_force_is_borne_where_the_body_is(variant):
    """(X + u) × F about any place, at large displacements: the arms are deformed ones."""
    force, corner = np.array([0.005, -0.02]), np.array([[1.0, 1.0]])
    scene = block(square(3, shape=variant.cells[0]), growth=STILL, loads=(gx.PointForce((1.0, 1.0), tuple(force)),))
    _, problem = run(scene, variant, tolerance=1e-12)
    place = (corner + problem.sample_displacement(corner))[0]
    assert np.linalg.norm(place - corner) > 0.03
    for about in ((0.0, 0.0), (0.4, -2.0)):
        arm = place - about
        moment = problem.reaction_moments(about)["left"]
        assert moment == pytest.approx([-(arm[0] * force[1] - arm[1] * force[0])], abs=1e-9)


@kinds
def test_a_moment_has_no_resultant_and_all_of_its_moment(variant):
    """Of its nodal forces, about any place, exactly; the clamped side bears it where displacements are small."""
    load = gx.Moment("right", 1e-5)
    scene = block(square(3, shape=variant.cells[0]), growth=STILL, loads=(load,), program=gx.Program(1.0, 1.0))
    steps, problem = run(scene, variant, tolerance=1e-12)
    assert problem.system.loads.resultant(problem.system.loads.full()) == pytest.approx([0.0, 0.0], abs=1e-18)
    assert steps[-1].reactions["left"] == pytest.approx([0.0, 0.0], abs=1e-13)
    assert problem.reaction_moments((0.2, 3.0))["left"] == pytest.approx([-1e-5], rel=1e-3)


@pytest.mark.parametrize("axis", range(3))
def test_moments_in_space(axis):
    """Torsion and bending of a side that is not a square: each about its own axis."""
    mesh = cube(2, 0.05)
    mesh.domain.geometry.x[:, 2] *= 2.0
    moment = tuple(1e-5 * (axis == i) for i in range(3))
    scene = block(mesh, growth=STILL, loads=(gx.Moment("right", moment),), program=gx.Program(1.0, 1.0))
    _, problem = run(scene, gx.Q1, tolerance=1e-12)
    assert problem.reaction_moments((0.0, 0.1, 0.3))["left"] == pytest.approx(-np.array(moment), abs=2e-8)


# -- springs -----------------------------------------------------------------------------------------------------------


@kinds
def test_a_foundation_carries_a_block(variant):
    """Sunk by p/k under a pressure p from above, whatever the time: the foundation is not ramped."""
    scene = block(
        square(2, shape=variant.cells[0]),
        growth=STILL,
        material=gx.Material(young=1.0, poisson=0.0),
        supports=(gx.Support("left", (0.0, None)),),
        loads=(gx.Foundation("bottom", 2.0), gx.Traction("top", (0.0, -0.1))),
    )
    for step in gx.march(scene, variant, problem := gx.discretise(scene, variant), tolerance=1e-12):
        _, y, _, v = displacements(problem).T
        assert v[np.isclose(y, 0)] == pytest.approx(-0.05 * step.load, abs=1e-9)
        assert step.force_defect < 1e-9


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1Q1], ids=lambda variant: variant.name)
def test_a_spring_stores_what_the_body_does_not(variant):
    """Work of the load = energy of the body + ½ k u²: the rule of trapezoids errs by the square of the load's steps."""
    k, t, mu = 0.4, 0.6, 0.5
    mesh = square(2, length=2.0)
    scene = block(
        mesh,
        growth=STILL,
        material=gx.Material(young=1.0, poisson=0.0),
        supports=ROLLERS,
        loads=(gx.Traction("right", (t, 0.0)), gx.Spring("right", (k, 0.0))),
        program=gx.Program(step=0.02, until=1.0, ramp=1.0),
    )
    width, work, old = boundary_size(mesh, "right"), 0.0, (0.0, 0.0)
    for step in gx.march(scene, variant, problem := gx.discretise(scene, variant), tolerance=1e-12):
        u = problem.sample_displacement(np.array([[2.0, 1.0]]))[0, 0]
        force = step.load * t * width
        work += (force + old[0]) / 2 * (u - old[1])
        old = force, u
    s = 1 + u / 2.0
    assert mu * (s - 1 / s) * width == pytest.approx(t * width - k * u, abs=1e-9)
    assert work == pytest.approx(energy(problem) + k * u**2 / 2, rel=1e-4)
    assert k * u**2 / 2 > 0.2 * work, "the spring must count"


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1Q1, gx.P2P1], ids=lambda variant: variant.name)
def test_newtons_method_knows_springs(variant):
    """Their stiffness belongs in the tangent, normal and tangential, beside what is ramped."""
    loads = (gx.Foundation("bottom", 0.7, 0.2), gx.Spring("right", (0.3, 0.1)), gx.Traction("top", (0.0, 0.1)))
    problem = gx.discretise(block(square(2, 0.06, shape=variant.cells[0]), loads=loads), variant)
    problem.system.begin_step(0.1, 0.5)
    set_iterate(
        problem,
        lambda x: np.stack([0.3 * np.sin(2 * x[0]) + 0.1 * x[1], 0.2 * x[0] * x[1] - 0.15 * x[1]]),
        lambda x: 1.0 + 0.3 * np.cos(3 * x[0] + x[1]),
    )
    assert_tangent_matches_differences(problem, tangent(problem))


def test_only_what_a_spring_resists_is_held():
    """A foundation without friction lets a body slide; one below and one beside it hold it, but for no turn."""
    loads = (gx.Foundation("bottom", 1.0),)
    with pytest.raises(InputError, match="is free to move along x"):
        gx.discretise(block(square(2), supports=(), loads=loads), gx.Q1)
    gx.discretise(block(square(2), supports=(), loads=(*loads, gx.Foundation("left", 1.0))), gx.Q1)
    gx.discretise(block(square(2), supports=(), loads=(gx.Spring("bottom", 1.0),)), gx.Q1)
    with pytest.raises(InputError, match="is free to move along y"):
        gx.discretise(block(square(2), supports=(), loads=(gx.Spring("bottom", (1.0, 0.0)),)), gx.Q1)
    with pytest.raises(InputError, match="has no support"):
        block(square(2), supports=(), loads=(gx.Foundation("bottom", 0.0),))


REFUSED = {
    "axis": (lambda: block(cube(1), supports=(gx.Rotation("back", 0.1),)), "the rotation of 'back' has no axis"),
    "about": (lambda: block(supports=(gx.Rotation("left", 0.1, (0.0,)),)), "about, of the rotation of 'left', has 1"),
    "angle": (lambda: gx.Rotation("left", np.nan), "the angle of the rotation of 'left' is nan: a finite number"),
    "free": (lambda: gx.Rotation("left", 0.1, free=(5,)), "a free direction of the rotation of 'left' is 5: 0, 1 or 2"),
    "boundary": (lambda: block(supports=(gx.Rotation("tip", 0.1),)), "the mesh has no boundary named 'tip'"),
    "moment": (lambda: block(loads=(gx.Moment("right", (0.1, 0.0)),)), "has 2 entries: the mesh needs a number"),
    "no moment": (lambda: gx.Moment("right", np.inf), "the moment on 'right' is inf: a finite number would be right"),
    "spring": (
        lambda: gx.Spring("right", -1.0),
        "the stiffness of the spring on 'right' is -1: a number of at",
    ),
    "springs": (
        lambda: gx.discretise(block(loads=(gx.Spring("right", (1.0,)),)), gx.Q1),
        "the stiffness of the spring on 'right' has 1 entries: the mesh needs 2",
    ),
    "foundation": (lambda: gx.Foundation("right", np.nan), "the normal stiffness of the foundation of 'right' is nan"),
}


@pytest.mark.parametrize(("make", "sentence"), REFUSED.values(), ids=REFUSED)
def test_what_cannot_be_meant_is_refused(make, sentence):
    """In one sentence, with the boundary and what would be right."""
    with pytest.raises(InputError) as caught:
        make()
    assert sentence in str(caught.value)


def test_a_turned_boundary_goes_with_a_table():
    """To and fro: at the end the body is where it began."""
    turn = gx.Rotation("right", 0.2, displacement=(0.05, 0.0), history=gx.Table(((0.0, 0.0), (0.2, 1.0), (0.4, 0.0))))
    scene = block(square(2), growth=STILL, supports=(gx.Support("left"), turn), loads=())
    steps, problem = run(replace(scene, program=gx.Program(0.1, 0.4)), gx.Q1, tolerance=1e-12)
    assert np.abs(steps[1].reactions["right"]).max() > 1e-3
    assert displacements(problem)[:, 2:] == pytest.approx(0.0, abs=1e-10)


@pytest.mark.parametrize(
    ("turn", "told"),
    [
        ({"axis": (0.0, 0.0, -1.0)}, "has an axis, and its body is plane, in which angles are from x to y"),
        ({"free": (2,)}, "is free along direction 2 of a body in 2 dimensions: directions from 0 to 1"),
    ],
)
def test_words_of_space_are_refused_in_the_plane(turn, told):
    """An axis was left out without a word, and with it the sign of the angle."""
    scene = block(square(1), growth=STILL, supports=(gx.Support("left"), gx.Rotation("right", 0.1)), loads=())
    with pytest.raises(InputError, match=told):
        replace(scene, supports=(gx.Support("left"), gx.Rotation("right", 0.1, **turn)))
