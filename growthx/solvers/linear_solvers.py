"""The linear systems of Newton's method: which of PETSc's solvers fits a problem, by its kind and size.

small: a factorisation, Cholesky where the tangent is symmetric – in single precision, which is enough to
steer Newton's method by, see `single_factor` – else LU;
large: Krylov's methods with algebraic multigrid (GAMG), which knows of the rigid motions, for the displacement:
    conjugate gradients   densities eliminated, tangent symmetric
    GMRES                 densities eliminated, tangent not symmetric
    flexible GMRES        nodal densities: a symmetric block Gauss–Seidel step, densities, displacement, densities,

        | K_ρρ       |⁻¹
        | K_uρ  K_uu |

in the plane with a factor of K_uu alone, which is symmetric and much smaller than one of the whole.  K_uu, without what
the densities would add to it by their elimination, does as well there as the condensed tangent of the same mesh: the
two differ by a factor that depends on the law of growth and on nothing else.  With bounds of nodal densities it is
that of the rows at no bound, in space alone; in the plane they keep to a factor.

Where it can be, neither has a matrix of PETSc's: factors are made right from the cells, see `cell_factors` and
`node_factors`.
"""

from __future__ import annotations

import math
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, Any

import dolfinx
import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from growthx.common.communicators import steady
from growthx.fem.sums.cell_sums import can_be_added
from growthx.fem.sums.node_blocks import are_of_nodes
from growthx.solvers import single_factor
from growthx.solvers.cell_factors import CellFactors
from growthx.solvers.node_factors import NodeFactors
from growthx.solvers.single_factor import SingleFactor

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from growthx.common.arrays import Floats, Indices
    from growthx.solvers.problem import Layout, NonlinearProblem

# Unknowns up to which a factorisation is faster, by dimension and degree of the displacement: of a tangent with
# displacements alone, or of all. A factor is kept over many solutions, which cost little with it; in the plane memory
# ends its use.
LARGEST_CONDENSED = {(2, 1): 2_000_000, (2, 2): 2_000_000, (3, 1): 20_000, (3, 2): 100_000}
LARGEST_SINGLE = {(2, 1): 2_000_000, (2, 2): 2_000_000, (3, 1): 150_000, (3, 2): 100_000}  # in single precision
LARGEST_SHARED = 50_000  # … of which each of several ranks makes the same
LARGEST_MONOLITHIC = {(2, 1): 1_500, (2, 2): 1_500, (3, 1): 10_000, (3, 2): 15_000}

# What a new tangent and its factor cost in iterations with an old one, by dimension. Of small systems most of it is the
# assembly; of large ones in space the factor, whose operations grow faster than its entries (`WORK` of them for each).
RENEWAL, RENEWAL_OF_MULTIGRID, WORK = {2: 7.0, 3: 12.0}, 6.0, 70.0

# Digits of the residual for each iteration at best, where a factor leaves out what couples load cases, or a block step
# what couples displacement and density: no new one brings them nearer (the femur in space: 0.7 to 0.8 once it is close,
# however new the factor is; the plate with nodal densities: 0.7 to 1).
PACE_OF_CASES = 0.7

# ‖A x − b‖₂ ≤ this · ‖b‖₂ ends iterative solutions: Newton's method with a kept factor gains no more from a better one.
TOLERANCE = 1e-2
TOLERANCE_MONOLITHIC = 1e-1
TOLERANCE_BOUNDED = 1e-4  # of nodal densities with bounds, where each iteration has a tangent of its own

_SWEEPS = 3  # on the block of nodal densities, which is close to a mass matrix
_RESTART = 60

