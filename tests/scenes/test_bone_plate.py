"""The plate of bone under nodal forces, whose law is FEBio's, against the scalar solution of one of its points."""

import numpy as np
import pytest
from blocks import densities, displacements, run
from scipy.optimize import brentq

import growthx as gx


def scalar_solution(scene, force):
    """(ρ, λ₁, λ₂) step by step of implicit Euler: P₁₁ = F/A, P₂₂ = 0 and ρ − ρₙ = Δt c [ρ^(n−1) Ψ − Ψ*], ρ* = 1."""
    E, nu, n = scene.material.young, scene.material.poisson, scene.material.density_exponent
    lam, mu = E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu))
    c, attractor, dt = scene.growth.rate, scene.growth.attractor, scene.program.step
    rho, found = 1.0, []

    def stretches(weight, traction):
        def across(s):
            return brentq(lambda q: mu * (q - 1 / q) + lam * np.log(s * q * q) / q, 0.3, 2.0, xtol=1e-15)

        def along(s):
            return weight * (mu * (s - 1 / s) + lam * np.log(s * across(s) ** 2) / s) - traction

        s = brentq(along, 1.0, 3.0, xtol=1e-15)
        return s, across(s)

    for k in range(1, round(scene.program.until / dt) + 1):
        traction = force / 0.4 * min(k * dt / scene.program.ramp, 1.0)

        def excess(r, traction=traction, old=rho):
            s, q = stretches(r**n, traction)
            J = s * q * q
            psi = lam / 2 * np.log(J) ** 2 + mu / 2 * (s * s + 2 * q * q - 3 - 2 * np.log(J))
            return r - old - dt * c * (r ** (n - 1) * psi - attractor)

        rho = brentq(excess, 0.7 * rho, 1.5 * rho, xtol=1e-14)
        found.append((rho, *stretches(rho**n, traction)))
    return np.array(found)


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1, gx.Q1Q1], ids=lambda variant: variant.name)
@pytest.mark.parametrize("n", [2.0, 0.5])
def test_the_plate_is_its_scalar_solution(variant, n):
    """Density and the norm of the displacements of all nodes at each step: forces, law and stiffness together."""
    scene = gx.scenes.bone_plate(3, force=0.04, n=n)
    assert scene.mesh.cell_count == 18
    steps, problem = run(scene, variant, tolerance=1e-13)
    expected = scalar_solution(scene, 0.04)
    assert [step.min_density for step in steps] == pytest.approx(expected[:, 0], rel=1e-8)
    assert [step.max_density for step in steps] == pytest.approx(expected[:, 0], rel=1e-8)
    assert expected[-1, 0] > 1.05, "bone must grow"
    assert steps[-1].reactions["left"] == pytest.approx([-0.04, 0.0, 0.0], abs=1e-11)
    found = displacements(problem)
    homogeneous = found[:, :3] * (expected[-1, [1, 2, 2]] - 1)
    assert np.linalg.norm(found[:, 3:]) == pytest.approx(np.linalg.norm(homogeneous), rel=1e-8)
    assert found[:, 3:] == pytest.approx(homogeneous, abs=1e-8)
    assert densities(problem)[:, 3] == pytest.approx(expected[-1, 0], rel=1e-8)


def test_its_size_is_that_of_febios():
    """About 878 cells in one layer, and as many forces as the end has nodes."""
    scene = gx.scenes.bone_plate()
    assert scene.mesh.cell_count == 882
    assert len(scene.loads[0].nodes) == 44
    assert np.sum(scene.loads[0].force, axis=0) == pytest.approx([0.04, 0.0, 0.0], abs=1e-16)
