"""Loads and influxes that depend on the deformation or the density: the open parts of (11), (12), with their tangent.

Each states a quantity per reference area or volume in UFL, of the running displacement u and density ρ, so that its
derivative enters Newton's method.  They grow with the loads of the scene.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import ufl

from growthx.errors import require_number
from growthx.kinematics import deformation_gradient, volume_ratio

if TYPE_CHECKING:
    from growthx.mesh import Mesh

# Of displacement, density and position, UFL expressions all; gives another: a vector for forces, a scalar for mass.
Law = Callable[[Any, Any, Any], Any]


class OpenLoad(ABC):
    """A force per reference area or volume that depends on the running state.

    on: name of the boundary it acts on, or None: everywhere in the body.
    """

    on: str | None

    @abstractmethod
    def force(self, u: Any, rho: Any, mesh: Mesh) -> Any:
        """Force per reference area or volume, a UFL vector of the displacement and the density."""


@dataclass(frozen=True)
class OpenTraction(OpenLoad):
    """Traction t_open per reference area on a named boundary, `law(u, ρ, x)`: a UFL vector, such as a spring's −k u."""

    on: str
    law: Law

    def force(self, u: Any, rho: Any, mesh: Mesh) -> Any:
        """t_open, force per reference area."""
        return self.law(u, rho, ufl.SpatialCoordinate(mesh.domain))


@dataclass(frozen=True)
class Pressure(OpenLoad):
    """A pressure (force per deformed area) on a named boundary that follows the deformation, t = −p J F⁻ᵀ N."""

    on: str
    value: float

    def __post_init__(self) -> None:
        require_number(self.value, f"the pressure on '{self.on}'", "a finite number", lambda _: True)

    def force(self, u: Any, rho: Any, mesh: Mesh) -> Any:
        """−p J F⁻ᵀ N, force per reference area."""
        F = deformation_gradient(u)
        return -self.value * volume_ratio(F) * ufl.inv(F).T * ufl.FacetNormal(mesh.domain)


@dataclass(frozen=True)
class OpenBodyForce(OpenLoad):
    """Momentum source b̄₀ per reference volume everywhere, `law(u, ρ, x)`: a UFL vector, such as a weight ρ g."""

    law: Law

    @property
    def on(self) -> None:  # type: ignore[override]
        """Nowhere in particular."""
        return None

    def force(self, u: Any, rho: Any, mesh: Mesh) -> Any:
        """b̄₀, force per reference volume."""
        return self.law(u, rho, ufl.SpatialCoordinate(mesh.domain))
