"""What a file of a mesh holds, looked at on one rank: what people want to know of it before they write a script."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from growthx.common.errors import InputError
from growthx.common.words import place_in_words
from growthx.fem.cells import PLURALS
from growthx.meshing.assembly.connection import islands, islands_in_words
from growthx.meshing.content import AROUND, DIMENSIONS, Content
from growthx.meshing.corners import MEASURES, corner_sines, facet_vectors, qualities, volumes
from growthx.meshing.files import assembled, content_of
from growthx.meshing.parts import Parts, check

if TYPE_CHECKING:
    from pathlib import Path

    from growthx.common.arrays import Floats, Indices

POOR = 0.1  # quality, below which cells are counted
_PLURALS = {**PLURALS, "point": "points", "interval": "lines", "prism": "prisms", "pyramid": "pyramids"}


@dataclass(frozen=True)
class Named:
    """A region or boundary: number of its cells or facets, and their volume or area (area or length in the plane)."""

    name: str
    count: int
    size: float


@dataclass(frozen=True)
class Group:
    """A group or set as the file has it: number of its elements, facets or nodes."""

    name: str
    of: str
    count: int


@dataclass(frozen=True)
class Quality:
    """Worst and middle quality of the cells, up to 1, by a measure; where the worst is; how many are below `POOR`."""

    measure: str
    worst: float
    at: tuple[float, ...]
    median: float
    poor: int


@dataclass(frozen=True)
class Values:
    """Values of cells: their range, and how many cells have none."""

    name: str
    low: float
    high: float
    without: int


@dataclass(frozen=True)
class Inspection:
    """All of it; what a file that is refused does not let see is empty.

    elements: number of the elements of each shape, as "8 triangles of 6 nodes".  nodes, orphans: of the file, and
    those that no cell has.  groups: all that the file names, of which regions and boundaries are made.  node_sets: of
    nodes of cells, by which forces are given.  low, high:
    corners of the box about the cells, in the file's three coordinates where no mesh can be made.  turned: cells that
    are numbered in the other sense than most.  islands: in words, if there are several.  nearest: of
    a node, in words, if it was asked for.  refused: the sentence with
    which `read` refuses the file.
    """

    file: str
    kind: str
    elements: tuple[str, ...]
    nodes: int
    orphans: int = 0
    groups: tuple[Group, ...] = ()
    shape: str = ""
    cells: int = 0
    low: tuple[float, ...] = ()
    high: tuple[float, ...] = ()
    unit: str = ""
    regions: tuple[Named, ...] = ()
    boundaries: tuple[Named, ...] = ()
    node_sets: tuple[Group, ...] = ()
    values: tuple[Values, ...] = ()
    turned: int = 0
    islands: str = ""
    nearest: str = ""
    quality: Quality | None = None
    notices: tuple[str, ...] = ()
    refused: str = ""


def inspect(
    path: Path,
    parameters: Mapping[str, float] | None = None,
    keep: str | None = None,
    merge: bool = False,
    trusted: bool = False,
) -> tuple[Inspection, Parts | None]:
    """What a file holds, and its mesh if there is one; arguments as of `files.read`.

    InputError for a file that cannot be read at all.
    """
    found = content_of(path, parameters, trusted)
    seen, parts = Inspection(str(path), "of a format of its own", (), 0), None
    if isinstance(found, Content):
        seen = _of_content(path, found)
    try:
        whole = assembled(found, path, keep, merge)
        if not isinstance(found, Content):  # nobody has looked at its numbers
            check(whole, path)
        parts, seen = whole, _of_parts(seen, whole)
        check(whole, path)
    except InputError as error:
        seen = replace(seen, refused=str(error))
    return seen, parts


def _of_content(path: Path, content: Content) -> Inspection:
    """What can be told before anything is made of it, and if nothing can be: numbers in it may be of nothing."""
    dim = max((DIMENSIONS[kind.shape] for kind in content.elements if len(kind.nodes)), default=0)
    are_cells = [DIMENSIONS[kind.shape] == dim and dim > 1 for kind in content.elements]
    nodes = [kind.nodes.reshape(-1) for kind, is_cell in zip(content.elements, are_cells, strict=True) if is_cell]
    used = np.unique(np.concatenate([np.empty(0, dtype=np.int64), *nodes]))
    used = used[(used >= 0) & (used < len(content.points))]
    x = content.points[used]
    x = x[np.isfinite(x).all(axis=1)]
    of_cells = np.repeat(np.array(are_cells, dtype=bool), [len(kind.nodes) for kind in content.elements])
    named = ((content.groups, "elements"), (content.facet_sets, "facets"), (content.node_sets, "nodes"))
    seen = Inspection(
        str(path),
        content.kind,
        _elements(content),
        len(content.points),
        len(content.points) - len(used),
        tuple(Group(name, of, len(some)) for parts, of in named for name, some in parts.items()),
        values=_values({name: found[of_cells] for name, found in content.values.items()}),
        notices=content.notices,
    )
    return _with_extent(seen, x) if len(x) else seen


def _with_extent(seen: Inspection, x: Floats) -> Inspection:
    low, high = x.min(axis=0), x.max(axis=0)
    return replace(seen, low=_numbers(low), high=_numbers(high), unit=_unit(float((high - low).max())))


def _elements(content: Content) -> tuple[str, ...]:
    """The kinds of elements and their numbers."""
    counts: dict[tuple[str, int], int] = {}
    for kind in content.elements:
        key = kind.shape, kind.nodes.shape[1]
        counts[key] = counts.get(key, 0) + len(kind.nodes)
    return tuple(
        f"{count} {_word(shape, count)}" + (f" of {nodes} nodes" if nodes > len(AROUND[shape]) else "")
        for (shape, nodes), count in counts.items()
        if count
    )


def _word(shape: str, count: int) -> str:
    return _PLURALS[shape] if count > 1 else {"interval": "line"}.get(shape, shape)


def _of_parts(seen: Inspection, parts: Parts) -> Inspection:
    corners = parts.points[parts.cells]
    sizes = volumes(parts.shape, corners)
    of_cell = islands(parts.shape, parts.points, parts.cells)
    senses = np.sign(corner_sines(parts.shape, corners).sum(axis=1))
    return replace(
        _with_extent(seen, parts.points),
        nodes=seen.nodes or len(parts.points),
        shape=parts.shape,
        cells=len(parts.cells),
        regions=tuple(Named(name, len(rows), float(sizes[rows].sum())) for name, rows in parts.regions.items()),
        boundaries=tuple(
            Named(name, len(facets), float(_areas(parts, facets).sum())) for name, facets in parts.boundaries.items()
        ),
        node_sets=()
        if parts.origin is None
        else tuple(Group(name, "nodes", len(some)) for name, some in parts.origin.node_sets.items()),
        values=() if parts.origin is None else _values(parts.origin.values),
        turned=int(min(np.count_nonzero(senses > 0), np.count_nonzero(senses < 0))),
        islands=islands_in_words(parts.shape, parts.points, parts.cells, of_cell) if of_cell.any() else "",
        quality=_quality(parts.shape, corners),
        notices=parts.notices,
    )


def _numbers(values: Any) -> tuple[float, ...]:
    return tuple(float(value) for value in values)


def _values(data: Mapping[str, Floats]) -> tuple[Values, ...]:
    """The ranges of data, but for those that no cell has."""
    known = {name: found[np.isfinite(found)] for name, found in data.items()}
    return tuple(
        Values(name, float(some.min()), float(some.max()), len(data[name]) - len(some))
        for name, some in known.items()
        if len(some)
    )


def _areas(parts: Parts, facets: Indices) -> Floats:
    """Areas of facets, or lengths in the plane; those with nodes that no cell has count for nothing."""
    corners = parts.points[facets[(facets >= 0).all(axis=1)]]
    return np.asarray(np.linalg.norm(facet_vectors(corners), axis=1))


def nearest_in_words(parts: Parts, place: tuple[float, ...]) -> str:
    """The node nearest to a place, as a sentence; InputError for a place of other dimensions."""
    if len(place) != parts.dim or not np.isfinite(place).all():
        raise InputError(f"the place {place} has {len(place)} coordinates: {parts.dim} finite ones would be right")
    apart = np.linalg.norm(parts.points - np.array(place), axis=1)
    row = int(apart.argmin())
    number = row if parts.origin is None else int(parts.origin.nodes[row])
    return (
        f"node {number} (from 0) at {place_in_words(parts.points[row])}, {apart[row]:.6g} from {place_in_words(place)}"
    )


def _quality(shape: str, corners: Floats) -> Quality:
    found = qualities(shape, corners)
    worst = int(found.argmin())
    where = corners[worst].mean(axis=0)
    return Quality(
        MEASURES[shape], float(found[worst]), _numbers(where), float(np.median(found)), int((found < POOR).sum())
    )


def _unit(extent: float) -> str:
    """What the extent may be meant in, as a question."""
    if 0.005 <= extent < 2:
        return "is it in metres? a femur is 0.45 m long, and growthx's own scenes are in mm, N and MPa"
    if 2 <= extent < 2000:
        return "is it in mm? forces are in N then, and moduli in MPa"
    if extent >= 2000:
        return "is it in µm? in mm, where forces are in N and moduli in MPa, it would be larger than a body"
    return "in which unit is it? in mm, where forces are in N and moduli in MPa, it would be smaller than a cell"
