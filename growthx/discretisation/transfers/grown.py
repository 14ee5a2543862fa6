"""The density of a run with its body, whole on each rank, in an order that no number of ranks changes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import basix
import basix.ufl
import dolfinx
import numpy as np
import ufl
from mpi4py import MPI

from growthx.common.communicators import steady
from growthx.common.errors import InputError, shown
from growthx.common.words import quoted
from growthx.discretisation.variants import AtPoints, Nodal, PerCell
from growthx.fem import compat
from growthx.fem.cells import counted
from growthx.meshing.mesh import Mesh, given_order

if TYPE_CHECKING:
    from growthx.common.arrays import Floats, Indices, Marks
    from growthx.discretisation.discretisation import Discretisation

BODY = "body/"  # how the names of its arrays in files begin
KINDS = {kind.__name__: kind for kind in (Nodal, PerCell, AtPoints)}


@dataclass(frozen=True, repr=False, eq=False)
class GrownDensity:
    """What a run has made of a body, as `transfer` takes it; of a run's files what `read_density` returns.

    scene, variant: their names.  time: that the run has reached.
    density: where densities live in a cell.  mass_degree, momentum_degree: of the variant's rules.
    shape, degree: of the cells and their geometry.  points: of the mesh, (nodes, dim).  cells: rows of points,
    (cells, nodes of a cell), in the order in which DOLFINx was given them.
    densities: of each cell, (cells, densities of a cell).  rests: cells that did not grow, (cells,).
    """

    scene: str
    variant: str
    time: float
    density: Any
    mass_degree: int
    momentum_degree: int
    shape: str
    degree: int
    points: Floats
    cells: Indices
    densities: Floats
    rests: Marks

    def __repr__(self) -> str:
        cells = counted(len(self.cells), self.shape)
        return f"GrownDensity({quoted(self.scene)} with {self.variant} at t = {self.time:g}: {cells})"

    @property
    def dim(self) -> int:
        """Number of space dimensions."""
        return int(self.points.shape[1])

    @property
    def element(self) -> Any:
        """Of the density."""
        return self.density.element(self.shape, self.mass_degree)

    @property
    def corners(self) -> Floats:
        """Nodes of the cells, shape (cells, nodes of a cell, dim)."""
        return self.points[self.cells]

    @cached_property
    def mesh(self) -> tuple[Mesh, Indices]:
        """The body as a mesh of this rank alone, and the rows of its cells here."""
        geometry = basix.ufl.element("Lagrange", self.shape, self.degree, shape=(self.dim,))
        # By keyword: DOLFINx 0.10 swapped the order of x and e.
        domain = dolfinx.mesh.create_mesh(
            MPI.COMM_SELF, cells=self.cells.astype(np.int64), x=self.points, e=ufl.Mesh(geometry)
        )
        return Mesh(domain, {}), np.asarray(domain.topology.original_cell_index)

    def as_numbers(self) -> tuple[dict[str, Any], dict[str, Floats]]:
        """Numbers and texts, as JSON knows them, and arrays by "body/name", of which `from_numbers` makes it."""
        numbers = {
            name: getattr(self, name)
            for name in ("scene", "variant", "time", "mass_degree", "momentum_degree", "shape", "degree")
        }
        numbers |= {"density": type(self.density).__name__, "density_degree": getattr(self.density, "degree", 0)}
        arrays = {BODY + name: getattr(self, name) for name in ("points", "cells", "densities", "rests")}
        return numbers, arrays

    @classmethod
    def from_numbers(cls, numbers: dict[str, Any], arrays: dict[str, Floats]) -> GrownDensity:
        """What `as_numbers` has told; arrays: these, and perhaps others."""
        others = {name: value for name, value in numbers.items() if name not in ("density", "density_degree")}
        kind: Any = KINDS[numbers["density"]]
        own = {name.removeprefix(BODY): array for name, array in arrays.items() if name.startswith(BODY)}
        given: dict[str, Any] = {**others, **own}
        return cls(density=kind(numbers["density_degree"]) if kind is Nodal else kind(), **given)


def gathered(problem: Discretisation) -> GrownDensity | None:
    """What a problem has become in its state, whole on rank 0, None on the others (collective)."""
    mesh, variant = problem.scene.mesh, problem.variant
    domain, owned = mesh.domain, len(mesh.owned_cells)
    nodes, numbers = point_numbers(domain), cell_numbers(domain)[:owned]
    count = domain.geometry.index_map().size_local
    rests = ~np.isin(mesh.owned_cells, problem.growing_cells)
    cells = nodes[compat.geometry_nodes(domain)[:owned]]
    points = domain.geometry.x[:count, : mesh.dim]
    parts = mesh.comm.gather((nodes[:count], points, numbers, cells, problem.densities_of_cells(), rests))
    if parts is None:
        return None
    of_points, points, of_cells, *of_each = (np.concatenate(part) for part in zip(*parts, strict=True))
    cells, densities, rests = (part[np.argsort(of_cells)] for part in of_each)
    return GrownDensity(
        scene=problem.scene.name,
        variant=variant.name,
        time=float(problem.time),
        density=variant.density,
        mass_degree=variant.mass_degree,
        momentum_degree=variant.momentum_degree,
        shape=mesh.cell_name,
        degree=_degree(domain),
        points=points[np.argsort(of_points)],
        cells=cells,
        densities=densities,
        rests=rests,
    )


def grown(source: Any) -> GrownDensity:
    """What a result, a discretised scene or a folder's density says, whole on each rank (collective)."""
    if isinstance(source, GrownDensity):
        return source
    problem = getattr(source, "problem", source)
    if isinstance(problem, type) or not (hasattr(problem, "scene") and hasattr(problem, "densities_of_cells")):
        raise InputError(
            f"the density to transfer is that of {shown(source)}: a result, a discretised scene, or what "
            "read_density(folder) returns, would be right"
        )
    return problem.comm.bcast(gathered(problem))


def cell_numbers(domain: dolfinx.mesh.Mesh) -> Indices:
    """Numbers of the cells that this rank knows, in the order in which DOLFINx was given them (collective)."""
    topology = domain.topology
    return _numbers(given_order(domain).cells, topology.index_map(topology.dim), domain)


def point_numbers(domain: dolfinx.mesh.Mesh) -> Indices:
    """Numbers of the nodes that this rank knows, in the order in which DOLFINx was given them (collective)."""
    return _numbers(given_order(domain).nodes, domain.geometry.index_map(), domain)


def _numbers(given: Any, index_map: Any, domain: dolfinx.mesh.Mesh) -> Indices:
    """The numbers that were given, if they are those from 0 on, as of submeshes they are not; else DOLFINx's own."""
    given, size = np.asarray(given, dtype=np.int64), index_map.size_local
    comm = steady(domain.comm)
    sizes = comm.allreduce(len(given) != size + index_map.num_ghosts)
    there = comm.allgather(given[:size])
    if not sizes and np.array_equal(np.sort(np.concatenate(there)), np.arange(index_map.size_global)):
        return given
    return np.asarray(index_map.local_to_global(np.arange(size + index_map.num_ghosts, dtype=np.int32)))


def _degree(domain: dolfinx.mesh.Mesh) -> int:
    """Of the cells' geometry."""
    return int(domain.ufl_domain().ufl_coordinate_element().embedded_superdegree)
