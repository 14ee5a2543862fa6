"""The initial boundary value problem as frozen data: what grows, how it is held and loaded, and for how long."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar, Protocol

import numpy as np

from growthx.arrays import Floats
from growthx.errors import InputError, require, require_number
from growthx.fields import Field
from growthx.open_loads import OpenLoad

if TYPE_CHECKING:
    from ufl import Measure

    from growthx.growth import GrowthLaw
    from growthx.material import Material
    from growthx.mesh import Mesh
    from growthx.transport import Influx, MassFlux, PrescribedDensity

Position = Callable[[Floats], Floats]


class _Held:
    """What supports share: a displacement, of which some directions may be free."""

    displacement: tuple[float | None, ...] | None

    @property
    def place(self) -> str:
        """Where it holds, as a part of a sentence and as its name."""
        raise NotImplementedError

    def components(self, dim: int) -> list[tuple[int, float]]:
        """Pairs (direction, prescribed value) of the directions that are held."""
        values = (0.0,) * dim if self.displacement is None else self.displacement
        if len(values) != dim:
            raise InputError(
                f"the displacement {values} of the support '{self.place}' has {len(values)} entries: "
                f"the mesh needs {dim}"
            )
        for value in values:
            if value is not None:
                what = f"the displacement of the support '{self.place}'"
                require_number(value, what, "a finite number", lambda _: True)
        return [(i, float(value)) for i, value in enumerate(values) if value is not None]


@dataclass(frozen=True)
class Support(_Held):
    """Prescribed displacement of a named boundary.

    displacement: one entry (length) per direction, None where the boundary is free to move; default: clamped.
    Values other than zero grow with the load.
    """

    on: str
    displacement: tuple[float | None, ...] | None = None

    @property
    def place(self) -> str:
        """The boundary."""
        return self.on


@dataclass(frozen=True)
class PointSupport(_Held):
    """Prescribed displacement of the node at a place.

    at: the place at rest, one entry (length) per direction.  displacement: as in `Support`.
    """

    at: tuple[float, ...]
    displacement: tuple[float | None, ...] | None = None

    @property
    def place(self) -> str:
        """The place, as text."""
        return "({})".format(", ".join(f"{x:g}" for x in self.at))


class Load(Protocol):
    """A dead load on a named boundary or in the body."""

    @property
    def place(self) -> str:
        """Where it acts, as a part of a sentence."""
        ...

    def measure(self, mesh: Mesh, degree: int) -> Measure:
        """What it is integrated over, exactly for polynomials of `degree`; InputError if the mesh has no such part."""
        ...

    def intensity(self, x: Floats) -> Floats:
        """Force per area, or volume, at the points x, (3, points), shape (dim, points).

        Up to a factor if there is a resultant.
        """
        ...

    @property
    def resultant(self) -> tuple[float, ...] | None:
        """The resulting force the load must be scaled to, or None where it is meant as it is."""
        ...

    @property
    def history(self) -> Callable[[float], float] | None:
        """Its share as a function of time, in place of the program's ramp."""
        ...


def _vector(values: tuple[float, ...], what: str) -> tuple[float, ...]:
    for value in values:
        require_number(value, what, "a finite number", lambda _: True)
    return tuple(float(value) for value in values)


def _at(value: tuple[float, ...] | Position, x: Floats) -> Floats:
    """A vector, or a function of position, at the points x, shape (dim, points)."""
    if callable(value):
        return value(x)
    return np.tile(np.array(value, dtype=float)[:, np.newaxis], x.shape[1])


class _OnBoundary:
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
class Traction(_OnBoundary):
    """Dead traction per reference area: a vector, or a function of position x, (3, points) to (dim, points).

    history: its share as a function of time, in place of the program's ramp.
    """

    on: str
    value: tuple[float, ...] | Position
    history: Callable[[float], float] | None = None
    resultant: ClassVar[None] = None

    def __post_init__(self) -> None:
        if not callable(self.value):
            _vector(self.value, f"a component of the traction {self.place}")

    def intensity(self, x: Floats) -> Floats:
        """Traction at the points x."""
        return _at(self.value, x)


