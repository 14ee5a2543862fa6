"""What Newton's method is asked for, as one value."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace


@dataclass(frozen=True)
class NewtonSettings:
    """Newton's method with an exact residual, a consistent tangent and steps that avoid inadmissible states.

    tolerance: ‖R‖₂ ≤ tolerance · force scale ends the iteration; R are the out-of-balance forces and, in units of
    force, of mass.  So does a residual that is as small as its round-off, see `round_off`, which the report then tells.
    full: assemble and factorise the tangent at every iteration, as the paper does, and search along each step; else
    only where an older factor has become slow, see `kept_factor` (not for densities with bounds that are unknowns).
    untouched: a state that was foretold is taken as it is only if it holds to this, like `tolerance`; where that is
    loose, many steps without any iteration could lead far astray.
    """

    tolerance: float = 1e-10
    full: bool = False
    maximum_iterations: int = 50
    untouched: float = math.inf

    def loosened(self, tolerance: float) -> NewtonSettings:
        """The same to another tolerance; what was foretold still has to hold to this one."""
        return replace(self, tolerance=tolerance, untouched=self.tolerance)
