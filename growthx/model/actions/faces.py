"""Boundaries that are turned as rigid ones, and moments on boundaries."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import basix
import dolfinx
import numpy as np

from growthx.common.checks import require_kind, require_name, require_number, require_vector
from growthx.common.errors import InputError
from growthx.common.words import place_in_words
from growthx.model.actions.dead import DeadLoad
from growthx.model.actions.histories import History, check_history
from growthx.model.supports import Held

if TYPE_CHECKING:
    from growthx.common.arrays import Floats
    from growthx.meshing.mesh import Mesh

FLAT = 1e-12  # of the largest of a face's second moments: about such an axis it cannot be turned by tractions


@dataclass(frozen=True)
class Face:
    """A boundary as a figure: its area (length in the plane), middle, (dim,), and ∫ r ⊗ r dA about it, (dim, dim)."""

    area: float
    middle: Floats
    second: Floats

    @classmethod
    def of(cls, mesh: Mesh, boundary: str) -> Face:
        """That of a named boundary, from the corners of its facets (collective)."""
        dim, domain = mesh.dim, mesh.domain
        facets = mesh.owned_facets(boundary)
        shape = basix.cell.subentity_types(basix.CellType[mesh.cell_name])[dim - 1][0]
        X, weights = map(np.asarray, basix.make_quadrature(shape, 4))
        table = np.asarray(basix.create_element(basix.ElementFamily.P, shape, 1).tabulate(1, X))[:, :, :, 0]
        x, dA = np.zeros((0, dim)), np.zeros(0)
        if len(facets):
            corners = domain.geometry.x[dolfinx.mesh.entities_to_geometry(domain, dim - 1, facets)][:, :, :dim]
            tangents = np.einsum("dpn,fni->fpdi", table[1:], corners)
            metric = np.einsum("fpdi,fpei->fpde", tangents, tangents)
            dA = (np.sqrt(np.linalg.det(metric)) * weights).ravel()
            x = np.einsum("pn,fni->fpi", table[0], corners).reshape(-1, dim)
        area, first = mesh.comm.allreduce(float(dA.sum())), mesh.comm.allreduce(dA @ x)
        middle = np.asarray(first / area)
        r = x - middle
        return cls(area, middle, np.asarray(mesh.comm.allreduce(np.einsum("p,pi,pj->ij", dA, r, r))))


def cross_matrix(axis: Floats, dim: int) -> Floats:
    """The matrix K of K r = axis × r, (dim, dim); in the plane the axis is one number."""
    if dim == 2:
        return float(axis[0]) * np.array([[0.0, -1.0], [1.0, 0.0]])
    a, b, c = axis
    return np.array([[0.0, -c, b], [c, 0.0, -a], [-b, a, 0.0]])


@dataclass(frozen=True)
class Moment(DeadLoad, replaceable=()):
    """A moment on a named boundary, by dead tractions t = ω × r about its middle, whose resulting force is nothing.

    moment: about the middle at rest, met exactly on flat facets: a number in the plane, positive from x to y (force
        times length per thickness), (3,) in space.  In space about the normal it is torsion.
    Of a `RigidFace` it is the moment of the face itself, at any rotation.
    history: its share as a function of time, or a `Table`, in place of the program's ramp.

    Example:
        >>> bent = gx.Moment("right", 0.01)
        >>> bent.place
        "on 'right'"
    """

    on: str
    moment: float | tuple[float, ...]
    history: History | None = None

    def __post_init__(self) -> None:
        require_name(self.on, "the boundary of a moment")
        if isinstance(self.moment, (tuple, list, np.ndarray)):
            object.__setattr__(self, "moment", require_vector(self.moment, f"the moment {self.place}"))
        else:
            require_number(self.moment, f"the moment {self.place}", "a finite number", lambda _: True)
        check_history(self.history, f"the moment {self.place}")

    @property
    def place(self) -> str:
        """Where it acts, as a part of a sentence."""
        return f"on '{self.on}'"

    def traction(self, mesh: Mesh) -> Callable[[Floats], Floats]:
        """Force per reference area as a function of position; InputError for a moment it cannot have (collective)."""
        moment = np.atleast_1d(np.array(self.moment, dtype=float))
        if len(moment) != (1 if mesh.dim == 2 else 3):
            wanted = "a number" if mesh.dim == 2 else "three"
            raise InputError(f"the moment {self.place} has {len(moment)} entries: the mesh needs {wanted}")
        face = Face.of(mesh, self.on)
        inertia = (
            np.trace(face.second) * np.eye(3) - face.second if mesh.dim == 3 else np.trace(face.second).reshape(1, 1)
        )
        omega = np.linalg.lstsq(inertia, moment, rcond=FLAT)[0]
        if np.linalg.norm(inertia @ omega - moment) > 1e-9 * np.linalg.norm(moment):
            raise InputError(f"the boundary '{self.on}' is too narrow to bear the moment {place_in_words(moment)}")
        K = cross_matrix(omega, mesh.dim)
        return lambda x: K @ (x[: mesh.dim] - face.middle[:, np.newaxis])


@dataclass(frozen=True)
class Rotation(Held, replaceable=()):
    """A named boundary that is turned, and moved, as a rigid one: u = [R(φ) − I] (X − c) + d.

    angle: φ at full load (radian), any size.  about: c, (dim,) (length); default: the middle of the boundary.
    axis: of φ, (3,), in space; in the plane φ is from x to y.  displacement: d at full load, (dim,) (length).
    free: directions, as numbers from 0, in which the boundary is free to move, as along the axis of a bar in torsion.
    history: share of φ and d as a function of time, or a `Table`, in place of the program's ramp.

    Example:
        >>> import math
        >>> turned = gx.Rotation("right", math.radians(30.0), about=(2.0, 0.5))
        >>> turned.place
        'right'
    """

    on: str
    angle: float
    about: tuple[float, ...] | None = None
    axis: tuple[float, ...] | None = None
    displacement: tuple[float, ...] | None = None
    free: tuple[int, ...] = ()
    history: History | None = None

    def __post_init__(self) -> None:
        require_name(self.on, "the boundary of a rotation")
        what = f"the rotation of '{self.on}'"
        require_number(self.angle, f"the angle of {what}", "a finite number", lambda _: True)
        for name in ("about", "axis", "displacement"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, require_vector(getattr(self, name), f"{name}, of {what},"))
        require_kind(self.free, (tuple, list), f"free, of {what},", "numbers of directions")
        for direction in self.free:
            require_number(direction, f"a free direction of {what}", "0, 1 or 2", lambda i: i in (0, 1, 2))
        check_history(self.history, what)

    @property
    def place(self) -> str:
        """The boundary."""
        return self.on

    def components(self, dim: int) -> list[tuple[int, float]]:
        """Pairs (direction, angle) of the directions that are held; InputError for other dimensions than the mesh's."""
        for name, entries in (("about", dim), ("displacement", dim), ("axis", 3)):
            value: Any = getattr(self, name)
            if value is not None and len(value) != entries:
                raise InputError(
                    f"{name}, of the rotation of '{self.on}', has {len(value)} entries: it needs {entries}"
                )
        if dim == 2 and self.axis is not None:
            raise InputError(
                f"the rotation of '{self.on}' has an axis, and its body is plane, in which angles are from x to y: no "
                "axis, and an angle of that sign, would be right"
            )
        if any(direction >= dim for direction in self.free):
            raise InputError(
                f"the rotation of '{self.on}' is free along direction {max(self.free)} of a body in {dim} dimensions: "
                f"directions from 0 to {dim - 1} would be right"
            )
        if dim == 3 and (self.axis is None or not any(self.axis)):
            raise InputError(
                f"the rotation of '{self.on}' has no axis: (x, y, z), not all of them zero, would be right"
            )
        return [(i, float(self.angle)) for i in range(dim) if i not in self.free]

    def fields(self, mesh: Mesh) -> list[tuple[Callable[[float], float], Callable[[Floats], Floats]]]:
        """Factors of the share, and displacements (points → (dim, points)) that they multiply (collective)."""
        dim = mesh.dim
        centre = Face.of(mesh, self.on).middle if self.about is None else np.array(self.about)
        axis = np.ones(1) if dim == 2 else np.array(self.axis) / np.linalg.norm(np.array(self.axis))
        K = cross_matrix(axis, dim)
        moved = np.zeros(dim) if self.displacement is None else np.array(self.displacement)

        def arms(x: Floats) -> Floats:
            return np.asarray(x[:dim] - centre[:, np.newaxis])

        # Rodrigues: R = I + sin φ K + (1 − cos φ) K².
        return [
            (lambda share: math.sin(share * self.angle), lambda x: K @ arms(x)),
            (lambda share: 1.0 - math.cos(share * self.angle), lambda x: K @ K @ arms(x)),
            (lambda share: share, lambda x: np.tile(moved[:, np.newaxis], x.shape[1])),
        ]
