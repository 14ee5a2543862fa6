"""The errors a user may meet: each message is one sentence with the offending value and what would be right."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from numbers import Real
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mpi4py import MPI

LARGEST = 1e100  # of any number: squares and products of larger ones overflow
SHOWN = 80  # characters of a wrong value that a sentence shows


class GrowthxError(Exception):
    """Any error growthx raises on purpose; `exit_status` is what the command line returns for it."""

    exit_status = 1

    def __init__(self, message: str) -> None:
        # One line, whatever names and values it quotes.
        super().__init__(" ".join(message.split()))


class InputError(GrowthxError):
    """Something the user gave is not usable: a parameter, a name, a file."""

    exit_status = 2


class EndedEarly(GrowthxError):
    """A run stopped before its last requested time: the message says when, where and why."""

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


def require_kind(value: Any, kinds: type | tuple[type, ...], what: str, wanted: str) -> None:
    """Refuse what is of none of these classes."""
    if not isinstance(value, kinds):
        raise InputError(f"{what} is {shown(value)}: {wanted} would be right")


def require_name(value: Any, what: str) -> None:
    """Refuse what is not text."""
    require_kind(value, str, what, "a name in quotes")


def require_each(values: Any, kinds: type | tuple[type, ...], what: str, wanted: str) -> tuple[Any, ...]:
    """The values as a tuple; refuse what is not a tuple or list, or holds anything of none of these classes."""
    require_kind(values, (tuple, list), what, f"a tuple of {wanted}s")
    for value in values:
        require_kind(value, kinds, f"an entry of {what}", f"a {wanted}")
    return tuple(values)


def require_function(value: Any, what: str, wanted: str) -> None:
    """Refuse what cannot be called."""
    if not is_function(value):
        raise InputError(f"{what} is {shown(value)}: {wanted} would be right")


def is_function(value: Any) -> bool:
    """Whether a value is meant to be called: classes and UFL's expressions, which can be, are not."""
    return callable(value) and not isinstance(value, type) and not hasattr(value, "ufl_shape")


def require_vector(values: Any, what: str) -> tuple[float, ...]:
    """The numbers of a vector; refuse what is not a row of finite numbers."""
    if not isinstance(values, (tuple, list)) and getattr(values, "ndim", None) != 1:
        raise InputError(f"{what} is {shown(values)}: a number for each direction would be right")
    for value in values:
        require_number(value, f"a component of {what}", "a finite number", lambda _: True)
    return tuple(float(value) for value in values)


class Interrupted(GrowthxError):
    """A run was ended by a signal: the message says when, and where its state is."""

    def __init__(self, message: str, signal: int) -> None:
        super().__init__(message)
        self.exit_status = 128 + signal


def require_number(value: Any, what: str, wanted: str, holds: Callable[[Any], Any]) -> None:
    """Refuse what is not a finite real number, or not as `holds` wants."""
    if not isinstance(value, Real) or isinstance(value, bool):
        raise InputError(f"{what} is {shown(value)}: {wanted} would be right")
    try:
        number = float(value)
    except OverflowError:  # integers know no infinity
        number = math.inf
    if not (math.isfinite(number) and holds(number)):
        raise InputError(f"{what} is {number:g}: {wanted} would be right")
    if abs(number) > LARGEST:
        raise InputError(f"{what} is {number:g}: one of at most {LARGEST:g}, whatever the units, would be right")


def require(value: Any, what: str, wanted: str, holds: Callable[[Any], Any]) -> None:
    """Refuse a number, any number in a mapping, or a DOLFINx Function's values, if not finite or not as `holds` wants.

    The values of functions of position are checked when they have become DOLFINx Functions.  What is neither a number
    nor a field is refused.
    """
    import numpy as np  # not above: the errors themselves, and so the command's help, do without

    if isinstance(value, Mapping):
        for name, part in value.items():
            require(part, f"{what} of '{name}'", wanted, holds)
    elif hasattr(value, "function_space"):
        array = value.x.array
        wrong = array[~((np.abs(array) <= LARGEST) & holds(array))]
        # Every rank raises, or none: one that raised alone would leave the others waiting.
        found = [rank for rank in value.function_space.mesh.comm.allgather(wrong[:1].tolist()) if rank]
        if found:
            raise InputError(f"{what} is {found[0][0]:g} somewhere: {wanted} would be right")
    elif not (is_function(value) or hasattr(value, "ufl_shape") or isinstance(value, np.ndarray)):
        require_number(value, what, wanted, holds)
