"""Where a step begins: the unknown continued in time by the polynomial that would have foretold the last one best."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from growthx.common.memory import Memory

if TYPE_CHECKING:
    from mpi4py import MPI

    from growthx.common.arrays import Floats

HIGHEST = 5  # degree


class Prediction:
    """Continues the unknown of the last times by polynomials, of a degree that is chosen anew at each time.

    The error of a polynomial through k + 1 times grows with the product of the distances from them: its last one tells
    the next one, as in codes with backward differences.  Over that product it is the divided difference of the next
    order, of the new time and those the polynomial goes through.
    """

    def __init__(self, comm: MPI.Intracomm) -> None:
        self._comm = comm
        self._known: list[tuple[float, Floats]] = []  # times and unknowns, the last one last
        self._differences: list[Floats] = []  # divided ones of the last time and as many before it as their order
        self._errors: list[float] = []  # of each degree at the last time, per product of distances

    def restart(self) -> None:
        """Forget all but the last time: nothing goes on as it went."""
        del self._known[:-1]
        self._begin_differences()
        self._errors = []

    def remember(self, time: float, unknown: Floats) -> None:
        """The unknown at a time; one at the last time takes its place."""
        if self._known and self._known[-1][0] == time:
            del self._known[-1]
            self._begin_differences()
        squares = np.array([float(each @ each) for each in self._add(time, unknown)])
        self._errors = [float(np.sqrt(square)) for square in self._comm.allreduce(squares)]
        self._known = [*self._known, (time, unknown)][-HIGHEST - 1 :]
        del self._differences[HIGHEST + 1 :]

    def memory(self) -> Memory:
        """The times and unknowns that it knows, and how well each degree did."""
        numbers = {"foretold_from": [time for time, _ in self._known], "degrees": [float(e) for e in self._errors]}
        return Memory(numbers, {f"known_{place}": unknown for place, (_, unknown) in enumerate(self._known)})

    def recall(self, memory: Memory) -> None:
        """Know again what was known."""
        times = memory.numbers["foretold_from"]
        self._known = [(time, memory.unknowns[f"known_{place}"].copy()) for place, time in enumerate(times)]
        self._begin_differences()
        self._errors = memory.numbers["degrees"]

    def at(self, time: float) -> Floats | None:
        """The unknown foretold for a time after the last one; None if that is what it was there."""
        if len(self._known) < 2:
            return None
        if len(self._known) == 2:  # no line has been tried yet
            return self._polynomial(time, 1)
        best = min(range(len(self._errors)), key=lambda degree: self._errors[degree] * self._distances(time, degree))
        return self._polynomial(time, best) if best > 0 else None

    def _begin_differences(self) -> None:
        """Those of what is known."""
        known, self._known, self._differences = self._known, [], []
        for time, unknown in known:
            self._add(time, unknown)
            self._known.append((time, unknown))

    def _add(self, time: float, unknown: Floats) -> list[Floats]:
        """Go on to the differences of a new last time; those of the first order and higher."""
        differences = [unknown]
        for order, (former, (known, _)) in enumerate(zip(self._differences, reversed(self._known), strict=True)):
            # What is known itself is kept, and has memory of its own.
            difference = np.subtract(differences[-1], former, out=former if order else None)
            difference /= time - known
            differences.append(difference)
        self._differences = differences
        return differences[1:]

    def _distances(self, time: float, degree: int) -> float:
        return float(np.prod([abs(time - known) for known, _ in self._known[len(self._known) - degree - 1 :]]))

    def _polynomial(self, time: float, degree: int) -> Floats:
        """Newton's polynomial: what stood still stays, to the bit."""
        value, distances = self._known[-1][1].copy(), 1.0
        for difference, (known, _) in zip(self._differences[1 : degree + 1], reversed(self._known), strict=False):
            distances *= time - known
            value += distances * difference
        return value
