"""Cells cut into pieces, each the part of one integration point: for pictures and files of exact values."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

import basix
import numpy as np

from growthx.common.errors import InputError
from growthx.fem.cells import SIMPLICES, equal_sided
from growthx.meshing import refinement
from growthx.meshing.sampling import reference_corners

if TYPE_CHECKING:
    from growthx.common.arrays import Floats, Indices

_TENSOR = {1: "interval", 2: "quadrilateral", 3: "hexahedron"}


@dataclass(frozen=True)
class Subcells:
    """A reference cell in pieces.

    shape: of the pieces.  X: their corners in the reference cell, (corners, dim).  pieces: rows of X in DOLFINx's
    order, (pieces, corners of a piece).  points: the integration point each piece belongs to, (pieces,).
    """

    shape: str
    X: Floats
    pieces: Indices
    points: Indices


def subcells(cell_name: str, points: Floats) -> Subcells:
    """Pieces of a cell, one for each of its integration points, (points, dim).

    Tensor cells are cut half-way between Gauss points, simplices with a point near each corner at the medians.
    Raises InputError for other sets of points.
    """
    if len(points) == 1:
        corners = reference_corners(cell_name)
        return Subcells(cell_name, corners, np.arange(len(corners))[np.newaxis], np.array([0]))
    shape, X, pieces = _around_corners(points) if cell_name in SIMPLICES else _grid(_ticks(points), points.shape[1])
    cell = basix.CellType[cell_name]
    middles = X[pieces].mean(axis=1)
    apart = equal_sided(cell, middles)[:, np.newaxis] - equal_sided(cell, points)
    owner = np.linalg.norm(apart, axis=2).argmin(axis=1)
    if not np.array_equal(np.sort(owner), np.arange(len(points))):
        raise InputError(
            f"a {cell_name} with {len(points)} integration points cannot be cut into one piece for each: Gauss points "
            "of tensor cells, or one near each corner of a simplex, would be right"
        )
    return Subcells(shape, X, pieces, owner)


def around_points(cell_name: str, points: Floats) -> Subcells:
    """A piece of a cell for each of its integration points, (points, dim), whatever set of points they are.

    Those of `subcells`, or else, of a simplex with other points, a small copy of the cell about each of them.
    """
    try:
        return subcells(cell_name, points)
    except InputError:
        corners = reference_corners(cell_name)
        inside = equal_sided(basix.CellType[cell_name], points).min()  # barycentric: the nearest that one is to a side
        X = points[:, np.newaxis] + inside * len(corners) * (corners - corners.mean(axis=0))
        numbers = np.arange(len(points) * len(corners)).reshape(len(points), -1)
        return Subcells(cell_name, X.reshape(-1, points.shape[1]), numbers, np.arange(len(points)))


def uniform(cell_name: str, parts: int) -> Subcells:
    """A triangle or quadrilateral in equal pieces, `parts` along each edge; every piece is of point 0."""
    weights, pieces = refinement.lattice(cell_name, parts)
    corners = reference_corners(cell_name)
    X = weights[:, : len(corners)] @ corners / parts**2
    return Subcells(cell_name, X, pieces, np.zeros(len(pieces), dtype=np.int64))


def _ticks(points: Floats) -> Floats:
    """Where a tensor cell is cut in each direction."""
    gauss = np.unique(points[:, 0].round(12))
    return np.concatenate([[0.0], (gauss[1:] + gauss[:-1]) / 2, [1.0]])


def _grid(ticks: Floats, dim: int) -> tuple[str, Floats, Indices]:
    """A tensor cell cut at the same ticks in all directions, the first of which runs fastest."""
    k = len(ticks)
    X = np.stack(np.meshgrid(*[ticks] * dim, indexing="ij"), axis=-1).reshape(-1, dim)[:, ::-1]
    numbers = np.arange(k**dim).reshape([k] * dim)
    first = numbers[(slice(-1),) * dim].ravel()
    corners = numbers[(slice(2),) * dim].ravel()  # bits of a corner's number are its coordinates, as in DOLFINx
    return _TENSOR[dim], X, np.add.outer(first, corners)


def _around_corners(points: Floats) -> tuple[str, Floats, Indices]:
    """A simplex cut at its medians: around each corner a tensor cell, whose corners are means of the simplex's."""
    dim = points.shape[1]
    vertices = np.vstack([np.zeros(dim), np.eye(dim)])
    X = []
    for vertex in range(dim + 1):
        others = [(vertex + 1 + i) % (dim + 1) for i in range(dim)]
        edges = vertices[others] - vertices[vertex]
        if np.linalg.det(edges) < 0:
            others[:2] = others[1::-1]
        for bits in product((False, True), repeat=dim):
            subset = [vertex] + [other for other, bit in zip(others, bits[::-1], strict=True) if bit]
            X.append(vertices[subset].mean(axis=0))
    return _TENSOR[dim], np.array(X), np.arange(len(X)).reshape(dim + 1, -1)
