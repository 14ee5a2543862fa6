"""How the solution of a step ended."""

from __future__ import annotations

from dataclasses import dataclass

DOUBTFUL = 1 / 16  # share of a Newton step

STAGNATES = "the residual stagnates"  # how the reason begins
CLOSE = 1e-5  # residual over its scale, below which what stagnates has found a solution, but not its last digits


@dataclass(frozen=True)
class NewtonReport:
    """How the solution of a step ended.

    residual_norms: ‖out-of-balance forces‖₂ over their scale, one per iteration, the start included.
    reason: a part of a sentence.
    residuals, factorisations: how often each was computed; of an iterative linear solver, its preconditioners.
    linear_solver: what solved the linear systems, in words.
    shortest_step: smallest share of a Newton step that was taken (of PETSc's own methods not known, 1).
    round_off: of the residual, over the scale, if that and not the tolerance ended the solution; else 0.
    """

    converged: bool
    iterations: int
    residual_norms: tuple[float, ...]
    reason: str
    residuals: int = 0
    factorisations: int = 0
    linear_solver: str = ""
    shortest_step: float = 1.0
    round_off: float = 0.0

    @property
    def in_doubt(self) -> bool:
        """Whether the way was so winding that the solution may not be the one that continues the last state."""
        return self.shortest_step < DOUBTFUL

    @property
    def stagnated(self) -> bool:
        """Whether a solution was as good as found, but its residual would fall no further."""
        return not self.converged and self.reason.startswith(STAGNATES) and self.residual_norms[-1] < CLOSE
