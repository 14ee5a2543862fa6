"""What of a mesh is connected: its islands, and nodes that stand in one place."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from growthx.common.words import place_in_words
from growthx.fem.cells import counted
from growthx.meshing.content import NO_NODE, Content, Elements
from growthx.meshing.corners import volumes

if TYPE_CHECKING:
    from pathlib import Path

    from growthx.common.arrays import Floats, Indices

TOLD = 5  # islands, of which a notice speaks one by one
_SAME_PLACE = 1e-9  # distance over the mesh's extent, below which two nodes stand in one place


def islands(shape: str, points: Floats, cells: Indices) -> Indices:
    """The island of each cell, (cells,), counted from the largest in volume; cells of an island share nodes.

    cells: nodes of their corners, (cells, corners).
    """
    from scipy.sparse import coo_array  # a tenth of a second, which those need not wait for who read no file
    from scipy.sparse.csgraph import connected_components

    used, nodes = np.unique(cells, return_inverse=True)
    nodes = nodes.reshape(cells.shape)
    pairs = np.repeat(nodes[:, 0], nodes.shape[1] - 1), nodes[:, 1:].reshape(-1)
    graph = coo_array((np.ones(len(pairs[0]), dtype=np.int8), pairs), shape=(len(used), len(used)))
    of_cell = connected_components(graph, directed=False)[1][nodes[:, 0]]
    if not of_cell.any():
        return np.asarray(of_cell)
    order = np.argsort(-np.bincount(of_cell, weights=volumes(shape, points[cells])), kind="stable")
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    found: Indices = rank[of_cell]
    return found


def islands_in_words(shape: str, points: Floats, cells: Indices, of_cell: Indices, first: int = 0) -> str:
    """Cells, volume and place of each island from `first` on, as a list."""
    sizes = volumes(shape, points[cells])
    centres = points[cells].mean(axis=1)
    kind = "area" if points.shape[1] == 2 else "volume"
    told = []
    end = int(of_cell.max()) + 1
    for number in range(first, min(end, first + TOLD)):
        rows = of_cell == number
        place = place_in_words(np.average(centres[rows], axis=0, weights=sizes[rows] + 1e-300), 4)
        count = np.count_nonzero(rows)
        told.append(f"{counted(int(count), shape)} of {kind} {sizes[rows].sum():.4g} about {place}")
    if end > first + TOLD:
        rows = of_cell >= first + TOLD
        told.append(
            f"{end - first - TOLD} more of {np.count_nonzero(rows)} cells and {kind} {sizes[rows].sum():.4g} in all"
        )
    return "; ".join(told)


def merged(content: Content) -> Content:
    """The same with one node in each place."""
    first, place = _places(content.points)
    onto = np.append(first[place], NO_NODE)
    return replace(
        content,
        elements=tuple(Elements(kind.shape, onto[kind.nodes]) for kind in content.elements),
        node_sets={name: np.unique(onto[nodes]) for name, nodes in content.node_sets.items()},
        facet_sets={name: onto[facets] for name, facets in content.facet_sets.items()},
    )


def _places(points: Floats) -> tuple[Indices, Indices]:
    """The first node in each place, and for each node the number of its place."""
    finite = points[np.isfinite(points).all(axis=1)]
    size = np.ptp(finite, axis=0).max(initial=0.0) if len(finite) else 0.0
    with np.errstate(invalid="ignore", over="ignore"):
        grid = np.round(points / (_SAME_PLACE * size or 1.0)) + 0.0
    # Rows that are the same to the bit, as one column of bytes: faster than by their coordinates.
    rows = np.ascontiguousarray(grid).view(np.dtype((np.void, grid.dtype.itemsize * grid.shape[1]))).reshape(-1)
    _, first, place = np.unique(rows, return_index=True, return_inverse=True)
    return first, place.reshape(-1)


def twins_in_words(points: Floats, path: str | Path) -> str:
    """What to say of nodes that stand in one place: the cells beside them are not connected there; "" if none do."""
    first, _ = _places(points)
    if len(first) == len(points):
        return ""
    twins = np.setdiff1d(np.arange(len(points)), first)
    where = place_in_words(points[twins[0]])
    return (
        f"{len(twins)} nodes of {path} stand where another does, the first at {where}: the cells beside them are not "
        "connected there, as at a crack; merge=True makes one node of each"
    )
