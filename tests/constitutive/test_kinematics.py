"""Strain measures of known deformations: the plane-strain 1 and the sign of J go wrong silently."""

import dolfinx
import numpy as np
import pytest
import ufl
from blocks import COMM, square

from growthx.constitutive.kinematics import deformation_gradient, principal_changes, shape_change, volume_change
from growthx.fem import kernels


def number(expression):
    """The value of a UFL expression of numbers."""
    return ufl.algorithms.expand_derivatives(expression)(())


@pytest.mark.parametrize("dim", [2, 3])
def test_first_invariant_is_that_of_three_dimensions(dim):
    """Plane strain: b : 1 counts the out-of-plane 1, so that the undeformed state has I₁ = 3 (spec's finding)."""
    assert number(shape_change(ufl.as_matrix(np.zeros((dim, dim)).tolist()))) == 0
    H, F = np.random.default_rng(dim).uniform(-0.3, 0.3, (dim, dim)), np.eye(3)
    F[:dim, :dim] += H
    expected = np.trace(F @ F.T) - 3 - 2 * (np.linalg.det(F) - 1)
    assert number(shape_change(ufl.as_matrix(H.tolist()))) == pytest.approx(expected, rel=1e-13)


def test_volume_change_keeps_the_sign_of_J():
    """An inverted cell is found by J < 0."""
    assert number(volume_change(ufl.as_matrix([[-1.0, 2.0], [1.5, -1.0]]))) == -4.0


@pytest.mark.parametrize("dim", [2, 3])
def test_volume_change_is_that_of_the_determinant(dim):
    """In space it has terms of three orders, one of which would be missed in the plane."""
    H = np.random.default_rng(dim).uniform(-0.3, 0.3, (dim, dim))
    expected = np.linalg.det(np.eye(dim) + H) - 1
    assert number(volume_change(ufl.as_matrix(H.tolist()))) == pytest.approx(expected, rel=1e-13)


def test_principal_changes_are_those_of_a_diagonal():
    """Homogeneous states and weak forms must mean the same strains."""
    extensions = (0.3, -0.2, 0.1)
    H = ufl.as_matrix(np.diag(extensions).tolist())
    assert principal_changes(extensions) == pytest.approx(
        (number(shape_change(H)), number(volume_change(H))), rel=1e-14
    )


def test_deformation_gradient_of_a_linear_displacement():
    """F = I + ∇u with (∇u)ᵢⱼ = ∂uᵢ/∂xⱼ: the transpose would pass every test of symmetric strains."""
    mesh = square(cells=2)
    gradient = np.array([[0.1, 0.4], [-0.2, 0.3]])
    u = dolfinx.fem.Function(dolfinx.fem.functionspace(mesh.domain, ("Lagrange", 1, (2,))))
    u.interpolate(lambda x: gradient @ x[:2])
    F = deformation_gradient(u)
    mean = [[dolfinx.fem.assemble_scalar(kernels.form(F[i, j] * ufl.dx)) for j in range(2)] for i in range(2)]
    assert np.allclose(COMM.allreduce(np.array(mean)), np.eye(2) + gradient, rtol=0, atol=1e-14)
