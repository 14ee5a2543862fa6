"""Whether supports hold a body against the motions of a rigid body, at rest; what is left free is found and named.

A part of the body, its cells joined side by side, can move as u = t + ω × (x − c).  Each held direction of a node is an
equation for t and ω, and so is each direction of a node that two parts share; what solves them all moves freely.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import basix
import dolfinx
import numpy as np
from mpi4py import MPI
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from growthx.common.errors import InputError
from growthx.common.words import place_in_words
from growthx.fem import compat
from growthx.meshing.corners import facet_vectors
from growthx.model.actions.rigid import RigidFace
from growthx.model.open_loads import OpenLoad
from growthx.model.supports import PointSupport

if TYPE_CHECKING:
    from collections.abc import Iterator

    from growthx.common.arrays import Floats, Indices
    from growthx.meshing.mesh import Mesh
    from growthx.model.actions.faces import Rotation
    from growthx.model.scene import Scene
    from growthx.model.supports import Support

FREE = 1e-12  # of the largest eigenvalue of the equations' Gram matrix, below which a motion is free
MANY = 50  # parts that hang together by nodes, above which nobody looks at how they turn about them
AXES = "xyz"


@dataclass(frozen=True)
class _Pieces:
    """How a body hangs together, the same on all ranks but for `of_cells`.

    of_cells: part of each local cell, of those joined side by side.  groups: of each part, that of the parts joined at
    nodes.  hinges: pairs of parts that share a node, (hinges, 2), where each is, (hinges, 3).
    """

    of_cells: Indices
    groups: Indices
    hinges: Indices
    places: Floats


def check_held(scene: Scene) -> None:
    """Raise InputError, on all ranks, if a part of the body is free to move in a load case (collective).

    Inertia resists every motion, and loads that depend on the displacement may do so where they act.
    """
    if scene.inertia is not None or any(load.may_hold and load.on is None for load in scene.open_loads):
        return
    pieces = _pieces(scene.mesh)
    springs = {
        frozenset((load.on, load.holds) for load in case.loads if isinstance(load, OpenLoad) and load.holds and load.on)
        for case in scene.load_cases
    }
    for boundaries in sorted(springs, key=str):
        rows = [*_held_rows(scene, pieces), *_spring_rows(scene.mesh, pieces, boundaries)]
        problem = _free_motion(scene, pieces, rows)
        if problem := scene.mesh.comm.bcast(problem):
            raise InputError(problem)


# -- how the body hangs together ---------------------------------------------------------------------------------------


def _pieces(mesh: Mesh) -> _Pieces:
    topology, comm = mesh.domain.topology, mesh.comm
    topology.create_connectivity(mesh.dim, mesh.dim - 1)
    per_cell = len(basix.topology(basix.CellType[mesh.cell_name])[mesh.dim - 1])
    sides = topology.connectivity(mesh.dim, mesh.dim - 1).array.reshape(-1, per_cell)
    of_cells, count = _joined(comm, sides, topology.index_map(mesh.dim - 1))
    if count == 1:
        return _Pieces(of_cells, np.zeros(1, dtype=int), np.empty((0, 2), dtype=int), np.empty((0, 3)))
    nodes = compat.geometry_nodes(mesh.domain)[: len(mesh.owned_cells)]
    numbers = mesh.domain.geometry.index_map().local_to_global(nodes.ravel().astype(np.int32))
    here = np.column_stack([numbers, np.repeat(of_cells[: len(nodes)], nodes.shape[1])])
    known, first = np.unique(here, axis=0, return_index=True)
    known, first_known = np.unique(np.concatenate(comm.allgather(known)), axis=0, return_index=True)
    places = np.concatenate(comm.allgather(mesh.domain.geometry.x[nodes.ravel()[first]]))[first_known]
    shared = np.flatnonzero(known[:-1, 0] == known[1:, 0])  # rows are sorted by node
    hinges = np.column_stack([known[shared, 1], known[shared + 1, 1]])
    joints = coo_array((np.ones(len(hinges)), hinges.T), shape=(count, count))
    return _Pieces(of_cells, connected_components(joints, directed=False)[1], hinges, places[shared])


def _joined(comm: MPI.Intracomm, entities: Indices, index_map: dolfinx.common.IndexMap) -> tuple[Indices, int]:
    """Number the sets of cells that are joined by common entities, over all ranks; their number.

    entities: local ones of each local cell, (cells, entities of a cell), with their index map.
    """
    cells, per_cell = entities.shape
    total = index_map.size_local + index_map.num_ghosts
    edges = np.repeat(np.arange(cells), per_cell), cells + entities.ravel()
    graph = coo_array((np.ones(entities.size), edges), shape=(cells + total, cells + total))
    count, labels = connected_components(graph, directed=False)
    if comm.size == 1:
        return labels[:cells], count
    first = comm.exscan(count) or 0
    # What another rank owns has another number there: the two are one.
    owners = dolfinx.la.vector(index_map, 1)
    owners.array[:] = first + labels[cells:]
    owners.scatter_forward()
    here, there = first + labels[cells + index_map.size_local :], owners.array[index_map.size_local :].astype(int)
    same = np.unique(np.column_stack([here, there]), axis=0)
    pairs, size = np.concatenate(comm.allgather(same)), comm.allreduce(count)
    whole = coo_array((np.ones(len(pairs)), pairs.T), shape=(size, size))
    number, merged = connected_components(whole, directed=False)
    return merged[first + labels[:cells]], number


# -- equations: rows (part, direction, place) --------------------------------------------------------------------------


@dataclass(frozen=True)
class _Spin:
    """In place of the direction of a displacement: the rotation about an axis, (3,)."""

    axis: Floats


Row = tuple["Indices", "int | Floats | _Spin", "Floats"]  # or, for a direction, one of each node, (nodes, dim)


def _held_rows(scene: Scene, pieces: _Pieces) -> Iterator[Row]:
    for support in scene.supports:
        parts, places = _support_nodes(support, scene.mesh, pieces)
        if isinstance(support, RigidFace):
            yield from _rigid_rows(support, scene.mesh, parts)
            continue
        for direction, _ in support.components(scene.mesh.dim):
            yield parts, direction, places


def _rigid_rows(face: RigidFace, mesh: Mesh, parts: Indices) -> Iterator[Row]:
    """Its centre stays along some directions, and it does not turn about others; so do all parts it belongs to."""
    here = np.unique(parts)
    places = np.tile(np.append(face.centre(mesh), [0.0] * (3 - mesh.dim)), (len(here), 1))
    for direction in face.held:
        yield here, direction, places
    free = [axis if mesh.dim == 3 else np.array([0.0, 0.0, axis[0]]) for axis in face.axes(mesh.dim)]
    stays = np.eye(3) - sum((np.outer(axis, axis) for axis in free), np.zeros((3, 3)))
    for axis in stays if mesh.dim == 3 else stays[2:]:
        if np.linalg.norm(axis) > FREE:
            yield here, _Spin(axis), places


def _spring_rows(mesh: Mesh, pieces: _Pieces, springs: frozenset[tuple[str, tuple[int, ...] | str]]) -> Iterator[Row]:
    for name, holds in sorted(springs, key=str):
        facets = mesh.boundary(name)
        parts, places = _nodes(mesh, pieces, mesh.dim - 1, facets)
        if holds == "normal":
            yield parts, _normals(mesh, facets), places
        else:
            for direction in range(mesh.dim) if holds == "all" else holds:
                yield parts, int(direction), places


def _normals(mesh: Mesh, facets: Indices) -> Floats:
    """The unit normal of the facet of each of its nodes, in the order of `_nodes`, (nodes, dim)."""
    if not len(facets):
        return np.empty((0, mesh.dim))
    nodes = dolfinx.mesh.entities_to_geometry(mesh.domain, mesh.dim - 1, np.asarray(facets, dtype=np.int32))
    vectors = facet_vectors(mesh.domain.geometry.x[nodes][:, :, : mesh.dim])
    return np.repeat(vectors / np.linalg.norm(vectors, axis=1, keepdims=True), nodes.shape[1], axis=0)


def _support_nodes(
    support: Support | PointSupport | Rotation | RigidFace, mesh: Mesh, pieces: _Pieces
) -> tuple[Indices, Floats]:
    if isinstance(support, PointSupport):
        return _nodes(mesh, pieces, 0, mesh.corner(support.at))
    return _nodes(mesh, pieces, mesh.dim - 1, mesh.boundary(support.on))


def _nodes(mesh: Mesh, pieces: _Pieces, dim: int, entities: Indices) -> tuple[Indices, Floats]:
    """The nodes of some local entities: part and place of each, (nodes,) and (nodes, 3)."""
    topology = mesh.domain.topology
    topology.create_connectivity(dim, mesh.dim)
    topology.create_connectivity(mesh.dim, dim)
    if not len(entities):
        return np.empty(0, dtype=int), np.empty((0, 3))
    around = topology.connectivity(dim, mesh.dim)
    cells = around.array[around.offsets[entities]]
    nodes = dolfinx.mesh.entities_to_geometry(mesh.domain, dim, np.asarray(entities, dtype=np.int32))
    return np.repeat(pieces.of_cells[cells], nodes.shape[1]), mesh.domain.geometry.x[nodes.ravel()]


# -- what solves them --------------------------------------------------------------------------------------------------


def _free_motion(scene: Scene, pieces: _Pieces, rows: list[Row]) -> str:
    """What is wrong, as a sentence; empty if everything is held."""
    mesh = scene.mesh
    low, high, cells = _extents(mesh, pieces)
    centres, sizes = (low + high) / 2, np.maximum((high - low).max(axis=1), np.finfo(float).tiny)

    def motions(parts: Indices, direction: int | Floats | _Spin, places: Floats) -> Floats:
        if isinstance(direction, _Spin):
            turns = direction.axis[2:] if mesh.dim == 2 else direction.axis
            return np.tile(np.append(np.zeros(mesh.dim), turns), (len(places), 1))
        group = pieces.groups[parts]
        y = (places - centres[group]) / sizes[group, np.newaxis]
        if isinstance(direction, int):
            return _displacements(y, direction, mesh.dim)
        along = (direction[:, [i]] * _displacements(y, i, mesh.dim) for i in range(mesh.dim))
        return np.asarray(sum(along, np.zeros((len(y), 1))))

    count, width = len(pieces.groups), 3 if mesh.dim == 2 else 6
    grams = np.zeros((count, width, width))
    for parts, direction, places in rows:
        of_rows = motions(parts, direction, places)
        np.add.at(grams, parts, of_rows[:, :, np.newaxis] * of_rows[:, np.newaxis, :])
    grams = mesh.comm.allreduce(grams)
    whole = np.zeros((len(cells), width, width))
    np.add.at(whole, pieces.groups, grams)
    free = {group: how for group in range(len(cells)) if (how := _named(_null(whole[group]), whole[group], mesh.dim))}
    if free:
        return _sentence(scene, free, centres, cells)
    for group in range(len(cells)):
        members = np.flatnonzero(pieces.groups == group)
        if 1 < len(members) <= MANY:
            here = np.flatnonzero(pieces.groups[pieces.hinges[:, 0]] == group)
            gram = _jointed(
                grams[members],
                np.searchsorted(members, pieces.hinges[here]),
                [motions(pieces.hinges[here, 0], direction, pieces.places[here]) for direction in range(mesh.dim)],
            )
            if _null(gram).size:
                return (
                    f"the body of the scene '{scene.name}' has parts that are joined at single nodes, as at "
                    f"{_text(pieces.places[here[0]], mesh.dim)}, and free to turn there: parts joined along sides of "
                    "cells, or held by supports, would be right"
                )
    return ""


def _extents(mesh: Mesh, pieces: _Pieces) -> tuple[Floats, Floats, Indices]:
    """Corners of the box around each group of parts, (groups, 3) twice, and number of its cells."""
    comm, count = mesh.comm, int(pieces.groups.max()) + 1
    nodes, x = compat.geometry_nodes(mesh.domain), mesh.domain.geometry.x
    of_nodes = np.empty(len(x), dtype=np.int64)
    of_nodes[nodes.ravel()] = np.repeat(pieces.groups[pieces.of_cells], nodes.shape[1])
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    here, first = np.unique(np.sort(of_nodes), return_index=True)
    if len(here):
        by_group = x[np.argsort(of_nodes, kind="stable")]
        low[here], high[here] = np.minimum.reduceat(by_group, first), np.maximum.reduceat(by_group, first)
    comm.Allreduce(MPI.IN_PLACE, low, MPI.MIN)
    comm.Allreduce(MPI.IN_PLACE, high, MPI.MAX)
    owned = pieces.groups[pieces.of_cells[: len(mesh.owned_cells)]]
    return low, high, comm.allreduce(np.bincount(owned, minlength=count))


def _displacements(y: Floats, direction: int, dim: int) -> Floats:
    """Displacement along a direction at places y of each unit motion, translations first, shape (places, motions)."""
    moved = np.zeros((len(y), 3 if dim == 2 else 6))
    moved[:, direction] = 1.0
    turns = [2] if dim == 2 else [0, 1, 2]
    for column, axis in enumerate(turns, start=dim):
        moved[:, column] = np.cross(np.eye(3)[axis], y)[:, direction]
    return moved


def _jointed(grams: Floats, hinges: Indices, motions: list[Floats]) -> Floats:
    """Gram matrix of the equations of several parts, (parts × motions) squared, with those of what they share."""
    parts, width = grams.shape[:2]
    whole = np.zeros((parts, width, parts, width))
    whole[np.arange(parts), :, np.arange(parts)] = grams
    for of_direction in motions:
        for (one, other), row in zip(hinges, of_direction, strict=True):
            square = np.outer(row, row)
            for a, b, sign in ((one, one, 1), (other, other, 1), (one, other, -1), (other, one, -1)):
                whole[a, :, b] += sign * square
    return whole.reshape(parts * width, parts * width)


def _null(gram: Floats) -> Floats:
    """The motions that no equation sees, shape (motions, free ones)."""
    values, vectors = np.linalg.eigh(gram)
    return np.asarray(vectors[:, values <= FREE * values[-1]])


def _named(free: Floats, gram: Floats, dim: int) -> str:
    """Free motions in words; empty if there are none."""
    if not free.size:
        return ""
    moves = [AXES[i] for i in range(dim) if gram[i, i] == 0]
    count = free.shape[1] - len(moves)  # of directions about which it turns
    turns = _axes(np.linalg.svd(free[dim:])[0][:, :count], dim) if count else []
    words = [f"move along {_listed(moves)}"] if moves else []
    return " and to ".join(words + ([f"rotate about {_listed(turns)}"] if turns else []))


def _axes(directions: Floats, dim: int) -> list[str]:
    """Names of the axes in the space of some orthonormal directions; of a direction that is no axis, its entries."""
    if dim == 2:
        return ["z"]
    inside = [AXES[i] for i in range(3) if np.linalg.norm(directions[i]) > 1 - 1e-6]
    if len(inside) == directions.shape[1]:
        return inside
    return [f"the direction {_text(along, 3)}" for along in directions.T]


def _sentence(scene: Scene, free: dict[int, str], centres: Floats, cells: Indices) -> str:
    group, how = next(iter(free.items()))
    right = "supports that hold it against every motion of a rigid body would be right"
    if len(cells) == 1:
        return f"the body of the scene '{scene.name}' is free to {how}: {right}"
    others = len(free) - 1
    more = f" (and {others} more)" if others else ""
    return (
        f"the body of the scene '{scene.name}' falls into {len(cells)} parts that share no node, and that of "
        f"{cells[group]} cells about {_text(centres[group], scene.mesh.dim)} is free to {how}{more}: {right}"
    )


def _listed(names: list[str]) -> str:
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def _text(place: Floats, dim: int) -> str:
    return place_in_words(np.where(np.abs(place) < 1e-12, 0.0, place)[:dim], 4)
