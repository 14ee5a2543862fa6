"""The proximal femur under the daily loads of walking and of extreme ab- and adduction (the paper's section 6).

Units: N, mm, MPa, g/cm³.  y points proximally, and on our own outline x points medially.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI

from growthx.common.checks import require_kind, require_number
from growthx.common.errors import InputError, raise_on_all, shown
from growthx.common.renamed import renamed
from growthx.constitutive.growth import EnergyDrivenGrowth
from growthx.constitutive.material import Material
from growthx.meshing import files
from growthx.meshing.mesh import Mesh
from growthx.model.loads import DistributedForce, LoadCase
from growthx.model.program import Program
from growthx.model.scene import Scene
from growthx.model.supports import Support
from growthx.scenes.anatomy import (
    Anatomy,
    Insertion,
    JointArc,
    outline,
    own_anatomy,
    own_insertion,
    own_zones,
    zones,
    zones_of,
)
from growthx.scenes.landmarks import find, loaded_length

if TYPE_CHECKING:
    from growthx.common.arrays import Floats

__all__ = ["LOAD_CASES", "Femur", "abductor_weight", "combination", "femur", "loaded_arcs", "outline", "zones"]

PAPER_SIZE = 3.5  # mm, of cells as many as the paper's
LEAST_FACETS = 3  # that a force must act on
LEAST_ARC = 0.8  # of the length that a force should act on
FOREIGN_ZONES = (
    "the outline is not growthx's own, for which its zones are polygons in mm: a CSV file of your own polygons "
    "(--zones) has their mean densities told"
)


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


@dataclass(frozen=True, repr=False)
class Femur(Scene):
    """A scene with what it knows of its femur.

    anatomy: where the hip's forces act.  zones: polygons by name, shape (corners, 2), whose mean densities can be told;
    none where they would not be meant.  thickness: of the plane model (mm).

    Example:
        >>> scene = gx.scenes.femur()
        >>> isinstance(scene, gx.scenes.Femur), len(scene.zones), scene.thickness
        (True, 10, 30.0)
    """

    anatomy: Anatomy = field(default_factory=own_anatomy)
    zones: Mapping[str, Floats] = MappingProxyType({})
    thickness: float = 30.0


@renamed(cells="shape")
def femur(
    mesh: Mesh | str | Path | None = None,
    *,
    head: tuple[float, float, float] | None = None,
    trochanter: tuple[tuple[float, float], tuple[float, float]] | None = None,
    zones: str | Path | Mapping[str, Any] | None = None,
    shape: str = "quadrilateral",
    size: float | None = None,
    refine: int = 1,
    thickness: float = 30.0,
    weights: tuple[float, float, float] = AVERAGE,
    separate: bool = False,
    n: float = 2.0,
    m: float = 3.0,
    step: float = 4.0,
    until: float = 160.0,
    trusted: bool = False,
    comm: MPI.Comm = MPI.COMM_WORLD,
) -> Femur:
    """The femur, fixed at its distal end and loaded by the weighted sum of the three load cases.

    mesh: a plane Mesh, or a file of one as `meshing.read` takes it, in mm, y proximal, left or right, with a boundary
    "distal" and "surface", or "head" and "trochanter", or all; default: our own outline, in 658 quadrilaterals as in
    the paper unless `shape` is "triangle" or a `size` of cells (mm) is asked for.
    head: centre and radius (x, y, r) of the mesh's; default: of a circle fitted to "head", or to what is round of
    "surface".  trochanter: both ends of the abductors' insertion on "surface"; default: the boundary "trochanter", or
    the lateral side of the greater trochanter, which is looked for.  On our own outline both are known.
    zones: polygons by name whose mean densities are of interest, or a CSV file with the columns zone, x_mm and y_mm;
    default: the anatomical zones of our own outline, or of its mirror image, and none on another.
    refine: every cell is split into refine × refine.
    thickness: of the plane model (mm).  weights: of the load cases, `AVERAGE`, `SUPERPOSED` or your own.
    separate: each load case has its own displacement under its full forces, and the density is driven by the mean of
    their energies, weighted; otherwise one displacement is that of the weighted sum of the forces.
    n, m: exponents of density.  step, until: Δt and end of the march; the load ramps over five steps.
    trusted: let a script of the mesh run programs and write files, see `meshing.read`.
    Raises InputError where the head or the trochanter cannot be told, or do not lie on the boundary.

    Example:
        >>> scene = gx.scenes.femur(step=8.0, until=40.0)
        >>> scene.mesh.cell_count, len(scene.loads), scene.program.until
        (658, 6, 40.0)
    """
    require_number(thickness, "the thickness (mm)", "a positive number", lambda h: h > 0)
    _check_weights(weights)
    require_kind(separate, bool, "separate, of the load cases,", "True or False")
    program = Program(step=step, until=until)
    used = [(case, weight) for case, weight in zip(LOAD_CASES, weights, strict=True) if weight > 0]
    if not used:
        raise InputError("no load case of the femur has a weight: one above 0 would be right")
    mesh, where = _mesh_and_anatomy(mesh, head, trochanter, shape, size, refine, trusted, comm)
    scene = Femur(
        name="femur",
        mesh=mesh,
        material=Material(young=500.0, poisson=0.2, reference_density=1.2, density_exponent=n),
        growth=EnergyDrivenGrowth(attractor=0.01, rate=1.0, exponent=m),
        supports=(Support("distal"),),
        loads=() if separate else tuple(force for case, w in used for force in _forces(case, w / thickness, where)),
        cases=tuple(LoadCase(case.name, w, _forces(case, 1 / thickness, where)) for case, w in used if separate),
        program=replace(program, ramp=5 * step),
        anatomy=where,
        zones=MappingProxyType(_zones(mesh, where, zones)),
        thickness=thickness,
    )
    loaded_arcs(scene)
    return scene


def _check_weights(weights: Any) -> None:
    if not isinstance(weights, (tuple, list)) or len(weights) != len(LOAD_CASES):
        raise InputError(
            f"the weights of the load cases are {shown(weights)}: {len(LOAD_CASES)} numbers would be right"
        )
    for weight in weights:
        require_number(weight, "the weight of a load case", "a number of at least 0", lambda w: w >= 0)


def _mesh_and_anatomy(
    mesh: Mesh | str | Path | None,
    head: Any,
    trochanter: Any,
    cells: str,
    size: float | None,
    refine: int,
    trusted: bool,
    comm: Any,
) -> tuple[Mesh, Anatomy]:
    if mesh is None:
        for name, given in (("head", head), ("trochanter", trochanter)):
            if given is not None:
                raise InputError(
                    f"the {name} is {shown(given)}, for a mesh that is not given: the built-in outline has its own"
                )
        if trusted:
            raise InputError(
                "trusted is True, for a mesh that is not given: the built-in outline is no stranger's, and "
                "False would be right"
            )
        return _own_mesh(cells, size, refine, comm), own_anatomy()
    if not isinstance(mesh, Mesh):
        mesh = files.read(mesh, refine=refine, trusted=trusted, comm=comm)
    if mesh.dim != 2:
        raise InputError(
            f"the femur's mesh has cells of the shape {mesh.cell_name}, and its scene is plane: quadrilaterals or "
            "triangles would be right"
        )
    return mesh, find(mesh, head, trochanter)


def _zones(mesh: Mesh, where: Anatomy, given: str | Path | Mapping[str, Any] | None) -> dict[str, Floats]:
    """The polygons of the user, or our own where they are meant."""
    if given is None:
        return own_zones(where.head.medial) if where.ours else {}
    found: dict[str, Floats] = {}
    problem = ""
    try:
        found = zones_of(given)
    except InputError as error:  # of a file, perhaps, that only some ranks can read
        problem = str(error)
    raise_on_all(mesh.comm, problem)
    from growthx.post.zones import require_overlap  # not above: most runs have no zones to look at before their end

    require_overlap(mesh, found)
    return found


def _own_mesh(cells: str, size: float | None, refine: int, comm: MPI.Comm) -> Mesh:
    """The outline's mesh: by default the one with the paper's counts, which gmsh's versions do not agree on."""
    triangles = files.triangles(cells)
    if size is None and not triangles:
        return files.read(files.locate("femur_658.msh"), refine=refine, comm=comm)
    size = PAPER_SIZE if size is None else size
    require_number(size, "the cell size (mm)", "a positive number", lambda h: h > 0)
    return files.read(files.locate("femur.geo"), refine=refine, comm=comm, size=size, triangles=triangles)


