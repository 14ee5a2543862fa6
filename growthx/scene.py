"""The initial boundary value problem as frozen data: what grows, how it is held and loaded, and for how long."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from growthx.arrays import Floats
from growthx.errors import (
    InputError,
    raise_on_all,
    require,
    require_each,
    require_kind,
    require_name,
    require_number,
)
from growthx.fields import Field, vector
from growthx.growth import GrowthLaw
from growthx.loads import Load, LoadCase
from growthx.material import Material
from growthx.mesh import Mesh
from growthx.open_loads import OpenLoad
from growthx.supports import PointSupport, Support
from growthx.transport import Influx, MassFlux, PrescribedDensity


@dataclass(frozen=True)
class Program:
    """Time steps and load ramp.

    step: nominal time step Δt; until: end time; ramp: time over which loads and displacements grow linearly from zero.
    requested: other times at which a step is to end.
    """

    step: float
    until: float
    ramp: float = 0.0
    requested: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        require_number(self.step, "the time step Δt", "a positive number", lambda dt: dt > 0)
        require_number(self.until, "the end time", "a positive number", lambda t: t > 0)
        require_number(self.ramp, "the duration of the load ramp", "a number of at least 0", lambda t: t >= 0)
        if self.until / self.step > 1e7:
            raise InputError(
                f"the time step Δt is {self.step:g} for an end time of {self.until:g}: more than ten million steps"
            )
        require_kind(self.requested, (tuple, list, np.ndarray), "the requested times", "a tuple of times")
        for time in self.requested:
            require_number(time, "a requested time", f"one above 0 and up to {self.until:g}", self._is_within)

    def times(self) -> Floats:
        """The times that must be hit: multiples of the step and requested ones, then the end time exactly."""
        count = math.ceil(self.until / self.step * (1 - 1e-12))
        return self._with_requested(self.step * np.arange(1, count))

    def landmarks(self) -> Floats:
        """The times that must be hit whatever the step: the end of the ramp, requested ones, the end time exactly."""
        return self._with_requested(np.array([self.ramp] if 0 < self.ramp < self.until else []))

    def _is_within(self, time: float) -> bool:
        return 0 < time <= self.until

    def _with_requested(self, some: Floats) -> Floats:
        """Some times, the requested ones and the end, in order, each once: rounding errors do not make two of one."""
        exact = np.array([*self.requested, self.until])
        apart = np.abs(np.subtract.outer(some, exact)).min(axis=1) > 1e-9 * self.step
        return np.unique(np.concatenate([some[apart], exact]))

    def amplitude(self, time: float) -> float:
        """Share of the loads at a time, from 0 to 1."""
        # A step meant to end the ramp may miss its end by a rounding error.
        return 1.0 if time >= self.ramp * (1 - 1e-12) else time / self.ramp


@dataclass(frozen=True)
class Inertia:
    """The rate of momentum ρ ṗ in the balance of momentum (4), by implicit Euler (Remark 4.2).

    The density must then be in units consistent with force, length and time.
    lumped: mass at the corners of the cells, which densities at integration points do not know.
    """

    lumped: bool = False

    def __post_init__(self) -> None:
        require_kind(self.lumped, bool, "lumped, of the inertia,", "True or False")


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
        self._check_kinds()
        require(self.start_density, "the initial density ρ(0)", "a positive number", lambda rho: rho > 0)
        if self.mesh.cell_count == 0:
            raise InputError(f"the mesh of the scene '{self.name}' has no cells: at least one is needed")
        for boundary in (*self.supports, *self.prescribed_densities, *self.influx):
            if not isinstance(boundary, PointSupport):
                self.mesh.boundary(boundary.on)
        low, high = self.growth.limits
        for prescribed in self.prescribed_densities:
            if not low <= prescribed.density <= high:
                raise InputError(
                    f"the density held on '{prescribed.on}' is {prescribed.density:g}: one within the bounds of "
                    f"density, {low:g} to {high:g}, would be right"
                )
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
        springs = any(load.may_hold for load in self.open_loads)
        if not (any(held) or springs or self.inertia):
            raise InputError(f"the scene '{self.name}' has no support: without one the body is free to move")
        for load in self.dead_loads:
            load.measure(self.mesh, 1)
            self._check_entries(load)
        if isinstance(self.growing, str):
            raise InputError(f"growing is '{self.growing}': names in a tuple, ('{self.growing}',), would be right")
        if self.growing is not None:
            object.__setattr__(self, "growing", require_each(self.growing, str, "growing", "region's name"))
        if self.growing == ():
            raise InputError(f"no region of the scene '{self.name}' grows: name one, or None for the whole body")
        for region in self.growing or ():
            self.mesh.region(region)

    def _check_kinds(self) -> None:
        require_name(self.name, "the name of the scene")
        of = f"of the scene '{self.name}'"
        for value, kind, what, wanted in (
            (self.mesh, Mesh, "the mesh", "a growthx.Mesh, as meshing.read or Mesh.with_names makes them,"),
            (self.material, Material, "the material", "a Material"),
            (self.growth, GrowthLaw, "the growth", "a GrowthLaw"),
            (self.program, Program, "the program", "a Program"),
            (self.flux, (MassFlux, type(None)), "the flux", "a MassFlux or None"),
            (self.inertia, (Inertia, type(None)), "the inertia", "an Inertia or None"),
        ):
            require_kind(value, kind, f"{what} {of}", wanted)
        parts: tuple[tuple[str, type | tuple[type, ...], str], ...] = (
            ("supports", (Support, PointSupport), "Support"),
            ("loads", (Load, OpenLoad), "load"),
            ("prescribed_densities", PrescribedDensity, "PrescribedDensity"),
            ("influx", Influx, "Influx"),
            ("cases", LoadCase, "LoadCase"),
        )
        for name, kinds, wanted in parts:
            object.__setattr__(self, name, require_each(getattr(self, name), kinds, f"{name} {of}", wanted))

    def _check_entries(self, load: Load) -> None:
        problem, dim = "", self.mesh.dim
        try:
            entries = len(vector(load.intensity)(self.mesh.domain.geometry.x[:1].T))
            if entries != dim:
                problem = f"the load {load.place} has {entries} entries: the mesh needs {dim}"
        except InputError as error:
            problem = f"the load {load.place} cannot be told: {error}"
        raise_on_all(self.mesh.domain.comm, problem)

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
