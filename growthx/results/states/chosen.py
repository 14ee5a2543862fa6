"""Files of fields that were chosen by name, each under a name that tells where it is known: nothing else is evaluated.

`fields.pvd` has means over cells (`…_in_cells`) and values averaged to nodes (`…_at_nodes`), `points.pvd` values at the
points of integration (`…_at_points`); both the displacement of their points.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from growthx.post.derived import CellFields, NodeFields, PointFields
from growthx.post.fields.choice import ENDINGS
from growthx.post.subcells import around_points
from growthx.results.fields import Corners
from growthx.results.series import open_series
from growthx.results.states.grid import State
from growthx.results.states.pieces import Pieces

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from growthx.common.arrays import Floats
    from growthx.discretisation.discretisation import Discretisation
    from growthx.post.fields.choice import Choice
    from growthx.results.series import Keeping


def makers(choice: Choice) -> tuple[Callable[..., Any], ...]:
    """What makes the writers of chosen fields, each of a folder, a problem and a `Keeping`."""
    known = {"fields": ChosenWriter, "points": ChosenPointWriter}
    return tuple(partial(make, choice) for name, make in known.items() if name in choice.files)


class ChosenWriter:
    """Writes means over cells and what is averaged to nodes, with the displacement of the nodes (`fields.pvd`)."""

    def __init__(self, choice: Choice, folder: Path, problem: Discretisation, keeping: Keeping | None = None) -> None:
        """keeping: see `FieldWriter`."""
        self._corners = Corners(problem)
        self._cells = CellFields(problem, choice.cells, often=True) if choice.cells else None
        self._nodes = NodeFields(problem, choice.nodes) if choice.nodes else None
        self._file = open_series(folder / "fields.pvd", self._corners.grid, problem.comm, keeping)

    @property
    def last(self) -> float | None:
        """The time of the last state, None if there is none."""
        return self._file.last

    def write(self, time: float) -> None:
        """Append the state at a time."""
        at_nodes = self._corners.displacement()
        if self._nodes is not None:
            found = {name: values[self._corners.grid.nodes] for name, values in self._nodes.values().items()}
            at_nodes |= _named(found, "nodes")
        in_cells = {} if self._cells is None else _named(self._cells.values(), "cells")
        self._file.write(State(at_nodes, in_cells), time)

    def close(self) -> None:
        """Finish the files."""
        self._file.close()


class ChosenPointWriter:
    """Writes values at the points of integration, each on a small cell of its own (`points.pvd`)."""

    def __init__(self, choice: Choice, folder: Path, problem: Discretisation, keeping: Keeping | None = None) -> None:
        """keeping: see `FieldWriter`."""
        mesh = problem.scene.mesh
        points = problem.variant.integration_points(mesh.cell_name)
        self._pieces = Pieces(problem, around_points(mesh.cell_name, points))
        self._fields = PointFields(problem, points, choice.points)
        self._file = open_series(folder / "points.pvd", self._pieces.grid, problem.comm, keeping)

    @property
    def last(self) -> float | None:
        """The time of the last state, None if there is none."""
        return self._file.last

    def write(self, time: float) -> None:
        """Append the state at a time."""
        found = {name: self._pieces.of_points(values) for name, values in self._fields.values().items()}
        self._file.write(State(self._pieces.displacement(), _named(found, "points")), time)

    def close(self) -> None:
        """Finish the files."""
        self._file.close()


def _named(fields: Mapping[str, Floats], place: str) -> dict[str, Floats]:
    """Fields by names that tell where they are known, tensors with their nine entries in a row."""
    rows = {name: values.reshape(len(values), -1) if values.ndim > 1 else values for name, values in fields.items()}
    return {name if name == "grows" else name + ENDINGS[place]: np.ascontiguousarray(v) for name, v in rows.items()}
