"""Loads and influxes that depend on the deformation or the density: the open parts of (11), (12), with their tangent.

Each states a quantity per reference area or volume in UFL, of the running displacement u and density ρ, so that its
derivative enters Newton's method.  They grow with the loads of the scene.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import ufl

from growthx.errors import InputError, require_function, require_name, require_number, shown
from growthx.kinematics import deformation_gradient, volume_ratio

if TYPE_CHECKING:
    from growthx.mesh import Mesh

# Of displacement, density and position, UFL expressions all; gives another: a vector for forces, a scalar for mass.
Law = Callable[[Any, Any, Any], Any]


def expression(value: Any, shape: tuple[int, ...], what: str) -> Any:
    """What a law of the user's returned as a UFL expression; InputError if it is none of that shape."""
    wanted = f"a vector of {shape[0]}" if shape else "a scalar"
    try:
        found = ufl.as_ufl(value)
    except (TypeError, ValueError):  # UFL's own error is one of these
        raise InputError(f"{what} has the values {shown(value)}: {wanted} in UFL is needed") from None
    if found.ufl_shape != shape:
        raise InputError(f"{what} has values of shape {found.ufl_shape or 'of a scalar'}: {wanted} is needed")
    if isinstance(value, float) and not math.isfinite(value):
        raise InputError(f"{what} has the values {value}: finite ones are needed")
    return found


class OpenLoad(ABC):
    """A force per reference area or volume that depends on the running state.

    on: name of the boundary it acts on, or None: everywhere in the body.
    may_hold: whether it may resist a motion of the body as a whole, as springs do.
    """

    on: str | None
    may_hold: ClassVar[bool] = True

    @property
    def place(self) -> str:
        """Where it acts, as a part of a sentence."""
        return "in the whole body" if self.on is None else f"on '{self.on}'"

    @abstractmethod
    def force(self, u: Any, rho: Any, mesh: Mesh) -> Any:
        """Force per reference area or volume, a UFL vector of the displacement and the density."""


def _forces(load: OpenLoad, law: Law, u: Any, rho: Any, mesh: Mesh) -> Any:
    return expression(law(u, rho, ufl.SpatialCoordinate(mesh.domain)), (mesh.dim,), f"the open load {load.place}")


@dataclass(frozen=True)
class OpenTraction(OpenLoad):
    """Traction t_open per reference area on a named boundary, `law(u, ρ, x)`: a UFL vector, such as a spring's −k u."""

    on: str
    law: Law

    def __post_init__(self) -> None:
        require_name(self.on, "the boundary of an open traction")
        require_function(self.law, f"the law of the open traction on '{self.on}'", "a function of u, ρ and x")

    def force(self, u: Any, rho: Any, mesh: Mesh) -> Any:
        """t_open, force per reference area."""
        return _forces(self, self.law, u, rho, mesh)


@dataclass(frozen=True)
class Pressure(OpenLoad):
    """A pressure (force per deformed area) on a named boundary that follows the deformation, t = −p J F⁻ᵀ N."""

    on: str
    value: float

    may_hold = False

    def __post_init__(self) -> None:
        require_name(self.on, "the boundary of a pressure")
        require_number(self.value, f"the pressure on '{self.on}'", "a finite number", lambda _: True)

    def force(self, u: Any, rho: Any, mesh: Mesh) -> Any:
        """−p J F⁻ᵀ N, force per reference area."""
        F = deformation_gradient(u)
        return -self.value * volume_ratio(F) * ufl.inv(F).T * ufl.FacetNormal(mesh.domain)


@dataclass(frozen=True)
class OpenBodyForce(OpenLoad):
    """Momentum source b̄₀ per reference volume everywhere, `law(u, ρ, x)`: a UFL vector, such as a weight ρ g."""

    law: Law

    def __post_init__(self) -> None:
        require_function(self.law, "the law of the open body force", "a function of u, ρ and x")

    @property
    def on(self) -> None:  # type: ignore[override]
        """Nowhere in particular."""
        return None

    def force(self, u: Any, rho: Any, mesh: Mesh) -> Any:
        """b̄₀, force per reference volume."""
        return _forces(self, self.law, u, rho, mesh)
