"""Newton's method that keeps its factor: a tangent is assembled and factorised only where an older one is slow.

With the factor of an older tangent K̃ the iteration is x ← x − K̃⁻¹ R(x), of linear convergence.  Anderson mixing of the
last few steps (a secant method on the kept factor) makes it several times faster.  The solution is that of Newton's
method: the residual is exact, and the same tolerance ends the iteration.

When a new factor pays is decided by counts, not by clocks, so that two runs do the same: within a solution where more
iterations are still to come, at the rate of the last one, than it costs and leaves to do, and from one solution to the
next as any machine is replaced that wears out: when the last solution has taken more than the mean of all that were
made with it, its own cost included.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI

from growthx.common.communicators import steady
from growthx.solvers.round_off import stagnates

if TYPE_CHECKING:
    from collections.abc import Callable

    from growthx.common.arrays import Floats
    from growthx.solvers.linear_solvers import Renewal
    from growthx.solvers.round_off import RoundOff

DEPTH = 5  # steps that are mixed
SHORTEST = 2.0**-12  # share of a Newton step
CONVERGED = "CONVERGED_FNORM_ABS"
BOLDEST = 1e4  # residual over the first one
DESCENT = 1e-4  # least relative reduction of the residual by a full step; less by its parts


class KeptFactor:
    """The context of a PETSc SNES of type "python": solves with the factor it has for as long as that pays.

    The factor outlives a call: the next time step begins with it.
    """

    def __init__(
        self,
        untouched: float,
        largest_share: Callable[[Floats, Floats], float],
        round_off: RoundOff,
        renewal: Callable[[], Renewal],
        settled: Callable[[Floats], Floats] = np.asarray,
    ) -> None:
        """untouched: norm of the residual above which a first iterate is never the solution.

        largest_share: of a step that may be taken from a position, both of owned unknowns; the same on all ranks.
        round_off: of the residual, at which it is the solution.
        renewal: what a new tangent and its factor cost and bring now.
        settled: where an iterate is that a step has led to, of owned unknowns.
        """
        self._untouched, self._largest_share, self._round_off = untouched, largest_share, round_off
        self._renewal, self._settled, self._wear = renewal, settled, _Wear()
        self.bold = False  # whether steps are full ones of Newton's method, see `Newton.solve`
        self.shortest_step = 1.0  # share of a step that was taken in the last call
        self.round_off = 0.0  # norm of it, if that was what ended the last call
        self.held_back = False  # whether its last step was shortened lest a density vanish
        self._mixing = _Mixing()
        self._factorised = False

    def solve(self, snes: Any, b: Any, x: Any) -> None:
        """Bring the residual at x below the solver's absolute tolerance; PETSc calls this."""
        self.round_off = 0.0
        at = _Iteration(snes, x, self._largest_share, self._settled)
        if self._wear.is_worn_out:
            self._factorised = False
        reason = self._iterate(at)
        self._wear.add(at.count - at.factorised_at)
        self.shortest_step, self.held_back = at.shortest_step, at.is_held_back
        if reason != CONVERGED:
            self._factorised = False
        snes.setConvergedReason(getattr(snes.ConvergedReason, reason))

    def drop_factor(self) -> None:
        """Begin the next call with a new factor."""
        self._factorised = False

    def _iterate(self, at: _Iteration) -> str:
        self._mixing.forget()
        while True:
            if not math.isfinite(at.norm):
                return at.not_a_number
            if at.norm <= (at.tolerance if at.count > 0 else min(at.tolerance, self._untouched)):
                return CONVERGED
            if at.count >= at.limit or (stagnates(at.norms) and not at.is_held_back):
                return "DIVERGED_MAX_IT"
            if not self._factorised:
                self._mixing = _Mixing()  # the memory is needed now
                at.factorise()
                self._factorised, self._wear = True, _Wear(self._renewal().cost)
            fresh = at.is_factorised_here or self.bold
            newton = at.newton_step()
            if newton is None:
                return "DIVERGED_LINEAR_SOLVE"
            before = at.norm
            if self.bold:
                moved = at.try_step(newton, shortest=SHORTEST, growth=BOLDEST)
            else:
                step = self._mixing.improve(at.position, newton, at.residual, at.comm)
                moved = at.try_step(step, shortest=SHORTEST if fresh else 1.0)
            # What is held back stays beyond the boundary, to be asked where that is: no other residual is looked at.
            near = not at.is_held_back and self._round_off.may_be_reached(before, at.norm)
            if near and self._is_at_round_off(at):
                return CONVERGED
            if not moved and fresh:
                return "DIVERGED_LINE_SEARCH"
            self._factorised = moved and not self.bold and not at.is_slow(before, self._renewal())

    def _is_at_round_off(self, at: _Iteration) -> bool:
        norm = self._round_off.norm(at.position, at.residual)
        if at.norm > norm:
            return False
        self.round_off = norm
        return True


