"""How a run goes through time: in fixed steps, as the paper, or in steps from the estimated error of density."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from growthx.common.checks import require_kind, require_number
from growthx.common.memory import Memory
from growthx.common.overrides import Sealed
from growthx.stepping.time_schemes import IMPLICIT_EULER, TR_BDF2, TimeScheme

if TYPE_CHECKING:
    from growthx.common.arrays import Floats
    from growthx.model.program import Program

SMALLEST_CUT = 2.0**-12  # of the nominal step: below it the run ends
MOST_FAILURES = 60  # more than half the steps that were solved: a run that creeps on comes to nothing
CREEPING = 0.01  # of the nominal step, from one failure to the next: slower runs come to nothing, either
FADING = 0.2  # share of the last failure in that mean: from whole steps to none it falls below in twenty-one
SAFETY = 0.9  # of the step whose estimated error would be the tolerance
WIDEST, NARROWEST = 5.0, 0.2  # change from one step to the next
FAILED = 0.25  # of a step that could not be solved
SOLVED = 0.03  # tolerance of Newton's method over that of the density
ROUND_OFF = 1e-9  # of a step: less than that is no time
NO_TIME = 1e-13  # of the nominal step: a shorter one may not change the time at all


class StepControl(ABC):
    """Proposes steps and hears how they went; made anew for each run."""

    needs_error: bool  # whether the steps depend on their estimated errors

    def __init__(self, program: Program) -> None:
        self._program = program
        self._failures = 0.0  # less half the steps that were solved since
        self._pace, self._gained = 1.0, 0.0  # nominal steps between two failures: their fading mean, and since the last

    @abstractmethod
    def targets(self) -> Floats:
        """The times at which a step must end."""

    @abstractmethod
    def end(self, time: float, target: float) -> float:
        """End of the step that begins at a time and goes no further than a target."""

    @property
    def hopeless(self) -> bool:
        """Whether steps have become so short, or have failed so often, that the run must end."""
        return self.too_short or self._failures > MOST_FAILURES or self._pace < CREEPING

    @property
    @abstractmethod
    def too_short(self) -> bool:
        """Whether steps have become so short that the run must end."""

    @abstractmethod
    def failed(self, time_step: float) -> None:
        """A step could not be solved: the next one is shorter."""
        self._failures += 1
        self._pace += FADING * (min(self._gained, 1.0) - self._pace)
        self._gained = 0.0

    @abstractmethod
    def accepts(self, time_step: float, error: float) -> bool:
        """Whether a solved step of that estimated error is good enough."""

    def solved(self) -> None:
        """A step was solved: former failures count for less."""
        self._failures = max(0.0, self._failures - 0.5)

    def gained(self, share: float) -> None:
        """The run has come on by so much of a nominal step."""
        self._gained += share

    def begin_anew(self) -> None:
        """Forget all failures: what is to come is solved in another way."""
        self._failures, self._pace, self._gained = 0.0, 1.0, 0.0

    @abstractmethod
    def memory(self) -> Memory:
        """What it has learnt of the steps so far."""
        return Memory({"failures": self._failures, "pace": self._pace, "gained": self._gained})

    @abstractmethod
    def recall(self, memory: Memory) -> None:
        """Know that again."""
        self._failures = memory.numbers["failures"]
        # In checkpoints of before there are none.
        self._pace, self._gained = memory.numbers.get("pace", 1.0), memory.numbers.get("gained", 0.0)


@dataclass(frozen=True, kw_only=True)
class Stepping(Sealed, ABC, replaceable=()):
    """A way through time.

    scheme: of time integration.
    equilibrium: end the run when the rate of density has fallen to this share of the resorption c S* without any
    stimulus, both as root mean squares over the volume; None goes on to the end of the program.
    predicted: begin each solution where the last ones point; else, as the paper, at the last state.
    """

    scheme: TimeScheme = IMPLICIT_EULER
    equilibrium: float | None = None
    predicted: bool = True

    def __post_init__(self) -> None:
        require_kind(self.scheme, TimeScheme, "the scheme of time integration", "gx.IMPLICIT_EULER or gx.TR_BDF2")
        require_kind(self.predicted, bool, "predicted, of the steps,", "True or False")
        if self.equilibrium is not None:
            require_number(self.equilibrium, "the share of equilibrium", "a positive number", lambda share: share > 0)

    @abstractmethod
    def control(self, program: Program) -> StepControl:
        """What chooses the steps of one run."""

    @abstractmethod
    def newton_tolerance(self, tolerance: float) -> float:
        """What Newton's method must reach, where exact solutions of the steps would take the given tolerance."""


@dataclass(frozen=True)
class FixedSteps(Stepping, replaceable=()):
    """Steps of the program's Δt, cut where one cannot be solved; implicit Euler with them is the paper's scheme.

    Example:
        >>> gx.FixedSteps().scheme.name, gx.FixedSteps(scheme=gx.TR_BDF2).scheme.name
        ('implicit Euler', 'TR-BDF2')
    """

    def control(self, program: Program) -> StepControl:
        """Nominal steps."""
        return _Nominal(program)

    def newton_tolerance(self, tolerance: float) -> float:
        """The given one: users compare digits."""
        return tolerance


