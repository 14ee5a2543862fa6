"""One call for a whole run: discretise, march, keep the history, say how it ended."""

from __future__ import annotations

import logging
import os
import signal
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from growthx.common.communicators import require_same_on_all
from growthx.common.errors import EndedEarly, GrowthxError, Interrupted, OutputError, shown
from growthx.common.interruption import Interruption
from growthx.common.usage import spent
from growthx.discretisation.discretise import discretise
from growthx.post.derived import check_fields
from growthx.results import checkpoints
from growthx.results.checkpoints import Checkpoints
from growthx.results.identity import identity
from growthx.results.plan import Plan, check_plan, plan
from growthx.results.states.choice import choose, with_landmarks
from growthx.results.states.trail import Trail
from growthx.solvers.settings import NewtonSettings
from growthx.stepping.arguments import check_run
from growthx.stepping.control import FixedSteps
from growthx.stepping.marching import march
from growthx.stepping.record import Cost, Ending, Result, Step

if TYPE_CHECKING:
    from growthx.discretisation.variants import Variant
    from growthx.model.scene import Scene
    from growthx.stepping.control import Stepping
    from growthx.stepping.marching import March


class RunEndedEarly(EndedEarly):
    """A run stopped before its last requested time; `result` holds everything up to the last good state.

    Example:
        >>> from dataclasses import replace
        >>> through = (gx.Support("left"), gx.Support("right", (-3.0, 0.0)))  # farther than the body is long
        >>> try:
        ...     gx.solve(replace(gx.scenes.plate(2), supports=through, program=gx.Program(0.1, 0.1)), gx.Q1P0)
        ... except gx.RunEndedEarly as error:
        ...     print(error.result.time, error.result.converged)
        0.0 False
    """

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
    every: int | None = None,
    times: Sequence[float] | None = None,
    frames: int | None = None,
    vtkhdf: bool = False,
    watch: Callable[[Result], None] | None = None,
    tolerance: float = 1e-10,
    stepping: Stepping | None = None,
    full_newton: bool = False,
    checkpoint: int | None = None,
    resume: str | os.PathLike[str] | None = None,
    refuge: str | os.PathLike[str] | None = None,
    fields: Sequence[str] | None = None,
) -> Result:
    """Run a scene to its end.

    out: a new or empty folder; the history is written there step by step, the fields and the density when the run ends,
    also early.
    every, times, frames: which other states are kept in `fields.pvd` and `raw.pvd` on the way: the start, and those
    after every so many steps; those at these times; the start, and so many at equal times to the end, with `FixedSteps`
    at the ends of steps next to these.  All other times become ends of steps: one is cut short there, which changes the
    results within the error of the steps; `AdaptiveSteps` go on with the length they had.
    vtkhdf: keep all states in one file each, `fields.vtkhdf` and `raw.vtkhdf`, instead of the .pvd and its files.
    watch: called after every accepted step with the result so far, for progress bars and intermediate output; the time
    it takes is not counted.
    stepping: the way through time, `FixedSteps` or `AdaptiveSteps`; default: the program's fixed steps, implicit Euler.
    tolerance, full_newton: of Newton's method, see `solvers.settings.NewtonSettings`.
    checkpoint: keep the state in `out`, at the start and after every so many steps.
    resume: a checkpoint of the same scene, which may have another end, to go on from; or the folder of a run that has
    left some, which may be `out` if nothing else is there.
    refuge: name of a folder to be made for the last state if there is no `out`.
    fields: names of the fields in the files, `gx.results.FIELDS` has them: each as mean over cells, averaged to nodes
    and at integration points, or as 'von_mises:cells', ':nodes' or ':points' in one of these places; None: the density
    and what it follows from.  Nothing else is evaluated.
    Raises RunEndedEarly if a step cannot be solved, RunInterrupted after Ctrl-C, SIGTERM or SIGUSR1 (a second one ends
    the run at once), InputError if `out` is not empty or not writable, or a checkpoint is not one of this run, and
    RunNotWritten if results cannot be written.

    Example:
        >>> gx.solve(gx.scenes.plate(2), gx.Q1P0)
        Result('plate' with Q1P0: 25 steps to t = 2.5, end of time)
    """
    check_run(scene, variant, tolerance=tolerance, stepping=stepping, full_newton=full_newton)
    kept: dict[str, Any] = {"every": every, "times": times, "frames": frames}
    where: dict[str, Any] = {"out": out, "resume": resume, "refuge": refuge}
    _agree(scene, where | kept | {"checkpoint": checkpoint, "vtkhdf": vtkhdf, "fields": fields})
    check_plan(**where, watch=watch, checkpoint=checkpoint, vtkhdf=vtkhdf, fields=fields, **kept)
    start = time.perf_counter()
    stepping = FixedSteps() if stepping is None else stepping
    choice = choose(**kept, program=scene.program, stepping=stepping)
    places = plan(out, checkpoint, resume, refuge, scene.mesh.comm, choice, vtkhdf, fields)
    program = with_landmarks(scene.program, choice, stepping)
    scene = scene if program is scene.program else replace(scene, program=program)
    problem = discretise(scene, variant)
    check_fields(fields, problem)
    steps = march(scene, variant, problem, tolerance, stepping=stepping, full_newton=full_newton)
    settings = NewtonSettings(tolerance, full_newton)
    run = _Run(steps, places, Checkpoints(problem, lambda: identity(problem, stepping, settings)), start)
    run.begin()
    run.result.setup_s = time.perf_counter() - start - run.result.compile_s
    return run.end(run.go(watch))


