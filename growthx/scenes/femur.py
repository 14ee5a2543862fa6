"""The proximal femur under the daily loads of walking and of extreme ab- and adduction (the paper's section 6).

Units: N, mm, MPa, g/cm³.  x points medially, y proximally.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from mpi4py import MPI
from scipy.interpolate import CubicSpline
from scipy.spatial import KDTree

from growthx import meshing
from growthx.errors import InputError, require_kind, require_number, shown
from growthx.growth import EnergyDrivenGrowth
from growthx.loads import DistributedForce, LoadCase, Position
from growthx.material import Material
from growthx.mesh import Mesh
from growthx.scene import Program, Scene
from growthx.supports import Support

if TYPE_CHECKING:
    from growthx.arrays import Floats

HEAD_CENTRE = (43.0, 132.0)
JOINT_HALF_ARC = np.radians(35.0)
CONTROL_POINTS = 63  # of the outline
ABDUCTOR_INSERTION = (45, 52)  # of them
PAPER_SIZE = 3.5  # mm, of cells as many as the paper's
OFF_OUTLINE = 3.0  # mm that a straight facet may lie off the outline's spline


@dataclass(frozen=True)
class HipForces:
    """Hip joint force on the head and abductor force on the greater trochanter (N), with angles from the vertical."""

    name: str
    joint: float
    joint_angle: float  # degrees
    abductor: float
    abductor_angle: float  # degrees

    @property
    def joint_force(self) -> tuple[float, float]:
        """−F (sin a, cos a): down onto the head."""
        a = np.radians(self.joint_angle)
        return -self.joint * float(np.sin(a)), -self.joint * float(np.cos(a))

    @property
    def abductor_force(self) -> tuple[float, float]:
        """+F (sin b, cos b): up at the trochanter."""
        b = np.radians(self.abductor_angle)
        return self.abductor * float(np.sin(b)), self.abductor * float(np.cos(b))


LOAD_CASES = (
    HipForces("midstance of gait", 2317.0, 24.0, 703.0, 28.0),
    HipForces("extreme abduction", 1158.0, -15.0, 351.0, -8.0),
    HipForces("extreme adduction", 1548.0, 56.0, 468.0, 35.0),
)
# How the cases share one displacement field: by their part of the daily cycles, or summed.
AVERAGE = (0.6, 0.2, 0.2)
SUPERPOSED = (1.0, 1.0, 1.0)


def femur(
    mesh: Mesh | str | Path | None = None,
    *,
    cells: str = "quadrilateral",
    size: float | None = None,
    refine: int = 1,
    thickness: float = 30.0,
    weights: tuple[float, float, float] = AVERAGE,
    separate: bool = False,
    n: float = 2.0,
    m: float = 3.0,
    step: float = 4.0,
    until: float = 160.0,
    comm: MPI.Comm = MPI.COMM_WORLD,
) -> Scene:
    """The femur, fixed at its distal end and loaded by the weighted sum of the three load cases.

    mesh: a Mesh or a .geo or .msh file in mm with boundaries "surface" and "distal"; default: our own outline, in 658
    quadrilaterals as in the paper unless `cells` is "triangle" or a `size` of cells (mm) is asked for.
    refine: every cell is split into refine × refine.
    thickness: of the plane model (mm).  weights: of the load cases, `AVERAGE`, `SUPERPOSED` or your own.
    separate: each load case has its own displacement under its full forces, and the density is driven by the mean of
    their energies, weighted; otherwise one displacement is that of the weighted sum of the forces.
    n, m: exponents of density.  step, until: Δt and end of the march; the load ramps over five steps.
    """
    require_number(thickness, "the thickness (mm)", "a positive number", lambda h: h > 0)
    if not isinstance(weights, (tuple, list)) or len(weights) != len(LOAD_CASES):
        raise InputError(
            f"the weights of the load cases are {shown(weights)}: {len(LOAD_CASES)} numbers would be right"
        )
    for weight in weights:
        require_number(weight, "the weight of a load case", "a number of at least 0", lambda w: w >= 0)
    require_kind(separate, bool, "separate, of the load cases,", "True or False")
    program = Program(step=step, until=until)
    used = [(case, weight) for case, weight in zip(LOAD_CASES, weights, strict=True) if weight > 0]
    if mesh is None:
        mesh = _own_mesh(cells, size, refine, comm)
    elif not isinstance(mesh, Mesh):
        mesh = meshing.read(mesh, refine=refine, comm=comm)
    return Scene(
        name="femur",
        mesh=mesh,
        material=Material(young=500.0, poisson=0.2, reference_density=1.2, density_exponent=n),
        growth=EnergyDrivenGrowth(attractor=0.01, rate=1.0, exponent=m),
        supports=(Support("distal"),),
        loads=() if separate else tuple(force for case, w in used for force in _forces(case, w / thickness)),
        cases=tuple(LoadCase(case.name, w, _forces(case, 1 / thickness)) for case, w in used if separate),
        program=replace(program, ramp=5 * step),
    )


def _own_mesh(cells: str, size: float | None, refine: int, comm: MPI.Comm) -> Mesh:
    """The outline's mesh: by default the one with the paper's counts, which gmsh's versions do not agree on."""
    triangles = meshing.triangles(cells)
    if size is None and not triangles:
        return meshing.read(meshing.locate("femur_658.msh"), refine=refine, comm=comm)
    size = PAPER_SIZE if size is None else size
    require_number(size, "the cell size (mm)", "a positive number", lambda h: h > 0)
    return meshing.read(meshing.locate("femur.geo"), refine=refine, comm=comm, size=size, triangles=triangles)


