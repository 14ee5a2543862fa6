"""Run in a process of its own by `apart`: a file of VTK by VTK itself, in plain arrays as those of `meshio_reader`.

meshio leaves out cells that it does not know, such as voxels.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

# meshio's names by VTK's numbers of types of cells; corners come first in all.
_KINDS = {
    1: "vertex",
    3: "line",
    5: "triangle",
    8: "pixel",
    9: "quad",
    10: "tetra",
    11: "voxel",
    12: "hexahedron",
    13: "wedge",
    14: "pyramid",
    21: "line",
    22: "triangle",
    23: "quad",
    24: "tetra",
    25: "hexahedron",
    26: "wedge",
    27: "pyramid",
    28: "quad",
    29: "hexahedron",
    34: "triangle",
    68: "line",
    69: "triangle",
    70: "quad",
    71: "tetra",
    72: "hexahedron",
    73: "wedge",
    74: "pyramid",
}


def arrays(path: str, values: Mapping[str, float], refuse: Callable[[str], None]) -> dict[str, Any]:
    """Points, the nodes of the cells of each kind, and data in the order of those; "names" tells what is what.

    refuse: ends it with a sentence about the file.
    """
    from vtkmodules.util.numpy_support import vtk_to_numpy

    grid = _grid(path, refuse)
    count = grid.GetNumberOfCells()
    points = np.empty((0, 3)) if grid.GetPoints() is None else vtk_to_numpy(grid.GetPoints().GetData())
    types = vtk_to_numpy(grid.GetCellTypesArray()) if count else np.empty(0, dtype=np.int64)
    offsets = vtk_to_numpy(grid.GetCells().GetOffsetsArray()) if count else np.zeros(1, dtype=np.int64)
    nodes = vtk_to_numpy(grid.GetCells().GetConnectivityArray()) if count else np.empty(0, dtype=np.int64)
    if len(offsets) != count + 1 or np.any(np.diff(offsets) < 0) or (count and offsets[-1] != len(nodes)):
        refuse("has cells that do not fit to their nodes: a whole file is needed")
    found: dict[str, Any] = {"points": points.astype(float)}
    kinds: list[str] = []
    order = []
    pairs, which = np.unique(np.column_stack([types, np.diff(offsets)]), axis=0, return_inverse=True)
    for number, (kind, width) in enumerate(pairs.tolist()):
        rows = np.flatnonzero(which.reshape(-1) == number)
        if kind not in _KINDS:
            right = "triangles, quadrilaterals, tetrahedra or hexahedra would be right"
            refuse(f"has {len(rows)} cells of VTK's type {kind}: {right}")
        if _KINDS[kind] in kinds:
            refuse(f"has {_KINDS[kind]} cells of several orders: one would be right")
        found[f"cells {number}"] = nodes[np.add.outer(offsets[rows], np.arange(width))].astype(np.int64)
        kinds.append(_KINDS[kind])
        order.append(rows)
    sorting = np.concatenate([np.empty(0, dtype=np.int64), *order])
    names: dict[str, Any] = {"kinds": kinds, "data": [], "sets": [], "points": [], "tags": {}, "point_tags": {}}
    data = grid.GetCellData()
    for place in range(data.GetNumberOfArrays()):
        column = data.GetArray(place)
        if column is None or column.GetNumberOfComponents() != 1 or column.GetNumberOfTuples() != count:
            continue
        numbers = vtk_to_numpy(column)
        found[f"data {len(names['data'])}"] = numbers[sorting].astype(float)
        names["data"].append([column.GetName() or f"data {place}", numbers.dtype.kind in "iu"])
    names |= {"fields": {}, "notices": []}
    found["names"] = np.array(json.dumps(names))
    return found


def _grid(path: str, refuse: Callable[[str], None]) -> Any:
    """The file as an unstructured grid."""
    from vtkmodules.vtkCommonCore import vtkObject
    from vtkmodules.vtkFiltersCore import vtkAppendFilter
    from vtkmodules.vtkIOLegacy import vtkGenericDataObjectReader
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

    with open(path, "rb") as file:
        head = file.read(4096)
    if b"<!DOCTYPE" in head or b"<!ENTITY" in head:
        refuse("has entities of XML, with which a file can fill the memory or read others: one without is needed")
    complaints: list[str] = []
    vtkObject.GlobalWarningDisplayOff()
    reader = vtkGenericDataObjectReader() if path.lower().endswith(".vtk") else vtkXMLUnstructuredGridReader()
    reader.AddObserver("ErrorEvent", lambda *_: complaints.append("it cannot be read whole"))
    reader.SetFileName(path)
    if reader.IsA("vtkXMLReader") and not reader.CanReadFile(path):
        refuse('is no unstructured grid of VTK: <VTKFile type="UnstructuredGrid"> would be right')
    reader.Update()
    output = reader.GetOutput() if reader.IsA("vtkXMLReader") else reader.GetOutputDataObject(0)
    if complaints or output is None or not output.IsA("vtkDataSet"):
        refuse("is not whole, or holds no mesh: a file that ParaView opens is needed")
    if output.IsA("vtkUnstructuredGrid"):
        return output
    append = vtkAppendFilter()
    append.AddInputData(output)
    append.Update()
    return append.GetOutput()
