"""Positions inside cells, for whole arrays of cells."""

from __future__ import annotations

from typing import TYPE_CHECKING

import basix
import dolfinx
import numpy as np

from growthx import compat

if TYPE_CHECKING:
    from growthx.arrays import Floats, Indices
    from growthx.mesh import Mesh


PULL_BACK_ITERATIONS = 20  # quadratic: a convex quadrilateral takes five


def reference_corners(cell_name: str) -> Floats:
    """Corners of the reference cell, shape (corners, dim)."""
    return np.asarray(basix.geometry(basix.CellType[cell_name]))


def positions(mesh: Mesh, X: Floats) -> Floats:
    """Where the points X of the reference cell, (points, dim), lie in the owned cells, shape (cells, points, 3)."""
    return np.einsum("pn,cni->cpi", _geometry_basis(mesh, X)[0], _corners(mesh), optimize=True)


def volume_ratios(mesh: Mesh, X: Floats) -> Floats:
    """Volume of the owned cells per reference volume at the points X, shape (cells, points), positive."""
    derivatives = _geometry_basis(mesh, X)[1:]
    jacobian = np.einsum("dpn,cni->cpid", derivatives, _corners(mesh)[:, :, : mesh.dim], optimize=True)
    return np.abs(np.linalg.det(jacobian))


def dof_positions(space: dolfinx.fem.FunctionSpace, mesh: Mesh) -> Floats:
    """Where the point values of a scalar space lie, shape (local dofs, 3); NaN for those in no owned cell."""
    found = np.full((space.dofmap.index_map.size_local + space.dofmap.index_map.num_ghosts, 3), np.nan)
    found[space.dofmap.list[: len(mesh.owned_cells)]] = positions(mesh, compat.interpolation_points(space.element))
    return found


def locate(mesh: Mesh, places: Floats) -> tuple[Indices, Floats]:
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
    if found.any():  # basix aborts when it is given no points at all
        X[found] = _pull_back(mesh, cells[found], np.asarray(places)[found])
    return cells, X


def _pull_back(mesh: Mesh, cells: Indices, places: Floats) -> Floats:
    """Points of the reference cell that lie at the given places of the given cells, one each, by Newton's method."""
    nodes = _corners(mesh)[cells][:, :, : mesh.dim]
    X = np.full((len(places), mesh.dim), 1 / (mesh.dim + 1))
    for _ in range(PULL_BACK_ITERATIONS):
        basis = _geometry_basis(mesh, X)
        gap = places - np.einsum("pn,pni->pi", basis[0], nodes)
        jacobian = np.einsum("dpn,pni->pid", basis[1:], nodes)
        step = np.linalg.solve(jacobian, gap[:, :, np.newaxis])[:, :, 0]
        X += step
        if np.abs(step).max(initial=0.0) < 1e-12:
            break
    return X


def _geometry_basis(mesh: Mesh, X: Floats) -> Floats:
    """Shape functions of the geometry and their derivatives, shape (1 + dim, points, nodes)."""
    element = mesh.domain.ufl_domain().ufl_coordinate_element().sub_elements[0]
    return np.array(element.tabulate(1, X))


def _corners(mesh: Mesh) -> Floats:
    """Nodes of the owned cells, shape (cells, nodes, 3)."""
    return np.asarray(mesh.domain.geometry.x[compat.geometry_nodes(mesh.domain)[: len(mesh.owned_cells)]])
