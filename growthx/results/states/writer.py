"""States written twice: with what people look for, and exactly as the variant knows them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from growthx.results.fields import FieldWriter
from growthx.results.raw import raw_writer

if TYPE_CHECKING:
    from pathlib import Path

    from growthx.discretisation.discretisation import Discretisation


class StateWriter:
    """Writes states, one after another in time, to `fields.pvd` and `raw.pvd`."""

    def __init__(self, folder: Path, problem: Discretisation, until: float | None = None) -> None:
        """until: go on with the states up to this time of files that are there; None: there are to be none."""
        self._fields = FieldWriter(folder, problem, until)
        self._raw = raw_writer(folder, problem, until)

    @property
    def last(self) -> float | None:
        """The time of the last state, None if there is none."""
        return self._fields.last

    def write(self, time: float) -> None:
        """Append the state as it is; OutputError, on all ranks, if it does not become whole."""
        self._fields.write(time)
        self._raw.write(time)

    def close(self) -> None:
        """Finish the files."""
        self._fields.close()
        self._raw.close()
