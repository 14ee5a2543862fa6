"""Landmarks on the outline of a user's femur: its head, its greater trochanter, which side is medial, how it leans.

What cannot be told is refused, with what to give instead.  Lengths in mm; the y axis points proximally.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import dolfinx
import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components, depth_first_order
from scipy.spatial import KDTree

from growthx.common.checks import require_kind, require_number, require_vector
from growthx.common.errors import InputError, shown
from growthx.scenes.anatomy import (
    CONTROL_POINTS,
    OFF_HEAD,
    OFF_OUTLINE,
    Anatomy,
    Head,
    Insertion,
    along_outline,
    outline,
    own_anatomy,
    own_insertion,
)

if TYPE_CHECKING:
    from mpi4py import MPI

    from growthx.common.arrays import Floats, Indices
    from growthx.meshing.mesh import Mesh
    from growthx.model.loads import Position

SAME_OUTLINE = 0.5  # mm, within which a boundary's nodes are on our outline
EXTENTS = (20.0, 2000.0)  # mm, between which a human femur, or a part of one, is in one direction at least
RADII = (5.0, 100.0)  # mm, of a head
MOST_LEAN = 20.0  # degrees of the shaft from the y axis
HEAD_FITS = 0.02  # of its radius, the farthest that a node of the head lies off the circle fitted to it
FITTED_OFF = 0.05  # … that a facet under the joint's force may lie off it, straight as it is
LEAST_HEAD = 150.0  # degrees of arc that must be round
HEAD_NODES = 7
THINNED = 240  # nodes of an outline, among which the head is looked for
RIVAL = 0.75  # of the head's arc, at which another round part could be the head as well
PROMINENT = 0.05  # of the head's radius, by which a tip stands out
BELOW_OUTERMOST = 0.16  # of the way from the trochanter's tip to its most lateral point, that the insertion goes on
ARC_POINTS = 2001  # of an insertion
SAMPLES = 64  # of a facet, by which the length of a load is measured


# -- boundaries as lines of nodes --------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Sides:
    """The facets of a boundary, of all ranks.

    nodes: numbers of both ends, (facets, 2).  ends: where these are, (facets, 2, 2).
    """

    name: str
    nodes: Indices
    ends: Floats

    @property
    def places(self) -> Floats:
        """Where its nodes are, each once, shape (nodes, 2)."""
        _, first = np.unique(self.nodes.ravel(), return_index=True)
        return self.ends.reshape(-1, 2)[first]

    @property
    def middles(self) -> Floats:
        """Of the facets, shape (facets, 2)."""
        return np.asarray(self.ends.mean(axis=1))

    @property
    def lengths(self) -> Floats:
        """Of the facets, shape (facets,)."""
        return np.hypot(*(self.ends[:, 1] - self.ends[:, 0]).T)

    def sampled(self, samples: int) -> Floats:
        """Middles of equal parts of the facets, shape (facets, samples, 2)."""
        return _along(self.ends, samples)

    def stretches(self) -> list[Floats]:
        """The nodes of each connected stretch, anticlockwise, (nodes, 2), the longest first; of a loop one twice."""
        numbers, place = np.unique(self.nodes.ravel(), return_inverse=True)
        pairs, count = place.reshape(-1, 2), len(numbers)
        graph = coo_array((np.ones(len(pairs)), pairs.T), shape=(count, count)).tocsr()
        degree = np.bincount(pairs.ravel(), minlength=count)
        if degree.max() > 2:
            x, y = self.places[degree.argmax()]
            raise InputError(
                f"the boundary '{self.name}' branches at ({x:.4g}, {y:.4g}): a line along the outline would be right"
            )
        pieces, label = connected_components(graph, directed=False)
        places = self.places
        found = []
        for piece in range(pieces):
            nodes = np.flatnonzero(label == piece)
            # A line from one of its ends; a loop from its lowest node.
            start = nodes[np.lexsort((places[nodes, 1], degree[nodes]))[0]]
            order = depth_first_order(graph, start, directed=False, return_predecessors=False)
            line = places[order if degree[start] == 1 else np.append(order, start)]
            found.append(line if _area(line) > 0 else line[::-1])
        return sorted(found, key=lambda line: -float(np.hypot(*np.diff(line, axis=0).T).sum()))


def sides(mesh: Mesh, name: str) -> Sides:
    """The facets of a named boundary of a plane mesh, of all ranks (collective); InputError if there is none."""
    return _sides(mesh, name, mesh.boundary(name))


def rim(mesh: Mesh) -> Sides:
    """The facets around a plane mesh, of all ranks (collective), whatever names they have."""
    mesh.domain.topology.create_connectivity(1, 2)
    return _sides(mesh, "", dolfinx.mesh.exterior_facet_indices(mesh.domain.topology))


def _sides(mesh: Mesh, name: str, facets: Indices) -> Sides:
    nodes = _ends(mesh, facets)
    comm = mesh.comm
    numbers = mesh.domain.geometry.index_map().local_to_global(nodes.ravel().astype(np.int32))
    places = mesh.domain.geometry.x[nodes.ravel(), :2]
    return Sides(name, _of_all(comm, numbers.reshape(-1, 2)), _of_all(comm, places.reshape(-1, 4)).reshape(-1, 2, 2))


def loaded_length(mesh: Mesh, on: str, weight: Position) -> tuple[float, int]:
    """Length (mm) and number of facets of a boundary on which a load has weight, of all ranks (collective)."""
    ends = mesh.domain.geometry.x[_ends(mesh, mesh.boundary(on)), :2]
    x = np.zeros((3, len(ends) * SAMPLES))
    x[:2] = _along(ends, SAMPLES).reshape(-1, 2).T
    loaded = np.mean((weight(x) > 1e-9).reshape(-1, SAMPLES), axis=1)
    lengths = np.hypot(*(ends[:, 1] - ends[:, 0]).T)
    length, facets = _sum(mesh.comm, np.array([loaded @ lengths, np.count_nonzero(loaded)]))
    return float(length), round(facets)


def _ends(mesh: Mesh, facets: Indices) -> Indices:
    """Geometry nodes at both ends of those of some facets that this rank owns, shape (facets, 2)."""
    topology = mesh.domain.topology
    facets = facets[facets < topology.index_map(1).size_local]
    topology.create_connectivity(1, 2)
    topology.create_connectivity(2, 1)
    if not len(facets):
        return np.empty((0, 2), dtype=np.int32)
    return np.asarray(dolfinx.mesh.entities_to_geometry(mesh.domain, 1, facets))[:, :2]


def _along(ends: Floats, samples: int) -> Floats:
    share = (np.arange(samples) + 0.5)[:, np.newaxis] / samples
    return ends[:, :1] * (1 - share) + ends[:, 1:] * share


def _of_all(comm: MPI.Comm, rows: Floats) -> Floats:
    """The rows of all ranks, one after another (collective)."""
    counts = np.empty(comm.size, dtype=np.int64)
    comm.Allgather(np.array([rows.size], dtype=np.int64), counts)
    whole = np.empty((counts.sum() // rows.shape[1], rows.shape[1]), dtype=rows.dtype)
    comm.Allgatherv(np.ascontiguousarray(rows), [whole, counts])
    return whole


def _sum(comm: MPI.Comm, values: Floats) -> Floats:
    total = np.empty_like(values)
    comm.Allreduce(values, total)
    return total


# -- the whole of it ---------------------------------------------------------------------------------------------------


def find(mesh: Mesh, head: Any = None, trochanter: Any = None) -> Anatomy:
    """Where the hip's forces act on a user's femur (collective).

    head: centre and radius (x, y, r); None: of a circle fitted to the boundary "head", or to the round part of
        "surface".
    trochanter: both ends ((x, y), (x, y)) of the abductors' insertion on "surface"; None: the boundary "trochanter",
        or from the tip of the greater trochanter to its most lateral point.
    Raises InputError where they cannot be told.
    """
    distal = sides(mesh, "distal")
    _require_millimetres(mesh)
    known = {name: sides(mesh, name) for name in ("surface", "head", "trochanter") if name in mesh.boundaries}
    around = rim(mesh)
    lean = _lean(around, distal)
    medial = _own_side(around)
    if head is not None:
        circle = _given_head(head, known)
    elif "head" in known:
        circle = _named_head(known["head"])
    else:
        surface = _surface(known, "the head can be looked for, nor 'head'")
        circle = own_anatomy(medial).head if medial else _fitted_head(surface)
    given = None if trochanter is None else _given_ends(trochanter)
    circle = _with_side(circle, mesh, known, given)
    if given is not None:
        insertion = _between(given, _surface(known, "the ends of the abductors' insertion could be"))
    elif "trochanter" in known:
        insertion = _named_insertion(known["trochanter"])
    else:
        surface = _surface(known, "the abductors' insertion can be looked for, nor 'trochanter'")
        insertion = own_insertion(medial) if medial else _found_insertion(circle, lean, surface)
    return Anatomy(circle, insertion, lean * circle.medial, ours=medial != 0)


def _surface(known: dict[str, Sides], what: str) -> Sides:
    """The boundary "surface"; InputError, with what it is needed for, if there is none."""
    if "surface" not in known:
        raise InputError(f"the femur's mesh has no boundary 'surface' on which {what}: one of them would be right")
    return known["surface"]


def _require_millimetres(mesh: Mesh) -> None:
    """Refuse lengths that no femur has in mm."""
    spans = (_span(mesh.comm, mesh.domain.geometry.x[:, axis]) for axis in range(2))
    extent = max(high - low for low, high in spans)
    if not EXTENTS[0] <= extent <= EXTENTS[1]:
        unit = "as if in metres" if extent < 2 else "as if in another unit"
        raise InputError(
            f"the femur's mesh extends over {extent:.3g}, {unit}: coordinates in mm would be right, since the loads "
            "are in N and the material in MPa"
        )


def _lean(around: Sides, distal: Sides) -> float:
    """Angle of the shaft from the y axis to the x axis (degrees), by its middle some way from the distal end."""
    middles, lengths = around.middles, around.lengths
    start = np.average(distal.middles, axis=0, weights=distal.lengths)
    far = np.hypot(*(middles - start).T)
    shaft = (far > 0.2 * far.max()) & (far < 0.5 * far.max())
    x, y = np.average(middles[shaft], axis=0, weights=lengths[shaft]) - start
    lean = float(np.degrees(np.arctan2(x, y)))
    if abs(lean) > MOST_LEAN:
        raise InputError(
            f"the shaft of the femur's mesh leans by {abs(lean):.0f}° from the y axis: a mesh whose y axis points "
            "proximally would be right, since the forces have their angles from there"
        )
    return lean


def _own_side(around: Sides) -> int:
    """1 where the whole outline is growthx's own, −1 where it is the mirror image of that, else 0."""
    own = outline()
    cut = own[-1] + np.linspace(0, 1, 101)[:, np.newaxis] * (own[0] - own[-1])
    curve = KDTree(np.concatenate([along_outline(0, CONTROL_POINTS - 1, 4001), cut]))
    line = KDTree(around.sampled(16).reshape(-1, 2))
    for medial in (1, -1):
        off = curve.query(around.places * (medial, 1))[0].max()
        uncovered = line.query(own * (medial, 1))[0].max()
        if off < SAME_OUTLINE and uncovered < OFF_OUTLINE:
            return medial
    return 0


