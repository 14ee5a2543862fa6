"""A .msh file as bytes: its sections, its version, and the numbers in them, as text or binary.

Nothing is taken from what a file says of its own size before so many numbers are there: a header may say anything.
"""

from __future__ import annotations

import re
import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from growthx.common.errors import InputError, shown

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from growthx.common.arrays import Floats, Indices

_MARK = b"\xef\xbb\xbf"  # of a text in UTF-8, which editors put first
_HEAD = re.compile(rb"^[ \t]*\$([A-Za-z]\w*)[ \t]*\r?\n", re.MULTILINE)
_FORMAT = re.compile(rb"\s*(\d+(?:\.\d+)?)\s+([01])\s+(\d{1,9})[ \t]*\r?\n?")
_VERSIONS = ("2", "2.0", "2.1", "2.2", "4", "4.0", "4.1")
_WHOLE = 2.0**53  # from here on not every whole number is one of floating point
_BYTES = 8  # of a real number


@dataclass(frozen=True)
class File:
    """A .msh file in memory.

    version: 1, 2.0 to 2.2, which do not differ here, 4.0 or 4.1.
    order: of the bytes, "<" or ">"; "" for text.
    sections: content of each, by the name, in the order of the file.
    """

    path: Path
    version: str
    order: str
    sections: Mapping[str, list[bytes]]

    @property
    def kind(self) -> str:
        """Format and version in words."""
        return f"gmsh mesh {self.version}, {'binary' if self.order else 'text'}"

    def section(self, name: str) -> bytes:
        """The one section of a name, which may stand there again; empty if there is none."""
        found = self.sections.get(name, [b""])
        if len(set(found)) > 1:
            raise InputError(f"{self.path} has {len(found)} sections ${name}: one would be right")
        return found[0]

    def numbers(self, name: str, *, whole: bool = False) -> Source:
        """The numbers of a section; whole: whether all of a text's are."""
        return self.of(self.section(name), name, whole=whole)

    def of(self, content: bytes, name: str, *, whole: bool = False) -> Source:
        """The numbers of a part of a section."""
        if self.order:
            return Binary(self.path, name, content, self.order)
        return Text(self.path, name, parsed(self.path, name, content, np.int64 if whole else np.float64))


def load(path: Path) -> File:
    """A .msh file, looked through for its sections; InputError if it is none or is not whole."""
    content = path.read_bytes().removeprefix(_MARK)
    first = _HEAD.search(content)
    if first is None or b"\0" in content[: first.start()]:
        raise InputError(f"{path} is not a gmsh mesh: it should begin with $MeshFormat")
    version, order = _version(path, content)
    return File(path, version, order, _sections(path, content, first.start(), binary=bool(order)))


def is_of_version_3(path: Path) -> bool:
    """Whether a file says that it is of version 3, of the year 2018, which gmsh itself no longer writes by default."""
    with path.open("rb") as file:
        return re.search(rb"\$MeshFormat[ \t]*\r?\n[ \t]*3(?:\.\d*)?[ \t]", file.read(1000)) is not None


def _version(path: Path, content: bytes) -> tuple[str, str]:
    """Version and order of bytes."""
    head = re.search(rb"^[ \t]*\$MeshFormat[ \t]*\r?\n", content, re.MULTILINE)
    if head is None:
        if re.search(rb"^[ \t]*\$(?:NOD|ELM)\b", content, re.MULTILINE):
            return "1", ""
        raise InputError(f"{path} is not a gmsh mesh: it should begin with $MeshFormat")
    said = _FORMAT.match(content, head.end())
    if said is None:
        line = content[head.end() : head.end() + 100].split(b"\n")[0].decode(errors="replace")
        raise InputError(f"the format of {path} is {shown(line.strip())}: one such as 4.1 0 8 would be right")
    version = said[1].decode()
    if version not in _VERSIONS:
        raise InputError(
            f"{path} is of version {version} of gmsh's format: one of 1 to 4.1 would be right, as "
            "gmsh -save -format msh41 makes it"
        )
    name = version if "." in version else f"{version}.0"
    if said[2] == b"0":
        return name, ""
    if int(said[3]) != _BYTES:
        raise InputError(f"{path} has numbers of {int(said[3])} bytes: {_BYTES} would be right")
    one = content[said.end() : said.end() + 4]
    orders = [order for order in "<>" if one == np.array(1, dtype=f"{order}i4").tobytes()]
    if not orders:
        raise InputError(f"{path} does not tell the order of its bytes: a file that is whole would be right")
    return name, orders[0]


