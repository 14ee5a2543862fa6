"""Models of FEBio (.feb, versions 2 to 4): parts and element sets are groups, surfaces and node sets boundaries.

Our own reader, as meshio and gmsh have none.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from growthx.common.errors import InputError, shown
from growthx.meshing.content import AROUND, Content, Elements
from growthx.meshing.parts import no_parameters

if TYPE_CHECKING:
    from pathlib import Path

    from growthx.common.arrays import Floats, Indices

SUFFIXES = {".feb": "an FEBio model"}

# Shape, and number of nodes, by the name of a type.
_TYPES = {
    "tri3": ("triangle", 3),
    "tri6": ("triangle", 6),
    "tri7": ("triangle", 7),
    "quad4": ("quadrilateral", 4),
    "quad8": ("quadrilateral", 8),
    "quad9": ("quadrilateral", 9),
    "q4ans": ("quadrilateral", 4),
    "q4eas": ("quadrilateral", 4),
    "tet4": ("tetrahedron", 4),
    "tet5": ("tetrahedron", 5),
    "tet10": ("tetrahedron", 10),
    "tet15": ("tetrahedron", 15),
    "tet20": ("tetrahedron", 20),
    "hex8": ("hexahedron", 8),
    "hex20": ("hexahedron", 20),
    "hex27": ("hexahedron", 27),
    "penta6": ("prism", 6),
    "penta15": ("prism", 15),
    "pyra5": ("pyramid", 5),
    "pyra13": ("pyramid", 13),
    "line2": ("interval", 2),
    "line3": ("interval", 3),
    "truss2": ("interval", 2),
}


def read(path: Path, values: Mapping[str, float]) -> Content:
    """The mesh of a model."""
    no_parameters(path, values)
    root = parsed(path)
    mesh = root.find("Mesh")
    mesh = root.find("Geometry") if mesh is None else mesh
    if root.tag != "febio_spec" or mesh is None:
        raise InputError(f"{path} is no FEBio model with a mesh: <febio_spec> with <Mesh> or <Geometry> would be right")
    tags, points, node_sets = _nodes(path, mesh)
    index = _Index(path, tags, "node")
    elements, numbers, groups = _elements(path, mesh, index)
    of = _Index(path, numbers, "element")
    names: dict[str, Indices] = {}
    for one in mesh.iter("ElementSet"):
        names[_name(path, one)] = of.places(_members(path, one, "e", "elem"))
    facets = {_name(path, one): _surface(path, one, index) for one in mesh.iter("Surface")}
    for one in mesh.iter("NodeSet"):
        node_sets[_name(path, one)] = _members(path, one, "n", "node")
    return Content(
        f"FEBio model {root.get('version', 'without a version')}",
        points,
        tuple(elements),
        {**groups, **{name: rows for name, rows in names.items() if len(rows)}},
        {name: np.unique(index.places(nodes)) for name, nodes in node_sets.items() if len(nodes)},
        {name: found for name, found in facets.items() if len(found)},
        _data(path, root, names, len(numbers)),
    )


def parsed(path: Path) -> Any:
    """The root of a file in XML, without entities; InputError for a file that is none."""
    from defusedxml import ElementTree
    from defusedxml.common import DefusedXmlException

    try:
        return ElementTree.parse(path).getroot()
    except DefusedXmlException:
        raise InputError(
            f"{path} has entities of XML, with which a file can fill the memory or read others: one without is needed"
        ) from None
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise InputError(f"{path} is not whole, as XML ({error}): a file that FEBio reads is needed") from None


def _name(path: Path, one: Any) -> str:
    name = one.get("name")
    if not name:
        raise InputError(f"a <{one.tag}> of {path} has no name: one is needed")
    return str(name)


def _numbers(path: Path, what: str, words: list[str], kind: type[Any]) -> Any:
    try:
        return np.array([kind(word) for word in words], dtype=np.int64 if kind is int else float)
    except (ValueError, OverflowError):
        right = "whole numbers" if kind is int else "numbers"
        raise InputError(f"the numbers of {what} of {path} are not all {right}, as they should be") from None


def _rows(path: Path, what: str, lines: list[str], kind: type[Any]) -> Any:
    """Numbers of lines with as many each, (lines, numbers)."""
    rows = [line.replace(",", " ").split() for line in lines]
    widths = {len(row) for row in rows}
    if len(widths) > 1:
        raise InputError(
            f"{what} of {path} has {min(widths)} to {max(widths)} numbers in a row: as many in each is right"
        )
    return _numbers(path, what, [word for row in rows for word in row], kind).reshape(len(rows), -1)


def _nodes(path: Path, mesh: Any) -> tuple[Indices, Floats, dict[str, Indices]]:
    """Numbers and coordinates of all nodes, and the numbers of those of each block with a name."""
    tags, lines, sets = [], [], {}
    for block in mesh.iter("Nodes"):
        own = [node.get("id", "") for node in block.iter("node")]
        lines += [node.text or "" for node in block.iter("node")]
        tags += own
        if block.get("name"):
            sets[str(block.get("name"))] = _numbers(path, "nodes", own, int)
    points = _rows(path, "<Nodes>", lines, float)
    if len(points) and points.shape[1] != 3:
        raise InputError(f"the nodes of {path} have {points.shape[1]} coordinates: three would be right")
    return _numbers(path, "nodes", tags, int), points.reshape(-1, 3), sets


class _Index:
    """Places of things by their numbers in the file."""

    def __init__(self, path: Path, tags: Indices, what: str) -> None:
        self._path, self._tags, self._what = path, tags, what
        self._order = np.argsort(tags, kind="stable")

    def places(self, wanted: Indices) -> Indices:
        """Places by numbers; InputError for one that there is not."""
        if not len(self._tags) and wanted.size:
            raise InputError(f"{self._path} has no {self._what}s: a whole file is needed")
        if not wanted.size:
            return wanted
        place = np.searchsorted(self._tags, wanted, sorter=self._order)
        found: Indices = self._order[np.minimum(place, len(self._tags) - 1)]
        wrong = wanted[self._tags[found] != wanted]
        if len(wrong):
            raise InputError(
                f"{self._path} speaks of the {self._what} {wrong[0]}, which it does not have: a whole file is needed"
            )
        return found


def _elements(path: Path, mesh: Any, index: _Index) -> tuple[list[Elements], Indices, dict[str, Indices]]:
    """The elements by their blocks, their numbers in the file, and the elements of each part."""
    elements: list[Elements] = []
    numbers: list[Indices] = [np.empty(0, dtype=np.int64)]
    groups: dict[str, list[Indices]] = {}
    start = 0
    for place, block in enumerate(mesh.iter("Elements"), start=1):
        kind = str(block.get("type", "")).lower()
        if kind not in _TYPES:
            raise InputError(f"the elements of {path} are of the type {shown(kind)}: one such as tet4 or hex8 is right")
        shape, width = _TYPES[kind]
        inner = [one for one in block if one.tag in ("elem", "e")]
        nodes = _rows(path, f"the elements '{kind}'", [one.text or "" for one in inner], int)
        if not len(nodes):
            continue
        if nodes.shape[1] != width:
            raise InputError(f"elements '{kind}' of {path} have {nodes.shape[1]} nodes: {width} would be right")
        elements.append(Elements(shape, index.places(nodes)))
        numbers.append(_numbers(path, "elements", [one.get("id", "") for one in inner], int))
        name = block.get("name") or block.get("elset") or block.get("mat") or f"part {place}"
        groups.setdefault(str(name), []).append(np.arange(start, start + len(nodes)))
        start += len(nodes)
    return elements, np.concatenate(numbers), {name: np.concatenate(rows) for name, rows in groups.items()}


def _members(path: Path, one: Any, *tags: str) -> Indices:
    """Numbers in a set, one by one or as a list with commas."""
    inner = [entry.get("id", "") for entry in one if entry.tag in tags]
    return np.asarray(_numbers(path, f"<{one.tag}>", inner or (one.text or "").replace(",", " ").split(), int))


def _surface(path: Path, one: Any, index: _Index) -> Indices:
    """Nodes of the corners of a surface's facets."""
    blocks: dict[str, list[str]] = {}
    for facet in one:
        if facet.tag in _TYPES:
            blocks.setdefault(facet.tag, []).append(facet.text or "")
    found: list[Indices] = []
    for kind, lines in blocks.items():
        nodes = _rows(path, f"the surface '{one.get('name')}'", lines, int)
        found.append(index.places(nodes)[:, : len(AROUND[_TYPES[kind][0]])])
    widths = {facets.shape[1] for facets in found}
    if len(widths) > 1:
        raise InputError(
            f"the surface '{one.get('name')}' of {path} has triangles and quadrilaterals: facets of one kind are needed"
        )
    return np.concatenate(found) if found else np.empty((0, 3), dtype=np.int64)


