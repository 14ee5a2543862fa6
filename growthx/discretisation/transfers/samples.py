"""The density of a run at points of another mesh's cells, with its mass."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import basix
import numpy as np

from growthx.common.errors import InputError
from growthx.common.words import place_in_words, quoted
from growthx.discretisation.transfers.grown import cell_numbers, grown
from growthx.discretisation.transfers.recovery import values_in_cell, volumes_of_densities
from growthx.discretisation.variants import PerCell
from growthx.fem.cells import SIMPLICES
from growthx.meshing.closest import nearest
from growthx.meshing.sampling import cells_at, positions, pull_back, reference_corners, volume_ratios

if TYPE_CHECKING:
    from collections.abc import Callable

    from growthx.common.arrays import Floats, Indices, Marks
    from growthx.discretisation.discretisation import Discretisation
    from growthx.discretisation.transfers.grown import GrownDensity
    from growthx.discretisation.variants import Variant
    from growthx.meshing.mesh import Mesh

BESIDE = 0.25  # of a cell's size: how far beside the body a point may be that another mesh has of the same curve
FIELD_DEGREE = 4  # up to which fields are integrated in each cell
INWARD = 1e-3  # of the way to the middle of its cell, by which a point is drawn in where cells are looked for
ROUND_OFF = 1e-9  # relative to the size of the body


@dataclass(frozen=True)
class Samples:
    """Densities at points of each owned cell of a mesh.

    X: the points in the reference cell, (points, dim).  weights: their volumes, (cells, points).
    values, low, high: densities there, and between which ones of the run, (cells, points).
    rests: whether the run's body did not grow there.
    correction: change of mass that made it that of the run, relative; NaN where it is not to be.
    beside, outside: shares of the volume that have the density of the nearest point, or one that was given.
    """

    X: Floats
    weights: Floats
    values: Floats
    low: Floats
    high: Floats
    rests: Marks
    correction: float = 0.0
    beside: float = 0.0
    outside: float = 0.0


def rule(variant: Variant, shape: str, degree: int) -> tuple[Floats, Floats]:
    """Points of a cell, (points, dim), with weights, enough for a variant and for one that integrates to a degree."""
    enough = max(4 if shape in SIMPLICES else 5, degree, variant.mass_degree, variant.momentum_degree)
    X, weights = basix.make_quadrature(basix.CellType[shape], enough)
    return np.asarray(X), np.asarray(weights)


def of_the_same_cells(source: GrownDensity, rows: Indices, mesh: Mesh, variant: Variant) -> Samples:
    """On the mesh of the run; rows: of the run's cells for the owned cells.  Each cell has the mass that it had."""
    X, weights = rule(variant, mesh.cell_name, source.mass_degree)
    densities, element = source.densities[rows], source.element
    weights = weights * volume_ratios(mesh, X)
    low, high = (np.repeat(end(densities, axis=1)[:, np.newaxis], len(X), axis=1) for end in (np.min, np.max))
    values = np.clip(densities @ values_in_cell(source.density, element, X).T, low, high)
    rests = np.repeat(source.rests[rows][:, np.newaxis], len(X), axis=1)
    samples = Samples(X, weights, values, low, high, rests)
    masses = volumes_of_densities(mesh, source.density, element, source.momentum_degree) * densities
    of_cells = np.repeat(np.arange(len(rows))[:, np.newaxis], len(X), axis=1)
    return _with_masses(samples, of_cells, masses.sum(axis=1), lambda sums: sums, None)


def of_another_mesh(source: GrownDensity, mesh: Mesh, variant: Variant, outside: float | None) -> Samples:
    """On any mesh; where that and the run's are of the same body, with the run's mass (collective).

    outside: density where there was no body; None: InputError if that is anywhere.
    """
    X, weights = rule(variant, mesh.cell_name, 0)
    weights = weights * volume_ratios(mesh, X)
    places = positions(mesh, X)[:, :, : mesh.dim].reshape(-1, mesh.dim)
    found, distance, allowed = _evaluated(source, places, _inward(mesh, X))
    values, low, high, rests = (each.reshape(weights.shape) for each in found)
    size = float(np.ptp(source.points, axis=0).max())
    beside = (distance > ROUND_OFF * size).reshape(weights.shape)
    far = (distance > np.maximum(allowed, ROUND_OFF * size)).reshape(weights.shape)
    shares = [weights.sum(), weights.sum(where=beside & ~far), weights.sum(where=far)]
    volume, near_by, missing = mesh.comm.allreduce(np.array(shares))
    if mesh.comm.allreduce(int(np.count_nonzero(far))):
        if outside is None:
            _refuse(source, mesh, places[far.ravel()], missing / volume)
        for each in (values, low, high):
            each[far] = outside
        rests[far] = False
    samples = Samples(X, weights, values, low, high, rests, np.nan, near_by / volume, missing / volume)
    return samples if near_by or missing else _with_the_mass_of(source, samples, mesh)


def _inward(mesh: Mesh, X: Floats, cells: Indices | slice = slice(None)) -> Floats:
    """Places of points X of cells, (cells · points, dim), drawn a little into their cells.

    Rules have points on the border of cells, where a body with the same cells would have any neighbour's density.
    """
    middle = reference_corners(mesh.cell_name).mean(axis=0)
    return positions(mesh, middle + (1 - INWARD) * (X - middle), cells)[:, :, : mesh.dim].reshape(-1, mesh.dim)


