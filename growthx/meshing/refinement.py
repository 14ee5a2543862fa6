"""A whole mesh split uniformly: every cell into K × K, its boundaries with it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from growthx.common.arrays import Indices
from growthx.common.errors import InputError
from growthx.meshing.content import Origin
from growthx.meshing.parts import Parts

if TYPE_CHECKING:
    from pathlib import Path


MOST_CELLS = 1e8  # that anybody means


def split(parts: Parts, refine: int, path: str | Path) -> Parts:
    """Split every cell into refine x refine and the boundaries with them; old nodes keep their coordinates exactly."""
    if refine == 1:
        return parts
    if parts.dim != 2:
        raise InputError(
            f"refine = {refine} works on two-dimensional meshes only, and {path} has {parts.shape}s: "
            "refine = 1 would be right"
        )
    if len(parts.cells) * refine**2 > MOST_CELLS:
        raise InputError(
            f"refine = {refine} makes {len(parts.cells)} cells of {path} more than {MOST_CELLS:g}: a "
            "smaller one would be right"
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
    origin = parts.origin or Origin(
        np.arange(len(parts.cells)), len(parts.cells), np.arange(len(parts.points)), len(parts.points)
    )
    whole = share.max(axis=1) == 1.0
    nodes = np.where(whole, origin.nodes[old[np.arange(len(old)), share.argmax(axis=1)]], -1)
    values = {name: np.repeat(found, refine**2) for name, found in origin.values.items()}
    origin = Origin(
        np.repeat(origin.cells, refine**2), origin.cell_count, nodes, origin.node_count, values, origin.node_sets
    )
    return Parts(parts.shape, points, cells, boundaries, regions, origin=origin, notices=parts.notices)


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