class _Wear:
    """What a factor has cost so far, in iterations: its making, and those of the solutions that were made with it."""

    def __init__(self, cost: float = math.inf) -> None:
        self.cost, self._spent, self._last, self._solutions = cost, cost, 0, 0

    def add(self, iterations: int) -> None:
        """Those of another solution, or of the rest of the one in which the factor was made."""
        self._spent, self._last, self._solutions = self._spent + iterations, iterations, self._solutions + 1

    @property
    def is_worn_out(self) -> bool:
        """Whether its last solution took more than the mean of all: another factor would do them at less."""
        return self._solutions > 0 and self._last * self._solutions > self._spent


class _Iteration:
    """An iterate of a SNES, its residual and what can be done with them."""

    def __init__(
        self,
        snes: Any,
        x: Any,
        largest_share: Callable[[Floats, Floats], float],
        settled: Callable[[Floats], Floats],
    ) -> None:
        self._snes, self._x, self._largest_share, self._settled = snes, x, largest_share, settled
        self._residual = snes.getFunction()[0]
        self._step, self._trial, self._trial_residual = x.duplicate(), x.duplicate(), x.duplicate()
        self.comm: MPI.Intracomm = steady(snes.comm.tompi4py())
        _, _, _, self.limit = snes.getTolerances()
        self.tolerance = snes.atol
        self.count, self.is_factorised_here, self.shortest_step = 0, False, 1.0
        self.factorised_at = 0  # count of the iterations before the last factor
        self.norms: list[float] = []  # of the residuals so far
        self.is_held_back = False  # whether the last step was shortened by the largest share
        snes.computeFunction(x, self._residual)
        self._log(self._residual.norm())

    @property
    def position(self) -> Floats:
        """The iterate's owned unknowns."""
        return np.array(self._x.array_r)

    @property
    def residual(self) -> Floats:
        """The residual's owned entries."""
        return np.array(self._residual.array_r)

    @property
    def not_a_number(self) -> str:
        """PETSc's name for a residual that is none: it has changed."""
        reasons = type(self._snes).ConvergedReason
        return next(name for name in ("DIVERGED_FNORM_NAN", "DIVERGED_FUNCTION_NANORINF") if hasattr(reasons, name))

    def factorise(self) -> None:
        """Assemble the tangent here and factorise it, as the function that SNES calls for it does."""
        matrix, preconditioner = self._snes.getJacobian()[:2]
        self._snes.computeJacobian(self._x, matrix, preconditioner)
        self.is_factorised_here, self.factorised_at = True, self.count

    def newton_step(self) -> Floats | None:
        """−K̃⁻¹ R; None if the linear system could not be solved."""
        solver = self._snes.getKSP()
        solver.solve(self._residual, self._step)
        return None if solver.getConvergedReason() < 0 else -self._step.array_r

    def try_step(self, step: Floats, shortest: float, growth: float = 0.0) -> bool:
        """Go along a step as far as the residual falls, by halves down to a shortest share; whether it fell.

        The first share is the largest that leaves the unknown densities positive; where det F ≤ 0, the residual is not
        a number, and has not fallen.  growth: of the first residual, that is as good as a fall.
        """
        share = largest = self._largest_share(self._x.array_r, step)
        self.is_held_back = largest < 1.0
        while share >= shortest:
            self._trial.array_w[:] = self._x.array_r + share * step
            self._snes.computeFunction(self._trial, self._trial_residual)
            norm = self._trial_residual.norm()
            if norm < max((1 - DESCENT * share) * self.norm, growth * self.norms[0]):  # not so where it is no number
                self._x.array_w[:] = self._settled(self._trial.array_r)
                self._trial_residual.copy(self._residual)
                self.count += 1
                self.shortest_step = min(self.shortest_step, share)
                self.is_factorised_here = False
                self._log(norm)
                return True
            share /= 2
        if largest < 1.0:  # leave the running iterate beyond the boundary, to be asked where that is
            self._trial.array_w[:] = self._x.array_r + step
            self._snes.computeFunction(self._trial, self._trial_residual)
        return False

    def is_slow(self, before: float, renewal: Renewal) -> bool:
        """Whether the rate of the last step, from a norm before, would need more than a renewal costs and leaves."""
        if self.norm <= self.tolerance:
            return False
        digits = math.log10(self.norm / self.tolerance)
        return digits > (renewal.cost + digits / renewal.pace) * math.log10(before / self.norm)

    @property
    def norm(self) -> float:
        """Of the residual."""
        return self.norms[-1]

    def _log(self, norm: float) -> None:
        self.norms.append(norm)
        self._snes.setIterationNumber(self.count)
        self._snes.logConvergenceHistory(norm, 0)


