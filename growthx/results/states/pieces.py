"""Cells in pieces for files: the points that their pieces share, also with those of other cells, and how they move."""

from __future__ import annotations

from typing import TYPE_CHECKING

import basix.ufl
import numpy as np
from scipy.sparse import csr_array

from growthx.meshing.content import AROUND
from growthx.meshing.sampling import positions, reference_corners
from growthx.results.states.grid import TYPES, Grid, in_space

if TYPE_CHECKING:
    from growthx.common.arrays import Floats, Indices
    from growthx.discretisation.discretisation import Discretisation
    from growthx.meshing.mesh import Mesh
    from growthx.post.subcells import Subcells

DIGITS = 1 << 40  # of a weight
NOTHING = 1e-14  # round-off of a weight, which are of the order of one


class Pieces:
    """The pieces of every owned cell as a grid, and the displacement of its points."""

    def __init__(self, problem: Discretisation, parts: Subcells) -> None:
        mesh = problem.scene.mesh
        self._displacement, self._parts = problem.displacement, parts
        first, numbers = joined(mesh, parts.X)
        around = parts.pieces[:, list(AROUND[parts.shape])]
        cells = numbers[:, around].reshape(-1, around.shape[1])
        points = positions(mesh, parts.X).reshape(-1, 3)[first]
        self.grid = Grid(points, cells, TYPES[parts.shape], np.arange(len(points)))
        space = self._displacement.function_space
        rows = space.ufl_element().sub_elements[0].tabulate(0, parts.X)[0][first % len(parts.X)]
        nodes = space.dofmap.list[first // len(parts.X)]
        starts = nodes.shape[1] * np.arange(len(first) + 1)
        shape = len(first), len(self._displacement.x.array) // mesh.dim
        rows[np.abs(rows) < NOTHING] = 0.0
        self._shares = csr_array((rows.ravel(), nodes.ravel(), starts), shape=shape)
        self._shares.eliminate_zeros()  # most points are corners, or on edges, of which few nodes say anything

    def displacement(self) -> dict[str, Floats]:
        """That of the state as it is."""
        u = self._displacement.x.array.reshape(-1, self._displacement.function_space.dofmap.bs)
        return {"displacement": in_space(self._shares @ u)}

    def of_points(self, values: Floats) -> Floats:
        """Values at the integration points of each owned cell, (cells, points, …), for each piece, (pieces, …)."""
        return np.ascontiguousarray(values[:, self._parts.points]).reshape(-1, *values.shape[2:])


def joined(mesh: Mesh, X: Floats) -> tuple[Indices, Indices]:
    """Points X of the reference cell, (points, dim), of all owned cells, with those of neighbours that are the same.

    Two are, where they have the same weights on the same corners of the mesh.
    Returns the first one of each, as cell · points + point, shape (different points,), and the number that each has
    among these, shape (cells, points).
    """
    domain, cells = mesh.domain, len(mesh.owned_cells)
    domain.topology.create_connectivity(mesh.dim, 0)
    corners = np.asarray(domain.topology.connectivity(mesh.dim, 0).array, dtype=np.int64)
    corners = corners.reshape(-1, len(reference_corners(mesh.cell_name)))[:cells]
    weights: Floats = np.asarray(basix.ufl.element("Lagrange", mesh.cell_name, 1).tabulate(0, X))[0]
    codes = np.rint(weights * DIGITS).astype(np.int64)
    first, numbers = np.empty(0, dtype=np.int64), np.empty((cells, len(X)), dtype=np.int64)
    support = (np.abs(codes) > 1).sum(axis=1)  # corners that have a weight
    for count in np.unique(support):
        (points,) = np.nonzero(support == count)
        heavy = np.argsort(np.abs(codes[points]) <= 1, axis=1, kind="stable")[:, :count]
        nodes, shares = corners[:, heavy], np.take_along_axis(codes[points], heavy, axis=1)
        order = np.argsort(nodes, axis=2)
        keys = np.concatenate(
            [np.take_along_axis(each, order, axis=2) for each in (nodes, np.broadcast_to(shares, nodes.shape))], axis=2
        )
        own, number = _different(keys.reshape(-1, 2 * count))
        numbers[:, points] = len(first) + number.reshape(cells, len(points))
        places = len(X) * np.arange(cells)[:, np.newaxis] + points
        first = np.concatenate([first, places.ravel()[own]])
    return first, numbers


def _different(rows: Indices) -> tuple[Indices, Indices]:
    """The first of each row among equal ones, and the number of each row among these.

    One number is sorted far faster than a row: rows of the same one are compared, so that none is taken for another.
    """
    mixed = np.zeros(len(rows), dtype=np.uint64)
    for column in rows.T:
        mixed = (mixed ^ column.astype(np.uint64)) * np.uint64(0x9E3779B97F4A7C15)
        mixed ^= mixed >> np.uint64(29)
    _, first, number = np.unique(mixed, return_index=True, return_inverse=True)
    if not np.array_equal(rows[first[number]], rows):
        _, first, number = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    return first, number.ravel()
