"""A block that deforms and grows homogeneously: every variant must reduce to the same scalar equations."""

import numpy as np
import pytest
from blocks import COMM, ROLLERS, block, densities, displacements, run, square
from scipy.optimize import root

import growthx as gx
from growthx.discretisation.variants import CATALOGUE

E, NU, REFERENCE, RATE, ATTRACTOR, TRACTION = 3.0, 0.3, 1.2, 4.0, 0.05, 0.9
STEP, RAMP, UNTIL = 0.25, 0.5, 1.5


def recursion(n, m):
    """Implicit Euler for the density with the stretches in balance: rows (λ₁, λ₂, ρ), written from (6), (7), (17)."""
    lam, mu = E * NU / ((1 + NU) * (1 - 2 * NU)), E / (2 * (1 + NU))

    def balances(state, old, traction):
        a, b, rho = state
        J, weight = a * b, (rho / REFERENCE) ** n
        energy = lam / 2 * np.log(J) ** 2 + mu / 2 * (a**2 + b**2 + 1 - 3 - 2 * np.log(J))
        source = RATE * ((rho / REFERENCE) ** -m * weight * energy - ATTRACTOR)
        return [
            weight * (mu * a + (lam * np.log(J) - mu) / a) - traction,
            weight * (mu * b + (lam * np.log(J) - mu) / b),
            rho - old - STEP * source,
        ]

    state, rows = np.array([1.0, 1.0, REFERENCE]), []
    for k in range(1, round(UNTIL / STEP) + 1):
        share = min(1.0, k * STEP / RAMP)
        found = root(balances, state, args=(state[2], share * TRACTION), tol=1e-14)
        assert np.abs(found.fun).max() < 1e-13
        state = found.x
        rows.append(state)
    return np.array(rows)


@pytest.mark.parametrize("variant", CATALOGUE.values(), ids=CATALOGUE)
@pytest.mark.parametrize("distortion", [0.0, 0.08], ids=["regular", "distorted"])
@pytest.mark.parametrize(("n", "m"), [(2.0, 3.0), (1.5, 3.0)], ids=["quadratic", "general"])
def test_every_variant_is_the_scalar_equation(variant, distortion, n, m):
    """Constants, signs, plane strain, the ramp and the time integration are all in these few numbers."""
    scene = block(
        square(2, distortion, shape=variant.cells[0]),
        material=gx.Material(E, NU, REFERENCE, n),
        growth=gx.EnergyDrivenGrowth(ATTRACTOR, RATE, m),
        supports=ROLLERS,
        loads=(gx.Traction("right", (TRACTION, 0.0)),),
        program=gx.Program(step=STEP, until=UNTIL, ramp=RAMP),
    )
    problem = gx.discretise(scene, variant)
    expected = recursion(n, m)
    assert np.ptp(expected[:, 2]) > 0.05, "the density must move for the comparison to mean something"
    steps = gx.march(scene, variant, problem, tolerance=1e-13)
    for step, (along, across, rho) in zip(steps, expected, strict=True):
        assert (step.min_density, step.max_density) == pytest.approx((rho, rho), rel=1e-10)
        assert step.mass == pytest.approx(rho, rel=1e-10)
        x, y, u, v = displacements(problem).T
        assert u == pytest.approx((along - 1) * x, abs=1e-10)
        assert v == pytest.approx((across - 1) * y, abs=1e-10)


def test_a_block_in_equilibrium_stays_there():
    """Started where R₀ = 0 under the full load, nothing moves: the source, not its drift, is balanced."""
    from growthx.constitutive.homogeneous import uniaxial_equilibrium

    material, growth = gx.Material(E, NU, REFERENCE), gx.EnergyDrivenGrowth(ATTRACTOR, RATE)
    rho = uniaxial_equilibrium(material, growth, TRACTION).density
    scene = block(
        material=material,
        growth=growth,
        supports=ROLLERS,
        loads=(gx.Traction("right", (TRACTION, 0.0)),),
        program=gx.Program(step=1.0, until=3.0),
        initial_density=rho,
    )
    _, problem = run(scene, gx.Q1)
    assert densities(problem)[:, 2] == pytest.approx(rho, rel=1e-10)
    assert COMM.allreduce(abs(problem.mass_rate())) < 1e-9
