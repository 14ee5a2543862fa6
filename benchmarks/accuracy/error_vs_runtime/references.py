"""Over-resolved final states, and the errors of others against them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

import growthx as gx
from benchmarks.accuracy.error_vs_runtime.cases import ADAPTIVE, Plan, Run, Way
from benchmarks.accuracy.error_vs_runtime.runs import solve
from benchmarks.shared.integrals import relative, rule
from growthx.meshing.sampling import cells_at, positions

if TYPE_CHECKING:
    from growthx.common.arrays import Floats
    from growthx.discretisation.discretisation import Discretisation


class Reference:
    """An over-resolved final state that is read anywhere in the body."""

    def __init__(self, plan: Plan, run: Run) -> None:
        self._problem = solve(plan.scene(run.mesh), run.variant, Way(ADAPTIVE, run.tolerance)).problem

    def density(self, places: Floats) -> Floats:
        """By the polynomial through the integration points of each cell, which are where its density is most exact."""
        space = self._problem.density_space
        points = space.ufl_element().custom_quadrature()[0]
        cells, X = cells_at(self._problem.scene.mesh, places)
        if (cells < 0).any():
            raise gx.GrowthxError(f"{np.sum(cells < 0)} points of a mesh lie outside the reference's")
        shares = monomials(X, len(points)) @ np.linalg.inv(monomials(points, len(points)))
        return np.einsum("pd,pd->p", shares, self._problem.density.x.array[space.dofmap.list[cells]])

    def displacement(self, places: Floats) -> Floats:
        """As it is."""
        return self._problem.sample_displacement(places)


def monomials(X: Floats, count: int) -> Floats:
    """xⁱ yʲ at points, as many as a tensor rule has points, shape (points, count)."""
    powers = range(math.isqrt(count))
    return np.column_stack([X[:, 0] ** i * X[:, 1] ** j for i in powers for j in powers])


def difference(first: Reference, second: Reference, scene: gx.Scene) -> tuple[float, float]:
    """Of two references in density and displacement, at the integration points of Q1 on a mesh."""
    X, volumes = rule(scene.mesh, gx.Q1.momentum_degree)
    places = positions(scene.mesh, X).reshape(-1, 3)[:, : scene.mesh.dim]
    return (
        relative(second.density(places), first.density(places), volumes.ravel()),
        relative(second.displacement(places), first.displacement(places), volumes.ravel()),
    )


@dataclass(frozen=True)
class Errors:
    """Of a final state, relative: of density and displacement in L², at the integration points of the momentum.

    density_at_its_points: where it is solved for – midpoints, integration points, nodes – weighted by their volumes.
    """

    density: float
    density_at_its_points: float
    displacement: float


FAILED = Errors(math.nan, math.nan, math.nan)


class Yardstick:
    """The reference, read where a discretisation on a mesh is to be compared with it."""

    def __init__(self, reference: Reference, problem: Discretisation) -> None:
        mesh = problem.scene.mesh
        self._X, volumes = rule(mesh, problem.variant.momentum_degree)
        places = positions(mesh, self._X).reshape(-1, 3)[:, : mesh.dim]
        self._volumes = volumes.ravel()
        self._density = reference.density(places)
        self._displacement = reference.displacement(places)
        own = problem.density_positions()[:, : mesh.dim]
        # A hair inwards: a node on the border of the body may lie outside by a rounding error.
        self._own_density = reference.density(own + 1e-9 * (own.mean(axis=0) - own))

    def errors(self, problem: Discretisation) -> Errors:
        """Of the final state of a run."""
        density = problem.density_at(self._X).ravel()
        displacement = problem.displacement_at(self._X).reshape(self._displacement.shape)
        own = problem.density.x.array
        return Errors(
            relative(density, self._density, self._volumes),
            relative(own, self._own_density, problem.volumes),
            relative(displacement, self._displacement, self._volumes),
        )
