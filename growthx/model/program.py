"""The way of the loads through time."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from growthx.common.arrays import Floats
from growthx.common.checks import require_kind, require_number
from growthx.common.errors import InputError
from growthx.common.overrides import Sealed


@dataclass(frozen=True)
class Program(Sealed, replaceable=()):
    """Time steps and load ramp.

    step: nominal time step Δt; until: end time; ramp: time over which loads and displacements grow linearly from zero.
    Without one they are there from the start, as a run needs that begins with a density grown under them.
    requested: other times at which a step is to end.

    Example:
        >>> program = gx.Program(step=0.1, until=2.5, ramp=0.5, requested=(1.25,))
        >>> program.until / program.step
        25.0
    """

    step: float
    until: float
    ramp: float = 0.0
    requested: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        require_number(self.step, "the time step Δt", "a positive number", lambda dt: dt > 0)
        require_number(self.until, "the end time", "a positive number", lambda t: t > 0)
        require_number(self.ramp, "the duration of the load ramp", "a number of at least 0", lambda t: t >= 0)
        if self.until / self.step > 1e7:
            raise InputError(
                f"the time step Δt is {self.step:g} for an end time of {self.until:g}: more than ten million steps, "
                "and a longer step would be right"
            )
        require_kind(self.requested, (tuple, list, np.ndarray), "the requested times", "a tuple of times")
        for time in self.requested:
            require_number(time, "a requested time", f"one above 0 and up to {self.until:g}", self._is_within)

    def times(self) -> Floats:
        """The times that must be hit: multiples of the step and requested ones, then the end time exactly."""
        count = math.ceil(self.until / self.step * (1 - 1e-12))
        return self._with_requested(self.step * np.arange(1, count))

    def landmarks(self) -> Floats:
        """The times that must be hit whatever the step: the end of the ramp, requested ones, the end time exactly."""
        return self._with_requested(np.array([self.ramp] if 0 < self.ramp < self.until else []))

    def _is_within(self, time: float) -> bool:
        return 0 < time <= self.until

    def _with_requested(self, some: Floats) -> Floats:
        """Some times, the requested ones and the end, in order, each once: rounding errors do not make two of one."""
        exact = np.array([*self.requested, self.until])
        apart = np.abs(np.subtract.outer(some, exact)).min(axis=1) > 1e-9 * self.step
        return np.unique(np.concatenate([some[apart], exact]))

    def amplitude(self, time: float) -> float:
        """Share of the loads at a time, from 0 to 1."""
        # A step meant to end the ramp may miss its end by a rounding error.
        return 1.0 if time >= self.ramp * (1 - 1e-12) else time / self.ramp
