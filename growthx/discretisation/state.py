"""All that a step changes: what the weak forms refer to, and what of it was accepted."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import dolfinx
import numpy as np

from growthx.common.memory import Memory
from growthx.model.actions.histories import History, share_at

if TYPE_CHECKING:
    from collections.abc import Sequence

    from growthx.common.arrays import Floats
    from growthx.discretisation.spaces import Spaces
    from growthx.discretisation.start import Start
    from growthx.model.open_loads import OpenLoad


@dataclass(frozen=True)
class Way:
    """How far the loads of a step have gone from where it began: shares of histories are between both ends."""

    start: float  # time
    part: float  # from 0 to 1

    def share(self, history: History, end: float) -> float:
        """Of a history, on the way to the end of the step."""
        share = share_at(history, end)
        return share if self.part == 1.0 else self.part * share + (1.0 - self.part) * share_at(history, self.start)


WHOLE = Way(0.0, 1.0)


class State:
    """Displacements and density at the end of the last accepted step, and the numbers of the step that is running.

    displacements: of the load cases; displacement: their weighted mean, for pictures.
    density: where it is an unknown, the accepted one; else that of the running iterate.  accepted_density: as in
    `density.x.array`.  old_density: what a step of implicit Euler begins with.
    time_step, share: of the running step, its length and the share of the loads that grow with the program, constants
    of the forms; amplitude and time as numbers.
    way: how much of its loads the running step has so far.  timed_shares: of open loads with a history of their own.
    motion: with inertia, displacement and velocity at the start of the step.
    """

    def __init__(self, spaces: Spaces, start: Start) -> None:
        domain, V = spaces.scene.mesh.domain, spaces.displacement_space
        self._spaces = spaces
        self.displacements, self.displacement = start.displacements, start.displacement
        self.density, self.old_density = start.density, start.old_density
        self.resting_density, self._at_rest = start.resting, start.at_nodes
        self.accepted_density: Floats = self.density.x.array.copy()
        self.time_step = dolfinx.fem.Constant(domain, np.float64(spaces.scene.program.step))
        self.share = dolfinx.fem.Constant(domain, np.float64(0.0))
        self.motion = [] if spaces.scene.inertia is None else [dolfinx.fem.Function(V), dolfinx.fem.Function(V)]
        self.time, self.amplitude = 0.0, 0.0
        self.past: dolfinx.fem.Function | None = None  # of a law with a memory: what it has become used to
        self.first_past: Floats | None = None
        self.way = WHOLE
        self.timed_shares: list[tuple[OpenLoad, dolfinx.fem.Constant]] = [
            (load, dolfinx.fem.Constant(domain, np.float64(0.0)))
            for load in spaces.scene.open_loads
            if load.history is not None
        ]
        self._accepted_at = (float(self.time_step.value), self.amplitude, self.time)

    def begin(
        self, time_step: float, amplitude: float, time: float, base: Floats | None = None, way: Way = WHOLE
    ) -> None:
        """Set the length, load and end of a step; base: densities it begins with, by default the accepted ones."""
        self._set_program(time_step, amplitude, time, way)
        self.old_density.x.array[:] = self.accepted_density if base is None else base

    def _set_program(self, time_step: float, amplitude: float, time: float, way: Way = WHOLE) -> None:
        self.time_step.value, self.amplitude, self.time, self.way = time_step, amplitude, time, way
        self.share.value = amplitude
        for load, share in self.timed_shares:
            share.value = self.share_now(load.history)

    def share_now(self, history: History | None) -> float:
        """The share of what follows a history, or the program's ramp, at the end of the running step or on the way."""
        return self.amplitude if history is None else self.way.share(history, self.time)

    def share_of(self, load: OpenLoad) -> Any:
        """The factor of a load that depends on the state, in UFL."""
        if load.history is not None:
            return next(share for timed, share in self.timed_shares if timed is load)
        return self.share if load.ramped else 1.0

    def accept(self, displacements: Sequence[Floats], density: Floats) -> None:
        """Make displacements of the load cases and a density, as in `x.array`, those of the state."""
        self._accepted_at = (float(self.time_step.value), self.amplitude, self.time)
        if self.motion:
            (old, velocity), now = (function.x.array for function in self.motion), displacements[0]
            velocity[:] = (now - old) / float(self.time_step.value)
            old[:] = now
        for u, values in zip(self.displacements, displacements, strict=True):
            u.x.array[:] = values
        if len(self.displacements) > 1:
            self.displacement.x.array[:] = sum(
                case.weight * u.x.array for case, u in zip(self._spaces.cases, self.displacements, strict=True)
            )
        self.set_density(density)

    def reject(self) -> None:
        """Go back to the numbers and the density of the last accepted step."""
        self._set_program(*self._accepted_at)
        self.density.x.array[:] = self.accepted_density

    def set_density(self, density: Floats) -> None:
        """Make a density, as in `x.array`, that of the state, at the displacement it has."""
        self.density.x.array[:] = self.accepted_density[:] = density

    def set_past(self, past: Floats) -> None:
        """Make values of this rank's growing densities what a law has become used to (collective)."""
        assert self.past is not None
        self.past.x.array[self._spaces.growing_dofs] = past
        self.past.x.scatter_forward()

    @property
    def elapsed(self) -> float:
        """Time since the last accepted step."""
        return self.time - self._accepted_at[2]

    def densities_of_cells(self) -> Floats:
        """Densities of each owned cell, shape (owned cells, densities of a cell); at rest, its own at shared nodes."""
        spaces = self._spaces
        of_cells = spaces.density_space.dofmap.list[: len(spaces.scene.mesh.owned_cells)]
        densities = np.asarray(self.density.x.array[of_cells])
        if self._at_rest is not None:
            densities[spaces.resting_cells] = self._at_rest
        return densities

    def memory(self) -> Memory:
        """The state, copied."""
        memory = Memory(densities={"density": self.accepted_density.copy()})
        if self.past is not None:
            memory.densities["past"] = self.past.x.array.copy()
        memory.numbers.update(amplitude=self.amplitude, time=self.time, time_step=float(self.time_step.value))
        for name, function in zip(("old_displacement", "old_velocity"), self.motion, strict=False):
            memory.displacements[name] = function.x.array.copy()
        return memory

    def recall(self, memory: Memory, displacements: Sequence[Floats]) -> None:
        """Make a state that was remembered the state, with these displacements."""
        numbers = memory.numbers
        self._set_program(numbers["time_step"], numbers["amplitude"], numbers["time"])
        self.accept(displacements, memory.densities["density"])
        self.old_density.x.array[:] = self.accepted_density
        if self.past is not None:
            self.past.x.array[:] = memory.densities["past"]
        for name, function in zip(("old_displacement", "old_velocity"), self.motion, strict=False):
            function.x.array[:] = memory.displacements[name]