@dataclass(frozen=True)
class BodyForce:
    """Dead momentum source b̄₀ per reference volume (8): a vector, or a function of position as in `Traction`.

    region: name of the region it acts in; None: everywhere.  history: as in `Traction`.
    """

    value: tuple[float, ...] | Position
    region: str | None = None
    history: Callable[[float], float] | None = None
    resultant: ClassVar[None] = None

    def __post_init__(self) -> None:
        if not callable(self.value):
            _vector(self.value, f"a component of the body force {self.place}")

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
class DistributedForce(_OnBoundary):
    """A force spread over a named boundary as parallel tractions in proportion to `weight`.

    force: resultant (force; in two dimensions force per thickness), met exactly on every mesh.
    weight: function of position x, (3, points) to (points,), at least 0; None: uniform.
    case: the load case it belongs to, for pictures.  history: as in `Traction`.
    """

    on: str
    force: tuple[float, ...]
    weight: Position | None = None
    case: str = "load"
    history: Callable[[float], float] | None = None

    def __post_init__(self) -> None:
        _vector(self.force, f"a component of the force {self.place}")

    @property
    def resultant(self) -> tuple[float, ...]:
        """The force."""
        return self.force

    def intensity(self, x: Floats) -> Floats:
        """Force times weight at the points x."""
        weight = np.ones(x.shape[1]) if self.weight is None else self.weight(x)
        return np.outer(self.force, weight)


@dataclass(frozen=True)
class Program:
    """Time steps and load ramp.

    step: nominal time step Δt; until: end time; ramp: time over which loads and displacements grow linearly from zero.
    """

    step: float
    until: float
    ramp: float = 0.0

    def __post_init__(self) -> None:
        require_number(self.step, "the time step Δt", "a positive number", lambda dt: dt > 0)
        require_number(self.until, "the end time", "a positive number", lambda t: t > 0)
        require_number(self.ramp, "the duration of the load ramp", "a number of at least 0", lambda t: t >= 0)
        if self.until / self.step > 1e7:
            raise InputError(
                f"the time step Δt is {self.step:g} for an end time of {self.until:g}: more than ten million steps"
            )

    def times(self) -> Floats:
        """The times that must be hit: multiples of the step, then the end time exactly."""
        count = math.ceil(self.until / self.step * (1 - 1e-12))
        return np.append(self.step * np.arange(1, count), self.until)

    def amplitude(self, time: float) -> float:
        """Share of the loads at a time, from 0 to 1."""
        # A step meant to end the ramp may miss its end by a rounding error.
        return 1.0 if time >= self.ramp * (1 - 1e-12) else time / self.ramp


@dataclass(frozen=True)
class LoadCase:
    """Loads that act at their own times, with a displacement of their own: an activity of the day.

    weight: its part of the daily cycles, up to a factor.
    """

    name: str
    weight: float
    loads: tuple[Load | OpenLoad, ...]

    def __post_init__(self) -> None:
        require_number(self.weight, f"the weight of the load case '{self.name}'", "a positive number", lambda w: w > 0)


@dataclass(frozen=True)
class Inertia:
    """The rate of momentum ρ ṗ in the balance of momentum (4), by implicit Euler (Remark 4.2).

    The density must then be in units consistent with force, length and time.
    lumped: mass at the corners of the cells, which densities at integration points do not know.
    """

    lumped: bool = False


