"""Dead forces at points of the body, at its nodes and along curves on it: consistent with any displacement's space.

A force at a place works on each unknown of the displacement by that one's shape function there: all on the corner where
there is one, shared between the unknowns of the cell elsewhere.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from growthx.common.checks import is_function, require_kind, require_name, require_number, require_vector
from growthx.common.errors import InputError, shown
from growthx.common.words import place_in_words
from growthx.meshing.surfaces.nodes import check_on_body, node_places
from growthx.model.actions.dead import DeadLoad
from growthx.model.actions.histories import check_history
from growthx.model.arrows import Arrow

if TYPE_CHECKING:
    from growthx.common.arrays import Floats
    from growthx.meshing.mesh import Mesh
    from growthx.meshing.surfaces.nodes import Spots


class NodalLoad(DeadLoad, ABC, replaceable=("points", "within")):
    """A dead load of forces at places on the body.

    within: how far from the body a place may be (length); its force is then at the nearest point of the body.

    Example:
        >>> muscle = gx.LineForce([(0.0, 1.0), (2.0, 1.0)], (0.0, 0.1))
        >>> isinstance(muscle, gx.NodalLoad), isinstance(gx.Traction("top", (0.0, 0.1)), gx.NodalLoad)
        (True, False)
    """

    within: float = 0.0

    @abstractmethod
    def points(self, mesh: Mesh) -> tuple[Floats, Floats]:
        """Places, (places, dim), and the force at each, (places, dim), the same on all ranks (collective)."""

    def spots(self, mesh: Mesh) -> tuple[Spots, Floats]:
        """Where on the body each place is, and the forces, (places, dim); InputError if it is none (collective)."""
        places, forces = self.points(mesh)
        for what, rows in (("places", places), ("forces", forces)):
            if np.ndim(rows) != 2 or np.shape(rows)[1] != mesh.dim:
                raise InputError(
                    f"the {what} of the load {self.place} have {np.shape(rows)[-1]} entries: the mesh needs {mesh.dim}"
                )
        return check_on_body(mesh, places, f"the load {self.place}", self.within), forces

    def total(self, mesh: Mesh) -> Floats:
        """The resulting force, (dim,) (collective)."""
        return np.asarray(self.points(mesh)[1].sum(axis=0))


@dataclass(frozen=True)
class PointForce(NodalLoad, replaceable=()):
    """A force at a point of the body, which need not be a node.

    point: at rest, (dim,) (length).  force: (dim,) (force; in two dimensions per thickness).
    history: its share as a function of time, in place of the program's ramp.  case: the load case, for pictures.

    Example:
        >>> pulled = gx.PointForce((2.0, 0.5), (0.01, 0.0))
        >>> print(pulled.place)
        at (2, 0.5)
    """

    point: tuple[float, ...]
    force: tuple[float, ...]
    history: Callable[[float], float] | None = None
    case: str = "load"

    def __post_init__(self) -> None:
        object.__setattr__(self, "point", require_vector(self.point, "the point of a force"))
        object.__setattr__(self, "force", require_vector(self.force, f"the force {self.place}"))
        check_history(self.history, f"the force {self.place}")
        require_name(self.case, f"the case of the force {self.place}")

    @property
    def place(self) -> str:
        """Where it acts, as a part of a sentence."""
        return f"at {place_in_words(self.point)}"

    def points(self, mesh: Mesh) -> tuple[Floats, Floats]:
        """The point and the force."""
        return np.array([self.point]), np.array([self.force])

    def arrow(self, mesh: Mesh) -> Arrow:
        """The force at its point."""
        return Arrow(self.force, self.point, self.case)


@dataclass(frozen=True)
class NodalForces(NodalLoad, replaceable=()):
    """A force at each of some nodes.

    nodes: the name of a set of nodes of the mesh's file, or of a boundary (the corners of its sides); a function of
        position x, (3, nodes) to booleans; or numbers of nodes in the order of the file.
    force: of each node, (dim,), or one row for each number of a node, (nodes, dim) (force; per thickness in the plane).
    history, case: as of `PointForce`.

    Example:
        >>> pulled = gx.NodalForces("right", (0.01, 0.0))
        >>> print(pulled.place)
        at the nodes 'right'
    """

    nodes: Any
    force: Any
    history: Callable[[float], float] | None = None
    case: str = "load"

    def __post_init__(self) -> None:
        if not (isinstance(self.nodes, str) or is_function(self.nodes)):
            require_kind(self.nodes, (tuple, list, np.ndarray), "the nodes of forces", "a name, a function or numbers")
            object.__setattr__(self, "nodes", tuple(np.asarray(self.nodes).tolist()))
        object.__setattr__(self, "force", self._checked_force())
        check_history(self.history, f"the forces {self.place}")
        require_name(self.case, f"the case of the forces {self.place}")

    def _checked_force(self) -> tuple[Any, ...]:
        what = f"the force {self.place}"
        if np.ndim(self.force) < 2:
            counts = Counter(map(str, self.nodes)) if isinstance(self.nodes, tuple) else {}
            if twice := next((node for node, count in counts.items() if count > 1), None):
                raise InputError(
                    f"the nodes of {what} have {twice} among them {counts[twice]} times, and it is of each node: each "
                    "once, or a row of forces for each number, would be right"
                )
            return require_vector(self.force, what)
        rows = tuple(require_vector(tuple(row), f"a row of {what}") for row in self.force)
        if not isinstance(self.nodes, tuple) or len(rows) != len(self.nodes):
            count = (
                f"{len(self.nodes)} nodes" if isinstance(self.nodes, tuple) else f"nodes given by {shown(self.nodes)}"
            )
            raise InputError(
                f"{what} has {len(rows)} rows for {count}: one row for each number of a node would be right"
            )
        return rows

    @property
    def place(self) -> str:
        """Where it acts, as a part of a sentence."""
        if isinstance(self.nodes, tuple):
            return f"at {len(self.nodes)} nodes"
        return f"at the nodes '{self.nodes}'" if isinstance(self.nodes, str) else "at nodes"

    def points(self, mesh: Mesh) -> tuple[Floats, Floats]:
        """The nodes and their forces."""
        places, forces = node_places(mesh, self.nodes, f"of the load {self.place}"), np.array(self.force, dtype=float)
        return places, forces if forces.ndim == 2 else np.tile(forces, (len(places), 1))

    def arrow(self, mesh: Mesh) -> Arrow:
        """Their resultant in the middle of the nodes."""
        places, forces = self.points(mesh)
        return Arrow(tuple(forces.sum(axis=0).tolist()), tuple(places.mean(axis=0).tolist()), self.case)


@dataclass(frozen=True)
class LineForce(NodalLoad, replaceable=()):
    """A force spread along a curve on the body, as a muscle pulls along its line of insertion.

    curve: corners of a polygon, (corners, dim) (length), two at least.  force: resultant, (dim,), met exactly on every
        mesh (force; in two dimensions per thickness); the same on each part of equal length.
    parts: points per side of the polygon at which it acts, which should be closer than the nodes.
    within: how far the curve may be from the body (length), at whose nearest points it then acts.
    history, case: as of `PointForce`.

    Example:
        >>> muscle = gx.LineForce([(0.0, 1.0), (1.0, 1.0), (2.0, 1.0)], (0.0, 0.1), within=0.1)
        >>> print(muscle.place)
        along the curve from (0, 1) to (2, 1)
    """

    curve: Any
    force: tuple[float, ...]
    within: float = 0.0
    parts: int = 20
    history: Callable[[float], float] | None = None
    case: str = "load"

    def __post_init__(self) -> None:
        require_kind(self.curve, (tuple, list, np.ndarray), "the curve of a force", "rows of coordinates")
        rows = tuple(
            require_vector(tuple(np.atleast_1d(row)), "a corner of the curve of a force") for row in self.curve
        )
        object.__setattr__(self, "curve", rows)
        if len(rows) < 2 or len({len(row) for row in rows}) > 1 or not self._lengths().sum() > 0:
            raise InputError(f"the curve of a force is {shown(rows)}: two different corners at least would be right")
        object.__setattr__(self, "force", require_vector(self.force, f"the force {self.place}"))
        require_number(self.within, f"the distance within of the force {self.place}", "at least 0", lambda d: d >= 0)
        require_number(self.parts, f"the parts of the force {self.place}", "a whole number from 1", _is_whole)
        check_history(self.history, f"the force {self.place}")
        require_name(self.case, f"the case of the force {self.place}")

    def _lengths(self) -> Floats:
        return np.asarray(np.linalg.norm(np.diff(np.array(self.curve), axis=0), axis=1))

    @property
    def place(self) -> str:
        """Where it acts, as a part of a sentence."""
        return f"along the curve from {place_in_words(self.curve[0])} to {place_in_words(self.curve[-1])}"

    def points(self, mesh: Mesh) -> tuple[Floats, Floats]:
        """The middles of equal parts of each side, and their shares of the force."""
        corners, lengths = np.array(self.curve), self._lengths()
        shares = (np.arange(self.parts) + 0.5) / self.parts
        places = corners[:-1, np.newaxis] + shares[:, np.newaxis] * np.diff(corners, axis=0)[:, np.newaxis]
        weights = np.repeat(lengths / lengths.sum() / self.parts, self.parts)
        return places.reshape(-1, corners.shape[1]), np.outer(weights, self.force)

    def arrow(self, mesh: Mesh) -> Arrow:
        """The resultant at the middle of the curve."""
        places, _forces = self.points(mesh)
        weights = self._lengths().repeat(self.parts)
        return Arrow(self.force, tuple((weights @ places / weights.sum()).tolist()), self.case)


def _is_whole(value: float) -> bool:
    return value >= 1 and value == int(value)
