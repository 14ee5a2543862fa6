"""Baselines of the literature, to compare with: the density is updated after equilibrium, not together with it.

    for each time step:
        solve the balance of momentum at frozen density       u of ρₙ
        ρₙ₊₁ = ρₙ + Δt R₀(ρₙ, u)                              explicit Euler, ρₙ₊₁ not below a floor

The variant says where: Q1P0 is the element-based update (Huiskes et al. 1987, Weinans et al. 1992, J. Biomech. 25,
1425), Q1Q1 the node-based one (Jacobs et al. 1995, J. Biomech. 28, 449), Q1 is explicit Euler at the integration
points.  What suppresses checkerboards is an `Averaging`, of the source before the update or of the density after it.

The update is stable for Δt < 2/|∂R₀/∂ρ| only.  With (6) at equilibrium, |∂R₀/∂ρ| = k c Ψ₀*/ρ; k is m − n where the
strain does not follow the density and, at small strains, m + n where the stress does not.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import dolfinx
import numpy as np
import ufl
from mpi4py import MPI

from growthx.baselines.averaging import Averaging, check_averages
from growthx.common.checks import require_number
from growthx.common.errors import EndedEarly, InputError
from growthx.discretisation.checks.arguments import check_problem_of, check_scene, require_problem
from growthx.discretisation.discretise import discretise
from growthx.discretisation.forms import balances
from growthx.fem.assembly import assemble
from growthx.meshing.fields import law_as_ufl
from growthx.solvers.newton import Newton
from growthx.solvers.report import NewtonReport
from growthx.solvers.settings import NewtonSettings
from growthx.stepping.arguments import check_tolerance
from growthx.stepping.continuation import solve_elastic
from growthx.stepping.failure import take_back
from growthx.stepping.record import Step

if TYPE_CHECKING:
    from growthx.common.arrays import Floats
    from growthx.discretisation.discretisation import Discretisation
    from growthx.discretisation.variants import Variant
    from growthx.model.scene import Scene


FLOOR = 0.01  # g/cm³, the literature's density of what is resorbed


def frozen(scene: Scene, variant: Variant) -> Discretisation:
    """The discretisation of a scene whose density does not change by itself, for `update`.

    Raises InputError where mass moves, which the baselines do not know.

    Example:
        >>> scene = gx.scenes.plate(2)
        >>> problem = gx.baselines.frozen(scene, gx.Q1P0)
        >>> masses = [problem.mass() for _ in gx.baselines.update(scene, gx.Q1P0, problem)]
        >>> len(masses), masses[-1] < masses[0]
        (25, True)
    """
    check_scene(scene, variant)
    if scene.moves_mass:
        raise InputError(
            f"the scene '{scene.name}' moves mass, which an update after equilibrium does not know: "
            "one without flux, influx and prescribed densities would be right"
        )
    if scene.growth.remembers:
        raise InputError(
            f"{type(scene.growth).__name__} of the scene '{scene.name}' has a memory, which an update after "
            "equilibrium does not know: memory=None, or gx.march, would be right"
        )
    return discretise(_at_rest(scene), variant)


def _at_rest(scene: Scene) -> Scene:
    """The scene without growth of its own."""
    return replace(scene, growth=scene.growth.without_growth())


def update(
    scene: Scene,
    variant: Variant,
    problem: Discretisation | None = None,
    *,
    source_average: Averaging | None = None,
    density_average: Averaging | None = None,
    floor: float = FLOOR,
    tolerance: float = 1e-10,
) -> Iterator[Step]:
    """Advance a scene through its program by updates after equilibrium, yielding each step; time steps are never cut.

    problem: from `frozen`, when the caller wants to look at it between steps; its displacement is in balance with the
    density before the update.  source_average: of the mass source before the update.  density_average: of the density
    after it.  floor: lowest density; the law's bounds hold as well.  tolerance: see `solvers.settings.NewtonSettings`.
    `mass_defect` of a step is the mass that averages, floor and bounds have made or lost, over the mass.
    Raises InputError for nodes without a volume (P2P2) and for a problem that is not frozen, or of another scene, and
    EndedEarly where no equilibrium is found.

    Example:
        >>> *_, last = gx.baselines.update(gx.scenes.plate(4), gx.Q1P0)
        >>> f"t = {last.time:g}: density from {last.min_density:.3f} to {last.max_density:.3f}"
        't = 2.5: density from 0.523 to 0.949'
    """
    check_scene(scene, variant)
    check_tolerance(tolerance)
    check_averages(source_average=source_average, density_average=density_average)
    require_number(floor, "the lowest density", "a positive number", lambda rho: rho > 0)
    if floor >= scene.growth.limits[1]:
        raise InputError(
            f"the lowest density is {floor:g} and the law's highest is {scene.growth.limits[1]:g}: one below that "
            "would be right"
        )
    if problem is None:
        problem = frozen(scene, variant)
    problem = require_problem(problem)
    if not problem.scene.growth.is_still:
        raise InputError("the problem to be updated grows by itself: one from `baselines.frozen` would be right")
    check_problem_of(problem, _at_rest(scene), variant)
    return _updates(scene, problem, source_average, density_average, floor, tolerance)


def _updates(
    scene: Scene,
    problem: Discretisation,
    source_average: Averaging | None,
    density_average: Averaging | None,
    floor: float,
    tolerance: float,
) -> Iterator[Step]:
    """As `update`, with a problem."""
    dofs, program = problem.growing_dofs, scene.program
    source = _source(scene, problem)
    of_source, of_density = (
        average.on(problem) if average else _as_it_is for average in (source_average, density_average)
    )
    low, high = max(floor, scene.growth.limits[0]), scene.growth.limits[1]
    time, mass = 0.0, problem.mass()
    with Newton(problem.system, NewtonSettings(tolerance)) as newton:
        for end in map(float, scene.timetable.times()):
            time_step = end - time
            problem.system.begin_step(time_step, program.amplitude(end), end)
            report, reactions = _equilibrium(problem, newton, time, program.until)
            rate, old_density = source(), problem.density.x.array[dofs]
            density = np.clip(old_density + time_step * of_source(rate), low, high)
            _set_density(problem, np.clip(of_density(density), low, high))
            gain = problem.comm.allreduce(float(problem.volumes[dofs] @ rate))
            time, old_mass, mass = end, mass, problem.mass()
            defect = abs(mass - old_mass - time_step * gain) / mass
            yield Step(
                end, time_step, problem.amplitude, 0, report, np.nan, mass, defect, *problem.density_range(), reactions
            )


def _equilibrium(
    problem: Discretisation, newton: Newton, time: float, until: float
) -> tuple[NewtonReport, dict[str, Floats]]:
    """Solve the balance of momentum, accept it and return how that went and the reactions; EndedEarly if it failed."""
    report = solve_elastic(problem, newton)
    if not report.converged:
        raise EndedEarly(f"the run ended at t = {time:g} of {until:g}: {take_back(problem, report)}")
    reactions = problem.reactions()
    problem.system.accept_step()
    return report, reactions


def _as_it_is(values: Floats) -> Floats:
    return values


def _source(scene: Scene, problem: Discretisation) -> Callable[[], Floats]:
    """R₀ of the state at each growing density, (densities,): the mean over what belongs to it, weighted by its test."""
    variant, growth = problem.variant, law_as_ufl(scene.growth, scene.mesh)
    test = ufl.TestFunction(problem.density_space)
    dV = problem.spaces.growing_volume.reconstruct(metadata={"quadrature_degree": variant.mass_degree})
    shares = assemble(problem.compile.form(test * dV))[problem.growing_dofs]
    least = problem.comm.allreduce(float(shares.min(initial=np.inf)), MPI.MIN)
    if least < 1e-9 * problem.comm.allreduce(float(shares.max(initial=0.0)), MPI.MAX):
        raise InputError(
            f"{variant.name} has nodes to which no volume belongs, over which the source has no mean: "
            "densities of degree 1, or of cells or points, would be right"
        )
    energy = problem.expressions.energy()
    form = problem.compile.form(balances.source(problem.density, energy, test, growth, problem.material, dV))
    return lambda: assemble(form)[problem.growing_dofs] / shares


def _set_density(problem: Discretisation, density: Floats) -> None:
    """Make densities of this rank's growing ones the state, and the start of the next step."""
    new = dolfinx.fem.Function(problem.density_space)
    new.x.array[:] = problem.density.x.array
    new.x.array[problem.growing_dofs] = density
    new.x.scatter_forward()
    problem.system.set_density(new.x.array)