@dataclass(frozen=True)
class AdaptiveSteps(Stepping, replaceable=()):
    """Steps as long as the error of density allows, which end with the ramp and at the program's requested times.

    tolerance: of the estimated error of one step, relative, root mean square over the volume.
    longest: step (time).

    Example:
        >>> result = gx.solve(gx.scenes.plate(2), gx.Q1P0, stepping=gx.AdaptiveSteps(tolerance=1e-2))
        >>> result.converged, len(result.steps) < 25
        (True, True)
    """

    tolerance: float = 1e-3
    longest: float = math.inf
    scheme: TimeScheme = field(default=TR_BDF2, kw_only=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        require_number(
            self.tolerance, "the tolerance of density", "a number between 0 and 1", lambda tolerance: 0 < tolerance < 1
        )
        if self.longest != math.inf:
            require_number(self.longest, "the longest time step", "a positive number", lambda step: step > 0)

    def control(self, program: Program) -> StepControl:
        """Steps from error."""
        return _FromError(program, self)

    def newton_tolerance(self, tolerance: float) -> float:
        """No tighter than the error of the steps is worth."""
        return max(tolerance, SOLVED * self.tolerance)


class Halving(StepControl):
    """A share of given steps, halved where they fail, doubled again where they do not."""

    needs_error = False

    def __init__(self, program: Program) -> None:
        super().__init__(program)
        self.cut = 1.0

    @property
    def too_short(self) -> bool:
        """Whether the share has become so small that the run must end."""
        return self.cut < SMALLEST_CUT

    def begin_anew(self) -> None:
        """With the whole step."""
        super().begin_anew()
        self.cut = 1.0

    def failed(self, time_step: float) -> None:
        """Half the share is next."""
        super().failed(time_step)
        self.cut /= 2

    def accepts(self, time_step: float, error: float) -> bool:
        """Every solved step is good enough."""
        self.solved()
        self.gained(self.cut)
        self.cut = min(1.0, 2 * self.cut)
        return True

    def memory(self) -> Memory:
        """The share."""
        memory = super().memory()
        memory.numbers["cut"] = self.cut
        return memory

    def recall(self, memory: Memory) -> None:
        """Know that again."""
        super().recall(memory)
        self.cut = memory.numbers["cut"]


class _Nominal(Halving):
    """The program's step, or a share of it."""

    def targets(self) -> Floats:
        return self._program.times()

    def end(self, time: float, target: float) -> float:
        remaining = target - time
        # The last piece ends on the requested time exactly and is never a sliver.
        pieces = max(1, round(remaining / (self.cut * self._program.step)))
        return target if pieces == 1 else time + remaining / pieces


class _FromError(StepControl):
    """A step in proportion to the root of the tolerance over the last error."""

    needs_error = True

    def __init__(self, program: Program, stepping: AdaptiveSteps) -> None:
        super().__init__(program)
        self._tolerance, self._order = stepping.tolerance, stepping.scheme.estimate_order
        self._longest = stepping.longest
        self._step = min(program.step, self._longest)
        self._wanted = self._step  # what the error alone would have, up to the nominal step
        self._has_failed = False  # the last step

    def targets(self) -> Floats:
        return self._program.landmarks()

    def end(self, time: float, target: float) -> float:
        remaining = target - time
        pieces = math.ceil(remaining / self._step * (1 - ROUND_OFF))
        if pieces <= 1:
            return target
        # Two like steps to the target rather than a long one and a sliver.
        return time + (remaining / 2 if pieces == 2 else self._step)

    @property
    def too_short(self) -> bool:
        # A step that the error asks for may be as short as it likes: what was not solved tells that there is no way.
        return self._step < max(SMALLEST_CUT * self._wanted, NO_TIME * self._program.step)

    def begin_anew(self) -> None:
        super().begin_anew()
        self._step, self._has_failed = min(self._program.step, self._longest), False

    def failed(self, time_step: float) -> None:
        super().failed(time_step)
        self._step, self._has_failed = FAILED * time_step, True

    def accepts(self, time_step: float, error: float) -> bool:
        self.solved()
        accepted = error <= self._tolerance  # not so where it is not a number
        change = SAFETY * (self._tolerance / error) ** (1 / self._order) if error > 0 else math.inf
        if not math.isfinite(error):
            change = NARROWEST
        # What could not be solved is not tried again at once (Hairer, Nørsett & Wanner, section II.4).
        widest = 1.0 if self._has_failed else WIDEST
        following = time_step * min(max(change, NARROWEST), widest)
        if accepted:
            self.gained(time_step / self._wanted)
            if time_step < self._step:  # a target cut it short: that says nothing against the longer one that was meant
                following = max(following, self._step)
        self._step, self._has_failed = min(following, self._longest), False
        # Also of a step that is short since longer ones could not be solved the error tells how long it might be.
        self._wanted = min(time_step * max(change, NARROWEST), self._longest, self._program.step)
        return accepted

    def memory(self) -> Memory:
        memory = super().memory()
        memory.numbers["step"], memory.numbers["wanted"] = self._step, self._wanted
        memory.numbers["has_failed"] = self._has_failed
        return memory

    def recall(self, memory: Memory) -> None:
        super().recall(memory)
        self._step = memory.numbers["step"]
        self._wanted = memory.numbers.get("wanted", self._program.step)  # in checkpoints of before there is none
        self._has_failed = bool(memory.numbers.get("has_failed", False))
