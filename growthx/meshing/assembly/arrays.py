"""Arrays of a mesh, as other libraries have them in memory, as the content of a file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from growthx.common.checks import require_kind, require_name
from growthx.common.errors import InputError, shown
from growthx.fem.cells import PLURALS
from growthx.meshing.content import AROUND, Content, Elements

if TYPE_CHECKING:
    from growthx.common.arrays import Floats, Indices

# Shapes by the number of nodes of a cell, of first, second and full second order.
_SHAPES = {
    3: ("triangle",),
    6: ("triangle",),
    4: ("tetrahedron", "quadrilateral"),
    10: ("tetrahedron",),
    8: ("hexahedron", "quadrilateral"),
    9: ("quadrilateral",),
    20: ("hexahedron",),
    27: ("hexahedron",),
}


def as_content(
    points: Any,
    cells: Any,
    regions: Mapping[str, Any],
    boundaries: Mapping[str, Any],
    cell_data: Mapping[str, Any],
    shape: str | None,
) -> Content:
    """The content of arrays, see `files.from_arrays`; InputError for arrays of no use."""
    for parts, what in ((regions, "regions"), (boundaries, "boundaries"), (cell_data, "cell_data")):
        require_kind(parts, Mapping, f"{what}, of arrays,", "a mapping from names to arrays")
        for name in parts:
            require_name(name, f"a name in the {what} of arrays")
    x = _points(points)
    nodes = _numbers("the cells", cells, len(x), (2,))
    if not len(nodes):
        raise InputError("the cells are none at all: the nodes of one at least would be right")
    elements = Elements(_shape(nodes.shape[1], shape, x[np.unique(nodes)]), nodes)
    node_sets: dict[str, Indices] = {}
    facet_sets: dict[str, Indices] = {}
    for name, given in boundaries.items():
        found = _numbers(f"the boundary '{name}'", given, len(x), (1, 2))
        if not len(found):
            raise InputError(
                f"the boundary '{name}' has no facets or nodes: those of one facet at least would be right"
            )
        (node_sets if found.ndim == 1 else facet_sets)[name] = found
    return Content(
        "arrays",
        x,
        (elements,),
        {name: _rows(f"the region '{name}'", rows, len(nodes)) for name, rows in regions.items()},
        node_sets,
        facet_sets,
        {name: _values(name, values, len(nodes)) for name, values in cell_data.items()},
    )


def _points(points: Any) -> Floats:
    """Coordinates of nodes in space."""
    right = "two or three numbers for each node, of shape (nodes, 2) or (nodes, 3), would be right"
    try:
        x = np.asarray(points)
    except ValueError:
        raise InputError(f"the points are {shown(points)}: {right}") from None
    if x.dtype.kind not in "iuf" or x.ndim != 2 or x.shape[1] not in (2, 3):
        raise InputError(f"the points are {shown(points)}: {right}")
    return np.pad(x.astype(float), ((0, 0), (0, 3 - x.shape[1])))


def _numbers(what: str, given: Any, end: int, dims: tuple[int, ...]) -> Indices:
    """Whole numbers from 0 to before `end` in an array of so many dimensions."""
    wanted = " or ".join({1: "a row of them", 2: "a row of them for each"}[dim] for dim in dims)
    right = f"whole numbers from 0, below {end}, {wanted}, would be right"
    try:
        found = np.asarray(given)
    except ValueError:
        raise InputError(f"{what}: {shown(given)} are no such numbers: {right}") from None
    if found.size and found.dtype.kind not in "iu":
        raise InputError(f"the numbers of {what} are {shown(given)}: {right}")
    if found.ndim not in dims:
        raise InputError(f"the numbers of {what} are of shape {found.shape}: {right}")
    numbers = found.astype(np.int64)
    if numbers.size and not (numbers.min() >= 0 and numbers.max() < end):
        wrong = numbers[(numbers < 0) | (numbers >= end)][0]
        raise InputError(f"the numbers of {what} have {wrong} among them: {right}")
    return numbers


def _shape(width: int, shape: str | None, points: Floats) -> str:
    """The shape of cells of so many nodes; points: of theirs."""
    fitting = _SHAPES.get(width, ())
    if shape is not None:
        if shape not in PLURALS:
            raise InputError(f"the shape of the cells is {shown(shape)}: one of {', '.join(PLURALS)} would be right")
        if width < len(AROUND[shape]):
            raise InputError(f"the cells have {width} nodes each: {len(AROUND[shape])} would be right for a {shape}")
        return shape
    if not fitting:
        raise InputError(
            f"the cells have {width} nodes each: 3, 4 or 8, or those of elements of second order, would be right"
        )
    spread = np.ptp(points, axis=0)
    plane = spread.min() <= 1e-9 * spread.max()
    return fitting[-1] if plane else fitting[0]


def _rows(what: str, given: Any, count: int) -> Indices:
    """Numbers of cells, or True for each of them."""
    found = np.asarray(given)
    if found.dtype == bool:
        if found.shape != (count,):
            raise InputError(f"{what} has {found.shape} marks: one for each of the {count} cells would be right")
        return np.flatnonzero(found)
    rows = _numbers(what, given, count, (1,))
    if not len(rows):
        raise InputError(f"{what} has no cells: one at least would be right")
    return rows


def _values(name: str, given: Any, count: int) -> Floats:
    """One value for each cell."""
    found = np.asarray(given)
    if found.dtype.kind not in "iuf" or found.shape != (count,):
        raise InputError(
            f"the cell data '{name}' are {shown(given)}: one number for each of the {count} cells would be right"
        )
    return found.astype(float)
