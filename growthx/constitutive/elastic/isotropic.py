"""Isotropic stored energies at finite strains: Saint Venant–Kirchhoff, Hencky, Mooney–Rivlin, Ogden."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import ufl

from growthx.common.checks import require, require_number, require_vector
from growthx.common.errors import InputError, shown
from growthx.constitutive.elastic import traces
from growthx.constitutive.elastic.base import ByModuli
from growthx.constitutive.elastic.invariants import Invariants
from growthx.constitutive.functions import ln1p, ln1p_excess

MOST = 12.0  # size of an exponent of a stretch


@dataclass(frozen=True)
class SaintVenantKirchhoff(ByModuli, replaceable=()):
    """½ λ tr²E + μ E : E of Green's strain E = ½ [Fᵀ F − I]: Hooke's law at large rotations.

    For small strains: in compression it softens below a stretch of 1/√3 = 0.577, and a body can turn inside out.
    Parameters: see `ByModuli`.

    Example:
        >>> bone = gx.SaintVenantKirchhoff(young=500.0)
        >>> print(f"{bone.principal_energy((0.1, 0.0, 0.0)):.4f}")
        3.0625
    """

    def energy_of(self, invariants: Invariants) -> Any:
        """By the invariants of 2 E."""
        lam, mu = self.lame
        first, second, _ = invariants.of_strain
        return (lam / 8 + mu / 4) * first * first - mu / 2 * second


@dataclass(frozen=True)
class _BySums(ByModuli, replaceable=()):
    """An energy with many terms, each of the few invariants."""

    def stress(self, H: Any, density: Any) -> Any:
        """Reduced momentum flux P̄, as `Elasticity.stress`: Σ ∂Ψ₀ᵉˡ/∂I ∂I/∂F, which differentiates each term by scalars.

        By the nine entries of F at once, compilers would take minutes.
        """
        H = ufl.variable(H)
        invariants = Invariants.of_gradient(H).as_variables()
        energy = self.energy_of(invariants)
        seen = (invariants.shape, invariants.volume, *invariants.of_strain)
        slopes = [ufl.diff(energy, each) * ufl.diff(each.ufl_operands[0], H) for each in seen]
        return self.weight(density) * sum(slopes[1:], slopes[0])


@dataclass(frozen=True)
class Hencky(_BySums, replaceable=()):
    """½ λ ln²J + μ |ln U|², of logarithmic strains (Hencky 1928).

    As exact as round-off between the stretches 0.8 and 1.3, to 4e-8 between ½ and 2, see `traces`; not elliptic beyond
    a stretch of about 1.4
    (Bruhns, Xiao & Meyers 2001).  Parameters: see `ByModuli`.

    Example:
        >>> bone = gx.Hencky(young=500.0)
        >>> print(f"{bone.principal_energy((0.1, 0.0, 0.0)):.4f}")
        2.5233
    """

    def energy_of(self, invariants: Invariants) -> Any:
        """By the invariants of C − I: regular where principal stretches coincide."""
        lam, mu = self.lame
        log_J = ln1p(invariants.volume)
        return lam / 2 * log_J * log_J + mu * traces.sum_of_squared_logarithms(invariants.of_strain)


@dataclass(frozen=True)
class MooneyRivlin(ByModuli, replaceable=()):
    """c₁ [I₁ − 3 − 2 ln J] + c₂ [I₂ − 3 − 4 ln J] + ¼ K [J² − 1 − 2 ln J] (Ciarlet & Geymonat 1982): polyconvex.

    c₁ = ½ [1 − s] μ, c₂ = ½ s μ and K = λ − 2 s μ, so that at small strains it is Hooke's law of E and ν.
    share: s (no unit), of the second invariant: from 0 to 1, and for K ≥ 0 at most ν/(1 − 2 ν).
    Other parameters: see `ByModuli`.

    Example:
        >>> bone = gx.MooneyRivlin(young=500.0, poisson=0.3, share=0.5)
        >>> print(f"{bone.principal_energy((0.1, 0.0, 0.0)):.4f}")
        3.2610
    """

    share: float = 0.25

    def __post_init__(self) -> None:
        super().__post_init__()
        require_number(self.share, "the share s of the second invariant", "a number from 0 to 1", lambda s: 0 <= s <= 1)
        require(
            self.poisson,
            f"Poisson's ratio ν beside the share {self.share:g} of the second invariant",
            f"one of at least s/(1 + 2 s) = {self.share / (1 + 2 * self.share):.6g}, or a smaller share,",
            lambda nu: nu / (1 - 2 * nu) >= self.share * (1 - 1e-9),
        )

    def energy_of(self, invariants: Invariants) -> Any:
        """I₂ − 3 − 4 ln J = 2 [I₁ − 3 − 2 (J − 1)] + 4 [J − 1 − ln J] + the second invariant of C − I."""
        lam, mu = self.lame
        shape, volume = invariants.shape, invariants.volume
        excess = ln1p_excess(volume)
        first, second = shape + 2 * excess, 2 * shape + 4 * excess + invariants.of_strain[1]
        bulk = lam - 2 * self.share * mu
        shear = (1 - self.share) * first + self.share * second
        return mu / 2 * shear + bulk / 4 * (volume * volume + 2 * excess)


@dataclass(frozen=True)
class Ogden(_BySums, replaceable=()):
    """Σ μₚ/αₚ [λ₁^αₚ + λ₂^αₚ + λ₃^αₚ − 3 − αₚ ln J] + ½ λ ln²J (Ogden 1972), Σ μₚ αₚ = 2 μ.

    powers: αₚ (no unit), none of them zero, up to a size of 12.  shares: sₚ of the terms in the shear modulus,
    μₚ = 2 sₚ μ/αₚ, at least 0 and of the sum one; default: equal ones.  One term with α = 2 is neo-Hooke.
    As exact as round-off between the stretches 0.8 and 1.3, to 1e-6 between ½ and 2, see `traces`; at any for powers
    that are even.
    Other parameters: see `ByModuli`.

    Example:
        >>> bone = gx.Ogden(young=500.0, powers=(2.0, -2.0), shares=(0.75, 0.25))
        >>> print(f"{bone.principal_energy((0.1, 0.0, 0.0)):.4f}")
        2.5893
    """

    powers: tuple[float, ...] = (2.0, -2.0)
    shares: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        powers = require_vector(self.powers, "the powers α of stretches")
        shares = (1 / max(len(powers), 1),) * len(powers)
        if self.shares is not None:
            shares = require_vector(self.shares, "the shares of the terms in the shear modulus")
        object.__setattr__(self, "powers", powers)
        object.__setattr__(self, "shares", shares)
        if not powers or any(alpha == 0 or abs(alpha) > MOST for alpha in powers):
            raise InputError(
                f"the powers α of stretches are {shown(powers)}: one or more, none of them 0, of a size of at "
                f"most {MOST:g}, would be right"
            )
        if len(shares) != len(powers) or min(shares) < 0 or abs(sum(shares) - 1) > 1e-9:
            raise InputError(
                f"the shares of the terms in the shear modulus are {shown(shares)}: {len(powers)} of at least 0 "
                "with the sum 1 would be right"
            )

    def energy_of(self, invariants: Invariants) -> Any:
        """By the invariants of C − I, or of its inverse for α < 0: regular where principal stretches coincide."""
        lam, mu = self.lame
        log_J, excess = ln1p(invariants.volume), ln1p_excess(invariants.volume)
        upright, turned = invariants.of_strain, traces.inverse(invariants.of_strain)
        linear = invariants.shape + 2 * excess  # Σ xᵢ − 2 ln J
        of_inverse = traces.sum_beyond_inverse(upright) - linear  # Σ yᵢ + 2 ln J, yᵢ those of the inverse
        total = lam / 2 * log_J * log_J
        for alpha, share in zip(self.powers, self.shares or (), strict=True):
            strain, rest = (upright, linear) if alpha > 0 else (turned, of_inverse)
            beyond = traces.sum_of_powers(strain, abs(alpha)) + abs(alpha) / 2 * rest
            total = total + 2 * share * mu / alpha**2 * beyond
        return total
