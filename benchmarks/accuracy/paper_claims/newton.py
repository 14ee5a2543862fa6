"""Remark 5.1 and section 7: consistent tangents, and whether implicit steps and well-posed models are stable."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from itertools import pairwise

import numpy as np
from dolfinx.fem import petsc

import growthx as gx
from benchmarks.accuracy.paper_claims.claim import Claim, Numbers, column, decide, values
from benchmarks.stability.study import BODIES, VARIANTS, at_once, march, named, with_exponents
from growthx.common.arrays import Floats, Indices
from growthx.discretisation.discretisation import Discretisation
from growthx.solvers.tangent import assemble_tangent
from growthx.stepping.record import Step

POINTS = (gx.Q1, gx.Q1sri)
PART = 1e-6  # of the largest displacement, for difference quotients
TOLERANCE, MOST = 1e-10, 40  # of Newton's method: share of the loads, and iterations
ROUND_OFF = 1e-11  # of the loads: norms of residuals below have no three digits that say something of an order
QUADRATIC = 100.0  # at linear convergence by a factor of a thousand this would be 1e4 and more in the last iteration


def tangent_of(problem: Discretisation) -> Floats:
    """At the running iterate, whose balance was looked at."""
    matrix = petsc.create_matrix(problem.system.coupling)
    assemble_tangent(problem.system, matrix)
    dense = np.array(matrix.convert("dense").getDenseArray())
    matrix.destroy()
    return dense


def _free(problem: Discretisation) -> Indices:
    """The unknowns that are not held."""
    return np.setdiff1d(np.arange(problem.system.owned), problem.system.layout.held)


def free_tangent(problem: Discretisation) -> Floats:
    """That of the unknowns that are not held."""
    free = _free(problem)
    return tangent_of(problem)[np.ix_(free, free)]


def _growing(variant: gx.Variant) -> Discretisation:
    """A plate at the end of its ramp, in the step after it."""
    scene = gx.scenes.plate(4)
    problem = gx.discretise(scene, variant)
    steps = gx.march(scene, variant, problem)
    for step in steps:
        if step.time > scene.program.ramp - 1e-9:
            break
    steps.close()
    problem.system.begin_step(scene.program.step, 1.0)
    return problem


def _tangents(problem: Discretisation, still: Discretisation) -> dict[str, Floats]:
    """Three tangents at the running iterate; still: the same without growth.

    The algorithmic one has the derivative of the step's own balance of mass, K = K_F − Δt k, the continuous one the
    density as it is, K_F.  As printed a Δt is missing between ∂P̄/∂ρ and ∂R₀/∂F, K_F − k.
    """
    algorithmic, step = tangent_of(problem), problem.scene.program.step
    still.system.set_density(problem.system.densities.iterate())
    still.system.begin_step(step, 1.0)
    still.system.start_from(problem.system.unknown.x.array)
    still.system.out_of_balance()
    continuous = tangent_of(still)
    printed = continuous + (algorithmic - continuous) / step
    return {"algorithmic": algorithmic, "continuous": continuous, "as printed": printed}


def _quotients(problem: Discretisation) -> tuple[Floats, Indices]:
    """Derivatives of the balance by differences, and the unknowns that are free."""
    system = problem.system
    start = system.unknown.x.array.copy()
    free = _free(problem)
    length = PART * np.abs(start).max()
    derivatives = np.zeros((system.owned, system.owned))
    for i in free:
        ends = []
        for sign in (1, -1):
            system.unknown.x.array[:] = start
            system.unknown.x.array[i] += sign * length
            ends.append(system.out_of_balance())
        derivatives[:, i] = (ends[0] - ends[1]) / (2 * length)
    system.start_from(start)
    system.out_of_balance()
    return derivatives, free


@cache
def _consistency() -> dict[str, float]:
    found = {}
    for variant in POINTS:
        problem = _growing(variant)
        problem.system.out_of_balance()
        right, free = _quotients(problem)
        right = right[np.ix_(free, free)]
        for name, tangent in _tangents(problem, gx.baselines.frozen(problem.scene, variant)).items():
            off = np.linalg.norm(tangent[np.ix_(free, free)] - right) / np.linalg.norm(right)
            found[f"{variant.name}, {name}: off the difference quotients"] = float(off)
    return found


def _iterations() -> dict[str, float]:
    """Of Newton's method from the state before, by each tangent; as many as are tried where it does not converge."""
    found = {}
    for variant in POINTS:
        for name in ("algorithmic", "continuous", "as printed"):
            problem = _growing(variant)
            still, system = gx.baselines.frozen(problem.scene, variant), problem.system
            count, forces = 0, system.out_of_balance()
            bound = TOLERANCE * system.force_scale()
            while not np.linalg.norm(forces) <= bound and count < MOST and np.isfinite(forces).all():
                move = np.linalg.solve(_tangents(problem, still)[name], forces)
                system.start_from(system.unknown.x.array[: system.owned] - move)
                forces, count = system.out_of_balance(), count + 1
            arrived = np.linalg.norm(forces) <= bound
            found[f"{variant.name}, {name}: iterations"] = float(count if arrived else MOST)
    return found


