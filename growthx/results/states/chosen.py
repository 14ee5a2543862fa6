"""Files of fields that were chosen by name, each under a name that tells where it is known: nothing else is evaluated.

`fields.pvd` has means over cells (`…_in_cells`) and values averaged to nodes (`…_at_nodes`), `points.pvd` values at the
points of integration (`…_at_points`); both the displacement of their points.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Protocol

import numpy as np

from growthx.meshing.sampling import positions
from growthx.post.derived import FIELDS, CellFields, NodeFields, PointFields
from growthx.post.fields.choice import ENDINGS, check_known
from growthx.post.subcells import around_points
from growthx.results.fields import Corners, FieldWriter
from growthx.results.raw import raw_writer
from growthx.results.series import Series
from growthx.results.states.grid import Grid, State, in_space

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from growthx.common.arrays import Floats
    from growthx.discretisation.discretisation import Discretisation
    from growthx.post.fields.choice import Choice


class Writer(Protocol):
    """What writes one series of a run."""

    def write(self, time: float) -> None:
        """Append the state at a time."""
        ...

    def close(self) -> None:
        """Finish the files."""
        ...


def writers(choice: Choice | None) -> tuple[Callable[..., Writer], ...]:
    """What makes the writers of a run's fields, each of a folder and a problem.

    None: of those that are told without being asked for.
    """
    if choice is None:
        return FieldWriter, raw_writer
    made: list[Callable[..., Writer]] = []
    if choice.cells or choice.nodes:
        made.append(partial(ChosenWriter, choice))
    if choice.points:
        made.append(partial(ChosenPointWriter, choice))
    return tuple(made)


def check_choice(choice: Choice | None, problem: Discretisation) -> None:
    """Raise InputError for a field that was chosen and that a problem does not have."""
    if choice is not None:
        check_known(choice.names, FIELDS, problem)


class ChosenWriter:
    """Writes means over cells and what is averaged to nodes, with the displacement of the nodes (`fields.pvd`)."""

    def __init__(self, choice: Choice, folder: Path, problem: Discretisation, until: float | None = None) -> None:
        """until: see `FieldWriter`."""
        self._corners = Corners(problem)
        self._cells = CellFields(problem, choice.cells) if choice.cells else None
        self._nodes = NodeFields(problem, choice.nodes) if choice.nodes else None
        self._file = Series(folder / "fields.pvd", self._corners.grid, problem.comm, until)

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

    def __init__(self, choice: Choice, folder: Path, problem: Discretisation, until: float | None = None) -> None:
        """until: see `FieldWriter`."""
        self._problem, mesh = problem, problem.scene.mesh
        points = problem.variant.integration_points(mesh.cell_name)
        self._parts = around_points(mesh.cell_name, points)
        grid = Grid.of_pieces(self._parts.shape, positions(mesh, self._parts.X), self._parts.pieces)
        self._fields = PointFields(problem, points, choice.points)
        self._file = Series(folder / "points.pvd", grid, problem.comm, until)

    @property
    def last(self) -> float | None:
        """The time of the last state, None if there is none."""
        return self._file.last

    def write(self, time: float) -> None:
        """Append the state at a time."""
        u = self._problem.displacement_at(self._parts.X).reshape(-1, self._problem.scene.mesh.dim)
        found = {
            name: values[:, self._parts.points].reshape(-1, *values.shape[2:])
            for name, values in self._fields.values().items()
        }
        self._file.write(State({"displacement": in_space(u)}, _named(found, "points")), time)

    def close(self) -> None:
        """Finish the files."""
        self._file.close()


def _named(fields: Mapping[str, Floats], place: str) -> dict[str, Floats]:
    """Fields by names that tell where they are known, tensors with their nine entries in a row."""
    rows = {name: values.reshape(len(values), -1) if values.ndim > 1 else values for name, values in fields.items()}
    return {name if name == "grows" else name + ENDINGS[place]: np.ascontiguousarray(v) for name, v in rows.items()}
