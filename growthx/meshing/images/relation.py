"""From Hounsfield units to apparent density: HU, equivalent density, ash density, apparent density."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from growthx.common.checks import require_number
from growthx.common.errors import InputError, shown

if TYPE_CHECKING:
    from growthx.common.arrays import Floats


@dataclass(frozen=True)
class Relation:
    """ρ = a + b HU, or, with ash = (c, d, r), ρ = [c + d (a + b HU)] / r; lifted to a floor.

    a, b: of the calibration, density, and density per HU.  ash: offset and slope from the calibrated to the ash
    density, and ash per apparent density.  floor: the lowest density.  largest: above it something is wrong.
    """

    a: float
    b: float
    ash: tuple[float, float, float] | None
    floor: float
    largest: float

    def __post_init__(self) -> None:
        for name in ("a", "b"):
            require_number(getattr(self, name), f"{name} of ρ = a + b HU", "a finite number", lambda _: True)
        if self.b == 0:
            raise InputError("b of ρ = a + b HU is 0: with it, the scan would have no say; a positive number is right")
        if self.ash is not None:
            if not isinstance(self.ash, (tuple, list)) or len(self.ash) != 3:
                raise InputError(
                    f"ash is {shown(self.ash)}: (c, d, r) of ρ = [c + d (a + b HU)] / r, with r the ash density per "
                    "apparent density, would be right"
                )
            for value in self.ash:
                require_number(value, "a number of ash", "a finite number", lambda _: True)
            require_number(self.ash[2], "the ash density per apparent density", "a positive number", lambda r: r > 0)
        require_number(self.floor, "the floor of the scan's density", "a positive number", lambda rho: rho > 0)
        if not (isinstance(self.largest, float) and self.largest == np.inf):
            right = f"a number above the floor, {self.floor:g}"
            require_number(self.largest, "the largest density of a scan", right, lambda rho: rho > self.floor)

    def __call__(self, hounsfield: Floats) -> Floats:
        """Density, as it comes."""
        calibrated = self.a + self.b * hounsfield
        if self.ash is None:
            return calibrated
        offset, slope, share = self.ash
        return (offset + slope * calibrated) / share

    @property
    def is_none(self) -> bool:
        """Whether the scan's values are taken for densities as they are."""
        return (self.a, self.b, self.ash) == (0, 1, None)
