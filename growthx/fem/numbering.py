"""The degrees of freedom of a space in an order that does not depend on the number of ranks."""

from __future__ import annotations

from typing import TYPE_CHECKING

import dolfinx
import numpy as np

from growthx.common.communicators import steady

if TYPE_CHECKING:
    from growthx.common.arrays import Floats, Indices


class Numbering:
    """Degrees of freedom in the order in which they are met on a walk through the cells.

    The cells come in the order in which they were given to DOLFINx, and those of a cell in the order of its element:
    both are the same however the cells are spread over ranks.
    """

    def __init__(self, space: dolfinx.fem.FunctionSpace) -> None:
        """Of a space (collective); rank 0 keeps the order."""
        self._comm = steady(space.mesh.comm)
        self._map, self._block = space.dofmap.index_map, space.dofmap.index_map_bs
        self._owned = self._map.size_local
        topology = space.mesh.topology
        count = topology.index_map(topology.dim).size_local
        dofs = space.dofmap.list[:count]
        nodes = self._map.local_to_global(dofs.ravel()).reshape(dofs.shape)
        cells = self._comm.gather(topology.original_cell_index[:count])
        gathered = self._comm.gather(nodes)
        self._ranges = self._comm.gather(self._owned)
        self._order: Indices | None = None
        if cells is not None and gathered is not None:
            walk = np.concatenate(gathered)[np.argsort(np.concatenate(cells))].ravel()
            _, first = np.unique(walk, return_index=True)
            self._order = walk[np.sort(first)]

    def gather(self, values: Floats) -> Floats | None:
        """The values of all ranks in that order on rank 0, (degrees of freedom,), None elsewhere (collective).

        values: of this rank, as `x.array`.
        """
        parts = self._comm.gather(values[: self._owned * self._block])
        if parts is None:
            return None
        return np.concatenate(parts).reshape(-1, self._block)[self._order].ravel()

    def scatter(self, values: Floats | None) -> Floats:
        """This rank's part of values that rank 0 has in that order, as `x.array`, ghosts included (collective)."""
        parts = None
        if values is not None and self._order is not None and self._ranges is not None:
            whole = np.empty((len(self._order), self._block))
            whole[self._order] = values.reshape(-1, self._block)
            parts = np.split(whole, np.cumsum(self._ranges)[:-1])
        own = dolfinx.la.vector(self._map, self._block)
        own.array[: self._owned * self._block] = self._comm.scatter(parts).ravel()
        own.scatter_forward()
        return own.array.copy()
