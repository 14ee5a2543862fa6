"""The paper's bar in tension (its sections 4.4 and 5.4): a discontinuous and a continuous problem."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI

from growthx.common.checks import is_whole, require_kind
from growthx.common.errors import InputError, shown
from growthx.common.renamed import renamed
from growthx.constitutive.growth import EnergyDrivenGrowth
from growthx.constitutive.homogeneous import Equilibrium, uniaxial_equilibrium
from growthx.constitutive.kinematics import Plane
from growthx.constitutive.material import Material
from growthx.meshing import files
from growthx.meshing.sampling import positions, reference_corners
from growthx.model.loads import Traction
from growthx.model.program import Program
from growthx.model.scene import Scene
from growthx.model.supports import Support

if TYPE_CHECKING:
    from collections.abc import Callable

    from growthx.common.arrays import Floats, Marks
    from growthx.discretisation.discretisation import Discretisation
    from growthx.meshing.mesh import Mesh

WIDTH = 0.01
MOST_ELEMENTS = 100_000  # cells a thousand times as wide as long
TRACTION = 2.0
ATTRACTOR_LEVELS = (2.0, 1.75, 1.5, 1.25, 1.0)  # from either end to mid-length, each on a tenth of the length


@dataclass(frozen=True)
class Problem:
    """One of the paper's two bars.

    attractor: Ψ₀*(x₁) along the bar.  taper: width at mid-length over width at the ends, linear between.
    """

    name: str
    attractor: Callable[[Floats], Floats]
    taper: float

    def traction(self, x: Floats) -> Floats:
        """Force over the cross-section's area along the bar."""
        return TRACTION / (1 - (1 - self.taper) * (1 - np.abs(2 * x - 1)))


def _stepped(x: Floats) -> Floats:
    return np.choose(np.clip((np.minimum(x, 1 - x) * 10).astype(int), 0, 4), ATTRACTOR_LEVELS)


DISCONTINUOUS = Problem("discontinuous", _stepped, taper=1.0)
CONTINUOUS = Problem("continuous", lambda x: np.full_like(x, 2.0), taper=0.5)
PROBLEMS = {problem.name: problem for problem in (DISCONTINUOUS, CONTINUOUS)}


@renamed(problem="kind", cells="shape")
def bar(
    kind: Problem | str = DISCONTINUOUS,
    elements: int = 40,
    *,
    shape: str = "quadrilateral",
    n: float = 2.0,
    m: float = 3.0,
    step: float = 0.1,
    until: float = 6.0,
    comm: MPI.Comm = MPI.COMM_WORLD,
) -> Scene:
    """Bar [0, 1] × 0.01 of `elements` × 1 quadrilaterals, clamped on the left, dead traction (2, 0) on the right.

    kind: "discontinuous" or "continuous", or the problem of that name.
    shape: "triangle" halves each quadrilateral, with diagonals that alternate.
    n, m: exponents of density.  step: Δt.  until: end time.  The load ramps over one unit of time.

    Example:
        >>> gx.scenes.bar("continuous", elements=10).mesh
        Mesh(10 quadrilaterals; boundaries 'left', 'right'; regions 'bar')
    """
    problem = _problem(kind)
    if not is_whole(elements, 1, MOST_ELEMENTS):
        raise InputError(
            f"the number of elements is {shown(elements)}: a whole number from 1 to {MOST_ELEMENTS} would be right"
        )
    if problem.taper == 1.0 and elements % 10:
        raise InputError(f"the discontinuous bar has {elements} elements: a multiple of 10 would meet its ten levels")
    mesh = files.read(
        files.locate("bar.geo"),
        comm=comm,
        elements=elements,
        taper=problem.taper,
        triangles=files.triangles(shape),
    )
    return Scene(
        name=f"bar, {problem.name}",
        mesh=mesh,
        material=Material(young=1.0, poisson=0.2, reference_density=1.0, density_exponent=n),
        growth=EnergyDrivenGrowth(attractor=lambda x: problem.attractor(x[0]), rate=1.0, exponent=m),
        supports=(Support("left"),),
        loads=(Traction("right", (TRACTION, 0.0)),),
        program=Program(step=step, until=until, ramp=1.0),
    )


