"""A step that cannot be solved at once is solved by way of easier ones, each of which begins where the last one ended.

    load ▲
       1 ┤   ┌────────▶ ●   solution      I    the load grows and no time passes: elastic, at the densities ρₙ
         │   │          ▲                 II   time passes at the load that was borne so far
         │   ├──────────┤                 III  the rest of the load, where the body must first gain density to bear it
         │ I │    II    │ III
         └───┴──────────┴──▶ time
                        Δt

Every part is a step of implicit Euler from the same ρₙ, of less load or length: the last one is the step itself, and
its solution the one that goes on from the state without a jump, where there are others.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    from growthx.discretisation.discretisation import Discretisation
    from growthx.solvers.newton import Newton
    from growthx.solvers.report import NewtonReport

MOST, FEWEST = 50, 4  # parts that are tried
NARROWEST = 2.0**-8  # part of a way
ENOUGH = 2.0**-3  # part of the elastic load: where no more of it can be borne, denser the body may bear it easily
INSTANT = 1e-12  # of the step's length: no density changes


class Unsolved:
    """A solution that failed or is in doubt, where it ended."""

    def __init__(self, problem: Discretisation, report: NewtonReport, begin: Callable[[], None]) -> None:
        """The iterate is the running one.  begin: begins what was to be solved once more."""
        self.report, self._problem, self._begin = report, problem, begin
        self._unknown = problem.system.unknown.x.array.copy()

    def bring_back(self) -> None:
        """Make the iterate that failed the running one, to be asked why (collective)."""
        self._problem.system.start_from(self._unknown)
        self._begin()
        self._problem.system.out_of_balance()


class Continuation:
    """Takes a problem to the solution of a step in parts.

    reports: of each part that was tried.  failure: the last one that failed.
    """

    def __init__(self, problem: Discretisation, newton: Newton, begin: Callable[[float, float], None]) -> None:
        """begin: begins the step with a share of what the load grows by, and a share of its length."""
        self._problem, self._newton, self._begin = problem, newton, begin
        self.reports: list[NewtonReport] = []
        self.failure: Unsolved | None = None
        self._left = 0  # parts that may still be tried

    def solve(self, most: int) -> bool:
        """Whether the way leads to its end, and the running iterate with it, in so many parts at most (collective)."""
        self._left = most
        borne = _furthest(lambda part: self._solve(part, INSTANT), ENOUGH)
        if borne == 0.0 or _furthest(lambda part: self._solve(borne, INSTANT ** (1.0 - part))) < 1.0:
            return False
        return borne == 1.0 or _furthest(lambda part: self._solve(1.0 - (1.0 - part) * (1.0 - borne), 1.0)) == 1.0

    def _solve(self, load: float, length: float) -> bool:
        """Solve for one point of the way from where the iterate is, or leave it there."""
        if self._left == 0:
            return False
        self._left -= 1
        return any(self._solved(load, length, bold) for bold in (False, True))

    def _solved(self, load: float, length: float, bold: bool) -> bool:
        """bold: by full steps, see `Newton.solve`, from where those that lower the residual led nowhere."""
        before = self._problem.system.unknown.x.array.copy()
        self._begin(load, length)
        report = self._newton.solve(roughly=not load == length == 1.0, bold=bold)
        self.reports.append(report)
        if report.converged and not report.in_doubt:
            return True
        if report.converged:
            report = replace(report, converged=False, reason="no solution was found that continues the last state")
        if not bold:
            self.failure = Unsolved(self._problem, report, partial(self._begin, load, length))
        self._problem.system.start_from(before)
        return False


def solve_elastic(problem: Discretisation, newton: Newton) -> NewtonReport:
    """Bring the running iterate to balance where no density changes: if not by steps that lower the residual, by full
    ones (collective).  Of two failures the running iterate is that of the first.
    """
    before = problem.system.unknown.x.array.copy()
    report = newton.solve()
    if report.converged or report.stagnated:
        return report
    failure = Unsolved(problem, report, lambda: None)
    problem.system.start_from(before)
    again = newton.solve(bold=True)
    if again.converged:
        return again
    failure.bring_back()
    return report


def _furthest(can_go_to: Callable[[float], bool], narrowest: float = NARROWEST) -> float:
    """How far from 0 to 1 a way leads in parts, which are halved where they fail and doubled where they do not.

    narrowest: part after the first one, which may have to be narrower.
    """
    reached, part = 0.0, 1.0
    while reached < 1.0 and part >= (narrowest if reached else NARROWEST):
        ahead = min(1.0, reached + part)
        if can_go_to(ahead):
            reached = ahead
            part *= 2
        else:
            part /= 2
    return reached