def _data(path: Path, root: Any, sets: Mapping[str, Indices], count: int) -> dict[str, Floats]:
    """Scalar values of elements of <MeshData>, by their names; lids count the elements of a set from 1."""
    values: dict[str, Floats] = {}
    for one in root.iter("ElementData"):
        name = one.get("name") or one.get("var") or one.get("type")
        rows = sets.get(str(one.get("elem_set")))
        inner = [entry for entry in one if entry.tag in ("elem", "e")]
        if (
            not name
            or rows is None
            or one.get("datatype", "scalar") != "scalar"
            or one.get("data_type", "scalar") != "scalar"
        ):
            continue
        if any("," in (entry.text or "") for entry in inner):
            continue
        lids = _numbers(path, "<ElementData>", [entry.get("lid", "") for entry in inner], int) - 1
        if len(lids) and not (lids.min() >= 0 and lids.max() < len(rows)):
            wrong = lids[(lids < 0) | (lids >= len(rows))][0] + 1
            raise InputError(
                f"the data '{name}' of {path} are of the element with lid {wrong}, which its set does not have: "
                f"{'1' if len(rows) == 1 else f'1 to {len(rows)}'} would be right"
            )
        column = values.setdefault(str(name), np.full(count, np.nan))
        column[rows[lids]] = _numbers(path, "<ElementData>", [entry.text or "" for entry in inner], float)
    return values
