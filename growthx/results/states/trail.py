"""What a run leaves on its way, before it is at its end: its history, and the states that were asked for."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

from growthx.common.errors import OutputError
from growthx.results.density import write_density
from growthx.results.history import History
from growthx.results.series import Keeping, agreed
from growthx.results.states.writer import StateWriter
from growthx.results.writing import write

if TYPE_CHECKING:
    from pathlib import Path

    from growthx.results.plan import Plan
    from growthx.stepping.record import Result


class Trail:
    """The files of a run on its way in the folder of a plan; without one, there are none.

    What cannot be written on the way is missed with a warning: the run may still come to its end.
    """

    def __init__(self, places: Plan, result: Result) -> None:
        self._places, self._result, self._comm = places, result, result.problem.comm
        self._history = None if places.folder is None else History(places.folder, ours=places.goes_on)
        self._states: StateWriter | None = None

    def begin(self) -> None:
        """Begin where the result is, and keep the start where it is asked for (collective)."""
        places, result = self._places, self._result
        if places.folder is None or self._history is None:
            return
        if places.goes_on and result.steps:
            self._history.add(result)
        there = places.goes_on and self._comm.bcast(
            any(places.folder.glob("*.pvd")) or any(places.folder.glob("*.vtkhdf"))
        )
        if places.states or there:
            until = result.time if places.goes_on else None
            self._states = StateWriter(places.folder, result.problem, Keeping(until, places.vtkhdf, places.fields))
            if places.states.start and self._states.last is None:
                self._keep()

    def add(self) -> None:
        """Keep the history of the last step, and its state if it is due (collective)."""
        result = self._result
        if self._history is not None:
            self._history.add(result)
        if self._states is not None and self._places.states.is_due(len(result.steps), result.time):
            self._keep()

    def end(self, folder: Path) -> None:
        """Write the last state, with its density, to a folder (collective); OutputError if it cannot be."""
        result, history = self._result, self._history if folder == self._places.folder else None
        whole = self._comm.bcast(history is not None and history.is_whole(result))
        if self._states is None or folder != self._places.folder:
            write(
                folder,
                result,
                with_density=True,
                with_history=not whole,
                vtkhdf=self._places.vtkhdf,
                fields=self._places.fields,
            )
            return
        if self._states.last != result.time:
            self._states.write(result.time)
        self.close()
        with agreed(folder, self._comm):
            if history is not None and not whole:
                history.complete(result)
            write_density(folder, result.problem)

    def close(self) -> None:
        """Leave the files as they are (collective)."""
        if self._states is not None:
            self._states.close()

    def _keep(self) -> None:
        assert self._states is not None
        try:
            self._states.write(self._result.time)
        except OutputError as error:
            if self._comm.rank == 0:
                logging.getLogger("growthx").warning("growthx: %s; the run goes on", error)
