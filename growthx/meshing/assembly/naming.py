"""Regions and boundaries of a mesh by the names of a file's groups and sets."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import basix
import basix.ufl
import numpy as np

from growthx.meshing.content import DIMENSIONS, Content
from growthx.meshing.parts import each_once

if TYPE_CHECKING:
    from pathlib import Path

    from growthx.common.arrays import Indices, Marks

_REST = ("all", "the rest", "in no group")  # names for the cells that no group has


@dataclass(frozen=True)
class Cells:
    """The cells of a content, each once.

    shape: of all of them.  nodes: of their corners, (cells, corners).  numbers: among the content's elements, (cells,).
    places: for each element the cell that it is, or −1, (elements,).  again: numbers of elements that repeat another.
    some_left: whether some of the content's cells are not among them.
    """

    shape: str
    nodes: Indices
    numbers: Indices
    places: Indices
    again: Indices
    some_left: bool = False

    @property
    def dim(self) -> int:
        """Number of space dimensions."""
        return DIMENSIONS[self.shape]


def regions(content: Content, cells: Cells, path: str | Path, notices: list[str]) -> dict[str, Indices]:
    """Rows of the cells of each group that has some, and of those that are in none."""
    found = {}
    grouped = np.zeros(len(cells.nodes), dtype=bool)
    for name, numbers in content.groups.items():
        rows = np.unique(cells.places[numbers])
        rows = rows[rows >= 0]
        grouped[rows] = True
        if len(rows):
            found[name] = rows
    if not grouped.all():
        rest = next(name for name in _REST if name not in found)
        if found:
            notices.append(
                f"{np.count_nonzero(~grouped)} of the {len(grouped)} cells of {path} are in no group: they are the "
                f"region '{rest}'"
            )
        found[rest] = np.flatnonzero(~grouped)
    return found


def boundaries(content: Content, cells: Cells, path: str | Path, notices: list[str]) -> dict[str, Indices]:
    """Nodes of the facets of each group of sides of cells, and of each set of facets or nodes, (facets, corners)."""
    found = {}
    for name, blocks in _facets(content, cells.dim).items():
        facets = _of_cells(name, blocks, cells, path, notices)
        if facets is not None:
            found[name] = facets
    outer = _outer_sides(cells) if content.node_sets else _all_sides(cells)[:0]
    for name, nodes in content.node_sets.items():
        facets = outer[_within(outer, nodes, len(content.points))]
        if name in found:
            _tell_other(name, facets, found[name], path, notices)
        elif len(facets):
            found[name] = facets
        else:
            notices.append(
                f"the set '{name}' of {len(nodes)} nodes of {path} is no boundary: no side of a cell on the surface "
                "has all of its corners in it"
            )
    return found


def node_sets(content: Content, dim: int, used: Indices) -> dict[str, Indices]:
    """Rows in the points of each set of nodes, and of each group of points or of curves in space, that cells use.

    used: nodes of cells, rising.
    """
    found = {name: np.unique(nodes) for name, nodes in content.node_sets.items()}
    for kind, start, end in zip(content.elements, content.starts[:-1], content.starts[1:], strict=True):
        if DIMENSIONS[kind.shape] >= dim - 1:
            continue
        for name, numbers in content.groups.items():
            rows = numbers[(numbers >= start) & (numbers < end)] - start
            if len(rows):
                found[name] = np.unique(np.concatenate([found.get(name, rows[:0]), kind.corners[rows].ravel()]))
    kept = {name: nodes[np.isin(nodes, used)] for name, nodes in found.items()}
    return {name: nodes for name, nodes in kept.items() if len(nodes)}


def _tell_other(name: str, facets: Indices, taken: Indices, path: str | Path, notices: list[str]) -> None:
    """Tell of a set of nodes that is left out for a set of facets of its name, unless they mean the same sides."""
    both = np.concatenate([facets, taken])
    if not len(facets) == len(taken) == len(each_once(both)[0]):
        notices.append(
            f"the set of nodes '{name}' of {path} means {len(facets)} sides of cells, and its facets of that name are "
            f"{len(taken)}: those of the facets are taken"
        )


def _facets(content: Content, dim: int) -> dict[str, list[Indices]]:
    """The corners of what each group and set has of one dimension less, by kinds."""
    found: dict[str, list[Indices]] = {}
    for kind, start, end in zip(content.elements, content.starts[:-1], content.starts[1:], strict=True):
        if DIMENSIONS[kind.shape] != dim - 1:
            continue
        for name, numbers in content.groups.items():
            rows = np.unique(numbers[(numbers >= start) & (numbers < end)]) - start
            if len(rows):
                found.setdefault(name, []).append(kind.corners[rows])
    for name, facets in content.facet_sets.items():
        found.setdefault(name, []).append(facets)
    return found


def _of_cells(name: str, blocks: list[Indices], cells: Cells, path: str | Path, notices: list[str]) -> Indices | None:
    """The facets of a group, each once; None for one that is no boundary, which is told.

    Of a group with a name, all must be sides of cells (`parts.check` says so), unless cells were left out.
    """
    width = len(_sides(cells.shape)[0])
    if any(len(block) and block.shape[1] != width for block in blocks):
        notices.append(f"the group '{name}' of {path} is no boundary: its elements are no sides of {cells.shape}s")
        return None
    facets = np.concatenate([block.reshape(-1, width) for block in blocks])
    facets = facets[each_once(facets)[0]]
    if not (cells.some_left or name.isdecimal()):
        return facets
    there = _are_sides(cells, facets)
    if there.all():
        return facets
    notices.append(
        f"{np.count_nonzero(~there)} of the {len(there)} elements of the group '{name}' of {path} are left out: they "
        "are on no cell"
    )
    return facets[there] if there.any() else None


def _sides(shape: str) -> Indices:
    """Corners of each side of a cell, (sides, corners of a side)."""
    return np.array(basix.topology(basix.CellType[shape])[DIMENSIONS[shape] - 1])


def _all_sides(cells: Cells) -> Indices:
    """The sides of all cells, those between two cells twice, (cells times sides, corners)."""
    sides = _sides(cells.shape)
    return cells.nodes[:, sides].reshape(-1, sides.shape[1])


def _are_sides(cells: Cells, facets: Indices) -> Marks:
    """Which facets are sides of cells, (facets,)."""
    sides = _all_sides(cells)
    sides = sides[np.isin(sides, facets).all(axis=1)]
    kept, place = each_once(np.concatenate([sides, facets]))
    return np.asarray(kept[place[len(sides) :]] < len(sides))


def _outer_sides(cells: Cells) -> Indices:
    """The sides of cells on the surface."""
    sides = _all_sides(cells)
    kept, place = each_once(sides)
    found: Indices = sides[kept[np.bincount(place, minlength=len(kept)) == 1]]
    return found


def _within(sides: Indices, nodes: Indices, count: int) -> Marks:
    """Which sides have all of their corners among some nodes; count: of all nodes."""
    within = np.zeros(count + 1, dtype=bool)
    within[nodes] = True
    return np.asarray(within[sides].all(axis=1))
