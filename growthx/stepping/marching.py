"""The march through time: an open loop over steps; what fails, or is not accurate enough, is taken back and cut."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

from growthx.common.errors import EndedEarly, InputError
from growthx.discretisation.checks.arguments import check_problem_of
from growthx.discretisation.discretise import discretise
from growthx.model.actions.histories import jumps_of
from growthx.model.exponents import is_well_posed
from growthx.solvers.newton import Newton
from growthx.solvers.settings import NewtonSettings
from growthx.stepping.arguments import check_run
from growthx.stepping.control import FixedSteps, Stepping
from growthx.stepping.failure import Corners, take_back
from growthx.stepping.integration import Integrator, SolvedStep
from growthx.stepping.record import Step
from growthx.stepping.time_schemes import IMPLICIT_EULER
from growthx.stepping.witness import Witness

if TYPE_CHECKING:
    from growthx.common.memory import Memory
    from growthx.discretisation.discretisation import Discretisation
    from growthx.discretisation.variants import Variant
    from growthx.model.scene import Scene


MOST_STAGNATED = 2  # attempts at a step: shorter ones end where the last digits are not to be had


class March(Iterator[Step]):
    """The steps of a run, one after another; what `march` returns.

    Between two steps, `memory` is what another march needs to go on from here, as `begin_anew` lets this one do.
    in_equilibrium: whether the last step met the share of equilibrium that was asked for.
    """

    def __init__(self, problem: Discretisation, settings: NewtonSettings, stepping: Stepping) -> None:
        """settings: as they were asked for; the stepping may loosen them."""
        self.problem, self.time, self.in_equilibrium = problem, 0.0, False
        worth, share = stepping.newton_tolerance(settings.tolerance), stepping.equilibrium
        # A rate that is to end the run has to be told from what Newton's method leaves.
        self._settings = settings.loosened(worth if share is None else min(worth, share))
        self._stepping, self._enough = stepping, _enough(problem, stepping)
        self._control = stepping.control(problem.scene.timetable)
        self._targets, self._target, self._ended = iter(self._control.targets()), 0.0, False
        self._make_solvers()
        self._witness, self._corners = Witness(problem, self._settings.tolerance), Corners(problem)

    def __next__(self) -> Step:
        try:
            while not (self._ended or self.time < self._target):
                self._target = float(next(self._targets))
            if self._ended:
                raise StopIteration
            step, found = self._step(self._target)
        except (StopIteration, EndedEarly):  # on all ranks
            self.close()
            raise
        except BaseException:
            self.leave()
            raise
        self._ended = self.in_equilibrium = self._enough(found)
        return step

    # Not left to the collector of cycles, of which this object is no part: it comes at other times on other ranks.
    def __del__(self) -> None:
        self.leave()

    def close(self) -> None:
        """End here, and free the solver's memory (collective); a march that has reached its end has done so."""
        self._ended = True
        if hasattr(self, "_newton"):
            self._newton.destroy()
            del self._newton

    def leave(self) -> None:
        """End here, and free the solver's memory as soon as all ranks can; any of them may call this alone."""
        self._ended = True
        if hasattr(self, "_newton"):
            self._newton.leave()
            del self._newton

    def memory(self) -> Memory:
        """What there is to know in the last accepted state."""
        memory = self.problem.system.memory()
        memory.join(self._integrator.memory())
        memory.join(self._control.memory())
        memory.numbers["reached"] = self.time
        return memory

    def begin_anew(self, memory: Memory | None = None) -> None:
        """Go on from what a march of the same scene remembered, by default this one (collective).

        Nothing else is left of the steps before, such as a factor: whoever goes on from there goes the same way, to the
        bit in one rank.
        """
        memory = memory or self.memory()
        self.time = memory.numbers["reached"]
        self.problem.system.recall(memory)
        self._control.recall(memory)
        self.close()
        self._ended = False
        self._make_solvers()
        self._integrator.recall(memory)

    def _make_solvers(self) -> None:
        problem, stepping = self.problem, self._stepping
        self._newton = Newton(problem.system, self._settings)
        self._integrator = Integrator(
            problem, self._newton, stepping.scheme, estimate=self._control.needs_error, predict=stepping.predicted
        )

    def _what_may_help(self, time: float) -> str:
        """The end of the sentence on a run that cannot go on (collective)."""
        scene = self.problem.scene
        if time <= 0.0 and scene.program.amplitude(scene.program.step) >= 1.0:
            ramp = f"with a ramp of {scene.program.ramp:g} all of the load is there at once"
            return f"{ramp}, and one over several steps may help"
        if not is_well_posed(scene):
            return "a law by which more density means a lower stimulus, as for m > n, is needed"
        return "a smaller load" + ("" if scene.growth.is_bounded else ", or a law with a lowest density,") + " may help"

    def _step(self, target: float) -> tuple[Step, SolvedStep]:
        """The next accepted step, which goes no further than a target, and how it was solved."""
        problem, control, program = self.problem, self._control, self.problem.scene.program
        time, mass, rejected, stagnated, loses = self.time, problem.mass(), 0, 0, False
        while True:
            end = control.end(time, target)
            found = self._integrator.step(time, end)
            if not found.newton.converged:
                loses |= self._integrator.positivity.is_lost()
                why = take_back(problem, found.newton)
                stagnated += found.newton.stagnated
                control.failed(end - time)
            elif why := self._corners.crushed():
                problem.system.reject_step()
                control.failed(end - time)
            elif not control.accepts(end - time, found.error):
                why = f"the estimated error of density is {found.error:.2g}"
                problem.system.reject_step()
            else:
                break
            rejected += 1
            self._integrator.positivity.take_back()
            if control.hopeless or stagnated > MOST_STAGNATED:
                if loses and self._integrator.keep_positive(time):
                    control.begin_anew()
                    continue
                raise EndedEarly(
                    f"the run ended at t = {time:g} of {program.until:g}: {why}, "
                    f"and a time step cut from {program.step:g} to {end - time:.3g} did not help: "
                    f"{self._what_may_help(time)}"
                )
        reactions = problem.reactions()
        force_defect, moment_defect = self._witness.defects(reactions)
        self._integrator.accept()
        self.time, old_mass, mass = end, mass, problem.mass()
        low, high = problem.density_range()
        step = Step(
            time=end,
            time_step=end - time,
            load=problem.amplitude,
            rejected=rejected,
            newton=found.newton,
            lumped_cells=self._integrator.positivity.cells,
            error=found.error,
            mass=mass,
            mass_defect=abs(mass - old_mass - (end - time) * found.mass_rate) / mass,
            min_density=low,
            max_density=high,
            reactions=reactions,
            force_defect=force_defect,
            moment_defect=moment_defect,
        )
        self._witness.hear(step)
        return step, found


