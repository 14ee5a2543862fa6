"""The flux of mass through a body, Fick's law.

Densities must be continuous between cells for it: only node-based variants know the gradient of the density.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import ufl

from growthx.common.arrays import Field
from growthx.common.checks import require, require_function
from growthx.common.overrides import Sealed
from growthx.constitutive.expressions import expression

if TYPE_CHECKING:
    from growthx.constitutive.energies import Elasticity


@dataclass(frozen=True)
class MassFlux(Sealed, replaceable=("flux", "coefficients")):
    """Mass flux R = R₀ᶠ ∇ρ (5).

    conduction: R₀ᶠ (length² per time), at least 0, a number or a field.
    dependence: a factor on it, as a function of ρ/ρ* that takes UFL; None: the conduction does not depend on density.

    Example:
        >>> gx.MassFlux(conduction=0.1, dependence=lambda relative: relative**2).dependence(0.5)
        0.25
    """

    conduction: Field
    dependence: Callable[[Any], Any] | None = None

    coefficients: ClassVar = ("conduction",)

    def __post_init__(self) -> None:
        require(self.conduction, "the conduction R₀ᶠ", "a number of at least 0", lambda c: c >= 0)
        if self.dependence is not None:
            require_function(self.dependence, "the dependence of the conduction", "a function of ρ/ρ* or None")

    def flux(self, density: Any, material: Elasticity) -> Any:
        """R = R₀ᶠ ∇ρ, mass per area and time."""
        factor: Any = 1.0
        if self.dependence is not None:
            relative = density / material.reference_density
            factor = expression(self.dependence(relative), (), "the dependence of the conduction on density")
        return self.conduction * factor * ufl.grad(density)