@dataclass(frozen=True)
class Scene:
    """An initial boundary value problem of growth.

    loads: dead ones, and `OpenLoad`s, which depend on the state.
    cases: if there are any, each has its own displacement, under its own loads and `loads`, and the density is driven
    by the weighted mean of their elastic energies; all are solved for at once.
    flux, prescribed_densities, influx: what moves mass, for densities that are continuous between cells.
    inertia: present where the balance of momentum is not quasi-static.
    initial_density: ρ(0), a number or a field; default: the material's reference density.
    growing: names of the regions that grow; default: everywhere.  Elsewhere the density stays as it is at no cost.
    """

    name: str
    mesh: Mesh
    material: Material
    growth: GrowthLaw
    supports: tuple[Support | PointSupport, ...]
    loads: tuple[Load | OpenLoad, ...]
    program: Program
    initial_density: Field | None = None
    growing: tuple[str, ...] | None = None
    flux: MassFlux | None = None
    prescribed_densities: tuple[PrescribedDensity, ...] = ()
    influx: tuple[Influx, ...] = ()
    inertia: Inertia | None = None
    cases: tuple[LoadCase, ...] = ()

    def __post_init__(self) -> None:
        require(self.start_density, "the initial density ρ(0)", "a positive number", lambda rho: rho > 0)
        if self.mesh.cell_count == 0:
            raise InputError(f"the mesh of the scene '{self.name}' has no cells: at least one is needed")
        for boundary in (*self.supports, *self.prescribed_densities, *self.influx):
            if not isinstance(boundary, PointSupport):
                self.mesh.boundary(boundary.on)
        if self.inertia is not None and len(self.cases) > 1:
            raise InputError(
                f"{len(self.cases)} load cases of one day have no common motion: no inertia would be right"
            )
        if len({case.name for case in self.cases}) < len(self.cases):
            names = ", ".join(f"'{case.name}'" for case in self.cases)
            raise InputError(f"the load cases are named {names}: a name of its own for each would be right")
        for open_load in self.open_loads:
            if open_load.on is not None:
                self.mesh.boundary(open_load.on)
        held = [support.components(self.mesh.dim) for support in self.supports]
        if not any(held):
            raise InputError(f"the scene '{self.name}' has no support: without one the body is free to move")
        for load in self.dead_loads:
            load.measure(self.mesh, 1)
            entries = len(load.intensity(self.mesh.domain.geometry.x[:1].T))
            if entries != self.mesh.dim:
                raise InputError(f"the load {load.place} has {entries} entries: the mesh needs {self.mesh.dim}")
        if isinstance(self.growing, str):
            raise InputError(f"growing is '{self.growing}': names in a tuple, ('{self.growing}',), would be right")
        if self.growing == ():
            raise InputError(f"no region of the scene '{self.name}' grows: name one, or None for the whole body")
        for region in self.growing or ():
            self.mesh.region(region)

    @property
    def load_cases(self) -> tuple[LoadCase, ...]:
        """The load cases with all of their loads and weights whose sum is one; one without a name if there are none."""
        cases = self.cases or (LoadCase("", 1.0, ()),)
        total = sum(case.weight for case in cases)
        return tuple(replace(case, weight=case.weight / total, loads=self.loads + case.loads) for case in cases)

    @property
    def all_loads(self) -> tuple[Load | OpenLoad, ...]:
        """The loads that all cases share, and those of each."""
        return self.loads + tuple(load for case in self.cases for load in case.loads)

    @property
    def dead_loads(self) -> tuple[Load, ...]:
        """The loads that do not depend on the state, of all cases."""
        return tuple(load for load in self.all_loads if not isinstance(load, OpenLoad))

    @property
    def open_loads(self) -> tuple[OpenLoad, ...]:
        """The loads that depend on the state, of all cases."""
        return tuple(load for load in self.all_loads if isinstance(load, OpenLoad))

    @property
    def moves_mass(self) -> bool:
        """Whether mass moves through the body or across its boundary."""
        return bool(self.flux or self.prescribed_densities or self.influx)

    @property
    def start_density(self) -> Field:
        """ρ(0) with its default filled in."""
        return self.material.reference_density if self.initial_density is None else self.initial_density
