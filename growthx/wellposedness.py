"""Whether a problem of growth is well posed: what the exponents say beforehand, and what a state shows."""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from mpi4py import MPI

from growthx.point_based import PointBased
from growthx.variants import AtPoints

if TYPE_CHECKING:
    from growthx.discretisation import Discretisation
    from growthx.scene import Scene

_said: set[str] = set()


def is_well_posed(scene: Scene) -> bool:
    """Whether more density means a lower stimulus at the same deformation, m > n: then the equilibrium is unique and
    stable (Harrigan & Hamilton 1994; the paper's section 3.2).
    """
    return scene.growth.power(scene.material) < 0


def warn_if_ill_posed(scene: Scene) -> None:
    """Say once, on rank 0, what to expect of a model that is not well posed."""
    if is_well_posed(scene) or scene.mesh.domain.comm.rank != 0:
        return
    power = scene.growth.power(scene.material)
    message = (
        f"growthx: the stimulus does not fall as the density rises (n − m = {power:g}, not below 0), so the model is "
        "not well posed: expect densities that run to zero or without bound, checkerboards, and results that depend on "
        "the mesh and on the time step"
    )
    if message not in _said:
        _said.add(message)
        logging.getLogger("growthx").warning(message)


@dataclass(frozen=True)
class WellPosedness:
    """What a state shows.

    exponents: whether the stimulus falls as the density rises, m > n.
    margin: lowest value of 1 − Δt ∂_ρR₀ at any integration point; below zero, the density of this step was not unique.
    negative: number of negative pivots of the tangent for Δt → ∞ that is symmetric with a density at each integration
    point; above zero, there are directions in which a disturbance of biological equilibrium grows.
    """

    exponents: bool
    margin: float
    negative: int

    @property
    def holds(self) -> bool:
        """Whether all say that the problem is well posed."""
        return self.exponents and self.margin > 0 and self.negative == 0

    def __str__(self) -> str:
        judgement = "well posed" if self.holds else "not well posed" + ("" if self.exponents else " (m is not above n)")
        return (
            f"{judgement}: 1 − Δt ∂R₀/∂ρ is at least {self.margin:.3g}, and the tangent for Δt → ∞ has "
            f"{self.negative} negative pivots"
        )


def check(problem: Discretisation) -> WellPosedness:
    """Examine the state that a problem is in, on request: it costs the compilation and factorisation of a tangent."""
    points = problem.variant.integration_points(problem.scene.mesh.cell_name)
    highest = 0.0
    if problem.scene.growth.power(problem.scene.material) != 0:
        slope = problem.growth.mass_source_slope(problem.density, problem.mean_energy(), problem.material)
        at_points = problem.evaluate(slope, points)[problem.growing_cells]
        highest = problem.comm.allreduce(float(at_points.max(initial=-np.inf)), MPI.MAX)
    return WellPosedness(
        is_well_posed(problem.scene), 1 - float(problem.time_step.value) * highest, _negative_pivots(problem)
    )


def _negative_pivots(problem: Discretisation) -> int:
    """Negative pivots of the Δt → ∞ tangent with a density at each integration point, in the state of a problem."""
    from growthx.newton import negative_pivots

    variant = problem.variant
    pointwise = replace(
        variant,
        name=f"{variant.name} at points",
        density=AtPoints(),
        mass_degree=variant.momentum_degree,
        storage_at_corners=False,
        source_at_corners=False,
    )
    # What is not symmetric has no part in the growth of disturbances of the density.
    scene = replace(problem.scene, flux=None, prescribed_densities=(), influx=(), inertia=None)
    twin = PointBased(scene, pointwise)
    points = variant.integration_points(scene.mesh.cell_name)
    cells = len(scene.mesh.owned_cells)
    twin.density.x.array[twin.density_space.dofmap.list[:cells]] = problem.density_at(points)
    for part, u, same in zip(twin.parts, problem.displacements, twin.displacements, strict=True):
        same.interpolate(u)
        twin.unknown.x.array[part] = same.x.array
    twin.time_step.value = 1e300
    return negative_pivots(twin)
