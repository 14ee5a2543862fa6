"""The surface in pieces between its sharp edges, for boundaries that a file does not name."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI

from growthx.common.checks import require_each, require_kind, require_number, require_vector
from growthx.common.errors import InputError
from growthx.fem import compat
from growthx.meshing.corners import facet_vectors
from growthx.meshing.mesh import Mesh
from growthx.meshing.surfaces.sides import Patch, corner_nodes, place, sides

if TYPE_CHECKING:
    from growthx.common.arrays import Floats, Indices

# Edges of a facet by its number of corners, in DOLFINx's order; of an interval its ends.
_EDGES = {2: [[0], [1]], 3: [[0, 1], [1, 2], [2, 0]], 4: [[0, 1], [1, 3], [3, 2], [2, 0]]}


def patches(mesh: Mesh, angle: float = 30.0) -> tuple[Patch, ...]:
    """The pieces of the surface between edges at which it turns by more than an angle, the largest first (collective).

    angle: in degrees, between the normals of neighbouring facets: 0 for a flat surface, 90 at the edge of a cube

    `mesh.named(boundaries={"top": gx.meshing.patches(mesh)[0]})` names one; print them to see which is which.

    InputError if the angle is not between 0 and 180.

    Example:
        >>> found = gx.meshing.patches(gx.scenes.plate(2).mesh)
        >>> [f"{patch.size:.3f}" for patch in found]
        ['2.000', '2.000', '1.000', '1.000']
    """
    require_kind(mesh, Mesh, "the mesh of patches", "a mesh of growthx")
    require_number(angle, "the angle between patches", "degrees between 0 and 180", lambda a: 0 < a < 180)
    facets = sides(mesh.domain)
    nodes = corner_nodes(mesh.domain, facets)
    corners = mesh.domain.geometry.x[nodes][:, :, : mesh.dim]
    areas, normals = _normals(mesh, facets, corners)
    found: Any = mesh.comm.gather(
        (mesh.domain.geometry.index_map().local_to_global(nodes.reshape(-1)), corners, normals)
    )
    counts = mesh.comm.allgather(len(facets))
    labels = None
    if mesh.comm.rank == 0:
        ids = np.concatenate([part[0] for part in found]).reshape(-1, nodes.shape[1])
        middles = np.concatenate([part[1] for part in found]).mean(axis=1)
        whole = _labels(ids, np.concatenate([part[2] for part in found]), middles, angle)
        labels = np.split(whole, np.cumsum(counts)[:-1])
    own = mesh.comm.scatter(labels)
    number = max(mesh.comm.allgather(int(own.max(initial=-1)))) + 1
    found_patches = _patches(mesh, facets, corners, areas, normals, own, number)
    return tuple(sorted(found_patches, key=lambda patch: (-round(patch.size, 12), patch.centre)))


def nearest(some: Iterable[Patch], at: tuple[float, ...]) -> Patch:
    """The patch whose centre is nearest to a place; InputError for none, and for a place of another dimension.

    Example:
        >>> found = gx.meshing.patches(gx.scenes.plate(2).mesh)
        >>> gx.meshing.nearest(found, (2.0, 0.5)).count
        2
    """
    patches = require_each(tuple(some), Patch, "the patches", "patch")
    where = np.array(require_vector(at, "the place of a patch"))
    if not patches:
        raise InputError(f"there are no patches near {place(where)}: those of a mesh would be right")
    if len(where) != len(patches[0].centre):
        raise InputError(f"the place of a patch has {len(where)} coordinates: {len(patches[0].centre)} would be right")
    found: Patch = min(patches, key=lambda patch: float(np.linalg.norm(np.array(patch.centre) - where)))
    return found


def _normals(mesh: Mesh, facets: Indices, corners: Floats) -> tuple[Floats, Floats]:
    """Areas of facets and their normals out of the body."""
    across = facet_vectors(corners)
    mesh.domain.topology.create_connectivity(mesh.dim - 1, mesh.dim)
    of = mesh.domain.topology.connectivity(mesh.dim - 1, mesh.dim)
    cells = of.array[of.offsets[facets]] if len(facets) else np.empty(0, dtype=np.int32)
    middles = mesh.domain.geometry.x[compat.geometry_nodes(mesh.domain)[cells]].mean(axis=1)[:, : mesh.dim]
    outward = np.sign(np.einsum("fi,fi->f", across, corners.mean(axis=1) - middles))
    areas = np.linalg.norm(across, axis=1)
    return areas, across * (outward / np.where(areas > 0, areas, 1.0))[:, np.newaxis]


def _labels(ids: Indices, normals: Floats, middles: Floats, angle: float) -> Indices:
    """The patch of each facet of the whole surface: those that meet at an edge without turning sharply are of one."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    edges = np.sort(ids[:, _EDGES[ids.shape[1]]].reshape(-1, len(_EDGES[ids.shape[1]][0])), axis=1)
    of = np.repeat(np.arange(len(ids)), len(_EDGES[ids.shape[1]]))
    _, which, counts = np.unique(edges, axis=0, return_inverse=True, return_counts=True)
    order = np.argsort(which.reshape(-1), kind="stable")
    first = np.cumsum(counts) - counts
    pairs = np.column_stack([of[order[first[counts == 2]]], of[order[first[counts == 2] + 1]]])
    cosines = np.einsum("pi,pi->p", normals[pairs[:, 0]], normals[pairs[:, 1]])
    smooth = pairs[cosines > np.cos(np.radians(angle))]
    graph = coo_array((np.ones(len(smooth), dtype=np.int8), smooth.T), shape=(len(ids), len(ids)))
    labels: Indices = connected_components(graph, directed=False)[1]
    return labels


def _patches(
    mesh: Mesh, facets: Indices, corners: Floats, areas: Floats, normals: Floats, own: Indices, number: int
) -> list[Patch]:
    """So many patches of the facets of all ranks; own: the number of the patch of each of this rank's.

    All at once: the surface of voxels has thousands.
    """
    dim = mesh.dim
    weights = areas[:, np.newaxis]
    columns = np.column_stack([np.ones_like(areas), areas, weights * corners.mean(axis=1), weights * normals])
    sums = np.column_stack([np.bincount(own, weights=column, minlength=number) for column in columns.T])
    mesh.comm.Allreduce(MPI.IN_PLACE, sums)
    ends = np.full((number, 2 * dim), -np.inf)  # the lowest is the highest of what is negative
    np.maximum.at(ends, own, np.column_stack([(-corners).max(axis=1), corners.max(axis=1)]))
    mesh.comm.Allreduce(MPI.IN_PLACE, ends, MPI.MAX)
    sizes = sums[:, 1]
    centres = sums[:, 2 : 2 + dim] / np.where(sizes > 0, sizes, 1.0)[:, np.newaxis]
    lengths = np.linalg.norm(sums[:, 2 + dim :], axis=1)
    closed = lengths <= 1e-9 * sizes  # in itself: what is left of the mean is round-off
    directions = np.where(closed[:, np.newaxis], 0.0, sums[:, 2 + dim :])
    directions /= np.where(closed, 1.0, lengths)[:, np.newaxis]
    order = np.argsort(own, kind="stable")
    rows = np.split(facets[order], np.cumsum(np.bincount(own, minlength=number))[:-1])
    places = np.round(np.stack([centres, directions, -ends[:, :dim], ends[:, dim:]], axis=1), 12) + 0.0
    return [
        Patch(
            rows[one],
            mesh.domain,
            round(float(sums[one, 0])),
            float(sizes[one]),
            *(tuple(map(float, x)) for x in places[one]),
        )
        for one in range(number)
    ]
