"""The corners of cells: whether a cell is convex, so that its map from the reference cell can be inverted."""

from __future__ import annotations

from typing import TYPE_CHECKING

import basix
import numpy as np

from growthx.common.errors import raise_on_all
from growthx.common.words import place_in_words
from growthx.fem import compat
from growthx.fem.cells import SIMPLICES
from growthx.meshing.sampling import reference_corners

if TYPE_CHECKING:
    from growthx.common.arrays import Floats, Marks
    from growthx.meshing.mesh import Mesh

FLAT = 1e-9  # sine of a corner, below which it counts as flat


def corner_sines(shape: str, corners: Floats) -> Floats:
    """Determinant of the unit edge vectors at each corner, (cells, corners), of one sign in a convex cell.

    corners: in DOLFINx's order, (cells, corners, dim).
    """
    count, dim = corners.shape[1:]
    tensor = shape in ("quadrilateral", "hexahedron")
    sines = []
    for corner in range(count if tensor else 1):
        # In DOLFINx's order the bits of a corner's number are its reference coordinates.
        ends = [corner ^ (1 << axis) for axis in range(dim)] if tensor else list(range(1, dim + 1))
        with np.errstate(all="ignore"):  # a node may be nowhere: what comes of it is not a number
            edges = corners[:, ends] - corners[:, [corner]]
            lengths = np.linalg.norm(edges, axis=2, keepdims=True)
            unit = np.divide(edges, lengths, out=np.zeros_like(edges), where=lengths > 0.0)
            sines.append((-1) ** corner.bit_count() * np.linalg.det(unit))
    return np.stack(sines, axis=1)


def volumes(shape: str, corners: Floats) -> Floats:
    """Areas or volumes of cells, positive, (cells,); corners: in DOLFINx's order, (cells, corners, dim)."""
    cell = basix.CellType[shape]
    element = basix.create_element(basix.ElementFamily.P, cell, 1)
    X, weights = (np.array(part) for part in basix.make_quadrature(cell, 2 if shape in SIMPLICES else 3))
    gradients = np.array(element.tabulate(1, X))[1:, :, :, 0]  # (dim, points, corners)
    jacobian = np.einsum("dpn,cni->cpid", gradients, corners, optimize=True)
    found: Floats = np.abs(np.linalg.det(jacobian) @ weights)
    return found


MEASURES = {
    "triangle": "twice the radius of the inscribed over that of the circumscribed circle",
    "tetrahedron": "three times the radius of the inscribed over that of the circumscribed sphere",
    "quadrilateral": "least sine of a corner (scaled Jacobian)",
    "hexahedron": "least scaled Jacobian of a corner",
}


def qualities(shape: str, corners: Floats) -> Floats:
    """How good cells are, from 0, of no volume, to 1, by the measure of their shape in `MEASURES`, (cells,).

    Of quadrilaterals and hexahedra that are not convex it is below 0.  corners: in DOLFINx's order.
    """
    if shape not in SIMPLICES:
        sines = corner_sines(shape, corners)
        turns = np.sign(sines.sum(axis=1))
        return np.asarray((sines * turns[:, np.newaxis]).min(axis=1))
    sizes = volumes(shape, corners)

    def length(a: int, b: int) -> Floats:
        return np.asarray(np.linalg.norm(corners[:, a] - corners[:, b], axis=1))

    if shape == "triangle":
        a, b, c = length(0, 1), length(1, 2), length(2, 0)
        inner, outer = 2 * sizes / (a + b + c), a * b * c / np.maximum(4 * sizes, 1e-300)
        return np.asarray(2 * inner / np.maximum(outer, 1e-300))
    products = [length(0, 1) * length(2, 3), length(0, 2) * length(1, 3), length(0, 3) * length(1, 2)]
    half = sum(products) / 2
    of_products = half * (half - products[0]) * (half - products[1]) * (half - products[2])
    outer = np.sqrt(np.maximum(of_products, 0.0)) / np.maximum(6 * sizes, 1e-300)
    faces = [corners[:, list(face)] for face in ((0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3))]
    areas = sum(np.linalg.norm(facet_vectors(face), axis=1) for face in faces)
    return np.asarray(9 * sizes / areas / np.maximum(outer, 1e-300))


def facet_vectors(corners: Floats) -> Floats:
    """A vector across each facet, as long as its area, or as its length in the plane, (facets, dim).

    corners: in DOLFINx's order, (facets, corners, dim).  Of a warped quadrilateral it is the mean.
    """
    if corners.shape[2] == 2:
        along = corners[:, 1] - corners[:, 0]
        return np.column_stack([along[:, 1], -along[:, 0]])
    if corners.shape[1] == 3:
        return np.asarray(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2)
    return np.asarray(np.cross(corners[:, 3] - corners[:, 0], corners[:, 2] - corners[:, 1]) / 2)  # of the diagonals


def not_convex(sines: Floats, turns: Floats) -> Marks:
    """Which cells have a corner that is flat or turns the other way; turns: the right way of each cell, 1 or −1."""
    return np.asarray(~((sines * turns[:, np.newaxis]).min(axis=1, initial=np.inf) > FLAT))


def complaint(count: int, cells: int, first: Floats, of: object) -> str:
    """What to say of so many cells that are not convex; first: corners of one of them, (corners, dim)."""
    return (
        f"{count} of the {cells} cells of {of} are inverted or have a corner of 180 degrees or more, "
        f"the first at {place_in_words(first.mean(axis=0))}: convex cells would be right"
    )


def check_cells(mesh: Mesh) -> None:
    """Raise InputError, on all ranks, if a cell has no volume, is folded or has no finite corners (collective).

    Simplices may be numbered in either sense: of two that overlap, nothing is seen here.
    """
    nodes = compat.geometry_nodes(mesh.domain)[: len(mesh.owned_cells)]
    corners = mesh.domain.geometry.x[nodes[:, : len(reference_corners(mesh.cell_name))], : mesh.dim]
    sines = corner_sines(mesh.cell_name, corners)
    bad = np.flatnonzero(not_convex(sines, np.sign(sines.sum(axis=1))))
    count = mesh.comm.allreduce(len(bad))
    problem = complaint(count, mesh.cell_count, corners[bad[0]], "the mesh") if len(bad) else ""
    raise_on_all(mesh.comm, problem)
