"""Dead loads: forces per reference area or volume that do not depend on the state, and the cases they act in."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from growthx.common.arrays import Floats
from growthx.common.checks import (
    is_function,
    require_each,
    require_function,
    require_name,
    require_number,
    require_vector,
)
from growthx.common.overrides import Sealed
from growthx.meshing.fields import scalar, vector
from growthx.model.actions.concentrated import NodalLoad
from growthx.model.actions.dead import DeadLoad
from growthx.model.actions.faces import Moment
from growthx.model.actions.histories import check_history
from growthx.model.arrows import Arrow, middle, resultant
from growthx.model.open_loads import OpenLoad

if TYPE_CHECKING:
    from ufl import Measure

    from growthx.meshing.mesh import Mesh

Position = Callable[[Floats], Floats]


class Load(DeadLoad, ABC, replaceable=("place", "measure", "intensity", "resultant", "history", "arrow")):
    """A dead load on a named boundary or in the body.

    Example:
        >>> [load.place for load in gx.scenes.plate(2).loads if isinstance(load, gx.Load)]
        ["on 'right'"]
    """

    @abstractmethod
    def measure(self, mesh: Mesh, degree: int) -> Measure:
        """What it is integrated over, exactly for polynomials of `degree`; InputError if the mesh has no such part."""

    @abstractmethod
    def intensity(self, x: Floats) -> Floats:
        """Force per area, or volume, at the points x, (3, points), shape (dim, points).

        Up to a factor if there is a resultant.
        """

    @property
    def resultant(self) -> tuple[float, ...] | None:
        """The resulting force the load must be scaled to, or None where it is meant as it is."""
        return None


def _value(value: Any, what: str) -> Any:
    """A function of position as it is, or the numbers of a vector; InputError if it is neither."""
    return value if is_function(value) else require_vector(value, what)


def _at(value: tuple[float, ...] | Position, x: Floats) -> Floats:
    """A vector, or a function of position, at the points x, shape (dim, points)."""
    if callable(value):
        return vector(value)(x)
    return np.tile(np.array(value, dtype=float)[:, np.newaxis], x.shape[1])


class _OnBoundary(Load, replaceable=()):
    """A load on a named boundary."""

    on: str

    @property
    def place(self) -> str:
        """Where it acts, as a part of a sentence."""
        return f"on '{self.on}'"

    def measure(self, mesh: Mesh, degree: int) -> Measure:
        """The boundary's area."""
        return mesh.boundary_measure(self.on, degree)


@dataclass(frozen=True)
class Traction(_OnBoundary, replaceable=()):
    """Dead traction per reference area: a vector, or a function of position x, (3, points) to (dim, points).

    history: its share as a function of time, in place of the program's ramp.

    Example:
        >>> sheared = gx.Traction("right", lambda x: 0.02 * x[:2], history=lambda time: min(time, 1.0))
        >>> sheared.place
        "on 'right'"
    """

    on: str
    value: tuple[float, ...] | Position
    history: Callable[[float], float] | None = None

    def __post_init__(self) -> None:
        require_name(self.on, "the boundary of a traction")
        object.__setattr__(self, "value", _value(self.value, f"the traction {self.place}"))
        check_history(self.history, f"the traction {self.place}")

    def intensity(self, x: Floats) -> Floats:
        """Traction at the points x."""
        return _at(self.value, x)

    def arrow(self, mesh: Mesh) -> Arrow:
        """Its resultant, nothing of one that balances itself, at the mean position, weighted by traction."""
        force = self.resultant or resultant(mesh, self.on, self.intensity)
        return Arrow(tuple(force), middle(mesh, self.on, self.intensity))


@dataclass(frozen=True)
class BodyForce(Load, replaceable=()):
    """Dead momentum source b̄₀ per reference volume (8): a vector, or a function of position as in `Traction`.

    region: name of the region it acts in; None: everywhere.  history: as in `Traction`.

    Example:
        >>> weight = gx.BodyForce((0.0, -0.01))
        >>> weight.place
        'in the whole body'
    """

    value: tuple[float, ...] | Position
    region: str | None = None
    history: Callable[[float], float] | None = None

    def __post_init__(self) -> None:
        if self.region is not None:
            require_name(self.region, "the region of a body force")
        object.__setattr__(self, "value", _value(self.value, f"the body force {self.place}"))
        check_history(self.history, f"the body force {self.place}")

    @property
    def place(self) -> str:
        """Where it acts, as a part of a sentence."""
        return "in the whole body" if self.region is None else f"in '{self.region}'"

    def measure(self, mesh: Mesh, degree: int) -> Measure:
        """The region's volume."""
        return mesh.volume_measure(self.region, degree)

    def intensity(self, x: Floats) -> Floats:
        """Force per volume at the points x."""
        return _at(self.value, x)


@dataclass(frozen=True)
class DistributedForce(_OnBoundary, replaceable=()):
    """A force spread over a named boundary as parallel tractions in proportion to `weight`.

    force: resultant (force; in two dimensions force per thickness), met exactly on every mesh.
    weight: function of position x, (3, points) to (points,), at least 0; None: uniform.
    case: the load case it belongs to, for pictures.  history: as in `Traction`.

    Example:
        >>> joint = gx.DistributedForce("right", (0.0, -0.02), weight=lambda x: x[1])
        >>> joint.resultant
        (0.0, -0.02)
    """

    on: str
    force: tuple[float, ...]
    weight: Position | None = None
    case: str = "load"
    history: Callable[[float], float] | None = None

    def __post_init__(self) -> None:
        require_name(self.on, "the boundary of a force")
        object.__setattr__(self, "force", require_vector(self.force, f"the force {self.place}"))
        if self.weight is not None:
            require_function(self.weight, f"the weight of the force {self.place}", "a function of position or None")
        check_history(self.history, f"the force {self.place}")

    @property
    def resultant(self) -> tuple[float, ...]:
        """The force."""
        return self.force

    def intensity(self, x: Floats) -> Floats:
        """Force times weight at the points x."""
        weight = np.ones(x.shape[1]) if self.weight is None else scalar(self.weight)(x)
        return np.outer(self.force, weight)

    def arrow(self, mesh: Mesh) -> Arrow:
        """Its resultant at the mean position of the boundary, weighted by traction, in the colour of its load case."""
        return Arrow(self.resultant, middle(mesh, self.on, self.intensity), self.case)


@dataclass(frozen=True)
class LoadCase(Sealed, replaceable=()):
    """Loads that act at their own times, with a displacement of their own: an activity of the day.

    weight: its part of the daily cycles, up to a factor.

    Example:
        >>> stance = gx.LoadCase("stance", 6000.0, (gx.Traction("right", (0.0, -0.02)),))
        >>> stairs = gx.LoadCase("stairs", 2000.0, (gx.Traction("right", (0.01, -0.03)),))
        >>> stance.weight / (stance.weight + stairs.weight)
        0.75
    """

    name: str
    weight: float
    loads: tuple[Load | NodalLoad | Moment | OpenLoad, ...]

    def __post_init__(self) -> None:
        require_name(self.name, "the name of a load case")
        require_number(self.weight, f"the weight of the load case '{self.name}'", "a positive number", lambda w: w > 0)
        loads = require_each(
            self.loads, (Load, NodalLoad, Moment, OpenLoad), f"the loads of the load case '{self.name}'", "load"
        )
        object.__setattr__(self, "loads", loads)
