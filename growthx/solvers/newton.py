"""Newton's method for the nonlinear system of one time step: PETSc's SNES, its linear solver and what it reports."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from growthx.common.errors import EndedEarly
from growthx.common.interruption import ignore_broken_pipes
from growthx.solvers import abandoned
from growthx.solvers.kept_factor import KeptFactor
from growthx.solvers.report import CLOSE, STAGNATES, NewtonReport
from growthx.solvers.round_off import RoundOff, stagnates
from growthx.solvers.settings import NewtonSettings
from growthx.solvers.tangent import Softest, Tangent, negative_pivots

if TYPE_CHECKING:
    from types import TracebackType

    from growthx.common.arrays import Floats
    from growthx.solvers.linear_solvers import LinearSolver
    from growthx.solvers.problem import NonlinearProblem


ignore_broken_pipes()

# Command-line options of PETSc under this prefix override what is chosen below, as in -growthx_pc_type.
PREFIX = "growthx_"

ROUGH = 1e-4  # tolerance where a solution is but a place to go on from
DEFAULTS = NewtonSettings()
DIVERGED = 1e4  # residual over that of the first iterate


class Newton:
    """Solves a problem from where its iterate is, see `NewtonSettings`; keeps factors from one solution to the next."""

    def __init__(self, problem: NonlinearProblem, settings: NewtonSettings = DEFAULTS) -> None:
        abandoned.free(problem.comm)
        self.problem, self.number = problem, abandoned.number(problem.comm)
        self._force_scale = problem.force_scale()
        self._settings, self._tolerance = settings, settings.tolerance * self._force_scale
        self._must_be_stable = problem.must_be_stable
        self._residuals = self._factorisations = 0
        self._solution = PETSc.Vec().createMPI((problem.owned, None), comm=problem.comm)
        residual = self._solution.duplicate()
        self._snes = snes = PETSc.SNES().create(problem.comm)
        snes.setOptionsPrefix(PREFIX)
        snes.setFunction(self._assemble_residual, residual)
        self._tangent = Tangent(snes, problem, full=settings.full)
        snes.setJacobian(self._assemble_tangent, self._tangent.matrix)
        self._round_off = RoundOff(self._residual_at, CLOSE * self._force_scale, problem.comm)
        self._stopped_at = 0.0  # norm of the residual, by its round-off, in the last solution
        self._kept: KeptFactor | None = None
        self._softest: Softest | None = None
        self._has_given_way = False  # whether a balance was found that is not stable
        limits = problem.limits()
        if limits is not None:
            snes.setType("vinewtonrsls")
        elif settings.full:
            snes.setType("newtonls")
        else:
            untouched = settings.untouched * self._force_scale
            self._kept = KeptFactor(
                untouched,
                problem.largest_share,
                self._round_off,
                lambda: self.linear_solver.renewal,
                np.asarray if problem.following is None else problem.following.settled,
            )
            snes.setType("python")
            snes.setPythonContext(self._kept)
        self._forced = settings.untouched < settings.tolerance
        snes.setForceIteration(self._forced)
        self._set_tolerance(self._tolerance)
        if self._kept is None:
            snes.setConvergenceTest(self._has_ended)
            if problem.following is not None:
                snes.setUpdate(self._settle)
        snes.setConvergenceHistory(length=settings.maximum_iterations + 1, reset=True)
        # The default search of the type with limits stalls, and ends runs, where full steps converge at once.
        if limits is None or not self._search("basic"):
            snes.setFromOptions()
        if limits is not None:
            self._limits = [PETSc.Vec().createWithArray(limit, comm=problem.comm) for limit in limits]
            snes.setVariableBounds(*self._limits)
            snes.setSolution(self._solution)

    @property
    def linear_solver(self) -> LinearSolver:
        """What solves the linear systems; another one where that had to give way."""
        return self._tangent.solver

    def _search(self, kind: str) -> bool:
        """Set how PETSc's own methods search along a step, unless the user has; whether that was so."""
        options, name = PETSc.Options(PREFIX), "snes_linesearch_type"
        if options.hasName(name):
            return False
        options[name] = kind
        self._snes.setFromOptions()
        options.delValue(name)
        return True

    def _set_tolerance(self, tolerance: float) -> None:
        self._snes.setTolerances(atol=tolerance, rtol=0.0, stol=0.0, max_it=self._settings.maximum_iterations)

    @abandoned.garbage_waits()
    def solve(self, *, roughly: bool = False, bold: bool = False) -> NewtonReport:
        """Bring the running iterate to balance, starting from what it is (collective).

        A balance that is known not to be stable counts as none.  roughly: to a tolerance of `ROUGH` at least.
        bold: by full steps, whatever becomes of the residual on the way.  Where a stiff part turns, a straight step
        stretches it by the square of its angle, and only the step after it takes that back: among steps that lower the
        residual there are but tiny ones.
        """
        if self._kept is not None:
            self._kept.bold = bold
        elif self.problem.limits() is None:  # else it takes full steps anyway
            self._search("basic" if bold else "bt")
        self._set_tolerance(max(self._tolerance, ROUGH * self._force_scale) if roughly else self._tolerance)
        self._residuals = self._factorisations = 0
        self._stopped_at = 0.0
        self._solution.array_w[:] = self.problem.unknown.x.array[: self._solution.local_size]
        try:
            self._snes.solve(None, self._solution)
        except PETSc.Error as error:
            origin = _origin(error)
            if origin is not error:
                raise origin from None
            # A factorisation that PETSc itself gives up on fails the step; anything else is a defect of ours.
            if error.ierr not in (PETSC_ERR_MAT_LU_ZRPVT, PETSC_ERR_MAT_CH_ZRPVT, PETSC_ERR_FP, PETSC_ERR_LIB):
                raise
            return self._report(False, (), "the linear system is singular")
        norms = tuple(float(norm) / self._force_scale for norm in self._snes.getConvergenceHistory()[0])
        code = self._snes.getConvergedReason()
        if self._kept is not None:
            self._stopped_at = self._kept.round_off
        if code > 0:  # else the iterate stays where it failed, to be asked why
            self._return_to(self._solution)
            if unstable := self._unstable_directions():
                self._has_given_way = True
                return self._report(False, norms, _unstable(unstable))
        return self._report(code > 0, norms, self._reason(code, norms))

    def _unstable_directions(self) -> int:
        """Number of negative pivots of a symmetric tangent.

        Looked for only where the last factorised one has some, or where a balance was not stable before.
        """
        if not (self.problem.symmetric and self._must_be_stable):
            return 0
        if self._tangent.leaves_out_coupling:
            return self._coupled_directions()
        if not (self._tangent.negative_pivots or self._has_given_way):
            return 0
        self._snes.computeJacobian(self._solution, self._tangent.matrix)
        return self._tangent.negative_pivots

    def _coupled_directions(self) -> int:
        """Number of negative pivots of the whole tangent, where what steers are the load cases' own blocks.

        Looked for where one direction shows that there are some: from there on the whole tangent steers.
        """
        if self._softest is None:
            self._softest = Softest(self._snes, self._residual_at, self.problem.layout.held)
        residual, count = self._snes.getFunction()[0].array_r.copy(), self._snes.getIterationNumber()
        position = self._solution.array_r.copy()
        if not self._softest.is_indefinite(position, residual, count, renewed=self._factorisations > 0):
            return 0
        self._factorisations += 1
        found = negative_pivots(self.problem)
        if found:
            assert self._kept is not None
            self._kept.drop_factor()
            self._tangent.use_whole(self._assemble_tangent, direct=True)
        return found

    def _report(self, converged: bool, norms: tuple[float, ...], reason: str) -> NewtonReport:
        return NewtonReport(
            converged,
            self._snes.getIterationNumber(),
            norms,
            reason,
            self._residuals,
            self._factorisations,
            self.linear_solver.description,
            1.0 if self._kept is None else self._kept.shortest_step,
            self._stopped_at / self._force_scale,
        )

    def _reason(self, code: int, norms: tuple[float, ...]) -> str:
        """Of PETSc's code, as a part of a sentence."""
        if self._stopped_at:
            return f"the residual is at its round-off, {self._stopped_at / self._force_scale:.1g} of the loads"
        held_back = self._kept is not None and self._kept.held_back  # by a density that is about to vanish
        if code <= 0 and norms and not held_back and (stagnates(norms) or norms[-1] < CLOSE):
            return f"{STAGNATES} at {norms[-1]:.1g} of the loads"
        return _REASONS.get(code, f"SNES reason {code}")

    def _has_ended(self, snes: PETSc.SNES, iteration: int, norms: tuple[float, float, float]) -> int:
        """PETSc's reason to end its own methods, zero to go on: its default test and, of the residual, round-off."""
        reasons = PETSc.SNES.ConvergedReason
        position, step, residual = norms
        history = [*map(float, snes.getConvergenceHistory()[0][:iteration]), residual]
        relative, absolute, of_step, _ = snes.getTolerances()
        if not np.isfinite(residual):
            return next(code for code, text in _REASONS.items() if code is not None and text == NOT_A_NUMBER)
        if residual <= absolute and (iteration > 0 or not self._forced):
            return reasons.CONVERGED_FNORM_ABS
        if iteration == 0:
            return 0
        if residual <= relative * history[0]:
            return reasons.CONVERGED_FNORM_RELATIVE
        if step < of_step * position:
            return reasons.CONVERGED_SNORM_RELATIVE
        if self._round_off.may_be_reached(history[-2], residual):
            found = self._round_off.norm(snes.getSolution().array_r.copy(), snes.getFunction()[0].array_r.copy())
            if residual <= found:
                self._stopped_at = found
                return reasons.CONVERGED_FNORM_ABS
        if residual > DIVERGED * history[0]:
            return reasons.DIVERGED_DTOL
        return reasons.DIVERGED_MAX_IT if stagnates(history) else 0

    def destroy(self) -> None:
        """Free the solver's memory (collective)."""
        for part in (self._snes, self._tangent, self._solution, self._softest):
            if part is not None:
                part.destroy()

    def leave(self) -> None:
        """Free it as soon as all ranks can; any of them may call this alone."""
        abandoned.leave(self)

    def __enter__(self) -> Newton:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None or issubclass(kind, EndedEarly):  # on all ranks
            self.destroy()
        else:
            self.leave()

    def _settle(self, snes: PETSc.SNES, step: int) -> None:
        """Put what follows motions to where these have it: a step has gone along their tangents."""
        x = snes.getSolution()
        assert self.problem.following is not None
        x.array_w[:] = self.problem.following.settled(x.array_r)

    def _take(self, x: PETSc.Vec) -> None:
        self.problem.start_from(x.array_r)

    def _return_to(self, x: PETSc.Vec) -> None:
        """Make x the running iterate again: the line search may have looked further than the iterate it took."""
        here = np.array_equal(x.array_r, self.problem.unknown.x.array[: x.local_size])
        if not self.problem.comm.allreduce(here, MPI.LAND):
            self._take(x)
            self.problem.out_of_balance()

    def _assemble_residual(self, snes: PETSc.SNES, x: PETSc.Vec, f: PETSc.Vec) -> None:
        f.array_w[:] = self._residual_at(x.array_r)

    def _residual_at(self, position: Floats) -> Floats:
        self._residuals += 1
        self.problem.start_from(position)
        return self.problem.out_of_balance()

    def _assemble_tangent(self, snes: PETSc.SNES, x: PETSc.Vec, A: PETSc.Mat, P: PETSc.Mat) -> None:
        self._factorisations += 1
        self._return_to(x)
        self._tangent.renew(self._assemble_tangent)


