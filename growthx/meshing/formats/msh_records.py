"""The elements of a .msh file of version 1 or 2, each with its own physical group.

gmsh keeps groups of whole entities: opened by it, all elements of an entity would have the groups of any of them.  In a
file of these versions each element names its group, and one that is in several stands there once for each.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from growthx.common.errors import InputError
from growthx.meshing.formats.msh_file import Binary, File, parsed

if TYPE_CHECKING:
    from growthx.common.arrays import Indices

_FEW = 16  # records of one layout, of which the first are looked for at once
_SHORT = 1000  # so many runs of records of one layout, and no more than


@dataclass(frozen=True)
class Block:
    """Elements of one type.

    kind: gmsh's number of the type.  tags: the element's number, (elements,).  nodes: in gmsh's order, by their tags,
    (elements, nodes).  entities: elementary tag of each, (elements,).  groups: physical tags, (elements, some), 0 for
    none.
    """

    kind: int
    tags: Indices
    nodes: Indices
    entities: Indices
    groups: Indices


@dataclass(frozen=True)
class _Layout:
    """Where a record of one or more elements has what; places count from its start, or from that of an element.

    kind: type of its elements.  tags: their number of tags, None: two.  count: number of elements, None: one.
    lead: numbers before the first element.  first: place in an element of its first tag.  extra: numbers of an element
    besides tags and nodes.
    """

    kind: int
    tags: int | None
    count: int | None
    lead: int
    first: int
    extra: int

    @property
    def told(self) -> int:
        """Numbers of a record in which it tells of itself."""
        return 1 + max(self.kind, self.tags or 0, self.count or 0)


_VERSION_1 = _Layout(kind=1, tags=None, count=None, lead=0, first=2, extra=3)  # number kind tag tag nodes, node …
_VERSION_2 = _Layout(kind=1, tags=2, count=None, lead=0, first=3, extra=3)  # number kind tags, tag … node …
_BINARY = _Layout(kind=0, tags=2, count=1, lead=3, first=1, extra=1)  # kind count tags, (number tag … node …) …


def read_records(file: File, sizes: Indices) -> list[Block]:
    """All elements of a file of version 1 or 2, text or binary, in blocks of one type, each in the file's order.

    sizes: number of nodes of an element by gmsh's number of its type, 0 where there is none.
    InputError if the file does not have as many elements as it says.
    """
    name = "ELM" if file.version == "1" else "Elements"
    content = file.section(name)
    if not content:
        return []
    numbers, wanted, layout = _numbers(file, name, content)
    starts = _starts(numbers, layout, sizes, wanted)
    if starts is None:
        raise InputError(f"{file.path} has not the {wanted} elements that it says: a file that is whole would be right")
    kinds, tags, counts = _told(numbers, layout, starts)
    ends = starts + layout.lead + counts * (layout.extra + tags + sizes[kinds])
    if len(numbers) > ends.max(initial=0):
        raise InputError(f"{file.path} has more than the {wanted} elements that it says: as many would be right")
    forms = kinds + len(sizes) * (tags + (tags.max(initial=0) + 1) * counts)
    _, examples, which = np.unique(forms, return_index=True, return_inverse=True)
    found = []
    for number in np.argsort(examples):
        kind, tag_count, count = (int(each[examples[number]]) for each in (kinds, tags, counts))
        width = layout.extra + tag_count + int(sizes[kind])
        first = np.add.outer(starts[which == number] + layout.lead, width * np.arange(count)).reshape(-1)
        two = [numbers[first + layout.first + i] if i < tag_count else np.zeros_like(first) for i in (0, 1)]
        nodes = numbers[np.add.outer(first, np.arange(width - sizes[kind], width))]
        # A negative group is the group, turned over.
        found.append(Block(kind, numbers[first], nodes, two[1], np.abs(two[0])[:, np.newaxis]))
    return found


def _numbers(file: File, name: str, content: bytes) -> tuple[Indices, int, _Layout]:
    """The numbers of the elements of a file, how many elements it says it has, and their layout."""
    if file.order:
        source = Binary(file.path, name, content, file.order)
        count = source.line()
        numbers = np.frombuffer(content, f"{file.order}i4", (len(content) - source.at) // 4, source.at)
        return numbers.astype(np.int64), count, _BINARY
    numbers = parsed(file.path, name, content, np.int64)
    if not len(numbers):
        raise InputError(f"the number of elements is missing in {file.path}: a file that is whole would be right")
    return numbers[1:], int(numbers[0]), _VERSION_1 if file.version == "1" else _VERSION_2


def _told(numbers: Indices, layout: _Layout, starts: Indices) -> tuple[Indices, Indices, Indices]:
    """Types, numbers of tags and numbers of elements of the records that begin there."""
    return (
        numbers[starts + layout.kind],
        np.full_like(starts, 2) if layout.tags is None else numbers[starts + layout.tags],
        np.ones_like(starts) if layout.count is None else numbers[starts + layout.count],
    )


def _starts(numbers: Indices, layout: _Layout, sizes: Indices, wanted: int) -> Indices | None:
    """Where the records with the `wanted` elements begin; None if there are not so many, or more."""
    runs: list[Indices] = []
    at, elements, records = 0, 0, 0
    while elements < wanted:
        if len(runs) >= _SHORT and records < _FEW * len(runs):  # of types that alternate
            rest = _chain(numbers[at:], layout, sizes, wanted - elements)
            if rest is None:
                return None
            return np.concatenate([*runs, at + rest])
        run, count, at = _run(numbers, layout, sizes, at)
        most = -(-(wanted - elements) // count) if count else 0
        if not most:
            return None
        runs.append(run[:most])
        records += len(runs[-1])
        elements += count * len(runs[-1])
    return np.concatenate([*runs, np.empty(0, dtype=np.int64)]) if elements == wanted else None


def _run(numbers: Indices, layout: _Layout, sizes: Indices, at: int) -> tuple[Indices, int, int]:
    """Where the records of one layout begin that follow each other from there, their elements, and where they end."""
    if at + layout.told > len(numbers):
        return np.empty(0, dtype=np.int64), 0, at
    first = numbers[at : at + layout.told]
    kind, tags, count = (int(each[0]) for each in _told(first, layout, np.zeros(1, dtype=np.int64)))
    size = int(sizes[kind]) if 0 <= kind < len(sizes) else 0
    width = layout.lead + count * (layout.extra + tags + size)
    if size == 0 or tags < 0 or count < 1 or at + width > len(numbers):
        return np.empty(0, dtype=np.int64), 0, at
    same = [place for place in (layout.kind, layout.tags, layout.count) if place is not None]
    most = (len(numbers) - at) // width
    found, step = 1, _FEW
    while found < most:
        more = min(step, most - found)
        begin = at + found * width
        rows = numbers[begin : begin + more * width].reshape(more, width)
        fits = (rows[:, same] == first[same]).all(axis=1)
        found += more if fits.all() else int(np.argmin(fits))
        if not fits.all():
            break
        step *= 4
    return at + width * np.arange(found), count, at + found * width


def _chain(numbers: Indices, layout: _Layout, sizes: Indices, wanted: int) -> Indices | None:
    """Where the records with the first `wanted` elements begin, each of another layout than the one before it."""
    end = len(numbers)
    # As if a record began everywhere: what it says of itself, and where the next one would begin.
    begins = np.arange(max(0, end - layout.told + 1))
    kinds, tags, counts = _told(numbers, layout, begins)
    nodes = np.where((kinds >= 0) & (kinds < len(sizes)), sizes[np.clip(kinds, 0, len(sizes) - 1)], 0)
    whole = (nodes > 0) & (tags >= 0) & (tags <= end) & (counts > 0) & (counts <= end)
    after = begins + layout.lead + np.where(whole, counts * (layout.extra + tags + nodes), 0)
    whole &= after <= end
    following: Indices = np.full(end + 1, end)
    following[begins[whole]] = after[whole]
    starts: Indices = np.zeros(1, dtype=np.int64)
    while len(starts) < wanted and starts[-1] < end:  # twice as many at each turn
        starts = np.concatenate([starts, following[starts]])
        following = following[following]
    starts = starts[starts < len(begins)][:wanted]
    starts = starts[: np.flatnonzero(~whole[starts]).min(initial=len(starts))]
    told = np.cumsum(counts[starts])
    if wanted > (told[-1] if len(told) else 0):
        return None
    return starts[: np.searchsorted(told, wanted) + 1]
