"""A body in space with a field on it, gathered on one rank as grids that pyvista cuts and draws."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from growthx.common.checks import require_kind
from growthx.common.errors import InputError
from growthx.fem.compat import interpolation_points
from growthx.meshing.content import AROUND
from growthx.meshing.sampling import positions, reference_corners
from growthx.post.derived import FIELDS, CellFields, NodeFields
from growthx.post.fields.choice import check_known, check_name
from growthx.post.smoothing import corner_space
from growthx.post.subcells import Subcells, subcells

if TYPE_CHECKING:
    from growthx.common.arrays import Floats, Marks
    from growthx.discretisation.discretisation import Discretisation

CELLS = {"tetrahedron": 10, "hexahedron": 12}  # VTK's numbers
SAME = 1e-9  # of a body's size: points that are one
VALUE = "value"  # name of what is drawn in the grids
MOVED = "displacement"  # … and of how far their points have moved


@dataclass(frozen=True)
class SpaceBody:
    """A body at rest in pieces of cells, gathered on rank 0; elsewhere, this rank's part.

    corners: (cells, corners, 3).  moved: displacement there.  parts: the pieces of a cell.  values: per corner or per
    piece.  grows: which cells do.
    """

    corners: Floats
    moved: Floats
    parts: Subcells
    values: Floats
    at_corners: bool
    grows: Marks

    @property
    def limits(self) -> tuple[float, float]:
        """Lowest and highest value of what grows, or of all if nothing does."""
        seen = self.values[self.grows] if self.grows.any() else self.values
        return float(seen.min()), float(seen.max())

    @cached_property
    def whole(self) -> Any:
        """All of it as a pyvista grid whose neighbours share their points."""
        return self.growing if self.grows.all() else self._grid(np.ones(len(self.grows), dtype=bool))

    @cached_property
    def growing(self) -> Any:
        """What of it grows, as such a grid; None if nothing does."""
        return self._grid(self.grows)

    @cached_property
    def resting(self) -> Any:
        """What of it does not grow, as such a grid; None if all grows."""
        return self._grid(~self.grows)

    def _grid(self, cells: Marks) -> Any:
        import pyvista

        if not cells.any():
            return None
        corners = self.corners[cells]
        count = corners.shape[1]
        around = self.parts.pieces[:, list(AROUND[self.parts.shape])]
        rows = count * np.arange(len(corners))[:, np.newaxis, np.newaxis] + around
        points = corners.reshape(-1, 3)
        grid = pyvista.UnstructuredGrid({CELLS[self.parts.shape]: rows.reshape(-1, around.shape[1])}, points)
        grid.point_data[MOVED] = self.moved[cells].reshape(-1, 3)
        (grid.point_data if self.at_corners else grid.cell_data)[VALUE] = self.values[cells].ravel()
        return grid.clean(tolerance=SAME * float(np.ptp(points, axis=0).max()))


def space_body(problem: Discretisation, field: str, relative: bool, smoothed: bool, magnification: float) -> SpaceBody:
    """The body of a problem with a field on it (collective); same errors as `field_named`."""
    mesh = problem.scene.mesh
    parts, values, at_corners = _values(problem, field_named(field, relative, problem), smoothed)
    corners, moved = positions(mesh, parts.X), magnification * problem.displacement_at(parts.X)
    grows = problem.grows.x.array[: len(corners)] > 0 if problem.rests else np.ones(len(corners), dtype=bool)
    mine = (corners, moved, values, grows)
    corners, moved, values, grows = (
        np.concatenate(part) for part in zip(*(problem.comm.gather(mine) or [mine]), strict=True)
    )
    return SpaceBody(corners, moved, parts, values, at_corners, grows)


def field_named(field: str, relative: bool, problem: Discretisation) -> str:
    """The name in `FIELDS` of what is to be drawn; InputError for what is no field of one number."""
    require_kind(field, str, "the field of a picture", "its name")
    check_name(field, FIELDS)
    check_known((field,), FIELDS, problem)
    if FIELDS[field].rank:
        right = ", ".join(name for name, row in FIELDS.items() if not row.rank)
        raise InputError(
            f"the field '{field}' has no single number to be drawn by a colour: one of {right} would be right"
        )
    if relative and field != "density":
        raise InputError(
            f"a relative change of '{field}' was asked for: there is one of the density alone, and "
            "relative=False would be right"
        )
    return "relative_change" if relative else field


def _values(problem: Discretisation, name: str, smoothed: bool) -> tuple[Subcells, Floats, bool]:
    """Pieces of a cell, the values of each owned cell's pieces or of their corners, and whether it is of these."""
    mesh, density = problem.scene.mesh, problem.variant.density
    corners = reference_corners(mesh.cell_name)
    whole = Subcells(mesh.cell_name, corners, np.arange(len(corners))[np.newaxis], np.zeros(1, dtype=np.int64))
    exact = FIELDS[name].exact
    if smoothed:
        nodes = corner_space(problem).dofmap.list[: len(mesh.owned_cells)]
        return whole, NodeFields(problem, (name,)).values()[name][nodes], True
    if exact is None:
        return whole, CellFields(problem, (name,)).values()[name][:, np.newaxis], False
    if not density.local:
        return whole, exact(problem, corners), True
    parts = subcells(mesh.cell_name, interpolation_points(problem.density_space.element))
    points = interpolation_points(problem.density_space.element)
    return parts, exact(problem, points)[:, parts.points], False


def range_of(body: SpaceBody, problem: Discretisation) -> tuple[float, float]:
    """The lowest and highest value of a body, as rank 0 has gathered it, on all ranks (collective)."""
    low, high = problem.comm.bcast(body.limits if problem.comm.rank == 0 else None)
    return low, high
