"""The rate of momentum, by implicit Euler: motions with known recursions, balances, and the quasi-static limit."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import ufl
from blocks import (
    COMM,
    assert_tangent_matches_differences,
    block,
    densities,
    displacements,
    run,
    set_iterate,
    square,
    tangent,
)
from dolfinx.fem import Function, assemble_scalar, form

import growthx as gx
from growthx.common.errors import InputError
from growthx.constitutive.kinematics import displacement_gradient

STILL = gx.EnergyDrivenGrowth(attractor=0.0, rate=0.0)
CONSISTENT, LUMPED = gx.Inertia(), gx.Inertia(lumped=True)
# Each way to come by a density with consistent masses, and those whose masses may be lumped.
KINDS = [(variant, CONSISTENT) for variant in (gx.Q1Q1, gx.Q1P0, gx.Q1, gx.Q1sri, gx.P2P1)]
KINDS += [(variant, LUMPED) for variant in (gx.Q1Q1, gx.Q1P0, gx.Q1sri, gx.P1P1)]
NAMES = [f"{variant.name}-{'lumped' if inertia.lumped else 'consistent'}" for variant, inertia in KINDS]
kinds = pytest.mark.parametrize(("variant", "inertia"), KINDS, ids=NAMES)


# -- the tangent -------------------------------------------------------------------------------------------------------


def tangent_in_motion(variant, inertia, **changes):
    """After a first step, so that there is an old velocity; at an iterate far from balance."""
    scene = block(square(2, 0.06, shape=variant.cells[0]), inertia=inertia, **changes)
    problem = gx.discretise(scene, variant)
    next(gx.march(scene, variant, problem))
    problem.system.begin_step(0.1, 0.7, 0.2)
    rests = "growing" in changes
    set_iterate(
        problem,
        lambda x: np.stack([0.3 * np.sin(2 * x[0]) + 0.1 * x[1], 0.2 * x[0] * x[1] - 0.15 * x[1]]),
        # A held density must stay what it is, so where some rest the iterate's density is the start's.
        lambda x: np.full_like(x[0], 1.2) if rests else 1.0 + 0.3 * np.cos(3 * x[0] + x[1]),
    )
    return problem, tangent(problem)


@kinds
@pytest.mark.parametrize("growing", [None, ("bone",)], ids=["all grow", "some rest"])
def test_tangent_is_the_derivative_of_the_forces(variant, inertia, growing):
    """With ∂_ρ of the rate of momentum, which (27) leaves out: only then is Newton's method quadratic."""
    changes = {} if growing is None else {"growing": growing}
    problem, exact = tangent_in_motion(variant, inertia, **changes)
    assert_tangent_matches_differences(problem, exact)
    _, still = tangent_in_motion(variant, None, **changes)
    assert np.abs(exact - still).max() > 1e-2 * np.abs(still).max()
    assert not problem.system.symmetric


# -- motions with a known recursion ------------------------------------------------------------------------------------


def sideways(variant, inertia, **changes):
    """A block on rollers, free to move sideways under a force ρ* a per volume, as a whole."""
    acceleration, density = 0.7, 1.3
    # Masses at corners are shared out as ∫ Nᵢ dV, and so the force, on triangles and on rectangles only.
    distortion = 0.0 if inertia.lumped and variant.cells[0] == "quadrilateral" else 0.06
    scene = block(
        square(2, distortion, shape=variant.cells[0]),
        material=gx.Material(1.0, 0.25, density),
        growth=STILL,
        supports=(gx.Support("bottom", (None, 0.0)),),
        loads=(gx.BodyForce((acceleration * density, 0.0)),),
        program=gx.Program(step=0.1, until=0.5),
        inertia=inertia,
    )
    return replace(scene, **changes), acceleration


@kinds
def test_a_free_block_moves_as_implicit_euler_says(variant, inertia):
    """vₖ = vₖ₋₁ + Δt a, uₖ = uₖ₋₁ + Δt vₖ: so uₖ = a Δt² k (k + 1)/2, at all nodes alike, without a strain."""
    scene, acceleration = sideways(variant, inertia)
    problem = gx.discretise(scene, variant)
    for k, step in enumerate(gx.march(scene, variant, problem, tolerance=1e-13), start=1):
        _, _, u, v = displacements(problem).T
        assert u == pytest.approx(acceleration * 0.01 * k * (k + 1) / 2, rel=1e-8)
        assert v == pytest.approx(0.0, abs=1e-9)
        assert step.reactions["bottom"] == pytest.approx([0.0, 0.0], abs=1e-9)