def _evaluated(source: GrownDensity, places: Floats, inward: Floats) -> tuple[list[Floats], Floats, Floats]:
    """Density of a run at places, the least and the largest of the cell there, and whether it rests.

    inward: the places drawn into the cells that ask, by which the cell of the run is chosen.
    Also how far each place is from the body, and how far it may be.
    """
    body, order = source.mesh
    cells, X = cells_at(body, inward)
    inside = np.flatnonzero(cells >= 0)
    X[inside] = pull_back(body, cells[inside], places[inside])
    distance, allowed = np.zeros(len(places)), np.zeros(len(places))
    beside = np.flatnonzero(cells < 0)
    if len(beside):
        cells[beside], X[beside], distance[beside], sizes = nearest(body, places[beside])
        allowed[beside] = BESIDE * sizes
    rows = order[cells]
    densities = source.densities[rows]
    low, high = densities.min(axis=1, initial=np.inf), densities.max(axis=1, initial=-np.inf)
    values = np.zeros(len(places))
    if len(places):  # basix aborts when it is given no points at all
        basis = values_in_cell(source.density, source.element, X)
        values = np.clip(np.einsum("pd,pd->p", basis, densities), low, high)
    return [values, low, high, source.rests[rows]], distance, allowed


def _refuse(source: GrownDensity, mesh: Mesh, far: Floats, share: float) -> None:
    """Raise InputError that names what of a mesh is beside the body of a run (collective)."""
    first = next(place for place in mesh.comm.allgather(far[:1].tolist()) if place)[0]
    raise InputError(
        f"{100 * share:.3g} % of the mesh, at {place_in_words(first, 4)} for one, lie outside the body of the run "
        f"{quoted(source.scene)}, farther from it than {BESIDE:g} of its cells: a density to begin with there, as "
        "outside=, or a mesh of the same body would be right"
    )


def _with_the_mass_of(source: GrownDensity, samples: Samples, mesh: Mesh) -> Samples:
    """Give samples of a mesh inside the run's body the run's mass, if it is the same body (collective)."""
    body, order = source.mesh
    of_cells = volumes_of_densities(body, source.density, source.element, source.momentum_degree)
    densities, rests = source.densities[order], source.rests[order]
    masses, volumes = (
        np.array([part[~rests].sum(), part[rests].sum()])
        for part in ((of_cells * densities).sum(axis=1), of_cells.sum(axis=1))
    )
    kinds = samples.rests.astype(int)
    here = mesh.comm.allreduce(np.bincount(kinds.ravel(), samples.weights.ravel(), 2))
    limit = ROUND_OFF * volumes.sum()
    if abs(here.sum() - volumes.sum()) > limit:
        return samples
    if np.abs(here - volumes).max() > limit:  # the meshes part what grows from what rests along other lines
        masses, kinds = np.array([masses.sum()]), np.zeros_like(kinds)
    ends = float(source.densities.min()), float(source.densities.max())
    changed = _with_masses(samples, kinds, masses, mesh.comm.allreduce, ends)
    change = mesh.comm.allreduce(float(np.sum(samples.weights * np.abs(changed.values - samples.values))))
    return replace(changed, correction=change / float(masses.sum()))


def _with_masses(
    samples: Samples, groups: Indices, masses: Floats, add: Callable[[Floats], Floats], ends: tuple[float, float] | None
) -> Samples:
    """Samples moved towards the bounds of their cells, or the ends of all, so that each group has its mass.

    groups: of the samples, from 0.  add: sums over ranks.  Where the bounds leave no room, all of a group are
    multiplied by one factor.
    """

    def sums(of: Floats) -> Floats:
        return add(np.bincount(groups.ravel(), of.ravel(), len(masses)))

    values, weights = samples.values, samples.weights
    bounds: list[tuple[Any, Any]] = [(samples.low, samples.high), *([ends] if ends else [])]
    for low, high in bounds:
        defect = masses - sums(weights * values)
        room = np.where(defect[groups] > 0, high, low) - values
        whole = sums(weights * room)
        usable = (whole != 0) & (np.abs(whole) >= np.maximum(np.abs(defect), 1e-12 * np.abs(masses)))
        share = np.divide(defect, whole, out=np.zeros_like(defect), where=usable)
        values = values + share[groups] * room
    factor = np.divide(masses, sums(weights * values), out=np.ones_like(masses), where=masses > 0)
    return replace(samples, values=values * factor[groups])


def means_of_cells(problem: Discretisation, values: Floats, mesh: Mesh, cells: Indices) -> Floats:
    """Values of the owned cells of one body, (its owned cells,), as means over some owned cells of another mesh.

    cells: of that mesh.  Returns shape (owned cells of the mesh,), zero in the others (collective).
    Raises InputError if any of them lies beside the body.
    """
    run = grown(problem)
    of_body = np.empty((len(run.cells), 1))
    numbers = cell_numbers(problem.scene.mesh.domain)[: len(values)]
    for rows, part in problem.comm.allgather((numbers, values)):
        of_body[rows, 0] = part
    X, weights = (np.asarray(part) for part in basix.make_quadrature(basix.CellType[mesh.cell_name], FIELD_DEGREE))
    volumes = weights * volume_ratios(mesh, X, cells)
    places = positions(mesh, X, cells)[:, :, : mesh.dim].reshape(-1, mesh.dim)
    inward = _inward(mesh, X, cells)
    found, distance, allowed = _evaluated(replace(run, density=PerCell(), densities=of_body), places, inward)
    far = distance > np.maximum(allowed, ROUND_OFF * float(np.ptp(run.points, axis=0).max()))
    whole, missing = mesh.comm.allreduce(np.array([volumes.sum(), volumes.sum(where=far.reshape(volumes.shape))]))
    if missing > 0:
        _refuse(run, mesh, places[far], missing / whole)
    means = np.zeros(len(mesh.owned_cells))
    means[cells] = np.sum(volumes * found[0].reshape(volumes.shape), axis=1) / volumes.sum(axis=1)
    return means
