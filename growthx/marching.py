"""The march through time: an open loop over steps; what fails, or is not accurate enough, is taken back and cut."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from growthx.corners import check_cells
from growthx.errors import EndedEarly, InputError
from growthx.integration import Integrator, SolvedStep
from growthx.newton import Newton, NewtonReport
from growthx.node_based import NodeBased
from growthx.point_based import PointBased
from growthx.rigid_motions import check_held
from growthx.stepping import FixedSteps, Stepping
from growthx.time_schemes import IMPLICIT_EULER
from growthx.wellposedness import warn_if_ill_posed

if TYPE_CHECKING:
    from growthx.arrays import Floats
    from growthx.discretisation import Discretisation
    from growthx.memory import Memory
    from growthx.scene import Scene
    from growthx.variants import Variant


@dataclass(frozen=True)
class Step:
    """One accepted time step; all numbers are global.

    time, time_step: end and length of the step.  load: share of the loads.  rejected: failed attempts before it.
    newton: how the solution of the step went, of all its stages.
    error: estimated error of density of this step, root mean square over the volume, relative; NaN if not asked for.
    mass: ∫ ρ dV (per thickness in two dimensions).
    mass_defect: |change of mass − Δt (∫ R₀ dV + influx)| over the mass.  min_density, max_density: over the density's
    own degrees of freedom.  reactions: force on the body at each support (per thickness in two dimensions).
    """

    time: float
    time_step: float
    load: float
    rejected: int
    newton: NewtonReport
    error: float
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
    """The discretisation of a scene by a variant, ready to march; warns of a model that is not well posed.

    Raises InputError if a cell of the mesh is not convex, if a part of the body is free to move, or if the variant is
    not made for the scene.
    """
    check_cells(scene.mesh)
    check_held(scene)
    warn_if_ill_posed(scene)
    return (PointBased if variant.density.local else NodeBased)(scene, variant)


def take_back(problem: Discretisation, report: NewtonReport) -> str:
    """Go back from a failed step to the state at its start; says why it failed, as a part of a sentence."""
    why = problem.inadmissible() or report.reason
    problem.reject_step()
    return why


class March(Iterator[Step]):
    """The steps of a run, one after another; what `march` returns.

    Between two steps, `memory` is what another march needs to go on from here, as `begin_anew` lets this one do.
    """

    def __init__(
        self, scene: Scene, problem: Discretisation, tolerance: float, stepping: Stepping, full_newton: bool
    ) -> None:
        """As `march`, with every default filled in."""
        self.problem, self.time = problem, 0.0
        self._scene, self._stepping, self._tolerance, self._full = scene, stepping, tolerance, full_newton
        self._enough = _enough(problem, stepping)
        self._control = stepping.control(scene.program)
        self._targets, self._target, self._ended = iter(self._control.targets()), 0.0, False
        self._make_solvers()

    def __next__(self) -> Step:
        try:
            while not (self._ended or self.time < self._target):
                self._target = float(next(self._targets))
            if self._ended:
                raise StopIteration
            step, found = self._step(self._target)
        except BaseException:
            self.close()
            raise
        self._ended = self._enough(found)
        return step

    # Not left to the collector of cycles, of which this object is no part: ranks must free what they share together.
    def __del__(self) -> None:
        self.close()

    def close(self) -> None:
        """End here, and free the solver's memory (collective); a march that has reached its end has done so."""
        self._ended = True
        if hasattr(self, "_newton"):
            self._newton.destroy()
            del self._newton

    def memory(self) -> Memory:
        """What there is to know in the last accepted state."""
        memory = self.problem.memory()
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
        self.problem.recall(memory)
        self._control.recall(memory)
        self.close()
        self._ended = False
        self._make_solvers()
        self._integrator.recall(memory)

    def _make_solvers(self) -> None:
        problem, stepping = self.problem, self._stepping
        tolerance = stepping.newton_tolerance(self._tolerance)
        self._newton = Newton(problem, tolerance, untouched=self._tolerance, full=self._full)
        self._integrator = Integrator(
            problem, self._newton, stepping.scheme, estimate=self._control.needs_error, predict=stepping.predicted
        )

    def _step(self, target: float) -> tuple[Step, SolvedStep]:
        """The next accepted step, which goes no further than a target, and how it was solved."""
        problem, control, program = self.problem, self._control, self._scene.program
        time, mass, rejected = self.time, problem.mass(), 0
        while True:
            end = control.end(time, target)
            found = self._integrator.step(time, end)
            if not found.newton.converged:
                why = take_back(problem, found.newton)
                control.failed(end - time)
            elif not control.accepts(end - time, found.error):
                why = f"the estimated error of density is {found.error:.2g}"
                problem.reject_step()
            else:
                break
            rejected += 1
            if control.hopeless:
                raise EndedEarly(
                    f"the run ended at t = {time:g} of {program.until:g}: {why}, "
                    f"and a time step cut from {program.step:g} to {end - time:.3g} did not help"
                )
        reactions = problem.reactions()
        self._integrator.accept()
        self.time, old_mass, mass = end, mass, problem.mass()
        low, high = problem.density_range()
        step = Step(
            time=end,
            time_step=end - time,
            load=problem.amplitude,
            rejected=rejected,
            newton=found.newton,
            error=found.error,
            mass=mass,
            mass_defect=abs(mass - old_mass - (end - time) * found.mass_rate) / mass,
            min_density=low,
            max_density=high,
            reactions=reactions,
        )
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
    tolerance, full_newton: of Newton's method, see `newton.Newton`.
    stepping: the way through time; default: the program's fixed steps by implicit Euler.
    Raises EndedEarly when a step fails even after the time step was cut to 2⁻¹² of its nominal length, or when failures
    keep coming; the problem then holds the last good state.  Raises InputError for a scheme that cannot integrate the
    scene.
    """
    stepping = FixedSteps() if stepping is None else stepping
    if scene.inertia is not None and not (isinstance(stepping, FixedSteps) and stepping.scheme is IMPLICIT_EULER):
        raise InputError(
            f"the scene '{scene.name}' has inertia and is to be integrated by {stepping.scheme.name} in "
            f"{type(stepping).__name__}: {IMPLICIT_EULER.name} in FixedSteps would be right"
        )
    problem = discretise(scene, variant) if problem is None else problem
    return March(scene, problem, tolerance, stepping, full_newton)


def _enough(problem: Discretisation, stepping: Stepping) -> Callable[[SolvedStep], bool]:
    """Whether a step has come so close to biological equilibrium that the run may end."""
    share = stepping.equilibrium
    if share is None:
        return lambda found: False
    resorption = problem.resorption()
    if resorption == 0:
        raise InputError(
            f"the rate c or the attractor stimulus of the scene '{problem.scene.name}' is zero everywhere, against "
            "which a rate of density cannot be measured: no share of equilibrium would be right"
        )
    return lambda found: problem.amplitude == 1.0 and problem.root_mean_square(found.slope) <= share * resorption
