"""Names for the kinds of NumPy arrays that go between the modules (dtypes for the reader, not for mypy)."""

from typing import Any

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
