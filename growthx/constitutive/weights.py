"""How the density weighs a stored energy, w(ρ), where that is no power [ρ/ρ*]ⁿ: written once for floats, arrays, UFL.

At a density, the weight is like the power of its local exponent n(ρ) = ∂ ln w/∂ ln ρ, which is all that slopes and
judgements of a law need of it.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import ufl

from growthx.common.arrays import Field
from growthx.common.checks import require, require_kind
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
class _Range(Sealed, replaceable=()):
    """Densities ρ₁ and ρ₂, numbers or fields, the first below the second wherever both are known."""

    first: Field
    last: Field

    coefficients = ("first", "last")
    exponents = ("first", "last")  # numbers stay numbers: their logarithms are no work of a form's

    def __post_init__(self) -> None:
        for density, which in ((self.first, "lower"), (self.last, "upper")):
            what = f"the {which} one of the densities between two exponents"
            require(density, what, "a number above 0", lambda rho: rho > 0)
        if isinstance(self.first, Mapping) and isinstance(self.last, Mapping):
            for name in self.first.keys() & self.last.keys():
                _Range(self.first[name], self.last[name])
        pair = self._out_of_order()
        if pair:
            raise InputError(
                f"the densities between two exponents are {shown(pair)}: two above 0, the lower one first, would be "
                "right"
            )

    def _out_of_order(self) -> tuple[float, ...]:
        """The two where they are not in order, as far as both are known; collective of DOLFINx Functions."""
        given = (self.first, self.last)
        spaces = [each.function_space for each in given if hasattr(each, "function_space")]
        values = [each.x.array if hasattr(each, "function_space") else each for each in given]
        known = all(np.isscalar(each) or isinstance(each, np.ndarray) for each in values)
        arrays = [np.shape(each) for each in values if np.ndim(each)]
        if not known or len({space.dofmap.index_map.size_global for space in spaces}) > 1:
            return ()  # of what becomes Functions, when it has
        if not spaces and len(set(arrays)) > 1:
            return ()
        first, last = np.broadcast_arrays(*map(np.atleast_1d, values))
        wrong = np.flatnonzero(~(first < last))[:1]
        found = [(float(first[at]), float(last[at])) for at in wrong]
        if spaces:
            from growthx.common.communicators import steady  # MPI, for those who have a mesh

            found = [pair for of_rank in steady(spaces[0].mesh.comm).allgather(found) for pair in of_rank]
        return found[0] if found else ()


@dataclass(frozen=True)
class PiecewisePower(DensityWeight, replaceable=(), final=("weight", "exponent")):
    """A power of the density with one exponent below a range of densities, another above it, smooth between.

    n(ρ) goes from n₁ to n₂ as 3 τ² − 2 τ³ with τ = ln(ρ/ρ₁)/ln(ρ₂/ρ₁) from 0 to 1, and w = exp ∫ n d ln ρ from ρ* to ρ:
    two derivatives are continuous.  The two powers of Beaupré, Orr & Carter 1990 (2.5 below 1.2 g/cm³, 3.2 above) meet
    so without a corner.

    below, above: n₁ and n₂ (no unit), numbers or fields.
    between: ρ₁ and ρ₂ (density), numbers or fields, the first below the second.

    Example:
        >>> bone = gx.Material(young=500.0, density_exponent=gx.PiecewisePower(2.0, 3.0, between=(1.0, 1.25)))
        >>> print([f"{bone.weight(density):.4f}" for density in (0.5, 1.0, 2.0)])
        ['0.2500', '1.0000', '7.1554']
    """

    below: Field = 2.0
    above: Field = 3.0
    between: Any = (1.0, 1.25)

    coefficients = ("below", "above", "between")

    def __post_init__(self) -> None:
        for exponent, where in ((self.below, "below"), (self.above, "above")):
            require(exponent, f"the density exponent n {where}", "a number of at least 0", lambda n: n >= 0)
        if isinstance(self.between, _Range):
            return
        what, wanted = "the densities between two exponents", "two above 0, the lower one first,"
        require_kind(self.between, (tuple, list), what, wanted)
        if len(self.between) != 2:
            raise InputError(f"{what} are {shown(self.between)}: {wanted} would be right")
        object.__setattr__(self, "between", _Range(*self.between))

    def weight(self, density: Any, reference_density: Any) -> Any:
        """Exp ∫ n d ln ρ from ρ* to ρ."""
        return exp(self._logarithm(density) - self._logarithm(reference_density))

    def _logarithm(self, density: Any) -> Any:
        """∫ n d ln ρ from ρ₁, where s ln(ρ₂/ρ₁) = ln(ρ/ρ₁): ln(ρ₂/ρ₁) { n₁ s + [n₂ − n₁] [τ³ − τ⁴/2 + ⟨s⟩ − τ] }."""
        share = self._share(density)
        tau, positive = between(share, 0.0, 1.0), between(share, 0.0, MOST)
        rise = tau * tau * tau * (1 - tau / 2) + (positive - tau)
        return self._width() * (self.below * share + (self.above - self.below) * rise)

    def exponent(self, density: Any, reference_density: Any) -> Any:
        """n₁ + [n₂ − n₁] [3 τ² − 2 τ³]."""
        tau = between(self._share(density), 0.0, 1.0)
        return self.below + (self.above - self.below) * tau * tau * (3 - 2 * tau)

    def _width(self) -> Any:
        return ln(self.between.last / self.between.first)

    def _share(self, density: Any) -> Any:
        """The running ln(ρ/ρ₁)/ln(ρ₂/ρ₁)."""
        return ln(density / self.between.first) / self._width()
