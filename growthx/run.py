"""One call for a whole run: discretise, march, keep the history, say how it ended."""

from __future__ import annotations

import logging
import os
import signal
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from growthx import checkpoints
from growthx.checkpoints import Checkpoints
from growthx.errors import EndedEarly, InputError, Interrupted, OutputError
from growthx.identity import identity
from growthx.interruption import Interruption
from growthx.marching import Step, discretise, march
from growthx.results import free_folder, new_folder, write
from growthx.stepping import FixedSteps

if TYPE_CHECKING:
    from mpi4py import MPI

    from growthx.discretisation import Discretisation
    from growthx.marching import March
    from growthx.scene import Scene
    from growthx.stepping import Stepping
    from growthx.variants import Variant


@dataclass
class Result:
    """A run: its history of accepted steps and the discretised scene in the last of their states.

    converged: whether the last requested time, or the equilibrium asked for, was reached; if not, `reason` says when,
    where and why it ended.  folder: where fields and history are on disk, None if nowhere.
    setup_s, compile_s, solve_s: seconds for spaces and symbolic set-up, for compiling the weak forms, for marching.
    """

    problem: Discretisation
    steps: list[Step] = field(default_factory=list)
    converged: bool = False
    reason: str = ""
    folder: Path | None = None
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


class RunInterrupted(Interrupted):
    """A run was ended by Ctrl-C or SIGTERM after the step it was in; `result` holds everything up to there.

    checkpoint: the file to resume from, None if there was no folder for it.
    """

    def __init__(self, result: Result, number: int, checkpoint: Path | None, trouble: str = "") -> None:
        """trouble: why there is no such file though there should be."""
        end = f"t = {result.time:g} of {result.scene.program.until:g}"
        result.reason = f"the run was ended by {signal.Signals(number).name} at {end}"
        then = f": to resume {checkpoint} goes on from there" if checkpoint else trouble and f", and {trouble}"
        super().__init__(result.reason + then, number)
        self.result, self.checkpoint = result, checkpoint


class RunNotWritten(OutputError):
    """The results of a run could not be written, also in place of `RunEndedEarly`; `result` still holds them."""

    def __init__(self, result: Result, error: OutputError) -> None:
        super().__init__(f"{result.reason}; {error}" if result.reason else str(error))
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
    checkpoint: int | None = None,
    resume: str | os.PathLike[str] | None = None,
    refuge: str | os.PathLike[str] | None = None,
) -> Result:
    """Run a scene to its end.

    out: a new or empty folder; the fields and history are written there when the run ends, also when it ends early.
    watch: called after every accepted step with the result so far, for progress bars and intermediate output; the time
    it takes is not counted.
    stepping: the way through time, `FixedSteps` or `AdaptiveSteps`; default: the program's fixed steps, implicit Euler.
    tolerance, full_newton: of Newton's method, see `newton.Newton`.
    checkpoint: keep the state in `out`, at the start and after every so many steps.
    resume: a checkpoint of the same scene, which may have another end, to go on from; or the folder of a run that has
    left some, which may be `out` if nothing else is there.
    refuge: name of a folder to be made for the last state if there is no `out`.
    Raises RunEndedEarly if a step cannot be solved, RunInterrupted after Ctrl-C, SIGTERM or SIGUSR1 (a second one ends
    the run at once), InputError if `out` is not empty or not writable, or a checkpoint is not one of this run, and
    RunNotWritten if results cannot be written.
    """
    comm = scene.mesh.domain.comm
    _check_plan(checkpoint, out)
    source = None if resume is None else checkpoints.locate(resume, comm)
    folder = None if out is None else new_folder(out, comm, lambda file: checkpoints.is_part_of(file, source))
    stepping = FixedSteps() if stepping is None else stepping
    start = time.perf_counter()
    problem = discretise(scene, variant)
    result = Result(problem, compile_s=problem.compile.seconds)
    steps = march(scene, variant, problem, tolerance, stepping=stepping, full_newton=full_newton)
    files = Checkpoints(problem, lambda: identity(problem, stepping, tolerance, full_newton))
    if source is not None:
        memory, result.steps = files.load(source)
        steps.begin_anew(memory)
    result.setup_s = time.perf_counter() - start - result.compile_s
    if folder is not None and checkpoint is not None and not _same_folder(source, folder):
        files.save(folder, checkpoints.PLANNED, steps.memory(), result.steps)
    number = 0
    try:
        with Interruption() as interruption:
            for step in _timed(steps, result):
                result.steps.append(step)
                if watch is not None:
                    watch(result)
                if folder is not None and checkpoint is not None and len(result.steps) % checkpoint == 0:
                    _keep(result, steps, files, folder)
                if number := interruption.signal_on_any_rank(comm):
                    break
        result.converged = not number
    except EndedEarly as ended:
        result.reason = str(ended)
    finally:
        steps.close()
    if folder is None and not result.converged and result.steps:
        folder = _folder_for_last_state(refuge, comm)
    if number:
        raise _interrupted(result, number, steps, files, folder)
    if folder is not None and result.steps:
        try:
            write(folder, result)
        except OutputError as error:
            raise RunNotWritten(result, error) from error
        result.folder = folder
    if not result.converged:
        raise RunEndedEarly(result)
    return result


def _check_plan(checkpoint: int | None, out: str | os.PathLike[str] | None) -> None:
    if checkpoint is None:
        return
    if not isinstance(checkpoint, int) or isinstance(checkpoint, bool) or checkpoint < 1:
        raise InputError(f"checkpoints are to be kept every {checkpoint!r} steps: a whole number from 1 would be right")
    if out is None:
        raise InputError(
            f"checkpoints are to be kept every {checkpoint} steps, but nowhere: a folder to write to is needed"
        )


def _same_folder(source: Path | None, folder: Path) -> bool:
    return source is not None and source.parent.resolve() == folder.resolve()


def _folder_for_last_state(refuge: str | os.PathLike[str] | None, comm: MPI.Comm) -> Path | None:
    """A new folder for a run without one; None if there is to be none, or there can be none where nobody may write."""
    try:
        return None if refuge is None else free_folder(refuge, comm)
    except InputError:
        return None


def _timed(steps: March, result: Result) -> Iterator[Step]:
    """The steps, with the time they take counted in the result."""
    while True:
        start = time.perf_counter()
        try:
            step = next(steps, None)
        finally:
            result.solve_s += time.perf_counter() - start
        if step is None:
            return
        yield step


def _interrupted(result: Result, number: int, steps: March, files: Checkpoints, place: Path | None) -> RunInterrupted:
    """Save the state, if there is a place for it; what a run that was ended raises."""
    if place is None:
        return RunInterrupted(result, number, None)
    try:
        kept = files.save(place, checkpoints.INTERRUPTED, steps.memory(), result.steps)
    except OutputError as error:
        return RunInterrupted(result, number, None, str(error))
    return RunInterrupted(result, number, kept)


def _keep(result: Result, steps: March, files: Checkpoints, folder: Path) -> None:
    """Write a planned checkpoint; a full disk now need not end a run that may still come to its end."""
    try:
        files.save(folder, checkpoints.PLANNED, steps.memory(), result.steps)
    except OutputError as error:
        if result.problem.comm.rank == 0:
            logging.getLogger("growthx").warning("growthx: %s; the run goes on", error)
    steps.begin_anew()  # as a run that resumes from here does
