"""The plane femur with a press-fit stem, bonded to the bone: what grows is the bone around it, under the same loads.

Units as those of the femur: N, mm, MPa, g/cm³.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import dolfinx
import numpy as np
from mpi4py import MPI

from growthx.common.checks import require_kind, require_number
from growthx.common.errors import InputError
from growthx.common.renamed import renamed
from growthx.common.words import place_in_words
from growthx.fem import compat
from growthx.meshing import files
from growthx.meshing.mesh import Mesh
from growthx.meshing.transferred import TransferredDensity
from growthx.scenes.anatomy import ABDUCTOR_INSERTION, HEAD_CENTRE, HEAD_RADIUS, along_outline
from growthx.scenes.femur import AVERAGE, Femur, femur

if TYPE_CHECKING:
    from growthx.common.arrays import Field, Floats

BONE_YOUNG = 500.0  # MPa, of bone of the reference density in the plane model
CORTEX = 1.8  # g/cm³, of the plane model's cortex
TITANIUM, COBALT_CHROMIUM = 110_000.0, 200_000.0  # MPa
METALS = {"titanium": TITANIUM, "cobalt-chromium": COBALT_CHROMIUM}
CORTICAL = 17_000.0  # MPa, of bone in truth
MIDDLE = -0.5  # x of the middle of the shaft
CUT = np.array([[30.40, 100.90], [13.00, 129.40]])  # ends of the cut through the neck
ON_CUT = (0.1, 0.85)  # shares of it, between which the stem comes out of the bone
COVER = 1.0  # mm of bone that must be around the stem


@renamed(exponent="density_exponent")
def scaled(young: float, reference_density: float = 1.2, density_exponent: float = 2.0) -> float:
    """Young's modulus (MPa) of a metal in the plane model, as many times that of its cortex as in truth of bone's."""
    require_number(young, "Young's modulus of the stem (MPa)", "a positive number", lambda E: E > 0)
    return young / CORTICAL * BONE_YOUNG * (CORTEX / reference_density) ** density_exponent


def corners(tip: float = 50.0, width: float = 13.0) -> Floats:
    """Corners of the stem in the bone, from the medial end of its part of the cut round to the lateral one, (7, 2).

    tip: its height (mm).  width: there.  The same as in meshes/femur_stem.geo.
    """
    half = width / 2
    medial, lateral = (CUT[0] + share * (CUT[1] - CUT[0]) for share in ON_CUT)
    down = [(half + 7, 95.0), (half + 1, 75.0), (half, tip), (-half, tip), (-half - 1.5, 90.0)]
    return np.array([medial, *((MIDDLE + x, y) for x, y in down), lateral])


@renamed(cells="shape", head="head_radius")
def stem_mesh(
    *,
    tip: float = 50.0,
    width: float = 13.0,
    head_radius: float = 14.0,
    natural: bool = False,
    size: float = 3.5,
    shape: str = "quadrilateral",
    comm: MPI.Comm = MPI.COMM_WORLD,
) -> Mesh:
    """The femur, cut through its neck, with a stem: regions "bone" and "stem", boundaries "surface" and "distal".

    tip: height of the stem's tip.  width: of the stem there.  head_radius: of the head.  size: of cells (all in mm).
    natural: the femur's own head and neck are one piece with the stem.  shape: of cells, "quadrilateral" or "triangle".
    Raises InputError for a stem that is not in the bone.

    Example:
        >>> mesh = gx.scenes.stem_mesh(tip=40.0, size=6.0)
        >>> sorted(mesh.regions), sorted(mesh.boundaries)
        (['bone', 'stem'], ['distal', 'interface', 'surface'])
    """
    for value, what in ((tip, "the height of the stem's tip"), (width, "the width of the stem")):
        require_number(value, f"{what} (mm)", "a positive number", lambda x: x > 0)
    require_number(head_radius, "the radius of the stem's head (mm)", "a number from 10 to 18", lambda r: 10 <= r <= 18)
    require_number(size, "the cell size (mm)", "a positive number", lambda h: h > 0)
    _require_in_bone(tip, width)
    return files.read(
        files.locate("femur_stem.geo"),
        comm=comm,
        tip=tip,
        width=width,
        head=head_radius,
        natural=int(natural),
        size=size,
        triangles=files.triangles(shape),
    )


def _require_in_bone(tip: float, width: float) -> None:
    """Refuse a stem that comes nearer to the outline of the bone than its cover, or out of it."""
    from matplotlib.path import Path

    ends = corners(tip, width)
    ticks = np.linspace(0, 1, 50)[:, np.newaxis, np.newaxis]
    border = (ends[:-1] + ticks * np.diff(ends, axis=0)).reshape(-1, 2)
    line = along_outline(0, 62, 2001)
    apart = np.linalg.norm(border[:, np.newaxis] - line, axis=2).min(axis=1)
    apart = np.minimum(apart, border[:, 1])  # from the distal end
    apart[~Path(line).contains_points(border)] = 0.0
    worst = int(np.argmin(apart))
    if apart[worst] < COVER:
        where = "outside the bone" if apart[worst] <= 0 else f"{apart[worst]:.2g} mm from the bone's surface"
        raise InputError(
            f"the stem with its tip at {tip:g} mm, {width:g} mm wide, lies {where} at "
            f"{place_in_words(border[worst], 4)}: "
            f"a thinner or shorter one, with {COVER:g} mm of bone around it, would be right"
        )
    if tip > 70:
        raise InputError(f"the stem's tip is at {tip:g} mm, beside its shoulder: one from 5 to 70 mm would be right")


@renamed(head="head_radius")
def stem(
    mesh: Mesh,
    density: Field,
    *,
    young: float | None = None,
    head_radius: float = 14.0,
    thickness: float = 30.0,
    weights: tuple[float, float, float] = AVERAGE,
    separate: bool = False,
    n: float = 2.0,
    m: float = 3.0,
    step: float = 4.0,
    until: float = 160.0,
) -> Femur:
    """Bone with a bonded stem, under the femur's loads, the joint's on the stem's head: they are there from the start.

    mesh: of `stem_mesh`.  density: at the start, as gx.transfer(intact, mesh, variant, outside=1.2) carries it there.
    young: of the stem (MPa); `scaled` turns a metal's into the plane model's.  None: at each place what the bone had
    there, [ρ/ρ*]ⁿ of bone's, for the density that was carried; that changes next to nothing.
    head_radius: of the head that bears the joint's force, 24 of the femur's own.
    Everything else as for `femur`.  Its zones are Gruen's, of a stem as long as the mesh's.

    Example:
        >>> mesh = gx.scenes.stem_mesh(size=6.0)
        >>> scene = gx.scenes.stem(mesh, 1.2, young=2000.0, until=4.0)
        >>> scene.growing, sorted(scene.zones)[:2]
        (('bone',), ['Gruen 1', 'Gruen 2'])
    """
    require_kind(mesh, Mesh, "the mesh with the stem", "a growthx.Mesh")
    for region in ("bone", "stem"):
        mesh.region(region)
    own = femur(
        mesh,
        **own_places(head_radius),
        thickness=thickness,
        weights=weights,
        separate=separate,
        n=n,
        m=m,
        step=step,
        until=until,
    )
    if young is not None:
        require_number(young, "Young's modulus of the stem (MPa)", "a positive number", lambda E: E > 0)
    moduli: Field = {"bone": BONE_YOUNG, "stem": young} if young is not None else as_bone(mesh, density, own.material)
    material = own.material
    return replace(
        own,
        name="femur with a stem",
        material=replace(material, young=moduli),
        growing=("bone",),
        initial_density=density,
        program=replace(own.program, ramp=0.0),
        zones=gruen(_tip(mesh)),
    )


def own_places(head: float = HEAD_RADIUS) -> dict[str, Any]:
    """Where head, of a radius (mm), and trochanter of our own outline are, as `femur` takes them with a mesh of it."""
    ends = along_outline(*ABDUCTOR_INSERTION, 3)
    return {"head": (*HEAD_CENTRE, head), "trochanter": (tuple(ends[0]), tuple(ends[-1]))}


def as_bone(mesh: Mesh, density: Any, material: Any) -> dolfinx.fem.Function:
    """Young's modulus of bone of the reference density, and in the stem of what the bone there was, one per cell."""
    if not isinstance(density, TransferredDensity):
        raise InputError("the stem is as stiff as the bone was, of a density that no run has: transfer(…) has one")
    young = dolfinx.fem.Function(dolfinx.fem.functionspace(mesh.domain, ("DG", 0)), name="young")
    found = np.full(len(mesh.owned_cells), float(material.young))
    inside = np.isin(mesh.owned_cells, mesh.region("stem"))
    was = density.of_cells().mean(axis=1)
    found[inside] *= material.weight(was[inside])
    young.x.array[: len(found)] = found
    young.x.scatter_forward()
    return young


