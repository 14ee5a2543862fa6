"""Which states of a run are kept on its way: after every so many steps, at given times, or evenly spread."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from growthx.common.checks import require_kind, require_number, require_whole
from growthx.common.errors import InputError, shown
from growthx.stepping.control import FixedSteps

if TYPE_CHECKING:
    from growthx.common.arrays import Floats
    from growthx.model.program import Program
    from growthx.stepping.control import Stepping

SAME = 1e-9  # of the nominal step: times closer than that are one


@dataclass(frozen=True)
class Choice:
    """Which states are kept on the way; the last one always is.

    every: those after every so many steps; None: none.  times: those at these times, at each of which a step ends.
    start: the state before the first step.  slack: how far a time may be from one of them (time).
    """

    every: int | None = None
    times: tuple[float, ...] = ()
    start: bool = False
    slack: float = 0.0

    def __bool__(self) -> bool:
        """Whether there are any."""
        return self.start or self.every is not None or bool(self.times)

    def is_due(self, steps: int, time: float) -> bool:
        """Whether the state after so many steps, at that time, is one of them."""
        if self.every is not None and steps % self.every == 0:
            return True
        return bool(self.times) and float(np.abs(np.subtract(self.times, time)).min()) <= self.slack


def check_choice(every: Any, times: Any, frames: Any) -> None:
    """Refuse what chooses no states, whatever the run."""
    if every is not None:
        require_whole(every, "every, the number of steps from one kept state to the next,")
    if frames is not None:
        require_whole(frames, "frames, the number of states to be kept,")
    if every is not None and frames is not None:
        raise InputError(
            f"states are to be kept after every {every} steps and as {frames} frames evenly spread: one of the two "
            "would be right"
        )
    if times is not None:
        require_kind(times, (tuple, list, np.ndarray), "times, at which states are to be kept,", "a tuple of times")
        if len(times) == 0:
            raise InputError(f"times, at which states are to be kept, are {shown(times)}: one or more would be right")


def choose(every: int | None, times: Any, frames: int | None, program: Program, stepping: Stepping) -> Choice:
    """The states that are asked for, in a run of a program by a stepping.

    times: up to the end; 0 is the start.  frames: so many at equal times from the first to the end, and the start.
    Of `FixedSteps`, these are the ends of steps that come nearest, so that no step is another than without them.
    """
    known = stepping.control(program).targets()
    wanted: list[float] = []
    for time in () if times is None else times:
        what, right = "a time at which a state is to be kept", f"one from 0 to the end, {program.until:g},"
        require_number(time, what, right, lambda each: 0 <= each <= program.until)
        wanted.append(float(time))
    start = every is not None or frames is not None or 0.0 in wanted
    exact = np.array([time for time in wanted if time > 0])
    even = np.empty(0) if frames is None else program.until * np.arange(1, frames + 1) / frames
    if frames is not None and isinstance(stepping, FixedSteps):
        if frames > len(known):
            raise InputError(
                f"{frames} frames are to be kept of a run of {len(known)} steps of fixed length: at most {len(known)}, "
                "or AdaptiveSteps, would be right"
            )
        even = _nearest(known, even)
    every_time = np.concatenate([exact, even])
    nearest, slack = _nearest(known, every_time), SAME * program.step
    found = np.where(np.abs(nearest - every_time) <= slack, nearest, every_time)
    return Choice(every, tuple(np.unique(found).tolist()), start, slack)


def _nearest(known: Floats, times: Floats) -> Floats:
    """The known times, in order, that come nearest to these."""
    after = np.searchsorted(known, times).clip(1, max(1, len(known) - 1))
    before, after = known[after - 1], known[np.minimum(after, len(known) - 1)]
    return np.where(times - before <= after - times, before, after)


def with_landmarks(program: Program, choice: Choice, stepping: Stepping) -> Program:
    """The program, with steps that also end at the times of a choice; itself where they do so already."""
    new = np.setdiff1d(choice.times, stepping.control(program).targets())
    return replace(program, requested=(*program.requested, *new.tolist())) if len(new) else program
