"""The fields of a state as a series for ParaView, at nodes and as means over cells."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import dolfinx

from growthx.common.checks import require_number, require_path
from growthx.discretisation.checks.arguments import require_problem
from growthx.post.derived import CellFields
from growthx.post.smoothing import corner_space, smoothed_density
from growthx.results.series import Series

if TYPE_CHECKING:
    from growthx.discretisation.discretisation import Discretisation


class FieldWriter:
    """Writes the fields of a state, one after another in time, as a series that ParaView opens (`fields.pvd`)."""

    def __init__(self, folder: Path, problem: Discretisation) -> None:
        require_path(folder, "the folder for results")
        require_problem(problem)
        self._problem = problem
        mesh = problem.scene.mesh
        self._file = Series(Path(folder) / "fields.pvd", problem.comm)
        self._fields, self._corners = CellFields(problem), corner_space(problem)
        self._per_cell = dolfinx.fem.functionspace(mesh.domain, ("DG", 0))
        self._displacement = dolfinx.fem.Function(
            dolfinx.fem.functionspace(mesh.domain, ("Lagrange", 1, (mesh.dim,))), name="displacement"
        )

    def write(self, time: float) -> None:
        """Append the state at a time: displacement and smoothed density at the nodes, the rest as means over cells."""
        require_number(time, "the time of a state", "a finite number", lambda _: True)
        self._displacement.interpolate(self._problem.displacement)
        functions = [self._displacement, smoothed_density(self._problem, self._corners)]
        for name, values in self._fields.values().items():
            function = dolfinx.fem.Function(self._per_cell, name=name)
            function.x.array[: len(values)] = values
            function.x.scatter_forward()
            functions.append(function)
        self._file.write(functions, time)

    def close(self) -> None:
        """Finish the files."""
        self._file.close()
