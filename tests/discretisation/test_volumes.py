"""Bodies in three dimensions: the same code on hexahedra and tetrahedra, where a two is easily left for a dimension."""

import numpy as np
import pytest
from blocks import (
    COMM,
    assert_tangent_matches_differences,
    block,
    cube,
    densities,
    displacements,
    run,
    set_iterate,
    tangent,
)
from scipy.optimize import root

import growthx as gx
from growthx.discretisation.variants import CATALOGUE

variants = pytest.mark.parametrize("variant", CATALOGUE.values(), ids=CATALOGUE)
E, NU, REFERENCE, RATE, ATTRACTOR, TRACTION = 3.0, 0.3, 1.2, 4.0, 0.05, 0.9
STEP, STEPS = 0.25, 3


def body(variant, **changes):
    """A distorted cube of two cells along each side."""
    return block(cube(2, 0.1, variant.cells[1]), **changes)


@variants
def test_tangent_is_the_derivative_of_the_forces(variant):
    """At an iterate that bends, shears and twists; the condensed one has more densities and nodes per cell here."""
    problem = gx.discretise(body(variant), variant)
    problem.system.begin_step(0.1, 0.7)
    set_iterate(
        problem,
        lambda x: np.stack(
            [0.3 * np.sin(2 * x[0]) + 0.1 * x[1] * x[2], 0.2 * x[0] * x[1] - 0.15 * x[2], 0.2 * x[0] ** 2 + 0.1 * x[2]]
        ),
        lambda x: 1.0 + 0.3 * np.cos(3 * x[0] + x[1] - x[2]),
    )
    exact = tangent(problem)
    assert_tangent_matches_differences(problem, exact)
    if problem.system.symmetric:
        assert exact == pytest.approx(exact.T, rel=0, abs=1e-14 * np.abs(exact).max())


def recursion():
    """Implicit Euler for the density of a bar with free sides: rows (λ₁, λ₂ = λ₃, ρ), written from (6), (7), (17)."""
    lam, mu = E * NU / ((1 + NU) * (1 - 2 * NU)), E / (2 * (1 + NU))

    def balances(state, old, traction):
        a, b, rho = state
        J, weight = a * b * b, (rho / REFERENCE) ** 2
        energy = lam / 2 * np.log(J) ** 2 + mu / 2 * (a**2 + 2 * b**2 - 3 - 2 * np.log(J))
        source = RATE * ((rho / REFERENCE) ** -3 * weight * energy - ATTRACTOR)
        return [
            weight * (mu * a + (lam * np.log(J) - mu) / a) - traction,
            weight * (mu * b + (lam * np.log(J) - mu) / b),
            rho - old - STEP * source,
        ]

    state, rows = np.array([1.0, 1.0, REFERENCE]), []
    for k in range(1, STEPS + 1):
        found = root(balances, state, args=(state[2], min(1.0, k / 2) * TRACTION), tol=1e-14)
        assert np.abs(found.fun).max() < 1e-13
        state = found.x
        rows.append(state)
    return np.array(rows)


@variants
def test_every_variant_is_the_scalar_equation(variant):
    """Free on all sides, so not in plane strain: a third direction left out of I₁ or J would show in the first step."""
    scene = body(
        variant,
        material=gx.Material(E, NU, REFERENCE),
        growth=gx.EnergyDrivenGrowth(ATTRACTOR, RATE),
        supports=(
            gx.Support("left", (0.0, None, None)),
            gx.Support("bottom", (None, 0.0, None)),
            gx.Support("front", (None, None, 0.0)),
        ),
        loads=(gx.Traction("right", (TRACTION, 0.0, 0.0)),),
        program=gx.Program(step=STEP, until=STEPS * STEP, ramp=2 * STEP),
    )
    problem = gx.discretise(scene, variant)
    expected = recursion()
    assert np.ptp(expected[:, 2]) > 0.05, "the density must move for the comparison to mean something"
    for step, (along, across, rho) in zip(gx.march(scene, variant, problem, tolerance=1e-13), expected, strict=True):
        assert (step.min_density, step.max_density) == pytest.approx((rho, rho), rel=1e-10)
        assert step.mass == pytest.approx(rho, rel=1e-10)
        assert step.mass_defect < 1e-13
        x, y, z, *u = displacements(problem).T
        for moved, place, stretch in zip(u, (x, y, z), (along, across, across), strict=True):
            assert moved == pytest.approx((stretch - 1) * place, abs=1e-10)


@pytest.mark.parametrize("variant", [gx.Q1Q1, gx.Q1P0, gx.Q1, gx.P1P1, gx.P1P0], ids=lambda variant: variant.name)
def test_loads_and_reactions_in_space(variant):
    """Each component of the load is borne by the support, region by region and step by step."""
    steps, problem = run(body(variant, growing=("bone",)), variant)
    for step in steps:
        assert step.reactions["left"] == pytest.approx(np.array([-0.1, 0.02, -0.01]) * step.load, abs=1e-11)
        assert step.mass_defect < 1e-10
    assert COMM.allreduce(len(problem.growing_dofs)) < problem.density_space.dofmap.index_map.size_global
    x, _, _, rho = densities(problem).T
    assert np.all(rho[x > 0.65] == 1.2) and np.any(rho[x < 0.5] != 1.2)
