"""The femur in space with a press-fit stem, bonded to the bone: what grows is the bone around it, under the same loads.

Units as those of the femur: N, mm, MPa, g/cm³.
"""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import dolfinx
import numpy as np
from mpi4py import MPI

from growthx.common.checks import require_flag, require_kind, require_number
from growthx.common.errors import InputError
from growthx.common.renamed import renamed
from growthx.common.words import place_in_words
from growthx.meshing import files
from growthx.meshing.mesh import Mesh
from growthx.scenes.femur3d import Femur3d, loaded_areas, of_script
from growthx.scenes.solid_anatomy import SolidAnatomy, corners, refuse_without_names
from growthx.scenes.stem import COVER, as_bone

if TYPE_CHECKING:
    from growthx.common.arrays import Field, Floats

CUT = 170.0  # mm below the head's centre, where the femur of meshes/femur3d_stem.geo ends
FAR = 200.0  # mm, to which zones reach
BELOW = 20.0  # mm, of the zone below the tip
PARTS = 4  # of the sides of facets, between which distances are looked at
NEAR_CUT = 3.0  # mm from the cut through the neck, at which the stem is not looked at


@renamed(version="anteversion")
def stem3d_mesh(
    *,
    left: bool = False,
    natural: bool = False,
    size: float | None = None,
    comm: MPI.Comm = MPI.COMM_WORLD,
    **shape: float,
) -> Mesh:
    """The femur in space, cut across its neck, with a stem: regions "bone" and "stem", boundaries as of the femur.

    left: a left femur.  size: of cells (mm).
    natural: the femur's own head and neck are one piece with the stem: the intact femur, in the same cells as those of
    the femur with the stem, which therefore begins with its density to the last digit.
    shape: parameters of the stem – tip (mm below the head's centre), width (mm, at its tip), flare (its width at the
    neck, in widths at its tip), stem_head (radius of its head, mm), resection (where the neck is cut, in lengths of the
    neck from the head's centre) – and of the femur, as for `femur3d`, whose cut is 170 mm below the head's centre here.
    Raises InputError for a stem that is not in the bone.

    Example:
        >>> gx.scenes.stem3d_mesh(left=1)
        Traceback (most recent call last):
        growthx.common.errors.InputError: left, of the femur, is 1: True or False would be right
    """
    require_flag(left, "left, of the femur,")
    require_flag(natural, "natural, of the stem,")
    # gmsh reads a script twice that is given parameters: those that it has by itself are left out.
    given = of_script(shape) | ({"left": 1.0} if left else {}) | ({"natural": 1.0} if natural else {})
    given |= {} if size is None else {"size": size}
    mesh = files.read(files.locate("femur3d_stem.geo"), comm=comm, **given)  # type: ignore[arg-type]
    _require_cover(mesh)
    return mesh


def stem3d(
    femur: Femur3d,
    mesh: Mesh,
    density: Any,
    *,
    young: float | None = None,
    step: float | None = None,
    until: float | None = None,
) -> Femur3d:
    """A femur's bone with a bonded stem, under the femur's loads, the joint's on the stem's head, all there at once.

    femur: the intact one, whose forces, material and law of growth these are.
    mesh: of `stem3d_mesh` with the femur's shape, or your own with the regions "bone" and "stem" and the boundaries
    "head", which is the stem's, "trochanter", "distal", "surface" and "interface", between bone and stem.
    density: at the start, as gx.transfer(intact, mesh, variant, outside=0.8) carries it there.
    young: of the stem (MPa).  None: at each place what the bone had there, [ρ/ρ*]ⁿ of bone's, for the density that was
    carried.
    step, until: Δt and end of the march; default: the femur's.
    Its zones are Gruen's.  Raises InputError for a mesh without these names, and where a force meets no boundary.

    Example:
        >>> gx.scenes.stem3d("femur.msh", "stem.msh", 0.8)
        Traceback (most recent call last):
        growthx.common.errors.InputError: the intact femur is 'femur.msh': a scene of femur3d would be right
    """
    require_kind(femur, Femur3d, "the intact femur", "a scene of femur3d")
    require_kind(mesh, Mesh, "the mesh with the stem", "a growthx.Mesh")
    if mesh.dim != 3:
        raise InputError(
            f"the mesh with the stem has cells of the shape {mesh.cell_name}, and its scene is in space: tetrahedra or "
            "hexahedra would be right"
        )
    for region in ("bone", "stem"):
        mesh.region(region)
    refuse_without_names(mesh)
    if young is not None:
        require_number(young, "Young's modulus of the stem (MPa)", "a positive number", lambda E: E > 0)
    bone: Any = femur.material
    moduli: Field = {"bone": bone.young, "stem": young} if young is not None else as_bone(mesh, density, bone)
    changes: dict[str, Any] = {name: value for name, value in (("step", step), ("until", until)) if value is not None}
    scene = replace(
        femur,
        name="femur in space with a stem",
        mesh=mesh,
        material=replace(bone, young=moduli),
        growing=("bone",),
        initial_density=density,
        program=replace(femur.program, ramp=0.0, **changes),
        zones=MappingProxyType(gruen3d(mesh, femur.anatomy)),
    )
    loaded_areas(scene)
    return scene


