"""Loads and influxes that depend on the deformation or the density: the open parts of (11), (12), with their tangent.

Each states a quantity per reference area or volume in UFL, of the running displacement u and density ρ, so that its
derivative enters Newton's method.  They grow with the loads of the scene.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import ufl
from ufl.algorithms.apply_algebra_lowering import apply_algebra_lowering
from ufl.algorithms.apply_derivatives import apply_derivatives
from ufl.averaging import CellAvg
from ufl.corealg.traversal import unique_pre_traversal
from ufl.differentiation import Derivative
from ufl.geometry import GeometricQuantity

from growthx.common.checks import require_function, require_name, require_number
from growthx.common.errors import InputError
from growthx.common.overrides import Sealed
from growthx.constitutive.expressions import expression
from growthx.constitutive.kinematics import deformation_gradient
from growthx.model.actions.histories import check_history

if TYPE_CHECKING:
    from growthx.meshing.mesh import Mesh


_SIDED = (Derivative, CellAvg)
_ONE_SIDED = (ufl.SpatialCoordinate, ufl.FacetArea, ufl.MinFacetEdgeLength, ufl.MaxFacetEdgeLength)

# Of displacement, density and position, UFL expressions all; gives another: a vector for forces, a scalar for mass.
LawOfState = Callable[[Any, Any, Any], Any]


def check_sides(value: Any, mesh: Mesh, boundary: str, what: str) -> None:
    """Refuse a value on facets inside the body that may depend on the cell they are seen from (collective).

    Inside, a facet has two: normals, gradients and densities of cells have two values there.
    """
    if not _has_sides(value):
        return
    inner, count = mesh.facet_counts(boundary)
    if inner:
        raise InputError(
            f"{what} depends on the side from which its boundary is seen, and {inner} of the {count} facets of "
            f"'{boundary}' lie inside the body, where they have two: a boundary of outer facets alone would be right"
        )


def _has_sides(value: Any) -> bool:
    value = apply_derivatives(apply_algebra_lowering(value))
    return any(isinstance(part, _SIDED) or _jumps(part) for part in unique_pre_traversal(value))


def _jumps(part: Any) -> bool:
    """Whether a terminal may have two values on a facet inside the body."""
    if isinstance(part, GeometricQuantity):
        return not isinstance(part, _ONE_SIDED)
    return isinstance(part, ufl.Coefficient) and part.ufl_element() not in ufl.H1


class OpenLoad(Sealed, ABC, replaceable=("place", "may_hold", "ramped", "history", "holds")):
    """A force per reference area or volume that depends on the running state.

    on: name of the boundary it acts on, or None: everywhere in the body.
    may_hold: whether it may resist a motion of the body as a whole, as springs do.
    ramped: whether it grows with the loads of the scene; else it is there from the start.
    what: what it is called in a sentence.

    Example:
        >>> [isinstance(load, gx.OpenLoad) for load in (gx.Pressure("top", 0.1), gx.Traction("top", (0.0, 0.1)))]
        [True, False]
    """

    on: str | None
    may_hold: ClassVar[bool] = True
    ramped: ClassVar[bool] = True
    what: ClassVar[str] = "open load"

    @property
    def history(self) -> Callable[[float], float] | None:
        """Its share as a function of time, in place of the program's ramp."""
        return None

    @property
    def holds(self) -> tuple[int, ...] | str:
        """Along what it resists motions, if it may: "all" directions, the "normal", or numbers of directions."""
        return "all" if self.may_hold else ()

    @property
    def place(self) -> str:
        """Where it acts, as a part of a sentence."""
        return "in the whole body" if self.on is None else f"on '{self.on}'"

    @abstractmethod
    def force(self, u: Any, rho: Any, mesh: Mesh) -> Any:
        """Force per reference area or volume, a UFL vector of the displacement and the density."""


def _forces(load: OpenLoad, law: LawOfState, u: Any, rho: Any, mesh: Mesh) -> Any:
    return expression(law(u, rho, ufl.SpatialCoordinate(mesh.domain)), (mesh.dim,), f"the open load {load.place}")


@dataclass(frozen=True)
class OpenTraction(OpenLoad, replaceable=()):
    """Traction t_open per reference area on a named boundary, `law(u, ρ, x)`: a UFL vector, such as a spring's −k u.

    Example:
        >>> elastic = gx.OpenTraction("right", lambda u, rho, x: -0.1 * u)
        >>> elastic.place
        "on 'right'"
    """

    on: str
    law: LawOfState

    def __post_init__(self) -> None:
        require_name(self.on, "the boundary of an open traction")
        require_function(self.law, f"the law of the open traction on '{self.on}'", "a function of u, ρ and x")

    def force(self, u: Any, rho: Any, mesh: Mesh) -> Any:
        """t_open, force per reference area."""
        return _forces(self, self.law, u, rho, mesh)


@dataclass(frozen=True)
class Pressure(OpenLoad, replaceable=()):
    """A pressure (force per deformed area) on a named boundary that follows the deformation, t = −p J F⁻ᵀ N.

    In plane stress it acts on the thickness as it is, too: J has the thickness stretch as a factor.
    history: its share as a function of time, or a `Table`, in place of the program's ramp.

    Example:
        >>> squeezed = gx.Pressure("right", 0.02, history=lambda time: min(time, 1.0))
        >>> squeezed.history(0.5) * squeezed.value
        0.01
    """

    on: str
    value: float
    history: Callable[[float], float] | None = None

    may_hold = False
    what = "pressure"

    def __post_init__(self) -> None:
        require_name(self.on, "the boundary of a pressure")
        require_number(self.value, f"the pressure on '{self.on}'", "a finite number", lambda _: True)
        check_history(self.history, f"the pressure on '{self.on}'")

    def force(self, u: Any, rho: Any, mesh: Mesh) -> Any:
        """−p J F⁻ᵀ N, force per reference area."""
        return self.force_on(u, ufl.FacetNormal(mesh.domain))

    def force_on(self, u: Any, area: Any, thickness_stretch: Any = 1.0) -> Any:
        """−p J F⁻ᵀ N of a vector for N, in the plane at a stretch λ₃ of the thickness."""
        F = deformation_gradient(u)
        return -self.value * thickness_stretch * ufl.det(F) * ufl.inv(F).T * area


@dataclass(frozen=True)
class OpenBodyForce(OpenLoad, replaceable=()):
    """Momentum source b̄₀ per reference volume everywhere, `law(u, ρ, x)`: a UFL vector, such as a weight ρ g.

    Example:
        >>> import ufl
        >>> weight = gx.OpenBodyForce(lambda u, rho, x: rho * ufl.as_vector((0.0, -9.81)))
        >>> weight.place
        'in the whole body'
    """

    law: LawOfState

    def __post_init__(self) -> None:
        require_function(self.law, "the law of the open body force", "a function of u, ρ and x")

    @property
    def on(self) -> None:  # type: ignore[override]
        """Nowhere in particular."""
        return None

    def force(self, u: Any, rho: Any, mesh: Mesh) -> Any:
        """b̄₀, force per reference volume."""
        return _forces(self, self.law, u, rho, mesh)