# Of GAMG, written out since PETSc's defaults have changed more than once: smoothed aggregation, on the finest level of
# neighbours of neighbours, where couplings weaker than the threshold do not count; aggregates are kept as long as the
# matrix has the same entries.
_AGGREGATION: dict[str, object] = {
    "pc_gamg_type": "agg",
    "pc_gamg_agg_nsmooths": 1,
    "pc_gamg_aggressive_coarsening": 1,
    "pc_gamg_aggressive_square_graph": True,
    "pc_gamg_threshold": 0.02,
    "pc_gamg_reuse_interpolation": True,
}
# One symmetric sweep of Gauss–Seidel's on each level. Chebyshev's need the largest eigenvalue, and where stiff cells
# are beside soft ones ten steps find too small a one: the preconditioner is then not definite, and nothing is solved.
_MULTIGRID: dict[str, object] = {
    "mg_levels_ksp_type": "richardson",
    "mg_levels_ksp_max_it": 1,
    "mg_levels_pc_type": "sor",
}


@dataclass(frozen=True)
class Renewal:
    """What a new tangent and its factor are worth.

    cost: in iterations of Newton's method with old ones.  pace: digits of the residual that an iteration with them
    gains at best; infinite where they are those of Newton's method.
    """

    cost: float
    pace: float = math.inf


class _Course:
    """What PETSc calls after each iterative solution: counts its iterations, and lets what is held rest.

    Rows of held unknowns are their own, but multigrid moves them with their neighbours; Newton's method has no residual
    there that would bring them back.
    """

    def __init__(self, held: Indices) -> None:
        self._held = held
        self.solutions = self.iterations = 0

    def __call__(self, ksp: PETSc.KSP, b: PETSc.Vec, x: PETSc.Vec) -> None:
        x.array_w[self._held] = 0.0
        self.solutions += 1
        self.iterations += ksp.getIterationNumber()


class _Unbound:
    """The context of a PETSc PC of type "python" for the rows of unknowns at no bound, which SNES picks: a field split.

    Which these are changes from one iteration to the next, so the split is made anew with each matrix.
    """

    def __init__(self, snes: PETSc.SNES, problem: NonlinearProblem, first: int) -> None:
        """first: row of the whole matrix that is this rank's first."""
        self._snes, self._problem, self._first = snes, problem, first
        self._ksp: PETSc.KSP | None = None
        self._held = np.empty(0, dtype=np.int32)

    def setUp(self, pc: PETSc.PC) -> None:
        """Make the split of the matrix as it is now; PETSc calls this."""
        self.destroy(pc)
        matrix = pc.getOperators()[0]
        picked = self._snes.getVIInactiveSet().getIndices() - self._first
        rows = np.full(self._problem.owned, -1, dtype=np.int32)
        rows[picked] = matrix.getOwnershipRange()[0] + np.arange(len(picked))
        held = rows[self._problem.layout.held]
        self._held = held[held >= 0] - matrix.getOwnershipRange()[0]
        self._ksp = ksp = PETSc.KSP().create(pc.comm)
        ksp.setOptionsPrefix(pc.getOptionsPrefix())
        ksp.setOperators(matrix)
        ksp.setType(PETSc.KSP.Type.PREONLY)
        _split(ksp, self._problem, rows, multigrid=True)
        with _chosen_options(ksp):
            ksp.setUp()
            ksp.setUpOnBlocks()

    def apply(self, pc: PETSc.PC, b: PETSc.Vec, x: PETSc.Vec) -> None:
        """X ≈ A⁻¹ b, where what is held rests; PETSc calls this."""
        assert self._ksp is not None
        self._ksp.getPC().apply(b, x)
        x.array_w[self._held] = 0.0

    def destroy(self, pc: PETSc.PC) -> None:
        """Free the memory; PETSc calls this."""
        if self._ksp is not None:
            self._ksp.destroy()
        self._ksp = None


