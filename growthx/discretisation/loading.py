"""Supports and dead loads of a scene on a function space."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import dolfinx
import numpy as np
from mpi4py import MPI

from growthx.common.errors import InputError, raise_on_all
from growthx.discretisation.constraints.rigid_faces import RigidFaces, is_of_a_rigid_face
from growthx.discretisation.forms import balances
from growthx.fem.assembly import assemble
from growthx.fem.lumping import owned
from growthx.meshing.fields import interpolate, vector
from growthx.model.actions.concentrated import NodalLoad
from growthx.model.actions.faces import Moment, Rotation, cross_matrix
from growthx.model.actions.histories import peak_of, share_at
from growthx.model.actions.rigid import RigidFace
from growthx.model.loads import Traction
from growthx.model.open_loads import OpenLoad
from growthx.model.supports import PointSupport

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from growthx.common.arrays import Floats, Indices
    from growthx.discretisation.spaces import Spaces
    from growthx.discretisation.state import State
    from growthx.discretisation.unknowns import Unknowns
    from growthx.meshing.mesh import Mesh
    from growthx.model.actions.histories import History
    from growthx.model.loads import Load
    from growthx.model.program import Program
    from growthx.model.supports import Support


LOOKED_AT = 100  # times at which supports that share nodes are compared
ALIKE = 1e-9  # of the largest displacement that either prescribes


@dataclass(frozen=True)
class Held:
    """One direction of a support, moved by `value` (length) at full load, as far as any of its unknowns.

    terms: factors of the share of the load, and what they multiply of each of the unknowns `dofs`.
    """

    boundary: str  # or, of a point, its place
    case: int
    direction: int
    value: float
    dofs: Indices  # ghosts included
    terms: tuple[tuple[Callable[[float], float], Floats], ...]
    condition: dolfinx.fem.DirichletBC
    history: History | None

    def at(self, share: float) -> Floats:
        """The unknowns at a share of the load, shape (dofs,)."""
        (factor, first), *others = self.terms
        return np.asarray(sum((other(share) * values for other, values in others), factor(share) * first))

    @property
    def values(self) -> Floats:
        """The unknowns at full load, shape (dofs,)."""
        return self.at(1.0)


class Turns:
    """What turns the body about a place, as unknowns: the test functions by which forces have their moments."""

    def __init__(self, spaces: Spaces, unknowns: Unknowns) -> None:
        self._unknowns, self._dim = unknowns, spaces.scene.mesh.dim
        self._deforms = not spaces.scene.material.small_strain
        self.axes = [np.ones(1)] if self._dim == 2 else list(np.eye(3))

    def of(self, axis: Floats, about: Floats, u: Floats | None, case: int) -> Floats:
        """δu = axis × (X + u − c), shape (owned unknowns,); of small strains, or without a u, axis × (X − c).

        axis: in the plane one number.  u: the displacement of the case, as `x.array`.
        """
        K = cross_matrix(axis, self._dim)
        arms = self._unknowns.places
        if u is not None and self._deforms:
            arms = arms + u.reshape(-1, self._dim)
        whole = np.zeros_like(self._unknowns.function.x.array)
        whole[self._unknowns.parts[case]] = (arms @ K.T).ravel()
        return np.asarray(whole[: self._unknowns.owned] - (K @ about) @ self._unknowns.translations[case])


class Supports:
    """What holds the displacements of the load cases.

    held: each direction of each support; conditions: the same for DOLFINx.
    rigid: boundaries that are held to be rigid, and free to move as such.
    """

    def __init__(self, spaces: Spaces, unknowns: Unknowns) -> None:
        self._spaces, self._translations = spaces, unknowns.translations
        self._turns, self._dim = Turns(spaces, unknowns), spaces.scene.mesh.dim
        scene = spaces.scene
        self.held = [
            held
            for case, space in enumerate(unknowns.subspaces)
            for held in _hold(scene.supports, scene.mesh, space, case)
        ]
        _refuse_conflicts(self.held, scene.timetable, spaces.comm)
        self.conditions = [held.condition for held in self.held]
        self.rigid = RigidFaces(spaces, unknowns)
        self.rigid.refuse_what_is_shared(
            (held.boundary, held.direction, held.dofs, bool(held.values.any())) for held in self.held
        )
        # What bears forces: name, load case, direction and owned unknowns.
        self._bearing = [
            *((held.boundary, held.case, held.direction, owned(held.condition)) for held in self.held),
            *(
                (face.face.on, face.case, i, face.dofs[face.own, i])
                for face in self.rigid.faces
                for i in range(self._dim)
            ),
        ]

    def move(self, iterate: Floats, state: State) -> None:
        """Put an iterate, as `x.array`, to where the supports are at the end of the running step."""
        for held in self.held:
            iterate[held.dofs] = held.at(state.share_now(held.history))

    def farthest(self) -> float:
        """The largest prescribed displacement, at full load and at the peaks of the histories (length)."""
        timetable = self._spaces.scene.timetable
        return max((abs(held.value) * peak_of(held.history, timetable) for held in self.held), default=0.0)

    def reactions(self, borne: Floats) -> dict[str, Floats]:
        """Force on the body (per thickness in two dimensions) at each support, by boundary name, shape (dim,).

        borne: internal minus external forces of the owned unknowns.  Of several load cases, by the case's name and the
        boundary's.
        """
        forces, cases, dim = borne.copy(), self._spaces.cases, self._spaces.scene.mesh.dim
        names = self._names()
        found: dict[str, Floats] = {name: np.zeros(dim) for name in names}
        for name, (_, case, direction, dofs) in zip(names, self._bearing, strict=True):
            moved = self._translations[case][direction]
            force = self._spaces.comm.allreduce(float(moved[dofs] @ forces[dofs])) / cases[case].weight
            found[name][direction] += force
            forces[dofs] = 0.0  # what two supports share is borne by the first
        return found

    def moments(self, borne: Floats, about: Floats, displacements: list[Floats]) -> dict[str, Floats]:
        """Moment on the body at each support about a place, by name as `reactions`; shape (1,) in the plane, or (3,).

        With the arms as they are deformed by the displacements of the load cases, as `x.array` each, of a material of
        small strains with those at rest (force times length; per thickness).  Of a rigid face without the moments that
        are its load.
        """
        axes, names = self._turns.axes, self._names()
        found: dict[str, Floats] = {name: np.zeros(len(axes)) for name in names}
        for number, axis in enumerate(axes):
            forces = borne.copy()
            turns = [self._turns.of(axis, about, u, case) for case, u in enumerate(displacements)]
            for name, (_, case, _, dofs) in zip(names, self._bearing, strict=True):
                of_rank = float(turns[case][dofs] @ forces[dofs])
                found[name][number] += self._spaces.comm.allreduce(of_rank) / self._spaces.cases[case].weight
                forces[dofs] = 0.0
        for face, moment in zip(self.rigid.faces, self.rigid.applied, strict=True):
            found[self._name(face.face.on, face.case)] -= moment
        return found

    def _names(self) -> list[str]:
        return [self._name(boundary, case) for boundary, case, _, _ in self._bearing]

    def _name(self, boundary: str, case: int) -> str:
        return f"{self._spaces.cases[case].name}: {boundary}".removeprefix(": ")


class DeadLoads:
    """Nodal forces of the loads that do not depend on the state, of all load cases, each by its weight.

    nodal_load: of the full loads without a history, shape (owned unknowns,); timed_loads: histories, and such forces.
    """

    def __init__(self, spaces: Spaces, unknowns: Unknowns) -> None:
        self._spaces, self._translations = spaces, unknowns.translations
        self._turns = Turns(spaces, unknowns)
        self.nodal_load: Floats = np.zeros(unknowns.owned)
        self.timed_loads: list[tuple[Callable[[float], float], Floats]] = []
        for number, (case, test) in enumerate(zip(spaces.cases, unknowns.tests, strict=True)):
            for load in case.loads:
                if isinstance(load, OpenLoad) or is_of_a_rigid_face(load, spaces.scene):
                    continue
                if isinstance(load, Moment):
                    load = Traction(load.on, load.traction(spaces.scene.mesh), load.history)
                if isinstance(load, NodalLoad):
                    forces = case.weight * _concentrated(load, spaces, unknowns, number)
                else:
                    forces = case.weight * _nodal_forces(load, spaces, test, partial(self.resultant, case=number))
                if load.history is None:
                    self.nodal_load += forces
                else:
                    self.timed_loads.append((load.history, forces))

    def at(self, state: State) -> Floats:
        """Nodal forces at the end of the running step, or on the way to it, shape (owned unknowns,)."""
        forces = state.amplitude * self.nodal_load
        for history, load in self.timed_loads:
            forces += state.share_now(history) * load
        return forces

    def peak(self) -> Floats:
        """Nodal forces at full load and at the peaks of the histories, which are looked for at a thousand times."""
        load, timetable = self.nodal_load.copy(), self._spaces.scene.timetable
        for history, forces in self.timed_loads:
            load += peak_of(history, timetable) * forces
        return load

    def resultant(self, forces: Floats, case: int = 0) -> Floats:
        """Sum of nodal forces on all ranks in a load case, one per direction, shape (dim,)."""
        return np.array(self._spaces.comm.allreduce(self._translations[case] @ forces))

    def resultants(self, forces: Floats) -> list[Floats]:
        """Resulting force of each load case, of nodal forces that count by its weight, shape (dim,) each."""
        return [self.resultant(forces, number) / case.weight for number, case in enumerate(self._spaces.cases)]

    def moments(self, forces: Floats, about: Floats, displacements: list[Floats] | None = None) -> list[Floats]:
        """Resulting moment of each load case about a place, of such forces, shape (1,) in the plane, or (3,).

        displacements: of the cases, whose deformed arms count; None: those at rest.
        """
        comm, found = self._spaces.comm, []
        for number, case in enumerate(self._spaces.cases):
            u = None if displacements is None else displacements[number]
            of_rank = [float(self._turns.of(axis, about, u, number) @ forces) for axis in self._turns.axes]
            found.append(np.array(comm.allreduce(np.array(of_rank))) / case.weight)
        return found

    def full(self) -> Floats:
        """Nodal forces of full loads, histories at one."""
        return np.asarray(self.nodal_load + sum(load for _, load in self.timed_loads))


def _hold(
    supports: Iterable[Support | PointSupport | Rotation | RigidFace],
    mesh: Mesh,
    space: dolfinx.fem.FunctionSpace,
    case: int,
) -> list[Held]:
    """Boundary conditions on the displacement of a load case, whose space is its own or a part of a mixed one."""
    held = []
    alone = dolfinx.fem.functionspace(mesh.domain, space.ufl_element().sub_elements[0])
    for support in supports:
        if isinstance(support, RigidFace):
            continue
        turned = support.fields(mesh) if isinstance(support, Rotation) else []
        for i, value in support.components(mesh.dim):
            part = space.sub(i)
            dofs, dofs_alone = _held_dofs(support, mesh, part, alone)
            fields = [(factor, partial(_entry, field, i)) for factor, field in turned]
            fields = fields or [(_as_it_is, partial(_everywhere, value))]
            terms = []
            for factor, field in fields:
                # Interpolated, since some unknowns are moments (serendipity), not values at nodes.
                moved = dolfinx.fem.Function(alone)
                moved.interpolate(field)
                terms.append((factor, moved.x.array[dofs_alone]))
            condition = dolfinx.fem.dirichletbc(moved, [dofs, dofs_alone], part)  # type: ignore[arg-type]
            found = Held(support.place, case, i, value, dofs, tuple(terms), condition, support.history)
            if turned:
                most = float(np.abs(found.values).max(initial=0.0))
                found = replace(found, value=mesh.comm.allreduce(most, MPI.MAX))
            held.append(found)
    return held


def _refuse_conflicts(held: list[Held], timetable: Program, comm: MPI.Comm) -> None:
    """Raise InputError where two supports hold an unknown at two displacements at any time looked at (collective)."""
    problem = ""
    found, counts = np.unique(
        np.concatenate([np.empty(0, np.int32), *(each.dofs for each in held)]), return_counts=True
    )
    both = found[counts > 1]
    sharing = [each for each in held if len(both) and np.isin(each.dofs, both).any()]
    try:
        for one, other in itertools.combinations(sharing, 2):
            problem = problem or _conflict(one, other, timetable)
    except InputError as error:  # of a history, on a rank with such nodes alone
        problem = str(error)
    raise_on_all(comm, problem)


def _conflict(one: Held, other: Held, timetable: Program) -> str:
    """What is wrong with two, or nothing."""
    _, of_one, of_other = np.intersect1d(one.dofs, other.dofs, return_indices=True)
    if not len(of_one):
        return ""
    times = timetable.times()
    for time in map(float, times[:: math.ceil(len(times) / LOOKED_AT)]):
        shares = [
            timetable.amplitude(time) if each.history is None else share_at(each.history, time) for each in (one, other)
        ]
        first, second = one.at(shares[0]), other.at(shares[1])
        apart = np.abs(first[of_one] - second[of_other])
        worst = int(apart.argmax())
        if apart[worst] > ALIKE * max(np.abs(first).max(), np.abs(second).max()):
            return (
                f"the supports '{one.boundary}' and '{other.boundary}' share nodes, and hold them along "
                f"{'xyz'[one.direction]} at {first[of_one][worst]:.6g} and {second[of_other][worst]:.6g} at "
                f"t = {time:g}: one displacement, or a direction that one of them leaves free, would be right"
            )
    return ""


def _as_it_is(share: float) -> float:
    return share


def _everywhere(value: float, x: Floats) -> Floats:
    return np.full(x.shape[1], value)


def _entry(field: Callable[[Floats], Floats], direction: int, x: Floats) -> Floats:
    return np.asarray(field(x)[direction])


def _held_dofs(
    support: Support | PointSupport | Rotation,
    mesh: Mesh,
    part: dolfinx.fem.FunctionSpace,
    alone: dolfinx.fem.FunctionSpace,
) -> tuple[Indices, Indices]:
    """The unknowns of one direction that a support holds, in the whole space and in that direction's own."""
    if not isinstance(support, PointSupport):
        found = dolfinx.fem.locate_dofs_topological((part, alone), mesh.dim - 1, mesh.boundary(support.on))
        return found[0], found[1]
    # By the corner of a cell: elements whose unknowns are moments (serendipity) have no positions.
    found = dolfinx.fem.locate_dofs_topological((part, alone), 0, mesh.corner(support.at))
    return found[0], found[1]


