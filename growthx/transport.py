"""What moves mass through a body and across its boundary: Fick's flux, prescribed densities, influx.

Densities must be continuous between cells for it: only node-based variants know the gradient of the density.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import ufl

from growthx.errors import is_function, require, require_function, require_name, require_number
from growthx.fields import Field
from growthx.open_loads import expression

if TYPE_CHECKING:
    from growthx.material import Material
    from growthx.mesh import Mesh


@dataclass(frozen=True)
class MassFlux:
    """Mass flux R = R₀ᶠ ∇ρ (5).

    conduction: R₀ᶠ (length² per time), at least 0, a number or a field.
    dependence: a factor on it, as a function of ρ/ρ* that takes UFL; None: the conduction does not depend on density.
    """

    conduction: Field
    dependence: Callable[[Any], Any] | None = None

    coefficients: ClassVar = ("conduction",)

    def __post_init__(self) -> None:
        require(self.conduction, "the conduction R₀ᶠ", "a number of at least 0", lambda c: c >= 0)
        if self.dependence is not None:
            require_function(self.dependence, "the dependence of the conduction", "a function of ρ/ρ* or None")

    def flux(self, density: Any, material: Material) -> Any:
        """R = R₀ᶠ ∇ρ, mass per area and time."""
        factor: Any = 1.0
        if self.dependence is not None:
            relative = density / material.reference_density
            factor = expression(self.dependence(relative), (), "the dependence of the conduction on density")
        return self.conduction * factor * ufl.grad(density)


@dataclass(frozen=True)
class PrescribedDensity:
    """A density that is held on a named boundary from the first step on (11)."""

    on: str
    density: float

    def __post_init__(self) -> None:
        require_name(self.on, "the boundary of a prescribed density")
        require_number(self.density, f"the density held on '{self.on}'", "a positive number", lambda rho: rho > 0)


@dataclass(frozen=True)
class Influx:
    """Mass that enters through a named boundary, r = R · N (12), per reference area and time.

    rate: a number, or `law(u, ρ, x)` that gives a scalar in UFL, such as k (ρ₁ − ρ).
    """

    on: str
    rate: float | Callable[[Any, Any, Any], Any]

    def __post_init__(self) -> None:
        require_name(self.on, "the boundary of an influx")
        if not is_function(self.rate):
            require_number(self.rate, f"the influx on '{self.on}'", "a finite number", lambda _: True)

    def value(self, u: Any, rho: Any, mesh: Mesh) -> Any:
        """r, mass per reference area and time."""
        rate = self.rate(u, rho, ufl.SpatialCoordinate(mesh.domain)) if callable(self.rate) else self.rate
        return expression(rate, (), f"the influx on '{self.on}'")
