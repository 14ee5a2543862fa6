"""The records of a march: each accepted step, and the run that they make."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING

from growthx.common.words import LINE, cut, line, quoted
from growthx.discretisation.words import problem_lines
from growthx.solvers.report import NewtonReport
from growthx.stepping import record

if TYPE_CHECKING:
    from growthx.common.arrays import Floats
    from growthx.discretisation.discretisation import Discretisation
    from growthx.discretisation.variants import Variant
    from growthx.model.scene import Scene


@dataclass(frozen=True)
class Step:
    """One accepted time step; all numbers are global.

    time, time_step: end and length of the step.  load: share of the loads.  rejected: failed attempts before it.
    newton: how the solution of the step went, of all its stages.
    error: estimated error of density of this step, root mean square over the volume, relative; NaN if not asked for.
    mass: ∫ ρ dV of what grows (per thickness in two dimensions).
    mass_defect: |change of mass − Δt (∫ R₀ dV + influx)| over the mass.
    min_density, max_density: over the density's own degrees of freedom in what grows.
    reactions: force on the body at each support (per thickness in two dimensions).
    force_defect: ‖sum of reactions and loads‖ over the sum of their sizes, the largest of the load cases.
    moment_defect: the same of moments about the middle of the body, over the sum of their sizes and that of the forces
        times half of the body's longest side; NaN with loads that depend on the state, or inertia.
    lumped_cells: number of cells in which the balance of mass was lumped, lest a nodal density vanish.
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
    force_defect: float = math.nan
    moment_defect: float = math.nan
    lumped_cells: int = 0

    @property
    def newton_iterations(self) -> int:
        """Newton iterations of the accepted solution."""
        return self.newton.iterations

    def __str__(self) -> str:
        return record.step_in_words(self)


@dataclass(frozen=True)
class Cost:
    """What a run has cost up to the end of a step.

    wall_s: seconds since it began, of a resumed one those of the run before included.
    peak_memory: the most memory that each of its processes had so far, of all together (MB); NaN where none can say.
    """

    wall_s: float
    peak_memory: float


class Ending(StrEnum):
    """How a run ended: in the biological equilibrium or at the end of time it was to reach, or before both."""

    EQUILIBRIUM = "equilibrium"
    END_OF_TIME = "end of time"
    EARLY = "ended early"
    INTERRUPTED = "interrupted"


@dataclass(repr=False)
class Result:
    """A run: its history of accepted steps and the discretised scene in the last of their states.

    ended: how, None as long as it goes on; if early or interrupted, `reason` says when, where and why.
    folder: where fields and history are on disk, None if nowhere.
    setup_s, compile_s, solve_s: seconds for spaces and symbolic set-up, for compiling the weak forms, for marching.
    costs: up to the end of each step; empty where nobody has kept them, as in a march.

    Example:
        >>> result = gx.solve(gx.scenes.plate(2), gx.Q1P0)
        >>> result.time, result.converged, len(result.steps)
        (2.5, True, 25)
    """

    problem: Discretisation
    steps: list[Step] = field(default_factory=list)
    ended: Ending | None = None
    reason: str = ""
    folder: Path | None = None
    setup_s: float = 0.0
    compile_s: float = 0.0
    solve_s: float = 0.0
    costs: list[Cost] = field(default_factory=list)

    def __repr__(self) -> str:
        return f"Result({record.result_in_short(self)})"

    def __str__(self) -> str:
        return record.result_in_words(self)

    @property
    def converged(self) -> bool:
        """Whether the last requested time, or the equilibrium asked for, was reached: `ended` says which."""
        return self.ended in (Ending.EQUILIBRIUM, Ending.END_OF_TIME)

    @property
    def scene(self) -> Scene:
        """What was computed."""
        return self.problem.scene

    @property
    def variant(self) -> Variant:
        """How it was discretised."""
        return self.problem.variant

    @property
    def time(self) -> float:
        """Time reached."""
        return self.steps[-1].time if self.steps else 0.0

    @property
    def newton_iterations(self) -> int:
        """Newton iterations of all accepted steps."""
        return sum(step.newton_iterations for step in self.steps)

    @property
    def factorisations(self) -> int:
        """Tangents assembled and factorised in all accepted steps."""
        return sum(step.newton.factorisations for step in self.steps)

    @property
    def linear_solver(self) -> str:
        """What solved the linear systems, in words; empty if no step was accepted."""
        return self.steps[-1].newton.linear_solver if self.steps else ""


def step_in_words(of: Step) -> str:
    """How a step went, on one line."""
    numbers = [
        f"t = {of.time:g} (Δt = {of.time_step:g}, load {of.load:.3g})",
        f"{of.newton_iterations} Newton iterations with {of.newton.factorisations} tangents",
        f"mass {of.mass:.6g}",
        f"density {of.min_density:.4g} to {of.max_density:.4g}",
    ]
    if of.lumped_cells:
        numbers.append(f"balance of mass lumped in {of.lumped_cells} cells")
    if of.rejected:
        numbers.append(f"{of.rejected} attempts rejected")
    return ", ".join(numbers)


def result_in_short(of: Result) -> str:
    """A result's scene, variant and end, on one line."""
    return (
        f"{quoted(of.scene.name)} with {of.variant.name}: {len(of.steps)} steps to t = {of.time:g}, "
        f"{of.ended or 'not ended'}"
    )


def result_in_words(of: Result) -> str:
    """A run: what was computed, how it went and how it ended."""
    lines = problem_lines(of.problem)
    lines.append(line("steps", f"{len(of.steps)}, {of.newton_iterations} Newton iterations"))
    if of.steps:
        last = of.steps[-1]
        lines.append(
            line("at the end", f"mass {last.mass:.6g}, density {last.min_density:.4g} to {last.max_density:.4g}")
        )
    if of.folder is not None:
        lines.append(line("folder", str(of.folder)))
    lines.append(f"  ended: {cut(ending(of), 3 * LINE)}")
    return "\n".join(lines)


def ending(of: Result) -> str:
    """How a run ended, as a sentence without a full stop."""
    if of.ended is None:
        return f"not yet, at t = {of.time:g} of {of.scene.program.until:g}"
    return f"{of.ended}, t = {of.time:g} of {of.scene.program.until:g}" if of.converged else f"{of.ended}, {of.reason}"