# -- the head ----------------------------------------------------------------------------------------------------------


def _given_head(head: Any, known: dict[str, Sides]) -> Head:
    x, y, radius = _numbers(head, 3, "the head", "its centre x, y and radius in mm")
    require_number(radius, "the radius of the head (mm)", "a positive number", lambda r: r > 0)
    return Head(x, y, radius, on="surface" if "surface" in known else "head", how="as it was given")


def _named_head(boundary: Sides) -> Head:
    nodes = boundary.places
    circle = _circle(nodes) if len(nodes) > 3 else None
    if circle is None or circle[3] > OFF_HEAD:
        how = "its nodes are on no circle" if circle is None else f"its nodes lie up to {circle[3]:.0%} off its circle"
        raise InputError(f"the boundary 'head' is not round ({how}): the head alone, or its centre and radius, is due")
    return Head(*circle[:3], on="head", how=f"fitted to the boundary 'head' to {circle[3]:.2g} of its radius")


def _fitted_head(surface: Sides) -> Head:
    """The head as the round part of the outline; InputError if there is none, or more than one that could be it."""
    cure = "its centre and radius (--head X Y R) or a boundary 'head' would be right"
    longest, *others = surface.stretches()
    lines = [longest, *(line for line in others if not np.array_equal(line[0], line[-1]))]  # without holes
    arcs = [arc for line in lines for arc in _round_arcs(line)]
    if not arcs:
        raise InputError(
            f"no part of 'surface' is round like a head, {LEAST_HEAD:.0f}° of a circle to {HEAD_FITS:.0%}: {cure}"
        )
    arcs.sort(key=lambda arc: -arc.score)
    if len(arcs) > 1 and arcs[1].score > RIVAL * arcs[0].score:
        places = " and ".join(f"({arc.x:.4g}, {arc.y:.4g})" for arc in arcs[:2])
        raise InputError(f"'surface' is round about {places}, each of which could be the head: {cure}")
    best = arcs[0]
    how = f"fitted to {best.degrees:.0f}° of 'surface' to {best.misfit:.2g} of its radius"
    return Head(best.x, best.y, best.radius, how=how, off=FITTED_OFF)


