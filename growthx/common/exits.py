"""How a program ends, in one rank or in many: messages from rank 0, exit status, and no rank left waiting."""

from __future__ import annotations

import os
import signal
import sys
import traceback
from collections.abc import Callable

from growthx.common.errors import GrowthxError
from growthx.common.places import place_of


def guarded(main: Callable[[], int | None]) -> int:
    """Run a program's `main` and return its exit status.

    A GrowthxError becomes one sentence on stderr, with what `growthx help` tells more about, and the error's exit
    status; Ctrl-C and SIGTERM become 130 and 143; any other exception is a defect: its traceback is shown and, in a
    parallel run, all ranks are ended.

    Example:
        >>> gx.guarded(lambda: print("done"))
        done
        0
    """
    signal.signal(signal.SIGTERM, _terminate)
    try:
        status = main() or 0
        sys.stdout.flush()
        return status
    except GrowthxError as error:
        if _rank() == 0:
            place = place_of(error)
            more = f" (growthx help {place} tells more)" if place else ""
            print(f"growthx: {error}{more}", file=sys.stderr)
        return error.exit_status
    except KeyboardInterrupt:
        return _ended("interrupted", 130)
    except BrokenPipeError:
        return _speechless()  # whoever read our output has left: nothing is wrong, and nobody to tell
    except OSError as error:
        if error.filename is not None:  # files that we write have names, and errors of their own
            return _defect()
        print(f"growthx: the output cannot be written ({error.strerror})", file=sys.stderr)
        return _speechless()
    except Exception:
        return _defect()


def _defect() -> int:
    traceback.print_exc()
    _abort(1)
    return 1


def _speechless() -> int:
    """End without another word on stdout, which Python would try once more."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    _abort(1)
    return 1


def _terminate(signum: int, frame: object) -> None:
    raise SystemExit(_ended("terminated", 143))


def _ended(how: str, status: int) -> int:
    print(f"growthx: {how}", file=sys.stderr)
    _abort(status)
    return status


def _rank() -> int:
    from mpi4py import MPI

    return MPI.COMM_WORLD.rank


def _abort(status: int) -> None:
    """End all ranks, if there are others: they may be waiting for this one."""
    from mpi4py import MPI

    if MPI.COMM_WORLD.size > 1:
        sys.stdout.flush()
        sys.stderr.flush()
        MPI.COMM_WORLD.Abort(status)
