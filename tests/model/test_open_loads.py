"""Loads that follow the state, loads with a history, and bodies held at points."""

from dataclasses import replace

import numpy as np
import pytest
import ufl
from blocks import (
    COMM,
    ROLLERS,
    assert_tangent_matches_differences,
    block,
    cube,
    densities,
    displacements,
    run,
    set_iterate,
    square,
    tangent,
)

import growthx as gx
from growthx.common.errors import InputError
from growthx.discretisation.discretisation import Discretisation

KINDS = (gx.Q1Q1, gx.Q1P0, gx.Q1, gx.Q1sri, gx.P2P1)
kinds = pytest.mark.parametrize("variant", KINDS, ids=lambda variant: variant.name)
LOCAL = (gx.Q1P0, gx.Q1, gx.Q1sri, gx.P1)
STILL = gx.EnergyDrivenGrowth(attractor=0.0, rate=0.0)

SPRING = gx.OpenTraction("right", lambda u, rho, x: -0.5 * (1 + x[1]) * u)
WEIGHT = gx.OpenBodyForce(lambda u, rho, x: rho * ufl.as_vector([0.05, -0.1]))
LOADS = {
    "pressure": (gx.Pressure("top", 0.1),),
    "suction": (gx.Pressure("right", -0.1), gx.Pressure("bottom", 0.05)),
    "spring": (gx.Traction("right", (0.1, 0.0)), SPRING),
    "weight": (WEIGHT,),
    "bed": (gx.OpenBodyForce(lambda u, rho, x: -0.3 * ufl.dot(u, u) * u),),
    "all": (gx.Traction("right", (0.1, 0.0)), gx.Pressure("top", 0.1), SPRING, WEIGHT),
}
loads = pytest.mark.parametrize("loads", LOADS.values(), ids=LOADS)


# -- the tangent -------------------------------------------------------------------------------------------------------


def tangent_at_an_iterate(variant, **changes):
    problem = gx.discretise(block(square(2, 0.06, shape=variant.cells[0]), **changes), variant)
    problem.system.begin_step(0.1, 0.7)
    # A held density must stay what it is, so where some rest the iterate's density is the start's.
    set_iterate(
        problem,
        lambda x: np.stack([0.3 * np.sin(2 * x[0]) + 0.1 * x[1], 0.2 * x[0] * x[1] - 0.15 * x[1]]),
        lambda x: np.full_like(x[0], 1.2) if "growing" in changes else 1.0 + 0.3 * np.cos(3 * x[0] + x[1]),
    )
    return problem, tangent(problem)


@kinds
@loads
@pytest.mark.parametrize("growing", [None, ("bone",)], ids=["all grow", "some rest"])
def test_tangent_is_the_derivative_of_the_forces(variant, loads, growing):
    """Loads that follow the state change the stiffness: Newton's method must know, also where a region rests."""
    changes = {} if growing is None else {"growing": growing}
    problem, exact = tangent_at_an_iterate(variant, loads=loads, **changes)
    assert_tangent_matches_differences(problem, exact)
    _, plain = tangent_at_an_iterate(variant, **changes)
    assert np.abs(exact - plain).max() > 1e-4 * np.abs(plain).max()
    assert not problem.system.symmetric, "it may be, for a spring, but nothing says so: it must not be factorised as if"


@pytest.mark.parametrize("variant", [gx.Q1Q1, gx.P2P1], ids=lambda variant: variant.name)
def test_tangent_of_a_traction_by_density(variant):
    """Nodal densities are known at a boundary: the coupling of momentum to density there must be in the tangent."""
    traction = gx.OpenTraction("right", lambda u, rho, x: rho**2 * ufl.as_vector([0.05, 0.0]))
    problem, exact = tangent_at_an_iterate(variant, loads=(traction,))
    assert_tangent_matches_differences(problem, exact)


