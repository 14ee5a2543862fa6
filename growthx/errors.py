"""The errors a user may meet: each message is one sentence with the offending value and what would be right."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from numbers import Real
from typing import Any


class GrowthxError(Exception):
    """Any error growthx raises on purpose; `exit_status` is what the command line returns for it."""

    exit_status = 1


class InputError(GrowthxError):
    """Something the user gave is not usable: a parameter, a name, a file."""

    exit_status = 2


class EndedEarly(GrowthxError):
    """A run stopped before its last requested time: the message says when, where and why."""

    exit_status = 3


def require_number(value: Any, what: str, wanted: str, holds: Callable[[Any], Any]) -> None:
    """Refuse what is not a finite real number, or not as `holds` wants."""
    if not isinstance(value, Real) or isinstance(value, bool):
        raise InputError(f"{what} is {value!r}: {wanted} would be right")
    if not (math.isfinite(value) and holds(value)):
        raise InputError(f"{what} is {float(value):g}: {wanted} would be right")


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
        wrong = array[~(np.isfinite(array) & holds(array))]
        # Every rank raises, or none: one that raised alone would leave the others waiting.
        found = [rank for rank in value.function_space.mesh.comm.allgather(wrong[:1].tolist()) if rank]
        if found:
            raise InputError(f"{what} is {found[0][0]:g} somewhere: {wanted} would be right")
    elif not (callable(value) or isinstance(value, np.ndarray)):
        require_number(value, what, wanted, holds)
