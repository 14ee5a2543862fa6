"""The fields of a state as a series for ParaView, at nodes and as means over cells."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import dolfinx
import numpy as np

from growthx.common.arrays import is_uniform
from growthx.common.checks import require_number, require_path
from growthx.discretisation.checks.arguments import require_problem
from growthx.discretisation.variants import PerCell
from growthx.fem.compat import interpolation_points
from growthx.post.derived import CellFields, PointFields, told_raw
from growthx.post.smoothing import Smoothing, corner_space
from growthx.results.series import Series, open_series
from growthx.results.states.grid import Grid, State

if TYPE_CHECKING:
    from growthx.common.arrays import Floats
    from growthx.discretisation.discretisation import Discretisation
    from growthx.results.series import Keeping


class FieldWriter:
    """Writes the fields of a state, one after another in time, as a series that ParaView opens (`fields.pvd`).

    The series is whole after each state, also if the run is killed while the next is written.
    told: what was written last.  Where `tells_raw`, all that `raw.pvd` tells is in it.

    Example:
        >>> from mpi4py import MPI
        >>> problem = gx.discretise(gx.scenes.plate(2), gx.Q1P0)
        >>> writer = gx.results.FieldWriter(gx.results.new_folder("states", MPI.COMM_WORLD), problem)
        >>> for step in gx.march(problem.scene, gx.Q1P0, problem):
        ...     writer.write(step.time)
        >>> f"{writer.last:g}"
        '2.5'
    """

    def __init__(self, folder: Path, problem: Discretisation, keeping: Keeping | None = None) -> None:
        """keeping: how the series is kept; None: as `Keeping()`."""
        require_path(folder, "the folder for results")
        problem = require_problem(problem)
        self._problem, self._corners = problem, Corners(problem)
        self.grid = self._corners.grid
        self._file = open_series(Path(folder) / "fields.pvd", self.grid, problem.comm, keeping)
        self._fields, self._exact = CellFields(problem, often=True), _exact_values(problem)
        self.told: State | None = None

    @property
    def last(self) -> float | None:
        """The time of the last state, None if there is none."""
        return self._file.last

    @property
    def written(self) -> Path | None:
        """This rank's file of the last state that this writer wrote, where there is one for each."""
        return self._file.written if isinstance(self._file, Series) else None

    def write(self, time: float) -> None:
        """Append the state at a time: displacement and smoothed density at the nodes, the rest as means over cells."""
        require_number(time, "the time of a state", "a finite number", lambda _: True)
        self.told = self.state()
        self._file.write(self.told, time)

    def state(self) -> State:
        """What is told of the state as it is."""
        at_points = self._corners.displacement() | self._corners.smoothed_density()
        in_cells = self._fields.values()
        if self._exact is not None:
            in_cells |= {name: values[:, 0] for name, values in self._exact.values().items()}
        beside = {"density": at_points["smoothed_density"]} if has_nodes_at_corners(self._problem) else {}
        return State(at_points, in_cells, beside)

    def close(self) -> None:
        """Finish the files."""
        self._file.close()


def tells_raw(problem: Discretisation) -> bool:
    """Whether all that is told raw is among the fields: on the same cells, exactly as the variant knows it."""
    return has_nodes_at_corners(problem) or _exact_values(problem) is not None


def has_nodes_at_corners(problem: Discretisation) -> bool:
    """Whether the densities are those at the corners of the cells, each one for all cells around it."""
    if problem.variant.density.local or problem.rests:
        return False
    return bool(problem.density_space.element.basix_element.degree == 1)


def _exact_values(problem: Discretisation) -> PointFields | None:
    """The fields that are better known than by means, of one value for each cell; None where there are others.

    A reference density that varies inside a cell has its relative change at one point of it.
    """
    variant, exact = problem.variant, [field.name for field in told_raw(problem) if field.exact is not None]
    alike = is_uniform(problem.scene.material.reference_density) and set(exact) <= {"density", "relative_change"}
    if not (isinstance(variant.density, PerCell) and variant.one_rule and alike):
        return None
    return PointFields(problem, interpolation_points(problem.density_space.element), exact)


class Corners:
    """The corners of the cells, as the points of a grid that they share, and what is told there."""

    def __init__(self, problem: Discretisation) -> None:
        self._problem, mesh = problem, problem.scene.mesh
        scalars = corner_space(problem)
        vectors = dolfinx.fem.functionspace(mesh.domain, ("Lagrange", 1, (mesh.dim,)))
        self._displacement = dolfinx.fem.Function(vectors, name="displacement")
        self._at_corners = _are_alike(problem.displacement.function_space, vectors)
        self._smoothing = None if has_nodes_at_corners(problem) else Smoothing(problem, scalars)
        self._density = dolfinx.fem.Function(scalars, name="smoothed_density")
        self.grid = Grid.of_space(scalars)

    def displacement(self) -> dict[str, Floats]:
        """The displacement of the state as it is."""
        if self._at_corners:
            return {"displacement": self.grid.values_of(self._problem.displacement)}
        self._displacement.interpolate(self._problem.displacement)
        return {"displacement": self.grid.values_of(self._displacement)}

    def smoothed_density(self) -> dict[str, Floats]:
        """The density of the state as it is, smoothed to the corners."""
        if self._smoothing is not None:
            self._density.x.array[:] = self._smoothing()
        else:
            of_cells = self._problem.densities_of_cells()
            self._density.x.array[self._density.function_space.dofmap.list[: len(of_cells)]] = of_cells
        return {"smoothed_density": self.grid.values_of(self._density)}


def _are_alike(one: dolfinx.fem.FunctionSpace, other: dolfinx.fem.FunctionSpace) -> bool:
    """Whether two spaces of the first degree have their nodes at the corners in the same order."""
    linear = one.element.basix_element.degree == other.element.basix_element.degree == 1
    return linear and np.array_equal(one.dofmap.list, other.dofmap.list)
