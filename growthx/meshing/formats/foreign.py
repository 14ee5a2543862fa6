"""Meshes of many programs: VTK's own (.vtu, .vtk) by VTK; by meshio XDMF, Salome, Nastran and Medit.

Scalar data of cells are values by their names.  Whole numbers of cells under a name that means groups, such as
MaterialIds or medit:ref (see `_GROUPS`), are groups as well, named by the number or, in files of Salome, as there.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from growthx.common.errors import InputError
from growthx.meshing.content import NO_NODE, Content, Elements
from growthx.meshing.formats.apart import process
from growthx.meshing.parts import no_parameters

if TYPE_CHECKING:
    from pathlib import Path

    from growthx.common.arrays import Indices

SUFFIXES = {
    ".vtu": "a VTK mesh",
    ".vtk": "a legacy VTK mesh",
    ".xdmf": "an XDMF mesh",
    ".med": "a Salome mesh",
    ".bdf": "a Nastran mesh",
    ".nas": "a Nastran mesh",
    ".mesh": "a Medit mesh",
}
# Names of whole numbers of cells that mean groups, in small letters without what is no letter or figure.
_GROUPS = re.compile(
    "(gmshphysical|meditref|nastranref|celltags|cellentity|cellmarker|mat|material|region|part|physical|domain|"
    "subdomain|label|marker|tag|group|zone|entity|attribute)(id)?s?"
)
MOST = 1000  # groups that numbers of cells are taken for
_PREFIXES = (
    ("triangle", "triangle"),
    ("quad", "quadrilateral"),
    ("tetra", "tetrahedron"),
    ("hexahedron", "hexahedron"),
    ("wedge", "prism"),
    ("pyramid", "pyramid"),
    ("line", "interval"),
    ("vertex", "point"),
)
_ROW_BY_ROW = {"pixel": ("quadrilateral", (0, 1, 3, 2)), "voxel": ("hexahedron", (0, 1, 3, 2, 4, 5, 7, 6))}


def read(path: Path, values: Mapping[str, float]) -> Content:
    """The mesh of a file, read by VTK or meshio in a process of its own."""
    no_parameters(path, values)
    library = "VTK" if path.suffix.lower() in (".vtu", ".vtk") else "meshio"
    found = process.arrays(f"{library.lower()}_reader", path, values)
    names = json.loads(str(found["names"]))
    points = found["points"]
    if points.ndim != 2 or points.shape[1] not in (2, 3):
        raise InputError(f"the nodes of {path} are of shape {points.shape}: two or three coordinates would be right")
    points = np.pad(points, ((0, 0), (0, 3 - points.shape[1])))
    elements = [_elements(path, kind, found[f"cells {number}"]) for number, kind in enumerate(names["kinds"])]
    dims = np.repeat(np.arange(len(elements)), [len(kind.nodes) for kind in elements])
    groups: dict[str, Indices] = {name: found[f"set {number}"] for number, name in enumerate(names["sets"])}
    data = {}
    notices = [f"of {path}, {library} says: {text}" for text in names["notices"]]
    for number, (name, whole) in enumerate(names["data"]):
        column = found[f"data {number}"]
        if len(column) != len(dims):
            continue
        plain = re.sub("[^a-z0-9]", "", name.lower())
        if whole and _GROUPS.fullmatch(plain) and len(np.unique(column)) > MOST:
            notices.append(f"'{name}' of {path} has more than {MOST} different numbers: they are values, and no groups")
        elif whole and _GROUPS.fullmatch(plain):
            for group, rows in _by_number(column, names, [kind.shape for kind in elements], dims).items():
                groups.setdefault(group, rows)
        if plain != "celltags":
            data[name] = column
    node_sets = {name: found[f"points {number}"] for number, name in enumerate(names["points"])}
    for number, of in names["point_tags"].items():
        rows = np.flatnonzero(found.get("point tags", np.empty(0)) == int(number))
        for name in of:
            node_sets[name] = np.union1d(node_sets.get(name, rows), rows)
    return Content(
        f"{SUFFIXES[path.suffix.lower()].split(' ', 1)[1]}, by {library}",
        points,
        tuple(elements),
        {name: rows for name, rows in groups.items() if len(rows)},
        {name: rows for name, rows in node_sets.items() if len(rows)},
        values=data,
        notices=tuple(notices),
    )


def _elements(path: Path, kind: str, nodes: Indices) -> Elements:
    """The elements of a block of meshio's, in the order that goes round."""
    if kind in _ROW_BY_ROW:
        shape, order = _ROW_BY_ROW[kind]
        return Elements(shape, nodes[:, list(order)])
    for prefix, shape in _PREFIXES:
        if re.fullmatch(rf"{prefix}\d*", kind) and nodes.shape[1]:
            return Elements(shape, np.where(nodes < 0, NO_NODE, nodes))
    raise InputError(
        f"{path} has {len(nodes)} cells of the kind '{kind}': triangles, quadrilaterals, tetrahedra or hexahedra would "
        "be right"
    )


def _by_number(column: Any, names: Mapping[str, Any], shapes: list[str], blocks: Indices) -> dict[str, Indices]:
    """Elements of each group that a column of whole numbers tells, by its name or else its number."""
    of_number = {pair[0]: name for name, pair in names["fields"].items()}
    groups: dict[str, Indices] = {}
    for number in np.unique(column).astype(np.int64):
        rows = np.flatnonzero(column == number)
        known = names["tags"].get(str(number))
        if names["tags"] and known is None:
            continue  # a family of Salome's in no group
        for name in known or [of_number.get(int(number), str(number))]:
            groups[name] = np.union1d(groups.get(name, rows), rows)
    return groups
