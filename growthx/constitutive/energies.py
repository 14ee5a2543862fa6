"""Stored energies: what all of them are to the rest of growthx, and one that is written in UFL by a user."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar

import basix.ufl
import ufl

from growthx.common.arrays import Field
from growthx.common.checks import require
from growthx.common.errors import InputError, shown
from growthx.common.overrides import Sealed
from growthx.constitutive.expressions import exact_exponent, expression
from growthx.constitutive.kinematics import in_space, volume_change
from growthx.constitutive.weights import DensityWeight


class Elasticity(Sealed, ABC, replaceable=()):
    """A stored energy weighted by relative density, Ψ₀ = [ρ/ρ*]ⁿ Ψ₀ᵉˡ; what follows from it for all of them.

    A frozen dataclass with these parameters among its own.  reference_density: ρ* (density).  density_exponent: n (no
    unit), a number or a field, or a `DensityWeight`, which stands wherever [ρ/ρ*]ⁿ is written; where nothing grows
    there is no weight, whatever n is.
    """

    reference_density: Field
    density_exponent: Field
    __dataclass_fields__: ClassVar[dict[str, Any]]

    coefficients: ClassVar[tuple[str, ...]] = ("reference_density", "density_exponent")
    exponents: ClassVar[tuple[str, ...]] = ("density_exponent",)
    directions: ClassVar[tuple[str, ...]] = ()  # coefficients whose mean may be of no length
    across: ClassVar[tuple[str, ...]] = ()  # coefficients of what points out of the plane: zero in a plane body
    small_strain: ClassVar[bool] = False  # whether the deformation changes nothing of the body that is loaded

    @property
    @abstractmethod
    def stiffness(self) -> Any:
        """A modulus E at small strains (stress), in the form of the parameters: numbers, arrays or UFL.

        Forces, energies and strains are measured against it; strain- and stress-driven growth convert by it.
        """

    @abstractmethod
    def energy_at(self, H: Any) -> Any:
        """Ψ₀ᵉˡ, energy per reference volume without the weight, as UFL of H = ∇u, shape (dim, dim), or (3, 3)."""

    @abstractmethod
    def principal_energy(self, extensions: tuple[float, float, float]) -> float:
        """Ψ₀ᵉˡ at principal stretches less one, λᵢ − 1, for parameters that are numbers."""

    @abstractmethod
    def principal_stresses(self, extensions: tuple[float, float, float], density: float) -> list[float]:
        """Reduced momentum fluxes P̄ᵢ = [ρ/ρ*]ⁿ ∂Ψ₀ᵉˡ/∂λᵢ there (force per reference area), for such parameters."""

    @property
    def scales(self) -> tuple[str, ...]:
        """Names of the parameters that `stiffness` depends on."""
        return tuple(name for name in self.coefficients if name not in Elasticity.coefficients)

    @property
    def is_of_a_power(self) -> bool:
        """Whether the weight is [ρ/ρ*]ⁿ, with one exponent at all densities."""
        return not isinstance(self.density_exponent, DensityWeight)

    def weight(self, density: Any) -> Any:
        """[ρ/ρ*]ⁿ, no unit."""
        n = self.density_exponent
        if isinstance(n, DensityWeight):
            return n.weight(density, self.reference_density)
        return (density / self.reference_density) ** exact_exponent(n)

    def exponent_at(self, density: Any) -> Any:
        """N at a density, ∂ ln w/∂ ln ρ, no unit."""
        n = self.density_exponent
        return n.exponent(density, self.reference_density) if isinstance(n, DensityWeight) else n

    def stress(self, H: Any, density: Any) -> Any:
        """Reduced momentum flux P̄ = [ρ/ρ*]ⁿ ∂Ψ₀ᵉˡ/∂F (7) at H = ∇u, force per reference area.

        UFL of shape (dim, dim), as H.
        """
        H = ufl.variable(H)
        return self.weight(density) * ufl.diff(self.energy_at(H), H)

    def true_stress(self, H: Any, density: Any) -> Any:
        """Cauchy's stress σ = P̄ Fᵀ/J, force per deformed area, of the shape of H."""
        F = ufl.Identity(H.ufl_shape[0]) + H
        return self.stress(H, density) * F.T / (1 + volume_change(H))

    def strain(self, H: Any) -> Any:
        """What is written as strain: ½ [Fᵀ F − I] = sym H + ½ Hᵀ H, no unit: no identity takes small ones' digits."""
        return ufl.sym(H) + H.T * H / 2

    def _check_weight(self) -> None:
        """Raise InputError for parameters of the weight that make no sense."""
        require(self.reference_density, "the reference density ρ*", "a positive number", lambda rho: rho > 0)
        n = self.density_exponent
        if isinstance(n, Mapping) and any(isinstance(part, DensityWeight) for part in n.values()):
            raise InputError(
                f"the density exponent n is {shown(n)}: numbers for the regions, or one DensityWeight whose parameters "
                "are numbers for the regions, would be right"
            )
        if not isinstance(n, DensityWeight):
            require(n, "the density exponent n", "a number of at least 0", lambda n: n >= 0)


