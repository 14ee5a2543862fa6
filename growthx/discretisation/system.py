"""The nonlinear system of one time step, and the state it advances; how the density is solved for is a part of it.

G_u = 0     the displacements of the load cases, and
G_ρ = 0     the densities: unknowns beside them, or found one by one and eliminated
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any, Protocol

import dolfinx
import numpy as np
from mpi4py import MPI

from growthx.discretisation.loading import DeadLoads, Supports
from growthx.discretisation.state import WHOLE, Way
from growthx.fem.assembly import assemble
from growthx.fem.lumping import owned
from growthx.model.exponents import is_well_posed
from growthx.solvers.problem import Layout

if TYPE_CHECKING:
    import ufl

    from growthx.common.arrays import Floats, Marks
    from growthx.common.memory import Memory
    from growthx.discretisation.constraints.rigid_faces import RigidFaces
    from growthx.discretisation.densities.lumped_nodes import LumpedNodes
    from growthx.discretisation.densities.past import Past
    from growthx.discretisation.forms.momentum import Momentum
    from growthx.discretisation.spaces import Spaces
    from growthx.discretisation.state import State
    from growthx.discretisation.unknowns import Unknowns

NO_LOAD = 1e-12  # of all nodal forces: what round-off leaves of a load on free nodes where all of it is borne at once


class Densities(Protocol):
    """How the densities are solved for, and the weak forms of both balances as that needs them.

    unknowns: what is left for Newton's method.  symmetric: whether the tangent is.
    conditions: on densities that are unknowns.
    constants: of the forms, beside those of the state and the laws.
    """

    unknowns: Unknowns
    symmetric: bool
    conditions: list[dolfinx.fem.DirichletBC]
    constants: list[dolfinx.fem.Constant]

    @property
    def lumped(self) -> LumpedNodes | None:
        """Nodes about which the balance of mass is lumped; None of densities that no two cells share."""

    @property
    def residuals(self) -> list[dolfinx.fem.Form]:
        """Compiled forms whose sum is the balances."""

    @property
    def tangents(self) -> list[dolfinx.fem.Form]:
        """Compiled forms whose sum is their derivative."""

    @property
    def coupling(self) -> dolfinx.fem.Form:
        """A bilinear form whose matrix has room for all tangents."""

    @property
    def own_tangents(self) -> list[list[dolfinx.fem.Form]]:
        """Of each displacement, forms by `condensed_tangent` whose sum is its own block; none if it is not theirs."""

    @property
    def dofs(self) -> int:
        """Number of unknowns of the system on all ranks, supports included."""

    def begin(self, force_scale: float) -> None:
        """Put what is prescribed on the first iterate of a step, whose numbers the state has."""

    def update(self) -> bool:
        """Bring what depends on the running iterate up to date; whether it is admissible on this rank, as far as known.

        (det F ≤ 0 shows by itself: the residual is then not a number.)
        """

    def iterate(self) -> Floats:
        """Density of the running iterate, as `density.x.array`."""

    def set_iterate(self, density: Floats) -> None:
        """Make a density, as in `x.array`, that of the running iterate."""

    def limits(self) -> tuple[Floats, Floats] | None:
        """Lowest and highest value of each owned unknown, if any has a bound."""

    def largest_share(self, position: Floats, step: Floats) -> float:
        """Largest share, up to one, of a step from a position that may be taken (owned unknowns; collective)."""

    def vanishing(self) -> Marks:
        """Densities of the running iterate that are gone, or nearly, and that lumping may save, as in `iterate`."""

    def mass_rate(self, borne: Floats | None) -> float:
        """Mass that enters per time at the running iterate, of which `borne` is the residual before conditions."""

    def unloaded_resorption(self) -> float:
        """∫ c S* dV, the mass that would leave per time without any stimulus."""

    def momentum_forms(self, tests: list[Any]) -> list[ufl.Form]:
        """The balance of momentum at the running iterate but dead loads, tested by vectors, one for each load case."""


class System:
    """What Newton's method sees, `solvers.problem.NonlinearProblem`, and what takes it from step to step.

    The iterate, `unknown`, becomes the state only in `accept_step`.
    deformation: how displacements deform the body.
    borne: internal minus external forces of the iterate whose balance was last looked at, at supports what these bear,
    shape (owned unknowns,); None before the first one.
    past: of a law with a memory, what brings that up to date.
    """

    def __init__(self, spaces: Spaces, state: State, momentum: Momentum, densities: Densities) -> None:
        self.spaces, self.state, self.densities, self.comm = spaces, state, densities, spaces.comm
        self._momentum, self.deformation = momentum, momentum.deformation
        self.unknowns = densities.unknowns
        self.unknown, self.owned = self.unknowns.function, self.unknowns.owned
        self.symmetric = densities.symmetric
        self.supports = Supports(spaces, self.unknowns)
        self.rigid = self.supports.rigid
        self.conditions = [*self.supports.conditions, *densities.conditions]
        self.loads = DeadLoads(spaces, self.unknowns)
        self.borne: Floats | None = None
        self.past: Past | None = None
        self._accepted: Floats = self.unknown.x.array.copy()

    @property
    def residuals(self) -> list[dolfinx.fem.Form]:
        """Linear forms whose sum, less the dead loads, is R."""
        return self.densities.residuals

    @property
    def tangents(self) -> list[dolfinx.fem.Form]:
        """Bilinear forms whose sum is ∂R/∂x."""
        return self.densities.tangents

    @property
    def coupling(self) -> dolfinx.fem.Form:
        """A bilinear form whose matrix has room for the tangents."""
        return self.densities.coupling

    @property
    def own_tangents(self) -> list[list[dolfinx.fem.Form]]:
        """Of each displacement, forms whose sum is its own block of ∂R/∂x, symmetric; none if there are no such."""
        return self.densities.own_tangents

    # -- what a solver asks --------------------------------------------------------------------------------------------

    @cached_property
    def must_be_stable(self) -> bool:
        """Whether a balance counts only where it is stable: of a model that is not well posed none need be."""
        return is_well_posed(self.spaces.scene)

    @cached_property
    def layout(self) -> Layout:
        """Of which fields the unknowns are, for the choice of a linear solver."""
        none, scene = np.empty(0, dtype=np.int32), self.spaces.scene
        return Layout(
            dim=scene.mesh.dim,
            degree=self.spaces.variant.displacement.degree,
            dofs=self.densities.dofs,
            condensed=self.unknowns.density_part is None,
            space=self.spaces.displacement_space,
            parts=tuple(self.unknowns.parts),
            held=np.unique(
                np.concatenate(
                    [
                        none,
                        *(owned(condition) for condition in self.conditions),
                        *(face.dofs[face.own].ravel() for face in self.rigid.faces),
                    ]
                )
            ),
            symmetric_parts=not scene.open_loads,
        )

    @cached_property
    def _force_scale(self) -> float:
        load, whole = self.peak_load(), self.loads.peak()
        total, with_held = self.comm.allreduce(np.array([load @ load, whole @ whole]))
        if total > (NO_LOAD**2) * with_held:
            return float(np.sqrt(total))
        dim, stiffness = self.spaces.scene.mesh.dim, self._momentum.largest_stiffness()
        size = self.spaces.growing_size() ** (1 / dim)
        moved = self.supports.farthest()
        return self.comm.allreduce(stiffness, MPI.MAX) * (moved or size) * size ** (dim - 2)

    def force_scale(self) -> float:
        """What nodal forces are measured against: ‖nodal dead load at full traction‖₂, at the peaks of its histories.

        Without a load, also where the body is held alone: E times the prescribed displacement or, if there is none, the
        size of the body, times size^(dim − 2).
        """
        return self._force_scale

    def peak_load(self) -> Floats:
        """Nodal dead load at full traction and at the peaks of its histories, but where the body is held.

        Of rigid faces, with their moments, what their motions feel of it.
        """
        load = self.loads.peak()
        for condition in self.conditions:
            load[owned(condition)] = 0.0
        self.rigid.reduce(load, [-moment for moment in self.rigid.turning_at_peak()])
        return load

    def start_from(self, values: Floats) -> None:
        """Make the first entries of the running iterate these, as many as there are."""
        self.unknown.x.array[: len(values)] = values

    @property
    def following(self) -> RigidFaces | None:
        """The rigid faces, if there are any."""
        return self.rigid if self.rigid.faces else None

    def out_of_balance(self) -> Floats:
        """Internal minus external forces of the running iterate, shape (owned unknowns,); NaN if it is not admissible.

        Rows of held unknowns are zero: they hold no equation, but what is not admissible may show in them alone.
        """
        self.unknown.x.scatter_forward()
        self.rigid.settle(self.unknown.x.array)
        admissible = self.densities.update()
        forces = self._forces()  # on all ranks, whatever one of them has found
        self.borne = forces.copy()
        counts = admissible and np.all(np.isfinite(forces))
        for condition in self.conditions:
            forces[owned(condition)] = 0.0
        self.rigid.reduce(forces, self.rigid.turning(self.state))
        if not counts:
            forces[:] = np.nan
        return forces

    def _forces(self) -> Floats:
        """Internal minus external forces as they are: at supports, what the supports bear."""
        forces = -self.loads.at(self.state)
        for residual in self.residuals:
            forces += assemble(residual)
        return forces

    def limits(self) -> tuple[Floats, Floats] | None:
        """Lowest and highest value of each owned unknown, if Newton's method must keep to any."""
        return self.densities.limits()

    def largest_share(self, position: Floats, step: Floats) -> float:
        """Largest share, up to one, of a step from a position that may be taken (owned unknowns; collective)."""
        return self.densities.largest_share(position, step)

    # -- from step to step ---------------------------------------------------------------------------------------------

    def begin_step(
        self,
        time_step: float,
        amplitude: float,
        time: float = 0.0,
        base: Floats | None = None,
        way: Way = WHOLE,
    ) -> None:
        """Set the length, load and end of a step of implicit Euler, and put what is prescribed on the first iterate.

        base: densities the step begins with, as `density.x.array`; default: those of the state.
        way: how much of the change of histories has come, where a step is solved in parts.
        """
        self.state.begin(time_step, amplitude, time, base, way)
        self.supports.move(self.unknown.x.array, self.state)
        self.rigid.settle(self.unknown.x.array)
        self.densities.begin(self.force_scale())

    def accept_step(self) -> None:
        """Make the running iterate the state."""
        self._accepted[:] = self.unknown.x.array
        elapsed = self.state.elapsed
        self.state.accept(self.unknowns.displacement_arrays(), self.densities.iterate())
        if self.past is not None:
            self.past.follow(elapsed)

    def reject_step(self) -> None:
        """Go back to the state at the start of the step."""
        self.state.reject()
        self.unknown.x.array[:] = self._accepted

    def set_density(self, density: Floats) -> None:
        """Make densities, as `density.x.array`, those of the state, at the displacement it has."""
        self.state.set_density(density)
        self.reject_step()
        self.densities.set_iterate(self.state.accepted_density)
        self._accepted[:] = self.unknown.x.array

    def memory(self) -> Memory:
        """The state, copied."""
        memory = self.state.memory()
        memory.unknowns["unknown"] = self._accepted.copy()
        return memory

    def recall(self, memory: Memory) -> None:
        """Make a state that was remembered the state."""
        self.start_from(memory.unknowns["unknown"])
        self._accepted[:] = self.unknown.x.array
        self.state.recall(memory, self.unknowns.displacement_arrays())
        self.densities.set_iterate(memory.densities["density"])
