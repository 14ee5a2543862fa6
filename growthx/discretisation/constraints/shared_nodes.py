"""Nodes that two supports hold in one direction: they must agree, since a node has one displacement."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING, Protocol

import numpy as np

from growthx.common.errors import InputError, raise_on_all
from growthx.model.actions.histories import share_at

if TYPE_CHECKING:
    from collections.abc import Sequence

    from mpi4py import MPI

    from growthx.common.arrays import Floats, Indices
    from growthx.model.actions.histories import History
    from growthx.model.program import Program

LOOKED_AT = 100  # times
ALIKE = 1e-9  # of the largest displacement that is prescribed


class Holding(Protocol):
    """One direction of a support, with the unknowns that it holds and where it moves them."""

    @property
    def boundary(self) -> str:
        """Its name."""
        ...

    @property
    def direction(self) -> int:
        """Of the displacement, from 0."""
        ...

    @property
    def dofs(self) -> Indices:
        """The unknowns, ghosts included."""
        ...

    @property
    def history(self) -> History | None:
        """What it follows in place of the program's ramp."""
        ...

    def at(self, share: float) -> Floats:
        """The unknowns at a share of the load, shape (dofs,)."""
        ...


def refuse_conflicts(held: Sequence[Holding], timetable: Program, comm: MPI.Comm) -> None:
    """Raise InputError where two supports hold an unknown at two displacements at any time looked at (collective)."""
    times = timetable.times()
    times = times[:: math.ceil(len(times) / LOOKED_AT)]
    problem = ""
    found, counts = np.unique(
        np.concatenate([np.empty(0, np.int32), *(each.dofs for each in held)]), return_counts=True
    )
    both = found[counts > 1]
    try:
        for one, other in itertools.combinations([each for each in held if np.isin(each.dofs, both).any()], 2):
            problem = problem or _conflict(one, other, times, timetable)
    except InputError as error:  # of a history, on a rank with such nodes alone
        problem = str(error)
    raise_on_all(comm, problem)


def _conflict(one: Holding, other: Holding, times: Floats, timetable: Program) -> str:
    """What is wrong with two, or nothing."""
    _, of_one, of_other = np.intersect1d(one.dofs, other.dofs, return_indices=True)
    if not len(of_one):
        return ""
    for time in map(float, times):
        shares = [
            timetable.amplitude(time) if each.history is None else share_at(each.history, time) for each in (one, other)
        ]
        first, second = one.at(shares[0]), other.at(shares[1])
        apart = np.abs(first[of_one] - second[of_other])
        worst = int(apart.argmax())
        if apart[worst] > ALIKE * max(np.abs(first).max(), np.abs(second).max()):
            return (
                f"the supports '{one.boundary}' and '{other.boundary}' share nodes, and hold them along "
                f"{'xyz'[one.direction]} at {first[of_one][worst]:.6g} and {second[of_other][worst]:.6g} at "
                f"t = {time:g}: one displacement, or a direction that one of them leaves free, would be right"
            )
    return ""
