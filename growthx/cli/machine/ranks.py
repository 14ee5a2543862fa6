"""Who speaks, where MPI itself may be what is missing."""

from __future__ import annotations


def first_rank() -> bool:
    """Whether this is rank 0, or a program without MPI."""
    try:
        from mpi4py import MPI
    except (ImportError, RuntimeError):
        return True
    return MPI.COMM_WORLD.rank == 0