@dataclass(frozen=True)
class _RoundArc:
    """A stretch of the outline with the circle fitted to it; misfit: farthest off, in radii."""

    x: float
    y: float
    radius: float
    misfit: float
    degrees: float
    score: float


def _round_arcs(line: Floats) -> list[_RoundArc]:
    """The roundest stretch of a line of nodes that can be a head, and the next that has no node in common with it."""
    thin = np.unique(np.linspace(0, len(line) - 1, min(len(line), THINNED)).round().astype(int))
    firsts, lasts, scores = _scores(line[thin])
    found: list[_RoundArc] = []
    taken = np.zeros(len(line), dtype=bool)
    for _ in range(2):
        if not len(scores):
            break
        best = scores.argmax()
        first, last = thin[firsts[best]], thin[lasts[best]]
        nodes = line[first : last + 1]
        if (circle := _circle(nodes)) is not None and circle[3] <= HEAD_FITS:
            degrees = _swept(nodes, circle)
            if degrees >= LEAST_HEAD:
                found.append(_RoundArc(*circle, degrees, float(scores[best])))
        taken[first : last + 1] = True
        apart = (thin[lasts] < first) | (thin[firsts] > last)
        firsts, lasts, scores = firsts[apart], lasts[apart], scores[apart]
    return found


