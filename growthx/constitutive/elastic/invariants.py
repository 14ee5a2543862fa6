"""What an isotropic energy knows of a deformation: invariants with the digits of small strains, for numbers and UFL."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import ufl

from growthx.constitutive import kinematics


def green_strain(H: Any) -> Any:
    """E = ½ [Fᵀ F − I] = sym H + ½ Hᵀ H of H = ∇u, of its shape, no unit."""
    return ufl.sym(H) + H.T * H / 2


@dataclass(frozen=True)
class Invariants:
    """Invariants of a deformation, each computed when it is asked for: numbers, complex ones too, arrays or UFL."""

    _shape: Callable[[], Any]
    _volume: Callable[[], Any]
    _principal: Callable[[], tuple[Any, Any, Any]]
    _linear: Callable[[], tuple[Any, Any]]

    @staticmethod
    def of_gradient(H: Any) -> Invariants:
        """Those of H = ∇u in UFL, shape (dim, dim)."""
        return Invariants(
            lambda: kinematics.shape_change(H),
            lambda: kinematics.volume_change(H),
            lambda: _of_tensor(2 * green_strain(H)),
            lambda: (ufl.tr(H), ufl.inner(ufl.sym(H), ufl.sym(H))),
        )

    @staticmethod
    def of_extensions(extensions: tuple[Any, Any, Any]) -> Invariants:
        """Those of principal stretches less one, λᵢ − 1: numbers or arrays."""
        shape, volume = kinematics.principal_changes(extensions)
        a, b, c = (extension * (2 + extension) for extension in extensions)
        linear = sum(extensions), sum(extension * extension for extension in extensions)
        return Invariants(
            lambda: shape, lambda: volume, lambda: (a + b + c, a * b + b * c + c * a, a * b * c), lambda: linear
        )

    @cached_property
    def shape(self) -> Any:
        """I₁ − 3 − 2 [J − 1]."""
        return self._shape()

    @cached_property
    def volume(self) -> Any:
        """J − 1."""
        return self._volume()

    @cached_property
    def of_strain(self) -> tuple[Any, Any, Any]:
        """The principal invariants of C − I, with C = Fᵀ F: Σ xᵢ, Σ xᵢ xⱼ, x₁ x₂ x₃ of xᵢ = λᵢ² − 1."""
        return self._principal()

    def as_variables(self) -> Invariants:
        """Those of finite strains as variables of UFL's, by which an energy is differentiated one by one."""
        shape, volume = ufl.variable(self.shape), ufl.variable(self.volume)
        of_strain = tuple(ufl.variable(ufl.as_ufl(each)) for each in self.of_strain)
        return Invariants(lambda: shape, lambda: volume, lambda: of_strain, self._linear)

    @property
    def dilation(self) -> Any:
        """Tr ε of the small strain ε = sym ∇u; of stretches, that of a body that is not turned."""
        return self._linear()[0]

    @property
    def linear_square(self) -> Any:
        """ε : ε."""
        return self._linear()[1]


def _of_tensor(X: Any) -> tuple[Any, Any, Any]:
    """The principal invariants of a symmetric tensor; one in the plane has a third principal value of zero."""
    if X.ufl_shape[0] == 2:
        return ufl.tr(X), ufl.det(X), 0.0
    minors = sum(X[i, i] * X[k, k] - X[i, k] * X[i, k] for i, k in ((0, 1), (1, 2), (2, 0)))
    return ufl.tr(X), minors, ufl.det(X)
