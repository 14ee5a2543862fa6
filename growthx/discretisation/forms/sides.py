"""Sides of plane cells on a boundary as parts of the cells: for values that are known at points of cells alone."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import basix
import numpy as np
import ufl

from growthx.fem.lumping import rule_of_points

if TYPE_CHECKING:
    from collections.abc import Iterator

    from growthx.meshing.mesh import Mesh


def sides(mesh: Mesh, boundary: str, degree: int) -> Iterator[tuple[ufl.Measure, Any]]:
    """Of each side of a cell, a measure of the cells that have it on an outer boundary, and N dA/dV there, in UFL.

    The measure has its points on the side and integrates polynomials of `degree` along it, so that ∫ f · N dA over the
    boundary is the sum of ∫ f · (N dA/dV) dV over the sides that are there.  In a plane mesh (collective).
    """
    cell, topology = basix.CellType[mesh.cell_name], mesh.domain.topology
    topology.create_connectivity(1, 2)
    topology.create_connectivity(2, 1)
    around, of_cells = topology.connectivity(1, 2), topology.connectivity(2, 1)
    facets = mesh.boundary(boundary)
    cells = around.array[around.offsets[facets]]
    own = cells < topology.index_map(2).size_local
    facets, cells = facets[own], cells[own]
    ends = basix.topology(cell)[1]
    places = np.argmax(of_cells.array.reshape(-1, len(ends))[cells] == facets[:, np.newaxis], axis=1)
    x, weights = map(np.asarray, basix.make_quadrature(basix.CellType.interval, degree))
    corners = np.asarray(basix.geometry(cell))
    normals = np.asarray(basix.cell.facet_outward_normals(cell))
    for place, ((first, last), normal) in enumerate(zip(ends, normals, strict=True)):
        if not mesh.comm.allreduce(int(np.count_nonzero(places == place))):
            continue  # compiling it would take a while
        along = corners[last] - corners[first]
        metadata = rule_of_points(corners[first] + x * along, np.linalg.norm(along) * weights, degree)
        here = np.sort(cells[places == place]).astype(np.int32)
        measure = ufl.Measure("dx", domain=mesh.domain, subdomain_data=[(1, here)], subdomain_id=1, metadata=metadata)
        # By Nanson's formula; whichever way the cell is numbered.
        yield measure, ufl.dot(ufl.as_vector(normal.tolist()), ufl.JacobianInverse(mesh.domain))
