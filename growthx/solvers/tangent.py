"""A system's tangent as a matrix, and the signs of its eigenvalues."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dolfinx.fem import petsc
from petsc4py import PETSc

from growthx.fem import implicit
from growthx.solvers import linear_solvers

if TYPE_CHECKING:
    from collections.abc import Callable

    from growthx.solvers.cell_factors import CellFactors
    from growthx.solvers.linear_solvers import LinearSolver
    from growthx.solvers.node_factors import NodeFactors
    from growthx.solvers.problem import NonlinearProblem


def assemble_tangent(problem: NonlinearProblem, matrix: PETSc.Mat) -> None:
    """Assemble the tangent of a problem at its running iterate into a matrix made from `problem.coupling`."""
    matrix.zeroEntries()
    for tangent in problem.tangents:
        implicit.refresh(tangent)
        petsc.assemble_matrix(matrix, tangent, problem.conditions)  # type: ignore[arg-type]
        matrix.assemble(PETSc.Mat.AssemblyType.FLUSH)  # PETSc drops, silently, what is added to what was inserted
    matrix.assemble()


class Tangent:
    """The tangent of Newton's method, and what solves with it.

    matrix: it, of PETSc's; an empty one where factors are made right from the cells, see `cell_factors`.
    """

    def __init__(self, snes: PETSc.SNES, problem: NonlinearProblem, *, full: bool) -> None:
        """snes: with its prefix.  full: of each iteration, as a full Newton's method has it (collective)."""
        self._snes, self._problem = snes, problem
        self._asked_for: PETSc.Mat | None = None
        options = PETSc.Options(snes.getOptionsPrefix()).getAll()  # they are for a matrix
        self._cells: CellFactors | NodeFactors | None = None
        if not (full or options):
            self._cells = linear_solvers.cell_factors(problem) or linear_solvers.node_factors(problem)
        if self._cells is None:
            self._use_matrix(full=full)
            return
        self.matrix = PETSc.Mat().createAIJ(((problem.owned, None),) * 2, nnz=0, comm=problem.comm)
        self.matrix.assemble()
        self.solver: LinearSolver = linear_solvers.use_cells(snes.getKSP(), problem, self.matrix, self._cells)

    def _use_matrix(self, *, full: bool = False, single: bool = True) -> None:
        self.matrix = petsc.create_matrix(self._problem.coupling)
        ksp = self._snes.getKSP()
        self.solver = linear_solvers.set_up(
            ksp, self._problem, self.matrix, direct=full, single=single, snes=self._snes
        )

    def renew(self, function: Callable[..., None]) -> None:
        """Assemble it at the running iterate, and have its solver ready.

        function: of SNES for it, which is to be told where another matrix takes over.
        """
        if self._cells is not None:
            if not self._cells.is_poor and self._cells.assemble():
                return
            # Single precision is not enough here.
            self._asked_for, self._cells = self.matrix, None  # SNES may still look at it
            self._snes.getKSP().reset()
            self._use_matrix(single=False)
            self._snes.setJacobian(function, self.matrix)
        assemble_tangent(self._problem, self.matrix)
        self.solver.refresh()

    def destroy(self) -> None:
        """Free the memory (collective)."""
        self.matrix.destroy()


def negative_pivots(problem: NonlinearProblem) -> int:
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
