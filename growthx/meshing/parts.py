"""A whole mesh in arrays on one rank, and what is wrong with it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import basix
import basix.ufl
import numpy as np

from growthx.common.arrays import Floats, Indices
from growthx.common.checks import LARGEST, require_kind
from growthx.common.errors import InputError, shown
from growthx.common.words import place_in_words
from growthx.fem.cells import PLURALS
from growthx.meshing.content import NO_NODE, Origin
from growthx.meshing.corners import complaint, corner_sines, facet_vectors, not_convex

if TYPE_CHECKING:
    from pathlib import Path


@dataclass(frozen=True)
class Parts:
    """A whole mesh in arrays, before its distribution over the ranks.

    shape: name of the cells' shape
    points: coordinates of the nodes, (nodes, dim), in the file's unit of length
    cells: nodes of the cells in DOLFINx's order, (cells, corners)
    boundaries: nodes of the facets of each named boundary, (facets, corners of a facet)
    regions: rows in `cells` of each named region, (cells of the region,)
    origin: where cells and nodes come from; None: they stand as they stood
    notices: sentences on what was left out or changed in reading

    Example:
        >>> import numpy as np
        >>> points = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
        >>> parts = gx.meshing.Parts("triangle", points, np.array([[0, 1, 2]]), {"bottom": np.array([[0, 1]])}, {})
        >>> len(parts.points), list(parts.boundaries)
        (3, ['bottom'])
    """

    shape: str
    points: Floats
    cells: Indices
    boundaries: Mapping[str, Indices]
    regions: Mapping[str, Indices]
    origin: Origin | None = None
    notices: tuple[str, ...] = ()

    @property
    def dim(self) -> int:
        """Number of space dimensions."""
        return self.points.shape[1]


def each_once(nodes: Indices) -> tuple[Indices, Indices]:
    """The first rows of elements of the same nodes, in any order, rising; and where among them each element's is.

    nodes: of the elements, (elements, nodes).
    """
    keys = np.sort(nodes, axis=1)
    # Rows that are the same have the same sum; comparing the few others that have is all that is left to do.
    factors = np.random.default_rng(0).integers(1, 2**63, keys.shape[1], dtype=np.uint64)
    _, numbers, counts = np.unique(keys.astype(np.uint64) @ factors, return_inverse=True, return_counts=True)
    suspects = np.flatnonzero(counts[numbers.reshape(-1)] > 1)
    first = np.arange(len(nodes))
    if len(suspects):
        _, found, which = np.unique(keys[suspects], axis=0, return_index=True, return_inverse=True)
        first[suspects] = suspects[found[which.reshape(-1)]]
    kept = np.flatnonzero(first == np.arange(len(nodes)))
    return kept, np.searchsorted(kept, first)


def check(parts: Any, path: str | Path) -> None:
    """Refuse a mesh of which no body can be made, whatever the format of its file."""
    require_kind(parts, Parts, f"what was read of {path}", "Parts of a mesh")
    if parts.shape not in PLURALS:
        shapes = ", ".join(PLURALS)
        raise InputError(f"the cells of {path} are of the shape {shown(parts.shape)}: one of {shapes} would be right")
    topology = basix.topology(basix.CellType[parts.shape])
    dim = len(topology) - 1
    _check_coordinates(path, parts.points, dim)
    _check_numbers(path, "of the nodes of cells", parts.cells, (len(topology[dim][0]),), 0, len(parts.points))
    if not len(parts.cells):
        raise InputError(f"{path} has no cells: one at least would be right")
    for name, facets in parts.boundaries.items():
        what, corners = f"of the nodes of '{name}'", len(topology[dim - 1][0])
        _check_numbers(path, what, facets, (corners,), NO_NODE, len(parts.points))
        check_facets(path, name, facets, parts.shape, parts.cells)
    for name, rows in parts.regions.items():
        _check_numbers(path, f"of the cells of '{name}'", rows, (), 0, len(parts.cells))
    check_corners(path, parts.shape, parts.points[parts.cells])
    _check_neighbours(parts, path)


def _check_coordinates(path: str | Path, points: Any, dim: int) -> None:
    """Refuse what is not a row of so many finite coordinates for each node."""
    x = np.asarray(points)
    if not (x.dtype.kind == "f" and x.ndim == 2 and x.shape[1] == dim and np.all(np.abs(x) <= LARGEST)):
        raise InputError(f"the nodes of {path} are at {shown(points)}: {dim} finite coordinates of each would be right")


def _check_numbers(path: str | Path, what: str, numbers: Any, width: tuple[int, ...], low: int, end: int) -> None:
    """Refuse what are not whole numbers from `low` to before `end`; width: of a row, () for numbers alone."""
    found = np.asarray(numbers)
    if found.ndim and not len(found):
        return
    if not (found.dtype.kind in "iu" and found.shape[1:] == width and np.all((found >= low) & (found < end))):
        wanted = f"whole numbers from 0, below {end}" + "".join(f", {corners} in each row," for corners in width)
        raise InputError(f"the numbers {what} of {path} are {shown(numbers)}: {wanted} would be right")


def check_facets(path: str | Path, name: str, facets: Indices, shape: str, cells: Indices) -> None:
    """Refuse a boundary without facets or with facets that are on no cell: they would be lost without a word."""
    if not len(facets):
        raise InputError(f"the group '{name}' of {path} has no elements: a meshed group would be right")
    dim = len(basix.topology(basix.CellType[shape])) - 1
    sides = cells[:, basix.topology(basix.CellType[shape])[dim - 1]].reshape(-1, facets.shape[1])
    near = np.unique(np.sort(sides[np.isin(sides, facets).all(axis=1)]), axis=0)
    if len(np.unique(np.concatenate([near, np.sort(facets)]), axis=0)) > len(near):
        raise InputError(
            f"the group '{name}' of {path} is not made of sides of cells: "
            "curves (of surfaces) or surfaces (of volumes) that bound a cell group would be right"
        )


def check_corners(path: str | Path, shape: str, corners: Floats) -> None:
    """Refuse cells with a flat or re-entrant corner, numbered in either sense; corners: (cells, corners, dim)."""
    sines = corner_sines(shape, corners)
    bad = np.flatnonzero(not_convex(sines, np.sign(sines.sum(axis=1))))
    if len(bad):
        raise InputError(complaint(len(bad), len(corners), corners[bad[0]], path))


def _check_neighbours(parts: Parts, path: str | Path) -> None:
    """Refuse cells that lie on the same side of the side that they share, and sides of more than two cells.

    Each cell may be numbered in either sense, so that two which overlap are each fine alone.
    """
    topology = basix.topology(basix.CellType[parts.shape])
    sides = np.array(topology[len(topology) - 2])
    facets = parts.cells[:, sides].reshape(-1, sides.shape[1])
    of = np.repeat(np.arange(len(parts.cells)), len(sides))
    kept, place = each_once(facets)
    counts = np.bincount(place, minlength=len(kept))
    order = np.argsort(place, kind="stable")
    first = np.cumsum(counts) - counts
    for many in np.flatnonzero(counts > 2)[:1]:
        where = place_in_words(parts.points[facets[kept[many]]].mean(axis=0))
        raise InputError(
            f"{counts[many]} cells of {path} share one side, at {where}: one or two cells on each side would be right"
        )
    one = order[first[counts == 2]]
    both = of[one], of[order[first[counts == 2] + 1]]
    corners = parts.points[facets[one]]
    normals = facet_vectors(corners)
    heights = [
        np.einsum("fi,fi->f", parts.points[parts.cells[cells]].mean(axis=1) - corners.mean(axis=1), normals)
        for cells in both
    ]
    bad = np.flatnonzero(heights[0] * heights[1] > 0)
    if len(bad):
        count = len(np.unique(np.concatenate([cells[bad] for cells in both])))
        raise InputError(
            f"{count} of the {len(parts.cells)} cells of {path} overlap a neighbour, the first at the side about "
            f"{place_in_words(corners[bad[0]].mean(axis=0))}: cells on both sides of it would be right"
        )


def no_parameters(path: str | Path, parameters: Mapping[str, float], right: str = "none would be right") -> None:
    """Refuse parameters for a file that has none."""
    if parameters:
        raise InputError(f"{path} is a mesh and takes no parameters ({quoted(parameters)}): {right}")


def quoted(names: Iterable[str]) -> str:
    """Names in quotes, sorted."""
    return ", ".join(f"'{name}'" for name in sorted(names))