@pytest.mark.parametrize("inertia", [CONSISTENT, LUMPED], ids=["consistent", "lumped"])
@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1Q1], ids=lambda variant: variant.name)
def test_steps_of_different_lengths(variant, inertia):
    """The old velocity is that of the old step, whatever the new one's length: Δt = 0.1, 0.1, 0.05."""
    scene, acceleration = sideways(variant, inertia, program=gx.Program(step=0.1, until=0.25))
    steps, problem = run(scene, variant, tolerance=1e-13)
    velocity, moved = 0.0, 0.0
    for length in (0.1, 0.1, 0.05):
        velocity += length * acceleration
        moved += length * velocity
    assert [step.time_step for step in steps] == pytest.approx([0.1, 0.1, 0.05])
    assert displacements(problem)[:, 2] == pytest.approx(moved, rel=1e-8)


@kinds
def test_the_motion_is_forgotten_in_a_rejected_step(variant, inertia):
    """An attempt that fails must leave neither its displacement nor its velocity behind."""
    scene, _ = sideways(variant, inertia)
    first, second = gx.discretise(scene, variant), gx.discretise(scene, variant)
    marches = [gx.march(scene, variant, problem, tolerance=1e-13) for problem in (first, second)]
    for march in marches:
        next(march)
    second.system.begin_step(0.07, 1.0, 0.17)
    set_iterate(second, lambda x: np.stack([x[0] * x[1], 0.1 * x[1]]), lambda x: 1.0 + 0.1 * x[0])
    second.system.out_of_balance()
    second.system.reject_step()
    for march in marches:
        next(march)
    assert displacements(second) == pytest.approx(displacements(first), rel=1e-9, abs=1e-11)


def vibrating(variant, inertia, **changes):
    """A clamped block that is pulled and let go after the first step."""
    scene = block(
        square(3, 0.05, shape=variant.cells[0]),
        growth=STILL,
        loads=(gx.Traction("right", (0.1, -0.05), history=lambda time: 1.0 if time < 1.5 else 0.0),),
        program=gx.Program(step=1.0, until=12.0),
        inertia=inertia,
    )
    return replace(scene, **changes)


@pytest.mark.parametrize("inertia", [CONSISTENT, LUMPED], ids=["consistent", "lumped"])
@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1Q1], ids=lambda variant: variant.name)
def test_free_vibrations_lose_energy_and_swing(variant, inertia):
    """Implicit Euler damps, it never feeds: stored plus kinetic energy falls in each step; and the block swings."""
    scene = vibrating(variant, inertia)
    problem = gx.discretise(scene, variant)
    old = Function(problem.displacement_space)
    u, dV = problem.displacement, ufl.dx(domain=scene.mesh.domain, metadata={"quadrature_degree": 3})
    dM = dV.reconstruct(metadata={"quadrature_rule": "vertex", "quadrature_degree": 1}) if inertia.lumped else dV
    velocity = u - old  # Δt = 1
    kinetic = form(problem.density / 2 * ufl.inner(velocity, velocity) * dM)
    stored = form(scene.material.weight(problem.density) * scene.material.energy_at(displacement_gradient(u)) * dV)
    energies, tips = [], []
    for _ in gx.march(scene, variant, problem, tolerance=1e-12):
        energies.append(COMM.allreduce(assemble_scalar(kinetic) + assemble_scalar(stored)))
        old.x.array[:] = u.x.array
        x, _, moved, _ = displacements(problem).T
        tips.append(moved[np.isclose(x, 1)].mean())
    assert all(after < before for before, after in pairwise(energies))
    assert energies[-1] < 0.2 * energies[0]
    assert min(tips) < -1e-3 < 1e-2 < max(tips), "it must swing through its place at rest"


