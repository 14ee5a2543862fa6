"""Arguments looked at before any of them takes time: one sentence for what is not usable."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping
from importlib.util import find_spec
from numbers import Integral, Real
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from growthx.common.errors import InputError, raise_on_all, shown

if TYPE_CHECKING:
    from mpi4py import MPI


LARGEST = 1e100  # of any number: squares and products of larger ones overflow


def require_kind(value: Any, kinds: type | tuple[type, ...], what: str, wanted: str) -> None:
    """Refuse what is of none of these classes."""
    if not isinstance(value, kinds):
        raise InputError(f"{what} is {shown(value)}: {wanted} would be right")


def require_name(value: Any, what: str) -> None:
    """Refuse what is not text."""
    require_kind(value, str, what, "a name in quotes")


def require_each(values: Any, kinds: type | tuple[type, ...], what: str, wanted: str) -> tuple[Any, ...]:
    """The values as a tuple; refuse what is not a tuple or list, or holds anything of none of these classes."""
    require_kind(values, (tuple, list), what, f"a tuple of {wanted}s")
    for value in values:
        require_kind(value, kinds, f"an entry of {what}", f"a {wanted}")
    return tuple(values)


def require_function(value: Any, what: str, wanted: str) -> None:
    """Refuse what cannot be called."""
    if not is_function(value):
        raise InputError(f"{what} is {shown(value)}: {wanted} would be right")


def is_function(value: Any) -> bool:
    """Whether a value is meant to be called: classes and UFL's expressions, which can be, are not."""
    return callable(value) and not isinstance(value, type) and not hasattr(value, "ufl_shape")


def require_vector(values: Any, what: str) -> tuple[float, ...]:
    """The numbers of a vector; refuse what is not a row of finite numbers."""
    if not isinstance(values, (tuple, list)) and getattr(values, "ndim", None) != 1:
        raise InputError(f"{what} is {shown(values)}: a number for each direction would be right")
    for value in values:
        require_number(value, f"a component of {what}", "a finite number", lambda _: True)
    return tuple(float(value) for value in values)


def require_number(value: Any, what: str, wanted: str, holds: Callable[[Any], Any]) -> None:
    """Refuse what is not a finite real number, or not as `holds` wants."""
    if not isinstance(value, Real) or isinstance(value, bool):
        raise InputError(f"{what} is {shown(value)}: {wanted} would be right")
    try:
        number = float(value)
    except OverflowError:  # integers know no infinity
        number = math.inf
    if not (math.isfinite(number) and holds(number)):
        raise InputError(f"{what} is {number:g}: {wanted} would be right")
    if abs(number) > LARGEST:
        raise InputError(f"{what} is {number:g}: one of at most {LARGEST:g}, whatever the units, would be right")


def require(value: Any, what: str, wanted: str, holds: Callable[[Any], Any]) -> None:
    """Refuse a number, any number in a mapping, or a DOLFINx Function's values, if not finite or not as `holds` wants.

    The values of functions of position are checked when they have become DOLFINx Functions.  What is neither a number
    nor a field is refused.
    """
    import numpy as np  # not above: the errors themselves, and so the command's help, do without

    if isinstance(value, Mapping):
        for name, part in value.items():
            require(part, f"{what} of '{name}'", wanted, holds)
    elif hasattr(value, "function_space"):
        from growthx.common.communicators import steady  # MPI, for those who have a mesh

        array = value.x.array
        wrong = array[~((np.abs(array) <= LARGEST) & holds(array))]
        # Every rank raises, or none: one that raised alone would leave the others waiting.
        found = [rank for rank in steady(value.function_space.mesh.comm).allgather(wrong[:1].tolist()) if rank]
        if found:
            raise InputError(f"{what} is {found[0][0]:g} somewhere: {wanted} would be right")
    elif not (is_function(value) or hasattr(value, "ufl_shape") or isinstance(value, np.ndarray)):
        require_number(value, what, wanted, holds)


def require_flag(value: Any, what: str) -> None:
    """Refuse what is neither True nor False."""
    require_kind(value, (bool, np.bool_), what, "True or False")


def require_whole(value: Any, what: str) -> None:
    """Refuse what is no whole number from 1."""
    if not is_whole(value, 1):
        raise InputError(f"{what} is {shown(value)}: a whole number from 1 would be right")


def is_whole(value: Any, lowest: int, highest: float = math.inf) -> bool:
    """Whether a value is a whole number between two, NumPy's ones included."""
    return isinstance(value, Integral) and not isinstance(value, bool) and lowest <= int(value) <= highest


def require_path(value: Any, what: str) -> None:
    """Refuse what names no place on disk."""
    require_kind(value, (str, os.PathLike), what, "its path")
    if not isinstance(os.fspath(value), str) or not os.fspath(value) or "\0" in os.fspath(value):
        raise InputError(f"{what} is {shown(value)}: its path would be right")


def check_picture(path: Any, suffixes: tuple[str, ...], comm: MPI.Comm, *, by: str = "pyvista") -> None:
    """Refuse, on all ranks, a picture that could not be drawn or written (collective).

    suffixes: of the formats there are.  by: the library that draws it.
    """
    require_path(path, "the file of a picture")
    trouble = _no_place_for(Path(path), suffixes) if comm.rank == 0 else ""
    if comm.rank == 0 and not trouble and find_spec(by) is None:
        right = f"{by}, by pip as growthx[pictures] or Debian's python3-{by}"
        trouble = f"the picture {path} is drawn by {by}, which is not installed: {right}, is needed"
    raise_on_all(comm, trouble)


def _no_place_for(file: Path, suffixes: tuple[str, ...]) -> str:
    """Why a picture cannot be written to a file, as a sentence; empty if it can."""
    what, right = f"the picture {file}", "a file in a folder that is there would be right"
    try:
        if file.is_dir():
            return f"{what} is a folder: a file in it would be right"
        if file.suffix not in suffixes:
            return f"{what} has the suffix {file.suffix!r}: one of {', '.join(suffixes)} would be right"
        if not file.parent.is_dir():
            return f"{what} is to be in the folder {file.parent}, which is not there: {right}"
    except OSError as error:
        return f"{what} cannot be written ({error.strerror}): {right}"
    if not os.access(file if file.exists() else file.parent, os.W_OK):
        return f"{what} may not be written: a file in a folder that you may write to would be right"
    return ""


def require_functions(functions: Any, what: str) -> None:
    """Refuse what does not map names to functions."""
    require_kind(functions, Mapping, what, "a mapping from labels to functions")
    for label, function in functions.items():
        require_name(label, f"a label of {what}")
        if not is_function(function):
            raise InputError(f"'{label}' of {what} is {shown(function)}: a function of position would be right")
