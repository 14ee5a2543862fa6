"""What a program uses of its machine, as all of its ranks together."""

import time

import numpy as np
from blocks import COMM

from growthx.common.usage import spent


def test_all_ranks_know_the_same_time_and_memory():
    """A history is written by one rank: its numbers must be those of the program."""
    start = time.perf_counter()
    first = spent(start, COMM)
    assert len(set(COMM.allgather(first))) == 1
    held = []
    for _ in range(50):  # pieces of 100 MB: what tests before this one have freed, a process takes again first
        held += [np.ones(12_500_000)] if COMM.rank == COMM.size - 1 else []
        second = spent(start, COMM)
        if second[1] > first[1] + 90:
            break
    assert second[0] > first[0] > 0
    assert first[1] + 200 > second[1] > first[1] + 90 and second[1] > 200
    del held
    assert spent(start, COMM)[1] >= second[1]  # the most so far
