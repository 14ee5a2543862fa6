"""What was met where a scan was asked for its density: told in one sentence, of all ranks together."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI

from growthx.common.errors import InputError
from growthx.common.words import place_in_words

if TYPE_CHECKING:
    from collections.abc import Callable

    from growthx.common.arrays import Floats, Marks
    from growthx.meshing.images.relation import Relation

NO_DENSITY = -5.0  # g/cm³: what is below is no density, but has another unit
DENSE = 5.0  # g/cm³: numbers up to that may be densities
NO_CONTRAST = 0.1  # of what numbers up to that differ by: what a calibration of HU leaves of it is far below


@dataclass
class Tally:
    """Counts of one rank; places are those of the body."""

    asked: int = 0
    outside: int = 0
    beyond: list[Any] = field(default_factory=list)  # the first place outside
    box: list[Any] = field(default_factory=list)  # least and largest coordinates of all places
    raw: tuple[float, float] = (np.inf, -np.inf)  # least and largest value of the scan itself, inside
    values: int = 0
    below: int = 0
    lowest: float = np.inf  # before the floor
    highest: float = -np.inf
    where: list[Any] = field(default_factory=list)  # the place of the highest

    def asked_at(self, places: Floats, values: Floats, outside: Marks) -> None:
        """Places at which the scan was asked for its values, and which of them lie outside."""
        if not len(places):
            return
        self.asked += len(places)
        self.outside += int(np.count_nonzero(outside))
        if not self.beyond and outside.any():
            self.beyond = places[np.argmax(outside)].tolist()
        ends = np.vstack([places.min(axis=0), places.max(axis=0), *self.box])
        self.box = [ends.min(axis=0), ends.max(axis=0)]
        if len(inside := values[~outside]):
            self.raw = min(self.raw[0], float(inside.min())), max(self.raw[1], float(inside.max()))

    def found(self, density: Floats, places: Floats, floor: float) -> None:
        """Densities that came of them, before the floor."""
        if not len(density):
            return
        self.values += len(density)
        self.below += int(np.count_nonzero(density < floor))
        self.lowest = min(self.lowest, float(density.min()))
        most = int(np.argmax(density))
        if density[most] > self.highest:
            self.highest, self.where = float(density[most]), places[most].tolist()

    def judged(self, relation: Relation, scan: str, what: str, comm: MPI.Comm, fits: Callable[[Floats], bool]) -> str:
        """A notice, or none, on all ranks; InputError, on all of them, for what cannot be used (collective).

        what: the values are of, in the plural.  fits: whether a body with such corners, (2, 2 or 3), the least and the
        largest coordinates, would lie inside if x and y had the other sign.
        """
        told = comm.allgather(self)
        _check_places(told, scan, fits)
        _check_units(told, relation, scan)
        values, below = sum(one.values for one in told), sum(one.below for one in told)
        if not below:
            return ""
        lowest = min(one.lowest for one in told)
        return (
            f"{below} of {values} {what} ({_percent(below, values)}) have a density from {scan} below the floor, down "
            f"to {lowest:.3g}: they have that of the floor, {relation.floor:g}"
            + ("; so few are of bone that the body may not lie where the scan has it" if 2 * below > values else "")
        )


def _check_places(told: list[Tally], scan: str, fits: Callable[[Floats], bool]) -> None:
    """Refuse a scan that does not cover the body."""
    asked, outside = sum(one.asked for one in told), sum(one.outside for one in told)
    if not outside:
        return
    place = next(one.beyond for one in told if one.beyond)
    ends = np.vstack([end for one in told for end in one.box])
    right = "a scan that covers the body, or moved(matrix) or to('LPS') where its frame is another, would be right"
    if fits(np.stack([ends.min(axis=0), ends.max(axis=0)])):
        right = (
            "with the other sign of x and y all lie inside, so that the other frame, to('LPS') or, of one in LPS, "
            "to('RAS'), would be right"
        )
    raise InputError(
        f"{outside} of {asked} points ({_percent(outside, asked)}) lie outside the voxel centres of {scan}, at "
        f"{place_in_words(place, 4)} for one: {right}"
    )


def _check_units(told: list[Tally], relation: Relation, scan: str) -> None:
    """Refuse HU that are taken for densities, densities that are taken for HU, and what is neither."""
    lowest, highest = min(one.lowest for one in told), max(one.highest for one in told)
    if relation.is_none and lowest < NO_DENSITY:
        raise InputError(
            f"the values of {scan} are taken for densities (a = 0, b = 1) and fall to {lowest:.4g}: they are HU, "
            "it seems, for which a and b of a calibration, ρ = a + b HU, would be right"
        )
    if highest > relation.largest:
        place = next(one.where for one in told if one.highest == highest)
        raise InputError(
            f"the density of {scan} reaches {highest:.4g} at {place_in_words(place, 4)}, above "
            f"{relation.largest:g}: a and b that turn HU into g/cm³, or largest= for other units, would be right"
        )
    least, most = min(one.raw[0] for one in told), max(one.raw[1] for one in told)
    if relation.is_none or not -DENSE <= least < most <= DENSE:
        return
    contrast = float(np.ptp(relation(np.array([least, most]))))
    if contrast < NO_CONTRAST * (most - least):
        raise InputError(
            f"the values of {scan} lie between {least:.4g} and {most:.4g} in the body and are taken for HU: they are "
            "densities already, it seems, for which a = 0 and b = 1 would be right"
        )


def _percent(part: int, whole: int) -> str:
    return f"{100 * part / max(whole, 1):.3g} %"
