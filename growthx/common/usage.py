"""What a program uses of its machine."""

from __future__ import annotations

import math
import sys
import time
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mpi4py import MPI


def spent(since: float, comm: MPI.Intracomm) -> tuple[float, float]:
    """Seconds since a time of `time.perf_counter`, and the most memory so far (MB), the same on all ranks (collective).

    Of memory, what each process has had at most, of all together; NaN where the system cannot say.
    """
    try:
        import resource  # not on every system
    except ImportError:
        own = math.nan
    else:
        unit = 1e-6 if sys.platform == "darwin" else 1024e-6  # bytes there, KiB elsewhere
        own = unit * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    walls, memories = zip(*comm.allgather((time.perf_counter() - since, own)), strict=True)
    return max(walls), sum(memories)
