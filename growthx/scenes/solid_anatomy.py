"""The anatomy of a femur in space, measured on its mesh: head, axes of shaft and neck, zones, where forces act.

Lengths in mm; y points anteriorly and z superiorly; x points laterally on a right femur and medially on a left one.
What cannot be told is refused.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import dolfinx
import numpy as np

from growthx.common.errors import InputError, raise_on_all
from growthx.meshing.sampling import positions, reference_corners, volume_ratios
from growthx.model.arrows import facet_sizes
from growthx.scenes.anatomy import OFF_HEAD

if TYPE_CHECKING:
    from growthx.common.arrays import Floats, Indices, Marks
    from growthx.meshing.mesh import Mesh

NAMES = ("head", "trochanter", "distal")  # of the boundaries that a femur's mesh has
RADII = (10.0, 60.0)  # mm, of a head
SHAFT = (3.3, 6.0)  # head radii below the head's centre, between which the shaft's axis is looked for
AT_THE_CUT = 0.3  # head radii above the distal end that are left out of it
LEAST_SHAFT = 0.5  # head radii of shaft that are needed
NECK = (1.15, 1.6)  # head radii from its centre, between which the neck is looked for
HALF_CAP = np.radians(45.0)  # about the direction of the joint's force, on which it acts
REFERENCE_RADIUS = 24.0  # mm, of the head whose zones the numbers below are
TOO_FAR = 25.0  # mm of a muscle's place from the boundary it pulls at


@dataclass(frozen=True)
class Cap:
    """Weight of a joint force on the head: a cosine over ±45° about the direction the force comes from.

    centre: of the head (mm).  towards: that direction, of length one.
    """

    centre: tuple[float, float, float]
    towards: tuple[float, float, float]

    def __call__(self, x: Floats) -> Floats:
        """The weight at points x of shape (3, points)."""
        away = x - np.array(self.centre)[:, np.newaxis]
        cosine = np.array(self.towards) @ away / np.maximum(np.linalg.norm(away, axis=0), 1e-12)
        angle = np.arccos(np.clip(cosine, -1.0, 1.0))
        return np.where(angle < HALF_CAP, np.cos(np.pi / 2 * angle / HALF_CAP), 0.0)


@dataclass(frozen=True)
class Attachment:
    """Weight of a muscle's force: a parabola over a ball.

    muscle: its name.  centre: on the boundary (mm).  radius: mm.
    """

    muscle: str
    centre: tuple[float, float, float]
    radius: float

    def __call__(self, x: Floats) -> Floats:
        """The weight at points x of shape (3, points)."""
        away = (x - np.array(self.centre)[:, np.newaxis]) / self.radius
        return np.maximum(0.0, 1.0 - np.sum(away**2, axis=0))


@dataclass(frozen=True, eq=False)
class SolidAnatomy:
    """The landmarks of a femur in space.

    centre, radius: of the head, a sphere fitted to its boundary; misfit: how far off it that lies, in radii.
    lateral: 1 or −1, the direction of x that points laterally.
    crossing: the point of the shaft's axis that is nearest to the neck's.
    shaft: of length one, down the shaft.  neck: of length one, from the head to the crossing.
    depth: of the distal end below the crossing, along the shaft (mm).
    """

    centre: Floats
    radius: float
    misfit: float
    lateral: int
    crossing: Floats
    shaft: Floats
    depth: float

    @property
    def neck(self) -> Floats:
        """Of length one, from the head to the crossing."""
        return _unit(self.crossing - self.centre)

    @property
    def neck_shaft_angle(self) -> float:
        """Between neck and shaft (degrees)."""
        return float(np.degrees(np.arccos(-self.neck @ self.shaft)))

    @property
    def version(self) -> float:
        """Of the neck, how far it points anteriorly (degrees)."""
        return float(np.degrees(np.arctan2(-self.neck[1], self.lateral * self.neck[0])))

    @property
    def frame(self) -> Floats:
        """Of length one, in rows: across the shaft laterally and anteriorly, and down the shaft."""
        sideways = np.array([self.lateral, 0.0, 0.0])
        sideways = _unit(sideways - (sideways @ self.shaft) * self.shaft)
        return np.array([sideways, np.cross(sideways, self.shaft), self.shaft])

    def in_space(self, vector: tuple[float, float, float]) -> tuple[float, float, float]:
        """The components in x, y, z of a vector (lateral, anterior, superior)."""
        return self.lateral * vector[0], vector[1], vector[2]

    def __str__(self) -> str:
        side = "right" if self.lateral > 0 else "left"
        x, y, z = self.centre.round(2) + 0.0  # no −0
        return (
            f"a {side} femur if y points anteriorly; head of radius {self.radius:.4g} mm about ({x:g}, {y:g}, {z:g}), "
            f"fitted to {self.misfit:.1g} of it; neck–shaft angle {self.neck_shaft_angle:.0f}°, version "
            f"{self.version:.0f}°"
        )


def measure(mesh: Mesh) -> SolidAnatomy:
    """The anatomy of the femur of a mesh with the boundaries "head", "trochanter" and "distal" (collective)."""
    head, trochanter, distal = (corners(mesh, name) for name in NAMES)
    centre, radius, misfit = _sphere(head)
    lateral = _lateral(centre, radius, trochanter.mean(axis=0))
    low = float(distal[:, 2].mean())
    if low > centre[2]:
        raise InputError(
            f"the distal end of the femur's mesh is {low - centre[2]:.4g} mm above its head: a mesh whose z axis "
            "points superiorly would be right"
        )
    middles, volumes = _cells(mesh)
    axis, slope = _shaft(mesh, middles, volumes, centre, radius, low)
    away = np.linalg.norm(middles - centre, axis=1) / radius
    neck = _mean(mesh, middles, np.where((away > NECK[0]) & (away < NECK[1]), volumes, 0.0))
    if neck is None:
        raise InputError(f"there is no bone about the head of the femur's mesh, {radius:.4g} mm wide: a neck is due")
    crossing = _nearest_to_line(axis, slope, centre, _unit(neck - centre))
    down = _unit(-slope)
    return SolidAnatomy(
        centre=centre,
        radius=radius,
        misfit=misfit,
        lateral=lateral,
        crossing=crossing,
        shaft=down,
        depth=float((distal.mean(axis=0) - crossing) @ down),
    )


# -- zones -------------------------------------------------------------------------------------------------------------

# In the plane of the neck: along the neck from the head's centre, in head radii and in lengths of the neck, and across
# it, superiorly, in mm of a head of 24 mm.
NECK_ZONES = {
    "strut, head to calcar": ((-0.45, 0.0, 12), (-0.45, 0.0, 3), (0.0, 0.41, -15), (0.0, 0.48, -7)),
    "head lateral to the strut": ((-0.05, 0.0, 23), (-0.05, 0.0, 15), (0.5, 0.0, 12), (0.5, 0.0, 20)),
    "head medial to the strut": ((-0.7, 0.0, -10), (-0.7, 0.0, -18), (0.0, 0.0, -24), (0.0, 0.0, -16)),
    "calcar": ((0.0, 0.5, -12), (0.0, 0.5, -21), (0.0, 0.7, -28), (0.0, 0.7, -18)),
    "superior neck": ((0.0, 0.35, 20), (0.0, 0.35, 13), (0.0, 0.55, 13), (0.0, 0.55, 20)),
    "middle neck": ((0.0, 0.3, 8), (0.0, 0.3, -4), (0.0, 0.5, -4), (0.0, 0.5, 8)),
    "Ward's triangle": ((0.0, 0.53, 9), (0.0, 0.55, -1), (0.0, 0.68, -1), (0.0, 0.68, 9)),
    "greater trochanter": ((0.0, 0.85, 20), (0.0, 0.85, 8), (0.0, 1.1, 8), (0.0, 1.1, 20)),
}
HALF_THICKNESS = 5.0  # mm of such a head, of all zones
CORTEX = 5.0  # … from the surface
CANAL = (3.5, 4.0)  # … from the shaft's axis, laterally and anteriorly
SHAFT_ZONES = (0.43, 0.75)  # of the way from the crossing to the distal end, or of 3.7 head radii on a longer shaft
LONGEST = 3.7


def zones_of_bone(mesh: Mesh, bone: SolidAnatomy) -> dict[str, Floats]:
    """Zones by name as the corners of convex bodies, shape (corners, 3), mm (collective)."""
    unit = bone.radius / REFERENCE_RADIUS
    zones = dict(_neck_zones(bone, unit))
    zones.update(_shaft_zones(bone, unit, _exterior(mesh)))
    return zones


def _neck_zones(bone: SolidAnatomy, unit: float) -> Iterator[tuple[str, Floats]]:
    along = bone.neck
    above = np.array([0.0, 0.0, 1.0])
    across = _unit(above - (above @ along) * along)
    out = np.cross(along, across)
    length = np.linalg.norm(bone.crossing - bone.centre)
    for name, corners_ in NECK_ZONES.items():
        radii, shares, heights = np.array(corners_).T
        flat = bone.centre + np.outer(radii * bone.radius + shares * length, along) + np.outer(unit * heights, across)
        yield name, np.concatenate([flat + sign * unit * HALF_THICKNESS * out for sign in (1, -1)])


def _shaft_zones(bone: SolidAnatomy, unit: float, surface: Floats) -> Iterator[tuple[str, Floats]]:
    frame = bone.frame
    lengths = np.array(SHAFT_ZONES) * min(bone.depth, LONGEST * bone.radius)
    places = (surface - bone.crossing) @ frame.T
    beside = (places[:, 2] > lengths[0]) & (places[:, 2] < lengths[1])
    beside &= np.abs(places[:, 1]) < unit * HALF_THICKNESS

    def box(side: tuple[float, float], depth: float) -> Floats:
        grid = np.meshgrid(side, (-depth, depth), lengths, indexing="ij")
        return np.asarray(bone.crossing + np.stack(grid, axis=-1).reshape(-1, 3) @ frame)

    for name, sign in (("medial cortex", -1), ("lateral cortex", 1)):
        there = places[beside & (sign * places[:, 0] > 0), 0]
        if not len(there):
            raise InputError(
                f"the shaft of the femur's mesh has no surface {'laterally' if sign > 0 else 'medially'} of its axis "
                f"from {lengths[0]:.3g} to {lengths[1]:.3g} mm below its neck: a finer mesh, or zones of your own, "
                "would be right"
            )
        outer = float(np.median(there))
        yield name, box((outer - sign * unit * CORTEX, outer + sign * unit * CORTEX / 2), unit * HALF_THICKNESS)
    yield "canal", box((-unit * CANAL[0], unit * CANAL[0]), unit * CANAL[1])


# -- places ------------------------------------------------------------------------------------------------------------


def corners(mesh: Mesh, name: str) -> Floats:
    """Where the corners of a boundary's facets are, each once, of all ranks, (corners, 3), mm (collective)."""
    return _places(mesh, mesh.owned_facets(name))


