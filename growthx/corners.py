"""The corners of cells: whether a cell is convex, so that its map from the reference cell can be inverted."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from growthx import compat
from growthx.errors import raise_on_all
from growthx.sampling import reference_corners

if TYPE_CHECKING:
    from growthx.arrays import Floats, Marks
    from growthx.mesh import Mesh

FLAT = 1e-9  # sine of a corner, below which it counts as flat


def corner_sines(shape: str, corners: Floats) -> Floats:
    """Determinant of the unit edge vectors at each corner, (cells, corners), of one sign in a convex cell.

    corners: in DOLFINx's order, (cells, corners, dim).
    """
    count, dim = corners.shape[1:]
    tensor = shape in ("quadrilateral", "hexahedron")
    sines = []
    for corner in range(count if tensor else 1):
        # In DOLFINx's order the bits of a corner's number are its reference coordinates.
        ends = [corner ^ (1 << axis) for axis in range(dim)] if tensor else list(range(1, dim + 1))
        with np.errstate(all="ignore"):  # a node may be nowhere: what comes of it is not a number
            edges = corners[:, ends] - corners[:, [corner]]
            lengths = np.linalg.norm(edges, axis=2, keepdims=True)
            unit = np.divide(edges, lengths, out=np.zeros_like(edges), where=lengths > 0.0)
            sines.append((-1) ** corner.bit_count() * np.linalg.det(unit))
    return np.stack(sines, axis=1)


def not_convex(sines: Floats, turns: Floats) -> Marks:
    """Which cells have a corner that is flat or turns the other way; turns: the right way of each cell, 1 or −1."""
    return np.asarray(~((sines * turns[:, np.newaxis]).min(axis=1, initial=np.inf) > FLAT))


def complaint(count: int, cells: int, first: Floats, of: object) -> str:
    """What to say of so many cells that are not convex; first: corners of one of them, (corners, dim)."""
    centre = ", ".join(f"{x:.6g}" for x in first.mean(axis=0))
    return (
        f"{count} of the {cells} cells of {of} are inverted or have a corner of 180 degrees or more, "
        f"the first at ({centre}): convex cells would be right"
    )


def check_cells(mesh: Mesh) -> None:
    """Raise InputError, on all ranks, if a cell has no volume, is folded or has no finite corners (collective).

    Simplices may be numbered in either sense: of two that overlap, nothing is seen here.
    """
    nodes = compat.geometry_nodes(mesh.domain)[: len(mesh.owned_cells)]
    corners = mesh.domain.geometry.x[nodes[:, : len(reference_corners(mesh.cell_name))], : mesh.dim]
    sines = corner_sines(mesh.cell_name, corners)
    bad = np.flatnonzero(not_convex(sines, np.sign(sines.sum(axis=1))))
    count = mesh.domain.comm.allreduce(len(bad))
    problem = complaint(count, mesh.cell_count, corners[bad[0]], "the mesh") if len(bad) else ""
    raise_on_all(mesh.domain.comm, problem)
