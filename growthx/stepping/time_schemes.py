"""Time integration of the density: diagonally implicit Runge–Kutta schemes, of which implicit Euler (17) is the first.

With slopes k of the density at the stages of a step of length Δt,

    ρᵢ = ρₙ + Δt Σⱼ aᵢⱼ kⱼ,        kᵢ = R₀(ρᵢ, uᵢ) + Div R,

every stage is a step of implicit Euler of length aᵢᵢ Δt from a base density ρₙ + Δt Σ_{j<i} aᵢⱼ kⱼ, together with the
balance of momentum at its time: what solves the one solves all.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

from growthx.common.errors import InputError
from growthx.common.overrides import Sealed


@dataclass(frozen=True)
class TimeScheme(Sealed, replaceable=()):
    """A diagonally implicit Runge–Kutta scheme whose last stage is the end of the step.

    order: the error of a run is of the order Δt^order.
    weights: aᵢⱼ of each implicit stage, the slope at the start of the step first.
    compared: weights of a scheme of another order with the same slopes, for the estimate of the error.
    estimate_order: the power of Δt that the estimated error of one step goes with.

    Example:
        >>> [(scheme.name, scheme.order) for scheme in (gx.IMPLICIT_EULER, gx.TR_BDF2)]
        [('implicit Euler', 1), ('TR-BDF2', 2)]
    """

    name: str
    order: int
    weights: tuple[tuple[float, ...], ...]
    compared: tuple[float, ...]
    estimate_order: int

    @property
    def times(self) -> tuple[float, ...]:
        """Time of each stage, as share of the step."""
        return (*(sum(row) for row in self.weights[:-1]), 1.0)

    @property
    def needs_start(self) -> bool:
        """Whether a stage needs the slope at the start of the step."""
        return any(row[0] != 0 for row in self.weights)

    @property
    def compares_start(self) -> bool:
        """Whether the estimate needs it."""
        return self.compared[0] != 0


# The error is estimated as the difference from the trapezoidal rule.
IMPLICIT_EULER = TimeScheme("implicit Euler", 1, ((0.0, 1.0),), (0.5, 0.5), 2)

_W, _D = sqrt(2) / 4, 1 - sqrt(2) / 2
# Trapezoidal rule to t + 2dΔt, then backward differences; A- and L-stable (Hosea & Shampine, Analysis and
# implementation of TR-BDF2, Appl. Numer. Math. 20 (1996) 21–37).
TR_BDF2 = TimeScheme("TR-BDF2", 2, ((_D, _D), (_W, _W, _D)), ((1 - _W) / 3, (3 * _W + 1) / 3, _D / 3), 3)

# Needs no slope at the start, and so is the scheme of first steps (Alexander, SIAM J. Numer. Anal. 14 (1977)
# 1006–1021); its error is estimated as the difference from implicit Euler, which is larger.
SDIRK2 = TimeScheme("SDIRK2", 2, ((0.0, _D), (0.0, 1 - _D, _D)), (0.0, 0.0, 1.0), 2)

SCHEMES = {"implicit-euler": IMPLICIT_EULER, "tr-bdf2": TR_BDF2, "sdirk2": SDIRK2}


def named(name: str) -> TimeScheme:
    """The scheme of that name on the command line; InputError if there is none."""
    if name not in SCHEMES:
        raise InputError(f"there is no scheme of time integration '{name}': one of {', '.join(SCHEMES)} would be right")
    return SCHEMES[name]
