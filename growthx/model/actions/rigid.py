"""Boundaries that stay as rigid as they are at rest, and move as the body and the loads have it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from growthx.common.checks import require_kind, require_name, require_number, require_vector
from growthx.common.errors import InputError, shown
from growthx.model.actions.faces import Face, cross_matrix
from growthx.model.supports import Held

if TYPE_CHECKING:
    from growthx.common.arrays import Floats
    from growthx.meshing.mesh import Mesh


@dataclass(frozen=True)
class RigidFace(Held, replaceable=()):
    """A named boundary that is rigid and free to move and to turn, as a platen on a joint: u = (R − I)(X − c) + d.

    R and d are found with the body's displacement, in each load case its own: forces of the boundary have no resultant
    along what is free, and a `Moment` on it is their moment, whatever the rotation (of fixed axes, in space).  Where
    the material is of small strains, R − I is ω ×.
    about: c, (dim,) (length); default: the middle of the boundary.
    held: directions, as numbers from 0, in which c does not move.  turns: whether it turns.
    axis: (3,), in space, about which alone it turns; default: about any.

    Example:
        >>> platen = gx.RigidFace("right", held=(1,))  # free to move along x, and to turn about its middle
        >>> platen.place
        'right'
    """

    on: str
    about: tuple[float, ...] | None = None
    held: tuple[int, ...] = ()
    turns: bool = True
    axis: tuple[float, ...] | None = None

    displacement = None
    history = None

    def __post_init__(self) -> None:
        require_name(self.on, "the boundary of a rigid face")
        what = f"the rigid face '{self.on}'"
        for name in ("about", "axis"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, require_vector(getattr(self, name), f"{name}, of {what},"))
        require_kind(self.held, (tuple, list), f"held, of {what},", "numbers of directions")
        for direction in self.held:
            require_number(direction, f"a held direction of {what}", "0, 1 or 2", lambda i: i in (0, 1, 2))
        object.__setattr__(self, "held", tuple(sorted({int(i) for i in self.held})))
        if not isinstance(self.turns, bool):
            raise InputError(f"turns, of {what}, is {shown(self.turns)}: True or False would be right")
        if self.axis is not None and not (self.turns and any(self.axis)):
            wanted = "(x, y, z), not all of them zero" if self.turns else "none, of a face that does not turn"
            raise InputError(f"the axis of {what} is {shown(self.axis)}: {wanted}, would be right")

    @property
    def place(self) -> str:
        """The boundary."""
        return self.on

    def components(self, dim: int) -> list[tuple[int, float]]:
        """Pairs (direction, zero) of the directions in which c is held; InputError for other dimensions."""
        for name, entries in (("about", dim), ("axis", 3)):
            value = getattr(self, name)
            if value is not None and len(value) != entries:
                raise InputError(f"{name}, of the rigid face '{self.on}', has {len(value)} entries: it needs {entries}")
        if dim == 2 and self.axis is not None:
            raise InputError(f"the rigid face '{self.on}' has an axis, which in the plane is z: none would be right")
        if any(i >= dim for i in self.held):
            raise InputError(f"the rigid face '{self.on}' is held along {max(self.held)}: less than {dim} is right")
        return [(i, 0.0) for i in self.held]

    def centre(self, mesh: Mesh) -> Floats:
        """The place c, shape (dim,) (collective)."""
        return Face.of(mesh, self.on).middle if self.about is None else np.array(self.about)

    def axes(self, dim: int) -> list[Floats]:
        """What it turns about: unit axes, (3,) each; in the plane (1,)."""
        if not self.turns:
            return []
        if dim == 2:
            return [np.ones(1)]
        return list(np.eye(3)) if self.axis is None else [np.array(self.axis) / np.linalg.norm(np.array(self.axis))]

    def turning(self, dim: int) -> list[Floats]:
        """Matrices K of K r = axis × r, (dim, dim), one for each axis."""
        return [cross_matrix(axis, dim) for axis in self.axes(dim)]
