"""Means of the density over zones, of what grows there: polygons in the plane, convex bodies in space."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from growthx.common.checks import require_kind, require_name
from growthx.common.errors import InputError, raise_on_all, shown
from growthx.discretisation.checks import arguments
from growthx.meshing.sampling import as_rows, nodes_of_cells, positions, reference_corners, volume_ratios

if TYPE_CHECKING:
    from collections.abc import Iterator

    from growthx.common.arrays import Floats, Marks
    from growthx.discretisation.discretisation import Discretisation
    from growthx.meshing.mesh import Mesh
    from growthx.stepping.record import Result

    Inside = Callable[[Floats], Marks]

SAMPLES = 24  # per direction of a cell: zone means to 0.2 % on the femur's mesh of 3.5 mm, also in the thin cortices
SAMPLES_IN_SPACE = 4  # … where there are many cells in a zone
KINDS = {2: "polygon", 3: "body"}  # of zones, by the dimension of the mesh


def area_means(
    problem: Discretisation | Result,
    zones: Mapping[str, Floats],
    regions: str | tuple[str, ...] | None = None,
    values: Floats | None = None,
) -> dict[str, float]:
    """Mean of ρ over what grows inside each zone, by name; the same on all ranks.

    zones: corners by name: in the plane of a polygon, shape (corners, 2), with means over area; in space of a convex
    body, (corners, 3), in any order, with means over volume.
    problem: a result, or its problem.
    regions: names of those that count instead, whether they grow or not.
    values: of another field, one for each owned cell, (cells,), as those of `cell_fields`.
    Each cell is sampled at 24 × 24 points, in space at 4 × 4 × 4.  Raises InputError for a zone that lies outside the
    mesh, is none, or in which nothing counts, and for a region that the mesh does not have.

    Example:
        >>> problem = gx.discretise(gx.scenes.plate(2), gx.Q1P0)
        >>> means = gx.zones.area_means(problem, {"left": [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]})
        >>> {name: f"{mean:.3f}" for name, mean in means.items()}
        {'left': '1.000'}
    """
    problem = arguments.require_problem(problem)
    mesh = problem.scene.mesh
    field = problem.density_at(_sample_points(mesh.cell_name)) if values is None else _of_cells(values, mesh)
    counts = np.isin(mesh.owned_cells, problem.cells_of(regions))
    means = {}
    for name, (total, size) in _integrals(mesh, zones, field, counts):
        if size == 0.0:
            raise InputError(f"the zone '{name}' {_has_nothing(regions, KINDS[mesh.dim])}")
        means[name] = total / size
    return means


def _of_cells(values: Floats, mesh: Mesh) -> Floats:
    """Values of the owned cells, as a column; InputError, on all ranks, for what are none."""
    found: Floats = np.empty(0)
    trouble = ""
    try:
        found = np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        trouble = f"the values of cells are {shown(values)}"
    if not trouble and found.shape != mesh.owned_cells.shape:
        trouble = f"the values of cells are of shape {found.shape}"
    right = f"one number for each of the {len(mesh.owned_cells)} cells of the rank would be right"
    raise_on_all(mesh.comm, trouble and f"{trouble}: {right}")
    return found[:, np.newaxis]


def require_overlap(mesh: Mesh, zones: Mapping[str, Floats]) -> None:
    """Refuse zones, as in `area_means`, that lie outside a mesh (collective).

    Example:
        >>> import numpy as np
        >>> square = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
        >>> gx.zones.require_overlap(gx.scenes.plate(2).mesh, {"square": square})
    """
    ones = np.ones((len(mesh.owned_cells), len(_sample_points(mesh.cell_name))))
    for _ in _integrals(mesh, zones, ones, np.ones(len(ones), dtype=bool)):
        pass


def contains(name: str, zone: Floats, places: Floats) -> Marks:
    """Which places, (…, dim), a zone as in `area_means` holds, shape (…); InputError for what is none.

    Example:
        >>> import numpy as np
        >>> square = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
        >>> gx.zones.contains("square", square, np.array([(0.5, 0.5), (1.5, 0.5)])).tolist()
        [True, False]
    """
    _, _, inside = _zone(name, zone, places.shape[-1])
    return np.asarray(inside(places.reshape(-1, places.shape[-1])).reshape(places.shape[:-1]))


def _integrals(
    mesh: Mesh, zones: Mapping[str, Floats], values: Floats, counts: Marks
) -> Iterator[tuple[str, tuple[float, float]]]:
    """By zone, the integral of values at the sample points over what counts of its part of the mesh, and its size.

    values: (cells, points) or (cells, 1).  counts: which of the owned cells do, (cells,).
    """
    X = _sample_points(mesh.cell_name)
    nodes = nodes_of_cells(mesh)[:, :, : mesh.dim]
    low, high = nodes.min(axis=1), nodes.max(axis=1)
    for name, corners, inside in [_zone(name, zone, mesh.dim) for name, zone in _by_name(zones).items()]:
        near = np.flatnonzero(np.all((low <= corners.max(axis=0)) & (high >= corners.min(axis=0)), axis=1))
        sizes = volume_ratios(mesh, X, near)
        there = inside(positions(mesh, X, near)[:, :, : mesh.dim].reshape(-1, mesh.dim)).reshape(sizes.shape)
        counting = there & counts[near, np.newaxis]
        here = [np.sum(part, where=where) for part, where in ((sizes, there), (sizes, counting))]
        here.append(np.sum(sizes * values[near], where=counting))
        whole, size, total = mesh.comm.allreduce(np.array(here))
        if whole == 0.0:
            kind = KINDS[mesh.dim]
            raise InputError(f"the zone '{name}' lies outside the mesh: a {kind} that overlaps it would be right")
        yield name, (float(total), float(size))


def _by_name(zones: Mapping[str, Floats]) -> Mapping[str, Floats]:
    require_kind(zones, Mapping, "what holds the zones", "a mapping from names to polygons")
    return zones


def _zone(name: str, zone: Floats, dim: int) -> tuple[str, Floats, Inside]:
    """A zone's name, its corners, (corners, dim), and what tells whether places, (places, dim), are in it."""
    require_name(name, "the name of a zone")
    corners, trouble = as_rows(zone, dim, "corners")
    if not trouble and len(corners) <= dim:
        trouble = f"are {len(corners)}: {'three' if dim == 2 else 'four'} or more would be right"
    if trouble:
        raise InputError(f"the corners of the zone '{name}' {trouble}")
    return name, corners, _in_polygon(corners) if dim == 2 else _in_body(name, corners)