def _sections(path: Path, content: bytes, start: int, *, binary: bool) -> dict[str, list[bytes]]:
    """What stands between the beginning and the end of each section, in any order; what stands outside is nothing."""
    found: dict[str, list[bytes]] = {}
    while (head := _HEAD.search(content, start)) is not None:
        name = head[1].decode()
        # Version 1 shouts: $NOD ends with $ENDNOD.
        end = re.compile(rb"\$End%b\b" % head[1] if name not in ("NOD", "ELM") else rb"\$END%b\b" % head[1])
        found_end = end.search(content, head.end())
        while found_end is not None and not binary and content[found_end.start() - 1 : found_end.start()] not in _LINE:
            found_end = end.search(content, found_end.end())
        if found_end is None:
            raise InputError(f"the section ${name} of {path} has no end: a file that is whole would be right")
        found.setdefault(name, []).append(content[head.end() : found_end.start()])
        start = found_end.end()
    return found


_LINE = (b"\n", b" ", b"\t")  # before a word at the beginning of a line, or of one that is set in


def parsed(path: Path, name: str, content: bytes, kind: type) -> Any:
    """All numbers of a text."""
    if not content.strip():
        return np.empty(0, dtype=kind)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            return np.fromstring(content.decode("ascii"), dtype=kind, sep=" ")
        except (ValueError, DeprecationWarning):
            what = "whole numbers" if kind is np.int64 else "numbers"
            raise InputError(f"the section ${name} of {path} is not all made of {what}, as it should be") from None


class Source(Protocol):
    """The numbers of a section, which are taken one after the other."""

    def rows(self, count: int, *columns: tuple[str, int]) -> tuple[Any, ...]:
        """So many rows of numbers, an array (count, width) for each of the columns, and past them.

        columns: what they hold, "i" for whole numbers, "s" for sizes (long whole numbers), "d" for real ones, and how
        many of these.
        """
        ...

    def end(self, what: str) -> None:
        """Refuse numbers that are left over; what: is told by the section, such as "3 nodes"."""
        ...

    def number(self) -> int:
        """The next whole number alone, which is a size."""
        return int(self.rows(1, ("s", 1))[0][0, 0])


def _short(path: Path, name: str) -> InputError:
    return InputError(f"the section ${name} of {path} has less than it says: a file that is whole would be right")


def _long(path: Path, name: str, what: str) -> InputError:
    return InputError(f"the section ${name} of {path} has more than the {what} that it says: as many would be right")


@dataclass
class Text(Source):
    """The numbers of a text."""

    path: Path
    name: str
    flat: Any
    at: int = 0

    def rows(self, count: int, *columns: tuple[str, int]) -> tuple[Any, ...]:
        """See `Source`."""
        width = sum(wide for _, wide in columns)
        if not 0 <= count * width <= len(self.flat) - self.at:
            raise _short(self.path, self.name)
        table = self.flat[self.at : self.at + count * width].reshape(count, width)
        self.at += count * width
        parts, start = [], 0
        for kind, wide in columns:
            part = table[:, start : start + wide]
            parts.append(part if kind == "d" else whole(self.path, self.name, part))
            start += wide
        return tuple(parts)

    def end(self, what: str) -> None:
        """See `Source`."""
        if self.at < len(self.flat):
            raise _long(self.path, self.name, what)


def whole(path: Path, name: str, numbers: Floats) -> Indices:
    """Numbers of a text as the whole ones that they should be."""
    if numbers.dtype == np.int64:
        return np.asarray(numbers)
    if not ((np.abs(numbers) < _WHOLE) & (np.floor(numbers) == numbers)).all():
        raise InputError(f"the section ${name} of {path} has other numbers where whole ones would be right")
    return numbers.astype(np.int64)


@dataclass
class Binary(Source):
    """The numbers of a binary section."""

    path: Path
    name: str
    content: bytes
    order: str
    at: int = 0

    def rows(self, count: int, *columns: tuple[str, int]) -> tuple[Any, ...]:
        """See `Source`."""
        kinds = {"i": "i4", "s": "i8", "d": "f8"}
        if any(wide < 0 for _, wide in columns):
            raise _short(self.path, self.name)
        width = sum(wide * int(kinds[kind][1]) for kind, wide in columns)
        if not 0 <= count * width <= len(self.content) - self.at:
            raise _short(self.path, self.name)
        table = np.frombuffer(self.content[self.at : self.at + count * width], np.uint8).reshape(count, width)
        self.at += count * width
        parts, start = [], 0
        for kind, wide in columns:
            end = start + wide * int(kinds[kind][1])
            part = np.ascontiguousarray(table[:, start:end]).view(f"{self.order}{kinds[kind]}")
            parts.append(part.reshape(count, wide).astype(np.float64 if kind == "d" else np.int64))
            start = end
        return tuple(parts)

    def line(self) -> int:
        """The whole number that stands as text on a line of its own, as version 2 has it."""
        said = re.compile(rb"[ \t]*(\d{1,18})[ \t]*\r?\n").match(self.content, self.at)
        if said is None:
            raise InputError(
                f"the section ${self.name} of {self.path} does not begin with a number: that of what it holds, on a "
                "line of its own, would be right"
            )
        self.at = said.end()
        return int(said[1])

    def end(self, what: str) -> None:
        """See `Source`."""
        if self.content[self.at :].strip():
            raise _long(self.path, self.name, what)
