"""What Newton's method, its linear solvers and whoever needs a tangent may ask of a system: it names no physics."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from collections.abc import Sequence

    import dolfinx
    from mpi4py import MPI

    from growthx.common.arrays import Floats, Indices


@dataclass(frozen=True)
class Layout:
    """Of which fields the unknowns of a system are, for the choice of a linear solver.

    dim, degree: number of space dimensions, degree of the displacement.  dofs: number of unknowns on all ranks.
    condensed: whether displacements are all there is.
    space: of one displacement.  parts: where in the unknown's `x.array` each displacement is, indices or a slice.
    held: owned unknowns that hold no equation, rising.  symmetric_parts: whether the blocks of the displacements are.
    """

    dim: int
    degree: int
    dofs: int
    condensed: bool
    space: dolfinx.fem.FunctionSpace
    parts: tuple[Any, ...]
    held: Indices
    symmetric_parts: bool


@dataclass(frozen=True)
class Motions:
    """The few motions that some unknowns follow instead of moving each for itself, where an iterate is.

    rows: these unknowns, of those this rank owns.  basis: the motions, orthonormal over all ranks, (rows, motions).
    curvature: how their equations change, (motions, motions), as the motions turn under the forces there.
    """

    rows: Indices
    basis: Floats
    curvature: Floats


class Following(Protocol):
    """Unknowns that follow few motions instead of moving each for itself."""

    def motions(self) -> Motions:
        """Those at the iterate whose balance was last looked at (collective)."""

    def settled(self, values: Floats) -> Floats:
        """The iterate of owned unknowns, near to such values, in which they follow their motions (collective)."""


class NonlinearProblem(Protocol):
    """A system R(x) = 0 with its tangent, on the ranks of a communicator."""

    @property
    def comm(self) -> MPI.Intracomm:
        """The ranks that share it."""

    @property
    def unknown(self) -> dolfinx.fem.Function:
        """The running iterate x, to be read; its first `owned` entries are what is solved for."""

    @property
    def owned(self) -> int:
        """Number of unknowns this rank owns."""

    @property
    def symmetric(self) -> bool:
        """Whether the tangent is."""

    @property
    def must_be_stable(self) -> bool:
        """Whether a solution counts only where a symmetric tangent is positive definite (collective)."""

    @property
    def layout(self) -> Layout:
        """Of which fields the unknowns are."""

    @property
    def coupling(self) -> dolfinx.fem.Form:
        """A bilinear form whose matrix has room for the tangent."""

    @property
    def tangents(self) -> Sequence[dolfinx.fem.Form]:
        """Bilinear forms whose sum is ∂R/∂x."""

    @property
    def own_tangents(self) -> Sequence[Sequence[dolfinx.fem.Form]]:
        """Of each displacement, forms of cells with a `kernel` and `kernel_cells` whose sum is its own block of ∂R/∂x.

        Each of `layout.space`, and symmetric; none if the blocks are not.
        """

    @property
    def conditions(self) -> Sequence[dolfinx.fem.DirichletBC]:
        """What is held: these unknowns hold no equation."""

    @property
    def following(self) -> Following | None:
        """Unknowns that follow few motions; None if there are none.

        `conditions` do not hold them, `layout.held` has them, and their rows of R hold basis · basisᵀ R.
        """

    def start_from(self, values: Floats) -> None:
        """Make the first entries of the running iterate these."""

    def force_scale(self) -> float:
        """What ‖R‖₂ is measured against."""

    def out_of_balance(self) -> Floats:
        """R at the running iterate, shape (owned unknowns,); NaN if it is not admissible (collective)."""

    def limits(self) -> tuple[Floats, Floats] | None:
        """Lowest and highest value of each owned unknown, if any must keep to some."""

    def largest_share(self, position: Floats, step: Floats) -> float:
        """Largest share, up to one, of a step from a position that may be taken (owned unknowns; collective)."""
