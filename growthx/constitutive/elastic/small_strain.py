"""Linear elasticity, as most papers on bone have it: small strains, where no deformation changes what is loaded."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import ufl

from growthx.constitutive.elastic.base import ByModuli
from growthx.constitutive.elastic.invariants import Invariants


@dataclass(frozen=True)
class LinearElasticity(ByModuli, replaceable=()):
    """½ λ tr²ε + μ ε : ε of ε = sym ∇u (Hooke), whatever the size of the strains.

    The stress is that of the body at rest and symmetric, det F is not asked for, and what is written of strains is ε.
    Not frame indifferent: a rotation by an angle φ strains it by 1 − cos φ.  Parameters: see `ByModuli`.

    Example:
        >>> bone = gx.LinearElasticity(young=500.0)
        >>> print(f"{bone.principal_energy((0.1, 0.0, 0.0)):.4f}")
        2.7778
    """

    small_strain = True

    def energy_of(self, invariants: Invariants) -> Any:
        """By the trace of ε and of ε²."""
        lam, mu = self.lame
        return lam / 2 * invariants.dilation**2 + mu * invariants.linear_square

    def strain(self, H: Any) -> Any:
        """ε = sym ∇u, no unit, of the shape of H."""
        return ufl.sym(H)

    def true_stress(self, H: Any, density: Any) -> Any:
        """σ, the one stress there is."""
        return self.stress(H, density)
