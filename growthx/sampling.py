"""Positions inside cells, for whole arrays of cells."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from growthx import compat

if TYPE_CHECKING:
    import dolfinx

    from growthx.arrays import Floats
    from growthx.mesh import Mesh


def positions(mesh: Mesh, X: Floats) -> Floats:
    """Where the points X of the reference cell, (points, dim), lie in the owned cells, shape (cells, points, 3)."""
    return np.einsum("pn,cni->cpi", _geometry_basis(mesh, X)[0], _corners(mesh))


def volume_ratios(mesh: Mesh, X: Floats) -> Floats:
    """Volume of the owned cells per reference volume at the points X, shape (cells, points), positive."""
    derivatives = _geometry_basis(mesh, X)[1:]
    jacobian = np.einsum("dpn,cni->cpid", derivatives, _corners(mesh)[:, :, : mesh.dim])
    return np.abs(np.linalg.det(jacobian))


def dof_positions(space: dolfinx.fem.FunctionSpace, mesh: Mesh) -> Floats:
    """Where the point values of a scalar space lie, shape (local dofs, 3); NaN for those in no owned cell."""
    found = np.full((space.dofmap.index_map.size_local + space.dofmap.index_map.num_ghosts, 3), np.nan)
    found[space.dofmap.list[: len(mesh.owned_cells)]] = positions(mesh, compat.interpolation_points(space.element))
    return found


def _geometry_basis(mesh: Mesh, X: Floats) -> Floats:
    """Shape functions of the geometry and their derivatives, shape (1 + dim, points, nodes)."""
    element = mesh.domain.ufl_domain().ufl_coordinate_element().sub_elements[0]
    return np.array(element.tabulate(1, X))


def _corners(mesh: Mesh) -> Floats:
    """Nodes of the owned cells, shape (cells, nodes, 3)."""
    return np.asarray(mesh.domain.geometry.x[compat.geometry_nodes(mesh.domain)[: len(mesh.owned_cells)]])
