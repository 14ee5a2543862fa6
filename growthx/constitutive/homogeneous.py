"""Homogeneous states, against which the discretisations are compared: biological equilibrium of a bar in tension."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from growthx.common.checks import require, require_number
from growthx.common.errors import InputError
from growthx.constitutive.growth import GrowthLaw
from growthx.constitutive.kinematics import Plane

if TYPE_CHECKING:
    from collections.abc import Callable

    from growthx.constitutive.energies import Elasticity
    from growthx.constitutive.sources import MassSource

LEAST, MOST = 1e-16, 1e3  # stretch along the load, less one
NEARER = 2.0  # factor by which it is made smaller where there is no state at the most
ALIKE = 1e-12  # of the stress along a bar: one across it that is none
LEAST_VOLUME = 1e-9  # of the one at rest, of a bar of the length at rest
LOWEST, HIGHEST = 1e-8, 1e8  # relative density


@dataclass(frozen=True)
class Equilibrium:
    """A homogeneous state: density and strains along the load, across it in the plane and across the plane.

    extension, transverse_extension, thickness_extension: principal stretches less one, which keeps the digits of small
    ones; the last is zero in plane strain.
    """

    density: float
    extension: float
    transverse_extension: float
    thickness_extension: float = 0.0

    @property
    def stretch(self) -> float:
        """Along the load."""
        return 1 + self.extension

    @property
    def transverse_stretch(self) -> float:
        """Across it."""
        return 1 + self.transverse_extension

    @property
    def thickness_stretch(self) -> float:
        """Across the plane."""
        return 1 + self.thickness_extension


def uniaxial_equilibrium(
    material: Elasticity, growth: MassSource, traction: float, plane: Plane = Plane.STRAIN
) -> Equilibrium:
    """Uniaxial tension in the plane with R₀ = 0, for uniform parameters and a source that depends on the density.

    The density follows from R₀ = 0: of a stimulus from [ρ/ρ*]^k D = S*, with the energy-driven law [ρ/ρ*]^(n−m) Ψ₀ⁿᵉᵒ =
    Ψ₀* (6).  The transverse stretch follows from P̄₂₂ = 0, in plane stress that of the thickness from P̄₃₃ = 0, and the
    stretch from P̄₁₁ = traction (force per reference area, positive).  Raises InputError where there is no such state,
    or no one density of it.
    """
    from scipy.optimize import brentq  # costly to import, and asked for by few

    require(traction, "the traction", "a positive number", lambda t: t > 0)
    if growth.remembers:
        raise InputError(
            f"{type(growth).__name__} has a memory, and its equilibrium depends on the way there: memory=None would be "
            "right"
        )
    if material.is_of_a_power:
        n = material.density_exponent
        require_number(n, "the density exponent n of a homogeneous state", "a number of at least 0", lambda n: n >= 0)
    if material.is_of_a_power and isinstance(growth, GrowthLaw):
        density = _density_by_power(material, growth)
    else:
        density = _density(material, growth)

    def state(extension: float) -> Equilibrium:
        across = _across(material, extension, plane)
        return Equilibrium(density(material.principal_energy((extension, *across))), extension, *across)

    def excess(logarithm: float) -> float:
        at = state(math.exp(logarithm))
        extensions = at.extension, at.transverse_extension, at.thickness_extension
        return material.principal_stresses(extensions, at.density)[0] - traction

    found = None
    if excess(math.log(LEAST)) < 0:
        found = state(math.exp(brentq(excess, math.log(LEAST), _beyond(excess, traction), xtol=1e-14)))
    ends = material.reference_density * LOWEST, material.reference_density * HIGHEST
    if found is None or found.density in ends:
        raise InputError(
            f"{type(growth).__name__} is zero at no density of a bar under the traction {traction:g}: one that has an "
            "equilibrium there would be right"
        )
    return found


def _across(material: Elasticity, extension: float, plane: Plane) -> tuple[float, float]:
    """The other two principal stretches, less one, of a bar that bears nothing across or, out of plane, is held."""
    from scipy.optimize import brentq

    # As shares of the extension, of which they keep the digits; one of one lowers the volume, which is not to vanish.
    thinnest = LEAST_VOLUME if plane is Plane.STRAIN else math.sqrt(LEAST_VOLUME)
    narrowest = min(1.0, (1 - thinnest) / extension)

    def stress(share: float, of_thickness: float, number: int) -> float:
        shares = (extension, -share * extension, -of_thickness * extension)
        return material.principal_stresses(shares, 1.0)[number] / extension

    def root(stress_of: Callable[[float], float]) -> float:
        return float(brentq(stress_of, -1.0, narrowest, xtol=1e-15))

    if plane is Plane.STRAIN:
        return -extension * root(lambda share: stress(share, 0.0, 1)), 0.0
    both = root(lambda share: stress(share, share, 1))  # where both directions are alike
    if abs(stress(both, both, 2)) <= ALIKE * abs(stress(both, both, 0)):
        return -extension * both, -extension * both

    def thickness(share: float) -> float:
        return root(lambda of_thickness: stress(share, of_thickness, 2))

    share = root(lambda share: stress(share, thickness(share), 1))
    return -extension * share, -extension * thickness(share)


def _beyond(excess: Callable[[float], float], traction: float) -> float:
    """The logarithm of an extension at which the bar bears more than its load.

    Some energies bear no such extension as the largest.
    """
    most = MOST
    while most > LEAST:
        try:
            if excess(math.log(most)) > 0:
                return math.log(most)
        except ValueError:  # of a root that is not there
            pass
        most /= NEARER
    raise InputError(
        f"no extension of a bar of this material bears the traction {traction:g}: a lower one would be right"
    )


def _density_by_power(material: Elasticity, growth: GrowthLaw) -> Callable[[float], float]:
    """ρ with [ρ/ρ*]^k D = S* of an energy."""
    exponent = -1 / growth.power(material)

    def density(energy: float) -> float:
        relative = (growth.drive(energy, material) / growth.attractor) ** exponent
        return float(material.reference_density * relative)

    return density


def _density(material: Elasticity, growth: MassSource) -> Callable[[float], float]:
    """ρ with R₀ = 0 of an energy, for a source that falls there; the lowest or highest looked at, if it lies beyond."""
    from scipy.optimize import brentq

    reference = material.reference_density

    def density(energy: float) -> float:
        def source(logarithm: float) -> float:
            return float(growth.mass_source(reference * math.exp(logarithm), energy, material))

        ends = math.log(LOWEST), math.log(HIGHEST)
        low, high = map(source, ends)
        if low < 0 < high:
            raise InputError(
                f"{type(growth).__name__} rises with the density, from {low:g} to {high:g}, so that its equilibria are "
                "not stable: one that falls would be right"
            )
        if low <= 0 or high >= 0:
            return float(reference * (LOWEST if low <= 0 else HIGHEST))
        return float(reference * math.exp(brentq(source, *ends, xtol=1e-15)))

    return density
