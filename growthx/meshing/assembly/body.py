"""The body in what a file holds: its cells, regions and boundaries, the same for files of all formats.

What cannot be made rightly is refused in a sentence; what is left out or changed is told in a notice.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from growthx.common.checks import LARGEST as FARTHEST
from growthx.common.errors import InputError
from growthx.fem.cells import PLURALS, counted
from growthx.meshing.assembly.connection import islands, islands_in_words, merged, twins_in_words
from growthx.meshing.assembly.naming import Cells, boundaries, node_sets, regions
from growthx.meshing.content import DIMENSIONS, NO_NODE, Content, Origin
from growthx.meshing.parts import Parts, check_corners, each_once

if TYPE_CHECKING:
    from pathlib import Path

    from growthx.common.arrays import Floats, Indices

LARGEST = "largest"  # island
_OFF_PLANE = 1e-9  # height over the mesh's extent, below which a surface counts as plane
_AXES = "xyz"


def assemble(content: Content, path: str | Path, keep: str | None = None, merge: bool = False) -> Parts:
    """The parts of a mesh: cells of the highest dimension, regions and boundaries by the names of groups and sets.

    Of elements of higher order the corners are kept.  A surface in a plane of two coordinates loses the third one.
    Cells in no group are the region "all".  A set of nodes is the boundary of the sides, outside, that have all of
    their corners in it.

    path: what the sentences call the file
    keep: "largest" leaves out all cells that are not connected to most of the body
    merge: make one node of those that stand in one place

    InputError if no body can be made of it.
    """
    notices = list(content.notices)
    _check_numbers(content, path)
    if merge:
        content = merged(content)
    cells = _cells(content, path, notices)
    used = np.unique(cells.nodes)
    points = _in_space(content.points[used], cells.dim, path, notices)
    cells = _one_island(cells, points, used, keep, path, notices)
    _check_repeated(content, cells, points, used, path)
    sides = boundaries(content, cells, path, notices)
    named = regions(content, cells, path, notices)
    kept = np.unique(cells.nodes)
    points = points[np.searchsorted(used, kept)]
    if twins := twins_in_words(points, path):
        notices.append(twins)
    values = {name: found[cells.numbers] for name, found in content.values.items()}
    of_file = np.flatnonzero(_dimensions(content) == cells.dim)
    return Parts(
        cells.shape,
        points,
        np.searchsorted(kept, cells.nodes),
        {name: _rows(kept, facets) for name, facets in sides.items()},
        named,
        Origin(
            np.searchsorted(of_file, cells.numbers),
            len(of_file),
            kept,
            len(content.points),
            {name: found for name, found in values.items() if not np.isnan(found).all()},
            node_sets(content, cells.dim, kept),
        ),
        tuple(notices),
    )


def _rows(used: Indices, nodes: Indices) -> Indices:
    """Where some nodes are among those that cells use, `NO_NODE` where they are not."""
    found = np.minimum(np.searchsorted(used, nodes), len(used) - 1)
    return np.where(used[found] == nodes, found, NO_NODE)


def _dimensions(content: Content) -> Indices:
    """The dimension of each element, (elements,)."""
    return np.repeat(
        np.array([DIMENSIONS[kind.shape] for kind in content.elements], dtype=np.int64),
        [len(kind.nodes) for kind in content.elements],
    )


def _check_numbers(content: Content, path: str | Path) -> None:
    """Refuse nodes and elements that there are not: a format's reader passes on what its file says."""
    points = content.points
    if points.ndim != 2 or points.shape[1] != 3:
        raise InputError(f"the nodes of {path} are of shape {points.shape}: three coordinates of each would be right")
    end = content.starts[-1]
    for name, numbers in content.groups.items():
        if len(numbers) and not (numbers.min() >= 0 and numbers.max() < end):
            raise InputError(f"the group '{name}' of {path} has elements that are not there: a whole file is needed")
    for kind in content.elements:
        if len(kind.nodes) and not (kind.nodes.min() >= NO_NODE and kind.nodes.max() < len(points)):
            raise InputError(f"{path} has {kind.shape}s of nodes that are not there: a whole file is needed")
    for name, nodes in (*content.node_sets.items(), *content.facet_sets.items()):
        if len(nodes) and not (nodes.min() >= 0 and nodes.max() < len(points)):
            raise InputError(f"the set '{name}' of {path} has nodes that are not there: a whole file is needed")


