"""Files of meshes, one module for each format, which is imported when a file is first read.

A format is a module of this folder that `OURS` names, or anything of the user's given to `register`, with

    SUFFIXES             what a file is by its suffix, such as {".msh": "a gmsh mesh"}
    read(path, values)   what the file holds, as `Content`, or the whole mesh, as `Parts`; values: of parameters by
                         name, which are the file's own

and, for files that are programs, IS_PROGRAM = True: they are read with a third argument, whether they are trusted.
Suffixes count in small letters, whatever case a file's name has.

`read` is called on rank 0 alone, with a file that is there and may be read.  It imports the library that it needs, and
raises InputError, a sentence that names the file, for one of no use and for parameters that it does not have
(`parts.no_parameters`).  What holds for all formats is looked at after it: whether numbers are those of nodes that
there are, corners and facets (`parts.check`).  Splitting and spreading over the ranks follow.
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol, cast

from growthx.common.checks import require_function, require_kind
from growthx.common.errors import InputError, shown
from growthx.meshing.content import Content
from growthx.meshing.parts import Parts

OURS = ("gmsh", "msh", "abaqus", "febio", "foreign", "stl")


class Format(Protocol):
    """A module, or an object, that reads files of some suffixes."""

    SUFFIXES: Mapping[str, str]

    def read(self, path: Path, values: Mapping[str, float], /) -> Content | Parts:
        """The whole mesh in a file."""
        ...


class Program(Format, Protocol):
    """One whose files are programs."""

    IS_PROGRAM: bool

    def read(self, path: Path, values: Mapping[str, float], trusted: bool = False, /) -> Content | Parts:
        """The whole mesh that a file makes, which may do whatever it likes only if it is trusted."""
        ...


_registered: list[Format] = []


def register(form: Format) -> None:
    """Let `meshing.read` read the files of one more format (on all ranks, as their sentences tell all there are).

    Raises InputError for what is no format, and for suffixes that another one has.
    """
    suffixes: Any = getattr(form, "SUFFIXES", None)
    require_kind(suffixes, Mapping, "SUFFIXES, of a format of meshes,", 'a mapping such as {".msh": "a gmsh mesh"}')
    require_function(getattr(form, "read", None), "read, of a format of meshes,", "a function of a path and parameters")
    for suffix, what in suffixes.items():
        if not (
            isinstance(suffix, str) and Path(f"mesh{suffix}").suffix == suffix.lower() != "" and isinstance(what, str)
        ):
            raise InputError(
                f"the suffix of a format of meshes is {shown(suffix)}, for {shown(what)}: one such as '.msh', and what "
                "such a file is, would be right"
            )
        if known().get(suffix, form) is not form:
            raise InputError(f"files of the suffix {suffix} are those of another format: one of its own would be right")
    if form not in _registered:
        _registered.append(form)


def known() -> dict[str, Format]:
    """The formats by their suffixes."""
    ours = [cast(Format, importlib.import_module(f"{__name__}.{name}")) for name in OURS]
    return {suffix: form for form in (*ours, *_registered) for suffix in form.SUFFIXES}


def of(path: Path) -> Format:
    """The format of a file by its suffix; InputError if there is none."""
    formats = known()
    suffix = path.suffix.lower()
    if suffix not in formats:
        *others, last = in_words()
        raise InputError(f"{path} is neither {', '.join(others)} nor {last}")
    return formats[suffix]


def in_words() -> list[str]:
    """What a file of a mesh may be, each as "a gmsh mesh (.msh)"."""
    return [f"{form.SUFFIXES[suffix]} ({suffix})" for suffix, form in known().items()]
