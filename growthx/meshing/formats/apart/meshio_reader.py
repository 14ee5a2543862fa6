"""Run in a process of its own by `apart`: a file as meshio has it, in plain arrays."""

from __future__ import annotations

import contextlib
import io
import json
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np


def arrays(path: str, values: Mapping[str, float], refuse: Callable[[str], None]) -> dict[str, Any]:
    """Points, the nodes of each block of cells, data and sets, numbered through; "names" tells what is what.

    refuse: ends it with a sentence about the file.
    """
    mesh, warned = _read(path, refuse)
    found: dict[str, Any] = {"points": np.asarray(mesh.points, dtype=float)}
    kinds = []
    for number, block in enumerate(mesh.cells):
        kinds.append(block.type)
        data = block.data
        if not isinstance(data, np.ndarray) or data.dtype == object or data.ndim != 2:
            data = np.empty((len(data), 0), dtype=np.int64)  # of polyhedra: their number is told
        found[f"cells {number}"] = data.astype(np.int64)
    names: dict[str, Any] = {"kinds": kinds, "data": [], "sets": [], "points": [], "tags": {}, "point_tags": {}}
    for name, blocks in mesh.cell_data.items():
        columns = [np.asarray(block) for block in blocks]
        columns = [block[:, 0] if block.ndim == 2 and block.shape[1] == 1 else block for block in columns]
        if columns and all(block.ndim == 1 and block.dtype.kind in "iufb" for block in columns):
            whole = all(block.dtype.kind in "iu" for block in columns)
            found[f"data {len(names['data'])}"] = np.concatenate([block.astype(float) for block in columns])
            names["data"].append([name, whole])
    starts = np.cumsum([0, *(len(block.data) for block in mesh.cells)])
    for name, parts in mesh.cell_sets.items():
        rows = [
            start + np.asarray(part, dtype=np.int64)
            for start, part in zip(starts, parts, strict=False)
            if part is not None and len(part)
        ]
        if name.startswith("gmsh:"):
            continue
        found[f"set {len(names['sets'])}"] = np.concatenate([np.empty(0, dtype=np.int64), *rows])
        names["sets"].append(name)
    for name, part in mesh.point_sets.items():
        found[f"points {len(names['points'])}"] = np.asarray(part, dtype=np.int64).reshape(-1)
        names["points"].append(name)
    names["fields"] = {
        name: [int(x) for x in np.asarray(pair).reshape(-1)[:2]]
        for name, pair in mesh.field_data.items()
        if np.asarray(pair).size == 2 and np.asarray(pair).dtype.kind in "iu"
    }
    for which, kind in (("tags", "cell_tags"), ("point_tags", "point_tags")):
        names[which] = {str(number): list(of) for number, of in getattr(mesh, kind, {}).items()}
    if "point_tags" in mesh.point_data:
        found["point tags"] = np.asarray(mesh.point_data["point_tags"], dtype=np.int64)
    names["notices"] = warned
    found["names"] = np.array(json.dumps(names))
    return found


def _read(path: str, refuse: Callable[[str], None]) -> tuple[Any, list[str]]:
    """The file as meshio has it, and what it warns of."""
    import defusedxml

    defusedxml.defuse_stdlib()  # before meshio has its parser: no entities, from this file or another
    import meshio

    said_of_it = io.StringIO()
    try:
        with contextlib.redirect_stderr(said_of_it):
            mesh = meshio.read(_with_its_beginning(path))
    except MemoryError:
        raise
    except BaseException as error:  # it ends programs, too
        said = " ".join(f"{said_of_it.getvalue()} {error}".split())[:200]
        name = type(error).__name__
        if name in ("EntitiesForbidden", "DTDForbidden", "ExternalReferenceForbidden"):
            refuse("has entities of XML, with which a file can fill the memory or read others: one without is needed")
        refuse(f"cannot be read by meshio ({name}{f': {said}' if said else ''}): a whole file of its format is needed")
        raise
    warned = " ".join(said_of_it.getvalue().split()).split("Warning: ")[1:]
    return mesh, list(dict.fromkeys(text.strip() for text in warned))


def _with_its_beginning(path: str) -> str:
    """A Nastran file, in the temporary folder of work with the line that meshio looks for, where gmsh leaves it out."""
    if not path.lower().endswith((".bdf", ".nas")):
        return path
    with open(path, encoding="latin-1") as file:
        text = file.read()
    if "BEGIN BULK" in text.upper():
        return path
    with open("bulk.bdf", "w", encoding="latin-1") as file:
        file.write(f"BEGIN BULK\n{text}" + ("" if "ENDDATA" in text.upper() else "\nENDDATA\n"))
    return "bulk.bdf"