def march(
    scene: Scene,
    variant: Variant,
    problem: Discretisation | None = None,
    tolerance: float = 1e-10,
    *,
    stepping: Stepping | None = None,
    full_newton: bool = False,
) -> March:
    """Advance a scene through its program, yielding each accepted step.

    problem: the discretised scene, when the caller wants to look at it between steps (default: `discretise`).
    tolerance, full_newton: of Newton's method, see `solvers.settings.NewtonSettings`.
    stepping: the way through time; default: the program's fixed steps by implicit Euler.
    Raises EndedEarly when a step fails even after the time step was cut to 2⁻¹² of its nominal length, or of what the
    error of density asks for, or when failures keep coming or leave the run hardly any way between them; the problem
    then holds the last good state.  Raises InputError for a scheme that cannot integrate the scene, for a problem of
    another scene or variant, and for arguments that are none.

    Example:
        >>> for step in gx.march(gx.scenes.plate(2, step=1.25), gx.Q1P0):
        ...     print(f"{step.time:g}")
        1.25
        2.5
    """
    check_run(scene, variant, tolerance=tolerance, stepping=stepping, full_newton=full_newton)
    if problem is not None:
        check_problem_of(problem, scene, variant)
    stepping = FixedSteps() if stepping is None else stepping
    if scene.inertia is not None and not (isinstance(stepping, FixedSteps) and stepping.scheme is IMPLICIT_EULER):
        raise InputError(
            f"the scene '{scene.name}' has inertia and is to be integrated by {stepping.scheme.name} in "
            f"{type(stepping).__name__}: {IMPLICIT_EULER.name} in FixedSteps would be right"
        )
    problem = discretise(scene, variant) if problem is None else problem
    return March(problem, NewtonSettings(tolerance, full_newton), stepping)


def _enough(problem: Discretisation, stepping: Stepping) -> Callable[[SolvedStep], bool]:
    """Whether a step has come so close to biological equilibrium that the run may end."""
    share = stepping.equilibrium
    if share is None:
        return lambda found: False
    resorption = problem.measures.resorption()
    if resorption == 0:
        raise InputError(
            f"the rate c or the attractor stimulus of the scene '{problem.scene.name}' is zero everywhere, against "
            "which a rate of density cannot be measured: no share of equilibrium would be right"
        )
    last = max(jumps_of(problem.scene.histories, problem.scene.program.until), default=0.0)
    return lambda found: (
        problem.amplitude == 1.0
        and problem.time > last
        and problem.measures.root_mean_square(found.slope) <= share * resorption
    )
