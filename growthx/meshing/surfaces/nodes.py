"""Nodes by name and places on the body, each found once over all ranks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from growthx.common.checks import is_function
from growthx.common.errors import InputError, raise_on_all, shown
from growthx.common.words import place_in_words, quoted_names
from growthx.fem import compat
from growthx.meshing.closest import nearest
from growthx.meshing.surfaces.sides import corner_nodes, numbers_of_file

if TYPE_CHECKING:
    from mpi4py import MPI

    from growthx.common.arrays import Floats, Indices, Marks
    from growthx.meshing.mesh import Mesh

ON_THE_BODY = 1e-9  # of the body's size: what is no farther away is on it, and what is as near to a corner is at it


@dataclass(frozen=True)
class Spots:
    """Places on the body, each on one rank.

    rows: which of the places this rank has, (spots,); cells: its cells that they are in, (spots,); X: where in the
    reference cell, (spots, dim).  distances: of all places from the body, (places,), the same on all ranks.
    """

    rows: Indices
    cells: Indices
    X: Floats
    distances: Floats


def spots(mesh: Mesh, places: Floats) -> Spots:
    """The points of a body nearest to places, (places, dim), the same on all ranks (collective)."""
    comm, here = mesh.comm, len(mesh.owned_cells) > 0
    cells: Indices = np.zeros(len(places), dtype=np.int32)
    X: Floats = np.zeros((len(places), mesh.dim))
    distances: Floats = np.full(len(places), np.inf)
    if here and len(places):
        cells, X, distances, _ = nearest(mesh, places)
    distances[distances <= ON_THE_BODY * size_of(mesh)] = 0.0
    of_ranks = np.array(comm.allgather(distances)).reshape(comm.size, len(places))
    rows = np.flatnonzero(of_ranks.argmin(axis=0) == comm.rank)  # of several that have it, the first
    X = X[rows]
    near = np.abs(X - np.round(X)) <= ON_THE_BODY
    X[near] = np.round(X[near])  # a corner is one to the last digit
    return Spots(rows, np.asarray(cells[rows]), X, of_ranks.min(axis=0, initial=np.inf))


def size_of(mesh: Mesh) -> float:
    """The longest side of the box about the body, the same on all ranks (collective)."""
    x = mesh.domain.geometry.x
    ends = [(x.min(axis=0), x.max(axis=0))] if len(x) else []
    every = [end for rank in mesh.comm.allgather(ends) for end in rank]
    low, high = np.min([end[0] for end in every], axis=0), np.max([end[1] for end in every], axis=0)
    return float((high - low).max())


def nearest_node(mesh: Mesh, place: Any) -> tuple[float, ...]:
    """Where the node nearest to a place is, (dim,) (collective)."""
    x = mesh.domain.geometry.x[:, : mesh.dim]
    apart = np.linalg.norm(x - np.asarray(place), axis=1)
    own = [(float(apart.min()), tuple(x[apart.argmin()].tolist()))] if len(x) else []
    found: tuple[float, ...] = min(one for rank in mesh.comm.allgather(own) for one in rank)[1]
    return found


def node_places(mesh: Mesh, nodes: Any, what: str) -> Floats:
    """Where some nodes are, each once, (nodes, dim), the same on all ranks (collective).

    nodes: the name of a set of nodes of the mesh's file, or of a boundary, of which it means the corners of its sides;
        a function of position, (3, nodes) to booleans; or numbers in the order of the file, whose order is kept
    what: whose nodes they are, for sentences

    InputError, on all ranks, for what means no nodes.
    """
    if isinstance(nodes, str):
        return _of_name(mesh, nodes, what)
    if is_function(nodes):
        return _of_function(mesh, nodes, what)
    wanted = numbers_of_file(nodes, mesh.origin.node_count, f"the nodes {what}", mesh.comm)
    numbers, places = _gathered(mesh, np.isin(mesh.origin.nodes, wanted))
    missing = np.setdiff1d(wanted, numbers)
    if len(missing):
        raise InputError(
            f"the nodes {what} have {missing[0]} among them, which is of no cell: nodes of cells are right"
        )
    return places[np.searchsorted(numbers, np.asarray(nodes))]


def _of_name(mesh: Mesh, name: str, what: str) -> Floats:
    if name in mesh.origin.node_sets:
        return _gathered(mesh, np.isin(mesh.origin.nodes, mesh.origin.node_sets[name]))[1]
    if name not in mesh.boundaries:
        sets, sides = quoted_names(sorted(mesh.origin.node_sets)), quoted_names(sorted(mesh.boundaries))
        raise InputError(
            f"the mesh has no nodes named '{name}' {what}; its sets of nodes are {sets}, its boundaries {sides}"
        )
    marks = np.zeros(len(mesh.domain.geometry.x), dtype=bool)
    marks[corner_nodes(mesh.domain, mesh.boundary(name)).ravel()] = True
    return _gathered(mesh, marks)[1]


def _of_function(mesh: Mesh, nodes: Any, what: str) -> Floats:
    x, problem = mesh.domain.geometry.x.T, ""
    marks = np.zeros(x.shape[1], dtype=bool)
    try:
        found = np.asarray(nodes(x))
        if found.dtype != bool or found.shape not in ((), (x.shape[1],)):
            problem = f"gives an array of {found.dtype} of shape {found.shape} for {x.shape[1]} nodes"
        else:
            marks |= found
    except Exception as error:  # on one rank, perhaps: as it is, it would leave the others waiting
        problem = f"fails, {shown(error)}"
    raise_on_all(mesh.comm, problem and f"the function of the nodes {what} {problem}: True or False for each is right")
    places = _gathered(mesh, marks)[1]
    if not len(places):
        raise InputError(f"the function of the nodes {what} marks none: one that marks a node would be right")
    return places


def _gathered(mesh: Mesh, marks: Marks) -> tuple[Indices, Floats]:
    """Numbers, rising, and places of all marked nodes of all ranks, each once (collective)."""
    comm: MPI.Intracomm = mesh.comm
    used = np.zeros(len(marks), dtype=bool)
    used[compat.geometry_nodes(mesh.domain).ravel()] = True
    here = np.flatnonzero(marks & used)
    keys = mesh.domain.geometry.index_map().local_to_global(here.astype(np.int32))
    numbers = np.concatenate(comm.allgather(np.column_stack([mesh.origin.nodes[here], keys])))
    places = np.concatenate(comm.allgather(mesh.domain.geometry.x[here][:, : mesh.dim]))
    if not len(numbers):
        return np.empty(0, dtype=np.int64), np.empty((0, mesh.dim))
    kept, first = np.unique(numbers, axis=0, return_index=True)
    return kept[:, 0], places[first]


def check_on_body(mesh: Mesh, places: Floats, what: str, within: float = 0.0) -> Spots:
    """The spots of places that must be on the body, or no farther than `within` from it (collective).

    InputError, on all ranks, for one that is not: it names the nearest node.
    """
    found = spots(mesh, places)
    if len(places) and found.distances.max() > within:
        worst = int(found.distances.argmax())
        place, node = place_in_words(places[worst]), place_in_words(nearest_node(mesh, places[worst]))
        where = "" if what.endswith(f"at {place}") else f", at {place},"
        raise InputError(
            f"{what}{where} is {found.distances[worst]:.3g} away from the body: a place on it would be right, such "
            f"as the nearest node, {node}"
        )
    return found
