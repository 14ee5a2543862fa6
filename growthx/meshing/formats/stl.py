"""Closed surfaces of triangles (.stl, .ply), filled with tetrahedra by gmsh in a process of its own.

    gx.meshing.read("femur.stl", size=3.0)               the surface's triangles stay as they are
    gx.meshing.read("femur.stl", size=3.0, remesh=True)  they become as large as the tetrahedra

A shell inside another one is a hole in it.  The boundary "surface" is all of the surface; `patches` takes it apart.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from numbers import Real
from typing import TYPE_CHECKING

import numpy as np

from growthx.common.errors import InputError, shown
from growthx.meshing.content import Content, Elements
from growthx.meshing.formats.apart import process
from growthx.meshing.parts import quoted

if TYPE_CHECKING:
    from pathlib import Path

SUFFIXES = {".stl": "a closed surface", ".ply": "a closed surface"}
SECONDS = 600.0, 60.0  # a fine mesh takes minutes


def read(path: Path, values: Mapping[str, float]) -> Content:
    """The body in a surface.

    values: size, of the tetrahedra, in the file's unit of length; remesh, whether the surface gets triangles of that
    size as well.
    """
    if unknown := sorted(set(values) - {"size", "remesh"}):
        raise InputError(f"{path} is a surface and has no parameter {quoted(unknown)}: size and remesh would be right")
    size, remesh = values.get("size"), values.get("remesh", False)
    if size is not None and not (isinstance(size, Real) and math.isfinite(size) and size > 0):
        raise InputError(f"the size of the tetrahedra in {path} is {shown(size)}: a positive number would be right")
    if not isinstance(remesh, (bool, int)) or remesh not in (0, 1):
        raise InputError(f"remesh, of {path}, is {shown(remesh)}: True or False would be right")
    given = {name: float(value) for name, value in values.items()}
    found = process.arrays("stl_reader", path, given, SECONDS)
    cells, facets = Elements("tetrahedron", found["cells"]), Elements("triangle", found["facets"])
    return Content(
        f"closed surface, filled with tetrahedra of size {size:g}",
        found["points"],
        (cells, facets),
        {"surface": np.arange(len(cells.nodes), len(cells.nodes) + len(facets.nodes))},
    )