@pytest.mark.parametrize("variant", [gx.Q1Q1, gx.Q1, gx.P1P0], ids=lambda variant: variant.name)
def test_tangent_of_pressure_in_space(variant):
    """J F⁻ᵀ N has nine entries there, and facets a surface."""
    problem = gx.discretise(block(cube(2, 0.1, variant.cells[1]), loads=(gx.Pressure("top", 0.1),)), variant)
    problem.system.begin_step(0.1, 0.7)
    set_iterate(
        problem,
        lambda x: np.stack([0.3 * x[0] + 0.1 * x[1] * x[2], 0.2 * x[0] * x[1] - 0.15 * x[2], 0.2 * x[0] ** 2]),
        lambda x: 1.0 + 0.3 * np.cos(3 * x[0] + x[1] - x[2]),
    )
    assert_tangent_matches_differences(problem, tangent(problem))


@pytest.mark.parametrize("variant", LOCAL, ids=lambda variant: variant.name)
def test_a_traction_by_density_is_refused_where_density_is_inside_cells_only(variant):
    """Such a density has no value on a boundary; the sentence names the load's place and what would do."""
    traction = gx.OpenTraction("right", lambda u, rho, x: rho * ufl.as_vector([0.05, 0.0]))
    with pytest.raises(InputError) as caught:
        gx.discretise(block(square(2, shape=variant.cells[0]), loads=(traction,)), variant)
    right = "Q1Q1, Q2Q2, S2Q1" if variant.cells[0] == "quadrilateral" else "P1P1, P2P2, P2P1"
    assert str(caught.value) == (
        f"the open load on 'right' depends on the density, which {variant.name} does not know at a boundary: "
        f"{right} would be right"
    )


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (
            lambda: block(loads=(gx.Pressure("tip", 1.0),)),
            "the mesh has no boundary named 'tip'; it has 'bottom', 'left', 'right', 'top'",
        ),
        (
            lambda: block(loads=(gx.OpenTraction("tip", lambda u, rho, x: u),)),
            "the mesh has no boundary named 'tip'; it has 'bottom', 'left', 'right', 'top'",
        ),
        (lambda: gx.Pressure("top", float("nan")), "the pressure on 'top' is nan: a finite number would be right"),
    ],
)
def test_impossible_parameters_are_refused(make, sentence):
    """The sentence must name quantity, place and remedy, before anything is discretised."""
    with pytest.raises(InputError) as caught:
        make()
    assert str(caught.value) == sentence


# -- pressure ----------------------------------------------------------------------------------------------------------


def stretch_under(pressure, young, poisson):
    """λ₁ = λ₂ of a body in plane strain under pressure all round: P₁₁ = −p λ from (7), by bisection."""
    lam, mu = young * poisson / ((1 + poisson) * (1 - 2 * poisson)), young / (2 * (1 + poisson))
    low, high = 0.3, 3.0
    for _ in range(80):
        s = (low + high) / 2
        excess = mu * s + (lam * 2 * np.log(s) - mu) / s + pressure * s
        low, high = (s, high) if excess < 0 else (low, s)
    return s


@kinds
@pytest.mark.parametrize("pressure", [0.3, -0.2])
def test_uniform_pressure_deforms_homogeneously(variant, pressure):
    """On distorted cells, on the deformed sides' own lengths and normals: λ must solve the scalar equation."""
    young, poisson = 2.0, 0.3
    scene = block(
        square(3, 0.06, shape=variant.cells[0]),
        material=gx.Material(young, poisson),
        growth=STILL,
        supports=ROLLERS,
        loads=(gx.Pressure("right", pressure), gx.Pressure("top", pressure)),
    )
    steps, problem = run(scene, variant, tolerance=1e-13)
    x, y, u, v = displacements(problem).T
    stretch = stretch_under(pressure, young, poisson)
    assert abs(stretch - 1) > 0.05
    assert u == pytest.approx((stretch - 1) * x, abs=1e-9)
    assert v == pytest.approx((stretch - 1) * y, abs=1e-9)
    # The planes of symmetry bear the pressure on their deformed length.
    assert steps[-1].reactions["left"] == pytest.approx([pressure * stretch, 0.0], abs=1e-9)
    assert steps[-1].reactions["bottom"] == pytest.approx([0.0, pressure * stretch], abs=1e-9)


def turned(angle, along, across):
    """Displacement of a block that is stretched and then turned as a whole."""
    rotation = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return lambda x: rotation @ (np.diag([along, across]) @ x[:2]) - x[:2]