def _scores(line: Floats) -> tuple[Indices, Indices, Floats]:
    """First and last node and score of all stretches of a line that can be a head.

    The score is the angle of arc, less where its nodes are farther off the circle: a longer stretch that leaves the
    head for the neck is worse than the head alone.
    """
    found = []
    middle = (line[:, 1].min() + line[:, 1].max()) / 2
    for first in range(len(line) - HEAD_NODES + 1):
        points = line[first:]
        x, y, radius = _algebraic_circles(points)
        off = np.abs(np.hypot(points[:, 0] - x[:, np.newaxis], points[:, 1] - y[:, np.newaxis]) - radius[:, np.newaxis])
        off[np.arange(len(points)) > np.arange(len(points))[:, np.newaxis]] = 0.0
        misfit = off.max(axis=1) / radius
        crosses = np.append(0.0, np.cumsum(points[:-1, 0] * points[1:, 1] - points[1:, 0] * points[:-1, 1]))
        chord = points - points[0]
        degrees = np.degrees((crosses - (x * chord[:, 1] - y * chord[:, 0])) / radius**2)
        with np.errstate(invalid="ignore"):
            good = (misfit < HEAD_FITS) & (degrees > LEAST_HEAD) & (degrees < 360.0) & (y > middle)
        good[: HEAD_NODES - 1] = False
        last = np.flatnonzero(good)
        found.append((np.full(len(last), first), first + last, degrees[last] * (1 - (misfit[last] / HEAD_FITS) ** 2)))
    if not found:
        return np.empty(0, dtype=int), np.empty(0, dtype=int), np.empty(0)
    firsts, lasts, scores = (np.concatenate(column) for column in zip(*found, strict=True))
    return firsts, lasts, scores


