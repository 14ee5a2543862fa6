"""Biological equilibrium without a march: R₀ + Div R = 0 (3) together with the balance of momentum, solved directly."""

from __future__ import annotations

from typing import TYPE_CHECKING

from growthx.common.checks import require_number
from growthx.common.errors import EndedEarly, InputError
from growthx.discretisation.checks.arguments import check_scene
from growthx.discretisation.discretise import discretise
from growthx.solvers.newton import Newton
from growthx.solvers.settings import NewtonSettings
from growthx.stepping.arguments import check_tolerance
from growthx.stepping.continuation import solve_elastic
from growthx.stepping.failure import take_back

if TYPE_CHECKING:
    from growthx.discretisation.discretisation import Discretisation
    from growthx.discretisation.variants import Variant
    from growthx.model.scene import Scene

LONG = 1e12  # of the program's time step: implicit Euler has then no rate of density left
SHORT = 1e-12  # … and no growth yet
ATTEMPTS = 40  # time steps on the way, after which the way is taken for a circle
STRIDE = 100.0  # between the time steps that are tried where the long one fails


def homeostasis(scene: Scene, variant: Variant, *, load_steps: int = 10, tolerance: float = 1e-10) -> Discretisation:
    """The scene discretised by a variant, in biological equilibrium under its full loads.

    The loads first grow in steps at the initial density.  Then one step of implicit Euler, so long that the rate of
    density vanishes, is solved for; where Newton's method fails, shorter ones lead there.
    Equal to the end of a long march where every part of the body carries load; elsewhere the density tends to zero,
    there is no equilibrium with a positive one, and EndedEarly says so: the march remains.

    Example:
        >>> problem = gx.homeostasis(gx.scenes.plate(2), gx.Q1P0)
        >>> round(problem.mass(), 3)
        1.197
    """
    check_scene(scene, variant)
    check_tolerance(tolerance)
    require_number(load_steps, "the number of load steps", "a whole number from 1", lambda k: k >= 1 and k == int(k))
    if scene.growth.remembers:
        raise InputError(
            f"{type(scene.growth).__name__} of the scene '{scene.name}' has a memory, and its equilibrium depends on "
            "the way there: memory=None, or gx.march, would be right"
        )
    problem = discretise(scene, variant)
    with Newton(problem.system, NewtonSettings(tolerance)) as newton:
        _load(problem, newton, int(load_steps))
        _relax(problem, newton)
    return problem


def loaded(scene: Scene, variant: Variant, *, load_steps: int = 1, tolerance: float = 1e-10) -> Discretisation:
    """The scene discretised by a variant, in balance under its full loads at its initial density: nothing has grown.

    Loads with a history are those of the program's end.  load_steps: in which the loads grow.
    Raises EndedEarly where no balance is found.

    Example:
        >>> problem = gx.loaded(gx.scenes.plate(2), gx.Q1P0)
        >>> energies = gx.results.cell_fields(problem, ["strain_energy"])["strain_energy"]
        >>> f"{problem.mean_density():.6f}", bool(energies.min() > 0)
        ('1.000000', True)
    """
    check_scene(scene, variant)
    check_tolerance(tolerance)
    require_number(load_steps, "the number of load steps", "a whole number from 1", lambda k: k >= 1 and k == int(k))
    problem = discretise(scene, variant)
    with Newton(problem.system, NewtonSettings(tolerance)) as newton:
        _load(problem, newton, int(load_steps))
    return problem


def _load(problem: Discretisation, newton: Newton, steps: int) -> None:
    """Let the loads grow at the initial density."""
    for k in range(1, steps + 1):
        _step(problem, newton, SHORT * problem.scene.program.step, k / steps)


def _relax(problem: Discretisation, newton: Newton) -> None:
    """Take steps of implicit Euler at full load, as long as can be solved for, until one is long enough."""
    nominal = problem.scene.program.step
    stretch = LONG
    for _ in range(ATTEMPTS):
        length = stretch * nominal
        try:
            _step(problem, newton, length, 1.0)
        except EndedEarly as failure:
            stretch /= STRIDE
            if stretch < 1.0:
                raise EndedEarly(f"no biological equilibrium was found: {failure}; the march remains") from None
            continue
        if stretch >= LONG:
            return
        stretch *= STRIDE
    raise EndedEarly(
        f"no biological equilibrium was found: {ATTEMPTS} time steps, the last of {length:.3g}, "
        "did not lead to one; the march remains"
    )


def _step(problem: Discretisation, newton: Newton, time_step: float, amplitude: float) -> None:
    problem.system.begin_step(time_step, amplitude, problem.scene.program.until)
    elastic = time_step <= SHORT * problem.scene.program.step
    report = solve_elastic(problem, newton) if elastic else newton.solve()
    if not report.converged:
        raise EndedEarly(take_back(problem, report))
    problem.system.accept_step()
