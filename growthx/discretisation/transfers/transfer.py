"""The density of one run as the start of another."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import dolfinx
import numpy as np
from mpi4py import MPI

from growthx.common.checks import require_kind, require_number
from growthx.common.errors import InputError
from growthx.common.words import quoted
from growthx.discretisation.transfers.grown import grown
from growthx.discretisation.transfers.projection import at_nodes, in_cells
from growthx.discretisation.transfers.samples import of_another_mesh, of_the_same_cells
from growthx.discretisation.variants import Nodal, Variant
from growthx.fem import compat
from growthx.fem.assembly import sum_cells
from growthx.meshing.mesh import Mesh
from growthx.meshing.transferred import TransferredDensity

if TYPE_CHECKING:
    from growthx.common.arrays import Floats, Indices, Marks
    from growthx.discretisation.transfers.grown import GrownDensity

_HALF, _LOW = np.uint64(32), np.uint64(0xFFFFFFFF)  # of the bits of a number
SAME = 1e-12  # relative to the size of the body: distance of nodes that are the same


def transfer(source: Any, mesh: Mesh, variant: Variant, *, outside: float | None = None) -> TransferredDensity:
    """The density that a run has ended with, as `initial_density` of a scene on a mesh, for a variant (collective).

    source: a result, a discretised scene, or what `read_density` returns of a folder; on any number of ranks.
    mesh, variant: of the run that begins.  On the same mesh, or on some of its cells, and where densities live alike it
    is the same to the bit.
    By another variant each cell keeps its mass, to round-off, or, with densities continuous between cells, the body
    does.  On another mesh of the same body the body does: `correction` tells how far densities were moved for that,
    within the bounds of those nearby.  A mesh of a part of the body, or of one with parts beside it, has the densities
    of the places.
    outside: a density for what lies where there was no body, farther off than a quarter of its cells; what is nearer
    has that of the nearest point.
    Raises InputError for what is no such source, mesh or variant, and, unless `outside` is given, if part of the mesh
    lies outside the body.

    Example:
        >>> from dataclasses import replace
        >>> coarse, fine = gx.solve(gx.scenes.plate(2), gx.Q1P0), gx.scenes.plate(4)
        >>> start = gx.transfer(coarse, fine.mesh, gx.Q1P0)
        >>> problem = gx.discretise(replace(fine, initial_density=start), gx.Q1P0)
        >>> abs(problem.mass() - coarse.problem.mass()) < 1e-9
        True
    """
    require_kind(mesh, Mesh, "the mesh to transfer a density to", "the growthx.Mesh of the scene that begins")
    require_kind(variant, Variant, "the variant to transfer a density to", "a variant such as gx.Q1")
    variant.check(mesh.cell_name)
    if outside is not None:
        require_number(outside, "the density outside", "a positive number", lambda rho: rho > 0)
    run = grown(source)
    if run.dim != mesh.dim:
        raise InputError(
            f"the density is of a body in {run.dim} dimensions and the mesh is in {mesh.dim}: as many would be right"
        )
    rows = _rows_of_the_same(run, mesh)
    space = dolfinx.fem.functionspace(mesh.domain, variant.density_element(mesh.cell_name))
    exact = rows is not None and run.element == variant.density_element(mesh.cell_name)
    facts = {"correction": 0.0, "beside": 0.0, "outside": 0.0, "exact": exact}
    if exact:
        of_cells, rests = run.densities[rows], run.rests[rows]
        values = _shared(space, of_cells, rests, mesh)
    else:
        samples = (
            of_another_mesh(run, mesh, variant, outside)
            if rows is None
            else of_the_same_cells(run, rows, mesh, variant)
        )
        facts |= {name: getattr(samples, name) for name in ("correction", "beside", "outside")}
        if isinstance(variant.density, Nodal):
            values, rests = at_nodes(samples, mesh, variant, space)
            of_cells = values[space.dofmap.list[: len(mesh.owned_cells)]]
            if mesh.comm.allreduce(int(np.count_nonzero(rests))):
                of_cells[rests] = in_cells(samples, mesh, variant)[rests]
                values = np.where(_touched(space, ~rests), values, _shared(space, of_cells, rests, mesh))
        else:
            of_cells = in_cells(samples, mesh, variant)
            values = _shared(space, of_cells, np.zeros(len(of_cells), dtype=bool), mesh)
    function, own = _functions(space, values, of_cells, variant)
    _require_positive(own, mesh.comm)
    origin = f"{quoted(run.scene)} with {run.variant} at t = {run.time:g}"
    return TransferredDensity(function, own, mesh=mesh, variant=variant.name, origin=origin, facts=facts)


def _rows_of_the_same(run: GrownDensity, mesh: Mesh) -> Indices | None:
    """Where the owned cells of a mesh stand in a run's, if each is one of them; else None (collective)."""
    from scipy.spatial import KDTree

    count = len(mesh.owned_cells)
    nodes = mesh.domain.geometry.x[compat.geometry_nodes(mesh.domain)[:count]][:, :, : mesh.dim]
    there = run.corners
    rows = np.zeros(count, dtype=np.int64)
    same = run.shape == mesh.cell_name and nodes.shape[1:] == there.shape[1:]
    if same and count:
        rows = KDTree(there.mean(axis=1)).query(nodes.mean(axis=1))[1]
        same = bool(np.abs(nodes - there[rows]).max() <= SAME * np.ptp(run.points, axis=0).max())
    return rows if mesh.comm.allreduce(same, MPI.LAND) else None


