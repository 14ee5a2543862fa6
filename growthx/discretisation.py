"""What the two ways to solve for the density share: spaces, supports, loads, the state and what is asked of it."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from functools import partial
from typing import TYPE_CHECKING, Any

import dolfinx
import numpy as np
import ufl
from mpi4py import MPI

from growthx import compat
from growthx.arrays import selection
from growthx.assembly import Compiler, assemble, average_cells
from growthx.boundary import hold, nodal_forces, owned
from growthx.errors import InputError, is_function, require, require_number
from growthx.fields import as_ufl, interpolate, is_uniform, law_as_ufl, scalar
from growthx.kinematics import deformation_gradient, volume_ratio
from growthx.memory import Memory
from growthx.momentum import Momentum
from growthx.open_loads import OpenLoad
from growthx.sampling import dof_positions, locate
from growthx.variants import AtPoints, right_ones

if TYPE_CHECKING:
    from collections.abc import Callable

    from growthx.arrays import Floats, Indices, Marks
    from growthx.scene import Scene
    from growthx.variants import Variant


LOOKED_AT = 1000  # times at which the peak of a load's history is looked for


def _at_time(history: Callable[[float], float], time: float) -> float:
    """The share of a load at a time; InputError if it is not a finite number."""
    share = history(time)
    require_number(share, f"the history of a load at t = {time:g}", "a finite number", lambda _: True)
    return float(share)


def _check_lumping(scene: Scene, variant: Variant) -> None:
    """Raise InputError where masses at the corners of the cells make no sense."""
    if scene.inertia is None or not scene.inertia.lumped:
        return

    def at_corners_alone(variant: Variant) -> bool:
        return variant.displacement.degree == 1 and not isinstance(variant.density, AtPoints)

    if not at_corners_alone(variant):
        raise InputError(
            f"{variant.name} has unknowns or densities beside the corners of the cells, where lumped inertia has its "
            f"masses: {right_ones(scene.mesh.cell_name, at_corners_alone)}"
        )


class Discretisation(ABC):
    """A scene discretised by a variant: one nonlinear system per time step, and the state it advances.

    `unknown` is what Newton's method solves for; `residuals` are compiled forms whose sum is the balances, `tangents`
    those whose sum is its derivative, `coupling` one whose matrix has room for all of them.  The iterate becomes the
    state only in `accept_step`.
    """

    symmetric: bool  # whether the tangent is
    unknown: dolfinx.fem.Function
    residuals: list[dolfinx.fem.Form]
    tangents: list[dolfinx.fem.Form]
    coupling: dolfinx.fem.Form
    parts: list[Any]  # where each load case's displacement is in the unknown: indices or a slice

    def __init__(self, scene: Scene, variant: Variant) -> None:
        mesh, domain = scene.mesh, scene.mesh.domain
        variant.check(mesh.cell_name)
        _check_lumping(scene, variant)
        self.scene = scene
        self.variant = variant
        self.comm: MPI.Intracomm = domain.comm
        self.compile = Compiler()
        self.displacement_space, self.density_space = self._make_spaces(
            variant.displacement_element(mesh.cell_name, mesh.dim), variant.density_element(mesh.cell_name)
        )
        self.cases = scene.load_cases
        self.displacements = [dolfinx.fem.Function(self.displacement_space, name=case.name) for case in self.cases]
        # Of several cases, for pictures, their mean.
        alone = len(self.cases) == 1
        self.displacement = self.displacements[0] if alone else dolfinx.fem.Function(self.displacement_space)
        self.displacement.name = "displacement"
        self.density = dolfinx.fem.Function(self.density_space, name="density")
        self.old_density = dolfinx.fem.Function(self.density_space, name="old_density")
        self.material = law_as_ufl(scene.material, mesh)
        self.growth = law_as_ufl(scene.growth, mesh)
        self.time_step = dolfinx.fem.Constant(domain, np.float64(scene.program.step))
        self.time, self.amplitude = 0.0, 0.0
        self._accepted_at = (float(self.time_step.value), self.amplitude, self.time)
        self.momentum = Momentum(scene, self.material, self.displacement_space, self.time_step)
        self._split_cells()
        self.density_dofs = self._growing_densities()
        self.growing = selection(self.density_dofs)
        self.volumes = assemble(self.compile.form(ufl.TestFunction(self.density_space) * self.growing_volume))
        self._set_start_density()

    # -- set-up --------------------------------------------------------------------------------------------------------

    @abstractmethod
    def _make_spaces(
        self, displacement: Any, density: Any
    ) -> tuple[dolfinx.fem.FunctionSpace, dolfinx.fem.FunctionSpace]:
        """Function spaces of the displacement and of the density for the given elements."""

    def _split_cells(self) -> None:
        """The cells that grow, the measure of their volume and of that of the rest (None if everything grows)."""
        mesh, growing = self.scene.mesh, self.scene.growing
        metadata = {"quadrature_degree": self.variant.momentum_degree}
        self.whole_volume = ufl.Measure("dx", domain=mesh.domain, metadata=metadata)
        self.growing_cells, self.growing_volume, self.resting_volume = mesh.owned_cells, self.whole_volume, None
        if growing is None:
            return
        marks = np.zeros_like(mesh.local_cells)
        for region in growing:
            marks[mesh.region(region)] = 1
        tags = dolfinx.mesh.meshtags(mesh.domain, mesh.dim, mesh.local_cells, marks)
        volume = ufl.Measure("dx", domain=mesh.domain, subdomain_data=tags, metadata=metadata)
        self.growing_cells = np.flatnonzero(marks[: len(mesh.owned_cells)]).astype(np.int32)
        self.growing_volume = volume(1)
        if self.comm.allreduce(len(mesh.owned_cells) - len(self.growing_cells)):
            self.resting_volume = volume(0)

    def _growing_densities(self) -> Indices:
        """Owned densities of cells that grow, as indices into the density's array."""
        dofmap = self.density_space.dofmap
        marks = dolfinx.la.vector(dofmap.index_map, 1)
        marks.array[dofmap.list[self.growing_cells]] = 1.0
        marks.scatter_reverse(dolfinx.la.InsertMode.add)
        return np.flatnonzero(marks.array[: dofmap.index_map.size_local]).astype(np.int32)

    def _set_start_density(self) -> None:
        start = self.scene.start_density
        if is_uniform(start):
            self.density.x.array[:] = start
        elif is_function(start):
            interpolate(self.density, scalar(start))
        else:
            self._average_cells(as_ufl(start, self.scene.mesh))
        require(self.density, "the initial density ρ(0)", "a positive number", lambda rho: rho > 0)
        self.old_density.x.array[:] = self.density.x.array
        self.accepted_density: Floats = self.density.x.array.copy()

    def _average_cells(self, start: dolfinx.fem.Function) -> None:
        """Give each density what a function has there, the mean of the cells around where they differ."""
        values = self.evaluate(start, compat.interpolation_points(self.density_space.element))
        self.density.x.array[:] = average_cells(self.density_space, values).x.array

    def evaluate(self, value: Any, X: Floats) -> Floats:
        """A scalar in UFL at points X of the reference cell, (points, dim), shape (owned cells, points)."""
        cells = self.scene.mesh.owned_cells
        values = self.compile.expression(value, X).eval(self.scene.mesh.domain, cells)
        return np.reshape(values, (len(cells), -1))

    def _resting_momentum(self, us: list[Any], tests: list[Any]) -> list[ufl.Form]:
        """The same in the regions that do not grow, at the density they have from the start; none if all grow."""
        if self.resting_volume is None:
            return []
        rho = as_ufl(self.scene.start_density, self.scene.mesh)
        forms = [self.momentum.inside(us, rho, tests, self.resting_volume)]
        return forms + self.momentum.of_corners(us, rho, tests, self.resting_volume)

    def mean_energy(self) -> Any:
        """Elastic energy Ψ₀ⁿᵉᵒ of the state that drives the growth, a UFL expression, energy per reference volume."""
        return self.momentum.mean_energy(self.displacements)

    def mean_stress(self) -> Any:
        """Cauchy stress of the state, the weighted mean over the load cases, UFL of shape (dim, dim)."""
        return self.momentum.mean_stress(self.displacements, self.density)

    def _hold(self, spaces: list[dolfinx.fem.FunctionSpace]) -> None:
        """Boundary conditions on the displacements, each in a space of its own or in a part of a mixed one."""
        scene = self.scene
        self.held = [
            held for case, space in enumerate(spaces) for held in hold(scene.supports, scene.mesh, space, case)
        ]
        self.conditions = [held.condition for held in self.held]

    def _load(self, tests: list[Any], space: dolfinx.fem.FunctionSpace) -> None:
        """Nodal forces of the full loads, assembled once: dead loads only scale with time."""
        dim, mesh, V = self.scene.mesh.dim, self.scene.mesh, self.displacement_space
        self.nodal_load = np.zeros(space.dofmap.index_map.size_local * space.dofmap.index_map_bs)
        self._translations = np.array([[self._translation(c, i) for i in range(dim)] for c in range(len(tests))])
        self.timed_loads: list[tuple[Callable[[float], float], Floats]] = []
        for c, (case, test) in enumerate(zip(self.cases, tests, strict=True)):
            for load in case.loads:
                if isinstance(load, OpenLoad):
                    continue
                unweighted = nodal_forces(load, mesh, V, test, partial(self.resultant, case=c), self.compile)
                forces = case.weight * unweighted
                if load.history is None:
                    self.nodal_load += forces
                else:
                    self.timed_loads.append((load.history, forces))

    def _translation(self, case: int, direction: int) -> Floats:
        """The owned unknowns that move the whole body by one along a direction, in one load case."""
        dim = self.scene.mesh.dim
        moved = dolfinx.fem.Function(self.displacement_space)
        moved.interpolate(lambda x: np.outer(np.arange(dim) == direction, np.ones(x.shape[1])))
        unknown = np.zeros_like(self.unknown.x.array)
        unknown[self.parts[case]] = moved.x.array
        return unknown[: len(self.nodal_load)]

    def _show_mean_displacement(self) -> None:
        """Of several load cases, bring the mean displacement up to date."""
        if len(self.cases) > 1:
            self.displacement.x.array[:] = sum(
                case.weight * u.x.array for case, u in zip(self.cases, self.displacements, strict=True)
            )

    # -- what the solver of a step uses --------------------------------------------------------------------------------

    def begin_step(self, time_step: float, amplitude: float, time: float = 0.0, base: Floats | None = None) -> None:
        """Set the length, load and end of a step of implicit Euler, and put what is prescribed on the first iterate.

        base: densities the step begins with, as `density.x.array`; default: those of the state.
        """
        self._set_program(time_step, amplitude, time)
        self.old_density.x.array[:] = self.accepted_density if base is None else base
        for held in self.held:
            self.unknown.x.array[held.dofs] = amplitude * held.values

    def _set_program(self, time_step: float, amplitude: float, time: float) -> None:
        self.time_step.value, self.time, self.amplitude = time_step, time, amplitude
        self.momentum.share.value = amplitude

    def out_of_balance(self) -> Floats:
        """Internal minus external forces of the running iterate, shape (owned unknowns,); NaN if it is not admissible.

        Rows of held unknowns are zero: they hold no equation.
        """
        self.unknown.x.scatter_forward()
        admissible = self.update()
        forces = self._forces()  # on all ranks, whatever one of them has found
        self._borne = forces.copy()
        if not admissible:
            forces[:] = np.nan
        for condition in self.conditions:
            forces[owned(condition)] = 0.0
        return forces

    def force_scale(self) -> float:
        """What nodal forces are measured against: ‖nodal dead load at full traction‖₂, at the peaks of its histories.

        Peaks are looked for at a thousand of the program's times.

        Without a load: E times the prescribed displacement or, if there is none, the body's size, times size^(dim − 2).
        """
        times = self.scene.program.times()
        times = times[:: math.ceil(len(times) / LOOKED_AT)]
        load = self.nodal_load.copy()
        for history, forces in self.timed_loads:
            load += max(abs(_at_time(history, time)) for time in times) * forces
        for condition in self.conditions:
            load[owned(condition)] = 0.0
        if total := self.comm.allreduce(float(load @ load)):
            return float(np.sqrt(total))
        mesh, young = self.scene.mesh, self.material.young
        size = self.growing_size() ** (1 / mesh.dim)
        moved = max((abs(held.value) for held in self.held), default=0.0)
        stiffness = (
            float(young.x.array.max(initial=0.0)) if isinstance(young, dolfinx.fem.Function) else float(young.value)
        )
        return self.comm.allreduce(stiffness, MPI.MAX) * (moved or size) * size ** (mesh.dim - 2)

    def _forces(self) -> Floats:
        """Internal minus external forces as they are: at supports, what the supports bear."""
        forces = -self.amplitude * self.nodal_load
        for history, load in self.timed_loads:
            forces -= _at_time(history, self.time) * load
        for residual in self.residuals:
            forces += assemble(residual)
        return forces

    @abstractmethod
    def update(self) -> bool:
        """Bring what depends on the running iterate up to date; whether it is admissible on this rank, as far as known.

        (det F ≤ 0 shows by itself: the residual is then not a number.)
        """

    def accept_step(self) -> None:
        """Make the running iterate the state."""
        self._accepted_at = (float(self.time_step.value), self.amplitude, self.time)

    def reject_step(self) -> None:
        """Go back to the state at the start of the step."""
        self._set_program(*self._accepted_at)

    def largest_share(self, position: Floats, step: Floats) -> float:
        """Largest share, up to one, of a step from a position that may be taken (owned unknowns; collective)."""
        return 1.0

    @abstractmethod
    def iterate_density(self) -> Floats:
        """Density of the running iterate, as `density.x.array`."""

    def iterate_displacement(self, case: int = 0) -> Floats:
        """Displacement of the running iterate in a load case, as `displacements[case].x.array`."""
        return self.unknown.x.array[self.parts[case]]

    def inadmissible(self) -> str:
        """What is wrong with the running iterate, and where, as a part of a sentence; empty if nothing is."""
        mesh = self.scene.mesh
        space = dolfinx.fem.functionspace(mesh.domain, ("DG", 0))
        u = dolfinx.fem.Function(self.displacement_space)
        J = volume_ratio(deformation_gradient(u))
        inverted = ufl.conditional(ufl.gt(J, 0), 0.0, 1.0)
        count = self.compile.form(inverted * ufl.TestFunction(space) * self.whole_volume)
        midpoints = dolfinx.mesh.compute_midpoints(mesh.domain, mesh.dim, mesh.owned_cells)
        for number, case in enumerate(self.cases):
            u.x.array[:] = self.iterate_displacement(number)
            if where := self._first(~(assemble(count) == 0), midpoints):
                return f"det F ≤ 0 in the cell at {where}" + (f" in the load case '{case.name}'" if case.name else "")
        old = self.accepted_density[: len(self.volumes)]
        density = self.iterate_density()[: len(old)]
        # A line search that halves its way towards zero never gets there.
        if where := self._first(~(density > 1e-9 * old), self.density_positions()):
            return f"no positive density balances the mass at {where}"
        return ""

    def _first(self, wrong: Marks, where: Floats) -> str:
        """Position of the first entry that is wrong on any rank, as text; empty if none is."""
        found = np.flatnonzero(wrong)
        places = self.comm.allgather(where[found[0]] if len(found) else None)
        place = next((place for place in places if place is not None), None)
        if place is None:
            return ""
        tidy = np.where(np.abs(place) < 1e-12 * np.abs(place).max(), 0.0, place)
        return "({})".format(", ".join(f"{x:.4g}" for x in tidy[: self.scene.mesh.dim]))

    def limits(self) -> tuple[Floats, Floats] | None:
        """Lowest and highest value of each owned unknown, if Newton's method must keep to any."""
        return None

    def set_density(self, density: Floats) -> None:
        """Make densities, as `density.x.array`, those of the state, at the displacement it has."""
        self.density.x.array[:] = self.accepted_density[:] = density
        self.reject_step()

    def memory(self) -> Memory:
        """The state, copied."""
        memory = self.momentum.memory()
        memory.numbers.update(amplitude=self.amplitude, time=self.time, time_step=float(self.time_step.value))
        memory.unknowns["unknown"] = self.unknown.x.array.copy()
        memory.densities["density"] = self.accepted_density.copy()
        return memory

    def recall(self, memory: Memory) -> None:
        """Make a state that was remembered the state."""
        numbers = memory.numbers
        self._set_program(numbers["time_step"], numbers["amplitude"], numbers["time"])
        self.unknown.x.array[:] = memory.unknowns["unknown"]
        self.density.x.array[:] = self.old_density.x.array[:] = memory.densities["density"]
        self.accept_step()
        self.momentum.recall(memory)

    # -- what is asked of the state ------------------------------------------------------------------------------------

    @property
    @abstractmethod
    def dofs(self) -> int:
        """Number of unknowns of the system on all ranks, supports included."""

    @property
    def points(self) -> int:
        """Number of integration points on all ranks."""
        return self.scene.mesh.cell_count * self.variant.points_per_cell(self.scene.mesh.cell_name)

    @abstractmethod
    def mass_rate(self) -> float:
        """Mass that enters per time at the running iterate (per thickness in two dimensions).

        From the source, ∫ R₀ dV, and across the boundary; at a bound of density, what of the source took effect.
        """

    def resultant(self, forces: Floats, case: int = 0) -> Floats:
        """Sum of nodal forces on all ranks in a load case, one per direction, shape (dim,)."""
        return np.array(self.comm.allreduce(self._translations[case] @ forces))

    def displacement_at(self, X: Floats) -> Floats:
        """Displacement (length) at points X of the reference cell, (points, dim), shape (owned cells, points, dim)."""
        space, mesh = self.displacement_space, self.scene.mesh
        basis = space.ufl_element().sub_elements[0].tabulate(0, X)[0]
        of_cells = self.displacement.x.array.reshape(-1, mesh.dim)[space.dofmap.list[: len(mesh.owned_cells)]]
        return np.asarray(np.einsum("pn,cni->cpi", basis, of_cells))

    def density_at(self, X: Floats) -> Floats:
        """Density, raw as the variant knows it, at points X of the reference cell, shape (owned cells, points)."""
        space, cells = self.density_space, len(self.scene.mesh.owned_cells)
        shares = self.variant.density.shares(space.ufl_element(), X)
        return np.asarray(self.density.x.array[space.dofmap.list[:cells]] @ shares.T)

    def reference_density_at(self, X: Floats) -> Floats | float:
        """ρ* at points X of the reference cell, shape (owned cells, points), or the one number it is everywhere."""
        reference = self.scene.material.reference_density
        return float(reference) if is_uniform(reference) else self.evaluate(self.material.reference_density, X)

    def sample_density(self, places: Floats) -> Floats:
        """Density, raw as the variant knows it, at places in the body at rest, (places, dim); the same on all ranks.

        NaN outside the body.
        """
        space = self.density_space

        def density(cells: Indices, X: Floats) -> Floats:
            shares = self.variant.density.shares(space.ufl_element(), X)
            return np.einsum("pd,pd->p", shares, self.density.x.array[space.dofmap.list[cells]])

        return self._sample(density, places, ())

    def sample_displacement(self, places: Floats) -> Floats:
        """Displacement (length) at places in the body at rest, (places, dim), shape (places, dim); NaN outside."""
        space, dim = self.displacement_space, self.scene.mesh.dim

        def displacement(cells: Indices, X: Floats) -> Floats:
            basis = space.ufl_element().sub_elements[0].tabulate(0, X)[0]
            return np.einsum("pn,pni->pi", basis, self.displacement.x.array.reshape(-1, dim)[space.dofmap.list[cells]])

        return self._sample(displacement, places, (dim,))

    def _sample(self, value: Callable[[Indices, Floats], Floats], places: Floats, shape: tuple[int, ...]) -> Floats:
        """Values, each of that shape, by owned cells and reference points, gathered from the ranks that have them."""
        cells, X = locate(self.scene.mesh, np.asarray(places, dtype=float))
        here = np.flatnonzero(cells >= 0)
        found = np.full((len(cells), *shape), -np.inf)
        if len(here):  # basix aborts when it is given no points at all
            found[here] = value(cells[here], X[here])
        self.comm.Allreduce(MPI.IN_PLACE, found, MPI.MAX)
        return np.where(np.isfinite(found), found, np.nan)

    def density_positions(self) -> Floats:
        """Where the densities are, in the order of `density.x.array`, shape (densities, 3)."""
        return dof_positions(self.density_space, self.scene.mesh)

    def mass(self) -> float:
        """∫ ρ dV over what grows (mass; per thickness in two dimensions)."""
        dofs = self.growing
        return self.comm.allreduce(float(self.volumes[dofs] @ self.density.x.array[dofs]))

    def mean_density(self) -> float:
        """Mean of ρ over what grows."""
        return self.mass() / self.growing_size()

    def growing_size(self) -> float:
        """Volume of what grows (in two dimensions, area)."""
        return self.comm.allreduce(float(self.volumes.sum()))

    def root_mean_square(self, values: Floats) -> float:
        """Root mean square over the volume that grows of values for each density, as `density.x.array`."""
        # Volumes of nodes at the corners of quadratic simplices are zero or below.
        weights = np.abs(self.volumes[self.growing])
        squares = np.array([weights @ np.square(values[self.growing]), weights.sum()])
        total, volume = self.comm.allreduce(squares)
        return float(np.sqrt(total / volume))

    def resorption(self) -> float:
        """Root mean square over the volume that grows of the resorption c S* without a stimulus, density per time."""
        square = self.compile.form((self.growth.rate * self.growth.attractor) ** 2 * self.growing_volume)
        total = self.comm.allreduce(float(dolfinx.fem.assemble_scalar(square).real))
        return float(np.sqrt(total / self.growing_size()))

    def density_range(self) -> tuple[float, float]:
        """Lowest and highest of the density's own degrees of freedom."""
        values = self.density.x.array[self.growing]
        return (
            self.comm.allreduce(float(values.min(initial=np.inf)), MPI.MIN),
            self.comm.allreduce(float(values.max(initial=-np.inf)), MPI.MAX),
        )

    def reactions(self) -> dict[str, Floats]:
        """Force on the body (per thickness in two dimensions) at each support, by boundary name, shape (dim,).

        At the iterate whose balance was last looked at.  Of several load cases, by the case's name and the boundary's.
        """
        forces = self._borne.copy()
        names = [f"{self.cases[held.case].name}: {held.boundary}".removeprefix(": ") for held in self.held]
        found: dict[str, Floats] = {name: np.zeros(self.scene.mesh.dim) for name in names}
        for name, held in zip(names, self.held, strict=True):
            dofs, moved = owned(held.condition), self._translations[held.case][held.direction]
            force = self.comm.allreduce(float(moved[dofs] @ forces[dofs])) / self.cases[held.case].weight
            found[name][held.direction] += force
            forces[dofs] = 0.0  # what two supports share is borne by the first
        return found