def _unstable(directions: int) -> str:
    count = "one direction" if directions == 1 else f"{directions} directions"
    return f"the balance that was found is not stable: the body gives way in {count}"


def _origin(error: BaseException) -> BaseException:
    """What was raised while PETSc called us, such as bad input or Ctrl-C, which it hands on as an error of its own."""
    return error if error.__cause__ is None else _origin(error.__cause__)


PETSC_ERR_LIB, PETSC_ERR_MAT_LU_ZRPVT, PETSC_ERR_FP, PETSC_ERR_MAT_CH_ZRPVT = 76, 71, 72, 81

NOT_A_NUMBER = "the residual is not a number"

# By name: PETSc has renamed some (FNORM_NAN became FUNCTION_NANORINF in 3.25).
_SENTENCES = {
    "CONVERGED_FNORM_ABS": "the balances hold to the tolerance",
    "DIVERGED_MAX_IT": "Newton's method did not converge within its number of iterations",
    "DIVERGED_LINE_SEARCH": "no part of a Newton step reduces the residual",
    "DIVERGED_LINEAR_SOLVE": "the linear system could not be solved",
    "DIVERGED_FNORM_NAN": NOT_A_NUMBER,
    "DIVERGED_FUNCTION_NANORINF": NOT_A_NUMBER,
    "DIVERGED_FUNCTION_DOMAIN": "the iterate is not admissible",
    "DIVERGED_DTOL": "the residual grows without bound",
}
_REASONS = {getattr(PETSc.SNES.ConvergedReason, name, None): text for name, text in _SENTENCES.items()}
