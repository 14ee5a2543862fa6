"""Nodal densities kept positive in a march: where one would vanish, the balance of mass is lumped about its node.

Only in a model that is well posed, m > n, and only once a step has failed for it however short it was made; from then
on, a step is solved as ever first.  Nodes are lumped until their density has recovered.  Ever more seldom, after 2, 4,
8, … steps, one is solved without, to see whether that is still needed: not if no density falls by half.
"""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

import numpy as np
from mpi4py import MPI

from growthx.common.memory import Memory

if TYPE_CHECKING:
    from growthx.common.arrays import Floats
    from growthx.discretisation.discretisation import Discretisation


class Positivity:
    """Of one march.

    wanted: whether steps may be lumped; not before one has failed.
    """

    def __init__(self, problem: Discretisation) -> None:
        self._problem, self._densities = problem, problem.system.densities
        self.wanted = False
        self._lumped_for = 0  # steps that began so
        self._accepted: Floats = np.zeros(0)  # what was lumped in the last accepted step

    @property
    def cells(self) -> int:
        """Number of cells, on all ranks, in which the balance of mass is lumped."""
        return 0 if self._densities.lumped is None else self._densities.lumped.cells

    def is_lost(self) -> bool:
        """Whether densities vanish at the running iterate that lumping may save (collective)."""
        lost = bool(np.any(self._densities.vanishing()))
        return self._problem.comm.allreduce(lost, MPI.LOR) and self._problem.system.must_be_stable

    def begin(self, time: float) -> bool:
        """Keep densities positive from a time on, since a step has failed for them; whether that is new."""
        if self.wanted:
            return False
        self.wanted = True
        if self._problem.comm.rank == 0:
            logging.getLogger("growthx").warning(
                "growthx: at t = %g a nodal density vanishes in steps however short: from here on the balance of mass "
                "is lumped about such nodes, in as many cells as each step tells (lumped_cells)",
                time,
            )
        return True

    def spread(self) -> bool:
        """Lump about the densities that vanish at the running iterate; whether about more than before (collective)."""
        lumped = self._densities.lumped
        return self.wanted and lumped is not None and lumped.spread(self._densities.vanishing())

    def begin_step(self) -> None:
        """Lump no more where densities have recovered, or for a trial nowhere (collective)."""
        lumped = self._densities.lumped
        if not self.wanted or lumped is None:
            return
        begins_lumped = lumped.cells > 0
        lumped.release(self._problem.state.accepted_density)
        self._lumped_for += begins_lumped
        if begins_lumped and self._lumped_for > 1 and self._lumped_for.bit_count() == 1:
            lumped.try_without()

    def accept(self) -> None:
        """Remember what was lumped in a step that is accepted."""
        if self.wanted and self._densities.lumped is not None:
            self._accepted = self._densities.lumped.memory()

    def take_back(self) -> None:
        """Lump what was lumped in the last accepted step (collective)."""
        if self.wanted and self._densities.lumped is not None:
            self._densities.lumped.recall(self._accepted)

    def memory(self) -> Memory:
        """What it has learnt; nothing as long as nothing was lost."""
        memory = Memory()
        if self.wanted:
            memory.numbers["lumped_for"] = self._lumped_for
        if self._densities.lumped is not None and self.cells:
            memory.densities["lumped"] = self._densities.lumped.memory()
        return memory

    def recall(self, memory: Memory) -> None:
        """Know that again (collective)."""
        self.wanted = "lumped_for" in memory.numbers
        self._lumped_for = memory.numbers.get("lumped_for", 0)
        if self._densities.lumped is not None:
            self._accepted = memory.densities.get("lumped", np.zeros(0))
            self._densities.lumped.recall(self._accepted)
