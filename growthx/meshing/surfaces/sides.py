"""The surface of a body: its sides, their corners, and pieces of it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import basix
import basix.ufl
import dolfinx
import numpy as np

from growthx.common.communicators import same_on_all
from growthx.common.errors import InputError, raise_on_all, shown
from growthx.common.words import place_in_words

if TYPE_CHECKING:
    from mpi4py import MPI

    from growthx.common.arrays import Indices
    from growthx.meshing.content import Origin


@dataclass(frozen=True)
class Patch:
    """A piece of the surface, the same on all ranks but for the facets, which are each rank's own.

    facets: indices of those that this rank owns, (facets,), in its domain.  count: of all facets.
    size: area, or length in the plane.  centre, normal: means over the patch, the normal out of the body, of unit
    length (zeros where it closes in itself).  low, high: corners of the box about it.

    Example:
        >>> patch = gx.meshing.nearest(gx.meshing.patches(gx.scenes.plate(2).mesh), (2.0, 0.5))
        >>> isinstance(patch, gx.meshing.Patch), f"{patch.size:.3f}"
        (True, '1.000')
    """

    facets: Indices = field(repr=False)
    domain: dolfinx.mesh.Mesh = field(repr=False, compare=False)
    count: int
    size: float
    centre: tuple[float, ...]
    normal: tuple[float, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]

    def __str__(self) -> str:
        size = "length" if len(self.centre) == 2 else "area"
        return (
            f"{self.count} facets, {size} {self.size:.4g}, about {place(self.centre)}, facing {place(self.normal)}, "
            f"from {place(self.low)} to {place(self.high)}"
        )


def place(x: Any) -> str:
    """A place, or a direction, in words."""
    return place_in_words(np.round(np.asarray(x), 12), 4)


def sides(domain: dolfinx.mesh.Mesh) -> Indices:
    """The facets on the surface that this rank owns."""
    dim = domain.topology.dim
    domain.topology.create_connectivity(dim - 1, dim)
    return np.sort(dolfinx.mesh.exterior_facet_indices(domain.topology)).astype(np.int32)


def corner_nodes(domain: dolfinx.mesh.Mesh, facets: Indices) -> Indices:
    """Nodes of the geometry at the corners of facets, (facets, corners), in DOLFINx's order."""
    dim = domain.topology.dim
    width = len(basix.topology(basix.CellType[domain.topology.cell_name()])[dim - 1][0])
    if not len(facets):
        return np.empty((0, width), dtype=np.int32)
    domain.topology.create_connectivity(dim - 1, dim)
    domain.topology.create_connectivity(dim, dim - 1)
    nodes: Indices = dolfinx.mesh.entities_to_geometry(domain, dim - 1, facets, False)[:, :width]
    return nodes


def sides_within(domain: dolfinx.mesh.Mesh, origin: Origin, nodes: Any, name: str, comm: MPI.Comm) -> Indices:
    """The sides on the surface with all of their corners in a set of nodes, in the order of the mesh's file.

    InputError, on all ranks, for what is no such set, and if there is no such side: it says what is near (collective).
    """
    wanted = numbers_of_file(nodes, origin.node_count, f"the nodes of the boundary '{name}'", comm)
    facets = sides(domain)
    corners = corner_nodes(domain, facets)
    marked = np.isin(origin.nodes, wanted)[corners] if len(facets) else np.zeros(corners.shape, dtype=bool)
    found = facets[marked.all(axis=1)]
    if comm.allreduce(len(found)):
        return found
    most = int(marked.sum(axis=1).argmax()) if len(facets) else -1
    on_surface = np.unique(origin.nodes[corners[marked]]).tolist()
    best = (int(marked[most].sum()), domain.geometry.x[corners[most]].mean(axis=0).tolist()) if most >= 0 else (0, [])
    best = max(comm.allgather(best))
    count = len(set().union(*comm.allgather(on_surface)))
    near = (
        f"; the side about {place(best[1][: domain.geometry.dim])} has {best[0]} of its corners there" if count else ""
    )
    raise InputError(
        f"the boundary '{name}' would be empty: no side of a cell on the surface has all of its corners in the "
        f"{len(wanted)} nodes of its set, of which {count} are on the surface{near}"
    )


def corners_and_sides(domain: dolfinx.mesh.Mesh, marks: Any, comm: MPI.Comm) -> str:
    """How many corners of cells a function of position marks, and sides inside the body; "" for none (collective)."""
    dim = domain.topology.dim
    domain.topology.create_connectivity(0, dim)
    owned = domain.topology.index_map(0).size_local
    corners = np.sort(dolfinx.mesh.locate_entities(domain, 0, marks)).astype(np.int32)
    corners = corners[corners < owned]
    inner = dolfinx.mesh.locate_entities(domain, dim - 1, marks)
    inner = inner[inner < domain.topology.index_map(dim - 1).size_local]
    counts = comm.allreduce(np.array([len(corners), len(np.setdiff1d(inner, sides(domain)))]))
    if not counts[0]:
        return ""
    nodes = dolfinx.mesh.entities_to_geometry(domain, 0, corners, False).reshape(-1) if len(corners) else corners
    first = min(x for some in comm.allgather(domain.geometry.x[nodes, :dim].tolist()) for x in some)
    told = "a corner of cells lies" if counts[0] == 1 else f"{counts[0]} corners of cells lie"
    told += f" there, {'at' if counts[0] == 1 else 'the first at'} {place(first)}"
    return told + (f", and so do {counts[1]} sides inside the body" if counts[1] else "")


def numbers_of_file(given: Any, count: int, what: str, comm: MPI.Comm) -> Indices:
    """Numbers of nodes or cells in the order of the mesh's file; InputError on all ranks if they are none, or differ.

    Each rank knows some of them only: those of one rank alone would mean something else on another (collective).
    """
    found, trouble = whole_numbers(given, count)
    raise_on_all(comm, trouble and f"{what} {trouble}")
    if not same_on_all(found.astype(np.int64), comm):
        raise InputError(f"{what} differ from rank to rank: the same ones on all would be right")
    return found


def whole_numbers(nodes: Any, count: int) -> tuple[Indices, str]:
    """Numbers from 0 to before `count`, each once, and what is wrong with them, as the end of a sentence."""
    right = f"whole numbers from 0, below {count}, in the order of the mesh's file would be right"
    try:
        found = np.asarray(nodes)
    except ValueError:
        found = np.empty(0)
    if found.dtype.kind not in "iu" or found.ndim != 1 or not len(found):
        return np.empty(0, dtype=np.int64), f"are {shown(nodes)}: {right}"
    if found.min() < 0 or found.max() >= count:
        return np.empty(0, dtype=np.int64), f"have {found[(found < 0) | (found >= count)][0]} among them: {right}"
    return np.unique(found), ""