def _orders() -> dict[str, float]:
    """Residuals over the squares of those before, in the step after the load's ramp."""
    found = {}
    for variant in (gx.Q1Q1, gx.Q1, gx.Q1P0, gx.Q1sri):
        scene = gx.scenes.plate(8)
        steps = gx.march(scene, variant, stepping=gx.FixedSteps(predicted=False), full_newton=True)
        norms = next(step.newton.residual_norms for step in steps if step.time > scene.program.ramp + 1e-9)
        steps.close()
        found[f"{variant.name}: iterations"] = float(len(norms) - 1)
        norms = [norm for norm in norms if norm > ROUND_OFF]
        found[f"{variant.name}: norm over the square of the last"] = max(b / a**2 for a, b in pairwise(norms))
    return found


class _Falling:
    """Watches whether the largest change of a density falls from step to step under constant loads."""

    def __init__(self, from_time: float) -> None:
        self.from_time, self.before, self.changes = from_time, np.empty(0), []  # type: ignore[var-annotated]

    def __call__(self, step: Step, problem: Discretisation) -> None:
        now = problem.density.x.array.copy()
        if step.time > self.from_time * 1.5:
            self.changes.append(float(np.abs(now - self.before).max()))
        self.before = now

    @property
    def falls(self) -> bool:
        """Whether it does, down to round-off."""
        return all(b < a or b < 1e-12 for a, b in pairwise(self.changes))


def _implicit() -> dict[str, float]:
    found = {}
    for step in (0.1, 10.0, 1e3, 1e6):
        finished, falling = 0, 0
        for name in VARIANTS:
            scene, stepping = at_once(BODIES["bar"].scene(1), BODIES["bar"], step, 5)
            watch = _Falling(scene.program.ramp)
            finished += march(scene, named(name), stepping=stepping, watch=watch).finished
            falling += watch.falls
        found[f"Δt = {step:g}: elements that finish, of 8"] = float(finished)
        found[f"Δt = {step:g}: whose changes fall, of 8"] = float(falling)
    return found


def _every_discretisation() -> dict[str, float]:
    found = {}
    for name in VARIANTS:
        each = march(with_exponents(BODIES["plate"].scene(1), 1.0, 2.0), named(name))
        found[f"{name}: reached t, of 10"] = each.time
        found[f"{name}: share of cells that were lumped"] = each.cells
    return found


def _stable(numbers: Numbers) -> bool:
    return min(values(numbers, "reached t")) == 10 and max(values(numbers, "lumped")) == 0


def _which_are_lumped(numbers: Numbers) -> str:
    lumped = [name for name, share in column(numbers, "share of cells that were lumped").items() if share]
    return (
        f"the plate with m = 2, n = 1 ends well in all, but a nodal density of {' and '.join(lumped)} would fall to "
        "zero were the balance of mass not lumped about it; all marches of that kind are counted on "
        "[the page on stability](../benchmarks/results/stability.md#exponents)"
    )