def _agree(scene: Scene, told: Mapping[str, Any]) -> None:
    """Refuse what ranks were told differently of where and when states are kept: no array among it is a rank's own."""
    as_rows = {name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in told.items()}
    require_same_on_all(scene.mesh.comm, as_rows)


class _Run:
    """A run on its way: its march, its result so far, and where both are kept."""

    def __init__(self, steps: March, places: Plan, files: Checkpoints, start: float) -> None:
        """start: when it began (seconds of `time.perf_counter`)."""
        self._steps, self._places, self._files = steps, places, files
        self._comm, self._start = steps.problem.comm, start
        self.result = Result(steps.problem, compile_s=steps.problem.compile.seconds)
        self._trail = Trail(places, self.result)

    def begin(self) -> None:
        """Go on from where another run was, and keep the start."""
        result = self.result
        if self._places.source is not None:
            memory, result.steps, result.costs = self._files.load(self._places.source)
            self._steps.begin_anew(memory)
            self._start -= result.costs[-1].wall_s if result.costs else 0.0
        self._trail.begin()

    def go(self, watch: Callable[[Result], None] | None) -> int:
        """March to the end; the number of the signal that ended it, zero if none did."""
        result, steps, number = self.result, self._steps, 0
        if self._places.keeps_start:
            self._save(checkpoints.PLANNED, self._places.folder)
        try:
            with Interruption() as interruption:
                for step in _timed(steps, result):
                    result.steps.append(step)
                    result.costs.append(Cost(*spent(self._start, self._comm)))
                    self._trail.add()
                    if watch is not None:
                        _show(watch, result)
                    if self._places.is_due(len(result.steps)):
                        self._keep()
                    if number := interruption.signal_on_any_rank(self._comm):
                        break
            reached = Ending.EQUILIBRIUM if steps.in_equilibrium else Ending.END_OF_TIME
            result.ended = Ending.INTERRUPTED if number else reached
        except EndedEarly as ended:
            result.ended, result.reason = Ending.EARLY, str(ended)
        except BaseException:
            steps.leave()
            raise
        steps.close()
        return number

    def end(self, number: int) -> Result:
        """Write what was found, and say how the run ended: by returning or by raising."""
        result, folder = self.result, self._places.folder
        if folder is None and not result.converged and result.steps:
            folder = self._places.folder_for_last_state(self._comm)
        if number:
            self._trail.close()
            raise self._interrupted(number, folder)
        if folder is not None and result.steps:
            try:
                self._trail.end(folder)
            except OutputError as error:
                raise RunNotWritten(result, error) from error
            result.folder = folder
        if not result.converged:
            raise RunEndedEarly(result)
        return result

    def _save(self, kind: str, folder: Path | None) -> Path:
        assert folder is not None
        return self._files.save(folder, kind, self._steps.memory(), self.result.steps, self.result.costs)

    def _keep(self) -> None:
        """Write a planned checkpoint; a full disk now need not end a run that may still come to its end."""
        try:
            self._save(checkpoints.PLANNED, self._places.folder)
        except OutputError as error:
            if self._comm.rank == 0:
                logging.getLogger("growthx").warning("growthx: %s; the run goes on", error)
        self._steps.begin_anew()  # as a run that resumes from here does

    def _interrupted(self, number: int, place: Path | None) -> RunInterrupted:
        """Save the state, if there is a place for it; what a run that was ended raises."""
        if place is None:
            return RunInterrupted(self.result, number, None)
        try:
            kept = self._save(checkpoints.INTERRUPTED, place)
        except OutputError as error:
            return RunInterrupted(self.result, number, None, str(error))
        return RunInterrupted(self.result, number, kept)


def _show(watch: Callable[[Result], None], result: Result) -> None:
    """Call what watches a run; where it raises an error on some ranks, all of them raise one (collective)."""
    comm = result.problem.comm
    try:
        watch(result)
    except BaseException as error:
        comm.allgather(shown(error))
        raise
    found = comm.allgather("")
    if any(found):
        rank, problem = next((rank, problem) for rank, problem in enumerate(found) if problem)
        raise GrowthxError(f"what watches the run raised {problem} at t = {result.time:g} on rank {rank}")


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
