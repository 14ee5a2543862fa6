"""Ctrl-C, SIGTERM and SIGUSR1: a run ends after the step it is in, on all ranks, so that its state can be saved."""

from __future__ import annotations

import signal
import threading
from typing import TYPE_CHECKING, Any

from mpi4py import MPI

if TYPE_CHECKING:
    from types import FrameType, TracebackType

# mpirun forwards the last one, and lets the ranks end as they will; after the others it kills them within a second.
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGUSR1)


def ignore_broken_pipes() -> None:
    """Take SIGPIPE back from PETSc, which aborts the program: Python has an exception for pipes that nobody reads."""
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGPIPE, signal.SIG_IGN)


class Interruption:
    """While it is entered, the first signal is noted; a second one does what it did before.

    Signals reach the main thread alone: in another, nothing is noted; nor are those that are ignored, as shells have
    programs in the background ignore Ctrl-C.
    """

    def __init__(self) -> None:
        self._noted = 0
        self._before: dict[signal.Signals, Any] = {}

    def __enter__(self) -> Interruption:
        if threading.current_thread() is threading.main_thread():
            heard = [number for number in SIGNALS if signal.getsignal(number) is not signal.SIG_IGN]
            self._before = {number: signal.signal(number, self._note) for number in heard}
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._restore()

    def signal_on_any_rank(self, comm: MPI.Intracomm) -> int:
        """The number of the signal that was noted, on any rank (collective); 0 if there was none."""
        return comm.allreduce(self._noted, MPI.MAX)

    def _note(self, number: int, frame: FrameType | None) -> None:
        self._noted = number
        self._restore()

    def _restore(self) -> None:
        for number, handler in self._before.items():
            signal.signal(number, signal.SIG_DFL if handler is None else handler)  # None: not Python's own
        self._before = {}
