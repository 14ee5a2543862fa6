"""The proximal femur in space under the hip's daily loads.

Units: N, mm, MPa, g/cm³.  The head's centre of our own is the origin; x points laterally on a right femur and medially
on a left one, y anteriorly, z superiorly.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI

from growthx.common.checks import require_each, require_flag, require_number
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
from growthx.scenes.anatomy import zones_of
from growthx.scenes.hip import ACTIVITIES, DAILY, Activity, Muscle, abductors
from growthx.scenes.solid_anatomy import (
    Attachment,
    Cap,
    SolidAnatomy,
    attachment,
    loaded_area,
    measure,
    refuse_without_names,
    zones_of_bone,
)

if TYPE_CHECKING:
    from growthx.common.arrays import Floats

__all__ = ["ACTIVITIES", "DAILY", "Activity", "Femur3d", "Muscle", "abductors", "femur3d", "loaded_areas"]

BODY_WEIGHT = 735.75  # N, of 75 kg
WEIGHTS = (150.0, 5000.0)  # N, of bodies
LEAST_FACETS = 3  # that a force must act on
# E at ρ* is that of cortical bone; the attractor is chosen so that cortices and canal come to the densities that they
# have.  The bounds are those of a marrow that still bears something, and of solid bone.
MATERIAL = {"young": 17000.0, "poisson": 0.3, "reference_density": 1.8}
GROWTH = {"attractor": 0.014, "rate": 20.0, "bounds": (0.02, 2.1)}
START = 0.8  # g/cm³


@dataclass(frozen=True, repr=False)
class Femur3d(Scene):
    """A scene with what it knows of its femur.

    anatomy: its landmarks.  zones: corners of convex bodies by name, shape (corners, 3), whose mean densities can be
    told.  body_weight: N.

    Example:
        >>> scene = gx.scenes.femur3d(size=12.0)
        >>> isinstance(scene, gx.scenes.Femur3d), f"{scene.anatomy.radius:.0f} mm"
        (True, '24 mm')
    """

    anatomy: SolidAnatomy = field(kw_only=True)
    zones: Mapping[str, Floats] = MappingProxyType({})
    body_weight: float = BODY_WEIGHT


@renamed(version="anteversion")
def femur3d(
    mesh: Mesh | str | Path | None = None,
    *,
    size: float | None = None,
    left: bool = False,
    body_weight: float = BODY_WEIGHT,
    activities: tuple[Activity, ...] = ACTIVITIES,
    weights: tuple[float, ...] = DAILY,
    separate: bool = True,
    zones: str | Path | Mapping[str, Any] | None = None,
    n: float = 2.0,
    m: float = 3.0,
    step: float = 1.0,
    until: float = 20.0,
    trusted: bool = False,
    comm: MPI.Comm = MPI.COMM_WORLD,
    **shape: float,
) -> Femur3d:
    """The proximal femur in space, fixed at its distal end, under the hip's forces in the activities of a day.

    mesh: a Mesh in space, or a file of one as `meshing.read` takes it, in mm, z superior and y anterior, left or right,
    with the boundaries "head", "trochanter" and "distal"; default: our own, a parametric one.
    size: of its cells (mm).  left: a left one.  shape: other parameters of meshes/femur3d.geo, such as head_radius,
    neck_shaft_angle, anteversion, offset, neck_width, neck_height, shaft_width, shaft_depth, lean, bow and cut.
    body_weight: N, of which the activities' forces are shares.
    activities: with a joint force and muscles each.  weights: their parts of the daily cycles; zero leaves one out.
    separate: each activity has its own displacement under its full forces, and the density is driven by the mean of
    their energies, weighted; otherwise one displacement is that of the weighted sum of the forces.
    zones: corners of convex bodies by name whose mean densities are of interest, or a CSV file with the columns zone,
    x_mm, y_mm and z_mm; default: the anatomical zones, laid by the landmarks that are measured on the mesh.
    n, m: exponents of density.  step, until: Δt and end of the march; the load ramps over the first step.
    trusted: let a script of the mesh run programs and write files, see `meshing.read`.
    Raises InputError for a mesh without these boundaries, and where they are not those of a femur.

    Example:
        >>> [case.name for case in gx.scenes.femur3d(size=12.0, body_weight=600.0).cases]
        ['walking', 'one-legged stance', 'standing up']
    """
    daily = plan(body_weight, activities, weights, separate, n=n, m=m, step=step, until=until)
    mesh = _mesh(mesh, size, left, shape, trusted, comm)
    refuse_without_names(mesh)
    bone = measure(mesh)
    cases = {
        activity.name: (weight, _forces(activity, body_weight * (1 if separate else weight), mesh, bone))
        for activity, weight in daily.used
    }
    scene = Femur3d(
        name="femur in space",
        mesh=mesh,
        material=daily.material,
        growth=daily.growth,
        supports=(Support("distal"),),
        loads=() if separate else tuple(force for _, forces in cases.values() for force in forces),
        cases=tuple(LoadCase(name, weight, forces) for name, (weight, forces) in cases.items() if separate),
        program=daily.program,
        initial_density=START,
        anatomy=bone,
        zones=MappingProxyType(_zones(mesh, bone, zones)),
        body_weight=float(body_weight),
    )
    loaded_areas(scene)
    return scene


@dataclass(frozen=True)
class Plan:
    """What a femur is to bear, of what and for how long, known without its mesh.

    used: the activities that have a part of the day, with their parts.
    """

    used: tuple[tuple[Activity, float], ...]
    material: Material
    growth: EnergyDrivenGrowth
    program: Program


def plan(
    body_weight: float,
    activities: tuple[Activity, ...],
    weights: tuple[float, ...],
    separate: bool,
    *,
    n: float,
    m: float,
    step: float,
    until: float,
) -> Plan:
    """Arguments of `femur3d`; InputError for those that no mesh makes right: one is made, or read, after them."""
    _check_weight(body_weight)
    require_flag(separate, "separate, of the activities,")
    return Plan(
        tuple(_used(activities, weights)),
        Material(**MATERIAL, density_exponent=n),
        EnergyDrivenGrowth(**GROWTH, exponent=m),  # type: ignore[arg-type]
        Program(step=step, until=until, ramp=step),
    )


def _check_weight(newtons: Any) -> None:
    wanted = "one from {:g} to {:g}, 9.81 N for a kilogram,".format(*WEIGHTS)
    require_number(newtons, "the body weight (N)", wanted, _is_weight)


def _is_weight(newtons: float) -> bool:
    return WEIGHTS[0] <= newtons <= WEIGHTS[1]


def _used(activities: Any, weights: Any) -> list[tuple[Activity, float]]:
    """The activities that have a part of the day, with their parts."""
    activities = require_each(activities, Activity, "the activities", "Activity")
    if not isinstance(weights, (tuple, list)) or len(weights) != len(activities):
        raise InputError(
            f"the weights of the activities are {shown(weights)}: {len(activities)} numbers, one for each, would be "
            "right"
        )
    for weight in weights:
        require_number(weight, "the weight of an activity", "a number of at least 0", lambda w: w >= 0)
    used = [(activity, float(weight)) for activity, weight in zip(activities, weights, strict=True) if weight > 0]
    if not used:
        raise InputError("no activity has a weight: one above 0 would be right")
    return used


def _mesh(
    mesh: Mesh | str | Path | None, size: float | None, left: bool, shape: Mapping[str, float], trusted: bool, comm: Any
) -> Mesh:
    require_flag(left, "left, of the femur,")
    if mesh is None:
        if trusted:
            raise InputError(
                "trusted is True, for a mesh that is not given: the built-in femur is no stranger's, and "
                "False would be right"
            )
        own = of_script(shape) | ({} if size is None else {"size": size}) | ({"left": 1.0} if left else {})
        return files.read(files.locate("femur3d.geo"), comm=comm, **own)  # type: ignore[arg-type]
    given = {"size": size, "left": left or None, **shape}
    for name, value in given.items():
        if value is not None:
            raise InputError(f"{name} is {shown(value)}, for a mesh that is given: the built-in femur has a {name}")
    if not isinstance(mesh, Mesh):
        mesh = files.read(mesh, trusted=trusted, comm=comm)
    if mesh.dim != 3:
        raise InputError(
            f"the femur's mesh has cells of the shape {mesh.cell_name}, and its scene is in space: tetrahedra or "
            "hexahedra would be right"
        )
    return mesh


def of_script(shape: Mapping[str, float]) -> dict[str, float]:
    """Parameters of meshes/femur3d.geo, where the anteversion is "version"."""
    return {"version" if name == "anteversion" else name: value for name, value in shape.items()}


def _zones(mesh: Mesh, bone: SolidAnatomy, given: str | Path | Mapping[str, Any] | None) -> dict[str, Floats]:
    """The zones of the user, or those that the landmarks lay."""
    if given is None:
        return zones_of_bone(mesh, bone)
    found: dict[str, Floats] = {}
    problem = ""
    try:
        found = zones_of(given, dim=3)
    except InputError as error:  # of a file, perhaps, that only some ranks can read
        problem = str(error)
    raise_on_all(mesh.comm, problem)
    from growthx.post.zones import require_overlap  # not above: most runs have no zones to look at before their end

    require_overlap(mesh, found)
    return found


def _forces(activity: Activity, newtons: float, mesh: Mesh, bone: SolidAnatomy) -> tuple[DistributedForce, ...]:
    """The forces of an activity for so many newtons of body weight."""

    def force(share: tuple[float, float, float]) -> tuple[float, ...]:
        return tuple(newtons / 100 * component for component in bone.in_space(share))

    x, y, z = bone.in_space(activity.joint)
    size = float(np.linalg.norm(activity.joint))
    cx, cy, cz = bone.centre
    cap = Cap((float(cx), float(cy), float(cz)), (-x / size, -y / size, -z / size))
    found = [DistributedForce("head", force(activity.joint), cap, activity.name)]
    for muscle in activity.muscles:
        place = bone.centre + np.array(bone.in_space(muscle.place))
        weight = attachment(mesh, muscle.name, muscle.on, place, muscle.radius)
        found.append(DistributedForce(muscle.on, force(muscle.pull), weight, activity.name))
    return tuple(found)


@dataclass(frozen=True)
class LoadedArea:
    """Where a force of the hip acts.

    case: its activity.  force: "joint", or the muscle.  on: the boundary.  newtons: its size.
    area: of the facets on whose middles it has weight (mm²).
    """

    case: str
    force: str
    on: str
    newtons: float
    area: float


def loaded_areas(scene: Femur3d) -> list[LoadedArea]:
    """On which area each force of a femur acts, in the order of its loads (collective).

    Raises InputError where one has less than three facets.
    """
    found = []
    for load in scene.dead_loads:
        if not (isinstance(load, DistributedForce) and isinstance(load.weight, (Cap, Attachment))):
            continue
        kind = load.weight.muscle if isinstance(load.weight, Attachment) else "joint"
        area, facets = loaded_area(scene.mesh, load.on, load.weight)
        if facets < LEAST_FACETS:
            raise InputError(
                f"the force of {kind} in {load.case} would act on {facets} facets of '{load.on}': {LEAST_FACETS} at "
                "least, of a finer mesh, would be right"
            )
        found.append(LoadedArea(load.case, kind, load.on, float(np.linalg.norm(load.force)), area))
    return found