def gruen3d(mesh: Mesh, bone: SolidAnatomy) -> dict[str, Floats]:
    """Gruen's zones 1 to 7 around the stem of a mesh: lateral down, below the tip, and medial up (collective).

    bone: the anatomy of the intact femur.  Prisms from front to back that reach beyond the bone, of which what grows
    counts: their corners, shape (corners, 3), mm.  As in radiographs, thirds of the stem along the shaft, parted by its
    axis, and above by the line from there to the middle of the stem's part of the cut.
    """
    interface = (corners(mesh, "interface") - bone.crossing) @ bone.frame.T
    lateral, _, depth = _rim(mesh).mean(axis=0) @ bone.frame.T - bone.frame @ bone.crossing
    tip = float(interface[:, 2].max())
    low, high = tip - (tip - depth) * np.array([1, 2]) / 3
    aside = lateral * (high + FAR) / (high - depth)  # of the line, at the upper end of zones

    def prism(*outline: tuple[float, float]) -> Floats:
        flat = np.array(outline)
        ends = [np.column_stack([flat[:, 0], np.full(len(flat), y), flat[:, 1]]) for y in (-FAR, FAR)]
        return np.asarray(bone.crossing + np.concatenate(ends) @ bone.frame)

    def band(side: float, top: float, bottom: float) -> Floats:
        return prism((0.0, top), (side, top), (side, bottom), (0.0, bottom))

    def above(side: float) -> Floats:
        return prism((0.0, high), (side, high), (side, -FAR), (aside, -FAR))

    return {
        "Gruen 1": above(FAR),
        "Gruen 2": band(FAR, high, low),
        "Gruen 3": band(FAR, low, tip),
        "Gruen 4": prism((-FAR, tip), (FAR, tip), (FAR, tip + BELOW), (-FAR, tip + BELOW)),
        "Gruen 5": band(-FAR, low, tip),
        "Gruen 6": band(-FAR, high, low),
        "Gruen 7": above(-FAR),
    }


def _rim(mesh: Mesh) -> Floats:
    """Where the interface ends, at the cut through the neck: nodes, shape (nodes, 3) (collective).

    They are on edges that one facet of the interface has alone.
    """
    found = np.concatenate(mesh.comm.allgather(_facets(mesh, "interface")))
    places, numbers = np.unique(found.reshape(-1, 3), axis=0, return_inverse=True)
    sides = np.sort(numbers.reshape(-1, 3)[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    edges, counts = np.unique(sides, axis=0, return_counts=True)
    rim = np.unique(edges[counts == 1])
    if len(rim) < 3:
        raise InputError(
            f"the boundary 'interface' of the mesh with the stem ends at {len(rim)} nodes: one that ends around the "
            "stem, where it comes out of the bone, would be right"
        )
    return np.asarray(places[rim])


def _facets(mesh: Mesh, name: str) -> Floats:
    """Corners of the owned facets of a boundary, (facets, 3, 3)."""
    mesh.domain.topology.create_connectivity(2, 3)
    facets = mesh.owned_facets(name)
    nodes = dolfinx.mesh.entities_to_geometry(mesh.domain, 2, facets) if len(facets) else np.empty((0, 3), np.int32)
    return np.asarray(mesh.domain.geometry.x[nodes])


def _require_cover(mesh: Mesh) -> None:
    """Refuse a stem that comes nearer to the surface of the bone than its cover, but for the cut (collective)."""
    from scipy.spatial import KDTree

    rim = _rim(mesh)
    middle = rim.mean(axis=0)
    normal = np.linalg.svd(rim - middle)[2][2]
    stem, bone = (places[np.abs((places - middle) @ normal) > NEAR_CUT] for places in _surfaces(mesh))
    away, _ = KDTree(bone).query(stem)
    worst = int(np.argmin(away))
    if away[worst] < COVER:
        raise InputError(
            f"the stem lies {away[worst]:.2g} mm from the bone's surface at {place_in_words(stem[worst], 4)}: a "
            f"thinner or shorter one, with {COVER:g} mm of bone around it, would be right"
        )


def _surfaces(mesh: Mesh) -> list[Floats]:
    """Points all over the interface and over the bone's surface, (points, 3) each (collective)."""
    ticks = np.arange(PARTS + 1)
    parts = [(i, j, PARTS - i - j) for i in ticks for j in ticks if i + j <= PARTS]
    found = []
    for name in ("interface", "surface"):
        places = np.einsum("pn,fni->fpi", np.array(parts) / PARTS, _facets(mesh, name)).reshape(-1, 3)
        found.append(np.concatenate(mesh.comm.allgather(places)))
    return found
