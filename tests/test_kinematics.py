"""Strain measures of known deformations: the plane-strain 1 and the sign of J go wrong silently."""

import dolfinx
import numpy as np
import pytest
import ufl
from blocks import COMM, square

from growthx.kinematics import deformation_gradient, first_invariant, volume_ratio


def number(expression):
    """The value of a UFL expression of numbers."""
    return ufl.algorithms.expand_derivatives(expression)(())


@pytest.mark.parametrize("dim", [2, 3])
def test_first_invariant_is_that_of_three_dimensions(dim):
    """Plane strain: b : 1 counts the out-of-plane 1, so that the undeformed state has I₁ = 3 (spec's finding)."""
    assert number(first_invariant(ufl.Identity(dim))) == 3
    F = np.eye(3)
    F[:dim, :dim] += np.random.default_rng(dim).uniform(-0.3, 0.3, (dim, dim))
    assert number(first_invariant(ufl.as_matrix(F[:dim, :dim].tolist()))) == pytest.approx(np.trace(F @ F.T), rel=1e-15)


def test_volume_ratio_keeps_its_sign():
    """An inverted cell is found by J < 0."""
    assert number(volume_ratio(ufl.as_matrix([[0.0, 2.0], [1.5, 0.0]]))) == -3.0


def test_deformation_gradient_of_a_linear_displacement():
    """F = I + ∇u with (∇u)ᵢⱼ = ∂uᵢ/∂xⱼ: the transpose would pass every test of symmetric strains."""
    mesh = square(cells=2)
    gradient = np.array([[0.1, 0.4], [-0.2, 0.3]])
    u = dolfinx.fem.Function(dolfinx.fem.functionspace(mesh.domain, ("Lagrange", 1, (2,))))
    u.interpolate(lambda x: gradient @ x[:2])
    F = deformation_gradient(u)
    mean = [[dolfinx.fem.assemble_scalar(dolfinx.fem.form(F[i, j] * ufl.dx)) for j in range(2)] for i in range(2)]
    assert np.allclose(COMM.allreduce(np.array(mean)), np.eye(2) + gradient, rtol=0, atol=1e-14)
