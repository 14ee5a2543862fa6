"""A system's tangent as a matrix, and the signs of its eigenvalues."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from dolfinx.fem import petsc
from mpi4py import MPI
from petsc4py import PETSc

from growthx.common.communicators import steady
from growthx.fem import implicit
from growthx.solvers import linear_solvers
from growthx.solvers.bordered import Bordered

if TYPE_CHECKING:
    from collections.abc import Callable

    from growthx.common.arrays import Floats, Indices
    from growthx.solvers.cell_factors import CellFactors
    from growthx.solvers.linear_solvers import LinearSolver
    from growthx.solvers.node_factors import NodeFactors
    from growthx.solvers.problem import NonlinearProblem

# Of the softest direction: share of the iterate by which the tangent's product with it is found as a difference,
# iterations of Newton's method, times the quotient, from one look to the next (a third of them with a new factor),
# steps of the first look, and at most of each; what is small, what no longer falls, and what is no new direction.
DIFFERENCE, WAIT, FIRST_STEPS, MOST_STEPS = 1e-6, 60, 3, 12
CLOSE_TO_ZERO, SETTLED, ALIKE = 0.25, 0.05, 1e-10


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
        self._border: Bordered | None = None
        self._cells: CellFactors | NodeFactors | None = None
        if not (full or options or problem.following is not None):
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
        if self._problem.following is not None:
            self._border, ksp = self._use_border(ksp)
        self.solver = linear_solvers.set_up(
            ksp, self._problem, self.matrix, direct=full, single=single, snes=self._snes
        )
        if self._border is not None:
            ksp.setFromOptions()

    def _use_border(self, ksp: PETSc.KSP) -> tuple[Bordered, PETSc.KSP]:
        """Have a KSP solve by a border, and another one by what is to be chosen, and told by the user's options."""
        inner = PETSc.KSP().create(self._problem.comm)
        inner.setOptionsPrefix(self._snes.getOptionsPrefix())
        border = Bordered(inner, self._problem, self._snes)
        ksp.setOptionsPrefix(f"{self._snes.getOptionsPrefix()}border_")
        ksp.setOperators(self.matrix)
        ksp.setType(PETSc.KSP.Type.PREONLY)
        ksp.getPC().setType(PETSc.PC.Type.PYTHON)
        ksp.getPC().setPythonContext(border)
        return border, inner

    @property
    def leaves_out_coupling(self) -> bool:
        """Whether what was factorised is not the whole tangent, but a block of each load case."""
        return self._cells is not None and self._cells.leaves_out_coupling

    @property
    def negative_pivots(self) -> int:
        """Of the symmetric tangent as it was factorised last, as far as known (collective)."""
        found = self.solver.negative_pivots
        return found if self._border is None else found + self._border.negative_pivots(self._snes.getFunction()[0])

    def renew(self, function: Callable[..., None]) -> None:
        """Assemble it at the running iterate, and have its solver ready.

        function: of SNES for it, which is to be told where another matrix takes over.
        """
        if self._cells is not None:
            if not self._cells.is_poor and self._cells.assemble():
                return
            self.use_whole(function)  # single precision is not enough here
        assemble_tangent(self._problem, self.matrix)
        if self._border is not None:
            self._border.take(self.matrix)
        self.solver.refresh()

    def use_whole(self, function: Callable[..., None], *, direct: bool = False) -> None:
        """Have the whole of it, in double precision, in place of factors made right from the cells (collective).

        function: of SNES for it.  direct: factorised at any size.
        """
        self._asked_for, self._cells = self.matrix, None  # SNES may still look at it
        self._snes.getKSP().reset()
        self._use_matrix(full=direct, single=False)
        self._snes.setJacobian(function, self.matrix)

    def destroy(self) -> None:
        """Free the memory (collective)."""
        self.matrix.destroy()


