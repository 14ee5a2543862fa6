"""Linear systems in which some unknowns follow few motions: a solver of all others, bordered by the motions.

    | A   B | | x |   | b |        A    of the unknowns that are free
    | Cᵀ  D | | q | = | c |        q    of the motions; the unknowns that follow them change by Q q

(D − Cᵀ A⁻¹ B) q = c − Cᵀ A⁻¹ b  is a system of few unknowns, which all ranks solve.  A keeps the rows of what follows,
as unit ones.  B and C are products of the tangent with the motions, before those rows are taken out of it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from growthx.common.communicators import steady

if TYPE_CHECKING:
    from petsc4py import PETSc

    from growthx.common.arrays import Floats, Indices
    from growthx.solvers.problem import Motions, NonlinearProblem

TIGHT = 1e-10  # of the solutions A⁻¹ B: D − Cᵀ A⁻¹ B is a small difference of large numbers


class Bordered:
    """The context of a PETSc PC of type "python" for the whole system.  inner: what solves with A."""

    def __init__(self, inner: PETSc.KSP, problem: NonlinearProblem, snes: PETSc.SNES | None = None) -> None:
        """snes: what picks the rows of unknowns at no bound, where there are bounds."""
        self.inner, self._problem, self._comm = inner, problem, steady(problem.comm)
        self._snes = snes if problem.limits() is not None else None
        self._motions: Motions | None = None
        self._right, self._left = np.empty((problem.owned, 0)), np.empty((problem.owned, 0))
        self._block = np.empty((0, 0))
        self._picked: Indices = np.arange(problem.owned, dtype=np.int32)
        self._followers: Indices = np.empty(0, dtype=np.int32)  # rows of the operator
        self._solved: Floats | None = None  # A⁻¹ B
        self._reduced = np.empty((0, 0))

    def take(self, matrix: PETSc.Mat) -> None:
        """Take the motions out of a tangent as it was assembled at the running iterate (collective)."""
        assert self._problem.following is not None
        motions = self._problem.following.motions()
        motion, product = matrix.createVecs()
        size, count = self._problem.owned, motions.basis.shape[1]
        right, left = np.empty((size, count)), np.empty((size, count))
        for column in range(count):
            motion.array_w[:] = 0.0
            motion.array_w[motions.rows] = motions.basis[:, column]
            matrix.mult(motion, product)
            right[:, column] = product.array_r
            matrix.multTranspose(motion, product)
            left[:, column] = product.array_r
        motion.destroy()
        product.destroy()
        self._block = self._comm.allreduce(motions.basis.T @ right[motions.rows]) + motions.curvature
        right[motions.rows] = left[motions.rows] = 0.0
        self._motions, self._right, self._left, self._solved = motions, right, left, None
        self._followers = motions.rows
        matrix.zeroRowsColumns(matrix.getOwnershipRange()[0] + motions.rows)

    def setUp(self, pc: PETSc.PC) -> None:
        """PETSc calls this for a matrix, which may be one of the rows at no bound."""
        self._solved = None
        if self._snes is None or self._motions is None:
            return
        matrix = pc.getOperators()[0]
        first = self._snes.getJacobian()[0].getOwnershipRange()[0]
        self._picked = self._snes.getVIInactiveSet().getIndices() - first
        self._followers = np.searchsorted(self._picked, self._motions.rows)
        self.inner.setOperators(matrix)
        self.inner.setUp()

    def _reduce(self, b: PETSc.Vec) -> Floats:
        """A⁻¹ B; b is of the right size."""
        side, solution = b.duplicate(), b.duplicate()
        right = self._right[self._picked]
        found = np.empty_like(right)
        kept = self.inner.getTolerances()
        self.inner.setTolerances(rtol=TIGHT)
        for column in range(right.shape[1]):
            side.array_w[:] = right[:, column]
            self.inner.solve(side, solution)
            found[:, column] = solution.array_r if self.inner.getConvergedReason() >= 0 else np.nan
        self.inner.setTolerances(*kept)
        side.destroy()
        solution.destroy()
        self._reduced = self._block - self._comm.allreduce(self._left[self._picked].T @ found)
        return found

    def apply(self, pc: PETSc.PC, b: PETSc.Vec, x: PETSc.Vec) -> None:
        """Solve; PETSc calls this."""
        assert self._motions is not None
        if self._solved is None:
            self._solved = self._reduce(b)
        free = b.duplicate()
        given = np.array(b.array_r)
        felt = self._motions.basis.T @ given[self._followers]
        given[self._followers] = 0.0
        free.array_w[:] = given
        self.inner.solve(free, x)
        alone = np.array(x.array_r) if self.inner.getConvergedReason() >= 0 else np.full_like(given, np.nan)
        free.destroy()
        wanted = self._comm.allreduce(felt - self._left[self._picked].T @ alone)
        moved = self._moved(wanted)
        alone -= self._solved @ moved
        alone[self._followers] = self._motions.basis @ moved
        x.array_w[:] = alone

    def _moved(self, wanted: Floats) -> Floats:
        if not (np.all(np.isfinite(self._reduced)) and np.all(np.isfinite(wanted))):
            return np.full_like(wanted, np.nan)
        try:
            return np.linalg.solve(self._reduced, wanted)
        except np.linalg.LinAlgError:
            return np.full_like(wanted, np.nan)

    def negative_pivots(self, like: PETSc.Vec) -> int:
        """Number of motions in which the rest gives way, beside what A itself has (collective)."""
        if self._solved is None:
            self._solved = self._reduce(like)
        if not np.all(np.isfinite(self._reduced)):
            return 0
        return int(np.count_nonzero(np.linalg.eigvals(self._reduced).real < 0))

    def reset(self, pc: PETSc.PC) -> None:
        """Forget the matrix, where another size of it comes; PETSc calls this."""
        self.inner.reset()
        self._solved = None

    def destroy(self, pc: PETSc.PC) -> None:
        """Free the memory; PETSc calls this."""
        self.inner.destroy()
