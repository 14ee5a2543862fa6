"""Communicators that Python may talk on: of the ranks of a mesh, and never freed.

mpi4py 4.0.3 hangs a lock on each communicator on which a lower-case (pickling) call is made.  Under Python 3.13 it
waits for ever if such a communicator is freed while an exception is on its way: so it would be with the duplicate that
DOLFINx makes for each mesh and frees with it.
"""

from __future__ import annotations

import zlib
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI

from growthx.common.errors import InputError, shown

if TYPE_CHECKING:
    from numpy.typing import NDArray

_SAME = (MPI.IDENT, MPI.CONGRUENT)
_kept: list[MPI.Intracomm] = []  # one for each set of ranks other than those MPI knows by itself


def steady(comm: MPI.Comm) -> MPI.Intracomm:
    """A communicator of the same ranks in the same order, which lives as long as the program (collective).

    Raises InputError for what is no communicator of ranks among which this one is.
    """
    if not isinstance(comm, MPI.Intracomm) or not comm:
        what = "MPI.COMM_NULL" if isinstance(comm, MPI.Comm) and not comm else shown(comm)
        raise InputError(f"the communicator is {what}: one that this rank is in, as MPI.COMM_WORLD, would be right")
    for known in (MPI.COMM_WORLD, MPI.COMM_SELF, *_kept):
        if MPI.Comm.Compare(known, comm) in _SAME:
            return known
    _kept.append(MPI.Intracomm(comm.Dup()))
    return _kept[-1]


def same_on_all(values: NDArray[Any], comm: MPI.Comm) -> bool:
    """Whether an array is the same on all ranks, by its checksum (collective)."""
    told = values.shape, values.dtype.str, zlib.crc32(np.ascontiguousarray(values).tobytes())
    return comm.size == 1 or len(set(comm.allgather(told))) == 1
