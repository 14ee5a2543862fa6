"""What a file of a mesh holds, as it stands there: points, elements of all kinds, named groups, values.

Each format fills this in, without a look at what can be made of it: that is for `assembly`, alike for all of them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from growthx.common.arrays import Floats, Indices

NO_NODE = -1  # among the nodes of an element one that the file does not tell, among those of a facet one of no cell

# Corners of a shape in DOLFINx's order (row by row) by their places in the order of gmsh, VTK, Abaqus, Nastran and
# FEBio, which goes round.
AROUND = {
    "point": (0,),
    "interval": (0, 1),
    "triangle": (0, 1, 2),
    "quadrilateral": (0, 1, 3, 2),
    "tetrahedron": (0, 1, 2, 3),
    "hexahedron": (0, 1, 3, 2, 4, 5, 7, 6),
    "prism": (0, 1, 2, 3, 4, 5),
    "pyramid": (0, 1, 3, 2, 4),
}
DIMENSIONS = {
    "point": 0,
    "interval": 1,
    "triangle": 2,
    "quadrilateral": 2,
    "tetrahedron": 3,
    "hexahedron": 3,
    "prism": 3,
    "pyramid": 3,
}


@dataclass(frozen=True)
class Elements:
    """Elements of one kind.

    shape: of the cells, one of `DIMENSIONS`.
    nodes: rows in the content's points, (elements, nodes): corners in the order that goes round (see `AROUND`), after
    them those of elements of higher order.
    """

    shape: str
    nodes: Indices

    @property
    def corners(self) -> Indices:
        """Nodes of the corners in DOLFINx's order, (elements, corners)."""
        return self.nodes[:, list(AROUND[self.shape])]

    @property
    def curved(self) -> bool:
        """Whether they have more nodes than corners: elements of second or higher order."""
        return self.nodes.shape[1] > len(AROUND[self.shape])


@dataclass(frozen=True)
class Content:
    """A file's points, elements, groups and values, on one rank.

    kind: format and version in words, such as "gmsh mesh 4.1, binary".
    points: coordinates of all nodes, in use or not, (nodes, 3), in the file's unit of length.
    elements: of all dimensions, each kind in the order of the file; numbered through from 0 in this order, so that
    those of the second kind begin after those of the first.
    groups: numbers of the elements in each named group, of any dimension.
    node_sets: rows in `points` of each named set of nodes.
    facet_sets: nodes of facets (sides of elements) of each named set, (facets, corners), in any order of corners.
    values: one for each element by the name of the data, (elements,); NaN where there is none.
    notices: sentences on what was left out or changed in reading.
    """

    kind: str
    points: Floats
    elements: tuple[Elements, ...]
    groups: Mapping[str, Indices] = field(default_factory=dict)
    node_sets: Mapping[str, Indices] = field(default_factory=dict)
    facet_sets: Mapping[str, Indices] = field(default_factory=dict)
    values: Mapping[str, Floats] = field(default_factory=dict)
    notices: tuple[str, ...] = ()

    @property
    def starts(self) -> Indices:
        """Number of the first element of each kind, and of all elements at the end, (kinds + 1,)."""
        return np.cumsum([0, *(len(kind.nodes) for kind in self.elements)])


@dataclass(frozen=True)
class Origin:
    """Where cells and nodes stood in the file or the arrays that they come from, and what they had there.

    cells: of each cell its place among the file's cells, in the order of the file, (cells,); nodes: of each node,
    (nodes,), −1 for a node that was not there.
    cell_count, node_count: number of cells and nodes there, in use or not.
    values: one for each cell by the name of the data, (cells,); NaN where there is none.
    node_sets: numbers of the nodes of cells of each named set, in the order of the file, the same on all ranks.
    """

    cells: Indices
    cell_count: int
    nodes: Indices
    node_count: int
    values: Mapping[str, Floats] = field(default_factory=dict)
    node_sets: Mapping[str, Indices] = field(default_factory=dict)
