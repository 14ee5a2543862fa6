"""A whole mesh on one rank spread over all of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import basix
import basix.ufl
import dolfinx
import numpy as np
import ufl
from dolfinx.io.utils import distribute_entity_data

from growthx.common.arrays import Indices
from growthx.meshing.content import Origin
from growthx.meshing.mesh import Mesh, given_order
from growthx.meshing.parts import Parts

if TYPE_CHECKING:
    from mpi4py import MPI


def distribute(whole: Parts | None, comm: MPI.Comm) -> Mesh:
    """The mesh of rank 0's parts, spread over the ranks by DOLFINx; the other ranks give None."""
    without_rows = comm.bcast(_without_rows(whole) if whole else None)
    parts = whole or without_rows
    element = basix.ufl.element("Lagrange", parts.shape, 1, shape=(parts.dim,))
    # By keyword: DOLFINx 0.10 swapped the order of x and e.
    domain = dolfinx.mesh.create_mesh(comm, cells=parts.cells, x=parts.points, e=ufl.Mesh(element))
    return Mesh(
        domain,
        {name: _local_indices(domain, parts.dim - 1, facets) for name, facets in parts.boundaries.items()},
        {name: _local_indices(domain, parts.dim, parts.cells[rows]) for name, rows in parts.regions.items()},
        _local_origin(domain, comm.bcast(whole and whole.origin)),
    )


def _local_origin(domain: dolfinx.mesh.Mesh, whole: Origin | None) -> Origin:
    """Where the cells and nodes that this rank knows come from."""
    given = given_order(domain)
    if whole is None:
        return given
    return Origin(
        whole.cells[given.cells],
        whole.cell_count,
        whole.nodes[given.nodes],
        whole.node_count,
        {name: values[given.cells] for name, values in whole.values.items()},
        whole.node_sets,
    )


def _without_rows(parts: Parts) -> Parts:
    """The same names and widths, which DOLFINx asks of every rank, with no points, cells or facets."""
    return Parts(
        parts.shape,
        parts.points[:0],
        parts.cells[:0],
        {name: facets[:0] for name, facets in parts.boundaries.items()},
        {name: rows[:0] for name, rows in parts.regions.items()},
    )


def _local_indices(domain: dolfinx.mesh.Mesh, dim: int, nodes: Indices) -> Indices:
    """Sorted local indices of the entities that rank 0 gives by their input nodes, (entities, corners)."""
    domain.topology.create_connectivity(dim, 0)
    domain.topology.create_connectivity(dim, domain.topology.dim)
    found, marks = distribute_entity_data(domain, dim, nodes, np.ones(len(nodes), dtype=np.int32))
    tags = dolfinx.mesh.meshtags_from_entities(domain, dim, dolfinx.graph.adjacencylist(found), marks)
    indices: Indices = np.unique(tags.indices)
    return indices