def _forces(case: HipForces, factor: float) -> tuple[DistributedForce, DistributedForce]:
    joint = tuple(factor * component for component in case.joint_force)
    abductor = tuple(factor * component for component in case.abductor_force)
    return (
        DistributedForce("surface", joint, _joint_weight(case), case.name),
        DistributedForce("surface", abductor, abductor_weight, case.name),
    )


def _joint_weight(case: HipForces) -> Position:
    """Cosine over ±35° of the head's arc about the direction the force comes from."""
    centre = np.radians(90.0 - case.joint_angle)

    def weight(x: Floats) -> Floats:
        angle = np.arctan2(x[1] - HEAD_CENTRE[1], x[0] - HEAD_CENTRE[0]) - centre
        angle = (angle + np.pi) % (2 * np.pi) - np.pi
        return np.where(np.abs(angle) < JOINT_HALF_ARC, np.cos(np.pi / 2 * angle / JOINT_HALF_ARC), 0.0)

    return weight


def abductor_weight(x: Floats) -> Floats:
    """Half a sine along the arc of the abductors' insertion, at points x of shape (3, points)."""
    arc, share = _insertion()
    distance, nearest = arc.query(x[:2].T)
    return np.where(distance < OFF_OUTLINE, np.sin(np.pi * share[nearest]), 0.0)


@cache
def outline() -> Floats:
    """Control points of the outline, anticlockwise from the distal medial corner, shape (63, 2), mm."""
    points = np.array([place for _, place in _places("femur_outline.csv", "index")])
    if len(points) != CONTROL_POINTS:
        raise InputError(
            f"growthx's own file femur_outline.csv has {len(points)} rows: a copy with {CONTROL_POINTS} is due"
        )
    return points


def _places(name: str, key: str) -> list[tuple[str, tuple[float, float]]]:
    """The rows of one of growthx's own tables, each a key with a place (mm); InputError if the file is damaged."""
    path = meshing.locate(name)
    try:
        with path.open(newline="", encoding="utf-8") as file:
            rows = [(row[key], (float(row["x_mm"]), float(row["y_mm"]))) for row in csv.DictReader(file)]
    except (OSError, KeyError, TypeError, ValueError, csv.Error) as error:
        raise InputError(f"growthx's own file {path} is damaged ({shown(error)}): a new copy would be right") from error
    if not rows or not np.all(np.isfinite([place for _, place in rows])):
        raise InputError(f"growthx's own file {path} is damaged (numbers are missing): a new copy would be right")
    return rows


@cache
def _insertion() -> tuple[KDTree, Floats]:
    """Points on the abductors' insertion, and their share of its arc length from 0 to 1."""
    points = outline()
    spline = CubicSpline(np.arange(len(points)), points)
    arc = spline(np.linspace(*ABDUCTOR_INSERTION, 2001))
    length = np.append(0.0, np.cumsum(np.hypot(*np.diff(arc, axis=0).T)))
    return KDTree(arc), length / length[-1]


@cache
def zones() -> dict[str, Floats]:
    """Polygons of anatomical zones by name, shape (corners, 2), mm."""
    corners: dict[str, list[tuple[float, float]]] = {}
    for zone, place in _places("femur_zones.csv", "zone"):
        corners.setdefault(zone, []).append(place)
    return {name: np.array(polygon) for name, polygon in corners.items()}


@dataclass(frozen=True)
class Combination:
    """A way to combine the load cases: their weights, and whether each has a displacement of its own."""

    weights: tuple[float, float, float]
    separate: bool = False


COMBINATIONS = {
    "average": Combination(AVERAGE),
    "superposed": Combination(SUPERPOSED),
    "stimulus": Combination(AVERAGE, separate=True),
}


def combination(name: str) -> Combination:
    """The combination of that name; InputError if there is none."""
    if name not in COMBINATIONS:
        raise InputError(f"there is no load combination '{name}': one of {', '.join(COMBINATIONS)} would be right")
    return COMBINATIONS[name]
