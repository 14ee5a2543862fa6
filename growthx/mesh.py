"""A mesh whose boundaries and regions have names."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import dolfinx
import numpy as np
import ufl
from mpi4py import MPI

from growthx.arrays import Floats, Indices, Marks
from growthx.errors import InputError, raise_on_all, require_function, require_kind, require_name, shown

Locator = Callable[[Floats], Marks]


@dataclass(frozen=True)
class Mesh:
    """A DOLFINx mesh with named boundaries (facet indices) and named regions (cell indices).

    The index arrays are local to the rank, int32, sorted, and may hold ghosts.  Lengths are in the user's unit.
    """

    domain: dolfinx.mesh.Mesh
    boundaries: Mapping[str, Indices]
    regions: Mapping[str, Indices] = field(default_factory=dict)

    def __post_init__(self) -> None:
        _require_domain(self.domain)
        for parts, what in ((self.boundaries, "boundaries"), (self.regions, "regions")):
            require_kind(parts, Mapping, f"what names the {what} of a mesh", "a mapping from names to indices")

    @classmethod
    def with_names(
        cls,
        domain: dolfinx.mesh.Mesh,
        boundaries: Mapping[str, Locator],
        regions: Mapping[str, Locator] | None = None,
    ) -> Mesh:
        """Name the parts of a DOLFINx mesh by functions of position: x of shape (3, points) to booleans (points,).

        Raises InputError, on all ranks, for what is no such mesh or function (collective).
        """
        _require_domain(domain)
        for parts, what in ((boundaries, "boundaries"), (regions or {}, "regions")):
            require_kind(parts, Mapping, f"what names the {what} of a mesh", "a mapping from names to functions")
            for name, locator in parts.items():
                require_name(name, f"a name in the {what} of a mesh")
                require_function(locator, f"the place of '{name}'", "a function of position")
        dim = domain.topology.dim
        domain.topology.create_connectivity(dim - 1, dim)
        return cls(
            domain,
            {
                name: _located(dolfinx.mesh.locate_entities_boundary, domain, dim - 1, name, locator)
                for name, locator in boundaries.items()
            },
            {
                name: _located(dolfinx.mesh.locate_entities, domain, dim, name, locator)
                for name, locator in (regions or {}).items()
            },
        )

    @property
    def dim(self) -> int:
        """Number of space dimensions of the cells."""
        return int(self.domain.topology.dim)

    @property
    def cell_count(self) -> int:
        """Number of cells on all ranks."""
        return int(self.domain.topology.index_map(self.dim).size_global)

    @property
    def owned_cells(self) -> Indices:
        """Indices of the cells this rank owns."""
        return np.arange(self.domain.topology.index_map(self.dim).size_local, dtype=np.int32)

    @property
    def local_cells(self) -> Indices:
        """Indices of the cells this rank knows: its own, then ghosts."""
        index_map = self.domain.topology.index_map(self.dim)
        return np.arange(index_map.size_local + index_map.num_ghosts, dtype=np.int32)

    @property
    def cell_name(self) -> str:
        """Shape of the cells, such as "quadrilateral"."""
        return str(self.domain.topology.cell_name())

    def boundary(self, name: str) -> Indices:
        """Facets of the boundary `name`; InputError if no such boundary exists."""
        return _named(self.boundaries, name, "boundary", self.domain.comm)

    def region(self, name: str) -> Indices:
        """Cells of the region `name`; InputError if no such region exists."""
        return _named(self.regions, name, "region", self.domain.comm)

    def corner(self, at: tuple[float, ...]) -> Indices:
        """The corner of cells at a place, (dim,), none or one; InputError if it is on no rank (collective)."""
        place = "({})".format(", ".join(f"{x:g}" for x in at))
        if len(at) != self.dim:
            raise InputError(f"the support at {place} has {len(at)} coordinates: the mesh needs {self.dim}")
        comm, x = self.domain.comm, self.domain.geometry.x
        size = comm.allreduce(float(np.abs(x).max(initial=0.0)), MPI.MAX)
        self.domain.topology.create_connectivity(0, self.dim)
        found = dolfinx.mesh.locate_entities(
            self.domain, 0, lambda y: np.abs(y[: self.dim].T - np.array(at)).max(axis=1, initial=0.0) <= 1e-9 * size
        )
        if not comm.allreduce(len(found)):
            raise InputError(f"no node of the mesh is at {place}: a corner of a cell would be right for a support")
        return found

    def boundary_measure(self, name: str, degree: int) -> ufl.Measure:
        """Surface measure of one named boundary, integrating polynomials of `degree` exactly."""
        return self._measure("ds", self.dim - 1, self.boundary(name), degree)

    def volume_measure(self, region: str | None, degree: int) -> ufl.Measure:
        """Volume measure of a named region, or of the whole mesh, integrating polynomials of `degree` exactly."""
        return self._measure("dx", self.dim, self.local_cells if region is None else self.region(region), degree)

    def _measure(self, kind: str, dim: int, entities: Indices, degree: int) -> ufl.Measure:
        tags = dolfinx.mesh.meshtags(self.domain, dim, entities, np.ones_like(entities))
        metadata = {"quadrature_degree": degree}
        return ufl.Measure(kind, domain=self.domain, subdomain_data=tags, subdomain_id=1, metadata=metadata)


def _require_domain(domain: Any) -> None:
    require_kind(domain, dolfinx.mesh.Mesh, "the domain of a mesh", "a dolfinx.mesh.Mesh")
    dims = domain.topology.dim, domain.geometry.dim
    if dims not in ((2, 2), (3, 3)):
        raise InputError(
            f"the cells of the mesh have dimension {dims[0]} in a space of {dims[1]}: 2 of both or 3 would be right"
        )


def _located(find: Any, domain: dolfinx.mesh.Mesh, dim: int, name: str, locator: Locator) -> Indices:
    """Entities that a finder of DOLFINx has by a locator; InputError on all ranks if it is of no use (collective)."""
    problem = ""

    def marks(x: Floats) -> Marks:
        nonlocal problem
        try:
            found = np.asarray(locator(x))
            if found.dtype != bool or found.shape not in ((), (x.shape[1],)):
                problem = f"an array of {found.dtype} of shape {found.shape} for {x.shape[1]} points"
        except Exception as error:  # on one rank, perhaps: as it is, it would leave the others waiting
            problem = shown(error)
        return np.zeros(x.shape[1], dtype=bool) if problem else np.array(np.broadcast_to(found, x.shape[1]))

    entities: Indices = find(domain, dim, marks)
    where = f"the function that places '{name}' gave"
    raise_on_all(domain.comm, problem and f"{where} {problem}: True or False for each point would be right")
    return entities


def _named(parts: Mapping[str, Indices], name: str, kind: str, comm: Any) -> Indices:
    if name not in parts:
        known = ", ".join(f"'{known}'" for known in sorted(parts)) or "none at all"
        raise InputError(f"the mesh has no {kind} named '{name}'; it has {known}")
    if comm.allreduce(len(parts[name])) == 0:
        raise InputError(f"the {kind} '{name}' of the mesh is empty")
    return parts[name]
