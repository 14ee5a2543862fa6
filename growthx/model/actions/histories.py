"""Shares of loads and of prescribed displacements through time: tables, from arrays or files, and functions."""

from __future__ import annotations

import itertools
import math
import os
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from growthx.common.checks import require_function, require_kind, require_number, require_path
from growthx.common.errors import InputError, raise_on_all, shown
from growthx.common.overrides import Sealed

if TYPE_CHECKING:
    from mpi4py import MPI

    from growthx.common.arrays import Floats
    from growthx.model.program import Program

History = Callable[[float], float]
LOOKED_AT = 1000  # times at which the peak of a load's history is looked for
SAME_TIME = 1e-9  # of the larger of two times: nearer ones are one


@dataclass(frozen=True)
class Table(Sealed, replaceable=()):
    """A history of rows (time, share), linear between them; before the first and after the last row it stays.

    Two rows of one time are a jump, from the share of the first to that of the second: a step ends there, with the
    share before it, and the next one begins with the share after it.

    Example:
        >>> steps = gx.Table(((0.0, 0.0), (1.0, 1.0), (2.0, 1.0), (2.0, 0.5)))
        >>> steps(0.25), steps(2.0), steps(3.0), steps.jumps
        (0.25, 1.0, 0.5, (2.0,))
    """

    rows: tuple[tuple[float, float], ...]

    def __post_init__(self) -> None:
        require_kind(self.rows, (tuple, list, np.ndarray), "a table of a history", "rows (time, share)")
        rows = tuple(_row(row, number) for number, row in enumerate(self.rows, start=1))
        object.__setattr__(self, "rows", rows)
        if not rows:
            raise InputError("a table of a history has no rows: one (time, share) at least would be right")
        for number, (before, after) in enumerate(itertools.pairwise(rows), start=2):
            if after[0] < before[0]:
                raise InputError(
                    f"row {number} of a table of a history has t = {after[0]:g} after t = {before[0]:g}: times that do "
                    "not fall would be right"
                )
            if number > 2 and rows[number - 3][0] == before[0] == after[0]:
                raise InputError(
                    f"a table of a history has three rows of t = {after[0]:g}: one, or two for a jump, would be right"
                )

    @classmethod
    def steps(cls, rows: Iterable[tuple[float, float]]) -> Table:
        """A history that jumps to each share at its time and keeps it until the next; before the first it is zero."""
        given = [_row(row, number) for number, row in enumerate(rows, start=1)]
        before = [0.0, *(share for _, share in given[:-1])]
        return cls(
            tuple(row for (time, share), old in zip(given, before, strict=True) for row in ((time, old), (time, share)))
        )

    @classmethod
    def read(cls, path: str | os.PathLike[str], comm: MPI.Comm | None = None) -> Table:
        """The table of a file of two columns, time and share, split by commas, semicolons or blanks (collective).

        Its first line may name the columns; lines that begin with # say nothing.  InputError, on all ranks, for a file
        that is none such.
        """
        from mpi4py import MPI

        from growthx.common.communicators import steady

        require_path(path, "the file of a history")
        comm = steady(comm or MPI.COMM_WORLD)
        rows, problem = [], ""
        if comm.rank == 0:
            try:
                rows = _rows_of(Path(path))
                cls(tuple(rows))
            except InputError as error:
                problem = str(error) if str(path) in str(error) else f"{path}: {error}"
        raise_on_all(comm, problem)
        return cls(tuple(comm.bcast(rows)))

    def __call__(self, time: float) -> float:
        """The share at a time; at a jump, that before it."""
        times, shares = self._columns()
        at = int(np.searchsorted(times, time - SAME_TIME * abs(time), side="left"))
        if at == 0:
            return float(shares[0])
        if at == len(times):
            return float(shares[-1])
        (low, high), (start, end) = times[at - 1 : at + 1], shares[at - 1 : at + 1]
        if time >= high * (1 - SAME_TIME):
            return float(end)
        return float(start + (end - start) * max(time - low, 0.0) / (high - low))

    @property
    def jumps(self) -> tuple[float, ...]:
        """Times at which it jumps."""
        times, shares = self._columns()
        return tuple(times[1:][(np.diff(times) == 0.0) & (np.diff(shares) != 0.0)].tolist())

    @property
    def peak(self) -> float:
        """The largest size of its shares."""
        return float(np.abs(self._columns()[1]).max())

    def _columns(self) -> tuple[Floats, Floats]:
        found = np.array(self.rows)
        return found[:, 0], found[:, 1]


def _row(row: Any, number: int) -> tuple[float, float]:
    if not isinstance(row, (tuple, list, np.ndarray)) or np.shape(row) != (2,):
        raise InputError(f"row {number} of a table of a history is {shown(row)}: (time, share) would be right")
    for value, what in zip(row, ("time", "share"), strict=True):
        require_number(value, f"the {what} in row {number} of a table of a history", "a finite number", lambda _: True)
    return float(row[0]), float(row[1])


def _rows_of(path: Path) -> list[tuple[float, float]]:
    """The rows of a file; InputError if it has others."""
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "it is no text"
        raise InputError(
            f"the history {path} cannot be read ({reason}): a file of two columns would be right"
        ) from None
    rows: list[tuple[float, float]] = []
    named = False
    for number, line in enumerate(lines, start=1):
        text = line.strip()
        if not text or text.startswith("#"):
            continue
        words = [word for word in text.replace(";", " ").replace(",", " ").split() if word]
        numbers = [value for word in words if (value := _number(word)) is not None]
        if len(words) == len(numbers) == 2:
            rows.append((numbers[0], numbers[1]))
        elif rows or named or len(words) == len(numbers):
            raise InputError(
                f"line {number} of the history {path} is {shown(text)}: two numbers, time and share, with a point "
                "before decimals, would be right"
            )
        else:
            named = True  # the names of the columns
    return rows


def _number(word: str) -> float | None:
    try:
        return float(word)
    except ValueError:
        return None


def check_history(history: Any, what: str) -> None:
    """Refuse what is neither None nor a function of time."""
    if history is not None:
        require_function(history, f"the history of {what}", "a function of time or a Table")


def share_at(history: History, time: float) -> float:
    """The share at a time; InputError if it is not a finite number."""
    share = history(time)
    require_number(share, f"the history of a load at t = {time:g}", "a finite number", lambda _: True)
    return float(share)


def jumps_of(histories: Iterable[History | None], until: float) -> tuple[float, ...]:
    """Times after the start and before an end at which any of some histories jumps, each once."""
    found = {time for history in histories if isinstance(history, Table) for time in history.jumps}
    return tuple(sorted(time for time in found if 0 < time < until))


def peak_of(history: History | None, timetable: Program) -> float:
    """The largest size of a history's shares, looked for at a thousand times of a program; of its ramp, one."""
    if history is None:
        return 1.0
    times = timetable.times()
    return max(abs(share_at(history, float(time))) for time in times[:: math.ceil(len(times) / LOOKED_AT)])
