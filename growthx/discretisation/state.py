"""All that a step changes: what the weak forms refer to, and what of it was accepted."""

from __future__ import annotations

from typing import TYPE_CHECKING

import dolfinx
import numpy as np

from growthx.common.memory import Memory

if TYPE_CHECKING:
    from collections.abc import Sequence

    from growthx.common.arrays import Floats
    from growthx.discretisation.spaces import Spaces
    from growthx.discretisation.start import Start


class State:
    """Displacements and density at the end of the last accepted step, and the numbers of the step that is running.

    displacements: of the load cases; displacement: their weighted mean, for pictures.
    density: where it is an unknown, the accepted one; else that of the running iterate.  accepted_density: as in
    `density.x.array`.  old_density: what a step of implicit Euler begins with.
    time_step, share: of the running step, its length and the share of the loads that grow with the program, constants
    of the forms; amplitude and time as numbers.
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
        self._accepted_at = (float(self.time_step.value), self.amplitude, self.time)

    def begin(self, time_step: float, amplitude: float, time: float, base: Floats | None = None) -> None:
        """Set the length, load and end of a step; base: densities it begins with, by default the accepted ones."""
        self._set_program(time_step, amplitude, time)
        self.old_density.x.array[:] = self.accepted_density if base is None else base

    def _set_program(self, time_step: float, amplitude: float, time: float) -> None:
        self.time_step.value, self.amplitude, self.time = time_step, amplitude, time
        self.share.value = amplitude

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
