"""gmsh's meshes (.msh), read without gmsh: it mixes up groups of elements of one entity, and damaged files crash it.

Versions 1, 2.0 to 2.2, 4.0 and 4.1, text and binary; version 3 is converted by gmsh in a process of its own.
"""

from __future__ import annotations

import re
import tempfile
from collections import defaultdict
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, cast

import numpy as np

from growthx.common.checks import LARGEST
from growthx.common.errors import InputError, shown
from growthx.meshing.content import AROUND, DIMENSIONS, Content, Elements
from growthx.meshing.formats import msh_blocks, msh_data, msh_file, msh_records
from growthx.meshing.formats.apart import process
from growthx.meshing.parts import each_once, no_parameters

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping

    from growthx.common.arrays import Floats, Indices
    from growthx.meshing.formats.msh_file import Binary, File
    from growthx.meshing.formats.msh_records import Block

SUFFIXES = {".msh": "a gmsh mesh"}

# gmsh's numbers of the types of elements, and how many nodes each has, the corners first.
TYPES = {
    "point": {15: 1},
    "interval": {1: 2, 8: 3, 26: 4, 27: 5, 28: 6, 62: 7, 63: 8, 64: 9, 65: 10, 66: 11},
    "triangle": {2: 3, 9: 6, 20: 9, 21: 10, 22: 12, 23: 15, 24: 15, 25: 21, 42: 28, 43: 36, 44: 45, 45: 55, 46: 66}
    | {52: 18, 53: 21, 54: 24, 55: 27, 56: 30},
    "quadrilateral": {3: 4, 10: 9, 16: 8, 36: 16, 37: 25, 38: 36, 39: 12, 40: 16, 41: 20, 47: 49, 48: 64, 49: 81}
    | {50: 100, 51: 121, 57: 24, 58: 28, 59: 32, 60: 36, 61: 40},
    "tetrahedron": {4: 4, 11: 10, 29: 20, 30: 35, 31: 56, 32: 22, 33: 28, 71: 84, 72: 120, 73: 165, 74: 220, 75: 286}
    | {79: 34, 80: 40, 81: 46, 82: 52, 83: 58, 137: 16},
    "hexahedron": {5: 8, 12: 27, 17: 20, 92: 64, 93: 125, 94: 216, 95: 343, 96: 512, 97: 729, 98: 1000, 99: 32}
    | {100: 44, 101: 56, 102: 68, 103: 80, 104: 92, 105: 104},
    "prism": {6: 6, 13: 18, 18: 15, 90: 40, 91: 75},
    "pyramid": {7: 5, 14: 14, 19: 13, 118: 30, 119: 55, 125: 21, 126: 29},
}
SHAPES = {number: shape for shape, numbers in TYPES.items() for number in numbers}
SIZES, DIMS = np.zeros((2, 1 + max(SHAPES)), dtype=np.int64)  # nodes and dimension by the number of a type, 0: none
for _shape, _numbers in TYPES.items():
    SIZES[list(_numbers)] = list(_numbers.values())
    DIMS[list(_numbers)] = DIMENSIONS[_shape]
_NAME = re.compile(rb'\s*(?:(-?\d{1,18})\s+)?(-?\d{1,18})\s+"(.*)"\s*')


# Where in the order that goes round the corner is that lies across from each.
_ACROSS = {"quadrilateral": [2, 3, 0, 1], "hexahedron": [6, 7, 4, 5, 2, 3, 0, 1]}


def read(path: Path, values: Mapping[str, float]) -> Content:
    """What a .msh file holds; InputError for one of no use, and for parameters, of which it has none."""
    no_parameters(path, values, "a .geo script would")
    return _by_gmsh(path) if msh_file.is_of_version_3(path) else _read(msh_file.load(path))


def _by_gmsh(path: Path) -> Content:
    """A file of version 3, an experiment of gmsh's of which only gmsh knows, converted by it."""
    converted = process.arrays("gmsh_reader", path, {})["msh"]
    with tempfile.TemporaryDirectory(prefix="growthx-") as folder:
        file = Path(folder) / path.name
        file.write_bytes(converted.tobytes())
        found = _read(msh_file.load(file))
    lost = (f"the values of elements of {path} are left out: those of a file of version 4.1 are read",)
    return replace(found, kind="gmsh mesh 3, by gmsh", notices=lost if b"$ElementData" in path.read_bytes() else ())


