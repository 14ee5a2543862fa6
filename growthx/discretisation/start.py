"""The fields of a state as they are at the start, and the density of what does not grow, which stays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import basix.ufl
import dolfinx
import numpy as np
from mpi4py import MPI

from growthx.common.arrays import is_uniform
from growthx.common.checks import require
from growthx.common.errors import raise_on_all
from growthx.fem.assembly import average_cells
from growthx.meshing.fields import as_ufl, has_points, put
from growthx.meshing.images.density import ScanDensity
from growthx.meshing.images.nodal import OfField, OfScan, Part, at_nodes
from growthx.meshing.sampling import reference_corners
from growthx.meshing.transferred import TransferredDensity

if TYPE_CHECKING:
    from growthx.common.arrays import Floats, Indices
    from growthx.discretisation.spaces import Spaces

FAR = 100.0  # reference densities, beyond which a density is of another unit: [ρ/ρ*]ⁿ has nothing to say there
A_HAIR = 1e-9  # of the way from a node to the middle of a cell
A_JUMP = 1e-6  # relative, of a density over that way


@dataclass(frozen=True)
class Start:
    """Functions for a state, at the start.

    displacements: of the load cases; displacement: for their mean, the one if there is one.
    density, old_density: at the end and at the start of a step.
    resting: density of what does not grow, in UFL; shared nodes do not have it.
    at_nodes: of each cell that rests, (resting cells, densities of a cell), where nodes are shared; else None.
    """

    displacements: list[dolfinx.fem.Function]
    displacement: dolfinx.fem.Function
    density: dolfinx.fem.Function
    old_density: dolfinx.fem.Function
    resting: Any
    at_nodes: Floats | None = None


def start(spaces: Spaces) -> Start:
    """The start of a scene; InputError if the initial density is nowhere near what it may be (collective)."""
    V, D = spaces.displacement_space, spaces.density_space
    displacements = [dolfinx.fem.Function(V, name=case.name) for case in spaces.cases]
    displacement = displacements[0] if len(displacements) == 1 else dolfinx.fem.Function(V)
    displacement.name = "displacement"
    density, old_density = dolfinx.fem.Function(D, name="density"), dolfinx.fem.Function(D, name="old_density")
    _fill(spaces, density)
    resting, at_nodes = density, None
    if spaces.rests and not spaces.variant.density.local:
        resting, at_nodes = _own_at_rest(spaces, density)
    require(density, "the initial density ρ(0)", "a positive number", lambda rho: rho > 0)
    _require_scale(spaces, density)
    old_density.x.array[:] = density.x.array
    return Start(displacements, displacement, density, old_density, resting, at_nodes)


def _require_scale(spaces: Spaces, density: dolfinx.fem.Function) -> None:
    """Refuse a density of another unit than the reference density, such as HU or kg/m³ for g/cm³ (collective).

    It is far away nearly everywhere; in some cells it may well be.
    """
    mesh, given = spaces.scene.mesh, as_ufl(spaces.scene.material.reference_density, spaces.scene.mesh)
    reference = np.ones(len(mesh.owned_cells))
    if isinstance(given, dolfinx.fem.Function):
        reference *= given.x.array[given.function_space.dofmap.list[: len(reference)]].max(axis=1, initial=0.0)
    else:
        reference *= given.value
    highest = density.x.array[spaces.density_space.dofmap.list[: len(reference)]].max(axis=1, initial=0.0)
    far = np.flatnonzero(highest > FAR * reference)
    if 2 * spaces.comm.allreduce(len(far)) <= mesh.cell_count:
        return
    raise_on_all(
        spaces.comm,
        f"the initial density ρ(0) is {highest[far[0]]:g} somewhere, where the reference density is "
        f"{reference[far[0]]:g}: one in the same unit, such as g/cm³ and not HU, would be right"
        if len(far)
        else "",
    )


def _fill(spaces: Spaces, density: dolfinx.fem.Function) -> None:
    """Give a density the values of the scene's start."""
    given = spaces.scene.start_density
    if is_uniform(given):
        density.x.array[:] = given
    elif has_points(given):
        put(density, given, spaces.scene.mesh)
        density.x.scatter_forward()  # where others' cells are, a node's place has another last digit
    elif isinstance(given, TransferredDensity):
        density.x.array[:] = given.x.array
    else:
        parts = _parts(spaces)
        if not parts or spaces.rests:
            _average(spaces, as_ufl(given, spaces.scene.mesh), density)
        if parts:
            values, known = at_nodes(spaces.density_space, spaces.scene.mesh, parts)
            density.x.array[known] = values[known]


