"""Names, numbers and lists in a few words, for what objects print of themselves."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import fields, is_dataclass
from numbers import Real
from typing import Any

from growthx.common.checks import is_function

NAME, LINE = 40, 150  # characters that are shown of a name and of a line
ENTRIES = 6  # that are shown of a list


def field_in_words(value: Any) -> str:
    """A number, a function of position, a field or a value for each region, as it is said."""
    if isinstance(value, Mapping):
        return "{" + listed([f"{quoted(name)}: {field_in_words(part)}" for name, part in value.items()]) + "}"
    if hasattr(value, "function_space"):
        return f"the field {quoted(value.name)}"
    if is_function(value):
        return "a function"
    if isinstance(value, Real) and not isinstance(value, bool):
        return f"{value:g}"
    if isinstance(value, tuple):
        return "(" + listed([field_in_words(part) for part in value]) + ")"
    return cut(repr(value), NAME)


def how_many(some: tuple[Any, ...], what: str) -> str:
    """A number of things, as "2 loads"."""
    return f"{len(some)} {what}" + ("" if len(some) == 1 else "s")


def line(what: str, text: str) -> str:
    """What something is, on an indented line."""
    return f"  {what}: {cut(text, LINE)}"


def fields_in_words(of: Any) -> str:
    """The fields of a dataclass, as it would be made."""
    if not is_dataclass(of):
        return type(of).__name__
    in_order = sorted(fields(of), key=lambda part: part.kw_only is True)
    parts = (f"{part.name}={field_in_words(getattr(of, part.name))}" for part in in_order)
    return f"{type(of).__name__}({', '.join(parts)})"


def counted(texts: Iterable[str]) -> str:
    """Texts, those that are alike once."""
    found = Counter(texts)
    return listed([text if count == 1 else f"{count} × {text}" for text, count in found.items()]) or "none"


def place_in_words(x: Iterable[float], digits: int = 6) -> str:
    """A place or a direction, as "(1, 0.5)"."""
    return "({})".format(", ".join(f"{value + 0.0:.{digits}g}" for value in x))


def quoted_names(names: Iterable[str]) -> str:
    """Names in quotes, the first ones."""
    return listed([quoted(name) for name in names]) or "none"


def quoted(name: object) -> str:
    """A name in quotes, not too long."""
    return f"'{cut(str(name), NAME)}'"


def listed(texts: list[str]) -> str:
    """Texts with commas between them, the first ones."""
    more = len(texts) - ENTRIES
    return ", ".join(texts[:ENTRIES]) + (f" and {more} more" if more > 0 else "")


def cut(text: str, most: int) -> str:
    """A text on one line, not too long."""
    tidy = " ".join(text.split())
    return tidy if len(tidy) <= most else f"{tidy[:most]}…"
