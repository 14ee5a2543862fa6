"""The values of elements in a .msh file ($ElementData), by the element's number."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from growthx.common.errors import InputError

if TYPE_CHECKING:
    from growthx.common.arrays import Floats, Indices
    from growthx.meshing.formats.msh_file import File

_LINE = re.compile(rb"[^\n]*\n")
_MOST = 100  # words, numbers or counts that tell of values: gmsh has one to four


def read_values(file: File) -> tuple[dict[str, tuple[Indices, Floats]], list[str]]:
    """Numbers of elements, and the value of each, by the name of the data; and what is to be said of them."""
    found: dict[str, tuple[Indices, Floats]] = {}
    times: dict[str, list[float]] = {}
    notices = []
    for content in file.sections.get("ElementData", []):
        name, time, parts, count, rest = _head(file, content)
        if parts != 1:
            notices.append(f"the {parts} components of '{name}' in {file.path} were left out: values are one a cell")
            continue
        source = file.of(rest, "ElementData")
        numbers, values = source.rows(count, ("i", 1), ("d", 1))
        source.end(f"{count} values")
        times.setdefault(name, []).append(time)
        found[name] = numbers[:, 0], values[:, 0]
    for name, steps in times.items():
        if len(steps) > 1:
            notices.append(
                f"'{name}' in {file.path} has {len(steps)} steps, of which the last was read (t = {steps[-1]:g})"
            )
    for section, what in (("NodeData", "nodes"), ("ElementNodeData", "the nodes of elements")):
        if section in file.sections:
            notices.append(f"the values at {what} in {file.path} were left out: those of elements are read")
    return found, notices


def _head(file: File, content: bytes) -> tuple[str, float, int, int, bytes]:
    """Name, time, number of components and of elements of values, and what follows."""
    at = 0

    def line() -> bytes:
        nonlocal at
        found = _LINE.match(content, at)
        if found is None:
            raise ValueError
        at = found.end()
        return found[0].strip()

    def lines() -> list[bytes]:
        count = int(line())
        if not 0 <= count <= _MOST:
            raise ValueError
        return [line() for _ in range(count)]

    try:
        words, reals, counts = lines(), [float(each) for each in lines()], [int(each) for each in lines()]
        name = words[0].strip(b'"').decode(errors="replace")
        return name, reals[0] if reals else 0.0, counts[1], counts[2], content[at:]
    except (ValueError, IndexError):
        raise InputError(
            f"a section $ElementData of {file.path} does not tell its name, time, step, number of components and of "
            "values: a file that is whole would be right"
        ) from None
