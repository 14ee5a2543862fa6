"""Nodes and elements of a .msh file of version 4, in blocks, one for each geometric entity, which has the groups."""

from __future__ import annotations

from collections import defaultdict
from typing import TYPE_CHECKING

import numpy as np

from growthx.common.errors import InputError
from growthx.meshing.formats.msh_records import Block

if TYPE_CHECKING:
    from collections.abc import Mapping

    from growthx.common.arrays import Floats, Indices
    from growthx.meshing.formats.msh_file import File, Source

_BOX = 6  # numbers that tell an entity's extent
_MANY = 16  # groups of an element for each of the file's bytes: what has more would not fit into memory


def read_nodes(file: File) -> tuple[Indices, Floats]:
    """Tags of all nodes, and where they are, (nodes, 3)."""
    source = file.numbers("Nodes")
    tags, places = [np.empty(0, dtype=np.int64)], [np.empty((0, 3))]
    blocks, count = (int(each) for each in source.rows(1, ("s", 2))[0][0])
    if file.version == "4.1":
        source.rows(1, ("s", 2))
    for _ in range(blocks):
        head, size = source.rows(1, ("i", 3), ("s", 1))
        dim = head[0, 0 if file.version == "4.1" else 1]
        further = int(dim) if head[0, 2] else 0
        if not 0 <= further <= 3:
            raise InputError(f"{file.path} has nodes of an entity of dimension {dim}: one of 0 to 3 would be right")
        if file.version == "4.1":
            (tag,) = source.rows(int(size[0, 0]), ("s", 1))
            (place,) = source.rows(int(size[0, 0]), ("d", 3 + further))
        else:
            tag, place = source.rows(int(size[0, 0]), ("i", 1), ("d", 3 + further))
        tags.append(tag[:, 0])
        places.append(place[:, :3])
    source.end(f"{count} nodes")
    if sum(map(len, tags)) != count:
        raise InputError(f"{file.path} has not the {count} nodes that it says: a file that is whole would be right")
    return np.concatenate(tags), np.concatenate(places)


def read_blocks(file: File, groups: Mapping[tuple[int, int], list[int]], sizes: Indices, dims: Indices) -> list[Block]:
    """All elements in blocks of one type, each in the file's order.

    groups: of the entities, see `entity_groups`.
    sizes, dims: nodes and dimension of an element by gmsh's number of its type, 0 nodes where there is none.
    """
    if not file.section("Elements"):
        return []
    source = file.numbers("Elements", whole=True)
    found = []
    blocks, count = (int(each) for each in source.rows(1, ("s", 2))[0][0])
    if file.version == "4.1":
        source.rows(1, ("s", 2))
    for _ in range(blocks):
        head, size = source.rows(1, ("i", 3), ("s", 1))
        one, other, kind = (int(each) for each in head[0])
        dim, entity = (one, other) if file.version == "4.1" else (other, one)
        if not (0 <= kind < len(sizes) and sizes[kind]) or dims[kind] != dim:
            raise InputError(
                f"{file.path} has elements of gmsh's type {kind} in an entity of dimension {dim}: those of points, "
                "lines, triangles, quadrilaterals, tetrahedra, hexahedra, prisms and pyramids would be right"
            )
        (rows,) = source.rows(int(size[0, 0]), ("s" if file.version == "4.1" else "i", 1 + int(sizes[kind])))
        of_entity = np.broadcast_to(np.int64(entity), len(rows))
        own = np.array(groups.get((dim, entity), [0]))
        found.append(Block(kind, rows[:, 0], rows[:, 1:], of_entity, np.broadcast_to(own, (len(rows), len(own)))))
    source.end(f"{count} elements")
    if sum(len(block.tags) for block in found) != count:
        raise InputError(f"{file.path} has not the {count} elements that it says: a file that is whole would be right")
    if sum(block.groups.size for block in found) > _MANY * len(file.section("Elements")):
        raise InputError(f"the elements of {file.path} are in more groups than can be meant: a few would be right")
    return found


def entity_groups(file: File) -> Mapping[tuple[int, int], list[int]]:
    """Physical groups by dimension and tag of the entities, of the whole mesh and of its parts."""
    found: dict[tuple[int, int], list[int]] = defaultdict(list)
    for name, parts in (("Entities", False), ("PartitionedEntities", True)):
        if not file.section(name):
            continue
        source = file.numbers(name)
        if parts:
            source.number()
            source.rows(source.number(), ("i", 2))
        for dim, count in enumerate(source.rows(1, ("s", 4))[0][0]):
            for _ in range(int(count)):
                tag, groups = _entity(source, file, dim, parts=parts)
                if groups:
                    found[dim, tag] = groups
    return found


def _entity(source: Source, file: File, dim: int, *, parts: bool) -> tuple[int, list[int]]:
    """Tag and physical groups of the next entity."""
    tag = int(source.rows(1, ("i", 1))[0][0, 0])
    if parts:
        source.rows(1, ("i", 2))  # what it is a part of
        source.rows(source.number(), ("i", 1))  # in which partitions
    source.rows(1, ("d", 3 if dim == 0 and file.version == "4.1" else _BOX))
    (groups,) = source.rows(source.number(), ("i", 1))
    if dim > 0:
        source.rows(source.number(), ("i", 1))
    # A negative group is the group, turned over.
    return tag, np.unique(np.abs(groups)).tolist()
