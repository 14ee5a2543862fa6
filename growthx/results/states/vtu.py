"""VTK's files in XML: a part for each rank (.vtu), a file that joins them (.pvtu), and one that names all times (.pvd).

Numbers are in binary, after the text that names them: all digits, in a fraction of the time and room that text takes.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import numpy as np

if TYPE_CHECKING:
    from growthx.common.arrays import Floats
    from growthx.results.states.grid import Grid, State

# Version 2.2: hexahedra of the second degree have their nodes in VTK's order of today.
HEAD = f'<?xml version="1.0"?>\n<VTKFile type="{{}}" version="2.2" byte_order="{sys.byteorder.title()}Endian"'
HEAD += ' header_type="UInt64">\n'
END = "</VTKFile>\n"
COUNT = np.dtype(np.uint64)  # of bytes, before each block of them
NAMES = {"f8": "Float64", "i8": "Int64", "i4": "Int32", "u1": "UInt8"}


class Part:
    """The .vtu files of a rank, whose cells are laid out once."""

    def __init__(self, grid: Grid) -> None:
        points, corners = len(grid.points), grid.cells.shape[1]
        whole = np.int32 if grid.cells.size < np.iinfo(np.int32).max else np.int64
        self._head = f'<Piece NumberOfPoints="{points}" NumberOfCells="{len(grid.cells)}">\n'
        self._cells: dict[str, Mapping[str, Any]] = {
            "Points": {"Points": np.ascontiguousarray(grid.points)},
            "Cells": {
                "connectivity": grid.cells.astype(np.int32).ravel(),
                "offsets": corners * np.arange(1, len(grid.cells) + 1, dtype=whole),
                "types": np.full(len(grid.cells), grid.kind, dtype=np.uint8),
            },
        }

    def content(self, state: State, time: float) -> Iterator[bytes | memoryview]:
        """A file, part by part."""
        blocks: list[Floats] = []
        lines = [HEAD.format("UnstructuredGrid"), "<UnstructuredGrid>\n<FieldData>\n"]
        lines.append(f'<DataArray type="Float64" Name="TimeValue" NumberOfTuples="1" format="ascii">{time!r}')
        lines.append("</DataArray>\n</FieldData>\n" + self._head)
        found = {"PointData": {**state.at_points, **state.beside}, "CellData": state.in_cells}
        start = 0
        for place, fields in (*self._cells.items(), *found.items()):
            lines.append(f"<{place}>\n")
            for name, values in fields.items():
                lines.append(f'<DataArray {_kind(name, values)} format="appended" offset="{start}" />\n')
                blocks.append(np.ascontiguousarray(values))
                start += COUNT.itemsize + blocks[-1].nbytes
            lines.append(f"</{place}>\n")
        lines.append('</Piece>\n</UnstructuredGrid>\n<AppendedData encoding="raw">\n_')
        yield "".join(lines).encode()
        for block in blocks:
            yield COUNT.type(block.nbytes).tobytes()
            yield block.data
        yield ("\n</AppendedData>\n" + END).encode()


def joined(state: State, parts: Iterable[str]) -> str:
    """The .pvtu of the .vtu files of all ranks."""
    lines = [HEAD.format("PUnstructuredGrid") + '<PUnstructuredGrid GhostLevel="0">\n']
    lines.append(f"<PPoints>\n<PDataArray {_kind('Points', np.empty((0, 3)))} />\n</PPoints>\n")
    for place, fields in (("PPointData", state.at_points), ("PCellData", state.in_cells)):
        inside = "".join(f"<PDataArray {_kind(name, values)} />\n" for name, values in fields.items())
        lines.append(f"<{place}>\n{inside}</{place}>\n")
    lines += [f'<Piece Source="{part}" />\n' for part in parts]
    return "".join([*lines, "</PUnstructuredGrid>\n", END])


def listed(entries: Iterable[tuple[float, str]]) -> str:
    """The .pvd of times and their files."""
    lines = [f'<DataSet timestep="{time!r}" part="0" file="{name}" />\n' for time, name in entries]
    return "".join([HEAD.format("Collection"), "<Collection>\n", *lines, "</Collection>\n", END])


def entries(file: Path) -> list[tuple[float, str]]:
    """The times of a .pvd and their files; OSError if it is none."""
    try:
        found = ElementTree.parse(file).getroot().iter("DataSet")
        return [(float(entry.attrib["timestep"]), entry.attrib["file"]) for entry in found]
    except (ElementTree.ParseError, KeyError, ValueError) as error:
        raise OSError(0, f"{file.name} is damaged: {error}") from error


def write_whole(file: Path, content: Iterable[bytes | memoryview], *, over: bool = False) -> None:
    """Write a file aside and put it in its place; OSError if that cannot be, and then it is as it was before.

    over: also over one that is there.  A program may be killed at any moment; that the disk itself has all of it is not
    waited for, which would take longer than all else.
    """
    if not over and file.exists():
        raise FileExistsError(0, f"{file.name} is there already")
    part = file.with_name(f".{file.name}.part")
    try:
        with part.open("wb") as stream:
            for each in content:
                stream.write(each)
        part.replace(file)
    finally:
        part.unlink(missing_ok=True)


def _kind(name: str, values: Floats) -> str:
    components = f' NumberOfComponents="{values.shape[1]}"' if values.ndim > 1 else ""
    return f'type="{NAMES[values.dtype.str[1:]]}" Name="{name}"{components}'