def loaded_area(mesh: Mesh, on: str, weight: Cap | Attachment) -> tuple[float, int]:
    """Area (mm²) and number of the facets of a boundary at whose middles a load has weight (collective)."""
    facets = mesh.owned_facets(on)
    areas = facet_sizes(mesh, facets)
    loaded: Marks = np.zeros(0, dtype=bool)
    if len(facets):
        loaded = weight(dolfinx.mesh.compute_midpoints(mesh.domain, 2, facets).T) > 0
    area, count = mesh.comm.allreduce(np.array([areas @ loaded, np.count_nonzero(loaded)], dtype=float))
    return float(area), round(count)


def attachment(mesh: Mesh, name: str, on: str, place: Floats, radius: float) -> Attachment:
    """The weight of a muscle about the corner of a boundary that is nearest to its place (collective)."""
    known = corners(mesh, on)
    off = np.linalg.norm(known - place, axis=1)
    nearest = known[off.argmin()]
    if off.min() > TOO_FAR:
        raise InputError(
            f"the place of {name} is {off.min():.3g} mm from the boundary '{on}' of the femur's mesh: one within "
            f"{TOO_FAR:g} mm would be right"
        )
    x, y, z = nearest
    return Attachment(name, (float(x), float(y), float(z)), radius)


def _exterior(mesh: Mesh) -> Floats:
    """Where the corners of the surface are, as in `corners` (collective)."""
    mesh.domain.topology.create_connectivity(2, 3)
    facets = dolfinx.mesh.exterior_facet_indices(mesh.domain.topology)
    return _places(mesh, facets[facets < mesh.domain.topology.index_map(2).size_local])


