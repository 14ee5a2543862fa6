"""Communicators that Python may talk on: of the ranks of a mesh, and never freed.

mpi4py 4.0.3 hangs a lock on each communicator on which a lower-case (pickling) call is made.  Under Python 3.13 it
waits for ever if such a communicator is freed while an exception is on its way: so it would be with the duplicate that
DOLFINx makes for each mesh and frees with it.
"""

from __future__ import annotations

import math
import os
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from numbers import Integral, Real
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI

from growthx.common.errors import InputError, raise_on_all, shown

if TYPE_CHECKING:
    from numpy.typing import NDArray

_SAME = (MPI.IDENT, MPI.CONGRUENT)
_kept: list[MPI.Intracomm] = []  # one for each set of ranks other than those MPI knows by itself


def steady(comm: MPI.Comm) -> MPI.Intracomm:
    """A communicator of the same ranks in the same order, which lives as long as the program (collective).

    Raises InputError for what is no communicator of ranks among which this one is.
    """
    if not isinstance(comm, MPI.Intracomm) or not comm:
        what = "MPI.COMM_NULL" if isinstance(comm, MPI.Comm) and not comm else shown(comm)
        raise InputError(f"the communicator is {what}: one that this rank is in, as MPI.COMM_WORLD, would be right")
    for known in (MPI.COMM_WORLD, MPI.COMM_SELF, *_kept):
        if MPI.Comm.Compare(known, comm) in _SAME:
            return known
    _kept.append(MPI.Intracomm(comm.Dup()))
    return _kept[-1]


def same_on_all(values: NDArray[Any], comm: MPI.Comm) -> bool:
    """Whether an array is the same on all ranks, by its checksum (collective)."""
    told = values.shape, values.dtype.str, zlib.crc32(np.ascontiguousarray(values).tobytes())
    return comm.size == 1 or len(set(comm.allgather(told))) == 1


def require_same_on_all(comm: MPI.Comm, told: Mapping[str, Any], of: str = "") -> None:
    """Refuse what the ranks were told differently, before one of them waits for the others in vain (collective).

    told: by name.  of: whose.  Of numbers, texts and what is made of them; of arrays, functions and what lives on a
    mesh, which may be a rank's own, only whether they are there.
    """
    if comm.size == 1:
        return
    here = [leaf for name, value in told.items() for leaf in _leaves(name, value)]
    pairs = zip(comm.bcast(here), here, strict=False)
    name, first, ours = next(
        ((name, first, ours) for (name, first), (other, ours) in pairs if name != other or not _alike(first, ours)),
        ("", "", ""),
    )
    raise_on_all(
        comm,
        name
        and f"{name}{of} is {shown(first)} on rank 0 and {shown(ours)} on rank {comm.rank}: the same on all ranks "
        "would be right",
    )


def _alike(first: float | str, other: float | str) -> bool:
    """Whether two leaves are the same, numbers but for round-off: machines differ in it."""
    if isinstance(first, str) or isinstance(other, str):
        return first == other
    return math.isclose(first, other, rel_tol=1e-9) or (math.isnan(first) and math.isnan(other))


def _leaves(name: str, value: Any) -> Iterator[tuple[str, float | str]]:
    """What can be compared, by where it is; lengths come before what differs in them."""
    if isinstance(value, (str, Enum, bool, np.bool_, os.PathLike)) or value is None:
        yield name, str(value)
    elif isinstance(value, Real):
        yield name, _number(value)
    elif isinstance(value, Mapping):
        yield f"tuple({name})", ", ".join(sorted(map(str, value)))
        for key in sorted(value, key=str):
            yield from _leaves(f"{name}[{key!r}]", value[key])
    elif isinstance(value, (tuple, list)):
        yield f"len({name})", len(value)
        for number, each in enumerate(value):
            yield from _leaves(f"{name}[{number}]", each)
    else:
        yield f"type({name})", type(value).__name__
        if is_dataclass(value) and not isinstance(value, type) and not hasattr(value, "domain"):
            for field in fields(value):
                yield from _leaves(f"{name}.{field.name}", getattr(value, field.name))


def _number(value: Real) -> float | str:
    """A number to be compared, or its text where it is none that a float can be."""
    try:
        return int(value) if isinstance(value, Integral) and abs(float(value)) < 2**53 else float(value)
    except (OverflowError, ValueError):
        return str(value)
