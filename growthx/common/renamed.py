"""Arguments that have a better name now: the old one is still understood, with a notice."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

from growthx.common.errors import InputError

P = ParamSpec("P")
R = TypeVar("R")


def renamed(**names: str) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Have a function understand old names of its arguments, as old="new", with a DeprecationWarning.

    Raises InputError, from the function, where both are given.

    Example:
        >>> @renamed(cells="elements")
        ... def grid(elements):
        ...     return elements
        >>> grid(elements=2)
        2
    """

    def understanding(function: Callable[P, R]) -> Callable[P, R]:
        @wraps(function)
        def call(*positional: P.args, **named: P.kwargs) -> R:
            for old in names.keys() & named.keys():
                new = names[old]
                if new in named:
                    raise InputError(
                        f"{function.__name__} has {old}={named[old]!r} and {new}={named[new]!r}, which are the same: "
                        f"{new} alone would be right"
                    )
                warnings.warn(
                    f"{function.__name__}: '{old}' is called '{new}' now, and the old name will go",
                    DeprecationWarning,
                    stacklevel=2,
                )
                named[new] = named.pop(old)
            return function(*positional, **named)

        return call

    return understanding
