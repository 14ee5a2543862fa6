"""Area means of the density over polygons, of what grows there, such as the anatomical zones of the femur."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from growthx.common.checks import require_kind, require_name
from growthx.common.errors import InputError, raise_on_all, shown
from growthx.discretisation.checks import arguments
from growthx.meshing.sampling import as_rows, positions, volume_ratios

if TYPE_CHECKING:
    from collections.abc import Iterator

    from growthx.common.arrays import Floats, Marks
    from growthx.discretisation.discretisation import Discretisation
    from growthx.meshing.mesh import Mesh

SAMPLES = 24  # per direction of a cell: zone means to 0.2 % on the femur's mesh of 3.5 mm, also in the thin cortices


def area_means(
    problem: Discretisation,
    polygons: Mapping[str, Floats],
    regions: str | tuple[str, ...] | None = None,
    values: Floats | None = None,
) -> dict[str, float]:
    """Mean of ρ over what grows inside each polygon, shape (corners, 2), by name; the same on all ranks.

    regions: names of those that count instead, whether they grow or not.
    values: of another field, one for each owned cell, (cells,), as those of `cell_fields`.
    Each cell is sampled at 24 × 24 points.  Raises InputError for a polygon that lies outside the mesh, is none, or in
    which nothing counts, and for a region that the mesh does not have.
    """
    arguments.require_problem(problem)
    mesh = problem.scene.mesh
    field = problem.density_at(_sample_points(mesh.cell_name)) if values is None else _of_cells(values, mesh)
    counts = np.isin(mesh.owned_cells, problem.cells_of(regions))[:, np.newaxis]
    means = {}
    for name, (total, area) in _integrals(mesh, polygons, field, counts):
        if area == 0.0:
            raise InputError(f"the zone '{name}' {_has_nothing(regions)}")
        means[name] = total / area
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


def require_overlap(mesh: Mesh, polygons: Mapping[str, Floats]) -> None:
    """Refuse polygons, as in `area_means`, that lie outside a mesh (collective)."""
    for _ in _integrals(mesh, polygons, 1.0, True):
        pass


def contains(name: str, polygon: Floats, places: Floats) -> Marks:
    """Which places, (…, 2), a zone holds, shape (…); InputError for what is no polygon, shape (corners, 2)."""
    from matplotlib.path import Path

    inside = Path(_corners(name, polygon)).contains_points(places.reshape(-1, 2))
    return np.asarray(inside.reshape(places.shape[:-1]))


def _integrals(
    mesh: Mesh, polygons: Mapping[str, Floats], values: Floats | float, counts: Marks | bool
) -> Iterator[tuple[str, tuple[float, float]]]:
    """By polygon, the integral of values at the sample points over what counts of its part of the mesh, and its area.

    counts: which of the owned cells do, (cells, 1), or all.
    """
    from matplotlib.path import Path

    X = _sample_points(mesh.cell_name)
    places = positions(mesh, X)[:, :, :2]
    areas = volume_ratios(mesh, X)
    polygons = {name: _corners(name, polygon) for name, polygon in _by_name(polygons).items()}
    for name, polygon in polygons.items():
        inside = Path(polygon).contains_points(places.reshape(-1, 2)).reshape(areas.shape)
        counting = inside & counts
        here = [np.sum(areas, where=inside), np.sum(areas, where=counting), np.sum(areas * values, where=counting)]
        whole, area, total = mesh.comm.allreduce(np.array(here))
        if whole == 0.0:
            raise InputError(f"the zone '{name}' lies outside the mesh: a polygon that overlaps it would be right")
        yield name, (float(total), float(area))


def _by_name(polygons: Mapping[str, Floats]) -> Mapping[str, Floats]:
    require_kind(polygons, Mapping, "what holds the zones", "a mapping from names to polygons")
    return polygons


def _corners(name: str, polygon: Floats) -> Floats:
    """The corners of a polygon, shape (corners, 2)."""
    require_name(name, "the name of a zone")
    corners, trouble = as_rows(polygon, 2, "corners")
    if not trouble and len(corners) < 3:
        trouble = f"are {len(corners)}: three or more would be right"
    if trouble:
        raise InputError(f"the corners of the zone '{name}' {trouble}")
    return corners


def _has_nothing(regions: str | tuple[str, ...] | None) -> str:
    """What is wrong with a zone in the body in which nothing counts, and what would be right."""
    if regions is None:
        return "holds nothing that grows: a polygon that overlaps what does, or regions to average over, would be right"
    names = ", ".join(f"'{name}'" for name in ([regions] if isinstance(regions, str) else regions))
    return f"holds nothing of {names}: a polygon that overlaps it, or other regions, would be right"


def _sample_points(cell_name: str) -> Floats:
    """Midpoints of equal parts of the reference cell, shape (points, 2)."""
    k = SAMPLES
    ticks = (np.arange(k) + 0.5) / k
    X = np.stack(np.meshgrid(ticks, ticks, indexing="ij"), axis=-1).reshape(-1, 2)
    if cell_name == "quadrilateral":
        return X
    if cell_name == "triangle":
        lower = np.stack(np.meshgrid(np.arange(k), np.arange(k), indexing="ij"), axis=-1).reshape(-1, 2)
        upright = (lower[lower.sum(axis=1) < k] + 1 / 3) / k
        inverted = (lower[lower.sum(axis=1) < k - 1] + 2 / 3) / k
        return np.concatenate([upright, inverted])
    raise InputError(f"zones are polygons in a plane and the cells are {cell_name}s: quadrilaterals or triangles fit")
