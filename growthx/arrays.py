"""Names for the kinds of NumPy arrays that go between the modules (dtypes for the reader, not for mypy)."""

from typing import Any

from numpy.typing import NDArray

Floats = NDArray[Any]
Indices = NDArray[Any]
Marks = NDArray[Any]
