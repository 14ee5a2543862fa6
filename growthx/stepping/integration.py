"""One step in time by a scheme: its stages solved one after another, its slopes, and the error they tell of."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from growthx.common.memory import Memory
from growthx.discretisation.state import Way
from growthx.model.actions.histories import SAME_TIME, jumps_of
from growthx.stepping.continuation import FEWEST, MOST, Continuation, Unsolved
from growthx.stepping.positivity import Positivity
from growthx.stepping.prediction import Prediction
from growthx.stepping.time_schemes import SDIRK2

if TYPE_CHECKING:
    from growthx.common.arrays import Floats
    from growthx.discretisation.discretisation import Discretisation
    from growthx.solvers.newton import Newton
    from growthx.solvers.report import NewtonReport
    from growthx.stepping.time_schemes import TimeScheme


@dataclass(frozen=True)
class SolvedStep:
    """What came of a step: how its solution went, and if it converged the rest.

    error: estimated, of density, root mean square over the volume, relative; NaN where it is not known.
    mass_rate: mass that entered per time.  slope: that of each density at the end (density per time).
    """

    newton: NewtonReport
    error: float = np.nan
    mass_rate: float = np.nan
    slope: Floats = field(default_factory=lambda: np.zeros(0))


class Integrator:
    """Takes a problem from one time to the next; the caller accepts a step or takes it back."""

    def __init__(
        self,
        problem: Discretisation,
        newton: Newton,
        scheme: TimeScheme,
        *,
        estimate: bool = False,
        predict: bool = True,
    ) -> None:
        """estimate: whether the error of each step is wanted.  predict: whether to begin where the last ones point."""
        self._problem, self._newton, self._scheme = problem, newton, scheme
        self._estimate, self._predict = estimate, predict
        self._prediction = Prediction(problem.comm)
        self._prediction.remember(0.0, problem.system.unknown.x.array.copy())
        self._jumps = jumps_of(problem.scene.histories, problem.scene.program.until)
        self._course: float | None = None  # growth of the load per time
        self._start: tuple[Floats, float] | None = None  # slope and mass rate at the start of the step
        self._parts = MOST  # in which a step may be solved: the fewer, the more often that has failed
        self._stuck_at: float | None = None  # start of the last step to which no parts led
        self._eased: tuple[float, Floats] | None = None  # start of the last one to which they did, and its solution
        self.positivity = Positivity(problem)
        self._end: tuple[Floats, float] | None = None  # the same at the end of the step that is not accepted yet
        self._found: list[tuple[float, Floats]] = []  # unknowns at the stages of the step that is not accepted yet

    def step(self, time: float, end: float) -> SolvedStep:
        """Solve the stages of a step; the running iterate is then the end of the step, or where a stage failed."""
        problem, scheme, length = self._problem, self._scheme, end - time
        self._follow_course(time, end)
        self.positivity.begin_step()
        self._found = []
        if self._start is None and (scheme.needs_start or (self._estimate and scheme.compares_start)):
            scheme = SDIRK2
        first = self._start or (np.zeros_like(problem.state.accepted_density), 0.0)
        slopes, rates = [first[0]], [first[1]]
        reports: list[NewtonReport] = []
        for row, share in zip(scheme.weights, scheme.times, strict=True):
            at = end if share == 1.0 else time + share * length
            base = problem.state.accepted_density.copy()
            for weight, slope in zip(row[:-1], slopes, strict=True):
                if weight:
                    base += length * weight * slope
            report = self._solve(row[-1] * length, at, base)
            reports.append(report)
            if not report.converged:
                return SolvedStep(_together(reports))
            slopes.append((problem.system.densities.iterate() - base) / (row[-1] * length))
            rates.append(problem.mass_rate())
            self._found.append((at, problem.system.unknown.x.array.copy()))
        self._end = slopes[-1], rates[-1]
        return SolvedStep(
            newton=_together(reports),
            error=self._error(scheme, length, slopes) if self._estimate else np.nan,
            mass_rate=float(np.dot(scheme.weights[-1], rates)),
            slope=slopes[-1],
        )

    def accept(self) -> None:
        """Make the end of the step the state."""
        self._problem.system.accept_step()
        self.positivity.accept()
        self._start = self._end
        for time, unknown in self._found:
            self._prediction.remember(time, unknown)

    def keep_positive(self, time: float) -> bool:
        """From a time on lump where nodal densities would vanish; whether that is new."""
        if not self.positivity.begin(time):
            return False
        self._start = None  # of the tiny steps before: its errors are divided by their length
        return True

    def memory(self) -> Memory:
        """What it knows at an accepted step: slope and mass rate there, the load's course, what predictions go by."""
        memory = self._prediction.memory()
        memory.numbers["course"], memory.numbers["parts"] = self._course, self._parts
        memory.join(self.positivity.memory())
        if self._start is not None:
            memory.densities["slope"], memory.numbers["mass_rate"] = self._start
        return memory

    def recall(self, memory: Memory) -> None:
        """Know that again."""
        self._prediction.recall(memory)
        self._course, self._parts = memory.numbers["course"], memory.numbers["parts"]
        self.positivity.recall(memory)
        if "slope" in memory.densities:
            self._start = memory.densities["slope"].copy(), memory.numbers["mass_rate"]

    def _solve(self, length: float, time: float, base: Floats) -> NewtonReport:
        """Bring the running iterate to balance, from what is foretold or else from where it was."""
        problem, system = self._problem, self._problem.system
        amplitude, before = problem.scene.program.amplitude(time), problem.time
        rise, start = amplitude - problem.amplitude, system.unknown.x.array.copy()

        def begin(load: float = 1.0, share: float = 1.0) -> None:
            system.begin_step(share * length, amplitude - (1 - load) * rise, time, base, Way(before, load))

        reports: list[NewtonReport] = []
        first = self._prediction.at(time) if self._predict else None
        if self._eased is not None and self._eased[0] == before:  # tried once more, since it erred too much
            first = self._eased[1]
        for guess in (start,) if first is None else (first, start):
            if reports:
                system.reject_step()
            system.start_from(guess)
            begin()
            reports.append(self._newton.solve())
            if reports[-1].stagnated or self._is_good(reports[-1]):
                return _together(reports)
        while self.positivity.spread():
            system.reject_step()
            system.start_from(start)
            begin()
            reports.append(self._newton.solve())
            if self._is_good(reports[-1]):
                return _together(reports)
        direct = Unsolved(problem, reports.pop(), begin)
        system.reject_step()
        system.start_from(start)
        continuation = Continuation(problem, self._newton, begin)
        # To a body with inertia no step is an instant; and where a way led nowhere, a shorter step has none either.
        if problem.scene.inertia is None and self._stuck_at != before:
            if continuation.solve(self._parts):
                self._parts, self._eased = MOST, (before, system.unknown.x.array.copy())
                return _together([*reports, direct.report, *continuation.reports])
            self._parts, self._stuck_at = max(self._parts // 2, FEWEST), before
        # A start that is not admissible tells little; a solution in doubt is the best there is.
        told = direct if direct.report.iterations else continuation.failure or direct
        told.bring_back()
        return _together([*reports, *continuation.reports, told.report])

    def _is_good(self, report: NewtonReport) -> bool:
        lost = report.converged and self.positivity.wanted and self.positivity.is_lost()
        return report.converged and not report.in_doubt and not lost

    def _follow_course(self, time: float, end: float) -> None:
        """What was found before a bend of the load says nothing about what comes after it."""
        amplitude = self._problem.scene.program.amplitude
        if any(abs(time - jump) <= SAME_TIME * jump for jump in self._jumps):
            self._prediction.restart()
            self._start = None  # densities change at another rate at once
        course = (amplitude(end) - amplitude(time)) / (end - time)
        if self._course is not None and abs(course - self._course) > 1e-9 * max(abs(course), abs(self._course)):
            self._prediction.restart()
        self._course = course

    def _error(self, scheme: TimeScheme, length: float, slopes: list[Floats]) -> float:
        """Root mean square over the volume of what the compared scheme would have found otherwise, relative."""
        problem = self._problem
        differences = np.array(scheme.compared) - np.array(scheme.weights[-1])
        error = sum(difference * slope for difference, slope in zip(differences, slopes, strict=True))
        return float(
            length
            * problem.measures.root_mean_square(error)
            / problem.measures.root_mean_square(problem.state.accepted_density)
        )


def _together(reports: list[NewtonReport]) -> NewtonReport:
    """The reports of the stages as one: the last one, with the work of all."""
    return replace(
        reports[-1],
        iterations=sum(report.iterations for report in reports),
        residuals=sum(report.residuals for report in reports),
        factorisations=sum(report.factorisations for report in reports),
        round_off=max(report.round_off for report in reports) if reports[-1].converged else 0.0,
    )