def _read(file: File) -> Content:
    path = file.path
    tags, points = _nodes(file)
    if file.version.startswith("4"):
        groups = msh_blocks.entity_groups(file)
        blocks = msh_blocks.read_blocks(file, groups, SIZES, DIMS)
        meant = {(dim, group) for (dim, _), own in groups.items() for group in own}
    else:
        blocks, meant = msh_records.read_records(file, SIZES), set()
    data, notices = msh_data.read_values(file)
    found = content(path, file.kind, (tags, points), blocks, _names(file), meant, data)
    return replace(found, notices=tuple(notices))


def content(
    path: Path,
    kind: str,
    nodes: tuple[Indices, Floats],
    blocks: list[Block],
    names: Mapping[tuple[int, int], str],
    meant: Collection[tuple[int, int]] = (),
    data: Mapping[str, tuple[Indices, Floats]] | None = None,
) -> Content:
    """The content of what gmsh numbers by tags.

    kind: format and version in words.  nodes: their tags, and where they are.  names: of physical groups, by dimension
    and tag, as are the groups that should have elements (`meant`).  data: numbers of elements, and the value of each.
    """
    by_kind: dict[int, list[Block]] = {}
    for block in blocks:
        if len(block.tags):
            by_kind.setdefault(block.kind, []).append(block)
    elements: list[Elements] = []
    groups: dict[tuple[int, int], list[Indices]] = defaultdict(list)
    tags, places = [], []
    start = 0
    for number, own in by_kind.items():
        rows = _rows(path, nodes[0], np.concatenate([block.nodes for block in own]))
        first, place = _each_once(SHAPES[number], rows)
        elements.append(Elements(SHAPES[number], rows[first]))
        for group, members in _members(own).items():
            groups[DIMENSIONS[SHAPES[number]], group].append(start + np.unique(place[members]))
        tags.append(np.concatenate([block.tags for block in own]))
        places.append(start + place)
        start += len(first)
    none = np.empty(0, dtype=np.int64)
    _check_groups(path, groups, names, meant)
    return Content(
        kind=kind,
        points=nodes[1],
        elements=tuple(elements),
        groups=_named(groups, names),
        values=_values(data or {}, np.concatenate([none, *tags]), np.concatenate([none, *places]), start),
    )


def _nodes(file: File) -> tuple[Indices, Floats]:
    """Tags of the nodes, and where they are, (nodes, 3)."""
    if "ParametricNodes" in file.sections:
        raise InputError(f"{file.path} has parametric nodes: a file saved with Mesh.SaveParametric = 0 would be right")
    name = "NOD" if file.version == "1" else "Nodes"
    if not file.section(name):
        return np.empty(0, dtype=np.int64), np.empty((0, 3))
    if file.version.startswith("4"):
        tags, points = msh_blocks.read_nodes(file)
    else:
        source = file.numbers(name)
        count = cast("Binary", source).line() if file.order else source.number()
        column, points = source.rows(count, ("i", 1), ("d", 3))
        source.end(f"{count} nodes")
        tags = column[:, 0]
    if not np.all(np.abs(points) <= LARGEST):
        raise InputError(
            f"{file.path} has nodes that are nowhere, or too far to be meant: finite coordinates would be right"
        )
    return tags, points


def _rows(path: Path, tags: Indices, nodes: Indices) -> Indices:
    """Rows of nodes among those of the file, by their tags."""
    if len(tags) and np.array_equal(tags, np.arange(tags[0], tags[0] + len(tags))):
        found = nodes - tags[0]
        known = (found >= 0) & (found < len(tags))
    elif len(tags):
        order = np.argsort(tags, kind="stable")
        found = order[np.minimum(np.searchsorted(tags, nodes, sorter=order), len(tags) - 1)]
        known = tags[found] == nodes
    if not len(tags) or not known.all():
        raise InputError(f"the cells of {path} have nodes that it does not tell: a file that is whole would be right")
    return found


