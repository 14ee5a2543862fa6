"""How much densities jump between neighbours, and how much of that no slope explains."""

from __future__ import annotations

from typing import TYPE_CHECKING

import basix
import dolfinx
import numpy as np

from growthx.discretisation.checks import arguments
from growthx.fem.assembly import sum_cells
from growthx.fem.cells import equal_sided
from growthx.fem.compat import interpolation_points
from growthx.meshing.sampling import positions

if TYPE_CHECKING:
    from growthx.common.arrays import Floats, Indices
    from growthx.discretisation.discretisation import Discretisation
    from growthx.stepping.record import Result


FLAT = 1e-9  # width over length, squared, below which cells or nodes lie on a line


def checkerboard_index(problem: Discretisation | Result) -> float:
    """Mean jump of density from one neighbour to the next in what grows, over the mean of the two; no unit, global.

    Neighbours are cells that share a facet, with their mean densities, or nodes next to one another in a cell.
    Slopes of a smooth density count as well, in proportion to the size of cells: not in `high_frequency_index`.

    Example:
        >>> problem = gx.discretise(gx.scenes.plate(2), gx.Q1P0)
        >>> gx.baselines.checkerboard_index(problem)  # of a uniform density
        0.0
    """
    problem = arguments.require_problem(problem)
    density, pairs = _compared(problem)
    return _mean_jump(problem, density, density, pairs)


def high_frequency_index(problem: Discretisation | Result) -> float:
    """The part of the checkerboard index that a density which is linear around each neighbour does not explain.

    From each density is taken the linear function nearest to those around it: to cells by the number of corners they
    share, to nodes by the number of cells.  A checkerboard keeps all of its index inside the body, a linear density has
    none.

    Example:
        >>> problem = gx.discretise(gx.scenes.plate(2), gx.Q1P0)
        >>> f"{gx.baselines.high_frequency_index(problem):.6f}"  # of a uniform density
        '0.000000'
    """
    problem = arguments.require_problem(problem)
    density, pairs = _compared(problem)
    return _mean_jump(problem, _without_slopes(problem, density), density, pairs)


def _compared(problem: Discretisation) -> tuple[dolfinx.fem.Function, Indices]:
    """Densities of cells or nodes, and the pairs of neighbours among them, shape (pairs, 2)."""
    problem.density.x.scatter_forward()
    if problem.variant.density.local:
        cells = dolfinx.fem.Function(dolfinx.fem.functionspace(problem.scene.mesh.domain, ("DG", 0)))
        places = cells.function_space.dofmap.list[:, 0]
        cells.x.array[places] = problem.density.x.array[problem.density_space.dofmap.list].mean(axis=1)
        return cells, places[_beside_facets(problem)]
    growing = problem.density_space.dofmap.list[problem.growing_cells]
    return problem.density, growing[:, _beside_nodes(problem)].reshape(-1, 2)


def _mean_jump(
    problem: Discretisation, values: dolfinx.fem.Function, density: dolfinx.fem.Function, pairs: Indices
) -> float:
    """Mean over all ranks' pairs of the jump of values over the mean density of the two."""
    jumps = np.abs(np.diff(values.x.array[pairs], axis=1)[:, 0]) / density.x.array[pairs].mean(axis=1)
    total, count = problem.comm.allreduce(np.array([jumps.sum(), jumps.size]))
    return float(total / count)


def _without_slopes(problem: Discretisation, density: dolfinx.fem.Function) -> dolfinx.fem.Function:
    """Densities of cells or nodes less the linear functions nearest to those around them."""
    mesh, space = problem.scene.mesh, density.function_space
    of_cells = space.dofmap.list[: len(mesh.owned_cells)]
    x = positions(mesh, interpolation_points(space.element))[:, :, : mesh.dim]
    at = density.x.array[of_cells][:, :, np.newaxis]
    squares = (x[:, :, :, np.newaxis] * x[:, :, np.newaxis, :]).reshape(*x.shape[:2], -1)
    moments = np.concatenate([np.ones_like(at), x, at, squares, x * at], axis=2)
    around, places = _sums_around(problem, space, moments), np.full((len(density.x.array), mesh.dim), np.nan)
    places[of_cells] = x
    rest = dolfinx.fem.Function(space)
    own = problem.growing_cells if problem.variant.density.local else problem.growing_dofs
    rest.x.array[own] = density.x.array[own] - _linear_fit(around[own], places[own])
    rest.x.scatter_forward()
    return rest


def _sums_around(problem: Discretisation, space: dolfinx.fem.FunctionSpace, moments: Floats) -> Floats:
    """Sums of moments, (owned cells, densities of a cell, moments), over the growing cells, or nodes, around each."""
    if problem.rests:
        moments = problem.grows.x.array[: len(moments), np.newaxis, np.newaxis] * moments
    of_cells = space.dofmap.list[: len(moments)]
    if not problem.variant.density.local:
        return sum_cells(space, np.broadcast_to(moments.sum(axis=1, keepdims=True), moments.shape))
    corners = dolfinx.fem.functionspace(space.mesh, ("Lagrange", 1))
    shape = (*corners.dofmap.list[: len(moments)].shape, moments.shape[2])
    at_corners = sum_cells(corners, np.broadcast_to(moments, shape))
    sums = np.zeros((len(space.dofmap.list), moments.shape[2]))
    sums[of_cells[:, 0]] = at_corners[corners.dofmap.list[: len(moments)]].sum(axis=1)
    return sums


def _linear_fit(sums: Floats, x: Floats) -> Floats:
    """Values at x, (places, dim), of the linear functions of least squares with these sums of moments.

    The moments are 1, x, ρ, x ⊗ x and x ρ.  Where all that count lie on a line, as in a row of cells, the slope does.
    """
    dim = x.shape[1]
    first = sums / sums[:, :1]
    middle, mean = first[:, 1 : 1 + dim], first[:, 1 + dim]
    spread = first[:, 2 + dim : -dim].reshape(-1, dim, dim) - middle[:, :, np.newaxis] * middle[:, np.newaxis, :]
    common = first[:, -dim:] - middle * mean[:, np.newaxis]
    slope = np.einsum("pij,pj->pi", np.linalg.pinv(spread, rcond=FLAT, hermitian=True), common)
    return np.asarray(mean + np.einsum("pi,pi->p", slope, x - middle))


def _beside_nodes(problem: Discretisation) -> Indices:
    """Pairs of densities of a cell whose nodes have no other between them along an edge, shape (pairs, 2)."""
    cell = problem.scene.mesh.cell_name
    X = equal_sided(basix.CellType[cell], interpolation_points(problem.density_space.element))
    distance = np.abs(X[:, np.newaxis] - X).sum(axis=2)
    nearest = distance[distance > 0].min()
    return np.argwhere(np.triu(np.isclose(distance, nearest)))


def _beside_facets(problem: Discretisation) -> Indices:
    """The two cells beside each facet inside what grows that this rank owns, shape (facets, 2)."""
    topology, dim = problem.scene.mesh.domain.topology, problem.scene.mesh.dim
    topology.create_connectivity(dim - 1, dim)
    beside = topology.connectivity(dim - 1, dim)
    starts = beside.offsets[: topology.index_map(dim - 1).size_local + 1]
    inside = np.flatnonzero(np.diff(starts) == 2)
    pairs = np.asarray(beside.array[starts[inside, np.newaxis] + np.arange(2)])
    return pairs[problem.grows.x.array[pairs].all(axis=1)] if problem.rests else pairs
