"""Names for the kinds of NumPy arrays that go between the modules (dtypes for the reader, not for mypy)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import is_dataclass, replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[Any]
Indices = NDArray[Any]
Marks = NDArray[Any]
Selection = NDArray[Any] | slice


def selection(indices: Indices) -> Selection:
    """The same entries as a slice where they follow one another: NumPy then copies nothing."""
    consecutive = len(indices) > 0 and indices[-1] - indices[0] == len(indices) - 1 and np.all(np.diff(indices) == 1)
    return slice(int(indices[0]), int(indices[-1]) + 1) if consecutive else indices


# A number; a function of x, shape (3, points), to values, shape (points,); a scalar DOLFINx Function; an array of one
# value for each cell, in the order of the mesh's file; or any of these but the Function per named region.
Field = Any
Law = TypeVar("Law", bound="Any")


def is_law(value: Any) -> bool:
    """Whether a parameter of a law is one itself: an object with a tuple `coefficients` of parameters that may vary."""
    return is_dataclass(value) and not isinstance(value, type) and hasattr(value, "coefficients")


def parameters(law: Law) -> dict[str, Field]:
    """The parameters of a law that may vary in space, by name, those of laws among them as "law.parameter"."""
    found: dict[str, Field] = {}
    for name in law.coefficients:
        value = getattr(law, name)
        inner = {f"{name}.{part}": of_part for part, of_part in parameters(value).items()} if is_law(value) else None
        found |= {name: value} if inner is None else inner
    return found


def changed(law: Law, change: Callable[[Field], Field]) -> Law:
    """The law with a change of each of these parameters; itself where that changes none."""
    old = {name: getattr(law, name) for name in law.coefficients}
    new = {name: changed(value, change) if is_law(value) else change(value) for name, value in old.items()}
    new = {name: value for name, value in new.items() if value is not old[name]}
    return replace(law, **new) if new else law


def is_uniform(field: Field) -> bool:
    """Whether the field is one number everywhere."""
    return bool(np.isscalar(field))