class Softest:
    """The direction y in which a symmetric tangent K is smallest beside the factors K̃ that steer: yᵀK y / yᵀK̃ y.

    Factors of blocks tell nothing of the signs of the whole: where load cases share a density, what stiffens it in one
    may soften it in another.  So one direction is followed from solution to solution, by conjugate gradients of that
    quotient, each at the cost of a residual and a solution: where the body comes to give way it falls below zero.

    Knyazev, Toward the optimal preconditioned eigensolver, SIAM J. Sci. Comput. 23 (2001) 517–541.
    """

    def __init__(self, snes: PETSc.SNES, residual: Callable[[Floats], Floats], held: Indices) -> None:
        """residual: of the owned unknowns, its owned entries (collective).  held: unknowns that hold no equation."""
        self._ksp, self._residual, self._held = snes.getKSP(), residual, held
        self._comm = steady(snes.comm.tompi4py())
        self._side, self._found = snes.getSolution().duplicate(), snes.getSolution().duplicate()
        self._followed: tuple[Floats, Floats] | None = None  # y, K̃ y
        self._quotient, self._waited, self._renewed = math.inf, 0, False

    def is_indefinite(self, position: Floats, residual: Floats, iterations: int, *, renewed: bool) -> bool:
        """Whether the quotient is below zero at a solution, as far as known (collective).

        residual: of the solution.  iterations: that led to it, `renewed`: by a new factor.  It is looked at the more
        often the smaller it is.
        """
        self._waited, self._renewed = self._waited + iterations, self._renewed or renewed
        wait = WAIT * self._quotient / (3 if self._renewed else 1)
        due = self._followed is None or self._quotient < CLOSE_TO_ZERO or self._waited >= wait
        size = self._norm(position)
        if not due or iterations == 0 or size == 0.0:
            return False
        steps = FIRST_STEPS if self._followed is None else int(self._renewed)
        self._quotient, self._waited, self._renewed = self._follow(position, residual, size, steps), 0, False
        self._residual(position)
        return self._quotient < 0.0

    def _follow(self, position: Floats, residual: Floats, size: float, steps: int) -> float:
        """The quotient after some steps, or more of them where it falls.  size: norm of the position."""

        def stiffness(y: Floats) -> Floats:
            share = DIFFERENCE * size / self._norm(y)
            return np.asarray((self._residual(position + share * y) - residual) / share)

        y, force = self._first() if self._followed is None else self._followed
        if steps > 0:
            y = self._solved(force)
        basis = [np.array([y, stiffness(y), force])]  # y, K y, K̃ y
        quotient = self._quotient
        for step in range(MOST_STEPS):
            shares, lowest = self._lowest(basis)
            if not math.isfinite(lowest):  # beyond what is admissible: what has been found so far holds
                break
            best, rest = _combined(basis, shares), basis[1:]
            falls, quotient = quotient - lowest > SETTLED * max(abs(lowest), SETTLED), lowest
            self._followed = best[0], best[2]
            if step >= steps and not (falls and (step == 0 or quotient < CLOSE_TO_ZERO)):
                break
            force = best[1] - quotient * best[2]
            y = self._solved(force)
            basis = [best, np.array([y, stiffness(y), force])]
            if rest:
                basis.append(_combined(rest, shares[1:]))
        return quotient

    def _first(self) -> tuple[Floats, Floats]:
        force = np.random.default_rng(self._comm.rank).normal(size=self._side.local_size)
        force[self._held] = 0.0
        return force, force

    def _solved(self, force: Floats) -> Floats:
        self._side.array_w[:] = force
        self._ksp.solve(self._side, self._found)
        return np.array(self._found.array_r)

    def _lowest(self, basis: list[Floats]) -> tuple[Floats, float]:
        """Shares of a basis that make the quotient lowest, and that; NaN where it is not a number."""
        products = np.array([[[y @ other[kind] for other in basis] for y, *_ in basis] for kind in (1, 2)])
        self._comm.Allreduce(MPI.IN_PLACE, products)
        if not np.all(np.isfinite(products)):
            return np.zeros(len(basis)), math.nan
        scale = 1.0 / np.sqrt(np.abs(np.diagonal(products[1])))
        stiff, steering = (products + products.transpose(0, 2, 1)) / 2 * np.outer(scale, scale)
        lengths, axes = np.linalg.eigh(steering)
        apart = lengths > ALIKE * lengths[-1]
        axes = axes[:, apart] / np.sqrt(lengths[apart])
        quotients, shares = np.linalg.eigh(axes.T @ stiff @ axes)
        return np.asarray(scale * (axes @ shares[:, 0])), float(quotients[0])

    def _norm(self, x: Floats) -> float:
        return float(np.sqrt(self._comm.allreduce(float(x @ x))))

    def destroy(self) -> None:
        """Free the memory (collective)."""
        self._side.destroy()
        self._found.destroy()


def _combined(basis: list[Floats], shares: Floats) -> Floats:
    return np.asarray(sum(share * vectors for share, vectors in zip(shares, basis, strict=True)))


def negative_pivots(problem: NonlinearProblem) -> int:
    """Number of negative eigenvalues of the symmetric tangent of a problem in its state, by Sylvester's law."""
    matrix = petsc.create_matrix(problem.coupling)
    assemble_tangent(problem, matrix)
    matrix.setOption(PETSc.Mat.Option.SYMMETRIC, True)
    ksp = PETSc.KSP().create(problem.comm)
    ksp.setOperators(matrix)
    ksp.setType(PETSc.KSP.Type.PREONLY)
    border = None if problem.following is None else Bordered(ksp, problem)
    if border is not None:
        border.take(matrix)
    solver = ksp.getPC()
    solver.setType("cholesky")
    solver.setFactorSolverType("mumps")
    solver.setFactorSetUpSolverType()
    solver.getFactorMatrix().setMumpsIcntl(24, 1)  # without looking for null pivots MUMPS does not count
    solver.setUp()
    negative = int(solver.getFactorMatrix().getInertia()[0])
    if border is not None:
        like = matrix.createVecRight()
        negative += border.negative_pivots(like)
        like.destroy()
    ksp.destroy()
    matrix.destroy()
    return negative
