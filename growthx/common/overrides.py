"""Classes of one's own: what a subclass of growthx's classes may replace, and the refusal of all else when it is made.

A method that some variants use and others do not, as they have its formula in another form, must not be replaced: the
subclass would mean one thing here and another there.  Each class says which of its parts are used wherever there is
need of them.
"""

from __future__ import annotations

import sys
from abc import ABC
from dataclasses import fields, is_dataclass
from functools import cached_property
from types import FunctionType, MemberDescriptorType
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Protocol

from growthx.common.errors import InputError, shown

if TYPE_CHECKING:
    from collections.abc import Iterable

FREE = {"__post_init__", "__repr__", "__str__"}  # whatever they do shows where they are
# The other special methods that mean something; the rest is Python's own account of a class.
MEANT = {
    "__init__",
    "__new__",
    "__init_subclass__",
    "__getattribute__",
    "__getattr__",
    "__setattr__",
    "__eq__",
    "__hash__",
}
PYTHONS: tuple[Any, ...] = (object, ABC, Generic, Protocol)  # bases that replace nothing
BOOKS = {"_abc_impl", "_is_protocol", "_is_runtime_protocol", "_replaceable", "_final"}

_complete: set[type] = set()  # classes that have been looked at


class Sealed:
    """What growthx's classes inherit that subclasses of one's own may build on, of which they may replace some parts.

    replaceable: names of the methods, properties and class attributes that every variant takes from a subclass; those
    that are abstract are so without being named.  growthx's own classes state it, be it empty, and are not checked.
    final: names of parts, abstract or replaceable in a base, that a class of growthx's has settled: of its subclasses
    they are not asked any more, and what they would say is not used.
    Parameters, the fields of dataclasses, may have other defaults.
    Raises InputError when a class is made that replaces anything else, itself or by another base.
    """

    _replaceable: ClassVar[tuple[str, ...]] = ()
    _final: ClassVar[tuple[str, ...]] = ()

    def __init_subclass__(
        cls, *, replaceable: Iterable[str] | None = None, final: Iterable[str] = (), **keywords: Any
    ) -> None:
        super().__init_subclass__(**keywords)
        if replaceable is None:
            _check(cls)
        else:
            cls._replaceable, cls._final = tuple(replaceable), tuple(final)

    def __new__(cls, *values: Any, **parameters: Any) -> Any:
        """An object of the class, looked at once more now that it is complete."""
        if cls not in _complete:
            _check_complete(cls)
            _complete.add(cls)
        return super().__new__(cls)


def is_foreign(kind: type) -> bool:
    """Whether a class is, or has in its bases, one of the user's."""
    return any(not (_is_ours(base) or base in PYTHONS) for base in kind.__mro__)


def place(kind: type, name: str) -> int:
    """How far from a class in the order of its bases the one stands that has an attribute."""
    return next(number for number, base in enumerate(kind.__mro__) if name in vars(base))


def _is_ours(kind: type) -> bool:
    return "_replaceable" in vars(kind)


def _ours(kind: type) -> list[Any]:
    return [base for base in kind.__mro__ if _is_ours(base)]


def _parameters(kind: type) -> dict[str, Any]:
    """The parameters of a class that growthx's classes among its bases have, and which of them."""
    found: dict[str, Any] = {}
    for base in reversed(_ours(kind)):
        found |= {part.name: base for part in fields(base)} if is_dataclass(base) else {}
    return found


def _check(kind: type) -> None:
    """Refuse a class of the user's that replaces what it may not."""
    ours, parameters = _ours(kind), _parameters(kind)
    asked = {name for base in ours for name in (*base._replaceable, *_abstract(base))}
    allowed = sorted(asked - {name for base in ours for name in base._final})
    known = {name: base for base in reversed(ours) for name in vars(base)}
    for name, base in {**known, **parameters}.items():
        provider = next((other for other in kind.__mro__ if name in vars(other)), base)
        if _is_ours(provider) or provider in PYTHONS or _is_pythons(name, provider):
            continue
        if name in parameters:
            _check_parameter(kind, name, provider)
        elif name not in allowed:
            raise InputError(
                f"the class {kind.__name__} replaces {name} of {base.__name__}, which is not used everywhere: "
                f"{_right(allowed)} would be right"
            )
        elif isinstance(vars(base)[name], FunctionType) and not callable(getattr(kind, name)):
            raise InputError(
                f"{name} of the class {kind.__name__} is {shown(vars(provider)[name])}: a method, as {base.__name__} "
                "has it, would be right"
            )


def _abstract(kind: type) -> list[str]:
    return [name for name, value in vars(kind).items() if getattr(value, "__isabstractmethod__", False)]


def _is_pythons(name: str, provider: type) -> bool:
    """Whether a name is none that a user chose to replace."""
    if name in FREE or name in BOOKS:
        return True
    if isinstance(vars(provider).get(name), MemberDescriptorType):  # of slots
        return True
    if name == "__hash__" and vars(provider)[name] is None:  # follows from another __eq__
        return True
    special = name.startswith("__") and name.endswith("__")
    return special and (name not in MEANT or "__dataclass_params__" in vars(provider))


def _right(allowed: list[str]) -> str:
    if not allowed:
        return "parameters of other values"
    return ("to replace " if len(allowed) == 1 else "to replace any of ") + ", ".join(allowed)


def _check_parameter(kind: type, name: str, provider: type) -> None:
    """Refuse a parameter that a class gives another meaning, or a value that Python's dataclasses would overlook."""
    value = vars(provider)[name]
    hidden = isinstance(value, (property, cached_property, classmethod, staticmethod))
    if hidden or name not in _annotated(provider):
        raise InputError(
            f"the class {kind.__name__} replaces the parameter {name} by {shown(value)}, which would not be used: "
            f"a default, '{name}: <type> = <value>' in a dataclass, would be right"
        )


def _check_complete(kind: type) -> None:
    """Refuse a class whose parameters are not those of growthx's classes that it builds on, and perhaps more."""
    if not is_foreign(kind):
        return
    parameters = _parameters(kind)
    for base in kind.__mro__:
        stated = [name for name in _annotated(base) if name in parameters]
        if stated and not _is_ours(base) and "__dataclass_params__" not in vars(base):
            raise InputError(
                f"the class {base.__name__} states the parameter {stated[0]} but is no dataclass, so that it would be "
                "overlooked: @dataclass(frozen=True) above the class would be right"
            )
    given = {part.name for part in fields(kind) if part.init} if is_dataclass(kind) else set()
    lost = [name for name in parameters if name not in given]
    if lost:
        raise InputError(
            f"the class {kind.__name__} has no parameter {lost[0]}: one with a default, in a class under "
            "@dataclass(frozen=True), would be right"
        )
    _check_coefficients(kind, given)


def _check_coefficients(kind: Any, given: set[str]) -> None:
    """Refuse names of parameters that may vary in space unless they are parameters, those of the bases among them."""
    needed = [name for base in reversed(_ours(kind)) for name in vars(base).get("coefficients", ())]
    if not hasattr(kind, "coefficients"):
        return
    names = kind.coefficients
    if not (isinstance(names, tuple) and set(needed) <= set(names) <= given):
        raise InputError(
            f"the coefficients of the class {kind.__name__} are {shown(names)}: a tuple of names of its parameters, "
            f"{', '.join(needed)} among them, would be right"
        )


def _annotated(kind: type) -> Iterable[str]:
    """The names that the body of a class gives types."""
    if sys.version_info >= (3, 14):
        import annotationlib

        return annotationlib.get_annotations(kind, format=annotationlib.Format.FORWARDREF)
    return vars(kind).get("__annotations__", {})
