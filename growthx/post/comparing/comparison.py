"""Pearson's r, root mean square error and bias between the density of a run and another one, whole and by zones."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from growthx.common.arrays import Field
from growthx.common.checks import check_picture, is_function, require_each, require_kind, require_name
from growthx.common.errors import InputError, raise_on_all, shown
from growthx.discretisation.checks.arguments import require_problem
from growthx.discretisation.transfers.grown import GrownDensity
from growthx.discretisation.transfers.transfer import transfer
from growthx.discretisation.variants import AtPoints
from growthx.meshing.fields import as_ufl, has_points, scalar
from growthx.meshing.images.density import ScanDensity
from growthx.meshing.sampling import positions, split_rule, volume_ratios
from growthx.meshing.transferred import TransferredDensity
from growthx.post.comparing.picture import IMAGES, draw

if TYPE_CHECKING:
    from growthx.common.arrays import Floats, Marks
    from growthx.discretisation.discretisation import Discretisation

DEGREE = 5  # of the rule by which cells are sampled
PIECES = 4  # … in the plane of so many parts of a cell in each direction, since zones cut through cells
CONSTANT = 1e-10  # relative: a density that varies less has no correlation


@dataclass(frozen=True)
class Agreement:
    """How one density, of mean `mean`, agrees with another, of mean `other`, over a volume (an area in the plane).

    pearson: correlation r by volume; None where one of them does not vary.  rmse: root of the mean of (ρ − other)².
    bias: mean of ρ − other.
    """

    pearson: float | None
    rmse: float
    bias: float
    mean: float
    other: float
    volume: float


@dataclass(frozen=True)
class Comparison(Agreement):
    """The agreement over what grows; zones: that of each zone."""

    zones: Mapping[str, Agreement]


def compare(
    result: Any,
    other: Any,
    *,
    zones: Mapping[str, Any] | None = None,
    picture: str | os.PathLike[str] | None = None,
    labels: tuple[str, str] = ("run", "compared with"),
    unit: str = "g/cm³",
) -> Comparison:
    """Compare the density that a run has ended with, over what grows, with another one (collective).

    other: what `Scan.density` returns; a result, a discretised scene or what `read_density` returns; or a field.
    zones: by name, a polygon of a plane body, (corners, 2); names of regions, as a tuple; or a function of position, x
    of shape (3, points), that is true inside.
    picture: an image of both and of the difference, means of cells; of a body in space the coronal plane (x, z)
    through its middle.  labels: of both, in the picture.  unit: of density, there.

    Cells are sampled at points that integrate a polynomial of degree 5, in the plane at those of each of its 4 × 4
    parts.  The same on all ranks.  Raises InputError for a zone in which nothing grows, and if the other density does
    not cover the body.

    Example:
        >>> found = gx.compare(gx.solve(gx.scenes.plate(2), gx.Q1P0), 0.7)
        >>> f"{found.mean:.3f} against {found.other:g}, off by {found.rmse:.3f}"
        '0.674 against 0.7, off by 0.090'
    """
    problem = require_problem(result)
    require_kind(unit, str, "the unit of density", "a text")
    labels = require_each(labels, str, "the labels of a picture", "text")
    if len(labels) != 2:
        raise InputError(f"the labels of a picture are {shown(labels)}: two texts would be right")
    require_kind(zones or {}, Mapping, "what holds the zones", "a mapping from names to what they are")
    if picture is not None:
        check_picture(picture, IMAGES, problem.comm)
    mesh = problem.scene.mesh
    X, weights = split_rule(mesh.cell_name, PIECES if mesh.dim == 2 else 1, DEGREE)
    places = positions(mesh, X)
    volumes = weights * volume_ratios(mesh, X)
    grows = np.isin(mesh.owned_cells, problem.growing_cells)[:, np.newaxis]
    one, two = problem.density_at(X), _values(problem, other, X, places)
    found = {}
    for name, meant in (zones or {}).items():
        require_name(name, "the name of a zone")
        inside = _inside(problem, name, meant, places) & grows
        found[name] = _agreement(problem, f"the zone '{name}'", volumes * inside, one, two)
    whole = _agreement(problem, "the body", volumes * grows, one, two)
    if picture is not None:
        means = (np.sum(volumes * values, axis=1) / volumes.sum(axis=1) for values in (one, two))
        draw(problem, *means, path=picture, labels=labels, unit=unit)
    return Comparison(**vars(whole), zones=found)


def _values(problem: Discretisation, other: Any, X: Floats, places: Floats) -> Floats:
    """The other density at points of the owned cells, (cells, points)."""
    mesh, shape = problem.scene.mesh, places.shape[:2]
    if isinstance(other, GrownDensity) or hasattr(getattr(other, "problem", other), "densities_of_cells"):
        other = transfer(other, mesh, problem.variant)
    if isinstance(other, TransferredDensity) and isinstance(problem.variant.density, AtPoints):
        if other.mesh is mesh and other.variant == problem.variant.name:  # read as the run's is, of the nearest point
            shares = problem.variant.density.shares(problem.density_space.ufl_element(), X)
            return np.asarray(other.of_cells() @ shares.T)
    elif isinstance(other, ScanDensity) and not other.of_cells:
        other.check_dimension(mesh.dim)
        return other.at_points(places.reshape(-1, 3)[:, : mesh.dim], problem.comm).reshape(shape)
    elif has_points(other):
        values, trouble = np.empty(shape), ""
        try:
            values = scalar(other)(places.reshape(-1, 3).T).reshape(shape)
        except InputError as error:
            trouble = str(error)
        raise_on_all(problem.comm, trouble)
        return np.asarray(values)
    return problem.evaluate(as_ufl(_field(other), mesh), X)


def _field(other: Any) -> Field:
    is_field = np.isscalar(other) or isinstance(other, (np.ndarray, Mapping, ScanDensity))
    if isinstance(other, str) or not (is_field or is_function(other) or hasattr(other, "function_space")):
        raise InputError(
            f"the density to compare with is {shown(other)}: what scan.density(a=…, b=…) returns, a result, or a field "
            "would be right"
        )
    return other


def _inside(problem: Discretisation, name: str, meant: Any, places: Floats) -> Marks:
    """Which points of the owned cells lie in a zone, (cells, points), or (cells, 1)."""
    mesh = problem.scene.mesh
    if isinstance(meant, str) or (isinstance(meant, (tuple, list)) and all(isinstance(one, str) for one in meant)):
        names = meant if isinstance(meant, str) else tuple(meant)
        return np.isin(mesh.owned_cells, problem.cells_of(names))[:, np.newaxis]
    if is_function(meant):
        inside = np.asarray(meant(places.reshape(-1, 3).T))
        if inside.shape != (places.shape[0] * places.shape[1],):
            raise InputError(f"the zone '{name}' has values of shape {inside.shape}: one for each point is needed")
        return inside.astype(bool).reshape(places.shape[:2])
    from growthx.post.zones import contains

    return contains(name, meant, places[:, :, : mesh.dim])


def _agreement(problem: Discretisation, what: str, volumes: Floats, one: Floats, two: Floats) -> Agreement:
    comm = problem.comm
    total, first, second = comm.allreduce(np.array([volumes.sum(), np.sum(volumes * one), np.sum(volumes * two)]))
    if not total > 0:
        raise InputError(f"{what} holds nothing that grows: one that overlaps what does would be right")
    mean, other = first / total, second / total
    a, b = one - mean, two - other
    sums = [np.sum(volumes * part) for part in (a * a, b * b, a * b, (one - two) ** 2)]
    aa, bb, ab, square = comm.allreduce(np.array(sums)) / total
    varies = aa > (CONSTANT * mean) ** 2 and bb > (CONSTANT * other) ** 2
    return Agreement(
        pearson=float(ab / np.sqrt(aa * bb)) if varies else None,
        rmse=float(np.sqrt(square)),
        bias=float(mean - other),
        mean=float(mean),
        other=float(other),
        volume=float(total),
    )