def _algebraic_circles(points: Floats) -> tuple[Floats, Floats, Floats]:
    """Centres and radii of the circles through the first 1, 2, … points by least squares in r² (Kåsa's); NaN: none."""
    origin = points.mean(axis=0)
    x, y = (points - origin).T
    z = x**2 + y**2
    count = np.arange(1, len(points) + 1)

    def sums(values: Floats) -> Floats:
        return np.cumsum(values) / count

    mx, my, mz = sums(x), sums(y), sums(z)
    xx, xy, yy = sums(x * x) - mx**2, sums(x * y) - mx * my, sums(y * y) - my**2
    xz, yz = sums(x * z) - mx * mz, sums(y * z) - my * mz
    det = xx * yy - xy**2
    with np.errstate(invalid="ignore", divide="ignore"):
        det = np.where(det > 1e-9 * (xx + yy) ** 2, det, np.nan)
        a, b = (xz * yy - yz * xy) / (2 * det), (yz * xx - xz * xy) / (2 * det)
        radius = np.sqrt(mz - 2 * (a * mx + b * my) + a**2 + b**2)
    return a + origin[0], b + origin[1], radius


def _circle(points: Floats) -> tuple[float, float, float, float] | None:
    """Centre x, y, radius and misfit of the circle through points by least squares of distances; None: on a line."""
    x, y, radius = (float(values[-1]) for values in _algebraic_circles(points))
    if not np.isfinite(radius):
        return None
    for _ in range(20):  # Gauss and Newton's iterations
        to = points - (x, y)
        distance = np.hypot(*to.T)
        if not distance.min() > 0:
            return None
        rows = np.column_stack([-to / distance[:, np.newaxis], -np.ones(len(points))])
        step = np.linalg.lstsq(rows, radius - distance, rcond=None)[0]
        x, y, radius = x + step[0], y + step[1], radius + step[2]
    misfit = float(np.abs(np.hypot(*(points - (x, y)).T) - radius).max() / abs(radius))
    return (float(x), float(y), float(radius), misfit) if radius > 0 and np.isfinite(misfit) else None


def _swept(nodes: Floats, circle: tuple[float, float, float, float]) -> float:
    """Angle about the circle's centre from the first to the last of the nodes, anticlockwise (degrees)."""
    to = nodes - circle[:2]
    angles = np.unwrap(np.arctan2(to[:, 1], to[:, 0]))
    return float(np.degrees(angles[-1] - angles[0]))


def _area(line: Floats) -> float:
    """Twice the area that a line and the chord between its ends go round anticlockwise."""
    x, y = (line - line[0]).T
    return float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def _with_side(head: Head, mesh: Mesh, known: dict[str, Sides], ends: Floats | None) -> Head:
    """The head with the side that is medial: away from the trochanter, or from what else is at the head's height."""
    if not RADII[0] <= head.radius <= RADII[1]:
        raise InputError(
            f"the femur's head has a radius of {head.radius:.3g}, {head.how}: coordinates in mm would be right, since "
            "the loads are in N and the material in MPa"
        )
    if ends is not None or "trochanter" in known:
        lateral = float((known["trochanter"].places if ends is None else ends)[:, 0].mean())
        away = head.x - lateral
    else:
        x = mesh.domain.geometry.x
        x = x[x[:, 1] > head.y - 2 * head.radius, 0]
        low, high = _span(mesh.comm, x)
        away = (head.x - low) - (high - head.x)
    if abs(away) < head.radius / 2:
        raise InputError(
            f"which side of the femur is medial cannot be told from its head about ({head.x:.4g}, {head.y:.4g}): the "
            "head's own circle, and the trochanter's place or a boundary 'trochanter', would be right"
        )
    return replace(head, medial=1 if away > 0 else -1)


def _span(comm: MPI.Comm, x: Floats) -> tuple[float, float]:
    """Least and largest of the values of all ranks."""
    spans = _of_all(comm, np.array([[x.min(initial=np.inf), x.max(initial=-np.inf)]]))
    return float(spans[:, 0].min()), float(spans[:, 1].max())


# -- the abductors' insertion ------------------------------------------------------------------------------------------


def _numbers(values: Any, count: int, what: str, wanted: str) -> tuple[float, ...]:
    numbers = require_vector(values, what)
    if len(numbers) != count:
        raise InputError(f"{what} is {shown(values)}: {wanted} would be right")
    return numbers


def _given_ends(trochanter: Any) -> Floats:
    """Both ends of the insertion, shape (2, 2)."""
    what, wanted = "the trochanter", "two places (x, y) in mm, the ends of the abductors' insertion,"
    require_kind(trochanter, (tuple, list, np.ndarray), what, wanted)
    if len(trochanter) != 2:
        raise InputError(f"{what} is {shown(trochanter)}: {wanted} would be right")
    return np.array([_numbers(end, 2, f"an end of {what}", "a place (x, y) in mm") for end in trochanter])