@dataclass(frozen=True)
class StoredEnergy(
    Elasticity, ABC, replaceable=("energy_at", "coefficients"), final=("principal_energy", "principal_stresses")
):
    """An elastic energy of one's own, Ψ₀ = [ρ/ρ*]ⁿ Ψ₀ᵉˡ(F): stress and tangents follow from it by differentiation.

    A subclass, a frozen dataclass, states `energy` and `stiffness`, and names parameters of its own that may vary in
    space in `coefficients`, beside those of this class.  Raises InputError, when the class is made, if it replaces
    anything else, see `overrides`; and with the scene, if the energy is none that can be computed with.

    Example:
        >>> import ufl
        >>> class Stretched(gx.StoredEnergy):
        ...     stiffness = 2.0
        ...     def energy(self, F):
        ...         return (ufl.tr(F.T * F) - 3) / 2 - ufl.ln(ufl.det(F))
        >>> round(Stretched().principal_energy((0.1, 0.0, 0.0)), 6)
        0.00969
    """

    reference_density: Field = field(default=1.0, kw_only=True)
    density_exponent: Field = field(default=2.0, kw_only=True)

    def __post_init__(self) -> None:
        self._check_weight()

    @abstractmethod
    def energy(self, F: Any) -> Any:
        """Ψ₀ᵉˡ, energy per reference volume without the weight [ρ/ρ*]ⁿ, as UFL of F = I + ∇u, shape (3, 3).

        In the plane F has an out-of-plane 1 or, in plane stress, λ₃, of which the energy must have one least value.
        Zero, and of no stress, at F = I.
        """

    def energy_at(self, H: Any) -> Any:
        """The same of H = ∇u, shape (dim, dim), or (3, 3) in plane stress.

        An energy that is a difference of large numbers may be stated here once more, by H, to keep the digits of small
        strains: then this is what is computed with.
        """
        space = in_space(H)
        return expression(self.energy(ufl.Identity(3) + space), (), f"the energy of {type(self).__name__}")

    def principal_energy(self, extensions: tuple[float, float, float]) -> float:
        """Ψ₀ᵉˡ at principal stretches less one, λᵢ − 1, for parameters that are numbers."""
        return self._principal.value(self._principal.energy, extensions)

    def principal_stresses(self, extensions: tuple[float, float, float], density: float) -> list[float]:
        """Reduced momentum fluxes P̄ᵢ = [ρ/ρ*]ⁿ ∂Ψ₀ᵉˡ/∂λᵢ there (force per reference area), for such parameters."""
        weight = float(self.weight(density))
        return [weight * self._principal.value(slope, extensions) for slope in self._principal.slopes]

    @cached_property
    def _principal(self) -> _PrincipalEnergy:
        return _PrincipalEnergy(self)


class _PrincipalEnergy:
    """An energy and its derivatives by the principal stretches, in UFL that evaluates for numbers."""

    def __init__(self, material: StoredEnergy) -> None:
        somewhere = ufl.Mesh(basix.ufl.element("Lagrange", "tetrahedron", 1, shape=(3,)))
        self._extensions = [ufl.Constant(somewhere) for _ in range(3)]
        variables = [ufl.variable(extension) for extension in self._extensions]
        rows = [[variables[i] if i == k else 0.0 for k in range(3)] for i in range(3)]
        energy = material.energy_at(ufl.as_matrix(rows))
        self.energy, *self.slopes = (
            ufl.algorithms.expand_derivatives(each) for each in (energy, *(ufl.diff(energy, x) for x in variables))
        )

    def value(self, what: Any, extensions: tuple[float, float, float]) -> float:
        """What one of the expressions is at numbers."""
        return float(what((), dict(zip(self._extensions, map(float, extensions), strict=True))))