class LinearSolver:
    """A KSP that fits a problem's tangent; what PETSc options have made of it shows in `description` and `direct`."""

    def __init__(self, ksp: PETSc.KSP, dim: int, course: _Course | None = None, *, of_parts: bool = False) -> None:
        """dim: of the body.  course: of an iterative one.

        of_parts: whether SNES gives the KSP parts of the matrix, as it does where unknowns have bounds.
        """
        self._ksp, self._dim, self._course, self._of_parts = ksp, dim, course, of_parts
        self.negative_pivots = 0  # of the symmetric matrix that was factorised last, as far as known
        self._replaced: list[PETSc.KSP] = []  # where MUMPS does what CHOLMOD could not

    @property
    def direct(self) -> bool:
        """Whether a solution is exact but for round-off."""
        return self._ksp.getType() == PETSc.KSP.Type.PREONLY and self._ksp.getPC().getType() in _FACTORS

    @property
    def description(self) -> str:
        """The solver in the log's words, as "Cholesky (CHOLMOD)"."""
        return _describe(self._ksp)

    @property
    def mean_iterations(self) -> float:
        """Iterations of the iterative solutions so far, the mean; NaN if there was none."""
        course = self._course
        return course.iterations / course.solutions if course and course.solutions else float("nan")

    @property
    def renewal(self) -> Renewal:
        """What a new tangent and its factor, or preconditioner, cost and bring.

        Of the order that was measured, but from what does not change from run to run.
        """
        parts = _parts(self._ksp)
        if any(part.getPC().getType() not in (*_FACTORS, PETSc.PC.Type.PYTHON, PETSc.PC.Type.JACOBI) for part in parts):
            return Renewal(RENEWAL_OF_MULTIGRID)
        contexts = [context for part in parts if (context := _single(part)) is not None]
        apart = any(getattr(context, "leaves_out_coupling", False) for context in contexts)
        cost = max([RENEWAL[self._dim], *(context.work / WORK for context in contexts)])
        return Renewal(cost, PACE_OF_CASES if apart else math.inf)

    def refresh(self) -> None:
        """Factorise, or make the preconditioner of, the matrix as it is now; call it when the tangent was assembled.

        A failure shows when the system is solved, or raises PETSc.Error where PETSc knows no better.
        """
        if self._of_parts:
            return
        self._leave_single_precision()
        if self._replaced and self.negative_pivots == 0:
            self._factorise_by(PETSc.Mat.SolverType.CHOLMOD)
        try:
            self._set_up()
        except PETSc.Error as error:
            # CHOLMOD knows positive definite matrices only; beyond an instability a tangent need not be one.
            self._replaced = _factorised_by_cholmod(self._ksp)
            if error.ierr != _NOT_DEFINITE or not self._replaced:
                raise
            self._factorise_by(PETSc.Mat.SolverType.MUMPS)
            self._set_up()
        if self._leave_single_precision():
            self.refresh()
            return
        self.negative_pivots = _negative_pivots(self._ksp.getPC()) if self.direct else 0

    def _leave_single_precision(self) -> bool:
        """Go on in double precision from where a factor in single precision is poor; whether that is here."""
        found = [(part, context) for part in _parts(self._ksp) if (context := _single(part)) is not None]
        if not any(context.is_poor for _, context in found):
            return False
        for part, _ in found:
            operators = part.getOperators()
            part.getPC().reset()
            _choose_factor(part.getPC(), symmetric=True)
            part.setOperators(*operators)
        return True

    def _factorise_by(self, package: str) -> None:
        for ksp in self._replaced:
            operators = ksp.getOperators()
            ksp.getPC().reset()  # forgets them
            ksp.setOperators(*operators)
            ksp.getPC().setFactorSolverType(package)

    def _set_up(self) -> None:
        ksp = self._ksp
        ksp.setOperators(*ksp.getOperators())  # else PETSc looks at the matrix again only when it solves
        with _chosen_options(ksp):
            ksp.setUp()
            ksp.setUpOnBlocks()


def _parts(ksp: PETSc.KSP) -> list[PETSc.KSP]:
    """A KSP, or those of its parts."""
    pc = ksp.getPC()
    if pc.getType() == PETSc.PC.Type.FIELDSPLIT:
        return [found for part in pc.getFieldSplitSubKSP() for found in _parts(part)]
    return [ksp]


def _single(ksp: PETSc.KSP) -> SingleFactor | CellFactors | NodeFactors | None:
    """What factorises for a KSP in single precision, if anything does."""
    pc = ksp.getPC()
    context = pc.getPythonContext() if pc.getType() == PETSc.PC.Type.PYTHON else None
    return context if isinstance(context, SingleFactor | CellFactors | NodeFactors) else None


