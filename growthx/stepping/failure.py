"""Back from a step that failed, and what was wrong with it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import dolfinx
import numpy as np
import ufl

from growthx.common.words import place_in_words
from growthx.constitutive.kinematics import displacement_gradient, volume_change
from growthx.fem.assembly import assemble

if TYPE_CHECKING:
    from mpi4py import MPI

    from growthx.common.arrays import Floats, Marks
    from growthx.discretisation.discretisation import Discretisation
    from growthx.solvers.report import NewtonReport

VANISHED = 1e-9  # share of the old density: a line search that halves its way towards zero never gets there


def take_back(problem: Discretisation, report: NewtonReport) -> str:
    """Go back from a failed step to the state at its start; says why it failed, as a part of a sentence."""
    why = inadmissible(problem) or report.reason
    problem.system.reject_step()
    return why


def inadmissible(problem: Discretisation) -> str:
    """What is wrong with the running iterate, and where, as a part of a sentence; empty if nothing is (collective)."""
    return _turned_over(problem) or _without_density(problem)


def _turned_over(problem: Discretisation) -> str:
    mesh = problem.scene.mesh
    if problem.scene.material.small_strain:
        return ""
    space, u = dolfinx.fem.functionspace(mesh.domain, ("DG", 0)), dolfinx.fem.Function(problem.displacement_space)
    inverted = ufl.conditional(ufl.gt(volume_change(displacement_gradient(u)), -1), 0.0, 1.0)
    count = problem.compile.form(inverted * ufl.TestFunction(space) * problem.spaces.whole_volume)
    midpoints = dolfinx.mesh.compute_midpoints(mesh.domain, mesh.dim, mesh.owned_cells)
    for case, displacement in zip(problem.spaces.cases, problem.system.unknowns.displacement_arrays(), strict=True):
        u.x.array[:] = displacement
        if where := _first(~(assemble(count) == 0), midpoints, mesh.dim, problem.comm):
            return f"det F ≤ 0 in the cell at {where}" + (f" in the load case '{case.name}'" if case.name else "")
    return ""


def _without_density(problem: Discretisation) -> str:
    old = problem.state.accepted_density[: len(problem.volumes)]
    gone = ~(problem.system.densities.iterate()[: len(old)] > VANISHED * old)
    where = _first(gone, problem.density_positions(), problem.scene.mesh.dim, problem.comm)
    return f"no positive density balances the mass at {where}" if where else ""


def _first(wrong: Marks, where: Floats, dim: int, comm: MPI.Intracomm) -> str:
    """Position of the first entry that is wrong on any rank, as text; empty if none is."""
    found = np.flatnonzero(wrong)
    places = comm.allgather(where[found[0]] if len(found) else None)
    place = next((place for place in places if place is not None), None)
    if place is None:
        return ""
    tidy = np.where(np.abs(place) < 1e-12 * np.abs(place).max(), 0.0, place)
    return place_in_words(tidy[:dim], 4)
