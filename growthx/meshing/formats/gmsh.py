"""gmsh's scripts (.geo), of which gmsh makes meshes: physical groups become named boundaries and regions.

gmsh runs on rank 0 only.
"""

from __future__ import annotations

import json
import math
import re
import signal
import threading
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from growthx.common.checks import LARGEST
from growthx.common.errors import InputError, shown
from growthx.meshing.content import DIMENSIONS
from growthx.meshing.formats import msh_file, msh_records, scripts
from growthx.meshing.formats.msh import SHAPES, SIZES, content
from growthx.meshing.formats.msh_records import Block
from growthx.meshing.parts import each_once, quoted

if TYPE_CHECKING:
    from growthx.meshing.content import Content

SUFFIXES = {".geo": "a gmsh script"}
IS_PROGRAM = True

_NAME = re.compile(r'\bName\s*"([^"]+)"')
_FINER = re.compile(r"surface (\d+) and refining all its bounding edges")
_NO_LIMIT = 1e199  # gmsh says 1e200 where there is none

# gmsh is silent and reads a script to its end: if an error raised (AbortOnError = 2, its default in Python), its parser
# would keep the rest of the script and prepend it to the next file.
_OPTIONS = {"General.Terminal": 0, "General.AbortOnError": 1}


def load() -> None:
    """Import gmsh ahead of its use, for a program that counts imports and set-up apart (rank 0 only, as elsewhere)."""
    import gmsh  # noqa: F401


def read(path: Path, parameters: Mapping[str, float], trusted: bool = False) -> Content:
    """The mesh that gmsh makes of a script.

    Of what is in physical groups, which name its regions and boundaries; of all where there are none.
    parameters: ONELAB's (DefineConstant with a Name), by the last part of their names or, where several end alike,
    their whole names.
    trusted: let the script run programs and write files, see `scripts`.
    """
    merged = scripts.check(path, trusted)
    _check_merged(path, merged)
    with _gmsh_session(path) as gmsh:
        if not _opened_at_once(gmsh, path, parameters, merged):
            _open(gmsh, path)
            if parameters:
                values = _set_parameters(gmsh, path, parameters)
                gmsh.model.remove()
                _open_with(gmsh, path, values)
        dim = max((dim for dim, _ in gmsh.model.getPhysicalGroups() or gmsh.model.getEntities()), default=None)
        if dim is None:
            raise InputError(f"{path} has no physical groups, surfaces or volumes: named ones would be right")
        if dim < 2:
            what = "the physical groups of" if gmsh.model.getPhysicalGroups() else "the entities of"
            raise InputError(
                f"{what} {path} hold no cells but only curves or points: a named group of surfaces or volumes would be "
                "right"
            )
        _check_extent(gmsh, path)
        if len(gmsh.model.mesh.getElementTypes(dim)) == 0:
            with _gmsh_errors(gmsh, path):
                gmsh.model.mesh.generate(dim)
        found = _content(gmsh, path)
        found = replace(found, notices=(*found.notices, *_trouble(gmsh.logger.get(), path)))
    if not any(DIMENSIONS[kind.shape] == dim for kind in found.elements):
        raise InputError(f"the physical groups of {path} hold no cells: a meshed surface or volume would be right")
    return found


def _trouble(log: Iterable[str], path: Path) -> Iterator[str]:
    """A notice of surfaces that gmsh could not mesh as asked, and then meshed with smaller and smaller cells."""
    surfaces = sorted({int(number) for line in log for number in _FINER.findall(line)})
    if surfaces:
        which = f"surface{'s' if len(surfaces) > 1 else ''} {', '.join(map(str, surfaces))}"
        yield (
            f"gmsh found no mesh of {which} of {path} with cells as large as asked, and made them smaller until it "
            "did: other parameters, a slightly different size for one, would give the cells that were meant"
        )


@contextmanager
def _gmsh_session(path: Path) -> Iterator[Any]:
    """The gmsh module, silent; a session of the user's own is left as it was, but for options set by the script."""
    try:
        import gmsh
    except (ImportError, OSError) as error:  # OSError: a system library gmsh needs is missing
        raise InputError(f"reading {path} needs gmsh's Python module, which does not load: {error}") from error
    nested = bool(gmsh.isInitialized())
    if not nested:
        gmsh.initialize(readConfigFiles=False, interruptible=False)
    options = {name: gmsh.option.getNumber(name) for name in _OPTIONS}
    model = gmsh.model.getCurrent()
    known = set(gmsh.onelab.getNames())
    for name, value in _OPTIONS.items():
        gmsh.option.setNumber(name, value)
    gmsh.logger.start()
    try:
        with _interruptible():
            yield gmsh
    finally:
        gmsh.logger.stop()
        if nested:
            for name in set(gmsh.onelab.getNames()) - known:
                gmsh.onelab.clear(name)
            gmsh.model.remove()
            gmsh.model.setCurrent(model)
            for name, value in options.items():
                gmsh.option.setNumber(name, value)
        else:
            gmsh.finalize()