def _factorised_by_cholmod(ksp: PETSc.KSP) -> list[PETSc.KSP]:
    """A KSP, or its parts, for which PETSc's CHOLMOD factorises."""
    pcs = ((part, part.getPC()) for part in _parts(ksp))
    cholmod = PETSc.Mat.SolverType.CHOLMOD
    return [part for part, pc in pcs if pc.getType() in _FACTORS and pc.getFactorSolverType() == cholmod]


@contextmanager
def _chosen_options(ksp: PETSc.KSP) -> Iterator[None]:
    """Within, PETSc finds what it is told of a solver's parts by options alone; those that the user has set win."""
    set_here = []
    chosen = [(part, _STRICT) for part in _factorised_by_cholmod(ksp)]
    chosen += [(part, _MULTIGRID) for part in _parts(ksp) if part.getPC().getType() == PETSc.PC.Type.GAMG]
    for part, values in chosen:
        options = PETSc.Options(part.getOptionsPrefix())
        for name, value in values.items():
            if not options.hasName(name):
                options[name] = value
                set_here.append((options, name))
    try:
        yield
    finally:
        for options, name in set_here:
            options.delValue(name)


def _negative_pivots(pc: PETSc.PC) -> int:
    """Of a Cholesky factor: none where CHOLMOD has made it, and what MUMPS counts by the way."""
    counted = pc.getType() == PETSc.PC.Type.CHOLESKY and pc.getFactorSolverType() == PETSc.Mat.SolverType.MUMPS
    return int(pc.getFactorMatrix().getMumpsInfog(12)) if counted else 0


