"""Back from a step that failed, and what was wrong with it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import dolfinx
import ufl

from growthx.constitutive import quantities
from growthx.constitutive.kinematics import Plane, displacement_gradient, volume_change
from growthx.fem.places import Exceptions, first_place

if TYPE_CHECKING:
    from growthx.discretisation.densities.lumped_nodes import LumpedNodes
    from growthx.discretisation.discretisation import Discretisation
    from growthx.solvers.report import NewtonReport

CRUSHED = 1e-8  # det F at a corner: half of the digits of F⁻ᵀ are gone, and what the energy is there, with them
VANISHED = 1e-9  # share of the old density: a line search that halves its way towards zero never gets there


def take_back(problem: Discretisation, report: NewtonReport) -> str:
    """Go back from a failed step to the state at its start; says why it failed, as a part of a sentence."""
    why = inadmissible(problem) or report.reason
    problem.system.reject_step()
    return why


def inadmissible(problem: Discretisation) -> str:
    """What is wrong with the running iterate, and where, as a part of a sentence; empty if nothing is (collective)."""
    return _turned_over(problem) or _without_thickness(problem) or _without_density(problem)


def _turned_over(problem: Discretisation) -> str:
    if problem.scene.material.small_strain:
        return ""
    spaces, lumped = problem.spaces, problem.system.densities.lumped
    u = dolfinx.fem.Function(problem.displacement_space)
    stays = ufl.gt(volume_change(displacement_gradient(u)), -1)
    points = [(stays, spaces.whole_volume)]
    if lumped is not None:
        points += _at_nodes(stays, lumped)
    looked_at = [Exceptions(condition, volume, u.function_space, problem.compile) for condition, volume in points]
    for case, displacement in zip(spaces.cases, problem.system.unknowns.displacement_arrays(), strict=True):
        u.x.array[:] = displacement
        for exceptions in looked_at:
            if where := exceptions.first():
                return f"det F ≤ 0 in the cell at {where}" + (f" in the load case '{case.name}'" if case.name else "")
    return ""


def _without_thickness(problem: Discretisation) -> str:
    """In plane stress an energy may have no thickness that bears nothing."""
    if problem.scene.plane is not Plane.STRESS:
        return ""
    spaces, system = problem.spaces, problem.system
    for case, u in zip(spaces.cases, system.unknowns.displacements, strict=True):
        thickness = quantities.thickness_stretch(problem.material, problem.density, system.deformation.gradient(u))
        known = ufl.ge(thickness**2, 0)  # of what is not a number it does not hold
        if where := Exceptions(known, spaces.whole_volume, problem.displacement_space, problem.compile).first():
            of_case = f" in the load case '{case.name}'" if case.name else ""
            return f"at no thickness σ₃₃ = 0 in the cell at {where}{of_case}"
    return ""


def _at_nodes(holds: Any, lumped: LumpedNodes) -> list[tuple[Any, ufl.Measure]]:
    """A condition where the source asks for the energy at the nodes."""
    return [(holds if here is None else ufl.Or(holds, ufl.Not(here)), nodes) for here, nodes in lumped.places()]


class Corners:
    """Looks for corners that are crushed in a balance which nothing else speaks against.

    Where the source is lumped it asks for energies at the nodes, but forces are summed at other points: they do not
    keep a corner from folding over, and ln J, which is not defined then, stops it wherever round-off says J > 0.
    """

    def __init__(self, problem: Discretisation) -> None:
        self._problem, self._u = problem, dolfinx.fem.Function(problem.displacement_space)
        self._looked_at: list[Exceptions] = []

    def crushed(self) -> str:
        """Where J is less than `CRUSHED` in the running iterate, as a part of a sentence, or empty (collective)."""
        problem, lumped = self._problem, self._problem.system.densities.lumped
        if lumped is None or problem.scene.material.small_strain or not lumped.places():
            return ""
        if not self._looked_at:  # compiled once
            is_left = ufl.gt(volume_change(displacement_gradient(self._u)), CRUSHED - 1)
            self._looked_at = [
                Exceptions(condition, nodes, self._u.function_space, problem.compile)
                for condition, nodes in _at_nodes(is_left, lumped)
            ]
        for displacement in problem.system.unknowns.displacement_arrays():
            self._u.x.array[:] = displacement
            for exceptions in self._looked_at:
                if where := exceptions.first():
                    return f"det F is less than {CRUSHED:g} at a corner of the cell at {where}, where no force resists"
        return ""


def _without_density(problem: Discretisation) -> str:
    old = problem.state.accepted_density[: len(problem.volumes)]
    gone = ~(problem.system.densities.iterate()[: len(old)] > VANISHED * old)
    if where := first_place(gone, problem.density_positions(), problem.scene.mesh.dim, problem.comm):
        return f"no positive density balances the mass at {where}"
    where = _between_nodes(problem)
    return f"the density falls below zero between the nodes of the cell at {where}" if where else ""


def _between_nodes(problem: Discretisation) -> str:
    """Polynomials of a higher degree than one may be negative there, beside a cliff."""
    spaces = problem.spaces
    if spaces.variant.density.local or spaces.density_space.ufl_element().degree < 2:
        return ""
    stays = ufl.gt(problem.system.unknowns.density, 0)
    return Exceptions(stays, spaces.growing_volume, problem.displacement_space, problem.compile).first()
