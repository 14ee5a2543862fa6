"""The points of a body that are nearest to places beside it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import dolfinx
import numpy as np

from growthx.fem.cells import SIMPLICES
from growthx.meshing import sampling

if TYPE_CHECKING:
    from growthx.common.arrays import Floats, Indices
    from growthx.meshing.mesh import Mesh


def nearest(mesh: Mesh, places: Floats) -> tuple[Indices, Floats, Floats, Floats]:
    """The owned cell nearest to each place, (places, dim), where in it the nearest point is, and how far away.

    Shapes (places,), (places, dim) in the reference cell, (places,); and the sizes of the cells, (places,).  Distances
    are those of points found, which may be a little farther than the nearest.
    """
    domain, dim = mesh.domain, mesh.dim
    tree = dolfinx.geometry.bb_tree(domain, dim, entities=mesh.owned_cells)
    middles = dolfinx.geometry.create_midpoint_tree(domain, dim, mesh.owned_cells)
    x = np.zeros((len(places), 3))
    x[:, :dim] = places
    cells = np.asarray(dolfinx.geometry.compute_closest_entity(tree, middles, domain, x))
    X = sampling.pull_back(mesh, cells, places, lambda X: _into_the_cell(mesh.cell_name, X))
    nodes = sampling.nodes_of_cells(mesh)[cells][:, :, :dim]
    found = np.einsum("pn,pni->pi", sampling.geometry_basis(mesh, X)[0], nodes)
    return cells, X, np.linalg.norm(found - places, axis=1), np.linalg.norm(np.ptp(nodes, axis=1), axis=1)


def _into_the_cell(cell_name: str, X: Floats) -> Floats:
    """Points of the reference cell near to given ones."""
    X = np.clip(X, 0.0, 1.0)
    return X / np.maximum(X.sum(axis=1, keepdims=True), 1.0) if cell_name in SIMPLICES else X
