"""Input files of Abaqus and CalculiX (.inp): sets of elements are groups, sets of nodes and surfaces boundaries.

Our own reader: meshio's leaves surfaces out and takes assemblies for one part.  Materials, steps and all else that is
no mesh are passed over.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from growthx.common.errors import InputError, shown
from growthx.meshing.content import Content
from growthx.meshing.formats.abaqus.elements import shape_of
from growthx.meshing.formats.abaqus.model import Part, joined
from growthx.meshing.parts import no_parameters

if TYPE_CHECKING:
    from pathlib import Path

    from growthx.common.arrays import Floats, Indices

SUFFIXES = {".inp": "an Abaqus input file"}

_MAKERS = ("NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY", "SYSTEM", "ELEMENT OUTPUT MATRIX", "MATRIX ASSEMBLE")
_DEEPEST = 10  # files that include files
MOST = 20_000_000  # numbers that a line makes


@dataclass
class _Block:
    """A keyword with its parameters and data lines; line: its number in its file."""

    keyword: str
    parameters: dict[str, str]
    file: Path
    line: int
    data: list[str] = field(default_factory=list)

    @property
    def where(self) -> str:
        """Its place, as sentences name it."""
        return f"{self.file}, line {self.line}"

    def needed(self, name: str) -> str:
        """The value of a parameter; InputError if there is none."""
        if not self.parameters.get(name):
            raise InputError(f"{self.where}: *{self.keyword} has no {name}: {name}=… would be right")
        return self.parameters[name]


def read(path: Path, values: Mapping[str, float]) -> Content:
    """The mesh of an input file, of all of its instances where it has an assembly."""
    no_parameters(path, values)
    parts: dict[str, Part] = {}
    instances: dict[str, Part] = {}
    whole = Part("")
    current, in_assembly = whole, False
    of_assembly: set[str] = set()
    for block in _blocks(path, path.parent, 0):
        keyword = block.keyword
        if keyword in _MAKERS:
            raise InputError(
                f"{block.where}: *{keyword} makes or moves nodes and elements, which is for Abaqus itself: a file in "
                "which all of them are written out would be right"
            )
        if keyword == "PART":
            current = parts[block.needed("NAME").upper()] = Part(block.needed("NAME"))
        elif keyword == "INSTANCE":
            current = _instance(block, parts)
            instances[current.name.upper()] = current
        elif keyword in ("END PART", "END INSTANCE"):
            current = whole
        elif keyword in ("ASSEMBLY", "END ASSEMBLY"):
            in_assembly = keyword == "ASSEMBLY"
        else:
            named = block.parameters.get("INSTANCE")
            if in_assembly and current is whole and named is None and keyword in ("NSET", "ELSET", "SURFACE"):
                _share(block, instances, whole)
            else:
                _fill(block, current, instances)
            if in_assembly and current is whole:
                name = block.parameters.get("NAME" if keyword == "SURFACE" else keyword, "")
                of_assembly.add(name.upper())
    return joined(path, whole, list(instances.values()) or list(parts.values()), of_assembly)


def _instance(block: _Block, parts: Mapping[str, Part]) -> Part:
    """A copy of a part, moved as the data lines of the instance say."""
    name, of = block.needed("NAME"), block.needed("PART")
    if of.upper() not in parts:
        raise InputError(f"{block.where}: there is no part {shown(of)}: one that the file has would be right")
    instance = parts[of.upper()].copy(name)
    rows = [_floats([word for word in line.split(",") if word.strip()], block) for line in block.data]
    if rows and len(rows[0]) >= 3:
        instance.shift = rows[0][:3]
    if len(rows) > 1:
        if len(rows[1]) != 7:
            raise InputError(
                f"{block.where}: a rotation is {len(rows[1])} numbers: two points and an angle, 7, are one"
            )
        instance.turn = rows[1]
    return instance


def _fill(block: _Block, part: Part, instances: Mapping[str, Part]) -> None:
    """Put what a block says of a mesh into its part, or into the instance that it names."""
    keyword, parameters = block.keyword, block.parameters
    if keyword not in ("NODE", "ELEMENT", "NSET", "ELSET", "SURFACE"):
        return
    if "INSTANCE" in parameters:
        name = parameters["INSTANCE"].upper()
        if name not in instances:
            raise InputError(f"{block.where}: there is no instance {shown(parameters['INSTANCE'])}")
        part = instances[name]
    if "INTERNAL" in parameters:
        part.internal.add(parameters.get(keyword, "").upper())
    if keyword == "NODE":
        if parameters.get("SYSTEM", "R").upper() != "R":
            raise InputError(f"{block.where}: the nodes are in a curved system: rectangular coordinates would be right")
        part.add_nodes(*_nodes(block), parameters.get("NSET"))
    elif keyword == "ELEMENT":
        _add_elements(block, part)
    elif keyword in ("NSET", "ELSET"):
        sets = part.node_sets if keyword == "NSET" else part.element_sets
        _add_members(block, part.spelled(sets, block.needed(keyword)), sets)
    else:
        rows = [[cell.strip() for cell in line.split(",")] for line in block.data]
        part.surfaces.append((block.needed("NAME"), parameters.get("TYPE", "ELEMENT").upper(), rows, block.where))


def _share(block: _Block, instances: Mapping[str, Part], whole: Part) -> None:
    """Put a set or a surface of an assembly into the instances whose numbers and sets it names."""
    kind = (
        "node_sets" if block.keyword == "NSET" or block.parameters.get("TYPE", "").upper() == "NODE" else "element_sets"
    )
    surface = block.keyword == "SURFACE"
    rows = [[cell.strip().strip('"') for cell in line.split(",")] for line in block.data]
    if not surface:
        rows = [[word] for row in rows for word in row]
    for row in rows:
        if not row[0]:
            continue
        instance, _, member = row[0].rpartition(".")
        if instance.upper() in instances:
            holders = [instances[instance.upper()]]
        else:
            member = row[0]
            known = [*instances.values(), whole]
            holders = [one for one in known if one.spelled(getattr(one, kind), member) in getattr(one, kind)]
        if not holders:
            raise InputError(
                f"{block.where}: there is no set {shown(row[0])} in the instances: INSTANCE=…, or instance.set, would "
                "be right"
            )
        for part in holders:
            inner = replace(block, data=[", ".join([member, *row[1:]])], parameters=dict(block.parameters))
            _fill(inner, part, {})


def _add_elements(block: _Block, part: Part) -> None:
    kind = block.needed("TYPE").upper()
    known = shape_of(kind)
    if known is None:
        part.left_out[kind] = part.left_out.get(kind, 0) + len(block.data)
        return
    shape, width, notice = known
    numbers = _integers(",".join(block.data), block)
    if len(numbers) % (width + 1):
        raise InputError(
            f"{block.where}: the elements of type {kind} have {len(numbers)} numbers in all: {width + 1} for each, its "
            f"own and its {width} nodes', would be right"
        )
    if notice:
        part.told.add(notice)
    rows = numbers.reshape(-1, width + 1)
    part.add_elements(shape, rows[:, 0], rows[:, 1:], block.parameters.get("ELSET"))


def _add_members(block: _Block, name: str, sets: dict[str, list[Indices | str]]) -> None:
    """Numbers, ranges of them, or names of other sets."""
    members = sets.setdefault(name, [])
    text = ",".join(block.data)
    if "GENERATE" in block.parameters:
        for line in block.data:
            row = _integers(line, block)
            step = int(row[2]) if len(row) == 3 else 1
            if len(row) not in (2, 3) or step < 1 or not 0 <= (int(row[1]) - int(row[0])) // step <= MOST:
                raise InputError(f"{block.where}: {shown(line)} generates no set: first, last and step would be right")
            members.append(np.arange(row[0], row[1] + 1, step))
        return
    words = [word for word in (word.strip().strip('"') for word in text.split(",")) if word]
    names = [word for word in words if not re.fullmatch(r"[+-]?\d+", word)]
    members += names
    if len(names) < len(words):
        members.append(_integers(",".join(word for word in words if re.fullmatch(r"[+-]?\d+", word)), block))


def _nodes(block: _Block) -> tuple[Indices, Floats]:
    """Numbers and coordinates of the nodes of a block: what is not written is 0, what follows the third is a normal."""
    rows = [[*line.split(","), "", "", ""][:4] for line in block.data]
    words = [word if word and not word.isspace() else "0" for row in rows for word in row]
    numbers = np.array(_floats(words, block)).reshape(-1, 4)
    tags = numbers[:, 0]
    whole = (tags == np.round(tags)) & (tags > 0) & (tags < 2.0**53)
    if not (np.all(np.isfinite(numbers)) and np.all(whole)):
        raise InputError(f"{block.where}: nodes have no whole numbers or no finite coordinates: such would be right")
    return tags.astype(np.int64), numbers[:, 1:]


def _floats(words: list[str], block: _Block) -> list[float]:
    try:
        return [float(word) for word in words]
    except ValueError:
        try:
            return [float(re.sub("[dD]", "e", word)) for word in words]
        except ValueError:
            raise InputError(f"{block.where}: *{block.keyword} has what is no number: numbers would be right") from None


def _integers(text: str, block: _Block) -> Indices:
    try:
        return np.array([int(word) for word in text.split(",") if word.strip()], dtype=np.int64)
    except (ValueError, OverflowError):
        raise InputError(
            f"{block.where}: *{block.keyword} has what is no whole number: whole numbers would be right"
        ) from None


def _blocks(path: Path, folder: Path, depth: int) -> Iterator[_Block]:
    """The keywords of a file with their data, those of included files in their places."""
    block: _Block | None = None
    continued = ""
    for number, raw in enumerate(_text(path).splitlines(), start=1):
        line = raw.strip()
        if not line or line.startswith("**"):
            continue
        if line.startswith("*") or continued:
            line = continued + line
            continued = line if line.endswith(",") and line.startswith("*") else ""
            if continued:
                continue
            yield from _finished(block, folder, depth)
            block = _keyword(line, path, number)
        elif block is None:
            raise InputError(
                f"{path}, line {number}: {shown(line)} comes before any keyword: *NODE or so would be right"
            )
        else:
            block.data.append(line)
    yield from _finished(block, folder, depth)


def _finished(block: _Block | None, folder: Path, depth: int) -> Iterator[_Block]:
    """A block whose data are complete: with those of another file where it names one."""
    if block is None:
        return
    other = block.parameters.get("INPUT", "").strip('"')
    if not other:
        if block.keyword == "INCLUDE":
            block.needed("INPUT")
        yield block
        return
    file = (folder / other).resolve()
    if depth >= _DEEPEST:
        raise InputError(f"{block.where}: files include each other more than {_DEEPEST} deep: fewer would be right")
    if not file.is_relative_to(folder.resolve()) or not file.is_file():
        raise InputError(f"{block.where}: there is no file {other} in {folder}: one in the same folder would be right")
    if block.keyword == "INCLUDE":
        yield from _blocks(file, folder, depth + 1)
    else:
        block.data += [line.strip() for line in _text(file).splitlines() if line.strip() and line[:1] != "*"]
        yield block


def _keyword(line: str, path: Path, number: int) -> _Block:
    """A keyword line, such as *ELEMENT, TYPE=C3D8, ELSET=bone."""
    first, *rest = re.findall(r'(?:[^,"]|"[^"]*"|")+', line[1:]) or [""]  # a comma in quotes is of the name
    parameters = {}
    for part in rest:
        name, _, value = part.partition("=")
        parameters[name.strip().upper()] = value.strip().strip('"')
    return _Block(" ".join(first.upper().split()), parameters, path, number)


def _text(path: Path) -> str:
    content = path.read_bytes().removeprefix(b"\xef\xbb\xbf")
    if b"\0" in content:
        raise InputError(f"{path} has bytes that are no text: an Abaqus input file would be right")
    try:
        return content.decode()
    except UnicodeDecodeError:
        return content.decode("latin-1")
