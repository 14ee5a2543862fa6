"""Where an iteration has nothing more to gain: at the round-off of its residual, or where the residual stagnates."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from mpi4py import MPI

    from growthx.common.arrays import Floats

SLOW = 0.5  # a step that leaves more than this of the residual asks for a look
PATIENCE = 8  # steps in which a residual must halve


class RoundOff:
    """The round-off of a residual: the norm of what changes in it when each unknown changes in its last place.

    An unknown is known to no more than that, and a residual is a sum of the forces of cells, each of them stiffness
    times differences of unknowns: fine meshes, slivers, stiff parts and large motions at small strains all make those
    forces large beside their sum.  The signs of the changes are random, as those of round-off are.
    """

    def __init__(self, residual: Callable[[Floats], Floats], below: float, comm: MPI.Intracomm) -> None:
        """residual: of the owned unknowns, its owned entries (collective).

        below: norm of a residual from which on its round-off is looked for.
        """
        self._residual, self._below, self._comm = residual, below, comm

    def may_be_reached(self, before: float, norm: float) -> bool:
        """Whether there is reason to look: the residual is small, and the last step has gained little."""
        return norm <= self._below and not norm <= SLOW * before

    def norm(self, position: Floats, residual: Floats) -> float:
        """At a position with its residual, at the cost of another residual; zero where it is not a number."""
        signs = 2.0 * np.random.default_rng(self._comm.rank).integers(0, 2, len(position)) - 1.0
        changed = self._residual(position * (1.0 + np.finfo(float).eps * signs)) - residual
        square = self._comm.allreduce(float(changed @ changed))
        return math.sqrt(square) if math.isfinite(square) else 0.0


def stagnates(norms: Sequence[float]) -> bool:
    """Whether the residual has not halved in the last steps."""
    return len(norms) > PATIENCE and not norms[-1] <= norms[-1 - PATIENCE] / 2