def _tip(mesh: Mesh) -> float:
    """The lowest point of the stem."""
    nodes = mesh.domain.geometry.x[compat.geometry_nodes(mesh.domain)[mesh.region("stem")]]
    return float(mesh.comm.allreduce(float(nodes[..., 1].min(initial=np.inf)), MPI.MIN))


def gruen(tip: float = 50.0) -> dict[str, Floats]:
    """Gruen's zones 1 to 7 around a stem with its tip at a height: lateral down, below the tip, and medial up.

    Polygons that reach beyond the bone, of which what grows counts: shape (corners, 2).

    Example:
        >>> len(gx.scenes.gruen(tip=50.0))
        7
    """
    far, up = 80.0, 170.0
    low, high = tip + (CUT[0, 1] - tip) * np.array([1, 2]) / 3
    centre = CUT[0] + np.mean(ON_CUT) * (CUT[1] - CUT[0])

    def band(side: float, bottom: float, end: float) -> Floats:
        return np.array([(MIDDLE, bottom), (side, bottom), (side, end), (MIDDLE, end)])

    def above(side: float) -> Floats:
        return np.array([(MIDDLE, high), (side, high), (side, up), (centre[0], up), tuple(centre)])

    return {
        "Gruen 1": above(-far),
        "Gruen 2": band(-far, low, high),
        "Gruen 3": band(-far, tip, low),
        "Gruen 4": np.array([(-far, tip - 20), (far, tip - 20), (far, tip), (-far, tip)]),
        "Gruen 5": band(far, tip, low),
        "Gruen 6": band(far, low, high),
        "Gruen 7": above(far),
    }
