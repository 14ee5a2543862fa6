"""Mass sources R₀(ρ, Ψ₀ᵉˡ): a law is one function of density and elastic energy, for floats, arrays and UFL.

They know nothing of meshes and solvers.  What every variant needs beside the function – its slope, its scale, bounds –
follows from it.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
import ufl

from growthx.common.arrays import Field, is_uniform
from growthx.common.checks import require_number
from growthx.common.errors import InputError, shown
from growthx.common.overrides import Sealed, place
from growthx.constitutive.energies import Elasticity
from growthx.constitutive.functions import is_symbolic

RESTING = 1e-30  # share of the stiffness: an energy that is none, without the infinite slopes of roots at zero
STEP = 1e-30  # relative, of a complex step: it leaves no difference to lose digits in


@dataclass(frozen=True)
class MassSource(Sealed, ABC, replaceable=("mass_source_slope", "resting_rate", "linear", "coefficients")):
    """A mass source R₀ (density per time) as one function of the density and the elastic energy.

    A law of one's own, a frozen dataclass, states `mass_source` and names parameters of its own that may vary in space
    in `coefficients`; `linear` says that at a given density the source is linear in the energy (it may have a constant
    part), which spares cells with one density some work.  It may state `mass_source_slope` and `resting_rate`, too.
    One text serves floats, arrays and UFL: arithmetic does, and `gx.functions`; slopes at arrays are taken by a
    complex step.  Raises InputError, when the class is made, if it replaces anything else: see `overrides`; and with
    the scene, if the source is none that can be computed with.

    bounds: lowest and highest density, None where there is none: density that reaches a bound stays there for as long
    as the source points beyond it.

    Example:
        >>> class Proportional(gx.MassSource):
        ...     linear = True
        ...     def mass_source(self, density, elastic_energy, material):
        ...         return elastic_energy - 0.02 * density
        >>> round(Proportional().mass_source(1.0, 0.05, gx.Material(1.0)), 6)
        0.03
    """

    bounds: tuple[float | None, float | None] = field(default=(None, None), kw_only=True)

    coefficients: ClassVar[tuple[str, ...]] = ()
    linear: ClassVar[bool] = False  # whether the source is linear in the elastic energy
    _linear_part: ClassVar[str] = "mass_source"  # of which `linear` is said

    def __init_subclass__(cls, **keywords: Any) -> None:
        super().__init_subclass__(**keywords)
        if place(cls, cls._linear_part) < place(cls, "linear"):  # what is linear was another one
            cls.linear = False

    def __post_init__(self) -> None:
        if not isinstance(self.bounds, (tuple, list)) or len(self.bounds) != 2:
            raise InputError(
                f"the bounds of density are {shown(self.bounds)}: the lowest and the highest would be right"
            )
        object.__setattr__(self, "bounds", tuple(self.bounds))
        for bound in self.bounds:
            if bound is not None:
                require_number(bound, "a bound of density", "a positive number or None", lambda rho: rho > 0)
        if self.limits[0] >= self.limits[1]:
            raise InputError(f"the bounds of density are {self.bounds}: the lowest before the highest would be right")

    @abstractmethod
    def mass_source(self, density: Any, elastic_energy: Any, material: Elasticity) -> Any:
        """R₀, density per time, of ρ and Ψ₀ᵉˡ (energy per reference volume, without the weight [ρ/ρ*]ⁿ)."""

    def mass_source_slope(self, density: Any, elastic_energy: Any, material: Elasticity) -> Any:
        """∂_ρ R₀, per time, by differentiation: one that is stated here instead must be the same."""
        if is_symbolic(density):
            rho = ufl.variable(density)
            return ufl.diff(ufl.as_ufl(self.mass_source(rho, elastic_energy, material)), rho)
        step = STEP * np.abs(density)
        return np.imag(self.mass_source(density + 1j * step, elastic_energy, material)) / step

    def mass_source_and_slope(self, density: Any, elastic_energy: Any, material: Elasticity) -> tuple[Any, Any]:
        """R₀ and ∂_ρ R₀."""
        return (
            self.mass_source(density, elastic_energy, material),
            self.mass_source_slope(density, elastic_energy, material),
        )

    def restoring_slope(self, density: Any, elastic_energy: Any, material: Elasticity) -> Any:
        """The slope by which it is judged whether more density means a lower source: ∂_ρ R₀, per time."""
        return self.mass_source_slope(density, elastic_energy, material)

    @property
    def mean_exponent(self) -> float:
        """The p of the mean [Σ wᵢ Ψᵢ^p]^(1/p) of the energies of several load cases that drives the source."""
        return 1.0

    def resting_rate(self, material: Elasticity) -> Any:
        """|R₀| at the reference density without energy, density per time: what rates of density are measured against.

        A law without such a rate may state another scale.
        """
        return abs(self.mass_source(material.reference_density, RESTING * material.stiffness, material))

    def rests_uniformly(self, material: Elasticity) -> bool:
        """Whether the parameters that `resting_rate` may depend on are numbers."""
        return all(is_uniform(getattr(law, name)) for law in (self, material) for name in law.coefficients)

    @property
    def is_linear(self) -> bool:
        """Whether the source at a given density is linear in the elastic energy: its mean is then that of its mean."""
        return self.linear

    @property
    def at_points_alike(self) -> tuple[str, ...]:
        """Names of the parameters whose mean stands for all points of a cell with one density."""
        return self.coefficients

    @property
    def limits(self) -> tuple[float, float]:
        """Lowest and highest density, with zero and infinity where there is no bound."""
        low, high = self.bounds
        return 0.0 if low is None else float(low), math.inf if high is None else float(high)

    @property
    def is_bounded(self) -> bool:
        """Whether there is a bound of density."""
        return self.bounds != (None, None)

    def without_growth(self) -> MassSource:
        """A law under which no density changes, for those who change it by other means."""
        return NoGrowth()

    @property
    def remembers(self) -> bool:
        """Whether the source depends on the past, which a state alone does not tell."""
        return False

    @property
    def is_still(self) -> bool:
        """Whether no density changes under this law."""
        return False


@dataclass(frozen=True)
class NoGrowth(MassSource, replaceable=(), final=("mass_source", "mass_source_slope", "resting_rate", "linear")):
    """No density changes: R₀ = c ρ with c = 0, which forms take for an expression as any other."""

    rate: Field = 0.0

    coefficients = ("rate",)
    linear = True

    def mass_source(self, density: Any, elastic_energy: Any, material: Elasticity) -> Any:
        """Zero, density per time."""
        return self.rate * density

    @property
    def is_still(self) -> bool:
        """Always."""
        return True
