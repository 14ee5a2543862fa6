"""The femur's anatomy: our own outline with its zones, and where the hip's forces act on this or another femur.

Lengths in mm.  On our outline x points medially and y proximally; on its mirror image medial is −x.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial import KDTree

from growthx.common.checks import LARGEST, require_kind, require_name
from growthx.common.errors import InputError, shown
from growthx.meshing import files

if TYPE_CHECKING:
    from growthx.common.arrays import Floats

HEAD_CENTRE = (43.0, 132.0)
HEAD_RADIUS = 24.0
JOINT_HALF_ARC = np.radians(35.0)
CONTROL_POINTS = 63  # of the outline
ABDUCTOR_INSERTION = (45, 52)  # of them
COLUMNS = ("x_mm", "y_mm", "z_mm")  # of a table of places
OFF_OUTLINE = 3.0  # mm that a straight facet may lie off the outline's spline
OFF_HEAD = 0.1  # of its radius, that the boundary which bears the joint's force may lie off the head's circle


@dataclass(frozen=True)
class Head:
    """The circle of the femoral head: centre (x, y) and radius.

    on: the boundary that bears the joint's force.  medial: 1 or −1, the direction of x that points medially.
    how: where the circle comes from, as a part of a sentence.  off: how far off it the boundary may lie, in radii.
    """

    x: float
    y: float
    radius: float
    on: str = "surface"
    medial: int = 1
    how: str = "of growthx's own outline"
    off: float = OFF_HEAD

    def __str__(self) -> str:
        side = "+x" if self.medial > 0 else "−x"
        return (
            f"a circle of radius {self.radius:.4g} mm about ({self.x:.4g}, {self.y:.4g}), {self.how}; medial is {side}"
        )


@dataclass(frozen=True)
class JointArc:
    """Weight of a joint force on the head: a cosine over ±35° of arc about the direction the force comes from.

    angle: of that direction from the vertical, medially (degrees).
    """

    head: Head
    angle: float

    @property
    def length(self) -> float:
        """Of the arc (mm)."""
        return float(2 * JOINT_HALF_ARC * self.head.radius)

    def __call__(self, x: Floats) -> Floats:
        """The weight at points x of shape (3, points)."""
        head = self.head
        dx, dy = head.medial * (x[0] - head.x), x[1] - head.y
        angle = np.arctan2(dy, dx) - np.radians(90.0 - self.angle)
        angle = (angle + np.pi) % (2 * np.pi) - np.pi
        there = np.abs(angle) < JOINT_HALF_ARC
        there &= np.abs(np.hypot(dx, dy) - head.radius) < head.off * head.radius
        return np.where(there, np.cos(np.pi / 2 * angle / JOINT_HALF_ARC), 0.0)


@dataclass(frozen=True, eq=False)
class Insertion:
    """Weight of the abductors' force: half a sine along the arc of their insertion.

    arc: points on it in order, shape (points, 2).  reach: how far off it a facet may lie.
    on: the boundary that bears the force.  how: where the arc comes from, as a part of a sentence.
    """

    arc: Floats
    reach: float = OFF_OUTLINE
    on: str = "surface"
    how: str = "of growthx's own outline"

    def __str__(self) -> str:
        ends = " to ".join(f"({x:.4g}, {y:.4g})" for x, y in self.arc[[0, -1]])
        return f"{self.length:.4g} mm from {ends}, {self.how}"

    @property
    def length(self) -> float:
        """Of the arc (mm)."""
        return float(self._along[-1])

    @cached_property
    def _along(self) -> Floats:
        """Length of the arc up to each of its points."""
        return np.append(0.0, np.cumsum(np.hypot(*np.diff(self.arc, axis=0).T)))

    @cached_property
    def _tree(self) -> KDTree:
        return KDTree(self.arc)

    def __call__(self, x: Floats) -> Floats:
        """The weight at points x of shape (3, points)."""
        distance, nearest = self._tree.query(x[:2].T)
        share = self._along[nearest] / self.length
        return np.where(distance < self.reach, np.sin(np.pi * share), 0.0)


@dataclass(frozen=True)
class Anatomy:
    """Where the hip's forces act.

    lean: of the shaft from the y axis, from which the forces have their angles (degrees, medially).
    ours: whether the whole outline is growthx's own, or its mirror image.
    """

    head: Head
    insertion: Insertion
    lean: float
    ours: bool


# -- our own -----------------------------------------------------------------------------------------------------------


@cache
def outline() -> Floats:
    """Control points of the outline, anticlockwise from the distal medial corner, shape (63, 2), mm."""
    points = np.array([place for _, place in _places("femur_outline.csv", "index")])
    if len(points) != CONTROL_POINTS:
        raise InputError(
            f"growthx's own file femur_outline.csv has {len(points)} rows: a copy with {CONTROL_POINTS} is due"
        )
    return points


@cache
def zones() -> dict[str, Floats]:
    """Polygons of anatomical zones by name, shape (corners, 2), mm."""
    return _polygons(_places("femur_zones.csv", "zone"))


def along_outline(first: int, last: int, points: int) -> Floats:
    """Points on the outline's spline between two of the control points, shape (points, 2)."""
    spline = CubicSpline(np.arange(CONTROL_POINTS), outline())
    return np.asarray(spline(np.linspace(first, last, points)))


