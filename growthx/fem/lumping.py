"""Masses at the nodes of cells, and the rows of a system that a rank owns."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import basix
import dolfinx
import numpy as np
import ufl

from growthx.common.communicators import steady
from growthx.fem import kernels
from growthx.fem.assembly import assemble
from growthx.fem.cells import SIMPLICES
from growthx.fem.compat import cell_name

if TYPE_CHECKING:
    from growthx.common.arrays import Floats, Indices


ROUND_OFF = 1e-9  # share of a cell's volume that is none


class _RulePoints(np.ndarray[Any, Any]):
    """Numbers of a rule of one's own as FFCx takes them, with the signature that UFL asks for."""

    @property
    def ufl_signature(self) -> str:
        """The numbers."""
        return repr(self.tolist())


def at_nodes(volume: ufl.Measure, degree: int = 1) -> ufl.Measure:
    """A measure of volume whose integration points are the nodes of Lagrange cells of degree 1 or 2.

    Its weights are those of the corners in equal shares, and of Simpson's rule on tensor cells of degree 2; on
    simplices of degree 2 equal ones: `node_shares` makes masses of them.
    """
    if degree == 1:
        return volume.reconstruct(metadata={"quadrature_rule": "vertex", "quadrature_degree": 1})
    cell = cell_name(volume.ufl_domain())
    if cell not in SIMPLICES:
        return volume.reconstruct(metadata={"quadrature_rule": "GLL", "quadrature_degree": 3})
    points = np.asarray(basix.create_element(basix.ElementFamily.P, basix.CellType[cell], degree).points)
    reference = float(np.sum(basix.make_quadrature(basix.CellType[cell], 1)[1]))
    weights = np.full(len(points), reference / len(points))
    return volume.reconstruct(metadata=rule_of_points(points, weights, degree))


def rule_of_points(points: Floats, weights: Floats, degree: int) -> dict[str, Any]:
    """The metadata of an integral over cells by points of the reference cell, (points, dim), and weights of one's own.

    degree: in the name of the rule alone.
    """
    rule: dict[str, Any] = {"quadrature_rule": "custom", "quadrature_degree": degree}
    rule["quadrature_points"] = np.ascontiguousarray(points).view(_RulePoints)
    rule["quadrature_weights"] = np.ascontiguousarray(weights).view(_RulePoints)
    return rule


def node_shares(domain: dolfinx.mesh.Mesh, degree: int = 1) -> dolfinx.fem.Function:
    """A factor on integrands at the nodes of the cells that makes masses of the rule there: ∫ Nᵢ dV at each node.

    It is one on parallelograms and simplices of degree 1; on other cells the nodes' own shares are not those of Gauss
    points.  Where a row sum is not positive, as at the corners of simplices of degree 2 – on triangles it is zero, but
    for round-off of either sign – the masses of that cell are in proportion to ∫ Nᵢ² dV (Hinton, Rock & Zienkiewicz,
    Earthq. Eng. Struct. Dyn. 4 (1976) 245–249): then they keep the cell's volume, and not ∫ ρ dV.
    """
    space = dolfinx.fem.functionspace(domain, ("DG", degree))
    shares, test = dolfinx.fem.Function(space), ufl.TestFunction(space)
    volume = ufl.Measure("dx", domain=domain, metadata={"quadrature_degree": 2 * degree + 1})
    gauss, nodes = (assemble(kernels.form(test * measure)) for measure in (volume, at_nodes(volume, degree)))
    rows = gauss.reshape(-1, space.dofmap.dof_layout.num_dofs)
    wrong = rows.min(axis=1) <= ROUND_OFF * rows.sum(axis=1)
    if degree > 1 and steady(domain.comm).allreduce(int(np.count_nonzero(wrong))):
        squares = _diagonal(space, volume).reshape(rows.shape)
        scaled = squares * (rows.sum(axis=1) / squares.sum(axis=1))[:, np.newaxis]
        gauss = np.where(wrong[:, np.newaxis], scaled, rows).ravel()
    shares.x.array[: len(gauss)] = gauss / nodes
    shares.x.scatter_forward()
    return shares


def _diagonal(space: dolfinx.fem.FunctionSpace, volume: ufl.Measure) -> Any:
    """∫ Nᵢ² dV of the functions of a discontinuous space."""
    trial, test = ufl.TrialFunction(space), ufl.TestFunction(space)
    matrix = dolfinx.fem.assemble_matrix(dolfinx.fem.form(trial * test * volume))
    return matrix.to_scipy().diagonal()[: space.dofmap.index_map.size_local]


def owned(condition: dolfinx.fem.DirichletBC) -> Indices:
    """Indices of the constrained unknowns this rank owns."""
    dofs, count = condition.dof_indices()
    return np.asarray(dofs[:count])
