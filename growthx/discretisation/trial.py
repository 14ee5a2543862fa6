"""A made-up state in place of the running one, for a while: what the balances make of it tells what they are."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

    from growthx.common.arrays import Floats
    from growthx.discretisation.system import System

SHARE = 0.7  # of all that is scaled
OLD = 0.9  # density at the start of the step, of that at its end


def set_iterate(system: System, displacements: Sequence[Floats], density: Floats) -> None:
    """Make displacements of the load cases and a density, as in `x.array`, the running iterate."""
    whole = system.unknown.x.array.copy()
    for part, values in zip(system.unknowns.parts, displacements, strict=True):
        whole[part] = values
    system.start_from(whole)
    system.densities.set_iterate(density)


@contextmanager
def trial(system: System, displacements: Sequence[Floats], density: Floats) -> Iterator[None]:
    """Within, displacements of the load cases and a density, as in `x.array`, are the running iterate.

    All else that the residuals depend on follows from these; afterwards everything is as before.
    """
    state = system.state
    constants = [state.time_step, state.share, *system.densities.constants, *(share for _, share in state.timed_shares)]
    functions = [system.unknown, state.density, state.old_density, *state.motion]
    functions += [] if state.past is None else [state.past]
    kept = [constant.value.copy() for constant in constants], [function.x.array.copy() for function in functions]
    try:
        for constant in constants[1:]:
            constant.value = SHARE
        state.time_step.value = system.spaces.scene.program.step
        state.density.x.array[:] = density
        set_iterate(system, displacements, density)
        state.old_density.x.array[:] = OLD * density
        for number, motion in enumerate(state.motion, start=2):
            motion.x.array[:] = displacements[0] / number
        if state.past is not None:
            state.past.x.array[:] = state.first_past
        yield
    finally:
        for constant, value in zip(constants, kept[0], strict=True):
            constant.value = value
        for function, values in zip(functions, kept[1], strict=True):
            function.x.array[:] = values