def _between(ends: Floats, surface: Sides) -> Insertion:
    """The stretch of "surface" between the nodes nearest to two places."""
    for line in surface.stretches():
        distance, (first, last) = KDTree(line).query(ends)
        if distance.max() <= np.hypot(*np.diff(line, axis=0).T).max() and abs(first - last) > 1:
            first, last = sorted((first, last))
            return _insertion(line[first : last + 1], "surface", "between the ends that were given")
    places = " and ".join(f"({x:.4g}, {y:.4g})" for x, y in ends)
    raise InputError(
        f"the ends {places} of the abductors' insertion are not on one stretch of 'surface', some facets apart: places "
        "on it would be right"
    )


def _insertion(line: Floats, on: str, how: str, ends: tuple[float, float] = (0.0, 1.0)) -> Insertion:
    """The insertion on a line of nodes, all of it or between two shares of its length."""
    lengths = np.hypot(*np.diff(line, axis=0).T)
    along = np.append(0.0, np.cumsum(lengths))
    places = np.linspace(*ends, ARC_POINTS) * along[-1]
    arc = np.column_stack([np.interp(places, along, line[:, axis]) for axis in range(2)])
    return Insertion(arc, reach=float(lengths.max() / 2), on=on, how=how)


def _named_insertion(boundary: Sides) -> Insertion:
    lines = boundary.stretches()
    if len(lines) > 1:
        raise InputError(f"the boundary 'trochanter' is in {len(lines)} pieces: one stretch would be right")
    return _insertion(lines[0], "trochanter", "the boundary 'trochanter'")


def _upright(lean: float) -> Floats:
    """Rotation that takes an axis that leans from the y axis to the x axis by some degrees to the y axis."""
    c, s = np.cos(np.radians(lean)), np.sin(np.radians(lean))
    return np.array([[c, -s], [s, c]])


def _found_insertion(head: Head, lean: float, surface: Sides) -> Insertion:
    """From the tip of the greater trochanter, along the outline, to a little below the most lateral point.

    Both must stand out and lie where a femur has them as seen from the head, upright, or the insertion is refused.
    """
    from scipy.signal import find_peaks

    for line in surface.stretches():
        line = line[:: head.medial]  # from the medial side by the head to the lateral one
        x, y = _upright(lean) @ (line - (head.x, head.y)).T / head.radius
        x = head.medial * x
        tips = find_peaks(y, prominence=PROMINENT)[0]
        tips = tips[(x[tips] < -1.2) & (x[tips] > -4.0) & (np.abs(y[tips]) < 1.5)]
        outermost = find_peaks(-x, prominence=PROMINENT)[0]
        for tip in tips[np.argsort(-y[tips])]:
            ends = outermost[(outermost > tip + 1) & (y[outermost] > y[tip] - 3.0) & (y[outermost] < y[tip])]
            if len(ends):
                return _from_tip(line, y, tip, -x, ends[0])
    raise InputError(
        "the greater trochanter cannot be told on 'surface', a tip beside the neck and a most lateral point below it: "
        "the ends of the abductors' insertion (--trochanter X Y X Y) or a boundary 'trochanter' would be right"
    )


def _from_tip(line: Floats, height: Floats, tip: int, laterally: Floats, outermost: int) -> Insertion:
    """The insertion on a line between two of its nodes, and a part of that farther, as far as on our outline."""
    along = np.append(0.0, np.cumsum(np.hypot(*np.diff(line, axis=0).T)))
    start, stop = _summit(along, height, tip), _summit(along, laterally, outermost)
    stop = min(stop + BELOW_OUTERMOST * (stop - start), along[-1])
    how = "from the greater trochanter's tip to below its most lateral point, as found on 'surface'"
    return _insertion(line, "surface", how, (start / along[-1], stop / along[-1]))


def _summit(along: Floats, values: Floats, node: int) -> float:
    """Where the parabola through a largest value and its neighbours has its summit."""
    s, v = along[node - 1 : node + 2] - along[node], values[node - 1 : node + 2]
    curvature, slope, _ = np.polyfit(s, v, 2)
    return float(along[node] + (np.clip(-slope / (2 * curvature), s[0], s[2]) if curvature < 0 else 0.0))