@cache
def own_insertion(medial: int = 1) -> Insertion:
    """The abductors' insertion on our outline, or on its mirror image."""
    return Insertion(along_outline(*ABDUCTOR_INSERTION, 2001) * (medial, 1))


@cache
def own_anatomy(medial: int = 1) -> Anatomy:
    """The anatomy of our outline, or of its mirror image."""
    x, y = HEAD_CENTRE
    return Anatomy(Head(medial * x, y, HEAD_RADIUS, medial=medial), own_insertion(medial), lean=0.0, ours=True)


def own_zones(medial: int = 1) -> dict[str, Floats]:
    """The zones of our outline, or of its mirror image."""
    return {name: polygon * (medial, 1) for name, polygon in zones().items()}


def _places(name: str, key: str) -> list[tuple[str, tuple[float, ...]]]:
    """The rows of one of growthx's own tables, each a key with a place (mm); InputError if the file is damaged."""
    path = files.locate(name)
    try:
        return _rows(path, key)
    except (OSError, KeyError, TypeError, ValueError, csv.Error) as error:
        raise InputError(f"growthx's own file {path} is damaged ({shown(error)}): a new copy would be right") from error


def _rows(path: Path, key: str, columns: tuple[str, ...] = COLUMNS[:2]) -> list[tuple[str, tuple[float, ...]]]:
    with path.open(newline="", encoding="utf-8-sig") as file:
        rows = [(row[key], tuple(float(row[column]) for column in columns)) for row in csv.DictReader(file)]
    if not rows or not np.all(np.isfinite([place for _, place in rows])):
        raise ValueError("numbers are missing")
    return rows


def _polygons(rows: list[tuple[str, tuple[float, ...]]]) -> dict[str, Floats]:
    corners: dict[str, list[tuple[float, ...]]] = {}
    for zone, place in rows:
        corners.setdefault(zone, []).append(place)
    return {name: np.array(polygon) for name, polygon in corners.items()}


# -- the user's --------------------------------------------------------------------------------------------------------


def zones_of(given: str | Path | Mapping[str, Any], dim: int = 2) -> dict[str, Floats]:
    """The user's zones: corners by name, of polygons in the plane and of convex bodies in space.

    A CSV file has the columns zone, x_mm and y_mm, in space also z_mm, a row for each corner.
    Raises InputError for what cannot be read, and for zones of too few corners, or without area or volume.
    """
    wanted = "a file, or a mapping from names to corners,"
    require_kind(given, (str, Path, Mapping), "the zones", wanted)
    if not given:
        raise InputError(f"the zones are {shown(given)}: {wanted} would be right")
    found = dict(given) if isinstance(given, Mapping) else _read_zones(Path(given), dim)
    source = "the zones" if isinstance(given, Mapping) else str(given)
    for name, corners in found.items():
        require_name(name, "the name of a zone")
        found[name] = zone = _numbers(corners)
        if zone.ndim != 2 or zone.shape[1:] != (dim,) or len(zone) <= dim or not np.all(np.abs(zone) < LARGEST):
            least = "a polygon of three corners (x, y)" if dim == 2 else "a body of four corners (x, y, z)"
            raise InputError(f"the zone '{name}' of {source} is {shown(corners)}: {least} in mm or more would be right")
        if not _has_extent(zone):
            what = "no area: the corners of a polygon" if dim == 2 else "no volume: the corners of a body"
            raise InputError(f"the zone '{name}' of {source} has {what} would be right")
    return found


def _has_extent(corners: Floats) -> bool:
    """Whether a polygon has an area, or the corners of a body do not lie in a plane."""
    away = corners - corners[0]
    if corners.shape[1] == 3:
        return int(np.linalg.matrix_rank(away, tol=1e-6 * np.abs(away).max())) == 3
    x, y = away.T
    return bool(abs(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))) > 1e-9 * np.ptp(corners, axis=0).max() ** 2)


def _numbers(corners: Any) -> Floats:
    try:
        return np.empty(0) if np.iscomplexobj(corners) else np.array(corners, dtype=float)
    except (TypeError, ValueError):
        return np.empty(0)


def _read_zones(path: Path, dim: int) -> dict[str, Floats]:
    columns = COLUMNS[:dim]
    try:
        return _polygons(_rows(path, "zone", columns))
    except OSError as error:
        raise InputError(f"the zones {path} cannot be read ({error.strerror}): a CSV file would be right") from error
    except (KeyError, TypeError, ValueError, csv.Error) as error:
        raise InputError(
            f"the zones {path} cannot be read ({shown(error)}): a CSV file with the columns zone, "
            f"{', '.join(columns[:-1])} and {columns[-1]}, a row for each corner, would be right"
        ) from error
