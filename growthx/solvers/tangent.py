"""A system's tangent as a matrix, and the signs of its eigenvalues."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dolfinx.fem import petsc
from petsc4py import PETSc

if TYPE_CHECKING:
    from growthx.solvers.problem import NonlinearProblem


def assemble_tangent(problem: NonlinearProblem, matrix: PETSc.Mat) -> None:
    """Assemble the tangent of a problem at its running iterate into a matrix made from `problem.coupling`."""
    matrix.zeroEntries()
    for tangent in problem.tangents:
        petsc.assemble_matrix(matrix, tangent, problem.conditions)  # type: ignore[arg-type]
        matrix.assemble(PETSc.Mat.AssemblyType.FLUSH)  # PETSc drops, silently, what is added to what was inserted
    matrix.assemble()


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