def _forces(case: HipForces, factor: float, where: Anatomy) -> tuple[DistributedForce, DistributedForce]:
    head, insertion = where.head, where.insertion

    def force(components: tuple[float, float]) -> tuple[float, ...]:
        return factor * head.medial * components[0], factor * components[1]

    arc = JointArc(head, case.joint_angle)
    return (
        DistributedForce(head.on, force(case.joint_force), arc, case.name),
        DistributedForce(insertion.on, force(case.abductor_force), insertion, case.name),
    )


def abductor_weight(x: Floats) -> Floats:
    """Half a sine along the arc of the abductors' insertion on our own outline, at points x of shape (3, points)."""
    return own_insertion()(x)


@dataclass(frozen=True)
class LoadedArc:
    """Where a force of the hip acts.

    case: its load case.  force: "joint" or "abductor".  on: the boundary.  newtons: its size under the case's weight.
    length: of boundary on which it has weight (mm).
    """

    case: str
    force: str
    on: str
    newtons: float
    length: float


def loaded_arcs(scene: Femur) -> list[LoadedArc]:
    """On which length each force of a femur acts, in the order of its loads (collective)."""
    forces = (load for load in scene.dead_loads if isinstance(load, DistributedForce))
    return [_loaded_arc(scene, load, load.weight) for load in forces if isinstance(load.weight, (JointArc, Insertion))]


def _loaded_arc(scene: Femur, load: DistributedForce, weight: JointArc | Insertion) -> LoadedArc:
    """The arc of one force; InputError where it has too little of it."""
    kind = "joint" if isinstance(weight, JointArc) else "abductor"
    length, facets = loaded_length(scene.mesh, load.on, weight)
    if facets < LEAST_FACETS or length < LEAST_ARC * weight.length:
        place = f"the head, {weight.head}" if isinstance(weight, JointArc) else f"its insertion, {weight}"
        raise InputError(
            f"the {kind} force of {load.case} would act on {facets} facets and {length:.3g} of {weight.length:.3g} mm "
            f"of arc on '{load.on}', for {place}: places on the boundary, of the mesh's own head and trochanter, and "
            f"{LEAST_FACETS} facets at least would be right"
        )
    return LoadedArc(load.case, kind, load.on, math.hypot(*load.force) * scene.thickness, length)


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