def _parts(spaces: Spaces) -> list[Part]:
    """What begins by scans with other values in the same cells, where nodes are shared, and what else grows beside it.

    None, if nothing does.
    """
    given, mesh = spaces.scene.start_density, spaces.scene.mesh
    fields = given if isinstance(given, Mapping) else {None: given}
    if spaces.variant.density.local or not any(isinstance(field, ScanDensity) for field in fields.values()):
        return []
    distinct: list[Any] = []
    of_cells = np.full(len(mesh.local_cells), -1)  # which field each cell has: the last one that is given for it
    for name, field in fields.items():
        same = [i for i, other in enumerate(distinct) if other is field and isinstance(field, ScanDensity)]
        if not same:
            distinct.append(field)
        of_cells[slice(None) if name is None else mesh.region(name)] = same[0] if same else len(distinct) - 1
    return _with_cells(spaces, distinct, of_cells[spaces.growing_cells])


def _with_cells(spaces: Spaces, fields: list[Any], of_growing: Indices) -> list[Part]:
    """The parts of fields, given by their numbers for each cell that grows; none, if no scan is among these."""
    counts = spaces.comm.allreduce(np.bincount(of_growing + 1, minlength=len(fields) + 1))[1:]
    there = [(field, spaces.growing_cells[of_growing == i]) for i, field in enumerate(fields) if counts[i]]
    if not any(isinstance(field, ScanDensity) for field, _ in there):
        return []
    parts: list[Part] = []
    values = partial(spaces.evaluate, _without_scans(spaces))
    for field, cells in there:
        if isinstance(field, ScanDensity):
            field.check_dimension(spaces.scene.mesh.dim)
            parts.append(OfScan(field, cells))
            continue
        found = values(spaces.density_points)[cells].min(initial=np.inf)
        parts.append(OfField(values, cells, float(spaces.comm.allreduce(found, MPI.MIN))))
    return parts


def _without_scans(spaces: Spaces) -> Any:
    """The start in UFL, as if scans were a number: where they are it is not asked for.

    Raises InputError if cells have none.
    """
    given = spaces.scene.start_density
    if not isinstance(given, Mapping):
        return as_ufl(1.0, spaces.scene.mesh)
    rest = {name: 1.0 if isinstance(field, ScanDensity) else field for name, field in given.items()}
    return as_ufl(rest, spaces.scene.mesh)


def _average(spaces: Spaces, given: dolfinx.fem.Function, density: dolfinx.fem.Function) -> None:
    """Give each density what a function has there, the mean of the cells around where they differ.

    What rests has no say where something grows: bone does not begin with a share of the density of metal.
    """
    theirs, own = given.function_space, spaces.density_space
    alike = theirs.ufl_element() == own.ufl_element() and np.array_equal(theirs.dofmap.list, own.dofmap.list)
    if not spaces.comm.allreduce(int(not alike)):  # to the bit: a mean of what is the same may round
        density.x.array[:] = given.x.array
        density.x.scatter_forward()
        return
    values = spaces.evaluate(given, spaces.density_points)
    first = spaces.growing_cells if spaces.rests else None
    density.x.array[:] = average_cells(own, values, first).x.array


def _own_at_rest(spaces: Spaces, density: dolfinx.fem.Function) -> tuple[Any, Floats]:
    """What does not grow shares nodes with what does: its density as it is given, not as the nodes have it.

    In UFL, and of each cell that rests.
    """
    if has_points(spaces.scene.start_density):
        return _split_at_jumps(spaces, density)
    given = as_ufl(spaces.scene.start_density, spaces.scene.mesh)
    if isinstance(spaces.scene.start_density, TransferredDensity):
        return given, spaces.scene.start_density.of_cells()[spaces.resting_cells]
    return given, spaces.evaluate(given, spaces.density_points)[spaces.resting_cells]


def _split_at_jumps(spaces: Spaces, density: dolfinx.fem.Function) -> tuple[dolfinx.fem.Function, Floats]:
    """Where a function of position jumps from what grows to what does not, give each side the value of its own.

    The density of what rests is then a function with nodes of each cell's own.
    """
    mesh, element, X = spaces.scene.mesh, spaces.density_space.ufl_element(), spaces.density_points
    inwards = X + A_HAIR * (reference_corners(mesh.cell_name).mean(axis=0) - X)
    points = basix.ufl.quadrature_element(element.cell_type.name, points=inwards, weights=np.ones(len(X)))
    inside = dolfinx.fem.Function(dolfinx.fem.functionspace(mesh.domain, points))
    put(inside, spaces.scene.start_density, mesh)
    cells = len(mesh.owned_cells)
    values = inside.x.array[inside.function_space.dofmap.list[:cells]]
    at_nodes = np.asarray(density.x.array[spaces.density_space.dofmap.list[:cells]])
    shared = average_cells(spaces.density_space, values, spaces.growing_cells).x.array
    for side, exact in ((values, at_nodes), (shared, density.x.array)):
        np.copyto(side, exact, where=np.isclose(side, exact, rtol=A_JUMP, atol=0.0))
    density.x.array[:] = shared
    own_nodes = dolfinx.fem.functionspace(mesh.domain, ("DG", element.degree))
    resting = dolfinx.fem.Function(own_nodes)
    resting.x.array[own_nodes.dofmap.list[:cells]] = values
    resting.x.scatter_forward()
    return resting, values[spaces.resting_cells]