def _concentrated(load: NodalLoad, spaces: Spaces, unknowns: Unknowns, case: int) -> Floats:
    """Forces at places as each owned unknown has its share of them, by its shape function there."""
    mesh, V = spaces.scene.mesh, spaces.displacement_space
    found, forces = load.spots(mesh)
    shares = dolfinx.la.vector(V.dofmap.index_map, mesh.dim)
    if len(found.rows):  # basix aborts when it is given no points at all
        basis = V.ufl_element().sub_elements[0].tabulate(0, found.X)[0]
        of_cells = basis[:, :, np.newaxis] * forces[found.rows][:, np.newaxis, :]
        np.add.at(shares.array.reshape(-1, mesh.dim), V.dofmap.list[found.cells], of_cells)
    shares.scatter_reverse(dolfinx.la.InsertMode.add)
    shares.scatter_forward()
    whole = np.zeros_like(unknowns.function.x.array)
    whole[unknowns.parts[case]] = shares.array
    return whole[: unknowns.owned]


def _nodal_forces(load: Load, spaces: Spaces, test: Any, resultant: Callable[[Floats], Floats]) -> Floats:
    """The load's share of each owned unknown (force; per thickness in two dimensions).

    test: test function of the displacement, perhaps in a mixed space.  resultant: sums nodal forces on all ranks, one
    sum per direction.
    Raises InputError for a load that is not finite, or for a force without weight on its boundary.
    """
    mesh, space = spaces.scene.mesh, spaces.displacement_space
    intensity = dolfinx.fem.Function(space)
    interpolate(intensity, vector(load.intensity))
    measure = load.measure(mesh, 2 * space.element.basix_element.degree)
    forces = assemble(spaces.compile.form(balances.external_work(intensity, test, measure)))
    if mesh.comm.allreduce(int(not np.all(np.isfinite(forces)))):
        raise InputError(f"the load {load.place} is not a number everywhere: finite forces would be right")
    if load.resultant is None or not any(load.resultant):
        return forces
    wanted = np.array(load.resultant)
    reached = float(resultant(forces) @ wanted / (wanted @ wanted))
    if not reached > 0:
        raise InputError(f"the force {load.resultant} {load.place} has no weight there: a positive one is needed")
    return np.asarray(forces / reached)
