"""Values at the centres of voxels, and between them: trilinear, never beyond them."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from growthx.common.arrays import Floats, Marks

HAIR = 1e-4  # of a voxel, that a place may lie beyond the outermost centres: NIfTI keeps affines in single precision
BLOCK = 20_000  # places at a time, few enough to stay in the processor's cache


class Voxels:
    """A grid of values in space.

    values: shape (i, j, k), numbers.  affine: (4, 4), from indices of voxels to places of their centres, invertible.
    """

    def __init__(self, values: Floats, affine: Floats) -> None:
        self.values, self.affine = np.ascontiguousarray(values), np.asarray(affine, dtype=float)
        self._inverse = np.linalg.inv(self.affine)
        self._flat = self.values.reshape(-1)
        self._strides = np.array([values.shape[1] * values.shape[2], values.shape[2], 1], dtype=np.int64)

    @property
    def spacing(self) -> Floats:
        """Distance of voxels along each axis of the array, (3,), positive."""
        return np.linalg.norm(self.affine[:3, :3], axis=0)

    @property
    def corners(self) -> tuple[Floats, Floats]:
        """Least and largest coordinates of the outermost centres, (3,) each."""
        ends = np.array(list(product(*((0, count - 1) for count in self.values.shape))))
        places = ends @ self.affine[:3, :3].T + self.affine[:3, 3]
        return places.min(axis=0), places.max(axis=0)

    def at(self, places: Floats) -> tuple[Floats, Marks]:
        """Values at places, (places, 3), and which of these lie beyond the centres, where they are those of the border.

        Along an axis of one voxel values do not change, as far as that reaches.
        """
        found, outside = np.empty(len(places)), np.empty(len(places), dtype=bool)
        for start in range(0, len(places), BLOCK):
            part = slice(start, start + BLOCK)
            found[part], outside[part] = self._at(places[part])
        return found, outside

    def _at(self, places: Floats) -> tuple[Floats, Marks]:
        last = np.array(self.values.shape)[:, np.newaxis] - 1
        indices = self._inverse[:3, :3] @ places.T + self._inverse[:3, 3:]
        beyond = np.where(last == 0, 0.5, HAIR)
        outside = ~((indices >= -beyond) & (indices <= last + beyond)).all(axis=0)
        indices[:, outside] = 0.0
        np.clip(indices, 0.0, last, out=indices)
        low = np.minimum(indices.astype(np.int64), np.maximum(last - 1, 0))
        shares = indices - low
        first = self._strides @ low
        found = np.zeros(len(places))
        for corner in product((0, 1), repeat=3):
            ends = [share if end else 1.0 - share for share, end in zip(shares, corner, strict=True)]
            next_to = first + self._strides @ (np.array(corner) * (last[:, 0] > 0))
            found += ends[0] * ends[1] * ends[2] * self._flat[next_to]
        return found, outside
