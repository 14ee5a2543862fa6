"""Arguments that have a better name now: the old one is still understood, with a notice."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Callable
from functools import wraps
from typing import Any, ParamSpec, TypeVar

from growthx.common.errors import InputError

P = ParamSpec("P")
R = TypeVar("R")
C = TypeVar("C", bound=type)


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
        told = function.__qualname__.removesuffix(".__init__")

        @wraps(function)
        def call(*positional: P.args, **named: P.kwargs) -> R:
            for old in names.keys() & named.keys():
                new = names[old]
                if new in named:
                    raise InputError(
                        f"{told} has {old}={named[old]!r} and {new}={named[new]!r}, which are the same: "
                        f"{new} alone would be right"
                    )
                _notice(told, old, new)
                named[new] = named.pop(old)
            return function(*positional, **named)

        return call

    return understanding


def renamed_fields(**names: str) -> Callable[[C], C]:
    """Have a dataclass understand old names of its fields, as old="new", when it is made and when it is read.

    Example:
        >>> from dataclasses import dataclass
        >>> @renamed_fields(cells="elements")
        ... @dataclass(frozen=True)
        ... class Grid:
        ...     elements: int
        >>> Grid(cells=2).cells
        2
    """

    def understanding(kind: C) -> C:
        understood = {"__init__": renamed(**names)(vars(kind)["__init__"])}
        for name, value in (understood | {old: _Former(old, new) for old, new in names.items()}).items():
            setattr(kind, name, value)
        return kind

    return understanding


class _Former:
    """An attribute by its old name."""

    def __init__(self, old: str, new: str) -> None:
        self.names = old, new

    def __get__(self, owner: Any, kind: type) -> Any:
        if owner is None:
            raise AttributeError(f"{kind.__name__} has no '{self.names[0]}' but as an attribute of its objects")
        _notice(kind.__name__, *self.names)
        return getattr(owner, self.names[1])


def _notice(told: str, old: str, new: str) -> None:
    """Say, at the line that calls what is told, that a name is an old one."""
    # FFCx has all warnings logged, where nobody hears them unless the program sets its log up.
    log = logging.getLogger("py.warnings")
    handlers = [*log.handlers, *logging.getLogger().handlers]
    unheard = logging.lastResort if all(isinstance(each, logging.NullHandler) for each in handlers) else None
    if unheard:
        log.addHandler(unheard)
    try:
        notice = f"{told}: '{old}' is called '{new}' now, and the old name will go"
        warnings.warn(notice, DeprecationWarning, stacklevel=3)
    finally:
        if unheard:
            log.removeHandler(unheard)
