"""The march through time: an open loop over steps, with cut-back when a step fails and regrowth after."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from growthx.errors import EndedEarly
from growthx.newton import Newton, NewtonReport
from growthx.node_based import NodeBased
from growthx.point_based import PointBased
from growthx.wellposedness import warn_if_ill_posed

if TYPE_CHECKING:
    from growthx.arrays import Floats
    from growthx.discretisation import Discretisation
    from growthx.scene import Scene
    from growthx.variants import Variant

SMALLEST_CUT = 2.0**-12  # of the nominal step: below it the run ends


@dataclass(frozen=True)
class Step:
    """One accepted time step; all numbers are global.

    time, time_step: end and length of the step.  load: share of the loads.  rejected: failed attempts before it.
    newton: how the solution of the step went.  mass: ∫ ρ dV (per thickness in two dimensions).
    mass_defect: |change of mass − Δt (∫ R₀ dV + influx)| over the mass.  min_density, max_density: over the density's
    own degrees of freedom.  reactions: force on the body at each support (per thickness in two dimensions).
    """

    time: float
    time_step: float
    load: float
    rejected: int
    newton: NewtonReport
    mass: float
    mass_defect: float
    min_density: float
    max_density: float
    reactions: dict[str, Floats] = field(repr=False)

    @property
    def newton_iterations(self) -> int:
        """Newton iterations of the accepted solution."""
        return self.newton.iterations


def discretise(scene: Scene, variant: Variant) -> Discretisation:
    """The discretisation of a scene by a variant, ready to march; warns of a model that is not well posed."""
    warn_if_ill_posed(scene)
    return (PointBased if variant.density.local else NodeBased)(scene, variant)


def take_back(problem: Discretisation, report: NewtonReport) -> str:
    """Go back from a failed step to the state at its start; says why it failed, as a part of a sentence."""
    why = problem.inadmissible() or report.reason
    problem.reject_step()
    return why


def march(
    scene: Scene, variant: Variant, problem: Discretisation | None = None, tolerance: float = 1e-10
) -> Iterator[Step]:
    """Advance a scene through its program, yielding each accepted step.

    problem: the discretised scene, when the caller wants to look at it between steps (default: `discretise`).
    tolerance: of Newton's method, see `newton.Newton`.
    Raises EndedEarly when a step fails even after the time step was cut to 2⁻¹² of its nominal length; the problem then
    holds the last good state.
    """
    problem = discretise(scene, variant) if problem is None else problem
    newton = Newton(problem, tolerance)
    try:
        yield from _steps(scene, problem, newton)
    finally:
        newton.destroy()


def _steps(scene: Scene, problem: Discretisation, newton: Newton) -> Iterator[Step]:
    program = scene.program
    time, cut, rejected = 0.0, 1.0, 0
    mass, solver = problem.mass(), _Solver(problem, newton)
    for target in map(float, program.times()):
        while time < target:
            remaining = target - time
            # The last piece ends on the requested time exactly and is never a sliver.
            pieces = max(1, round(remaining / (cut * program.step)))
            end = target if pieces == 1 else time + remaining / pieces
            report = solver.solve(end - time, program.amplitude(end), end)
            if not report.converged:
                why = take_back(problem, report)
                rejected += 1
                cut /= 2
                if cut < SMALLEST_CUT:
                    raise EndedEarly(
                        f"the run ended at t = {time:g} of {program.until:g}: {why}, "
                        f"and a time step cut from {program.step:g} to {end - time:.3g} did not help"
                    )
                continue
            reactions = problem.reactions()
            problem.accept_step()
            gain, old_mass, mass = problem.mass_rate(), mass, problem.mass()
            low, high = problem.density_range()
            yield Step(
                time=end,
                time_step=end - time,
                load=problem.amplitude,
                rejected=rejected,
                newton=report,
                mass=mass,
                mass_defect=abs(mass - old_mass - (end - time) * gain) / mass,
                min_density=low,
                max_density=high,
                reactions=reactions,
            )
            time, rejected, cut = end, 0, min(1.0, 2 * cut)


class _Solver:
    """Solves one step after another, each from what the last one foretells or, if that fails, from the last state."""

    def __init__(self, problem: Discretisation, newton: Newton) -> None:
        self._problem, self._newton = problem, newton
        self._amplitude = 0.0
        self._last: tuple[float, float, Floats] | None = None  # time step, growth of the load, change of the unknown

    def solve(self, time_step: float, amplitude: float, end: float) -> NewtonReport:
        """Bring the running iterate to balance at the end of a step."""
        problem, growth = self._problem, amplitude - self._amplitude
        state = problem.unknown.x.array.copy()
        problem.begin_step(time_step, amplitude, end)
        report = self._newton.solve() if self._foretell(state, time_step, growth) else None
        if report is None or not report.converged:
            if report is not None:
                problem.reject_step()
                problem.begin_step(time_step, amplitude, end)
            report = self._newton.solve()
        if report.converged:
            self._amplitude, self._last = amplitude, (time_step, growth, problem.unknown.x.array - state)
        return report

    def _foretell(self, state: Floats, time_step: float, growth: float) -> bool:
        """Put a linear continuation of the last step on the iterate; False if the load does not go on as it went."""
        if self._last is None:
            return False
        last_step, last_growth, change = self._last
        ratio = time_step / last_step
        if abs(growth - ratio * last_growth) > 1e-9:
            return False
        unknown = self._problem.unknown.x.array
        begun = unknown.copy()
        unknown[:] = state + ratio * change
        for condition in self._problem.conditions:  # what is prescribed has been put there already
            dofs, _ = condition.dof_indices()
            unknown[dofs] = begun[dofs]
        return True
