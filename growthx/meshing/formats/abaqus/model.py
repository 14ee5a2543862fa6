"""Parts and instances of an Abaqus model, and all of them as one content."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from growthx.common.errors import InputError, shown
from growthx.meshing.content import AROUND, DIMENSIONS, Content, Elements
from growthx.meshing.formats.abaqus.elements import SIDES
from growthx.meshing.parts import each_once

if TYPE_CHECKING:
    from pathlib import Path

    from growthx.common.arrays import Floats, Indices

DEEPEST = 50  # sets that name sets
Members = dict[str, list[Any]]  # of sets: arrays of numbers, and names of other sets


@dataclass
class Part:
    """Nodes and elements with their own numbers, and what is named among them.

    elements: shape, numbers, and numbers of the nodes of each block.  surfaces: name, type, rows and place of each.
    internal: sets, in capitals, that only surfaces mean.  left_out: number of elements without a shape by their type.
    told: sentences on types of elements.
    shift, turn: of an instance: a translation, then a rotation about the axis between two points by an angle in
    degrees.
    """

    name: str
    tags: list[Indices] = field(default_factory=list)
    points: list[Floats] = field(default_factory=list)
    elements: list[tuple[str, Indices, Indices]] = field(default_factory=list)
    node_sets: Members = field(default_factory=dict)
    element_sets: Members = field(default_factory=dict)
    surfaces: list[tuple[str, str, list[list[str]], str]] = field(default_factory=list)
    left_out: dict[str, int] = field(default_factory=dict)
    told: set[str] = field(default_factory=set)
    internal: set[str] = field(default_factory=set)
    shift: list[float] | None = None
    turn: list[float] | None = None

    def copy(self, name: str) -> Part:
        """The same as an instance of its own."""
        return replace(
            self,
            name=name,
            tags=list(self.tags),
            points=list(self.points),
            elements=list(self.elements),
            node_sets={key: list(members) for key, members in self.node_sets.items()},
            element_sets={key: list(members) for key, members in self.element_sets.items()},
            surfaces=list(self.surfaces),
            internal=set(self.internal),
        )

    @staticmethod
    def spelled(sets: Mapping[str, Any], name: str) -> str:
        """The name as it was first written: case does not count."""
        return next((known for known in sets if known.upper() == name.upper()), name)

    def add_nodes(self, tags: Indices, points: Floats, name: str | None) -> None:
        """Nodes of a block, and the set that they are."""
        self.tags.append(tags)
        self.points.append(points)
        if name:
            self.node_sets.setdefault(self.spelled(self.node_sets, name), []).append(tags)

    def add_elements(self, shape: str, tags: Indices, nodes: Indices, name: str | None) -> None:
        """Elements of a block, and the set that they are."""
        self.elements.append((shape, tags, nodes))
        if name:
            self.element_sets.setdefault(self.spelled(self.element_sets, name), []).append(tags)

    @property
    def dim(self) -> int:
        """The highest dimension of its elements."""
        return max((DIMENSIONS[shape] for shape, _, _ in self.elements), default=0)

    def placed(self) -> Floats:
        """Where its nodes are, (nodes, 3)."""
        x = np.concatenate([np.empty((0, 3)), *self.points])
        if self.shift is not None:
            x = x + np.array(self.shift)
        if self.turn is not None:
            start, end, angle = np.array(self.turn[:3]), np.array(self.turn[3:6]), np.radians(self.turn[6])
            axis = (end - start) / (np.linalg.norm(end - start) or 1.0)
            arm = x - start
            x = (
                start
                + arm * np.cos(angle)
                + np.cross(axis, arm) * np.sin(angle)
                + np.outer(arm @ axis, axis) * (1 - np.cos(angle))
            )
        return np.asarray(x)


@dataclass
class _Found:
    """What is named in some parts: numbers of elements and of nodes in the whole, and nodes of facets."""

    groups: dict[str, Indices]
    node_sets: dict[str, Indices]
    facet_sets: dict[str, Indices]


def joined(path: Path, whole: Part, parts: list[Part], of_assembly: set[str]) -> Content:
    """One content of what stands outside of parts and of all parts, or of all instances.

    of_assembly: names, in capitals, of sets that are of the assembly, of whichever instances their members are.
    """
    parts = [whole, *parts]
    points, elements, notices = [], [], []
    found = []
    node_start = element_start = 0
    for part in parts:
        x = part.placed()
        index = _Index(part, path, node_start, element_start)
        points.append(x)
        elements += [Elements(shape, index.nodes(nodes)) for shape, _, nodes in part.elements]
        found.append((part.name, _named(part, index)))
        notices += [
            f"{count} elements of type {kind} in {path} are left out: they have no shape"
            for kind, count in part.left_out.items()
        ]
        notices += [f"in {path}, {sentence}" for sentence in sorted(part.told)]
        node_start += len(x)
        element_start += len(index.tags)
    names = [
        [name for _, one in found for name in getattr(one, kind)] for kind in ("groups", "node_sets", "facet_sets")
    ]
    return Content(
        "Abaqus input file",
        np.concatenate([np.empty((0, 3)), *points]),
        tuple(elements),
        _united(found, "groups", names[0], of_assembly),
        _united(found, "node_sets", names[1], of_assembly),
        _united(found, "facet_sets", names[2], of_assembly),
        notices=tuple(dict.fromkeys(notices)),
    )


def _united(found: list[tuple[str, _Found]], kind: str, names: list[str], of_assembly: set[str]) -> dict[str, Indices]:
    """The sets of all parts; one that several have is named after each of them, unless it is of the assembly."""
    sets: dict[str, list[Indices]] = {}
    for part, one in found:
        for name, members in getattr(one, kind).items():
            several = names.count(name) > 1 and part and name.upper() not in of_assembly
            sets.setdefault(f"{part}.{name}" if several else name, []).append(members)
    return {name: np.concatenate(members) for name, members in sets.items()}


class _Index:
    """Where the nodes and elements of a part are among all."""

    def __init__(self, part: Part, path: Path, node_start: int, element_start: int) -> None:
        none = np.empty(0, dtype=np.int64)
        self.path, self.part = path, part
        self.node_start, self.element_start = node_start, element_start
        self.node_tags = np.concatenate([none, *part.tags])
        self.tags = np.concatenate([none, *(tags for _, tags, _ in part.elements)])
        # Of a number that is given twice the last one counts, as in Abaqus.
        self._node_order = np.argsort(self.node_tags, kind="stable")
        self._order = np.argsort(self.tags, kind="stable")

    def nodes(self, tags: Indices) -> Indices:
        """Rows of nodes by their numbers; InputError for one that there is not."""
        return self.node_start + self._places(self.node_tags, self._node_order, tags, "node")

    def elements(self, tags: Indices) -> Indices:
        """Numbers of elements among all; those that have no shape are left out."""
        known = tags[np.isin(tags, self.tags)]
        return self.element_start + self._places(self.tags, self._order, known, "element")

    def _places(self, tags: Indices, order: Indices, wanted: Indices, what: str) -> Indices:
        place = np.searchsorted(tags, wanted, side="right", sorter=order) - 1
        found = order[np.maximum(place, 0)] if len(tags) else np.zeros(wanted.shape, dtype=np.int64)
        wrong = wanted.reshape(-1)[(tags[found] != wanted).reshape(-1)] if len(tags) else wanted.reshape(-1)
        if len(wrong):
            raise InputError(
                f"{self.path} speaks of the {what} {wrong[0]}, which it does not have: a whole file is needed"
            )
        return np.asarray(found)


def _named(part: Part, index: _Index) -> _Found:
    of_elements: dict[str, Indices] = {}
    of_nodes: dict[str, Indices] = {}
    elements = {name: _members(part.element_sets, name, index.path, of_elements) for name in part.element_sets}
    nodes = {name: _members(part.node_sets, name, index.path, of_nodes) for name in part.node_sets}
    groups = {name: np.unique(index.elements(tags)) for name, tags in elements.items()}
    node_sets = {name: np.unique(index.nodes(tags)) for name, tags in nodes.items()}
    facet_sets = {}
    for name, kind, rows, where in part.surfaces:
        if kind == "NODE":
            tags = [_resolved(row[0], node_sets, index.nodes, where) for row in rows if row and row[0]]
            node_sets.setdefault(name, np.unique(np.concatenate([np.empty(0, dtype=np.int64), *tags])))
        elif kind == "ELEMENT":
            facet_sets.update(_surface(name, rows, where, part, index, groups))
    return _Found(
        {name: rows for name, rows in groups.items() if len(rows) and name.upper() not in part.internal},
        {name: rows for name, rows in node_sets.items() if len(rows) and name.upper() not in part.internal},
        facet_sets,
    )


def _members(sets: Members, name: str, path: Path, done: dict[str, Indices], above: tuple[str, ...] = ()) -> Indices:
    """All numbers in a set, with those of the sets that it names; done: those that were looked at before."""
    if name in done:
        return done[name]
    found: list[Indices] = [np.empty(0, dtype=np.int64)]
    for member in sets[name]:
        if not isinstance(member, str):
            found.append(member)
            continue
        known = Part.spelled(sets, member.rsplit(".", 1)[-1])
        if known not in sets or known in (*above, name) or len(above) > DEEPEST:
            raise InputError(
                f"the set '{name}' of {path} names the set {shown(member)}: one that it has, not itself and not "
                f"through more than {DEEPEST} others, would be right"
            )
        found.append(_members(sets, known, path, done, (*above, name)))
    done[name] = np.unique(np.concatenate(found))
    return done[name]


def _resolved(word: str, sets: Mapping[str, Indices], numbers: Any, where: str) -> Indices:
    """Rows by the name of a set or by a number."""
    known = Part.spelled(sets, word.rsplit(".", 1)[-1])
    if known in sets:
        return sets[known]
    if word.isdecimal():
        return np.asarray(numbers(np.array([int(word)])))
    raise InputError(f"{where}: there is no set {shown(word)}: one that the file has would be right")


def _surface(
    name: str, rows: list[list[str]], where: str, part: Part, index: _Index, groups: Mapping[str, Indices]
) -> dict[str, Indices]:
    """Nodes of the facets of a surface of elements, by its name; of shells and lines, which are sides of cells."""
    blocks: dict[int, list[Indices]] = {}
    for row in rows:
        if not row or not row[0]:
            continue
        numbers = _resolved(row[0], groups, index.elements, where)
        label = row[1].upper() if len(row) > 1 else ""
        for facets in _sides(numbers - index.element_start, label, part, index, where):
            if len(facets):
                blocks.setdefault(facets.shape[1], []).append(facets)
    if not blocks:
        return {}
    if len(blocks) == 1:
        return {name: np.concatenate(next(iter(blocks.values())))}
    return {f"{name} ({width} corners)": np.concatenate(parts) for width, parts in sorted(blocks.items())}


def _sides(numbers: Indices, label: str, part: Part, index: _Index, where: str) -> list[Indices]:
    """Nodes of one side of some elements, or of all of their sides that no other element has; by blocks of elements."""
    starts = np.cumsum([0, *(len(tags) for _, tags, _ in part.elements)])
    found = []
    for (shape, _, nodes), start, end in zip(part.elements, starts[:-1], starts[1:], strict=True):
        own = numbers[(numbers >= start) & (numbers < end)] - start
        if not len(own):
            continue
        corners = index.nodes(nodes[own][:, : len(AROUND[shape])])
        if label in ("SPOS", "SNEG") or shape not in SIDES:
            found.append(corners)
        elif label:
            side = label.lstrip("SE")
            if not (side.isdecimal() and 1 <= int(side) <= len(SIDES[shape])):
                raise InputError(
                    f"{where}: a {shape} has no side {shown(label)}: S1 to S{len(SIDES[shape])} would be right"
                )
            found.append(corners[:, list(SIDES[shape][int(side) - 1])])
        else:
            found += list(_all_sides(shape, corners).values())
    return found if label else [_outside(facets, part, index) for facets in found]


def _all_sides(shape: str, corners: Indices) -> dict[int, Indices]:
    """Nodes of all sides of elements by the number of their corners, (sides, corners)."""
    widths = {len(side) for side in SIDES[shape]}
    return {
        width: np.concatenate([corners[:, list(side)] for side in SIDES[shape] if len(side) == width])
        for width in widths
    }


def _outside(facets: Indices, part: Part, index: _Index) -> Indices:
    """Those facets that are a side of one element only."""
    sides = [
        sides[facets.shape[1]]
        for shape, _, nodes in part.elements
        if shape in SIDES
        and facets.shape[1] in (sides := _all_sides(shape, index.nodes(nodes[:, : len(AROUND[shape])])))
        and DIMENSIONS[shape] == part.dim
    ]
    kept, place = each_once(np.concatenate([*sides, facets]))
    counts = np.bincount(place, minlength=len(kept))
    once: Indices = facets[counts[place[len(place) - len(facets) :]] == 2]  # its own, and that of its element
    return once
