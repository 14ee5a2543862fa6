"""Planes that cut a body in space: the three of anatomy, or any by a point and its normal."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI

from growthx.common.checks import require_vector
from growthx.common.errors import InputError, shown

if TYPE_CHECKING:
    from growthx.common.arrays import Floats
    from growthx.meshing.mesh import Mesh

# By name: towards whom the picture looks, x to the right or y in the sagittal plane, with x lateral, y anterior and z
# superior.
NORMALS = {"coronal": (0.0, -1.0, 0.0), "axial": (0.0, 0.0, 1.0), "sagittal": (1.0, 0.0, 0.0)}
AXES = "xyz"
ALIKE = 1 + 1e-6  # extents of a body that are the same but for round-off
UPRIGHT = 0.9  # cosine: of a plane whose normal is nearer to z, y is drawn upwards


@dataclass(frozen=True)
class Plane:
    """A plane, seen from where its normal points to.

    point: on it, (3,).  normal: of length one, (3,).  label: what is written above its picture.  is_named: whether it
    is one of anatomy, whose label tells the axes.
    """

    point: tuple[float, ...]
    normal: tuple[float, ...]
    label: str
    is_named: bool = False

    @property
    def up(self) -> tuple[float, float, float]:
        """What is drawn upwards."""
        return (0.0, 1.0, 0.0) if abs(self.normal[2]) > UPRIGHT else (0.0, 0.0, 1.0)


def extent(mesh: Mesh) -> tuple[Floats, Floats]:
    """The lowest and the highest coordinates of a body at rest (collective)."""
    x = mesh.domain.geometry.x
    low, high = x.min(axis=0, initial=np.inf), x.max(axis=0, initial=-np.inf)
    mesh.comm.Allreduce(MPI.IN_PLACE, low, MPI.MIN)
    mesh.comm.Allreduce(MPI.IN_PLACE, high, MPI.MAX)
    return low, high


def plane_of(wanted: Any, mesh: Mesh) -> Plane:
    """The plane that is meant (collective).

    wanted: 'coronal', 'axial' or 'sagittal', through the middle of the body; a point and a normal; None: that of the
    three which is across the body's shortest extent.
    Raises InputError for what is no plane, and for one that misses the body.
    """
    low, high = extent(mesh)
    middle = (low + high) / 2
    if wanted is None:
        extents = {"coronal": (high - low)[1], "sagittal": (high - low)[0], "axial": (high - low)[2]}
        wanted = next(name for name, size in extents.items() if size <= ALIKE * min(extents.values()))
    if isinstance(wanted, str):
        if wanted not in NORMALS:
            raise InputError(
                f"there is no plane '{wanted}': one of {', '.join(NORMALS)}, or a point and a normal, would be right"
            )
        named = NORMALS[wanted]
        axis = int(np.argmax(np.abs(named)))
        across, upward = (AXES[i] for i in range(3) if i != axis)
        (at,) = _rounded((float(middle[axis]),), float(np.max(high - low)))
        return Plane(tuple(middle), named, f"{wanted}, {AXES[axis]} = {at:.4g}   ({across} →, {upward} ↑)", True)
    if not isinstance(wanted, (tuple, list)) or len(wanted) != 2:
        raise InputError(
            f"the plane is {shown(wanted)}: one of {', '.join(NORMALS)}, or a point and a normal, is needed"
        )
    point = require_vector(wanted[0], "the point of a plane")
    normal = require_vector(wanted[1], "the normal of a plane")
    length = float(np.linalg.norm(normal))
    if len(point) != 3 or len(normal) != 3 or length == 0:
        raise InputError(
            f"the plane has the point {point} and the normal {normal}: three numbers for each, not all zero, are needed"
        )
    # What is written is rounded, as round-off of a user's own computation is no place.
    size = max(float(np.max(high - low)), float(np.abs(point).max()))
    label = f"through {_row(_rounded(point, size))}, normal {_row(_rounded(normal, float(np.abs(normal).max())))}"
    plane = Plane(point, tuple(np.array(normal) / length), label)
    _check_cut(plane, mesh, low, high)
    return plane


def _rounded(vector: tuple[float, ...], size: float) -> tuple[float, ...]:
    """Without what is round-off beside a size, and without −0."""
    return tuple(float(each) for each in np.round(np.array(vector) / size, 6) * size + 0.0)


def _row(vector: tuple[float, ...]) -> str:
    return "(" + ", ".join(f"{each:.4g}" for each in vector) + ")"


def _check_cut(plane: Plane, mesh: Mesh, low: Floats, high: Floats) -> None:
    """Raise InputError for a plane that has the whole body on one side."""
    heights = (mesh.domain.geometry.x - np.array(plane.point)) @ np.array(plane.normal)
    lowest = mesh.comm.allreduce(float(heights.min(initial=np.inf)), MPI.MIN)
    highest = mesh.comm.allreduce(float(heights.max(initial=-np.inf)), MPI.MAX)
    if lowest > 0 or highest < 0:
        raise InputError(
            f"the plane {plane.label} misses the body, which reaches from {_row(tuple(low))} to {_row(tuple(high))}: "
            "a point inside would be right"
        )
