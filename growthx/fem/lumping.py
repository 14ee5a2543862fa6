"""Masses at the corners of cells, and the rows of a system that a rank owns."""

from __future__ import annotations

from typing import TYPE_CHECKING

import dolfinx
import numpy as np
import ufl

from growthx.fem import kernels
from growthx.fem.assembly import assemble

if TYPE_CHECKING:
    from growthx.common.arrays import Indices


def at_corners(volume: ufl.Measure) -> ufl.Measure:
    """A measure of volume whose integration points are the corners of the cells, in equal shares."""
    return volume.reconstruct(metadata={"quadrature_rule": "vertex", "quadrature_degree": 1})


def corner_shares(domain: dolfinx.mesh.Mesh) -> dolfinx.fem.Function:
    """A factor on integrands at the corners of cells that makes lumped matrices of row sums: ∫ Nᵢ dV at each corner.

    It is one on parallelograms and simplices; on other cells the corners' own shares are not those of Gauss points.
    """
    space = dolfinx.fem.functionspace(domain, ("DG", 1))
    shares, test = dolfinx.fem.Function(space), ufl.TestFunction(space)
    volume = ufl.Measure("dx", domain=domain, metadata={"quadrature_degree": 3})
    gauss, corners = (assemble(kernels.form(test * measure)) for measure in (volume, at_corners(volume)))
    shares.x.array[: len(gauss)] = gauss / corners
    shares.x.scatter_forward()
    return shares


def owned(condition: dolfinx.fem.DirichletBC) -> Indices:
    """Indices of the constrained unknowns this rank owns."""
    dofs, count = condition.dof_indices()
    return np.asarray(dofs[:count])
