"""Finite-strain kinematics: F, J and I₁ (the paper's section 2.1)."""

from typing import Any

import ufl


def deformation_gradient(displacement: Any) -> Any:
    """F = I + ∇u, shape (dim, dim), no unit."""
    return ufl.Identity(displacement.ufl_shape[0]) + ufl.grad(displacement)


def volume_ratio(F: Any) -> Any:
    """J = det F, no unit."""
    return ufl.det(F)


def first_invariant(F: Any) -> Any:
    """I₁ = b : 1 with b = F Fᵀ, no unit; in two dimensions (plane strain) the out-of-plane 1 is counted."""
    return ufl.inner(F, F) + (3 - F.ufl_shape[0])