def _places(mesh: Mesh, facets: Indices) -> Floats:
    topology = mesh.domain.topology
    topology.create_connectivity(2, 3)
    topology.create_connectivity(3, 2)
    nodes = dolfinx.mesh.entities_to_geometry(mesh.domain, 2, facets) if len(facets) else np.empty(0, np.int32)
    found = mesh.comm.allgather(mesh.domain.geometry.x[np.unique(nodes)])
    return np.unique(np.concatenate(found), axis=0)


def _cells(mesh: Mesh) -> tuple[Floats, Floats]:
    """Middles, (cells, 3), and volumes, (cells,), of the owned cells; volumes up to a factor."""
    middle = reference_corners(mesh.cell_name).mean(axis=0, keepdims=True)
    return positions(mesh, middle)[:, 0], volume_ratios(mesh, middle)[:, 0]


def _mean(mesh: Mesh, values: Floats, weights: Floats) -> Floats | None:
    """The mean of the owned cells' values, (cells, n), over all ranks; None where nothing has weight (collective)."""
    total = mesh.comm.allreduce(np.append(weights @ values, weights.sum()))
    return None if total[-1] == 0.0 else total[:-1] / total[-1]


# -- measures ----------------------------------------------------------------------------------------------------------


def _unit(vector: Floats) -> Floats:
    return np.asarray(vector / np.linalg.norm(vector))


