"""Newton's method for the nonlinear system of one time step: PETSc's SNES, its linear solver and what it reports."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from dolfinx.fem import petsc
from mpi4py import MPI
from petsc4py import PETSc

from growthx import linear_solvers
from growthx.interruption import ignore_broken_pipes
from growthx.kept_factor import KeptFactor

if TYPE_CHECKING:
    from growthx.discretisation import Discretisation

ignore_broken_pipes()

# Command-line options of PETSc under this prefix override what is chosen below, as in -growthx_pc_type.
PREFIX = "growthx_"

DOUBTFUL = 1 / 16  # share of a Newton step
ROUGH = 1e-4  # tolerance where a solution is but a place to go on from


@dataclass(frozen=True)
class NewtonReport:
    """How the solution of a step ended.

    residual_norms: ‖out-of-balance forces‖₂ over their scale, one per iteration, the start included.
    reason: a part of a sentence.
    residuals, factorisations: how often each was computed; of an iterative linear solver, its preconditioners.
    linear_solver: what solved the linear systems, in words.
    shortest_step: smallest share of a Newton step that was taken (of PETSc's own methods not known, 1).
    """

    converged: bool
    iterations: int
    residual_norms: tuple[float, ...]
    reason: str
    residuals: int = 0
    factorisations: int = 0
    linear_solver: str = ""
    shortest_step: float = 1.0

    @property
    def in_doubt(self) -> bool:
        """Whether the way was so winding that the solution may not be the one that continues the last state."""
        return self.shortest_step < DOUBTFUL


class Newton:
    """Newton's method with an exact residual, a consistent tangent and steps that avoid inadmissible states.

    tolerance: ‖R‖₂ ≤ tolerance · force scale ends the iteration; R are the out-of-balance forces and, in units of
    force, of mass.
    untouched: a state that was foretold is taken as it is only if it holds to this, like `tolerance`; where that is
    loose, many steps without any iteration could lead far astray.
    full: assemble and factorise the tangent at every iteration, as the paper does, and search along each step; else
    only where an older factor has become slow, see `kept_factor` (not for densities with bounds that are unknowns).
    """

    def __init__(
        self,
        problem: Discretisation,
        tolerance: float = 1e-10,
        maximum_iterations: int = 25,
        *,
        untouched: float = np.inf,
        full: bool = False,
    ) -> None:
        self.problem = problem
        self._force_scale = problem.force_scale()
        self._tolerance, self._maximum_iterations = tolerance * self._force_scale, maximum_iterations
        self._residuals = self._factorisations = 0
        self._matrix = petsc.create_matrix(problem.coupling)
        self._solution = PETSc.Vec().createMPI((len(problem.nodal_load), None), comm=problem.comm)
        residual = self._solution.duplicate()
        self._snes = snes = PETSc.SNES().create(problem.comm)
        snes.setOptionsPrefix(PREFIX)
        snes.setFunction(self._assemble_residual, residual)
        snes.setJacobian(self._assemble_tangent, self._matrix)
        self._kept: KeptFactor | None = None
        limits = problem.limits()
        if limits is not None:
            snes.setType("vinewtonrsls")
        elif full:
            snes.setType("newtonls")
        else:
            self._kept = KeptFactor(untouched * self._force_scale, problem.largest_share)
            snes.setType("python")
            snes.setPythonContext(self._kept)
        snes.setForceIteration(untouched < tolerance)
        self._set_tolerance(self._tolerance)
        snes.setConvergenceHistory(length=maximum_iterations + 1, reset=True)
        self.linear_solver = linear_solvers.set_up(snes.getKSP(), problem, self._matrix, direct=full)
        if limits is not None and not PETSc.Options(PREFIX).hasName("snes_linesearch_type"):
            # The default one of this type stalls, and ends runs, where full steps converge at once.
            options = PETSc.Options(PREFIX)
            options["snes_linesearch_type"] = "basic"
            snes.setFromOptions()
            options.delValue("snes_linesearch_type")
        else:
            snes.setFromOptions()
        if limits is not None:
            self._limits = [PETSc.Vec().createWithArray(limit, comm=problem.comm) for limit in limits]
            snes.setVariableBounds(*self._limits)
            snes.setSolution(self._solution)

    def _set_tolerance(self, tolerance: float) -> None:
        self._snes.setTolerances(atol=tolerance, rtol=0.0, stol=0.0, max_it=self._maximum_iterations)

    def solve(self, *, roughly: bool = False) -> NewtonReport:
        """Bring the running iterate to balance, starting from what it is (collective).

        A balance that is known not to be stable counts as none.  roughly: to a tolerance of `ROUGH` at least.
        """
        self._set_tolerance(max(self._tolerance, ROUGH * self._force_scale) if roughly else self._tolerance)
        self._residuals = self._factorisations = 0
        unknown = self.problem.unknown.x.array
        self._solution.array_w[:] = unknown[: self._solution.local_size]
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
        if code > 0:  # else the iterate stays where it failed, to be asked why
            self._return_to(self._solution)
            if unstable := self._unstable_directions():
                return self._report(False, norms, _unstable(unstable))
        return self._report(code > 0, norms, _REASONS.get(code, f"SNES reason {code}"))

    def _unstable_directions(self) -> int:
        """Number of negative pivots of a symmetric tangent; looked for only where the last factorised one has some."""
        scene = self.problem.scene
        # Of a model that is not well posed no balance need be stable.
        well_posed = scene.growth.power(scene.material) < 0
        if not (self.problem.symmetric and well_posed and self.linear_solver.negative_pivots):
            return 0
        self._snes.computeJacobian(self._solution, self._matrix)
        return self.linear_solver.negative_pivots

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
        )

    def destroy(self) -> None:
        """Free the solver's memory (collective)."""
        for part in (self._snes, self._matrix, self._solution):
            part.destroy()

    def _take(self, x: PETSc.Vec) -> None:
        self.problem.unknown.x.array[: x.local_size] = x.array_r

    def _return_to(self, x: PETSc.Vec) -> None:
        """Make x the running iterate again: the line search may have looked further than the iterate it took."""
        here = np.array_equal(x.array_r, self.problem.unknown.x.array[: x.local_size])
        if not self.problem.comm.allreduce(here, MPI.LAND):
            self._take(x)
            self.problem.out_of_balance()

    def _assemble_residual(self, snes: PETSc.SNES, x: PETSc.Vec, f: PETSc.Vec) -> None:
        self._residuals += 1
        self._take(x)
        f.array_w[:] = self.problem.out_of_balance()

    def _assemble_tangent(self, snes: PETSc.SNES, x: PETSc.Vec, A: PETSc.Mat, P: PETSc.Mat) -> None:
        self._factorisations += 1
        self._return_to(x)
        assemble_tangent(self.problem, P)
        self.linear_solver.refresh()


def _unstable(directions: int) -> str:
    count = "one direction" if directions == 1 else f"{directions} directions"
    return f"the balance that was found is not stable: the body gives way in {count}"


def _origin(error: BaseException) -> BaseException:
    """What was raised while PETSc called us, such as bad input or Ctrl-C, which it hands on as an error of its own."""
    return error if error.__cause__ is None else _origin(error.__cause__)


def assemble_tangent(problem: Discretisation, matrix: PETSc.Mat) -> None:
    """Assemble the tangent of a problem at its running iterate into a matrix made from `problem.coupling`."""
    matrix.zeroEntries()
    for tangent in problem.tangents:
        petsc.assemble_matrix(matrix, tangent, problem.conditions)  # type: ignore[arg-type]
        matrix.assemble(PETSc.Mat.AssemblyType.FLUSH)  # PETSc drops, silently, what is added to what was inserted
    matrix.assemble()


def negative_pivots(problem: Discretisation) -> int:
    """Number of negative eigenvalues of the symmetric tangent of a problem in its state, by Sylvester's law."""
    matrix = petsc.create_matrix(problem.coupling)
    assemble_tangent(problem, matrix)
    matrix.setOption(PETSc.Mat.Option.SYMMETRIC, True)
    solver = PETSc.PC().create(problem.comm)
    solver.setOperators(matrix)
    solver.setType("cholesky")
    solver.setFactorSolverType("mumps")
    solver.setFactorSetUpSolverType()
    solver.getFactorMatrix().setMumpsIcntl(24, 1)  # without looking for null pivots MUMPS does not count
    solver.setUp()
    negative, _, _ = solver.getFactorMatrix().getInertia()
    solver.destroy()
    matrix.destroy()
    return int(negative)


PETSC_ERR_LIB, PETSC_ERR_MAT_LU_ZRPVT, PETSC_ERR_FP, PETSC_ERR_MAT_CH_ZRPVT = 76, 71, 72, 81

# By name: PETSc has renamed some (FNORM_NAN became FUNCTION_NANORINF in 3.25).
_SENTENCES = {
    "CONVERGED_FNORM_ABS": "the balances hold to the tolerance",
    "DIVERGED_MAX_IT": "Newton's method did not converge within its number of iterations",
    "DIVERGED_LINE_SEARCH": "no part of a Newton step reduces the residual",
    "DIVERGED_LINEAR_SOLVE": "the linear system could not be solved",
    "DIVERGED_FNORM_NAN": "the residual is not a number",
    "DIVERGED_FUNCTION_NANORINF": "the residual is not a number",
    "DIVERGED_FUNCTION_DOMAIN": "the iterate is not admissible",
    "DIVERGED_DTOL": "the residual grows without bound",
}
_REASONS = {getattr(PETSc.SNES.ConvergedReason, name, None): text for name, text in _SENTENCES.items()}
