"""How the density weighs a stored energy, w(ρ), where that is no power [ρ/ρ*]ⁿ: written once for floats, arrays, UFL.

At a density, the weight is like the power of its local exponent n(ρ) = ∂ ln w/∂ ln ρ, which is all that slopes and
judgements of a law need of it.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import ufl

from growthx.common.arrays import Field
from growthx.common.checks import require, require_vector
from growthx.common.errors import InputError, shown
from growthx.common.overrides import Sealed
from growthx.constitutive.functions import between, exp, is_symbolic, ln

STEP = 1e-30  # relative, of a complex step: it leaves no difference to lose digits in
MOST = 1e9  # above any logarithm


@dataclass(frozen=True)
class DensityWeight(Sealed, ABC, replaceable=("exponent", "coefficients")):
    """The weight w(ρ) of a stored energy, Ψ₀ = w Ψ₀ᵉˡ: what a material's `density_exponent` may be beside a number n.

    A weight of one's own, a frozen dataclass, states `weight`, and names parameters of its own that may vary in space
    in `coefficients`.  One text serves floats, arrays, complex ones too, and UFL: arithmetic does, and `gx.functions`.
    Growth laws take it wherever [ρ/ρ*]ⁿ stands in them.  Raises InputError, when the class is made, if it replaces
    anything else; and with the scene, if the weight is none that can be computed with.

    Example:
        >>> class Mixed(gx.DensityWeight):
        ...     def weight(self, density, reference_density):
        ...         relative = density / reference_density
        ...         return 0.5 * relative**2 + 0.5 * relative**3
        >>> bone = gx.Material(young=500.0, density_exponent=Mixed())
        >>> print(f"{bone.weight(0.5):.4f}, {bone.exponent_at(1.0):.2f}")
        0.1875, 2.50
    """

    coefficients: ClassVar[tuple[str, ...]] = ()

    @abstractmethod
    def weight(self, density: Any, reference_density: Any) -> Any:
        """w, no unit, of ρ and ρ*: above 0, and one at ρ* if the material's moduli are to be those of that density."""

    def exponent(self, density: Any, reference_density: Any) -> Any:
        """n(ρ) = ∂ ln w/∂ ln ρ, no unit, by differentiation: one that is stated here instead must be the same."""
        if is_symbolic(density):
            rho = ufl.variable(density)
            weight = ufl.as_ufl(self.weight(rho, reference_density))
            return density * ufl.diff(weight, rho) / weight
        step = STEP * np.abs(density)
        weight = self.weight(density + 1j * step, reference_density)
        return np.imag(weight) / step * density / np.real(weight)


@dataclass(frozen=True)
class PiecewisePower(DensityWeight, replaceable=(), final=("weight", "exponent")):
    """A power of the density with one exponent below a range of densities, another above it, smooth between.

    n(ρ) goes from n₁ to n₂ as 3 τ² − 2 τ³ with τ = ln(ρ/ρ₁)/ln(ρ₂/ρ₁) from 0 to 1, and w = exp ∫ n d ln ρ from ρ* to ρ:
    two derivatives are continuous.  The two powers of Beaupré, Orr & Carter 1990 (2.5 below 1.2 g/cm³, 3.2 above) meet
    so without a corner.

    below, above: n₁ and n₂ (no unit), numbers or fields.  between: ρ₁ and ρ₂ (density), the first below the second.

    Example:
        >>> bone = gx.Material(young=500.0, density_exponent=gx.PiecewisePower(2.0, 3.0, between=(1.0, 1.25)))
        >>> print([f"{bone.weight(density):.4f}" for density in (0.5, 1.0, 2.0)])
        ['0.2500', '1.0000', '7.1554']
    """

    below: Field = 2.0
    above: Field = 3.0
    between: tuple[float, float] = (1.0, 1.25)

    coefficients = ("below", "above")

    def __post_init__(self) -> None:
        for exponent, where in ((self.below, "below"), (self.above, "above")):
            require(exponent, f"the density exponent n {where}", "a number of at least 0", lambda n: n >= 0)
        ends = require_vector(self.between, "the densities between two exponents")
        object.__setattr__(self, "between", ends)
        if len(ends) != 2 or not 0 < ends[0] < ends[1]:
            raise InputError(
                f"the densities between two exponents are {shown(ends)}: two above 0, the lower one first, would be "
                "right"
            )

    def weight(self, density: Any, reference_density: Any) -> Any:
        """Exp ∫ n d ln ρ from ρ* to ρ."""
        return exp(self._logarithm(density) - self._logarithm(reference_density))

    def _logarithm(self, density: Any) -> Any:
        """∫ n d ln ρ from ρ₁, where s ln(ρ₂/ρ₁) = ln(ρ/ρ₁): ln(ρ₂/ρ₁) { n₁ s + [n₂ − n₁] [τ³ − τ⁴/2 + ⟨s⟩ − τ] }."""
        share = self._share(density)
        tau, positive = between(share, 0.0, 1.0), between(share, 0.0, MOST)
        rise = tau * tau * tau * (1 - tau / 2) + (positive - tau)
        return self._width * (self.below * share + (self.above - self.below) * rise)

    def exponent(self, density: Any, reference_density: Any) -> Any:
        """n₁ + [n₂ − n₁] [3 τ² − 2 τ³]."""
        tau = between(self._share(density), 0.0, 1.0)
        return self.below + (self.above - self.below) * tau * tau * (3 - 2 * tau)

    @property
    def _width(self) -> float:
        return float(np.log(self.between[1] / self.between[0]))

    def _share(self, density: Any) -> Any:
        """The running ln(ρ/ρ₁)/ln(ρ₂/ρ₁)."""
        return ln(density / self.between[0]) / self._width
