"""The initial boundary value problem as frozen data: what grows, how it is held and loaded, and for how long."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from numbers import Real

from growthx.common.arrays import Field
from growthx.common.checks import require, require_each, require_kind, require_name
from growthx.common.communicators import require_same_on_all
from growthx.common.errors import InputError, raise_on_all, shown
from growthx.common.overrides import Sealed, is_foreign
from growthx.constitutive.energies import Elasticity
from growthx.constitutive.flux import MassFlux
from growthx.constitutive.kinematics import Plane
from growthx.constitutive.sources import MassSource
from growthx.meshing.fields import vector
from growthx.meshing.mesh import Mesh
from growthx.model import words
from growthx.model.actions.concentrated import NodalLoad
from growthx.model.actions.faces import Moment, Rotation
from growthx.model.actions.histories import History, jumps_of
from growthx.model.actions.rigid import RigidFace
from growthx.model.inertia import Inertia
from growthx.model.loads import Load, LoadCase
from growthx.model.open_loads import OpenLoad, Pressure
from growthx.model.program import Program
from growthx.model.supports import PointSupport, Support
from growthx.model.transport import Influx, PrescribedDensity


@dataclass(frozen=True)
class Scene(Sealed, replaceable=()):
    """An initial boundary value problem of growth.

    loads: dead ones, and `OpenLoad`s, which depend on the state; none where all are in `cases`.
    program: to be given, as all before it but loads.
    cases: if there are any, each has its own displacement, under its own loads and `loads`, and the density is driven
    by the weighted mean of their elastic energies; all are solved for at once.
    flux, prescribed_densities, influx: what moves mass, for densities that are continuous between cells.
    inertia: present where the balance of momentum is not quasi-static.
    initial_density: ρ(0), a number or a field; default: the material's reference density.  `transfer(result, mesh,
    variant)` goes on from the end of a run, by any variant on any mesh, under its loads if the program has no ramp: in
    one, bone that was in equilibrium with them is resorbed until they are back.
    growing: names of the regions that grow; default: everywhere.  Elsewhere the density stays as it is at no cost, and
    stiffness is what the material's energy says, without the weight of a density.
    plane: of a plane body, `Plane.STRAIN`, the default, or `Plane.STRESS`; their names "strain" and "stress" will do.

    Example:
        >>> mesh, law = gx.scenes.plate(2).mesh, gx.EnergyDrivenGrowth(0.02, 10.0)
        >>> held, pulled = (gx.Support("left"),), (gx.Traction("right", (0.0, -0.02)),)
        >>> scene = gx.Scene("plate", mesh, gx.Material(1.0), law, held, pulled, gx.Program(0.1, 2.5, ramp=0.5))
        >>> scene.loads[0].place
        "on 'right'"
    """

    name: str
    mesh: Mesh
    material: Elasticity
    growth: MassSource
    supports: tuple[Support | PointSupport | Rotation | RigidFace, ...]
    loads: tuple[Load | NodalLoad | Moment | OpenLoad, ...] = ()
    program: Program = None  # type: ignore[assignment]  # behind what may be left out; `None` is refused
    initial_density: Field | None = None
    growing: tuple[str, ...] | None = None
    flux: MassFlux | None = None
    prescribed_densities: tuple[PrescribedDensity, ...] = ()
    influx: tuple[Influx, ...] = ()
    inertia: Inertia | None = None
    cases: tuple[LoadCase, ...] = ()
    plane: Plane | str = Plane.STRAIN

    def __post_init__(self) -> None:
        if isinstance(self.mesh, Mesh):
            told = {part.name: getattr(self, part.name) for part in fields(self) if part.name != "mesh"}
            require_same_on_all(self.mesh.comm, told, f" of the scene '{self.name}'")
        self._check_kinds()
        wanted = "a positive number" if isinstance(self.start_density, (Real, Mapping)) else words.A_DENSITY
        require(self.start_density, "the initial density ρ(0)", wanted, lambda rho: rho > 0)
        if self.mesh.cell_count == 0:
            raise InputError(f"the mesh of the scene '{self.name}' has no cells: at least one is needed")
        if any(is_foreign(type(law)) for law in (self.growth, self.material)) or not self.material.is_of_a_power:
            from growthx.model import probes  # asked for by those who write laws of their own

            raise_on_all(self.mesh.comm, probes.trouble(self.growth, self.material, self.mesh))
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
        self._check_plane()
        self._check_pressures()
        held = [support.components(self.mesh.dim) for support in self.supports]
        springs = any(load.may_hold for load in self.open_loads)
        if not (any(held) or springs or self.inertia):
            raise InputError(
                f"the scene '{self.name}' has no support: without one the body is free to move, and a gx.Support among "
                "its supports would be right"
            )
        for load in self.dead_loads:
            if isinstance(load, NodalLoad):
                load.spots(self.mesh)
            elif isinstance(load, Moment):
                load.traction(self.mesh)
            else:
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

    # In short: on its own, a dataclass shows every index of the mesh.
    def __repr__(self) -> str:
        return f"Scene({words.scene_in_short(self)})"

    def __str__(self) -> str:
        return words.scene_in_words(self)

    def _check_kinds(self) -> None:
        require_name(self.name, "the name of the scene")
        of = f"of the scene '{self.name}'"
        for value, kind, what, wanted in (
            (self.mesh, Mesh, "the mesh", "a growthx.Mesh, as meshing.read or Mesh.with_names makes them,"),
            (self.material, Elasticity, "the material", "a Material or a StoredEnergy of one's own"),
            (self.growth, MassSource, "the growth", "a GrowthLaw or a MassSource of one's own"),
            (self.program, Program, "the program", "a Program"),
            (self.flux, (MassFlux, type(None)), "the flux", "a MassFlux or None"),
            (self.inertia, (Inertia, type(None)), "the inertia", "an Inertia or None"),
        ):
            require_kind(value, kind, f"{what} {of}", wanted)
        parts: tuple[tuple[str, type | tuple[type, ...], str], ...] = (
            ("supports", (Support, PointSupport, Rotation, RigidFace), "Support"),
            ("loads", (Load, NodalLoad, Moment, OpenLoad), "load"),
            ("prescribed_densities", PrescribedDensity, "PrescribedDensity"),
            ("influx", Influx, "Influx"),
            ("cases", LoadCase, "LoadCase"),
        )
        for name, kinds, wanted in parts:
            object.__setattr__(self, name, require_each(getattr(self, name), kinds, f"{name} {of}", wanted))

    def _check_pressures(self) -> None:
        """Refuse what follows the deformation where the material does not."""
        for load in self.open_loads:
            if isinstance(load, Pressure) and self.material.small_strain:
                raise InputError(
                    f"the pressure on '{load.on}' follows the deformation, and {type(self.material).__name__} is of "
                    "small strains, which know none: a Traction would be right"
                )

    def _check_plane(self) -> None:
        """Refuse plane stress of what has no plane, and of materials that do not tell what they do across it."""
        try:
            object.__setattr__(self, "plane", Plane(self.plane))
        except ValueError:
            raise InputError(
                f"the plane of the scene '{self.name}' is {shown(self.plane)}: Plane.STRAIN or Plane.STRESS, "
                '"strain" or "stress", would be right'
            ) from None
        if self.plane is not Plane.STRESS:
            return
        if self.mesh.dim != 2:
            raise InputError(
                f"the scene '{self.name}' is in plane stress, and its body in {self.mesh.dim} dimensions: a plane "
                "mesh, or no plane, would be right"
            )
        if is_foreign(type(self.material)):
            from growthx.model import probes

            raise_on_all(self.mesh.comm, probes.trouble_across(self.material, self.mesh))

    def _check_entries(self, load: Load) -> None:
        problem, dim = "", self.mesh.dim
        try:
            entries = len(vector(load.intensity)(self.mesh.domain.geometry.x[:1].T))
            if entries != dim:
                problem = f"the load {load.place} has {entries} entries: the mesh needs {dim}"
        except InputError as error:
            problem = f"the load {load.place} cannot be told: {error}"
        raise_on_all(self.mesh.comm, problem)

    @property
    def histories(self) -> tuple[History, ...]:
        """What loads and supports follow instead of the program's ramp."""
        parts = (*self.supports, *self.all_loads)
        return tuple(part.history for part in parts if part.history is not None)

    @property
    def timetable(self) -> Program:
        """The program, of which a step is to end, too, wherever a history jumps."""
        jumps = jumps_of(self.histories, self.program.until)
        return replace(self.program, requested=(*self.program.requested, *jumps)) if jumps else self.program

    @property
    def load_cases(self) -> tuple[LoadCase, ...]:
        """The load cases with all of their loads and weights whose sum is one; one without a name if there are none."""
        cases = self.cases or (LoadCase("", 1.0, ()),)
        total = sum(case.weight for case in cases)
        return tuple(replace(case, weight=case.weight / total, loads=self.loads + case.loads) for case in cases)

    @property
    def all_loads(self) -> tuple[Load | NodalLoad | Moment | OpenLoad, ...]:
        """The loads that all cases share, and those of each."""
        return self.loads + tuple(load for case in self.cases for load in case.loads)

    @property
    def dead_loads(self) -> tuple[Load | NodalLoad | Moment, ...]:
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
