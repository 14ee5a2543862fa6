"""Solvers that were left on the way: by `break`, or by an exception, which one rank may have met alone.

What ranks share they free together.  One that frees it while an exception unwinds waits for the others, which do not
come: its exception would never be heard of.  So on several ranks what is left stays until all of them meet again.
"""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from mpi4py import MPI


class Solver(Protocol):
    """What can be left: made for a problem, and known by a number on all of its ranks."""

    problem: Any
    number: int

    def destroy(self) -> None:
        """Free what it has (collective)."""


_made: Counter[int] = Counter()  # solvers on each communicator: the same number on all its ranks
_left: list[Solver] = []


def number(comm: MPI.Intracomm) -> int:
    """By which a solver that is being made is known on all ranks (collective)."""
    _made[comm.py2f()] += 1
    return _made[comm.py2f()]


def leave(solver: Solver) -> None:
    """Have a solver freed: at once on one rank, on several by `free`; any of them may call this alone."""
    if solver.problem.comm.size == 1:
        solver.destroy()
    else:
        _left.append(solver)


def free(comm: MPI.Intracomm) -> None:
    """Free the solvers that all ranks have left (collective)."""
    if comm.size == 1:
        return
    here = {solver.number: solver for solver in _left if solver.problem.comm == comm}
    for known in sorted(set.intersection(*comm.allgather(set(here)))):
        _left.remove(here[known])
        here[known].destroy()