def _condensation() -> dict[str, float]:
    problem = _growing(gx.Q1P0)
    problem.system.out_of_balance()
    right, free = _quotients(problem)
    off = tangent_of(problem)[np.ix_(free, free)] - right[np.ix_(free, free)]
    return {
        "unknowns": float(problem.dofs),
        "displacements": 2.0 * problem.displacement_space.dofmap.index_map.size_global,
        "densities": float(problem.density_space.dofmap.index_map.size_global),
        "tangent off the difference quotients": float(np.linalg.norm(off) / np.linalg.norm(right)),
    }


def _off(bound: float, tangent: str) -> Callable[[Numbers], bool]:
    return lambda numbers: max(values(numbers, f", {tangent}")) < bound


CLAIMS = (
    Claim(
        "q1p0-by-condensation",
        "R4.1",
        "The density of Q1P0 can be eliminated by static condensation.",
        _condensation,
        decide(
            lambda numbers: (
                numbers["unknowns"] == numbers["displacements"] and values(numbers, "tangent off")[0] < 1e-6
            ),
            "displacements are all that is solved for, and the condensed tangent is that of the difference quotients",
            "the condensed system is another one",
        ),
    ),
    Claim(
        "algorithmic-tangent",
        "R5.1",
        "The algorithmic derivative of the density makes the tangent consistent, the continuous one does not.",
        _consistency,
        decide(
            lambda numbers: _off(1e-6, "algorithmic")(numbers) and min(values(numbers, ", continuous")) > 1e-3,
            "difference quotients of the condensed balance are the algorithmic tangent, not the continuous one",
            "difference quotients of the condensed balance are not the algorithmic tangent alone",
        ),
    ),
    Claim(
        "printed-tangent",
        "R5.1",
        "Equations (39) and (40) give that tangent as printed.",
        _consistency,
        decide(
            _off(1e-6, "as printed"),
            "difference quotients agree with it",
            "as we read them they lack a Δt between ∂P̄/∂ρ and ∂R₀/∂F, and the tangent is further off than the "
            "continuous one; with [∂R₀/∂ρ − 1/Δt]⁻¹ it agrees",
        ),
    ),
    Claim(
        "iterations-by-tangent",
        "R5.1",
        "With the algorithmic derivative Newton's method takes fewer iterations.",
        _iterations,
        decide(
            lambda numbers: 2 * max(values(numbers, ", algorithmic")) < min(values(numbers, ", continuous")),
            f"less than half of those with the continuous one (a step of the plate; {MOST} stands for no convergence)",
            "not less than half of those with the continuous one",
        ),
    ),
    Claim(
        "quadratic-convergence",
        "R5.1",
        "Newton's method then converges quadratically, by either strategy.",
        _orders,
        decide(
            lambda numbers: max(values(numbers, "square")) < QUADRATIC,
            "norms of the residuals over the squares of those before, relative to the loads, stay bounded",
            "norms of the residuals over the squares of those before, relative to the loads, do not stay bounded",
        ),
    ),
    Claim(
        "implicit-steps",
        "§7",
        "Implicit steps are unconditionally stable.",
        _implicit,
        decide(
            lambda numbers: set(numbers.values()) == {8.0},
            "the stepped bar under its full load at once: five steps of whatever length come to their end, each with a "
            "smaller change of density than the one before; "
            "[Δt over nine orders](../benchmarks/results/stability.md#time-steps)",
            "not all steps come to their end with ever smaller changes",
        ),
    ),
    Claim(
        "every-discretisation",
        "§7",
        "A well-posed model, m > n, is stable in every discretisation.",
        _every_discretisation,
        decide(_stable, "the plate with m = 2, n = 1 ends well in all", _which_are_lumped),
    ),
)