def cell_factors(problem: NonlinearProblem) -> CellFactors | None:
    """Factors made right from the cells, if they fit the problem (collective)."""
    layout = problem.layout
    if not (problem.symmetric and layout.condensed and can_be_added(layout.space)) or problem.limits() is not None:
        return None
    library = _single_precision(steady(problem.comm), layout.dofs // len(layout.parts), layout, len(layout.parts))
    return CellFactors(library, problem) if library and problem.own_tangents else None


def node_factors(problem: NonlinearProblem) -> NodeFactors | None:
    """A block step whose factors are made right from the cells, if it fits the problem (collective)."""
    layout, whole, cases = problem.layout, problem.unknown.function_space, len(problem.layout.parts)
    if layout.condensed or not layout.symmetric_parts or problem.limits() is not None or steady(problem.comm).size > 1:
        return None
    if not are_of_nodes(layout.space, whole, cases) or layout.dofs <= LARGEST_MONOLITHIC[layout.dim, layout.degree]:
        return None
    library = _single_precision(steady(problem.comm), whole.dofmap.index_map.size_global // (cases + 1), layout, cases)
    if library is None or not all(hasattr(form, "by_nodes") and form.by_nodes() for form in problem.tangents):
        return None
    return NodeFactors(library, problem)


def use_cells(
    ksp: PETSc.KSP, problem: NonlinearProblem, matrix: PETSc.Mat, cells: CellFactors | NodeFactors
) -> LinearSolver:
    """Solve by factors made right from the cells.  matrix: of the right size, is not looked at."""
    ksp.setOperators(matrix)
    ksp.setType(PETSc.KSP.Type.PREONLY)
    ksp.getPC().setType(PETSc.PC.Type.PYTHON)
    ksp.getPC().setPythonContext(cells)
    return LinearSolver(ksp, problem.layout.dim)


def set_up(
    ksp: PETSc.KSP,
    problem: NonlinearProblem,
    matrix: PETSc.Mat,
    *,
    direct: bool = False,
    single: bool = True,
    snes: PETSc.SNES | None = None,
) -> LinearSolver:
    """Choose the solver of a problem's tangent; PETSc options are to be applied to the KSP afterwards (collective).

    ksp: with its prefix.  matrix: made from `problem.coupling`, not necessarily assembled yet.
    direct: factorise at any size, as a full Newton's method does.  single: whether single precision may do.
    snes: what picks the rows of unknowns at no bound, where there are bounds.
    """
    ksp.setOperators(matrix)
    if problem.symmetric:
        matrix.setOption(PETSc.Mat.Option.SYMMETRIC, True)
        matrix.setOption(PETSc.Mat.Option.SYMMETRY_ETERNAL, True)
    layout = problem.layout
    # Bounds of unknowns take rows out of the matrix: what solves the rest is to be told which.
    bounded = problem.limits() is not None
    single = single and problem.symmetric and not (direct or bounded)
    if single and _use_single_precision(ksp.getPC(), layout.dofs, layout):
        ksp.setType(PETSc.KSP.Type.PREONLY)
        return LinearSolver(ksp, layout.dim)
    limit = (LARGEST_CONDENSED if layout.condensed else LARGEST_MONOLITHIC)[layout.dim, layout.degree]
    if direct or layout.dofs <= limit or (bounded and (layout.dim == 2 or snes is None)):
        _factorise(ksp, problem.symmetric)
        return LinearSolver(ksp, layout.dim, of_parts=bounded)
    _iterate(ksp, problem)
    if bounded:
        ksp.setTolerances(rtol=TOLERANCE_BOUNDED)
        ksp.getPC().setType(PETSc.PC.Type.PYTHON)
        ksp.getPC().setPythonContext(_Unbound(snes, problem, matrix.getOwnershipRange()[0]))
        course = _Course(np.empty(0, dtype=np.int32))
        ksp.setPostSolve(course)
        return LinearSolver(ksp, layout.dim, course, of_parts=True)
    course = _Course(layout.held)
    ksp.setPostSolve(course)
    if layout.condensed and len(layout.parts) == 1:
        matrix.setNearNullSpace(_rigid_motions(problem, layout.parts[0]))
        _use_multigrid(ksp.getPC())
    else:
        _split(ksp, problem, matrix.getOwnershipRange()[0] + np.arange(problem.owned, dtype=np.int32))
    return LinearSolver(ksp, layout.dim, course)


def _factorise(ksp: PETSc.KSP, symmetric: bool) -> None:
    ksp.setType(PETSc.KSP.Type.PREONLY)
    _choose_factor(ksp.getPC(), symmetric)


def _use_single_precision(pc: PETSc.PC, size: int, layout: Layout) -> bool:
    """Factorise a symmetric matrix of that size in single precision, where that pays and memory allows; whether so."""
    library = _single_precision(steady(pc.comm.tompi4py()), size, layout)
    if library is None:
        return False
    pc.setType(PETSc.PC.Type.PYTHON)
    pc.setPythonContext(SingleFactor(library, layout.dim))
    return True


def _single_precision(comm: Any, size: int, layout: Layout, count: int = 1) -> Any:
    """What makes a number of factors of a size, if that pays and memory allows; of one, each rank makes the same."""
    fits = count * size >= single_factor.SMALLEST and size <= LARGEST_SINGLE[layout.dim, layout.degree]
    fits = fits and (comm.size == 1 or count > 1 or size <= LARGEST_SHARED)
    factors = comm.size if count == 1 else count
    if not comm.allreduce(fits and single_factor.fits_into_memory(size, layout.dim, factors), MPI.LAND):
        return None
    return single_factor.load(comm)


def _choose_factor(pc: PETSc.PC, symmetric: bool) -> None:
    pc.setType(PETSc.PC.Type.CHOLESKY if symmetric else PETSc.PC.Type.LU)
    # CHOLMOD knows no more than one rank, and is not in every PETSc (in Debian's by its own name).
    there = any(map(PETSc.Sys.hasExternalPackage, ("cholmod", "suitesparse")))
    cholmod = symmetric and pc.comm.size == 1 and there
    pc.setFactorSolverType(PETSc.Mat.SolverType.CHOLMOD if cholmod else PETSc.Mat.SolverType.MUMPS)


def _iterate(ksp: PETSc.KSP, problem: NonlinearProblem) -> None:
    """Krylov's method, which ends by the residual itself, as Newton's does."""
    condensed = problem.layout.condensed
    ksp.setTolerances(rtol=TOLERANCE if condensed else TOLERANCE_MONOLITHIC, max_it=500)
    if problem.symmetric:
        ksp.setType(PETSc.KSP.Type.CG)
        ksp.setNormType(PETSc.KSP.NormType.UNPRECONDITIONED)
    else:
        # The flexible method keeps what the preconditioner has made: where one iteration does, nothing is done twice.
        ksp.setType(PETSc.KSP.Type.GMRES if condensed else PETSc.KSP.Type.FGMRES)
        ksp.setGMRESRestart(_RESTART)
        ksp.setPCSide(PETSc.PC.Side.RIGHT)


def _use_multigrid(pc: PETSc.PC) -> None:
    pc.setType(PETSc.PC.Type.GAMG)
    options, set_here = PETSc.Options(pc.getOptionsPrefix()), []
    for name, value in _AGGREGATION.items():
        if not options.hasName(name):  # there is no other way to set most of them from Python
            options[name] = value
            set_here.append(name)
    pc.setFromOptions()
    for name in set_here:
        options.delValue(name)


def _split(ksp: PETSc.KSP, problem: NonlinearProblem, places: Indices, *, multigrid: bool = False) -> None:
    """Solve for the densities, if they are unknowns, and for the displacement of each load case in turn.

    places: row of the matrix that each owned unknown has, below zero if it has none.
    multigrid: for displacements of any size.
    """
    pc, layout = ksp.getPC(), problem.layout
    pc.setType(PETSc.PC.Type.FIELDSPLIT)
    # Also where the matrix is not symmetric: with densities last, the balance of mass is left with hardly any residual.
    pc.setFieldSplitType(PETSc.PC.CompositeType.SYMMETRIC_MULTIPLICATIVE)
    displacements = [_owned(problem, part) for part in layout.parts]
    if not layout.condensed:
        rest = np.setdiff1d(np.arange(problem.owned, dtype=np.int32), np.concatenate(displacements))
        densities = places[rest]
        pc.setFieldSplitIS(("density", PETSc.IS().createGeneral(densities[densities >= 0], comm=problem.comm)))
        _use_sweeps(pc.getFieldSplitSubKSP()[0])
    for number, (part, dofs) in enumerate(zip(layout.parts, displacements, strict=True)):
        rows = PETSc.IS().createGeneral(places[dofs], comm=problem.comm)  # no displacement has a bound
        rows.setBlockSize(layout.dim)
        rows.compose("nearnullspace", _rigid_motions(problem, part))
        name = "displacement" if len(displacements) == 1 else f"displacement_{number + 1}"
        pc.setFieldSplitIS((name, rows))
        part_ksp = pc.getFieldSplitSubKSP()[-1]
        if multigrid:
            part_ksp.setType(PETSc.KSP.Type.PREONLY)
            _use_multigrid(part_ksp.getPC())
        else:
            _approximate(part_ksp, rows.getSize(), layout)


def _use_sweeps(ksp: PETSc.KSP) -> None:
    """A fixed number of sweeps on the densities."""
    ksp.setType(PETSc.KSP.Type.CHEBYSHEV)
    ksp.setTolerances(max_it=_SWEEPS)
    ksp.setNormType(PETSc.KSP.NormType.NONE)
    ksp.getPC().setType(PETSc.PC.Type.JACOBI)


def _approximate(ksp: PETSc.KSP, size: int, layout: Layout) -> None:
    """One application of what fits a displacement of so many unknowns."""
    ksp.setType(PETSc.KSP.Type.PREONLY)
    pc = ksp.getPC()
    if layout.symmetric_parts and _use_single_precision(pc, size, layout):
        return
    if size > LARGEST_CONDENSED[layout.dim, layout.degree]:
        _use_multigrid(pc)
    else:
        _choose_factor(pc, symmetric=layout.symmetric_parts)


def _owned(problem: NonlinearProblem, part: Any) -> Indices:
    """The owned unknowns of a load case's displacement, rising: node by node."""
    dofs = np.arange(len(problem.unknown.x.array), dtype=np.int32)[part]
    return np.sort(dofs[dofs < problem.owned])


def _rigid_motions(problem: NonlinearProblem, part: Any) -> PETSc.NullSpace:
    """Translations and linearised rotations of a load case's displacement, orthonormal, of the unknowns it owns."""
    moved, dofs = dolfinx.fem.Function(problem.layout.space), _owned(problem, part)
    motions: list[PETSc.Vec] = []
    for velocity in _velocities(problem.layout.dim):
        moved.interpolate(velocity)  # unknowns may be moments (serendipity), which have no coordinates
        whole = np.empty_like(problem.unknown.x.array)
        whole[part] = moved.x.array
        motion = PETSc.Vec().createMPI((len(dofs), None), comm=problem.comm)
        motion.array_w[:] = whole[dofs]
        for other in motions:
            motion.axpy(-other.dot(motion), other)
        motion.normalize()
        motions.append(motion)
    return PETSc.NullSpace().create(vectors=motions, comm=problem.comm)


def _velocities(dim: int) -> Sequence[Callable[[Floats], Floats]]:
    """Of rigid motions, at points of shape (3, points): matrices for x ↦ W x + v."""
    units = np.eye(dim, 3)
    translations = [lambda x, unit=unit: np.outer(unit[:dim], np.ones(x.shape[1])) for unit in np.eye(dim)]
    spins = [np.outer(units[i], units[j]) - np.outer(units[j], units[i]) for i, j in combinations(range(dim), 2)]
    return translations + [lambda x, spin=spin: spin[:dim] @ x for spin in spins]


def _describe(ksp: PETSc.KSP) -> str:
    pc = ksp.getPC()
    if (context := _single(ksp)) is not None:
        return _METHODS.get(ksp.getType(), f"{ksp.getType()} with ") + context.name
    if pc.getType() == PETSc.PC.Type.PYTHON and isinstance(pc.getPythonContext(), _Unbound):
        return _METHODS.get(ksp.getType(), f"{ksp.getType()} with ") + "field split of what is at no bound (GAMG)"
    name = _PRECONDITIONERS.get(pc.getType(), str(pc.getType()))
    if pc.getType() in _FACTORS:
        name += f" ({str(pc.getFactorSolverType() or 'petsc').upper()})"
    elif pc.getType() == PETSc.PC.Type.FIELDSPLIT:
        parts = (f"{_field(part)}: {_describe(part)}" for part in pc.getFieldSplitSubKSP())
        name = f"field split ({', '.join(parts)})"
    return _METHODS.get(ksp.getType(), f"{ksp.getType()} with ") + name


def _field(ksp: PETSc.KSP) -> str:
    """The name of a part, from its prefix as in growthx_fieldsplit_density_."""
    return str(ksp.getOptionsPrefix()).rstrip("_").rpartition("fieldsplit_")[2]


_FACTORS = (PETSc.PC.Type.CHOLESKY, PETSc.PC.Type.LU)
_PRECONDITIONERS = {
    PETSc.PC.Type.CHOLESKY: "Cholesky",
    PETSc.PC.Type.LU: "LU",
    PETSc.PC.Type.GAMG: "GAMG",
    PETSc.PC.Type.HYPRE: "BoomerAMG",
    PETSc.PC.Type.JACOBI: "Jacobi",
}
_METHODS = {
    PETSc.KSP.Type.PREONLY: "",
    PETSc.KSP.Type.CG: "conjugate gradients with ",
    PETSc.KSP.Type.GMRES: "GMRES with ",
    PETSc.KSP.Type.FGMRES: "flexible GMRES with ",
    PETSc.KSP.Type.CHEBYSHEV: "Chebyshev with ",
}
_STRICT: dict[str, object] = {"mat_cholmod_final_asis": 0, "mat_cholmod_final_ll": 1, "mat_cholmod_print": 0}
_NOT_DEFINITE = 81  # PETSC_ERR_MAT_CH_ZRPVT
