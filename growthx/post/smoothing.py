"""Densities smoothed to the corners of the cells: extrapolated from the integration points, averaged over the cells.

For pictures alone: what is computed with is never smoothed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import basix.ufl
import dolfinx
import numpy as np

from growthx.fem import compat
from growthx.fem.assembly import CellAverages
from growthx.meshing.sampling import reference_corners

if TYPE_CHECKING:
    from growthx.common.arrays import Floats
    from growthx.discretisation.discretisation import Discretisation


def smoothed_density(
    problem: Discretisation, space: dolfinx.fem.FunctionSpace | None = None, of_cells: Floats | None = None
) -> dolfinx.fem.Function:
    """Continuous density, linear between the corners of the cells; of a node-based one, its values there.

    At corners of cells that grow it is theirs alone: what rests beside them is not mixed into it.
    space: `corner_space` of the mesh, for those who have it already.  of_cells: densities of each owned cell, shape
    (owned cells, densities of a cell); default: those of the state.
    """
    smooth = dolfinx.fem.Function(corner_space(problem) if space is None else space, name="smoothed_density")
    smooth.x.array[:] = Smoothing(problem, smooth.function_space)(of_cells)
    return smooth


class Smoothing:
    """The same for state after state: what the corners take from the cells is found once."""

    def __init__(self, problem: Discretisation, space: dolfinx.fem.FunctionSpace) -> None:
        """space: `corner_space` of the mesh (collective)."""
        self._problem, self._shares = problem, _to_corners(problem).T
        self._averages = CellAverages(space, problem.growing_cells if problem.rests else None)

    def __call__(self, of_cells: Floats | None = None) -> Floats:
        """Values at the corners, as in `x.array`; of_cells: see `smoothed_density` (collective)."""
        return self._averages((self._problem.densities_of_cells() if of_cells is None else of_cells) @ self._shares)


def corner_space(problem: Discretisation) -> dolfinx.fem.FunctionSpace:
    """Scalars that are linear between the corners of the cells."""
    return dolfinx.fem.functionspace(problem.scene.mesh.domain, ("Lagrange", 1))


def _to_corners(problem: Discretisation) -> Floats:
    """What each corner of a cell takes from each of its densities, shape (corners, densities); rows sum to one."""
    cell_name, element = problem.scene.mesh.cell_name, problem.density_space.ufl_element()
    if not problem.variant.density.local:
        return problem.variant.density.shares(element, reference_corners(cell_name))
    return corners_from_points(cell_name, compat.interpolation_points(problem.density_space.element))


def corners_from_points(cell_name: str, points: Floats) -> Floats:
    """What each corner of a cell takes from values at points of it, (corners, points); rows sum to one.

    The (multi)linear function nearest to these values; where there are too few for one, the smallest.
    """
    return np.linalg.pinv(_linear_at(cell_name, points))


def corner_functions(problem: Discretisation) -> Floats:
    """The (multi)linear function of each corner of a cell where its densities are, shape (densities, corners)."""
    return _linear_at(problem.scene.mesh.cell_name, compat.interpolation_points(problem.density_space.element))


def _linear_at(cell_name: str, points: Floats) -> Floats:
    """The (multi)linear function of each corner of a cell at points of it, shape (points, corners)."""
    return np.asarray(basix.ufl.element("Lagrange", cell_name, 1).tabulate(0, points))[0]
