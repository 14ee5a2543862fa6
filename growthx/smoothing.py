"""Densities smoothed to the corners of the cells: extrapolated from the integration points, averaged over the cells.

For pictures alone: what is computed with is never smoothed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import basix.ufl
import dolfinx
import numpy as np

from growthx import compat
from growthx.assembly import average_cells
from growthx.sampling import reference_corners

if TYPE_CHECKING:
    from growthx.arrays import Floats
    from growthx.discretisation import Discretisation


def smoothed_density(problem: Discretisation) -> dolfinx.fem.Function:
    """Continuous density, linear between the corners of the cells; of a node-based one, its values there."""
    domain = problem.scene.mesh.domain
    space = dolfinx.fem.functionspace(domain, ("Lagrange", 1))
    of_cells = problem.density.x.array[problem.density_space.dofmap.list[: len(problem.scene.mesh.owned_cells)]]
    smooth = average_cells(space, of_cells @ _to_corners(problem).T)
    smooth.name = "smoothed_density"
    return smooth


def _to_corners(problem: Discretisation) -> Floats:
    """What each corner of a cell takes from each of its densities, shape (corners, densities); rows sum to one."""
    cell_name, element = problem.scene.mesh.cell_name, problem.density_space.ufl_element()
    if not problem.variant.density.local:
        return problem.variant.density.shares(element, reference_corners(cell_name))
    # The (multi)linear function nearest to the values at the points; where there are too few for one, the smallest.
    return np.linalg.pinv(corner_functions(problem))


def corner_functions(problem: Discretisation) -> Floats:
    """The (multi)linear function of each corner of a cell where its densities are, shape (densities, corners)."""
    points = compat.interpolation_points(problem.density_space.element)
    linear = basix.ufl.element("Lagrange", problem.scene.mesh.cell_name, 1)
    return np.asarray(linear.tabulate(0, points))[0]
