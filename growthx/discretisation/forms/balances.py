"""The weak balances of mass and momentum (18), one function per term; how they are solved is not known here.

    G_ρ = ∫ δρ [ρ − ρₙ]/Δt dV + ∫ ∇δρ · R dV − ∮ δρ r dA − ∫ δρ R₀ dV = 0
    G_u = ∫ δu · ρ [p − pₙ]/Δt dV + ∫ ∇δu : P̄ dV − ∮ δu · t dA − ∫ δu · b̄₀ dV = 0

u: displacement (length), ρ: reference density, δu and δρ: test functions.  Each function returns a UFL form.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import ufl

from growthx.constitutive.expressions import expression
from growthx.constitutive.kinematics import in_space

if TYPE_CHECKING:
    from growthx.constitutive.energies import Elasticity
    from growthx.constitutive.flux import MassFlux
    from growthx.constitutive.sources import MassSource


def storage(rho: Any, old_rho: Any, test: Any, time_step: Any, dV: ufl.Measure) -> ufl.Form:
    """∫ δρ [ρ − ρₙ]/Δt dV, the implicit Euler rate of mass (17)."""
    return test * (rho - old_rho) / time_step * dV


def source(rho: Any, energy: Any, test: Any, growth: MassSource, material: Elasticity, dV: ufl.Measure) -> ufl.Form:
    """∫ δρ R₀ dV with the mass source R₀ (6) at the elastic energy Ψ₀ⁿᵉᵒ."""
    return test * growth.mass_source(rho, energy, material) * dV


def internal_work(H: Any, rho: Any, test: Any, material: Elasticity, dV: ufl.Measure) -> ufl.Form:
    """∫ ∇δu : P̄ dV with the reduced momentum flux P̄ (7) at H = ∇u, of which the plane may be a part."""
    slope = ufl.grad(test)
    return ufl.inner(material.stress(H, rho), slope if H.ufl_shape == slope.ufl_shape else in_space(slope)) * dV


def external_work(load: Any, test: Any, measure: ufl.Measure) -> ufl.Form:
    """∮ δu · t dA with the dead traction t per reference area (12), or ∫ δu · b̄₀ dV with the momentum source b̄₀ (8)."""
    return ufl.inner(load, test) * measure


def flux(rho: Any, test: Any, law: MassFlux, material: Elasticity, dV: ufl.Measure) -> ufl.Form:
    """∫ ∇δρ · R dV with the mass flux R = R₀ᶠ ∇ρ (5)."""
    slope = ufl.grad(test)
    return ufl.inner(expression(law.flux(rho, material), slope.ufl_shape, "the mass flux"), slope) * dV


def influx(rate: Any, test: Any, dA: ufl.Measure) -> ufl.Form:
    """∮ δρ r dA with the influx r = R · N (12)."""
    return rate * test * dA


def inertia(u: Any, old_u: Any, old_velocity: Any, rho: Any, test: Any, time_step: Any, dV: ufl.Measure) -> ufl.Form:
    """∫ δu · ρ [p − pₙ]/Δt dV, the rate of momentum by implicit Euler, p = [u − uₙ]/Δt (Remark 4.2)."""
    velocity = (u - old_u) / time_step
    return ufl.inner(rho * (velocity - old_velocity) / time_step, test) * dV
