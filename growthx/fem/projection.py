"""Functions of shared nodes that are nearest to values in cells, without a matrix: products of cells, summed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from growthx.fem.assembly import sum_cells

if TYPE_CHECKING:
    from collections.abc import Sequence

    import dolfinx
    from mpi4py import MPI

    from growthx.common.arrays import Floats

MOST_ITERATIONS = 500


class NodalProjection:
    """The projection in L² onto a scalar space, of as many cells as are heard.

    known: the nodes of those, (local nodes,).  right: ∫ N f, as in `x.array`.
    """

    def __init__(self, space: dolfinx.fem.FunctionSpace, masses: Floats, right: Floats, comm: MPI.Intracomm) -> None:
        """masses, right: ∫ N N and ∫ N f of each owned cell, (cells, nodes, nodes) and (cells, nodes); zero in those
        that are not heard (collective).
        """
        self._space, self._masses, self._comm = space, masses, comm
        self._rows = space.dofmap.list[: len(masses)]
        self._owned = space.dofmap.index_map.size_local
        self.right = self.sum(right)
        self._diagonal = self.sum(np.einsum("cii->ci", masses))
        self.known = self._diagonal > 0

    def sum(self, of_cells: Floats) -> Floats:
        """What the cells say of each of their nodes, (cells, nodes), summed (collective)."""
        return sum_cells(self._space, of_cells[:, :, np.newaxis])[:, 0]

    def nearest(self, first: float) -> Floats:
        """The function, as in `x.array`, by conjugate gradients from a number; zero at other nodes (collective)."""
        return self._solved(self.right, first)

    def keeping(self, values: Floats, volumes: Sequence[Floats], totals: Floats) -> Floats:
        """The function nearest to another, of those with given integrals over some parts (collective).

        volumes: ∫ N over each part, as in `x.array`.  totals: the integrals.
        """
        answers = [self._solved(each, 0.0) for each in volumes]
        matrix = np.array([[self._dot(each, answer) for answer in answers] for each in volumes])
        missing = totals - np.array([self._dot(each, values) for each in volumes])
        shares = np.linalg.lstsq(matrix, missing, rcond=None)[0]  # parts without nodes of their own are not independent
        return values + sum(share * answer for share, answer in zip(shares, answers, strict=True))

    def _solved(self, right: Floats, first: float) -> Floats:
        scale = np.where(self.known, self._diagonal, 1.0)
        values = np.where(self.known, first, 0.0)
        residual = right - self._product(values)
        direction = residual / scale
        size, whole = self._dot(residual, direction), self._dot(right, right / scale)
        for _ in range(MOST_ITERATIONS):
            if size <= 1e-31 * whole:
                break
            product = self._product(direction)
            length = size / self._dot(direction, product)
            values, residual = values + length * direction, residual - length * product
            new = self._dot(residual, residual / scale)
            direction, size = residual / scale + new / size * direction, new
        return values

    def _dot(self, one: Floats, other: Floats) -> float:
        return float(self._comm.allreduce(float(one[: self._owned] @ other[: self._owned])))

    def _product(self, values: Floats) -> Floats:
        return self.sum(np.einsum("cij,cj->ci", self._masses, values[self._rows]))
