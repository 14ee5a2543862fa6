"""Names for the kinds of NumPy arrays that go between the modules (dtypes for the reader, not for mypy)."""

from __future__ import annotations

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


def is_uniform(field: Field) -> bool:
    """Whether the field is one number everywhere."""
    return bool(np.isscalar(field))
