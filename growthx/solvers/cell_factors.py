"""Factors in single precision made right from the cells: of each displacement's own block of the tangent.

Where densities are eliminated, a cell couples the displacements of the load cases by what their mean energy does to its
density.  That is little beside their stiffness: without it Newton's method with a kept factor takes about as many
iterations, while one factor of all cases has nine times the entries of three of one case each.  No matrix of PETSc's is
needed: cells add up to half a matrix, see `fem.sums.cell_sums`, and that is what is factorised.

On several ranks each has the factors of some load cases; of one case alone each makes the same.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI

from growthx.common.communicators import steady
from growthx.fem.sums.cell_sums import CellSums
from growthx.solvers.single_factor import NAME, Factor, gathered

if TYPE_CHECKING:
    from petsc4py import PETSc

    from growthx.common.arrays import Floats, Indices, Marks
    from growthx.solvers.problem import NonlinearProblem


class CellFactors:
    """The context of a PETSc PC of type "python" that needs no matrix.

    work: operations of a factorisation for each entry of a factor; zero before the first one.
    leaves_out_coupling: whether there are load cases that densities couple.
    """

    def __init__(self, library: Any, problem: NonlinearProblem) -> None:
        """library: see `single_factor.load` (collective)."""
        self._library, self._problem, self._comm = library, problem, steady(problem.comm)
        space, parts = problem.layout.space, problem.layout.parts
        index_map = space.dofmap.index_map
        self._cells = CellSums(space)
        self._numbers = np.array(self._comm.allgather(index_map.size_local * space.dofmap.bs))  # of unknowns
        unknowns = np.arange(len(problem.unknown.x.array))
        self._places = [unknowns[part][: self._numbers[self._comm.rank]] for part in parts]
        first = index_map.local_range[0] * space.dofmap.bs
        self._own = slice(first, first + self._numbers[self._comm.rank])
        self._exchange = _Exchange(self._comm, self._cells.pairs)
        self._owners = [None if len(parts) == 1 else part % self._comm.size for part in range(len(parts))]
        self._factors: dict[int, Factor] = {}
        self._values: dict[int, Floats] = {}  # until the first solutions were looked at
        self.work = 0.0
        self.leaves_out_coupling = len(parts) > 1
        self.name = NAME if len(parts) == 1 else f"{NAME} of each load case"

    @property
    def is_poor(self) -> bool:
        """Whether factors in double precision would do better (collective)."""
        return bool(self._comm.allreduce(any(factor.is_poor for factor in self._factors.values()), MPI.LOR))

    def assemble(self) -> bool:
        """Factorise the blocks as they are now; whether all of them have a factor (collective)."""
        tangents = self._problem.own_tangents
        for part, (forms, owner) in enumerate(zip(tangents, self._owners, strict=True)):
            values = self._exchange.total(self._cells(forms), owner)
            if values is not None:
                self._values[part] = values
        if not self._factors:
            self._analyse()
        made = [self._factors[part].factorise(values) for part, values in self._values.items()]
        self.work = self._comm.allreduce(max((factor.work for factor in self._factors.values()), default=0.0), MPI.MAX)
        return bool(self._comm.allreduce(all(made), MPI.LAND))

    def _analyse(self) -> None:
        for part, held in enumerate(self._held()):
            if part in self._values:
                dim = self._problem.layout.dim
                self._factors[part] = Factor.of_blocks(self._library, self._exchange.pairs, held, dim)

    def _held(self) -> list[Marks]:
        """Of each displacement, which of its unknowns hold no equation, on all ranks."""
        held = self._problem.layout.held
        return [gathered(self._comm, np.isin(places, held), self._numbers) for places in self._places]

    def apply(self, pc: PETSc.PC, b: PETSc.Vec, x: PETSc.Vec) -> None:
        """X ≈ A⁻¹ b; PETSc calls this."""
        given, found = b.array_r, x.array_w
        sides = {}
        for part, (places, owner) in enumerate(zip(self._places, self._owners, strict=True)):
            side = self._to(owner, given[places])
            if side is not None:
                sides[part] = side
        solutions = {part: self._solve(part, side) for part, side in sides.items()}
        self._values.clear()
        for part, (places, owner) in enumerate(zip(self._places, self._owners, strict=True)):
            found[places] = self._from(owner, solutions.get(part), len(places))

    def _solve(self, part: int, side: Floats) -> Floats:
        factor, values = self._factors[part], self._values.get(part)
        return factor.solve(side, lambda x: factor.times(np.asarray(values), x))

    def _to(self, owner: int | None, ours: Floats) -> Floats | None:
        """A vector of all ranks on its owner, None on the others; of nobody's, on all."""
        if owner is None or self._comm.size == 1:
            return np.asarray(gathered(self._comm, ours, self._numbers))
        whole = np.empty(self._numbers.sum()) if self._comm.rank == owner else None
        self._comm.Gatherv(ours, None if whole is None else [whole, self._numbers], root=owner)
        return whole

    def _from(self, owner: int | None, whole: Floats | None, count: int) -> Floats:
        """This rank's part of what its owner has."""
        if owner is None or self._comm.size == 1:
            assert whole is not None
            return whole[self._own]
        ours = np.empty(count)
        self._comm.Scatterv(None if whole is None else [whole, self._numbers], ours, root=owner)
        return ours

    def destroy(self, pc: PETSc.PC) -> None:
        """Free the memory; PETSc calls this."""
        for factor in self._factors.values():
            factor.destroy()


class _Exchange:
    """Sums of what the ranks' cells add up to.  pairs: of all ranks' blocks, as in `CellSums`."""

    def __init__(self, comm: MPI.Intracomm, pairs: Indices) -> None:
        self._comm, self.pairs = comm, pairs
        self._counts = np.array(comm.allgather(len(pairs)))
        self._places: list[Indices] = []  # of each rank's blocks among all
        if comm.size > 1:
            all_pairs = gathered(comm, pairs.ravel(), 2 * self._counts).reshape(-1, 2)
            number = all_pairs.max() + 1  # one key is sorted faster than two
            keys, places = np.unique(all_pairs[:, 0] * number + all_pairs[:, 1], return_inverse=True)
            self.pairs = np.column_stack([keys // number, keys % number])
            self._places = np.split(places, np.cumsum(self._counts)[:-1])

    def total(self, values: Floats, owner: int | None) -> Floats | None:
        """Blocks of all ranks, (blocks, block, block), on their owner, None on the others; of nobody's, on all."""
        if self._comm.size == 1:
            return values
        entries = values[0].size
        parts: Any = None
        if owner is None:
            parts = gathered(self._comm, values.ravel(), entries * self._counts)
        else:
            if self._comm.rank == owner:
                parts = np.empty(entries * self._counts.sum())
            self._comm.Gatherv(
                values.ravel(), [parts, entries * self._counts] if parts is not None else None, root=owner
            )
        if parts is None:
            return None
        whole, start = np.zeros((len(self.pairs), entries)), 0
        for places, count in zip(self._places, self._counts, strict=True):
            whole[places] += parts[start : start + entries * count].reshape(-1, entries)
            start += entries * count
        return whole
