"""What a program uses of its machine."""

from __future__ import annotations

import math
import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mpi4py import MPI


def peak_memory(comm: MPI.Comm) -> float:
    """The most memory that each process has had so far, of all together (MB, collective); NaN where none can say."""
    try:
        import resource  # not on every system
    except ImportError:
        own = math.nan
    else:
        unit = 1e-6 if sys.platform == "darwin" else 1024e-6  # bytes there, KiB elsewhere
        own = unit * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return float(comm.allreduce(own))