@contextmanager
def _interruptible() -> Iterator[None]:
    """Let Ctrl-C and SIGTERM end the program at once: nothing else is heard while gmsh reads an endless script."""
    if threading.current_thread() is not threading.main_thread():  # which alone may say so
        yield
        return
    before = {number: signal.signal(number, signal.SIG_DFL) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _open(gmsh: Any, path: Path) -> None:
    gmsh.model.add("growthx")  # gmsh opens a file in the current model if that is empty
    with _gmsh_errors(gmsh, path):
        gmsh.open(str(path))


def _opened_at_once(gmsh: Any, path: Path, parameters: Mapping[str, float], merged: Iterable[Path]) -> bool:
    """Open a script whose text tells the whole names of all parameters, so that it need not be read to know them.

    Whether it took their values.  If not, it is as if nothing had been tried: reading it first finds what is wrong.
    """
    if not parameters:
        return False
    known = list(dict.fromkeys(name for file in (path, *merged) for name in _names_in(file)))
    found = [_meant(name, known) for name in parameters]
    if any(len(meant) != 1 for meant in found):
        return False
    values = {meant: _finite(path, name, parameters[name]) for (meant,), name in zip(found, parameters, strict=True)}
    for name, value in values.items():
        gmsh.onelab.setNumber(name, [value])
    before = {name: gmsh.onelab.get(name) for name in values}
    try:
        _open_with(gmsh, path, values)
        known = _numbers(gmsh)
        # What no DefineConstant was reached for is as it was.
        taken = all(gmsh.onelab.get(name) != told for name, told in before.items())
        if taken and [_meant(name, known) for name in parameters] == found:
            return True
    except InputError:
        pass
    for name in values:
        gmsh.onelab.clear(name)
    gmsh.model.remove()
    return False


def _names_in(file: Path) -> list[str]:
    """Of the parameters, as far as the text of a script tells them."""
    return _NAME.findall(file.read_text(errors="replace")) if file.suffix.lower() in SUFFIXES else []


def _meant(name: str, known: Iterable[str]) -> list[str]:
    """The whole names that a name may mean."""
    return [name] if name in known else [whole for whole in known if whole.endswith(f"/{name}")]


def _numbers(gmsh: Any) -> list[str]:
    """The whole names of the parameters that are numbers."""
    own = [name for name in gmsh.onelab.getNames() if not name.startswith(("Gmsh/", "ONELAB/"))]
    return [name for name in own if len(gmsh.onelab.getNumber(name))]


def _open_with(gmsh: Any, path: Path, values: Mapping[str, float]) -> None:
    """Open a script whose parameters have these values; refuse those that it does not want, whatever came of them."""
    problem = None
    try:
        _open(gmsh, path)
    except InputError as error:
        problem = error
    for name, value in values.items():
        _check_value(json.loads(gmsh.onelab.get(name)), path, value)
        if list(gmsh.onelab.getNumber(name)) != [value]:
            raise InputError(
                f"the parameter '{name}' of {path} cannot be {value:g}: the script has it read only, and "
                "without it would be right"
            )
    if problem is not None:
        raise problem


@contextmanager
def _gmsh_errors(gmsh: Any, path: Path) -> Iterator[None]:
    """Raise InputError with the first error gmsh reports."""
    earlier = len(gmsh.logger.get())
    raised = []
    try:
        yield
    except Exception as error:  # gmsh raises nothing more special
        raised = [str(error)]
    try:
        logged = [line.removeprefix("Error: ") for line in gmsh.logger.get()[earlier:] if line.startswith("Error: ")]
    except UnicodeDecodeError:  # gmsh quotes what it does not understand
        logged = ["it has bytes that are no text"]
    if messages := logged + raised:
        raise InputError(f"gmsh cannot make a mesh of {path}: {messages[0]}")


def _set_parameters(gmsh: Any, path: Path, parameters: Mapping[str, float]) -> dict[str, float]:
    """Give the ONELAB parameters of the opened script their values, which count when it is opened again.

    Returns them by their whole names.
    """
    known, values = _numbers(gmsh), {}
    for name, value in parameters.items():
        meant = _meant(name, known)
        if not meant:
            has = quoted(whole.rsplit("/", 1)[-1] for whole in known)
            raise InputError(f"{path} has no parameter '{name}'; it has {has or 'none at all'}")
        if len(meant) > 1:
            raise InputError(f"{path} has {len(meant)} parameters '{name}': {quoted(meant)}, whole, would be right")
        values[meant[0]] = _finite(path, name, value)
        # Cleared, for limits that gmsh makes up, a fifth to five times the value, would stay those of the first value.
        gmsh.onelab.clear(meant[0])
        gmsh.onelab.setNumber(meant[0], [values[meant[0]]])
    return values


def _finite(path: Path, name: str, value: float) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not math.isfinite(number):
        raise InputError(f"the parameter '{name}' of {path} is {shown(value)}: a number would be right")
    return number


def _check_extent(gmsh: Any, path: Path) -> None:
    """Refuse a geometry that reaches out to where gmsh would not come to an end."""
    box = gmsh.model.getBoundingBox(-1, -1) if gmsh.model.getEntities() else (0.0,)
    if not np.all(np.abs(box) <= LARGEST):
        raise InputError(
            f"{path} has points that are nowhere, or too far to be meant: finite coordinates would be right"
        )


def _check_value(parameter: Mapping[str, Any], path: Path, number: float) -> None:
    """Refuse a value out of its limits.

    parameter: as the script left it, opened with the value: limits that gmsh makes up always hold that.
    """
    name = parameter["name"].rsplit("/", 1)[-1]
    low, high, choices = parameter["min"], parameter["max"], parameter.get("choices", [number])
    if not low <= number <= high:
        right = f"{low:g} to {high:g}" if low > -_NO_LIMIT and high < _NO_LIMIT else ""
        right = right or (f"at most {high:g}" if high < _NO_LIMIT else f"at least {low:g}")
        raise InputError(f"the parameter '{name}' of {path} is {number:g}: {right} would be right")
    if number not in choices:
        allowed = ", ".join(f"{choice:g}" for choice in choices)
        raise InputError(f"the parameter '{name}' of {path} is {number:g}: one of {allowed} would be right")


def _content(gmsh: Any, path: Path) -> Content:
    """What gmsh's current model holds: all in physical groups, or all there is where there are none."""
    groups = gmsh.model.getPhysicalGroups()
    blocks = []
    for dim, entity in gmsh.model.getEntities():
        own = np.unique(np.abs(gmsh.model.getPhysicalGroupsForEntity(dim, entity).astype(np.int64)))
        if groups and not len(own):
            continue
        own = own if len(own) else np.zeros(1, dtype=np.int64)
        for kind, tags, flat in zip(*gmsh.model.mesh.getElements(dim, entity), strict=True):
            if kind not in SHAPES:
                what = gmsh.model.mesh.getElementProperties(kind)[0]
                raise InputError(f"the mesh of {path} has elements of gmsh's type {what}: simpler ones would be right")
            blocks.append(
                Block(
                    int(kind),
                    tags.astype(np.int64),
                    flat.astype(np.int64).reshape(len(tags), -1),
                    np.broadcast_to(np.int64(entity), len(tags)),
                    np.broadcast_to(own, (len(tags), len(own))),
                )
            )
    tags, flat, _ = gmsh.model.mesh.getNodes()
    names = {key: name for key in groups if (name := gmsh.model.getPhysicalName(*key))}
    return content(path, "gmsh script", (tags.astype(np.int64), flat.reshape(-1, 3)), blocks, names, groups)


def _check_merged(path: Path, merged: Iterable[Path]) -> None:
    """Refuse a script that merges a file whose elements name their groups, where gmsh would mix them up.

    A file that is not whole is refused, too: some crash gmsh.
    """
    for file in merged:
        if file.suffix.lower() != ".msh":
            continue
        found = msh_file.load(file)
        if found.version.startswith("4") or not any(map(_mixed, msh_records.read_records(found, SIZES))):
            continue
        raise InputError(
            f"{path} merges {file}, in which elements of one elementary tag are in different physical groups: gmsh "
            "would mix them up, and a file of version 4, or that file without a script, would be right"
        )


def _mixed(block: Block) -> bool:
    """Whether any entity has elements in different groups: all of its elements would get the groups of any."""
    _, place = each_once(block.nodes)
    groups, entities = block.groups[:, 0], block.entities
    pairs = np.unique(np.column_stack([entities, groups, place])[groups > 0], axis=0)
    entities_of_pairs = np.unique(pairs[:, :2], axis=0)[:, 0]
    names, counts = np.unique(np.unique(np.column_stack([entities, place]), axis=0)[:, 0], return_counts=True)
    return len(pairs) != counts[np.searchsorted(names, entities_of_pairs)].sum()
