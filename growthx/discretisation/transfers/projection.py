"""Samples of a density as the densities of a variant, of the same mass: in each cell, or at nodes that cells share."""

from __future__ import annotations

from typing import TYPE_CHECKING

import dolfinx
import numpy as np
from mpi4py import MPI

from growthx.discretisation.transfers.recovery import limited, through, volumes_of_densities
from growthx.discretisation.variants import AtPoints, Nodal, PerCell
from growthx.fem import compat
from growthx.fem.assembly import sum_cells
from growthx.fem.projection import NodalProjection

if TYPE_CHECKING:
    from growthx.common.arrays import Floats, Marks
    from growthx.discretisation.transfers.samples import Samples
    from growthx.discretisation.variants import Variant
    from growthx.meshing.mesh import Mesh

LEAST = 0.5  # of the least density there was, that a quadratic one may fall to between its nodes


def in_cells(samples: Samples, mesh: Mesh, variant: Variant) -> Floats:
    """Densities that no two cells share, (owned cells, densities of a cell): the nearest in each, within its bounds."""
    weights = samples.weights
    means = np.einsum("cp,cp->c", weights, samples.values) / weights.sum(axis=1)
    if isinstance(variant.density, PerCell):
        return means[:, np.newaxis]
    element = variant.density_element(mesh.cell_name)
    if isinstance(variant.density, AtPoints):
        points = element.custom_quadrature()[0]
        basis, at = (through(element.cell_type, points, X) for X in (samples.X, points))
    else:
        basis = variant.density.shares(element, samples.X)
        at = np.eye(basis.shape[1])
    own = volumes_of_densities(mesh, variant.density, element, variant.momentum_degree)
    values = _nearest(basis, weights, samples.values) @ at.T
    return limited(values, own, means, samples.values.min(axis=1), samples.values.max(axis=1))


def _nearest(basis: Floats, weights: Floats, values: Floats) -> Floats:
    """Coefficients of the functions of a basis, (points, functions), that are nearest to values in each cell."""
    masses = np.einsum("cp,pi,pj->cij", weights, basis, basis, optimize=True)
    right = (weights * values) @ basis
    return np.asarray(np.linalg.solve(masses, right[:, :, np.newaxis])[:, :, 0])


def at_nodes(samples: Samples, mesh: Mesh, variant: Variant, space: dolfinx.fem.FunctionSpace) -> tuple[Floats, Marks]:
    """Densities of shared nodes, as `x.array`, and which cells the run's body rests in, (owned cells,) (collective).

    What rests has no say where something grows.
    """
    rests = np.einsum("cp,cp->c", samples.weights, samples.rests) > 0.5 * samples.weights.sum(axis=1)
    everywhere = not mesh.comm.allreduce(int(np.count_nonzero(~rests)))
    nodes = _Nodes(samples, np.ones(len(rests), dtype=bool) if everywhere else ~rests, mesh, space)
    linear = variant.density == Nodal(1)
    values = nodes.limited() if linear else _quadratic(nodes, samples, mesh, space)
    own = volumes_of_densities(mesh, variant.density, variant.density_element(mesh.cell_name), variant.momentum_degree)
    rows = space.dofmap.list[: len(rests)]
    sums = [np.sum(samples.weights * samples.values * nodes.heard), np.sum(own * values[rows] * nodes.heard)]
    wanted, found = mesh.comm.allreduce(np.array(sums))
    return values * (wanted / found if found > 0 else 1.0), rests & (not everywhere)


def _quadratic(nodes: _Nodes, samples: Samples, mesh: Mesh, space: dolfinx.fem.FunctionSpace) -> Floats:
    """The nearest of higher degree; as much of the linear one in it as keeps it above zero."""
    values = nodes.nearest()
    low = LEAST * mesh.comm.allreduce(float(samples.values.min(initial=np.inf)), MPI.MIN)
    if mesh.comm.allreduce(float(np.min(values, where=nodes.known, initial=np.inf)), MPI.MIN) >= low:
        return values
    linear = dolfinx.fem.functionspace(mesh.domain, ("Lagrange", 1))
    basis = linear.ufl_element().tabulate(0, compat.interpolation_points(space.element))[0]
    rows = _Nodes(samples, nodes.heard[:, 0], mesh, linear).limited()[linear.dofmap.list[: len(nodes.heard)]]
    safe = values.copy()
    safe[space.dofmap.list[: len(rows)]] = rows @ basis.T
    total = sum_cells(space, np.stack([nodes.heard * (rows @ basis.T), nodes.heard * np.ones(len(basis))], axis=2))
    np.divide(total[:, 0], total[:, 1], out=safe, where=total[:, 1] > 0)
    short = nodes.known & (values < low)
    share = np.divide(safe - low, safe - values, out=np.ones_like(values), where=short)
    return safe + max(0.0, mesh.comm.allreduce(float(share.min(initial=1.0)), MPI.MIN)) * (values - safe)


class _Nodes:
    """The projection onto shared nodes, without a matrix: products of cells, summed.

    heard: ones for the cells that count, (cells, 1).  known: nodes of these, (local nodes,).
    """

    def __init__(self, samples: Samples, heard: Marks, mesh: Mesh, space: dolfinx.fem.FunctionSpace) -> None:
        self._rows = space.dofmap.list[: len(heard)]
        self.heard = heard[:, np.newaxis].astype(float)
        basis = space.ufl_element().tabulate(0, samples.X)[0]
        weights = self.heard * samples.weights
        self._masses = np.einsum("cp,pi,pj->cij", weights, basis, basis, optimize=True)
        self._cells = NodalProjection(space, self._masses, (weights * samples.values) @ basis, mesh.comm)
        self._volumes = self._cells.sum(self._masses.sum(axis=2))
        self.known = self._cells.known
        counts = self.heard[:, 0] > 0
        self._low = mesh.comm.allreduce(float(samples.values[counts].min(initial=np.inf)), MPI.MIN)
        self._high = mesh.comm.allreduce(float(samples.values[counts].max(initial=-np.inf)), MPI.MAX)

    def nearest(self) -> Floats:
        """The density at nodes that is nearest to the samples."""
        return self._cells.nearest(0.5 * (self._low + self._high))

    def limited(self) -> Floats:
        """The same of a linear density, within the bounds of the samples: as near to it as these let each cell be."""
        volumes = np.where(self.known, self._volumes, 1.0)
        coarse = self._cells.right / volumes
        fine = self.nearest()[self._rows]
        # What makes the lumped projection the nearest, cell by cell, in which its sum is zero.
        flux = self._masses.sum(axis=2) * fine - np.einsum("cij,cj->ci", self._masses, fine)
        shares = np.ones_like(flux)
        for sign, end in ((1.0, self._high), (-1.0, self._low)):
            towards = np.maximum(sign * flux, 0.0)
            whole, room = self._cells.sum(towards), np.maximum(sign * (end - coarse), 0.0) * volumes
            part = np.minimum(1.0, np.divide(room, whole, out=np.ones_like(room), where=whole > 0))
            np.minimum(shares, np.where(towards > 0, part[self._rows], 1.0), out=shares)
        return coarse + self._cells.sum(shares.min(axis=1, keepdims=True) * flux) / volumes
