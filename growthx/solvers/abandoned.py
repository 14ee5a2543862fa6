"""Solvers that were left on the way: by `break`, or by an exception, which one rank may have met alone.

What ranks share they free together.  One that frees it while an exception unwinds waits for the others, which do not
come: its exception would never be heard of.  So on several ranks what is left stays until all of them meet again.
"""

from __future__ import annotations

import gc
from collections import Counter
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from collections.abc import Iterator

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


@contextmanager
def garbage_waits() -> Iterator[None]:
    """Collect no garbage meanwhile, while PETSc calls us.

    An exception of ours is on its way through PETSc for a while, and PETSc's objects that are freed just then take it
    away: petsc4py, which adds where it has been to it, then ends the program by a segmentation fault.
    """
    collects = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collects:
            gc.enable()
