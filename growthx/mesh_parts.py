"""A whole mesh in arrays on one rank: checked, split uniformly, and distributed over the ranks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import basix
import basix.ufl
import dolfinx
import numpy as np
import ufl
from dolfinx.io.utils import distribute_entity_data

from growthx.arrays import Floats, Indices
from growthx.corners import complaint, corner_sines, not_convex
from growthx.errors import InputError
from growthx.mesh import Mesh

if TYPE_CHECKING:
    from pathlib import Path

    from mpi4py import MPI


MOST_CELLS = 1e8  # that anybody means


@dataclass(frozen=True)
class Parts:
    """A whole mesh in arrays, before its distribution over the ranks.

    shape: name of the cells' shape
    points: coordinates of the nodes, (nodes, dim), in the file's unit of length
    cells: nodes of the cells in DOLFINx's order, (cells, corners)
    boundaries: nodes of the facets of each named boundary, (facets, corners of a facet)
    regions: rows in `cells` of each named region, (cells of the region,)
    """

    shape: str
    points: Floats
    cells: Indices
    boundaries: Mapping[str, Indices]
    regions: Mapping[str, Indices]

    @property
    def dim(self) -> int:
        """Number of space dimensions."""
        return self.points.shape[1]


def check_facets(path: Path, name: str, facets: Indices, shape: str, cells: Indices) -> None:
    """Refuse a boundary without facets or with facets that are on no cell: they would be lost without a word."""
    if not len(facets):
        raise InputError(f"the physical group '{name}' of {path} has no elements: a meshed group would be right")
    dim = len(basix.topology(basix.CellType[shape])) - 1
    sides = cells[:, basix.topology(basix.CellType[shape])[dim - 1]].reshape(-1, facets.shape[1])
    near = np.unique(np.sort(sides[np.isin(sides, facets).all(axis=1)]), axis=0)
    if len(np.unique(np.concatenate([near, np.sort(facets)]), axis=0)) > len(near):
        raise InputError(
            f"the physical group '{name}' of {path} is not made of sides of cells: "
            "curves (of surfaces) or surfaces (of volumes) that bound a cell group would be right"
        )


def check_corners(path: Path, shape: str, corners: Floats, entities: Indices) -> None:
    """Refuse cells with a flat or re-entrant corner and cells turned over; corners: (cells, corners, dim)."""
    sines = corner_sines(shape, corners)
    # A surface drawn clockwise is no error: what counts is that all cells of one entity turn the same way.
    turns = np.sign(np.bincount(entities, weights=np.sign(sines).sum(axis=1)))[entities]
    bad = np.flatnonzero(not_convex(sines, turns))
    if len(bad):
        raise InputError(complaint(len(bad), len(corners), corners[bad[0]], path))


def split(parts: Parts, refine: int, path: str | Path) -> Parts:
    """Split every cell into refine x refine and the boundaries with them; old nodes keep their coordinates exactly."""
    if refine == 1:
        return parts
    if parts.dim != 2:
        raise InputError(f"refine = {refine} works on two-dimensional meshes only, and {path} has {parts.shape}s")
    if len(parts.cells) * refine**2 > MOST_CELLS:
        raise InputError(
            f"refine = {refine} makes {len(parts.cells)} cells of {path} more than {MOST_CELLS:g}, too many"
        )
    weights, pieces = lattice(parts.shape, refine)
    side_weights, side_pieces = lattice("interval", refine)
    keys = [_mean_keys(parts.cells, weights)]
    keys += [_mean_keys(lines, side_weights) for lines in parts.boundaries.values()]
    # Two lattice points are one node if they are the same weighted mean of the same old nodes.
    means, numbers = np.unique(np.concatenate(keys), axis=0, return_inverse=True)
    old, share = means[:, :4], means[:, 4:] / refine**2
    points = np.einsum("nc,ncd->nd", share, parts.points[old])
    blocks = np.split(numbers.reshape(-1), np.cumsum([len(key) for key in keys])[:-1])
    cells = blocks[0].reshape(len(parts.cells), -1)[:, pieces].reshape(-1, parts.cells.shape[1])
    boundaries = {
        name: block.reshape(-1, refine + 1)[:, side_pieces].reshape(-1, 2)
        for name, block in zip(parts.boundaries, blocks[1:], strict=True)
    }
    children = np.arange(refine**2)
    regions = {name: np.add.outer(rows * refine**2, children).reshape(-1) for name, rows in parts.regions.items()}
    return Parts(parts.shape, points, cells, boundaries, regions)


def lattice(shape: str, refine: int) -> tuple[Indices, Indices]:
    """Lattice points as weighted means of a shape's corners, and the pieces they bound.

    Weights: (points, 4), in units of 1/refine^2, zero beyond the shape's corners; pieces: (pieces, corners).
    """
    k = refine
    j, i = (grid.reshape(-1) for grid in np.mgrid[: k + 1, : k + 1])
    if shape == "quadrilateral":
        weights = np.stack([(k - i) * (k - j), i * (k - j), (k - i) * j, i * j], axis=1)
        start = np.flatnonzero((i < k) & (j < k))
        return weights, np.add.outer(start, [0, 1, k + 1, k + 2])
    if shape == "triangle":
        inside = i + j <= k
        number = np.cumsum(inside) - 1
        weights = k * np.stack([k - i - j, i, j, 0 * i], axis=1)[inside]
        upright = np.add.outer(np.flatnonzero(i + j < k), [0, 1, k + 1])
        turned = np.add.outer(np.flatnonzero(i + j < k - 1), [1, k + 2, k + 1])
        return weights, number[np.concatenate([upright, turned])]
    i = np.arange(k + 1)
    return k * np.stack([k - i, i, 0 * i, 0 * i], axis=1), np.add.outer(i[:-1], [0, 1])


def _mean_keys(nodes: Indices, weights: Indices) -> Indices:
    """Every lattice point of every element as a row: its old nodes, rising, then their weights; 0 fills up to four."""
    padded = np.pad(nodes, ((0, 0), (0, 4 - nodes.shape[1])))[:, None, :]
    used = np.where(weights > 0, padded, 0)
    order = np.argsort(np.where(weights > 0, padded, -1), axis=2)
    shares = np.broadcast_to(weights, used.shape)
    keys: Indices = np.concatenate([np.take_along_axis(part, order, axis=2) for part in (used, shares)], axis=2)
    return keys.reshape(-1, 8)


def distribute(whole: Parts | None, comm: MPI.Comm) -> Mesh:
    """The mesh of rank 0's parts, spread over the ranks by DOLFINx; the other ranks give None."""
    without_rows = comm.bcast(_without_rows(whole) if whole else None)
    parts = whole or without_rows
    element = basix.ufl.element("Lagrange", parts.shape, 1, shape=(parts.dim,))
    # By keyword: DOLFINx 0.10 swapped the order of x and e.
    domain = dolfinx.mesh.create_mesh(comm, cells=parts.cells, x=parts.points, e=ufl.Mesh(element))
    return Mesh(
        domain,
        {name: _local_indices(domain, parts.dim - 1, facets) for name, facets in parts.boundaries.items()},
        {name: _local_indices(domain, parts.dim, parts.cells[rows]) for name, rows in parts.regions.items()},
    )


def _without_rows(parts: Parts) -> Parts:
    """The same names and widths, which DOLFINx asks of every rank, with no points, cells or facets."""
    return Parts(
        parts.shape,
        parts.points[:0],
        parts.cells[:0],
        {name: facets[:0] for name, facets in parts.boundaries.items()},
        {name: rows[:0] for name, rows in parts.regions.items()},
    )


def _local_indices(domain: dolfinx.mesh.Mesh, dim: int, nodes: Indices) -> Indices:
    """Sorted local indices of the entities that rank 0 gives by their input nodes, (entities, corners)."""
    domain.topology.create_connectivity(dim, 0)
    domain.topology.create_connectivity(dim, domain.topology.dim)
    found, marks = distribute_entity_data(domain, dim, nodes, np.ones(len(nodes), dtype=np.int32))
    tags = dolfinx.mesh.meshtags_from_entities(domain, dim, dolfinx.graph.adjacencylist(found), marks)
    indices: Indices = np.unique(tags.indices)
    return indices