@kinds
def test_resultant_of_pressure_is_normal_to_the_deformed_side(variant):
    """p times the deformed length, against the deformed outward normal, whatever the body's turn and stretch."""
    angle, along, across, pressure, share = 0.7, 1.3, 0.8, 0.4, 0.5
    mesh = square(2, 0.06, length=1.5, shape=variant.cells[0])
    forces = []
    for loads in ((gx.Pressure("right", pressure),), ()):
        # Held where the turn leaves it: the iterate is the turned body as a whole, which `discretise` would refuse.
        scene = block(mesh, loads=loads, supports=(gx.PointSupport((0.0, 0.0)),))
        problem = Discretisation(scene, variant)
        problem.system.begin_step(0.1, share)
        set_iterate(problem, turned(angle, along, across), lambda x: np.full_like(x[0], 1.2))
        problem.system.out_of_balance()
        forces.append(problem.system.loads.resultant(problem.system.borne))
    normal = np.array([np.cos(angle), np.sin(angle)])
    # Internal minus external forces: the pressure's own are what is less.
    assert forces[1] - forces[0] == pytest.approx(-share * pressure * 1.5 * across * normal, rel=1e-10)
    assert forces[1] == pytest.approx(np.zeros(2), abs=1e-12)


# -- springs, weights --------------------------------------------------------------------------------------------------


@kinds
def test_a_spring_shares_the_load(variant):
    """A block in homogeneous tension against a spring: P₁₁ = t − k u, with the stretches from the scalar equations."""
    young, poisson, traction, spring = 2.0, 0.0, 0.6, 0.4
    scene = block(
        square(2, 0.06, shape=variant.cells[0]),
        material=gx.Material(young, poisson),
        growth=STILL,
        supports=ROLLERS,
        loads=(gx.Traction("right", (traction, 0.0)), gx.OpenTraction("right", lambda u, rho, x: -spring * u)),
    )
    steps, problem = run(scene, variant, tolerance=1e-13)
    x, _, u, v = displacements(problem).T
    # For ν = 0, λ = 0 and μ = E/2: μ (s − 1/s) = t − k (s − 1), a quadratic in s; nothing moves across.
    mu = young / 2
    s = np.roots([mu + spring, -(traction + spring), -mu]).max()
    assert u == pytest.approx((s - 1) * x, abs=1e-10)
    assert v == pytest.approx(0 * x, abs=1e-10)
    assert steps[-1].reactions["left"] == pytest.approx([-(traction - spring * (s - 1)), 0.0], abs=1e-9)


@kinds
def test_supports_bear_the_weight(variant):
    """ρ g over the body: the reactions are the mass after the step times g, while mass grows; and no other."""
    gravity = np.array([0.02, -0.05])
    weight = gx.OpenBodyForce(lambda u, rho, x: rho * ufl.as_vector(list(gravity)))
    scene = block(square(3, 0.05, shape=variant.cells[0]), loads=(weight,))
    steps, _ = run(scene, variant)
    for step in steps:
        assert step.reactions["left"] == pytest.approx(-step.load * step.mass * gravity, rel=1e-8)
    assert abs(steps[-1].mass - 1.2) > 0.005, "mass must change for the weight to follow it"


@pytest.mark.parametrize("variant", [gx.Q1Q1, gx.Q1P0, gx.Q1], ids=lambda variant: variant.name)
def test_a_body_force_that_depends_on_nothing_is_a_dead_one(variant):
    """The open road and the dead one must end in the same place."""
    mesh = square(3, 0.05)
    dead = gx.BodyForce((0.05, -0.02))
    open_ = gx.OpenBodyForce(lambda u, rho, x: ufl.as_vector([0.05, -0.02]))
    first, second = (run(block(mesh, loads=(load,)), variant, tolerance=1e-12)[1] for load in (dead, open_))
    assert displacements(first) == pytest.approx(displacements(second), rel=1e-8, abs=1e-11)
    assert densities(first) == pytest.approx(densities(second), rel=1e-9)