def _sphere(nodes: Floats) -> tuple[Floats, float, float]:
    """Centre, radius and misfit of the sphere fitted to some points, in radii; InputError for what is no head."""
    start = nodes.mean(axis=0)
    away = nodes - start
    matrix = np.column_stack([2 * away, np.ones(len(nodes))])
    solution = np.linalg.lstsq(matrix, np.sum(away**2, axis=1), rcond=None)[0]
    centre = start + solution[:3]
    radius = float(np.sqrt(max(0.0, solution[3] + solution[:3] @ solution[:3])))
    off = np.abs(np.linalg.norm(nodes - centre, axis=1) - radius).max()
    if not (radius > 0 and off <= OFF_HEAD * radius):
        how = f"its nodes lie up to {off / radius:.0%} off the sphere fitted to them" if radius else "it is flat"
        raise InputError(f"the boundary 'head' is not round ({how}): the surface of the head alone would be right")
    if not RADII[0] <= radius <= RADII[1]:
        raise InputError(
            f"the head of the femur's mesh has a radius of {radius:.3g}: coordinates in mm, of a head of {RADII[0]:g} "
            f"to {RADII[1]:g} mm, would be right, since loads are in N and the material in MPa"
        )
    return centre, radius, float(off / radius)


def _lateral(centre: Floats, radius: float, trochanter: Floats) -> int:
    beside = float(trochanter[0] - centre[0])
    if abs(beside) < radius / 2:
        raise InputError(
            f"the boundary 'trochanter' of the femur's mesh is {abs(beside):.3g} mm beside the head along x: a mesh "
            "whose x axis points laterally or medially, y anteriorly and z superiorly would be right"
        )
    return 1 if beside > 0 else -1


def _shaft(
    mesh: Mesh, middles: Floats, volumes: Floats, centre: Floats, radius: float, low: float
) -> tuple[Floats, Floats]:
    """A point of the shaft's axis, and its slope for z = 1, from the middles of its cells (collective)."""
    top = centre[2] - SHAFT[0] * radius
    bottom = max(low + AT_THE_CUT * radius, centre[2] - SHAFT[1] * radius)
    height = middles[:, 2]
    weights = np.where((height > bottom) & (height < top), volumes, 0.0)
    point = _mean(mesh, middles, weights)
    if point is None or top - bottom < LEAST_SHAFT * radius:
        raise InputError(
            f"the femur's mesh ends {centre[2] - low:.3g} mm below the centre of its head, of radius {radius:.3g} mm: "
            f"{(SHAFT[0] + AT_THE_CUT + LEAST_SHAFT) * radius:.3g} mm at least would be right, for the shaft's axis"
        )
    away = middles - point
    moments = _mean(mesh, away * away[:, 2:], weights)
    assert moments is not None
    return point, moments / moments[2]


def _nearest_to_line(point: Floats, along: Floats, other: Floats, its_way: Floats) -> Floats:
    """The point of a line that is nearest to another line."""
    matrix = np.column_stack([along, -its_way])
    share = np.linalg.lstsq(matrix, other - point, rcond=None)[0][0]
    return np.asarray(point + share * along)


def refuse_without_names(mesh: Mesh) -> None:
    """Refuse a mesh that has not all of the boundaries that a femur's has, before anything is measured."""
    missing = [name for name in NAMES if name not in mesh.boundaries]
    problem = ""
    if missing:
        has = ", ".join(f"'{name}'" for name in mesh.boundaries) or "none"
        names = " and ".join(f"'{name}'" for name in missing)
        problem = (
            f"the femur's mesh has no boundary {names} (it has {has}): surfaces 'head', 'trochanter' and 'distal' "
            "would be right"
        )
    raise_on_all(mesh.comm, problem)
