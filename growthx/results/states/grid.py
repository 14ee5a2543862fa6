"""The cells of a rank as VTK has them, and what a state says of them."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import dolfinx.plot
import numpy as np

from growthx.common.arrays import selection

if TYPE_CHECKING:
    from collections.abc import Mapping

    import dolfinx

    from growthx.common.arrays import Floats, Indices, Selection

TYPES = {"interval": 3, "triangle": 5, "quadrilateral": 9, "tetrahedron": 10, "hexahedron": 12}  # VTK's numbers


@dataclass(frozen=True)
class Grid:
    """The owned cells of this rank.

    points: (points, 3).  cells: rows of points in VTK's order, (cells, points of a cell).  kind: VTK's number for them.
    nodes: where the points are among the nodes of the space that the grid was made of, (points,).
    """

    points: Floats
    cells: Indices
    kind: int
    nodes: Indices

    @cached_property
    def _selection(self) -> Selection:
        """The nodes, as a selection that costs no copy where it can be one."""
        return selection(self.nodes)

    @staticmethod
    def of_space(space: dolfinx.fem.FunctionSpace) -> Grid:
        """The cells with the nodes of a Lagrange space, continuous or not, as their points."""
        topology, kinds, places = dolfinx.plot.vtk_mesh(space)
        rows = topology.reshape(-1, space.dofmap.dof_layout.num_dofs + 1)[:, 1:]
        nodes, cells = np.unique(rows, return_inverse=True)
        kind = int(kinds[0]) if len(kinds) else 0  # a rank without cells
        return Grid(places[nodes], cells.reshape(rows.shape), kind, nodes)

    def values_of(self, function: dolfinx.fem.Function) -> Floats:
        """A function of the grid's space at its points, (points,), or (points, 3) of a vector, padded with zeros."""
        size = function.function_space.dofmap.bs
        values = function.x.array.reshape(-1, size)[self._selection]
        return values[:, 0] if size == 1 else in_space(values)


@dataclass(frozen=True)
class State:
    """What is known at a time: by name, values at the points of a grid and in its cells.

    Each of shape (points or cells,), or (points or cells, 3).
    beside: at points, what a series of several files has in them, for another series to show, and does not show itself.
    """

    at_points: Mapping[str, Floats]
    in_cells: Mapping[str, Floats] = field(default_factory=dict)
    beside: Mapping[str, Floats] = field(default_factory=dict)


def in_space(vectors: Floats) -> Floats:
    """Vectors of a plane, (…, 2), as VTK has them, with a third component of zero; those in space as they are."""
    return vectors if vectors.shape[1] == 3 else np.pad(vectors, ((0, 0), (0, 3 - vectors.shape[1])))
