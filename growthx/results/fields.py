"""The fields of a state as a series for ParaView, at nodes and as means over cells."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import dolfinx

from growthx.common.checks import require_number, require_path
from growthx.discretisation.checks.arguments import require_problem
from growthx.post.derived import CellFields
from growthx.post.smoothing import corner_space, smoothed_density
from growthx.results.series import open_series
from growthx.results.states.grid import Grid, State

if TYPE_CHECKING:
    from growthx.common.arrays import Floats
    from growthx.discretisation.discretisation import Discretisation
    from growthx.results.series import Keeping


class FieldWriter:
    """Writes the fields of a state, one after another in time, as a series that ParaView opens (`fields.pvd`).

    The series is whole after each state, also if the run is killed while the next is written.
    """

    def __init__(self, folder: Path, problem: Discretisation, keeping: Keeping | None = None) -> None:
        """keeping: how the series is kept; None: as `Keeping()`."""
        require_path(folder, "the folder for results")
        require_problem(problem)
        self._problem, self._corners = problem, Corners(problem)
        self._file = open_series(Path(folder) / "fields.pvd", self._corners.grid, problem.comm, keeping)
        self._fields = CellFields(problem)

    @property
    def last(self) -> float | None:
        """The time of the last state, None if there is none."""
        return self._file.last

    def write(self, time: float) -> None:
        """Append the state at a time: displacement and smoothed density at the nodes, the rest as means over cells."""
        require_number(time, "the time of a state", "a finite number", lambda _: True)
        at_points = self._corners.displacement() | self._corners.smoothed_density()
        self._file.write(State(at_points, self._fields.values()), time)

    def close(self) -> None:
        """Finish the files."""
        self._file.close()


class Corners:
    """The corners of the cells, as the points of a grid that they share, and what is told there."""

    def __init__(self, problem: Discretisation) -> None:
        self._problem, mesh = problem, problem.scene.mesh
        self._scalars = corner_space(problem)
        self._displacement = dolfinx.fem.Function(
            dolfinx.fem.functionspace(mesh.domain, ("Lagrange", 1, (mesh.dim,))), name="displacement"
        )
        self.grid = Grid.of_space(self._scalars)

    def displacement(self) -> dict[str, Floats]:
        """The displacement of the state as it is."""
        self._displacement.interpolate(self._problem.displacement)
        return {"displacement": self.grid.values_of(self._displacement)}

    def smoothed_density(self) -> dict[str, Floats]:
        """The density of the state as it is, smoothed to the corners."""
        return {"smoothed_density": self.grid.values_of(smoothed_density(self._problem, self._scalars))}
