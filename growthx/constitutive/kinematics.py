"""Finite-strain kinematics from the displacement gradient H = ∇u = F − I (the paper's section 2.1).

H rather than F: adding the identity would take the digits of small strains.
"""

from enum import StrEnum
from typing import Any

import ufl


class Plane(StrEnum):
    """What a plane body does out of its plane.

    STRAIN: it keeps its thickness, λ₃ = 1.  STRESS: it bears nothing there, σ₃₃ = 0, and its thickness follows.

    Example:
        >>> gx.Plane("stress") is gx.Plane.STRESS
        True
    """

    STRAIN = "strain"
    STRESS = "stress"


def displacement_gradient(displacement: Any) -> Any:
    """H = ∇u, shape (dim, dim), no unit."""
    return ufl.grad(displacement)


def deformation_gradient(displacement: Any) -> Any:
    """F = I + ∇u, shape (dim, dim), no unit."""
    return ufl.Identity(displacement.ufl_shape[0]) + ufl.grad(displacement)


def in_space(H: Any, thickness_change: Any = 0.0) -> Any:
    """H of shape (3, 3): of one in the plane, with zeros out of the plane but for the thickness stretch less one."""
    if H.ufl_shape[0] == 3:
        return H
    return ufl.as_matrix([[H[0, 0], H[0, 1], 0.0], [H[1, 0], H[1, 1], 0.0], [0.0, 0.0, thickness_change]])


def in_plane(tensor: Any) -> Any:
    """The part in the plane, (2, 2), of a tensor of shape (3, 3)."""
    return ufl.as_matrix([[tensor[i, j] for j in range(2)] for i in range(2)])


def volume_change(H: Any) -> Any:
    """J − 1 = tr H + ½ [tr²H − tr H²] + det H (the last in space only: in the plane the second term is det H)."""
    trace = ufl.tr(H)
    if H.ufl_shape[0] == 2:
        return trace + ufl.det(H)
    return trace + (trace * trace - ufl.inner(H, H.T)) / 2 + ufl.det(H)


def shape_change(H: Any) -> Any:
    """I₁ − 3 − 2 [J − 1] = 2 |sym H|² − tr²H − 2 det H (the last in space only), no unit.

    I₁ = b : 1 with b = F Fᵀ counts, in two dimensions (plane strain), the out-of-plane 1.
    """
    trace = ufl.tr(H)
    if H.ufl_shape[0] == 2:
        return (H[0, 0] - H[1, 1]) ** 2 + (H[0, 1] + H[1, 0]) ** 2
    strain = ufl.sym(H)
    return 2 * ufl.inner(strain, strain) - trace * trace - 2 * ufl.det(H)


def principal_changes(extensions: tuple[Any, Any, Any]) -> tuple[Any, Any]:
    """`shape_change` and `volume_change` of principal stretches less one, λᵢ − 1: numbers or arrays."""
    a, b, c = extensions
    products = a * b + b * c + c * a + a * b * c
    return a * a + b * b + c * c - 2 * products, a + b + c + products