@pytest.mark.parametrize("variant", [gx.Q1Q1, gx.Q1P0, gx.P2P1], ids=lambda variant: variant.name)
def test_a_traction_that_depends_on_nothing_is_a_dead_one(variant):
    """Also beside a region that rests, on which it acts here."""
    mesh = square(4, shape=variant.cells[0])
    dead = gx.Traction("right", lambda x: np.stack([0.1 * x[1], 0 * x[0]]))
    open_ = gx.OpenTraction("right", lambda u, rho, x: ufl.as_vector([0.1 * x[1], 0.0]))
    first, second = (
        run(block(mesh, loads=(load,), growing=("bone",)), variant, tolerance=1e-12)[1] for load in (dead, open_)
    )
    assert displacements(first) == pytest.approx(displacements(second), rel=1e-8, abs=1e-11)


# -- dead loads with a history -----------------------------------------------------------------------------------------


@kinds
def test_reactions_follow_a_history(variant):
    """Beside a ramped load: each has its own share of time, the history that of the end of the step."""
    history = lambda time: np.sin(7 * time) - 0.3  # noqa: E731
    scene = block(
        square(2, 0.05, shape=variant.cells[0]),
        loads=(
            gx.Traction("right", (0.1, -0.02), history=history),
            gx.BodyForce((0.0, 0.03)),
            gx.DistributedForce("top", (0.01, 0.0), history=lambda time: time),
        ),
    )
    for step in run(scene, variant)[0]:
        expected = history(step.time) * np.array([0.1, -0.02]) + step.load * np.array([0.0, 0.03])
        expected = expected + step.time * np.array([0.01, 0.0])
        assert step.reactions["left"] == pytest.approx(-expected, abs=1e-9)


@pytest.mark.parametrize("variant", [gx.Q1, gx.Q1Q1], ids=lambda variant: variant.name)
def test_a_history_like_the_ramp_is_the_ramp(variant):
    """Written twice, once as the program's ramp: the whole run must be the same."""
    plain = block(square(2, 0.05))
    timed = replace(plain, loads=(replace(plain.loads[0], history=plain.program.amplitude),))
    first, second = (run(scene, variant, tolerance=1e-12)[1] for scene in (plain, timed))
    assert displacements(first) == pytest.approx(displacements(second), rel=1e-9, abs=1e-12)
    assert densities(first) == pytest.approx(densities(second), rel=1e-11)


# -- bodies held at points ---------------------------------------------------------------------------------------------

POINTWISE = (gx.Q1Q1, gx.Q2Q2, gx.Q1P0, gx.Q1, gx.Q2, gx.P2P1, gx.P2)
pointwise = pytest.mark.parametrize("variant", POINTWISE, ids=lambda variant: variant.name)


@pointwise
def test_a_point_support_holds_that_node_alone(variant):
    """Free to stretch: two corners hold the body without a force across, in mixed spaces and on any rank."""
    scene = block(
        square(3, shape=variant.cells[0]),
        supports=(gx.PointSupport((0.0, 0.0)), gx.PointSupport((0.0, 1.0), (0.0, None))),
        loads=(gx.Traction("right", (0.1, 0.0)), gx.Traction("left", (-0.1, 0.0))),
    )
    problem = gx.discretise(scene, variant)
    held = [COMM.allreduce(int(condition.dof_indices()[1])) for condition in problem.system.conditions]
    assert held == [1, 1, 1], "each direction of each support holds one unknown, on one rank"
    steps = list(gx.march(scene, variant, problem))
    x, y, u, v = displacements(problem).T
    first, second = (np.isclose(x, 0) & np.isclose(y, place) for place in (0.0, 1.0))
    assert [u[first], v[first], u[second]] == pytest.approx(np.zeros((3, 1)), abs=1e-15)
    free = ~first & ~second & np.isclose(x, 0)
    assert free.any() and abs(v[second]) > 1e-3
    # In balance without the supports, which therefore bear nothing: u is homogeneous.
    assert u == pytest.approx(u.max() * x, abs=1e-9)
    assert steps[-1].reactions == {
        "(0, 0)": pytest.approx(np.zeros(2), abs=1e-10),
        "(0, 1)": pytest.approx(np.zeros(2), abs=1e-10),
    }