def _in_polygon(corners: Floats) -> Inside:
    from matplotlib.path import Path

    return Path(corners).contains_points


def _in_body(name: str, corners: Floats) -> Inside:
    """Inside the convex hull of corners, (corners, 3)."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        sides = ConvexHull(corners).equations
    except QhullError as error:
        raise InputError(
            f"the corners of the zone '{name}' lie in a plane: those of a body, with a volume, would be right"
        ) from error
    return lambda places: np.all(places @ sides[:, :3].T + sides[:, 3] <= 0, axis=1)


def _has_nothing(regions: str | tuple[str, ...] | None, kind: str) -> str:
    """What is wrong with a zone in the body in which nothing counts, and what would be right."""
    if regions is None:
        return f"holds nothing that grows: a {kind} that overlaps what does, or regions to average over, would be right"
    names = ", ".join(f"'{name}'" for name in ([regions] if isinstance(regions, str) else regions))
    return f"holds nothing of {names}: a {kind} that overlaps it, or other regions, would be right"


def _sample_points(cell_name: str) -> Floats:
    """Midpoints of equal parts of the reference cell, shape (points, dim)."""
    if cell_name in ("quadrilateral", "hexahedron"):
        k, dim = (SAMPLES, 2) if cell_name == "quadrilateral" else (SAMPLES_IN_SPACE, 3)
        ticks = (np.arange(k) + 0.5) / k
        return np.stack(np.meshgrid(*dim * [ticks], indexing="ij"), axis=-1).reshape(-1, dim)
    if cell_name == "tetrahedron":
        halves = round(np.log2(SAMPLES_IN_SPACE))
        return _halved(reference_corners(cell_name)[np.newaxis], halves).mean(axis=1)
    k = SAMPLES
    lower = np.stack(np.meshgrid(np.arange(k), np.arange(k), indexing="ij"), axis=-1).reshape(-1, 2)
    upright = (lower[lower.sum(axis=1) < k] + 1 / 3) / k
    inverted = (lower[lower.sum(axis=1) < k - 1] + 2 / 3) / k
    return np.concatenate([upright, inverted])


# A tetrahedron in eight of equal volume, by its corners 0 … 3 and the middles of its edges 01, 02, 03, 12, 13 and 23.
EDGES = ((0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3))
EIGHTHS = (
    *((0, 4, 5, 6), (4, 1, 7, 8), (5, 7, 2, 9), (6, 8, 9, 3)),
    *((4, 9, 5, 6), (4, 9, 6, 8), (4, 9, 8, 7), (4, 9, 7, 5)),
)


def _halved(tetrahedra: Floats, times: int) -> Floats:
    """The corners of equal parts of tetrahedra, whose edges are halved so many times; shape (parts, 4, 3)."""
    for _ in range(times):
        places = np.concatenate([tetrahedra, tetrahedra[:, EDGES].mean(axis=2)], axis=1)
        tetrahedra = places[:, EIGHTHS].reshape(-1, 4, 3)
    return tetrahedra
