"""States written twice: with what people look for, and exactly as the variant knows them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from growthx.post.derived import chosen_fields
from growthx.results.fields import FieldWriter, tells_raw
from growthx.results.raw import TwinWriter, raw_writer
from growthx.results.states.chosen import makers

if TYPE_CHECKING:
    from pathlib import Path

    from growthx.discretisation.discretisation import Discretisation
    from growthx.results.series import Keeping


class StateWriter:
    """Writes states, one after another in time, to the series of the usual fields, or of chosen ones."""

    def __init__(self, folder: Path, problem: Discretisation, keeping: Keeping | None = None) -> None:
        """keeping: how the series are kept; None: as `Keeping()`."""
        choice = None if keeping is None else chosen_fields(keeping.fields)
        if choice is None:
            self._writers = _usual(folder, problem, keeping)
        else:
            self._writers = [make(folder, problem, keeping) for make in makers(choice)]

    @property
    def last(self) -> float | None:
        """The time of the last state that is in all series, None if there is none."""
        found = [writer.last for writer in self._writers]
        return None if None in found else min(found)

    def write(self, time: float) -> None:
        """Append the state as it is, where it is not yet; OutputError, on all ranks, if it does not become whole."""
        for writer in self._writers:
            if writer.last != time:
                writer.write(time)

    def close(self) -> None:
        """Finish the files."""
        for writer in self._writers:
            writer.close()


def _usual(folder: Path, problem: Discretisation, keeping: Keeping | None) -> list[Any]:
    """What people look for, and what is exactly as the variant knows it: in one file, where that has both."""
    fields = FieldWriter(folder, problem, keeping)
    if tells_raw(problem):
        return [fields, TwinWriter(fields, folder, problem, keeping)]
    return [fields, raw_writer(folder, problem, keeping)]
