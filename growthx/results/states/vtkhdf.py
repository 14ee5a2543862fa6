"""VTK's file in HDF5: all times of a grid in one, which has its cells once.

The layout is VTKHDF 2.0 of an unstructured grid that stays as it is, in a part for each rank.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from growthx.common.errors import InputError

if TYPE_CHECKING:
    from growthx.common.arrays import Floats
    from growthx.results.states.grid import Grid, State

MOST = 1_000_000  # rows of a chunk
ONCE = ("PartOffsets", "PointOffsets", "CellOffsets", "ConnectivityIdOffsets")  # where cells begin: at every time, at 0


def require_h5py() -> None:
    """Refuse to write files of HDF5 where there is nothing to write them."""
    if find_spec("h5py") is None:
        raise InputError(
            "states in a .vtkhdf need h5py, which is not installed: it, or files without vtkhdf, would be right"
        )


def begin(path: Path, grids: Sequence[Grid]) -> None:
    """Make a file of no times; grids: of all ranks."""
    with _opened(path, "w-") as root:
        root.attrs["Version"] = (2, 0)
        kind = b"UnstructuredGrid"
        root.attrs.create("Type", kind, dtype=f"S{len(kind)}")
        for name, numbers in (
            ("NumberOfPoints", [len(grid.points) for grid in grids]),
            ("NumberOfCells", [len(grid.cells) for grid in grids]),
            ("NumberOfConnectivityIds", [grid.cells.size for grid in grids]),
        ):
            root[name] = np.array(numbers, dtype=np.int64)
        root["Points"] = np.concatenate([grid.points for grid in grids])
        root["Connectivity"] = np.concatenate([grid.cells.ravel() for grid in grids]).astype(np.int64)
        ends = [grid.cells.shape[1] * np.arange(len(grid.cells) + 1) for grid in grids]
        root["Offsets"] = np.concatenate(ends).astype(np.int64)
        kinds = [np.full(len(grid.cells), grid.kind, dtype=np.uint8) for grid in grids]
        root["Types"] = np.concatenate(kinds)
        steps = root.create_group("Steps")
        steps.attrs["NSteps"] = np.int64(0)
        _make(steps, "Values", np.empty(0))
        for name in ("NumberOfParts", *ONCE):
            _make(steps, name, np.empty((0, 1) if name in ONCE[2:] else 0, dtype=np.int64))
        for name in ("PointData", "CellData"):
            root.create_group(name)
            steps.create_group(f"{name}Offsets")


def append(path: Path, states: Sequence[State], time: float) -> None:
    """Append a state, in the parts that all ranks have of it."""
    with _opened(path, "r+") as root:
        steps, parts = root["Steps"], len(root["NumberOfPoints"])
        for place, fields in (("PointData", [s.at_points for s in states]), ("CellData", [s.in_cells for s in states])):
            for name in fields[0]:
                _append_field(root, place, name, np.concatenate([each[name] for each in fields]))
        _append(steps["Values"], [time])
        _append(steps["NumberOfParts"], [parts])
        for name in ONCE:
            _append(steps[name], np.zeros((1, *steps[name].shape[1:]), dtype=np.int64))
        steps.attrs["NSteps"] = np.int64(len(steps["Values"]))


def times(path: Path) -> list[float]:
    """The times in a file."""
    with _opened(path, "r") as root:
        return [float(time) for time in root["Steps/Values"]]


def cut(path: Path, count: int) -> None:
    """Leave the first times alone, so many."""
    with _opened(path, "r+") as root:
        steps = root["Steps"]
        for place in ("PointData", "CellData"):
            for name, offsets in steps[f"{place}Offsets"].items():
                if count < len(offsets):
                    root[place][name].resize(int(offsets[count]), axis=0)
                    offsets.resize(count, axis=0)
        for name in ("Values", "NumberOfParts", *ONCE):
            steps[name].resize(count, axis=0)
        steps.attrs["NSteps"] = np.int64(count)


def _append_field(root: Any, place: str, name: str, values: Floats) -> None:
    offsets = root["Steps"][f"{place}Offsets"]
    if name not in root[place]:
        _make(root[place], name, values[:0], len(values))
        _make(offsets, name, np.empty(0, dtype=np.int64))
    _append(offsets[name], [len(root[place][name])])
    _append(root[place][name], values)


def _make(group: Any, name: str, empty: Floats, rows: int = 64) -> None:
    """A row of numbers that grows."""
    chunks = (min(max(rows, 1), MOST), *empty.shape[1:])
    group.create_dataset(name, data=empty, maxshape=(None, *empty.shape[1:]), chunks=chunks)


def _append(found: Any, values: Any) -> None:
    start = len(found)
    found.resize(start + len(values), axis=0)
    found[start:] = values


@contextmanager
def _opened(path: Path, mode: str) -> Iterator[Any]:
    """The root group of a file; OSError, also for what HDF5 tells otherwise."""
    try:
        with import_module("h5py").File(path, mode) as file:
            yield file.require_group("VTKHDF") if mode == "w-" else file["VTKHDF"]
    except (KeyError, RuntimeError, ValueError) as error:
        raise OSError(0, f"{path.name} is no VTKHDF: {error}") from error