def _shared(space: dolfinx.fem.FunctionSpace, of_cells: Floats, rests: Marks, mesh: Mesh) -> Floats:
    """Densities of cells as `x.array`; at nodes that cells share those of what grows, to the bit (collective)."""
    values = np.full(space.dofmap.index_map.size_local + space.dofmap.index_map.num_ghosts, np.nan)
    rows = space.dofmap.list[: len(of_cells)]
    for some in (rests, ~rests):
        values[rows[some]] = of_cells[some]
    says = np.zeros(len(values), dtype=bool)
    says[rows[~rests]] = True
    # A rank may own a node of none of its cells that grow: it takes what others say, who all say the same.  Sums of the
    # halves of its bits are exact, as its own would not be.
    bits = np.where(says, values, 0.0).view(np.uint64)
    sums = dolfinx.la.vector(space.dofmap.index_map, 3)
    sums.array[:] = np.column_stack([says, bits >> _HALF, bits & _LOW]).astype(float).ravel()
    sums.scatter_reverse(dolfinx.la.InsertMode.add)
    ranks, *halves = sums.array.reshape(-1, 3).T
    high, low = ((half / np.maximum(ranks, 1.0)).astype(np.uint64) for half in halves)
    told = (high << _HALF | low).view(np.float64)
    own = dolfinx.la.vector(space.dofmap.index_map, 1)
    own.array[:] = np.where(~says & (ranks > 0), told, values)
    if mesh.comm.allreduce(int(np.isnan(own.array[: space.dofmap.index_map.size_local]).any())):
        resting = sum_cells(space, np.stack([of_cells, np.ones_like(of_cells)], axis=2))
        own.array[:] = np.where(np.isnan(own.array), resting[:, 0] / resting[:, 1], own.array)
    own.scatter_forward()
    return np.array(own.array)


def _touched(space: dolfinx.fem.FunctionSpace, cells: Marks) -> Marks:
    """Which densities are of some of the owned cells on any rank, as `x.array` (collective)."""
    ones = np.repeat(cells[:, np.newaxis].astype(float), space.dofmap.list.shape[1], axis=1)
    return sum_cells(space, ones[:, :, np.newaxis])[:, 0] > 0


def _functions(
    space: dolfinx.fem.FunctionSpace, values: Floats, of_cells: Floats, variant: Variant
) -> tuple[dolfinx.fem.Function, dolfinx.fem.Function]:
    """Densities as a function, and as one in which each cell has its own."""
    function = dolfinx.fem.Function(space, name="density")
    function.x.array[:] = values
    if not isinstance(variant.density, Nodal):
        return function, function
    own = dolfinx.fem.Function(dolfinx.fem.functionspace(space.mesh, ("DG", variant.density.degree)), name="density")
    own.x.array[own.function_space.dofmap.list[: len(of_cells)]] = of_cells
    own.x.scatter_forward()
    return function, own


def _require_positive(own: dolfinx.fem.Function, comm: MPI.Intracomm) -> None:
    least = comm.allreduce(float(own.x.array.min(initial=np.inf)), MPI.MIN)
    if not least > 0:
        raise InputError(
            f"the density that is transferred falls to {least:.3g}: one per cell, at integration points or linear in "
            "each cell, which keep within the bounds of the run's, would be right"
        )
