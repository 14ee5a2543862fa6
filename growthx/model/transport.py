"""Mass across the boundary of a body: prescribed densities and influx.

Densities must be continuous between cells for it, as for a flux.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import ufl

from growthx.common.checks import is_function, require_name, require_number
from growthx.common.overrides import Sealed
from growthx.constitutive.expressions import expression

if TYPE_CHECKING:
    from growthx.meshing.mesh import Mesh


@dataclass(frozen=True)
class PrescribedDensity(Sealed, replaceable=()):
    """A density that is held on a named boundary from the first step on (11).

    Example:
        >>> from dataclasses import replace
        >>> held = (gx.PrescribedDensity("left", 1.2),)
        >>> scene = replace(gx.scenes.plate(2), flux=gx.MassFlux(0.1), prescribed_densities=held)
        >>> scene.prescribed_densities[0].density
        1.2
    """

    on: str
    density: float

    def __post_init__(self) -> None:
        require_name(self.on, "the boundary of a prescribed density")
        require_number(self.density, f"the density held on '{self.on}'", "a positive number", lambda rho: rho > 0)


@dataclass(frozen=True)
class Influx(Sealed, replaceable=("value",)):
    """Mass that enters through a named boundary, r = R · N (12), per reference area and time.

    rate: a number, or `law(u, ρ, x)` that gives a scalar in UFL, such as k (ρ₁ − ρ).

    Example:
        >>> supply = gx.Influx("right", lambda u, rho, x: 0.1 * (1.2 - rho))
        >>> round(supply.rate(None, 1.0, None), 6)
        0.02
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
