"""Supports and dead loads of a scene on a function space."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import dolfinx
import numpy as np

from growthx import balances
from growthx.assembly import Compiler, assemble
from growthx.errors import InputError
from growthx.fields import interpolate, vector
from growthx.supports import PointSupport

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from growthx.arrays import Floats, Indices
    from growthx.loads import Load
    from growthx.mesh import Mesh
    from growthx.supports import Support


@dataclass(frozen=True)
class Held:
    """One direction of a support: moved by `value` (length) at full load, where the unknowns `dofs` are `values`."""

    boundary: str  # or, of a point, its place
    case: int
    direction: int
    value: float
    dofs: Indices  # ghosts included
    values: Floats
    condition: dolfinx.fem.DirichletBC


def owned(condition: dolfinx.fem.DirichletBC) -> Indices:
    """Indices of the constrained unknowns this rank owns."""
    dofs, count = condition.dof_indices()
    return np.asarray(dofs[:count])


def hold(
    supports: Iterable[Support | PointSupport], mesh: Mesh, space: dolfinx.fem.FunctionSpace, case: int
) -> list[Held]:
    """Boundary conditions on the displacement of a load case, whose space is its own or a part of a mixed one."""
    held = []
    alone = dolfinx.fem.functionspace(mesh.domain, space.ufl_element().sub_elements[0])
    for support in supports:
        for i, value in support.components(mesh.dim):
            part = space.sub(i)
            # Interpolated, since some unknowns are moments (serendipity), not values at nodes.
            constant = dolfinx.fem.Function(alone)
            constant.interpolate(lambda x, value=value: np.full(x.shape[1], value))
            dofs, dofs_alone = _held_dofs(support, mesh, part, alone)
            condition = dolfinx.fem.dirichletbc(constant, [dofs, dofs_alone], part)  # type: ignore[arg-type]
            held.append(Held(support.place, case, i, value, dofs, constant.x.array[dofs_alone], condition))
    return held


def _held_dofs(
    support: Support | PointSupport, mesh: Mesh, part: dolfinx.fem.FunctionSpace, alone: dolfinx.fem.FunctionSpace
) -> tuple[Indices, Indices]:
    """The unknowns of one direction that a support holds, in the whole space and in that direction's own."""
    if not isinstance(support, PointSupport):
        found = dolfinx.fem.locate_dofs_topological((part, alone), mesh.dim - 1, mesh.boundary(support.on))
        return found[0], found[1]
    # By the corner of a cell: elements whose unknowns are moments (serendipity) have no positions.
    found = dolfinx.fem.locate_dofs_topological((part, alone), 0, mesh.corner(support.at))
    return found[0], found[1]


def nodal_forces(
    load: Load,
    mesh: Mesh,
    space: dolfinx.fem.FunctionSpace,
    test: Any,
    resultant: Callable[[Floats], Floats],
    compiler: Compiler,
) -> Floats:
    """The load's share of each owned unknown (force; per thickness in two dimensions).

    space: of the displacement, in which the load is interpolated.  test: test function of the displacement, in this
    or in a mixed space.  resultant: sums nodal forces on all ranks, one sum per direction.
    Raises InputError for a load that is not finite, or for a force without weight on its boundary.
    """
    intensity = dolfinx.fem.Function(space)
    interpolate(intensity, vector(load.intensity))
    measure = load.measure(mesh, 2 * space.element.basix_element.degree)
    forces = assemble(compiler.form(balances.external_work(intensity, test, measure)))
    if mesh.domain.comm.allreduce(int(not np.all(np.isfinite(forces)))):
        raise InputError(f"the load {load.place} is not a number everywhere: finite forces would be right")
    if load.resultant is None or not any(load.resultant):
        return forces
    wanted = np.array(load.resultant)
    reached = float(resultant(forces) @ wanted / (wanted @ wanted))
    if not reached > 0:
        raise InputError(f"the force {load.resultant} {load.place} has no weight there: a positive one is needed")
    return np.asarray(forces / reached)
