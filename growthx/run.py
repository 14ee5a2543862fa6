"""One call for a whole run: discretise, march, keep the history, say how it ended."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from growthx.errors import EndedEarly
from growthx.marching import Step, discretise, march
from growthx.results import new_folder, write

if TYPE_CHECKING:
    from growthx.discretisation import Discretisation
    from growthx.scene import Scene
    from growthx.stepping import Stepping
    from growthx.variants import Variant


@dataclass
class Result:
    """A run: its history of accepted steps and the discretised scene in the last of their states.

    converged: whether the last requested time, or the equilibrium asked for, was reached; if not, `reason` says when,
    where and why it ended.
    setup_s, compile_s, solve_s: seconds for spaces and symbolic set-up, for compiling the weak forms, for marching.
    """

    problem: Discretisation
    steps: list[Step] = field(default_factory=list)
    converged: bool = False
    reason: str = ""
    setup_s: float = 0.0
    compile_s: float = 0.0
    solve_s: float = 0.0

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


class RunEndedEarly(EndedEarly):
    """A run stopped before its last requested time; `result` holds everything up to the last good state."""

    def __init__(self, result: Result) -> None:
        super().__init__(result.reason)
        self.result = result


def solve(
    scene: Scene,
    variant: Variant,
    *,
    out: str | os.PathLike[str] | None = None,
    watch: Callable[[Result], None] | None = None,
    tolerance: float = 1e-10,
    stepping: Stepping | None = None,
    full_newton: bool = False,
) -> Result:
    """Run a scene to its end.

    out: a new or empty folder; the fields and history are written there when the run ends, also when it ends early.
    watch: called after every accepted step with the result so far, for progress bars and intermediate output; the time
    it takes is not counted.
    stepping: the way through time, `FixedSteps` or `AdaptiveSteps`; default: the program's fixed steps, implicit Euler.
    tolerance, full_newton: of Newton's method, see `newton.Newton`.
    Raises RunEndedEarly if a step cannot be solved, InputError if `out` is not empty or not writable.
    """
    folder = None if out is None else new_folder(out, scene.mesh.domain.comm)
    start = time.perf_counter()
    problem = discretise(scene, variant)
    result = Result(problem, compile_s=problem.compile.seconds)
    result.setup_s = time.perf_counter() - start - result.compile_s
    start = time.perf_counter()
    try:
        for step in march(scene, variant, problem, tolerance, stepping=stepping, full_newton=full_newton):
            result.solve_s += time.perf_counter() - start
            result.steps.append(step)
            if watch is not None:
                watch(result)
            start = time.perf_counter()
        result.converged = True
    except EndedEarly as ended:
        result.reason = str(ended)
    result.solve_s += time.perf_counter() - start
    if folder is not None:
        write(folder, result)
    if not result.converged:
        raise RunEndedEarly(result)
    return result