def _each_once(shape: str, nodes: Indices) -> tuple[Indices, Indices]:
    """The first rows of elements of the same nodes, rising; and where among them each element's is.

    In files of version 2 an element of several groups is there once for each, perhaps turned over.  One whose corners
    follow each other otherwise, such as a twisted quadrilateral, is another.
    """
    kept, place = each_once(nodes)
    if len(kept) == len(nodes) or shape not in _ACROSS:
        return kept, place
    corners = nodes[:, : len(AROUND[shape])]
    order = np.argsort(corners, axis=1)
    across = np.take_along_axis(corners[:, _ACROSS[shape]], order, axis=1)
    first = kept[place]
    other = (across != across[first]).any(axis=1)
    first[other] = np.flatnonzero(other)
    kept = np.unique(first)
    return kept, np.searchsorted(kept, first)


def _members(blocks: list[Block]) -> dict[int, Indices]:
    """Places of the elements of each physical group among those of all blocks."""
    starts = np.cumsum([0, *(len(block.tags) for block in blocks)])
    rows, groups = [], []
    for start, block in zip(starts, blocks, strict=False):
        for group in block.groups.T:
            rows.append(np.arange(start, start + len(group)))
            groups.append(group)
    order = np.argsort(np.concatenate(groups), kind="stable")
    found, begins = np.unique(np.concatenate(groups)[order], return_index=True)
    parts = np.split(np.concatenate(rows)[order], begins[1:])
    return {int(group): part for group, part in zip(found, parts, strict=True) if group}


def _values(
    data: Mapping[str, tuple[Indices, Floats]], tags: Indices, places: Indices, count: int
) -> dict[str, Floats]:
    """Values of the elements, each once, by the name of the data; NaN where there is none.

    tags, places: number of each element that the file has, and its place among those that are there once.
    """
    values: dict[str, Floats] = {}
    for name, (numbers, found) in data.items():
        values[name] = np.full(count, np.nan)
        if len(numbers):
            order = np.argsort(numbers, kind="stable")
            row = order[np.minimum(np.searchsorted(numbers, tags, sorter=order), len(numbers) - 1)]
            told = np.flatnonzero((numbers[row] == tags) & ~np.isnan(found[row]))
            told = told[::-1]  # the first of those that are the same counts
            values[name][places[told]] = found[row][told]
    return values


def _names(file: File) -> dict[tuple[int, int], str]:
    """Names of the physical groups by dimension and tag; a name without a dimension is that of each."""
    found = {}
    for line in file.section("PhysicalNames").splitlines()[1:]:
        if not line.strip():
            continue
        said = _NAME.fullmatch(line)
        if said is None:
            raise InputError(
                f"a line of $PhysicalNames of {file.path} is {shown(line.decode(errors='replace'))}: dimension, number "
                'and name, such as 2 1 "bone", would be right'
            )
        dims = range(4) if said[1] is None else (int(said[1]),)
        try:
            name = said[3].decode()
        except UnicodeDecodeError:
            name = said[3].decode("latin-1")
        found.update({(dim, abs(int(said[2]))): name for dim in dims if name})
    return found


def _named(groups: Mapping[tuple[int, int], list[Indices]], names: Mapping[tuple[int, int], str]) -> dict[str, Indices]:
    """The elements of each group by its name, or its number where it has none."""
    found: dict[str, list[Indices]] = {}
    for key, parts in sorted(groups.items()):
        found.setdefault(names.get(key, str(key[1])), []).extend(parts)
    return {name: np.unique(np.concatenate(parts)) for name, parts in found.items()}


def _check_groups(
    path: Path,
    groups: Mapping[tuple[int, int], list[Indices]],
    names: Mapping[tuple[int, int], str],
    meant: Collection[tuple[int, int]],
) -> None:
    """Refuse a named group of sides of cells without any: what is held or loaded there would be lost."""
    most = max((dim for dim, _ in groups), default=0)
    for dim, tag in sorted(meant):
        if dim == most - 1 and (dim, tag) in names and (dim, tag) not in groups:
            raise InputError(f"the group '{names[dim, tag]}' of {path} has no elements: a meshed group would be right")
