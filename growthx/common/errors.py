"""The errors a user may meet: each message is one sentence with the offending value and what would be right."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mpi4py import MPI


SHOWN = 80  # characters of a wrong value that a sentence shows


class GrowthxError(Exception):
    """Any error growthx raises on purpose; `exit_status` is what the command line returns for it.

    Example:
        >>> [kind.exit_status for kind in (gx.GrowthxError, gx.InputError, gx.EndedEarly)]
        [1, 2, 3]
    """

    exit_status = 1

    def __init__(self, message: str) -> None:
        # One line, whatever names and values it quotes.
        super().__init__(" ".join(message.split()))


class InputError(GrowthxError):
    """Something the user gave is not usable: a parameter, a name, a file.

    Example:
        >>> try:
        ...     gx.Material(young=-1.0)
        ... except gx.InputError as error:
        ...     print(error)
        Young's modulus E is -1: a positive number would be right
    """

    exit_status = 2


class EndedEarly(GrowthxError):
    """A run stopped before its last requested time: the message says when, where and why.

    Example:
        >>> issubclass(gx.RunEndedEarly, gx.EndedEarly), gx.EndedEarly.exit_status
        (True, 3)
    """

    exit_status = 3


class OutputError(GrowthxError):
    """Results could not be written: nothing of them stays where they were to be."""


def shown(value: Any) -> str:
    """A wrong value as a sentence shows it: on one line, not too long."""
    text = " ".join(repr(value).split())
    return text if len(text) <= SHOWN else f"{text[:SHOWN]}…"


def raise_on_all(comm: MPI.Comm, problem: str, kind: type[GrowthxError] = InputError) -> None:
    """Raise an error on all ranks if any of them has found a problem (collective): the sentence of the first."""
    if found := next(filter(None, comm.allgather(problem)), ""):
        raise kind(found)


def no_such_name(module: str, name: str, known: Iterable[str]) -> AttributeError:
    """What a module raises when it is asked for a name that it has not."""
    return AttributeError(f"{module} has no '{name}'; it has {', '.join(sorted(known))}")


class Interrupted(GrowthxError):
    """A run was ended by a signal: the message says when, and where its state is."""

    def __init__(self, message: str, signal: int) -> None:
        super().__init__(message)
        self.exit_status = 128 + signal
