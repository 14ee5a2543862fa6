"""Values at the centres of voxels, and between them: trilinear, never beyond them."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from growthx.common.arrays import Floats, Marks

HAIR = 1e-4  # of a voxel, that a place may lie beyond the outermost centres: NIfTI keeps affines in single precision
BLOCK = 500_000  # places at a time


class Voxels:
    """A grid of values in space.

    values: shape (i, j, k), numbers.  affine: (4, 4), from indices of voxels to places of their centres, invertible.
    """

    def __init__(self, values: Floats, affine: Floats) -> None:
        self.values, self.affine = values, np.asarray(affine, dtype=float)
        self._inverse = np.linalg.inv(self.affine)

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
        last = np.array(self.values.shape) - 1
        indices = places @ self._inverse[:3, :3].T + self._inverse[:3, 3]
        beyond = np.where(last == 0, 0.5, HAIR)
        outside = ~((indices >= -beyond) & (indices <= last + beyond)).all(axis=1)
        indices = np.clip(np.where(outside[:, np.newaxis], 0.0, indices), 0.0, last)
        low = np.minimum(indices.astype(np.int64), np.maximum(last - 1, 0))
        shares = indices - low
        found = np.zeros(len(places))
        for corner in product((0, 1), repeat=3):
            weights = np.where(corner, shares, 1.0 - shares).prod(axis=1)
            i, j, k = np.minimum(low + corner, last).T
            found += weights * self.values[i, j, k]
        return found, outside
