"""Fields exactly as the variant knows them, for ParaView: one small cell for each integration point, or the nodes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import basix.ufl
import dolfinx
import numpy as np
import ufl

from growthx.fem import compat
from growthx.meshing.sampling import positions
from growthx.post.derived import PointFields
from growthx.post.subcells import subcells
from growthx.results.series import Series

if TYPE_CHECKING:
    from pathlib import Path

    from mpi4py import MPI

    from growthx.common.arrays import Floats, Indices
    from growthx.discretisation.discretisation import Discretisation


def raw_writer(folder: Path, problem: Discretisation) -> PointWriter | NodeWriter:
    """What writes `raw.pvd` for the variant of a problem."""
    return (PointWriter if problem.variant.density.local else NodeWriter)(folder, problem)


class NodeWriter:
    """Writes a density that is continuous between cells, in its own degree, with the displacement at its nodes.

    Where some cells rest, each cell has nodes of its own, since the density jumps there, and tells whether it grows.
    """

    def __init__(self, folder: Path, problem: Discretisation) -> None:
        self._problem = problem
        self._file = Series(folder / "raw.pvd", problem.comm)
        mesh, degree = problem.scene.mesh, problem.density_space.element.basix_element.degree
        family = "DG" if problem.rests else "Lagrange"
        space = dolfinx.fem.functionspace(mesh.domain, (family, degree, (mesh.dim,)))
        self._displacement = dolfinx.fem.Function(space, name="displacement")
        self._density = problem.density
        if problem.rests:
            self._density = dolfinx.fem.Function(dolfinx.fem.functionspace(mesh.domain, ("DG", degree)), name="density")

    def write(self, time: float) -> None:
        """Append the state at a time."""
        problem, functions = self._problem, [self._displacement, self._density]
        self._displacement.interpolate(problem.displacement)
        if problem.rests:
            of_cells = problem.densities_of_cells()
            self._density.x.array[self._density.function_space.dofmap.list[: len(of_cells)]] = of_cells
            self._density.x.scatter_forward()
            functions.append(problem.grows)
        self._file.write(functions, time)

    def close(self) -> None:
        """Finish the files."""
        self._file.close()


class PointWriter:
    """Writes density, its relative change, the stimulus and what else `derived.FIELDS` tells raw at integration points.

    Each value on the part of a cell that is its point's; and where some cells rest, which of them grow.  The parts are
    a mesh of their own, which stays on the ranks of their cells; its points carry the displacement.
    """

    def __init__(self, folder: Path, problem: Discretisation) -> None:
        self._problem = problem
        self._file = Series(folder / "raw.pvd", problem.comm)
        mesh, variant = problem.scene.mesh, problem.variant
        points = variant.integration_points(mesh.cell_name)
        self._parts = subcells(mesh.cell_name, points)
        corners = positions(mesh, self._parts.X)[:, :, : mesh.dim]
        self._domain, self._cells, self._nodes = _loose_mesh(
            problem.comm, self._parts.shape, corners, self._parts.pieces
        )
        self._per_cell = dolfinx.fem.functionspace(self._domain, ("DG", 0))
        self._displacement = dolfinx.fem.Function(
            dolfinx.fem.functionspace(self._domain, ("Lagrange", 1, (mesh.dim,))), name="displacement"
        )
        self._fields = PointFields(problem, points)

    def write(self, time: float) -> None:
        """Append the state at a time."""
        problem, mesh = self._problem, self._problem.scene.mesh
        u = problem.displacement_at(self._parts.X).reshape(-1, mesh.dim)
        self._displacement.x.array.reshape(-1, mesh.dim)[self._nodes] = u
        functions = [self._displacement]
        for name, at_points in self._fields.values().items():
            function = dolfinx.fem.Function(self._per_cell, name=name)
            function.x.array[self._cells] = at_points[:, self._parts.points].ravel()
            functions.append(function)
        self._file.write(functions, time)

    def close(self) -> None:
        """Finish the files."""
        self._file.close()


def _loose_mesh(
    comm: MPI.Intracomm, shape: str, corners: Floats, pieces: Indices
) -> tuple[dolfinx.mesh.Mesh, Indices, Indices]:
    """A mesh of the pieces of every cell, which share no nodes with those of other cells.

    corners: of the pieces, (cells, corners, dim).  Returns the mesh and, for the pieces and corners in the given order,
    their cells and nodes there.
    """
    dim = corners.shape[2]
    points = corners.reshape(-1, dim)
    first = (comm.exscan(len(points)) or 0) + corners.shape[1] * np.arange(len(corners))
    cells = (first[:, np.newaxis, np.newaxis] + pieces).reshape(-1, pieces.shape[1])
    element = basix.ufl.element("Lagrange", shape, 1, shape=(dim,))
    domain = compat.mesh_that_stays(comm, cells, points, ufl.Mesh(element))
    start = (comm.exscan(len(cells)) or 0), (comm.exscan(len(points)) or 0)
    own = domain.topology.index_map(dim).size_local
    cell_of = np.empty(len(cells), dtype=np.int32)
    cell_of[domain.topology.original_cell_index[:own] - start[0]] = np.arange(own)
    node_of = np.empty(len(points), dtype=np.int32)
    node_of[domain.geometry.input_global_indices - start[1]] = np.arange(len(points))
    return domain, cell_of, node_of