def _cells(content: Content, path: str | Path, notices: list[str]) -> Cells:
    """The elements of the highest dimension."""
    dim = max((DIMENSIONS[kind.shape] for kind in content.elements if len(kind.nodes)), default=-1)
    if dim < 2:
        what = {-1: "has no elements at all", 0: "holds no cells but only points", 1: "holds no cells but only curves"}
        raise InputError(f"{path} {what[dim]}: surfaces or volumes with elements would be right")
    kinds = [number for number, kind in enumerate(content.elements) if DIMENSIONS[kind.shape] == dim]
    shapes = {content.elements[number].shape for number in kinds if len(content.elements[number].nodes)}
    if len(shapes) > 1 or not shapes <= PLURALS.keys():
        raise InputError(_mixed(content, kinds, path))
    (shape,) = shapes
    kinds = [number for number in kinds if content.elements[number].shape == shape]
    if any(content.elements[number].curved for number in kinds):
        notices.append(f"the cells of {path} are of higher order: their corners are kept, and their sides are straight")
    starts = content.starts
    nodes = np.concatenate([content.elements[number].corners for number in kinds])
    numbers = np.concatenate([np.arange(starts[number], starts[number + 1]) for number in kinds])
    if nodes.min() == NO_NODE:
        raise InputError(f"the cells of {path} have nodes that it does not tell: a file that is whole would be right")
    kept, place = each_once(nodes)
    places = np.full(starts[-1], -1)
    places[numbers] = place
    again = np.delete(numbers, kept)
    if len(again):
        notices.append(f"{len(again)} cells of {path} stand there twice: once is enough")
    return Cells(shape, nodes[kept], numbers[kept], places, again)


def _mixed(content: Content, kinds: list[int], path: str | Path) -> str:
    """What to say of cells of several shapes, or of one that has no elements here."""
    counts: dict[str, int] = {}
    for number in kinds:
        kind = content.elements[number]
        counts[kind.shape] = counts.get(kind.shape, 0) + len(kind.nodes)
    told = " and ".join(counted(count, shape) for shape, count in counts.items() if count)
    if counts.keys() == {"triangle", "quadrilateral"}:
        cure = (
            "of one shape would be right: in gmsh, Mesh.RecombinationAlgorithm = 2 or 3 or Mesh.SubdivisionAlgorithm "
            "= 1 leave no triangles, and no recombination leaves no quadrilaterals"
        )
    elif counts.keys() <= {"tetrahedron", "hexahedron", "prism", "pyramid"}:
        cure = "all tetrahedra, or all hexahedra (in gmsh, Mesh.SubdivisionAlgorithm = 2), would be right"
    else:
        cure = "triangles, quadrilaterals, tetrahedra or hexahedra of one kind would be right"
    return f"the mesh of {path} has {told}: cells {cure}"


def _one_island(
    cells: Cells, points: Floats, used: Indices, keep: str | None, path: str | Path, notices: list[str]
) -> Cells:
    """All cells, or those of the largest island; points: at the nodes in `used`."""
    rows = np.searchsorted(used, cells.nodes)
    of_cell = islands(cells.shape, points, rows)
    if not of_cell.any():
        return cells
    if keep is None:
        told = islands_in_words(cells.shape, points, rows, of_cell)
        notices.append(
            f"{path} has {of_cell.max() + 1} islands, which no node connects: {told}; each must be held, or "
            f'keep="{LARGEST}" leaves out all but the first'
        )
        return cells
    told = islands_in_words(cells.shape, points, rows, of_cell, first=1)
    notices.append(f"left out of {path}, since they are not connected to most of it: {told}")
    kept = np.flatnonzero(of_cell == 0)
    onto = np.full(len(cells.nodes) + 1, -1)
    onto[kept] = np.arange(len(kept))
    return replace(
        cells, nodes=cells.nodes[kept], numbers=cells.numbers[kept], places=onto[cells.places], some_left=True
    )


def _in_space(points: Floats, dim: int, path: str | Path, notices: list[str]) -> Floats:
    """Coordinates of nodes in as many directions as cells have; what is left out is told."""
    if not np.all(np.abs(points) <= FARTHEST):
        raise InputError(
            f"{path} has nodes that are nowhere, or too far to be meant: finite coordinates would be right"
        )
    if dim == 3:
        return points
    spread = np.ptp(points, axis=0)
    flat = [axis for axis in (2, 1, 0) if spread[axis] <= _OFF_PLANE * spread.max()]
    if not flat:
        raise InputError(
            f"the surfaces of {path} leave every plane of two coordinates (they extend by "
            f"{', '.join(f'{extent:.4g}' for extent in spread)}): a plane mesh or volumes would be right"
        )
    axis = flat[0]
    kept = [other for other in range(3) if other != axis]
    height = float(points[:, axis].mean())
    if axis != 2 or abs(height) > _OFF_PLANE * spread.max():
        names = [_AXES[other] for other in kept]
        notices.append(
            f"{path} is plane, with {_AXES[axis]} = {height:.6g} everywhere: {_AXES[axis]} is left out, and the mesh's "
            f"two coordinates are the file's {names[0]} and {names[1]}"
        )
    return np.ascontiguousarray(points[:, kept])


def _check_repeated(content: Content, cells: Cells, points: Floats, used: Indices, path: str | Path) -> None:
    """Refuse what stood there once more in an order of corners in which it is folded; points: at nodes in `used`."""
    starts = content.starts
    nodes = [
        kind.corners[cells.again[(cells.again >= start) & (cells.again < end)] - start]
        for kind, start, end in zip(content.elements, starts[:-1], starts[1:], strict=True)
        if kind.shape == cells.shape
    ]
    again = np.concatenate(nodes)
    check_corners(path, cells.shape, points[np.searchsorted(used, again)])
