"""A mesh whose boundaries and regions have names."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import dolfinx
import numpy as np
import ufl

from growthx.arrays import Floats, Indices, Marks
from growthx.errors import InputError

Locator = Callable[[Floats], Marks]


@dataclass(frozen=True)
class Mesh:
    """A DOLFINx mesh with named boundaries (facet indices) and named regions (cell indices).

    The index arrays are local to the rank, int32, sorted, and may hold ghosts.  Lengths are in the user's unit.
    """

    domain: dolfinx.mesh.Mesh
    boundaries: Mapping[str, Indices]
    regions: Mapping[str, Indices] = field(default_factory=dict)

    @classmethod
    def with_names(
        cls,
        domain: dolfinx.mesh.Mesh,
        boundaries: Mapping[str, Locator],
        regions: Mapping[str, Locator] | None = None,
    ) -> Mesh:
        """Name the parts of a DOLFINx mesh by functions of position: x of shape (3, points) to booleans (points,)."""
        dim = domain.topology.dim
        domain.topology.create_connectivity(dim - 1, dim)
        return cls(
            domain,
            {
                name: dolfinx.mesh.locate_entities_boundary(domain, dim - 1, locator)
                for name, locator in boundaries.items()
            },
            {name: dolfinx.mesh.locate_entities(domain, dim, locator) for name, locator in (regions or {}).items()},
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


def _named(parts: Mapping[str, Indices], name: str, kind: str, comm: Any) -> Indices:
    if name not in parts:
        known = ", ".join(f"'{known}'" for known in sorted(parts)) or "none at all"
        raise InputError(f"the mesh has no {kind} named '{name}'; it has {known}")
    if comm.allreduce(len(parts[name])) == 0:
        raise InputError(f"the {kind} '{name}' of the mesh is empty")
    return parts[name]