class _Mixing:
    """Anderson mixing: the best combination of the last steps, least squares of what their residuals tell.

    Walker & Ni, Anderson acceleration for fixed-point iterations, SIAM J. Numer. Anal. 49 (2011) 1715–1735.
    """

    def __init__(self) -> None:
        self._moves: Floats = np.empty((DEPTH, 0))  # changes of the iterate, with those of the step from it
        self._changes: Floats = np.empty((DEPTH, 0))  # changes of the residual: they have one unit, steps have not
        self._products: Floats = np.empty((DEPTH, DEPTH))  # of the changes
        self.forget()

    def forget(self) -> None:
        """Drop all former steps."""
        self._count = 0
        self._last: tuple[Floats, Floats] | None = None

    def improve(self, position: Floats, step: Floats, residual: Floats, comm: MPI.Intracomm) -> Floats:
        """The mixed step for the owned unknowns (collective)."""
        target, former, self._last = position + step, self._last, (position + step, residual)
        if former is None:
            return step
        if self._moves.shape[1] != len(step):
            self._moves, self._changes = np.empty((DEPTH, len(step))), np.empty((DEPTH, len(step)))
        newest = self._count % DEPTH
        self._moves[newest], self._changes[newest] = target - former[0], residual - former[1]
        self._count += 1
        known = slice(min(self._count, DEPTH))
        found = np.array([self._changes[known] @ self._changes[newest], self._changes[known] @ residual])
        comm.Allreduce(MPI.IN_PLACE, found)
        self._products[newest, known] = self._products[known, newest] = found[0]
        return np.asarray(step - self._shares(known, found[1]) @ self._moves[known])

    def _shares(self, known: slice, wanted: Floats) -> Floats:
        """Least squares by the normal equations, each change by its size."""
        products = self._products[known, known]
        size = np.sqrt(np.diag(products))
        size[size == 0] = 1.0
        return np.asarray(np.linalg.lstsq(products / np.outer(size, size), wanted / size, rcond=1e-12)[0] / size)
