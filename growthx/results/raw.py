"""Fields exactly as the variant knows them, for ParaView: a cell for each density, or the nodes of a continuous one."""

from __future__ import annotations

from typing import TYPE_CHECKING

import dolfinx
import numpy as np

from growthx.discretisation.variants import PerCell
from growthx.fem.assembly import CellMeans
from growthx.fem.compat import interpolation_points
from growthx.post.derived import PointFields, told_raw
from growthx.post.fields.row import read_all
from growthx.post.subcells import subcells
from growthx.results.fields import Corners
from growthx.results.series import Series, open_series
from growthx.results.states.grid import Grid, State
from growthx.results.states.pieces import Pieces

if TYPE_CHECKING:
    from pathlib import Path

    from growthx.common.arrays import Floats
    from growthx.discretisation.discretisation import Discretisation
    from growthx.results.fields import FieldWriter
    from growthx.results.series import Keeping


class TwinWriter:
    """Writes `raw.pvd` where `fields.tells_raw`: a .vtu of the fields has all of it and gets a second name."""

    def __init__(
        self, fields: FieldWriter, folder: Path, problem: Discretisation, keeping: Keeping | None = None
    ) -> None:
        """fields: writes each state first.  keeping: see `FieldWriter`."""
        self._fields, self._file = fields, open_series(folder / "raw.pvd", fields.grid, problem.comm, keeping)
        told = told_raw(problem) if problem.variant.density.local else ()
        self._in_cells = [field.name for field in told] + (["grows"] if told and problem.rests else [])

    @property
    def last(self) -> float | None:
        """The time of the last state, None if there is none."""
        return self._file.last

    def write(self, time: float) -> None:
        """Append the state at a time."""
        fields, whole = self._fields, self._fields.told
        if whole is None:  # the fields of this state were there, and the raw ones were not
            whole = fields.state()
        at_points = {"displacement": whole.at_points["displacement"], **whole.beside}
        state = State(at_points, {name: whole.in_cells[name] for name in self._in_cells})
        if isinstance(self._file, Series):
            self._file.write(state, time, fields.written)
        else:
            self._file.write(state, time)

    def close(self) -> None:
        """Finish the files."""
        self._file.close()


def raw_writer(
    folder: Path, problem: Discretisation, keeping: Keeping | None = None
) -> CellWriter | PointWriter | NodeWriter:
    """What writes `raw.pvd` for the variant of a problem; keeping: see `FieldWriter`."""
    density = problem.variant.density
    if not density.local:
        return NodeWriter(folder, problem, keeping)
    return (CellWriter if isinstance(density, PerCell) else PointWriter)(folder, problem, keeping)


class NodeWriter:
    """Writes a density that is continuous between cells, in its own degree, with the displacement at its nodes.

    Where some cells rest, each cell has nodes of its own, since the density jumps there, and tells whether it grows.
    """

    def __init__(self, folder: Path, problem: Discretisation, keeping: Keeping | None = None) -> None:
        self._problem = problem
        mesh, degree = problem.scene.mesh, problem.density_space.element.basix_element.degree
        family = "DG" if problem.rests else "Lagrange"
        space = dolfinx.fem.functionspace(mesh.domain, (family, degree, (mesh.dim,)))
        self._displacement = dolfinx.fem.Function(space, name="displacement")
        self._grid = Grid.of_space(space)
        self._density = problem.density
        if problem.rests:
            self._density = dolfinx.fem.Function(dolfinx.fem.functionspace(mesh.domain, ("DG", degree)), name="density")
        self._densities = Grid.of_space(self._density.function_space)
        self._file = open_series(folder / "raw.pvd", self._grid, problem.comm, keeping)

    @property
    def last(self) -> float | None:
        """The time of the last state, None if there is none."""
        return self._file.last

    def write(self, time: float) -> None:
        """Append the state at a time."""
        problem, in_cells = self._problem, {}
        self._displacement.interpolate(problem.displacement)
        if problem.rests:
            of_cells = problem.densities_of_cells()
            self._density.x.array[self._density.function_space.dofmap.list[: len(of_cells)]] = of_cells
            in_cells["grows"] = problem.grows.x.array[: len(of_cells)]
        at_points = {
            "displacement": self._grid.values_of(self._displacement),
            "density": self._densities.values_of(self._density),
        }
        self._file.write(State(at_points, in_cells), time)

    def close(self) -> None:
        """Finish the files."""
        self._file.close()


class CellWriter:
    """Writes the one density of each cell, with what else `derived.FIELDS` tells raw, and whether it grows.

    These others are means over the cell where the mean source drives the density, and else as they are at its midpoint.
    """

    def __init__(self, folder: Path, problem: Discretisation, keeping: Keeping | None = None) -> None:
        self._corners = Corners(problem)
        self._file = open_series(folder / "raw.pvd", self._corners.grid, problem.comm, keeping)
        self._means = _Means(problem) if problem.variant.one_rule else None
        means = () if self._means is None else self._means.names
        names = [field.name for field in told_raw(problem) if field.name not in means]
        self._at_middle = PointFields(problem, interpolation_points(problem.density_space.element), names)

    @property
    def last(self) -> float | None:
        """The time of the last state, None if there is none."""
        return self._file.last

    def write(self, time: float) -> None:
        """Append the state at a time."""
        in_cells = {name: at_points[:, 0] for name, at_points in self._at_middle.values().items()}
        if self._means is not None:
            in_cells |= self._means.values()
        self._file.write(State(self._corners.displacement(), in_cells), time)

    def close(self) -> None:
        """Finish the files."""
        self._file.close()


class _Means:
    """Means over the owned cells of what is told raw and is not known better at points, compiled once."""

    def __init__(self, problem: Discretisation) -> None:
        self._fields = [field for field in told_raw(problem) if field.exact is None]
        parts = [field.scalars(problem) for field in self._fields]
        self._ends = np.cumsum([len(part) for part in parts])
        domain, volume = problem.scene.mesh.domain, problem.spaces.whole_volume
        scalars = [scalar for part in parts for scalar in part]
        self._means = CellMeans(domain, scalars, volume, problem.compile, often=True) if scalars else None

    @property
    def names(self) -> list[str]:
        """Which these are."""
        return [field.name for field in self._fields]

    def values(self) -> dict[str, Floats]:
        """Those of the state as it is, by name, each of shape (owned cells,)."""
        if self._means is None:
            return {}
        numbers = dict(zip(self.names, np.split(self._means(), self._ends[:-1], axis=1), strict=True))
        return read_all(self._fields, lambda field: numbers[field.name])


class PointWriter:
    """Writes density, its relative change, the stimulus and what else `derived.FIELDS` tells raw at integration points.

    Each value on the part of a cell that is its point's; and where some cells rest, which of them grow.  The parts of
    all cells share their points, which carry the displacement.
    """

    def __init__(self, folder: Path, problem: Discretisation, keeping: Keeping | None = None) -> None:
        mesh, points = problem.scene.mesh, interpolation_points(problem.density_space.element)
        self._pieces = Pieces(problem, subcells(mesh.cell_name, points))
        self._file = open_series(folder / "raw.pvd", self._pieces.grid, problem.comm, keeping)
        self._fields = PointFields(problem, points)

    @property
    def last(self) -> float | None:
        """The time of the last state, None if there is none."""
        return self._file.last

    def write(self, time: float) -> None:
        """Append the state at a time."""
        in_cells = {name: self._pieces.of_points(at_points) for name, at_points in self._fields.values().items()}
        self._file.write(State(self._pieces.displacement(), in_cells), time)

    def close(self) -> None:
        """Finish the files."""
        self._file.close()
