"""Positions inside cells, for whole arrays of cells."""

from __future__ import annotations

from itertools import permutations
from typing import TYPE_CHECKING, Any

import basix
import dolfinx
import numpy as np

from growthx.common.communicators import same_on_all
from growthx.common.errors import raise_on_all, shown
from growthx.fem import compat
from growthx.fem.cells import SIMPLICES

if TYPE_CHECKING:
    from collections.abc import Callable

    from mpi4py import MPI

    from growthx.common.arrays import Floats, Indices, Selection
    from growthx.meshing.mesh import Mesh


ALL = slice(None)
PULL_BACK_ITERATIONS = 20  # quadratic: a convex quadrilateral takes five


def reference_corners(cell_name: str) -> Floats:
    """Corners of the reference cell, shape (corners, dim)."""
    return np.asarray(basix.geometry(basix.CellType[cell_name]))


def split_rule(cell_name: str, parts: int, degree: int) -> tuple[Floats, Floats]:
    """Points of the reference cell, (points, dim), and weights, of a rule in each of so many parts along every edge.

    Simplices are parted as Kuhn does: the corner x₁ ≥ x₂ ≥ x₃ of a cube of parts³ cubes, in tetrahedra of equal volume.
    """
    X, weights = (np.asarray(part) for part in basix.make_quadrature(basix.CellType[cell_name], degree))
    dim = X.shape[1]
    low = np.stack(np.meshgrid(*[np.arange(parts)] * dim, indexing="ij"), axis=-1).reshape(-1, 1, dim)
    if cell_name not in SIMPLICES:
        points = (low + X).reshape(-1, dim) / parts
        return points, np.tile(weights, len(low)) / parts**dim
    inner = np.vstack([X, np.full(dim, 1 / (dim + 1))])  # and the middle, which tells whether a part belongs
    falling = np.cumsum(inner[:, ::-1], axis=1)[:, ::-1]
    found = []
    for order in permutations(range(dim)):
        places = low + falling[:, np.argsort(order)]
        within = np.all(np.diff(places[:, -1], axis=1) < 0, axis=1)
        found.append(places[within, :-1].reshape(-1, dim))
    y = np.concatenate(found) / parts
    points = np.column_stack([y[:, :-1] - y[:, 1:], y[:, -1]])
    return points, np.tile(weights, len(points) // len(X)) / parts**dim


def positions(mesh: Mesh, X: Floats, cells: Selection = ALL) -> Floats:
    """Where the points X of the reference cell, (points, dim), lie in owned cells, all or some, (cells, points, 3)."""
    return np.einsum("pn,cni->cpi", geometry_basis(mesh, X)[0], nodes_of_cells(mesh)[cells], optimize=True)


def volume_ratios(mesh: Mesh, X: Floats, cells: Indices | slice = slice(None)) -> Floats:
    """Volume of the owned cells per reference volume at the points X, shape (cells, points), positive.

    cells: which of them.
    """
    derivatives = geometry_basis(mesh, X)[1:]
    jacobian = np.einsum("dpn,cni->cpid", derivatives, nodes_of_cells(mesh)[cells][:, :, : mesh.dim], optimize=True)
    return np.abs(np.linalg.det(jacobian))


def dof_positions(space: dolfinx.fem.FunctionSpace, mesh: Mesh) -> Floats:
    """Where the point values of a scalar space lie, shape (local dofs, 3); NaN for those in no owned cell."""
    found = np.full((space.dofmap.index_map.size_local + space.dofmap.index_map.num_ghosts, 3), np.nan)
    found[space.dofmap.list[: len(mesh.owned_cells)]] = positions(mesh, compat.interpolation_points(space.element))
    return found


def as_places(places: Any, dim: int, comm: MPI.Comm) -> tuple[Floats, slice]:
    """The places in the body of all ranks, shape (places, dim), and which of them are this rank's (collective).

    Where all ranks have the same ones, those alone.  In the plane they may have a third coordinate, zero, as DOLFINx
    gives it to functions of position.  InputError, on all ranks, if any has what are no places.
    """
    found, trouble = as_rows(_in_the_plane(places) if dim == 2 else places, dim, "places")
    raise_on_all(comm, trouble and f"the places to sample {trouble}")
    if same_on_all(found, comm):
        return found, slice(len(found))
    everyone = comm.allgather(found)
    start = sum(map(len, everyone[: comm.rank]))
    return np.concatenate(everyone), slice(start, start + len(found))


def _in_the_plane(places: Any) -> Any:
    """Places without a third coordinate that is zero in all of them; anything else as it is."""
    try:
        found = np.asarray(places)
    except ValueError:
        return places
    flat = found.ndim == 2 and found.shape[1] == 3 and found.dtype.kind in "iuf" and not found[:, 2].any()
    return found[:, :2] if flat else places


def as_rows(values: Any, dim: int, what: str) -> tuple[Floats, str]:
    """Values as rows of so many finite numbers, and what is wrong with them, as the end of a sentence."""
    right = f"shape ({what}, {dim}), a row for each, would be right"
    try:
        found = np.asarray(values)
        if found.dtype.kind not in "iuf":
            raise TypeError
        found = found.astype(float)
    except (TypeError, ValueError, OverflowError):
        return np.empty((0, dim)), f"are {shown(values)}: {right}"
    if found.ndim != 2 or found.shape[1] != dim:
        return np.empty((0, dim)), f"are of shape {found.shape}: {right}"
    wrong = found[~np.isfinite(found).all(axis=1)]
    if len(wrong):
        return found, f"have {shown(wrong[0].tolist())} among them: finite coordinates would be right"
    return found, ""


def cells_at(mesh: Mesh, places: Floats) -> tuple[Indices, Floats]:
    """The owned cell that holds each place, or −1, shape (places,), and where it lies in the reference cell.

    places, and the places in the reference cell: (places, dim).  On the border of cells, one of them holds it.
    """
    domain = mesh.domain
    x = np.zeros((len(places), 3))
    x[:, : mesh.dim] = places
    tree = dolfinx.geometry.bb_tree(domain, mesh.dim, entities=mesh.owned_cells, padding=1e-12)
    near = dolfinx.geometry.compute_collisions_points(tree, x)
    hits = dolfinx.geometry.compute_colliding_cells(domain, near, x)
    found = np.diff(hits.offsets) > 0
    cells = np.full(len(places), -1, dtype=np.int32)
    cells[found] = hits.array[hits.offsets[:-1][found]]
    X = np.zeros((len(places), mesh.dim))
    X[found] = pull_back(mesh, cells[found], np.asarray(places)[found])
    return cells, X


def pull_back(mesh: Mesh, cells: Indices, places: Floats, within: Callable[[Floats], Floats] = lambda X: X) -> Floats:
    """Points of the reference cell that lie at the given places of the given cells, one each, by Newton's method.

    within: what becomes of each iterate.
    """
    nodes = nodes_of_cells(mesh)[cells][:, :, : mesh.dim]
    X: Floats = np.full((len(places), mesh.dim), 1 / (mesh.dim + 1))
    for _ in range(PULL_BACK_ITERATIONS):
        basis = geometry_basis(mesh, X)
        gap = places - np.einsum("pn,pni->pi", basis[0], nodes)
        jacobian = np.einsum("dpn,pni->pid", basis[1:], nodes)
        step = np.linalg.solve(jacobian, gap[:, :, np.newaxis])[:, :, 0]
        before, X = X, within(X + step)
        if np.abs(X - before).max(initial=0.0) < 1e-12:
            break
    return X


def geometry_basis(mesh: Mesh, X: Floats) -> Floats:
    """Shape functions of the geometry and their derivatives, shape (1 + dim, points, nodes)."""
    if not len(X):  # basix aborts when it is given no points at all
        return np.zeros((1 + mesh.dim, 0, compat.geometry_nodes(mesh.domain).shape[1]))
    element = mesh.domain.ufl_domain().ufl_coordinate_element().sub_elements[0]
    return np.array(element.tabulate(1, X))


def nodes_of_cells(mesh: Mesh) -> Floats:
    """Nodes of the owned cells, shape (cells, nodes, 3)."""
    return np.asarray(mesh.domain.geometry.x[compat.geometry_nodes(mesh.domain)[: len(mesh.owned_cells)]])