@pytest.mark.parametrize("variant", [gx.Q1Q1, gx.Q1, gx.P2P1], ids=lambda variant: variant.name)
def test_a_point_may_be_moved(variant):
    """The displacement grows with the load, and the reaction of the point is what the other support bears."""
    scene = block(
        square(2, shape=variant.cells[0]),
        supports=(gx.Support("left"), gx.PointSupport((1.0, 0.5), (0.1, None))),
        loads=(),
    )
    problem = gx.discretise(scene, variant)
    for step in gx.march(scene, variant, problem):
        x, y, u, _ = displacements(problem).T
        assert u[np.isclose(x, 1) & np.isclose(y, 0.5)] == pytest.approx([0.1 * step.load], rel=1e-14)
        pulled, borne = step.reactions["(1, 0.5)"], step.reactions["left"]
        assert pulled[0] > 0 and pulled[1] == 0
        assert pulled + borne == pytest.approx(np.zeros(2), abs=1e-9)


@pytest.mark.parametrize(
    ("at", "sentence"),
    [
        (
            (0.1, 0.2),
            "no node of the mesh is at (0.1, 0.2): a corner of a cell would be right for a support",
        ),
        ((0.0,), "the support at (0) has 1 coordinates: the mesh needs 2"),
        ((0.0, 0.0, 0.0), "the support at (0, 0, 0) has 3 coordinates: the mesh needs 2"),
    ],
)
@pytest.mark.parametrize("variant", [gx.Q1, gx.Q1Q1], ids=lambda variant: variant.name)
def test_a_place_without_a_node_is_refused(variant, at, sentence):
    """A support that holds nothing would leave the body free, silently."""
    with pytest.raises(InputError) as caught:
        gx.discretise(block(square(2), supports=(gx.PointSupport(at),)), variant)
    assert str(caught.value) == sentence


def test_a_nodes_place_counts_on_large_bodies_as_on_small_ones():
    """Places are compared with the body's size: in micrometres as in metres."""
    for length in (1e-6, 1e6):
        scene = block(
            square(3, length=length),
            supports=(gx.PointSupport((length / 3, length / 3)), gx.Support("left", (0.0, None))),
            loads=(),
        )
        problem = gx.discretise(scene, gx.Q1)
        assert [COMM.allreduce(int(c.dof_indices()[1])) for c in problem.system.conditions][:2] == [1, 1]


@pytest.mark.parametrize("variant", [gx.S2Q1, gx.S2fri], ids=lambda variant: variant.name)
def test_serendipity_is_held_at_a_corner(variant):
    """Its unknowns are moments without a position: the corner of a cell must be found all the same."""
    supports = (gx.PointSupport((0.0, 0.0)), gx.PointSupport((0.0, 1.0), (0.0, None)))
    steps, problem = run(block(square(2), supports=supports), variant)
    x, y, u, v = displacements(problem).T
    corner = (x == 0) & (y == 0)
    assert np.all(u[corner] == 0) and np.all(v[corner] == 0)
    assert sum(steps[-1].reactions.values()) == pytest.approx([-0.1, 0.02], abs=1e-10)


@pytest.mark.parametrize("variant", [gx.Q1, gx.Q1Q1], ids=lambda variant: variant.name)
@pytest.mark.parametrize(
    ("load", "sentence"),
    [
        (gx.OpenTraction("right", lambda u, rho, x: u[0]), "the open load on 'right' has values of shape of a scalar"),
        (gx.OpenBodyForce(lambda u, rho, x: ufl.as_vector([0.0, 0.0, 1.0])), "whole body has values of shape (3,)"),
    ],
)
def test_an_open_load_of_another_shape_is_refused(variant, load, sentence):
    """A law that gives a number, or too many of them, is the user's slip: one sentence, not the form compiler's."""
    with pytest.raises(InputError) as caught:
        gx.discretise(block(square(2), loads=(load,)), variant)
    assert sentence in str(caught.value) and "a vector of 2 is needed" in str(caught.value)


def test_a_history_that_is_no_number_is_refused():
    """It would end as a step that fails for no reason."""
    scene = block(square(2), loads=(gx.Traction("right", (0.1, 0.0), history=lambda t: np.nan if t > 0.15 else t),))
    with pytest.raises(InputError, match=r"^the history of a load at t = 0.2 is nan: a finite number would be right"):
        run(scene, gx.Q1)
