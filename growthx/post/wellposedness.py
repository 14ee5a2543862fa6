"""Whether a problem of growth is well posed: what the exponents say beforehand, and what a state shows."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import dolfinx
import numpy as np
import ufl
from mpi4py import MPI

from growthx.constitutive.growth import GrowthLaw
from growthx.discretisation.checks.arguments import require_problem
from growthx.discretisation.discretisation import Discretisation
from growthx.discretisation.trial import set_iterate
from growthx.discretisation.variants import AtPoints
from growthx.model.exponents import is_well_posed

if TYPE_CHECKING:
    from growthx.stepping.record import Result

FOREVER = 1e300  # time step in which a density comes to its equilibrium


@dataclass(frozen=True)
class WellPosedness:
    """What a state shows.

    exponents: whether the stimulus falls as the density rises, m > n; of a source without one, whether the source does.
    margin: lowest value of 1 − Δt ∂_ρR₀ at any integration point; below zero, the density of this step was not unique.
    negative: number of negative pivots of the tangent for Δt → ∞ that is symmetric with a density at each integration
    point; above zero, there are directions in which a disturbance of biological equilibrium grows.
    reason: what is wrong with the law, if anything is.

    Example:
        >>> gx.wellposedness.WellPosedness(exponents=True, margin=1.2, negative=0).negative
        0
    """

    exponents: bool
    margin: float
    negative: int
    reason: str = "m is not above n"

    @property
    def holds(self) -> bool:
        """Whether all say that the problem is well posed."""
        return self.exponents and self.margin > 0 and self.negative == 0

    def __str__(self) -> str:
        judgement = "well posed" if self.holds else "not well posed" + ("" if self.exponents else f" ({self.reason})")
        return (
            f"{judgement}: 1 − Δt ∂R₀/∂ρ is at least {self.margin:.3g}, and the tangent for Δt → ∞ has "
            f"{self.negative} negative pivots"
        )


def check(problem: Discretisation | Result) -> WellPosedness:
    """Examine the state that a problem is in, on request: it costs the compilation and factorisation of a tangent.

    Example:
        >>> gx.wellposedness.check(gx.discretise(gx.scenes.plate(2), gx.Q1P0)).exponents
        True
    """
    problem = require_problem(problem)
    points = problem.variant.integration_points(problem.scene.mesh.cell_name)
    highest = 0.0
    growth, material = problem.growth, problem.material
    power = growth.power_at(problem.density, material) if isinstance(growth, GrowthLaw) else None
    flat = np.isscalar(power) and power == 0
    slope = None if flat else growth.mass_source_slope(problem.density, problem.expressions.energy(), material)
    if slope is not None and not isinstance(slope, ufl.constantvalue.Zero):
        at_points = problem.evaluate(slope, points)[problem.growing_cells]
        highest = problem.comm.allreduce(float(at_points.max(initial=-np.inf)), MPI.MAX)
    margin = 1 - float(problem.state.time_step.value) * highest
    found = is_well_posed(problem.scene), margin, _negative_pivots(problem)
    if isinstance(growth, GrowthLaw):
        return WellPosedness(*found)
    return WellPosedness(*found, reason="the mass source does not fall as the density rises")


def _negative_pivots(problem: Discretisation) -> int:
    """Negative pivots of the Δt → ∞ tangent with a density at each integration point, in the state of a problem."""
    from growthx.solvers.tangent import negative_pivots

    variant = problem.variant
    pointwise = replace(
        variant,
        name=f"{variant.name} at points",
        density=AtPoints(),
        mass_degree=variant.momentum_degree,
        storage_at_corners=False,
        source_at_corners=False,
    )
    # What is not symmetric has no part in the growth of disturbances of the density; and it has that of the state, not
    # the scene's of the beginning, which may be one for this variant alone.
    scene = replace(problem.scene, flux=None, prescribed_densities=(), influx=(), inertia=None, initial_density=None)
    twin = Discretisation(scene, pointwise)
    points = variant.integration_points(scene.mesh.cell_name)
    cells, density = len(scene.mesh.owned_cells), twin.density.x.array.copy()
    density[twin.density_space.dofmap.list[:cells]] = problem.density_at(points)
    if problem.state.past is not None and twin.state.past is not None:
        past = twin.state.past.x.array.copy()
        past[twin.density_space.dofmap.list[:cells]] = problem.evaluate(problem.state.past, points)
        twin.state.past.x.array[:] = past
    at = dolfinx.fem.Function(twin.displacement_space)
    displacements = []
    for u in problem.displacements:
        at.interpolate(u)
        displacements.append(at.x.array.copy())
    twin.system.begin_step(FOREVER, 0.0)
    set_iterate(twin.system, displacements, density)
    return negative_pivots(twin.system)
