"""Errors of one run: in space, of the manufactured problem; in time, of a block in homogeneous tension."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np
import ufl
from mpi4py import MPI
from scipy.integrate import solve_ivp
from scipy.optimize import root

import growthx as gx
from benchmarks.accuracy import manufactured
from benchmarks.accuracy.convergence.orders import END_DENSITY, END_DISPLACEMENT, QUANTITIES
from benchmarks.accuracy.manufactured import QUADRILATERALS, TRIANGLES
from benchmarks.shared.integrals import rule
from growthx.fem import kernels
from growthx.meshing.sampling import positions

if TYPE_CHECKING:
    from growthx.discretisation.discretisation import Discretisation

COMM = MPI.COMM_WORLD

DEGREE = 9  # of the rule the errors are integrated with


# -- in space ----------------------------------------------------------------------------------------------------------


def errors_in_space(variant: gx.Variant, mesh: gx.Mesh) -> dict[str, float]:
    """The four errors of the manufactured problem on one mesh, each an L² norm over a body of volume one.

    At its points: the root mean square over the places of the densities (nodes, midpoints or integration points).
    """
    problem = solved(variant, mesh)
    dim = mesh.dim
    X, volumes = rule(mesh, DEGREE)
    x = positions(mesh, X).reshape(-1, 3).T
    gradients = kernels.expression(ufl.grad(problem.displacement), X).eval(mesh.domain, mesh.owned_cells)
    found = {
        "displacement": problem.displacement_at(X).reshape(-1, dim).T,
        "gradient": np.reshape(gradients, (-1, dim, dim)).transpose(1, 2, 0),
        "density": problem.density_at(X).ravel(),
    }
    norms = [norm(values - manufactured.numeric(dim, name)(x), volumes.ravel()) for name, values in found.items()]
    return dict(zip(QUANTITIES, [*norms, error_at_points(problem)], strict=True))


def solved(variant: gx.Variant, mesh: gx.Mesh) -> Discretisation:
    """The manufactured problem after its one step."""
    scene = manufactured.scene(mesh)
    problem = gx.discretise(scene, variant)
    begin_at_the_solution(problem)
    times = [step.time for step in gx.march(scene, variant, problem, tolerance=1e-11)]
    if times != [scene.program.until]:
        raise gx.EndedEarly(f"{variant.name} took the step in pieces, to the times {times}: it solves another problem")
    return problem


def begin_at_the_solution(problem: Discretisation) -> None:
    """Interpolate the exact fields into the first iterate.

    From rest, S2Q1 on 5 or 6 hexahedra per side finds another root of its equations, wrong at a free corner.
    """
    unknown, dim = problem.system.unknown, problem.scene.mesh.dim
    alone = unknown is problem.displacement
    parts = {"displacement": unknown} if alone else {"displacement": unknown.sub(0), "density": unknown.sub(1)}
    for name, part in parts.items():
        part.interpolate(manufactured.numeric(dim, name))
    unknown.x.scatter_forward()


def error_at_points(problem: Discretisation) -> float:
    """Root mean square error of the densities where they are."""
    owned = problem.density_space.dofmap.index_map.size_local
    x = problem.density_positions()[:owned].T
    exact = manufactured.numeric(problem.scene.mesh.dim, "density")(x)
    return norm(problem.density.x.array[:owned] - exact, 1 / COMM.allreduce(owned))


def norm(values: np.ndarray, weights: np.ndarray | float) -> float:
    """Square root of the weighted sum of squares over all points of all ranks."""
    return float(np.sqrt(COMM.allreduce(float(np.sum(values**2 * weights)))))


# -- in time -----------------------------------------------------------------------------------------------------------

BLOCK = gx.Material(young=3.0, poisson=0.3, reference_density=1.2)
GROWTH = gx.EnergyDrivenGrowth(attractor=0.05, rate=4.0)
TENSION, UNTIL = 0.9, 1.0


def errors_in_time(variant: gx.Variant, steps: int) -> dict[str, float]:
    """Errors at the end of a block in homogeneous tension, the load constant from t = 0; the mesh plays no part."""
    scene = gx.Scene(
        name="block",
        mesh=(QUADRILATERALS if "quadrilateral" in variant.cells else TRIANGLES).mesh(2),
        material=BLOCK,
        growth=GROWTH,
        supports=(gx.Support("left", (0.0, None)), gx.Support("bottom", (None, 0.0))),
        loads=(gx.Traction("right", (TENSION, 0.0)),),
        program=gx.Program(step=UNTIL / steps, until=UNTIL),
    )
    problem = gx.discretise(scene, variant)
    taken = sum(1 for _ in gx.march(scene, variant, problem, tolerance=1e-12))
    if taken != steps:
        raise gx.EndedEarly(f"{variant.name} took {taken} steps instead of {steps}")
    density, stretch = end_of_tension()
    middle = np.array([[0.5, 0.5]]) if scene.mesh.cell_name == "quadrilateral" else np.array([[1 / 3, 1 / 3]])
    x, u = positions(scene.mesh, middle)[..., 0], problem.displacement_at(middle)[..., 0]
    owned = np.abs(problem.density.x.array[: problem.density_space.dofmap.index_map.size_local] - density)
    return {
        END_DENSITY: COMM.allreduce(owned.max(initial=0.0), MPI.MAX),
        END_DISPLACEMENT: COMM.allreduce(np.abs(u - (stretch - 1) * x).max(initial=0.0), MPI.MAX),
    }


@cache
def end_of_tension() -> tuple[float, float]:
    """Density and stretch at the end by a method of high order: ρ̇ = R₀ (3), (6) with stretches in balance (7)."""
    lam, mu = BLOCK.lame
    reference, n, m = BLOCK.reference_density, BLOCK.density_exponent, GROWTH.exponent

    def stretches(density: float) -> tuple[float, float]:
        def stresses(s: np.ndarray) -> np.ndarray:
            P = mu * s + (lam * np.log(s[0] * s[1]) - mu) / s
            return (density / reference) ** n * P - (TENSION, 0.0)

        return tuple(root(stresses, (1.2, 0.9), tol=1e-14).x)

    def source(_: float, density: np.ndarray) -> float:
        a, b = stretches(density[0])
        energy = lam / 2 * np.log(a * b) ** 2 + mu / 2 * (a**2 + b**2 + 1 - 3 - 2 * np.log(a * b))
        return GROWTH.rate * ((density[0] / reference) ** (n - m) * energy - GROWTH.attractor)

    density = solve_ivp(source, (0, UNTIL), [reference], method="DOP853", rtol=1e-12, atol=1e-14).y[0, -1]
    return float(density), stretches(density)[0]