def _problem(kind: Problem | str) -> Problem:
    """The problem of that name."""
    if isinstance(kind, str) and kind not in PROBLEMS:
        raise InputError(f"there is no bar problem '{kind}': one of {', '.join(PROBLEMS)} would be right")
    found = PROBLEMS[kind] if isinstance(kind, str) else kind
    require_kind(found, Problem, "the problem of the bar", "gx.scenes.DISCONTINUOUS or gx.scenes.CONTINUOUS")
    return found


def lower_edge(problem: Problem, count: int = 2000) -> Floats:
    """Places on the bar's lower edge, a hair inside, from end to end, shape (count, 2)."""
    x = (np.arange(count) + 0.5) / count
    half_width = WIDTH / 2 * TRACTION / problem.traction(x)
    return np.column_stack([x, -(1 - 1e-6) * half_width])


def equilibrium(scene: Scene, problem: Problem, x: float) -> Equilibrium:
    """Semi-analytic state at biological equilibrium where every cross-section is free: the end of a long march."""
    law: Any = scene.growth
    growth = replace(law, attractor=float(problem.attractor(np.array([x]))[0]))
    return uniaxial_equilibrium(scene.material, growth, float(problem.traction(np.array([x]))[0]), Plane(scene.plane))


def midpoint_density_change(discretisation: Discretisation) -> float:
    """[ρ − ρ*]/ρ* at mid-length: in the cell to the right of x = 0.5, in the outermost row, nearest to x = 0.5."""
    return _beside_mid_length(discretisation, lambda y: y)


def midpoint_axis_density_change(discretisation: Discretisation) -> float:
    """[ρ − ρ*]/ρ* at mid-length: in the cell to the right of x = 0.5, nearest to x = 0.5, and there to the axis.

    The paper reads Q2Q2 so in places.  It is `midpoint_density_change` where the cell has no row nearer to the axis.
    """
    return _beside_mid_length(discretisation, lambda y: (abs(y), y))


def _beside_mid_length(discretisation: Discretisation, order: Callable[[float], Any]) -> float:
    """[ρ − ρ*]/ρ* right of mid-length at the density nearest to it; of several, the first in an order of their y."""
    mesh, space = discretisation.scene.mesh, discretisation.density_space
    places = discretisation.density_positions()
    found = []
    for cell in mesh.owned_cells[_right_of_middle(mesh)]:
        for dof in space.dofmap.list[cell]:
            x, y, _ = places[dof]
            found.append((round(abs(x - 0.5), 9), order(round(y, 9)), float(discretisation.density.x.array[dof])))
    density = min(entry for entries in mesh.comm.allgather(found) for entry in entries)[2]
    return density / discretisation.scene.material.reference_density - 1


def _right_of_middle(mesh: Mesh) -> Marks:
    """The owned cells that hold the cross-section just right of mid-length."""
    x = positions(mesh, reference_corners(mesh.cell_name))[:, :, 0]
    middle = 0.5 + 1e-9
    return np.asarray((x.min(axis=1) < middle) & (middle < x.max(axis=1)))


def end_displacement(discretisation: Discretisation) -> float:
    """Axial displacement (length) of a corner of the loaded end."""
    mesh = discretisation.scene.mesh
    corners = reference_corners(mesh.cell_name)
    x, u = positions(mesh, corners).reshape(-1, 3), discretisation.displacement_at(corners).reshape(-1, 2)
    at_end = np.isclose(x[:, 0], 1.0)
    found = zip(x[at_end, 1].round(9).tolist(), u[at_end, 0].tolist(), strict=True)
    return float(min(entry for entries in discretisation.comm.allgather(list(found)) for entry in entries)[1])