@kinds
def test_long_steps_are_quasi_static(variant, inertia):
    """ρ a falls with Δt⁻²: with steps of 10⁶ and the same growth per step, the run without inertia comes out."""
    slow = block(
        square(2, 0.05, shape=variant.cells[0]),
        growth=gx.EnergyDrivenGrowth(0.01, 5e-7),
        program=gx.Program(step=1e6, until=4e6, ramp=2e6),
    )
    (_, first), (_, second) = (run(scene, variant, tolerance=1e-12) for scene in (slow, replace(slow, inertia=inertia)))
    assert np.ptp(densities(first)[:, 2]) > 1e-3
    assert displacements(second) == pytest.approx(displacements(first), rel=1e-7, abs=1e-10)
    assert densities(second) == pytest.approx(densities(first), rel=1e-8)


# -- balances ----------------------------------------------------------------------------------------------------------


@kinds
def test_reactions_and_loads_are_the_rate_of_momentum(variant, inertia):
    """Load + reactions = ∫ ρ (v − vₙ)/Δt dV, integrated here from displacements, in each step of a growing block."""
    scene = block(
        square(3, 0.05, shape=variant.cells[0]),
        program=gx.Program(step=0.5, until=2.0, ramp=1.0),
        inertia=inertia,
    )
    problem = gx.discretise(scene, variant)
    older, old = (Function(problem.displacement_space) for _ in range(2))
    dV = ufl.dx(domain=scene.mesh.domain, metadata={"quadrature_degree": variant.momentum_degree})
    acceleration = (problem.displacement - 2 * old + older) / 0.25
    if inertia.lumped:
        from growthx.fem.lumping import at_nodes, node_shares

        acceleration, dV = node_shares(scene.mesh.domain) * acceleration, at_nodes(dV)
    rates = [form(problem.density * acceleration[i] * dV) for i in range(2)]
    largest = 0.0
    for step in gx.march(scene, variant, problem, tolerance=1e-12):
        rate = np.array([COMM.allreduce(assemble_scalar(each)) for each in rates])
        load = step.load * np.array([0.1, -0.02])
        assert load + step.reactions["left"] == pytest.approx(rate, abs=1e-9)
        largest = max(largest, np.abs(rate).max())
        older.x.array[:] = old.x.array
        old.x.array[:] = problem.displacement.x.array
    assert largest > 0.01, "there must be momentum to speak of"


@pytest.mark.parametrize("inertia", [CONSISTENT, LUMPED], ids=["consistent", "lumped"])
@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1Q1], ids=lambda variant: variant.name)
def test_a_region_at_rest_has_inertia_too(variant, inertia):
    """What does not grow moves all the same, with the density it has from the start."""
    scene, acceleration = sideways(variant, inertia)
    scene = replace(scene, mesh=square(4), growing=("bone",), initial_density={"bone": 1.3, "implant": 1.3})
    _, problem = run(scene, variant, tolerance=1e-13)
    assert displacements(problem)[:, 2] == pytest.approx(acceleration * 0.01 * 5 * 6 / 2, rel=1e-8)


# -- where lumping makes sense -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "variant", [gx.Q1, gx.Q2, gx.Q2Q2, gx.S2Q1, gx.S2fri, gx.P1, gx.P2, gx.P2P1, gx.P2P2], ids=lambda v: v.name
)
def test_lumped_masses_need_corners(variant):
    """Row sums vanish or are negative at corners of quadratic cells, and point densities are not known there."""
    with pytest.raises(InputError) as caught:
        gx.discretise(block(square(2, shape=variant.cells[0]), inertia=LUMPED), variant)
    right = "Q1Q1, Q1P0, Q1sri" if variant.cells[0] == "quadrilateral" else "P1P1, P1P0"
    assert str(caught.value) == (
        f"{variant.name} has unknowns or densities beside the corners of the cells, where lumped inertia has its "
        f"masses: {right} would be right"
    )


def test_lumped_and_consistent_masses_differ_and_converge():
    """Two ways to spread the same mass: apart on a coarse mesh, less so on a finer one."""
    apart = []
    for cells in (2, 4):
        tips = []
        for inertia in (CONSISTENT, LUMPED):
            _, problem = run(vibrating(gx.Q1P0, inertia, mesh=square(cells)), gx.Q1P0)
            x, y, u, _ = displacements(problem).T
            tips.append(float(u[np.isclose(x, 1) & np.isclose(y, 0.5)][0]))
        apart.append(abs(tips[0] - tips[1]))
    assert apart[0] > 1.5 * apart[1] > 0
