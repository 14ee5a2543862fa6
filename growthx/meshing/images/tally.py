"""What was met where a scan was asked for its density: told in one sentence, of all ranks together."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI

from growthx.common.errors import InputError
from growthx.common.words import place_in_words

if TYPE_CHECKING:
    from growthx.common.arrays import Floats, Marks
    from growthx.meshing.images.relation import Relation

NO_DENSITY = -5.0  # g/cm³: what is below is no density, but has another unit


@dataclass
class Tally:
    """Counts of one rank; places are those of the body."""

    asked: int = 0
    outside: int = 0
    beyond: list[Any] = field(default_factory=list)  # the first place outside
    values: int = 0
    below: int = 0
    lowest: float = np.inf  # before the floor
    highest: float = -np.inf
    where: list[Any] = field(default_factory=list)  # the place of the highest

    def asked_at(self, places: Floats, outside: Marks) -> None:
        """Places at which the scan was asked for its values."""
        self.asked += len(places)
        self.outside += int(np.count_nonzero(outside))
        if not self.beyond and outside.any():
            self.beyond = places[np.argmax(outside)].tolist()

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

    def judged(self, relation: Relation, scan: str, what: str, comm: MPI.Comm) -> str:
        """A notice, or none, on all ranks; InputError, on all of them, for what cannot be used (collective).

        what: the values are of, in the plural.
        """
        told = comm.allgather(self)
        asked, outside = sum(one.asked for one in told), sum(one.outside for one in told)
        if outside:
            place = next(one.beyond for one in told if one.beyond)
            raise InputError(
                f"{outside} of {asked} points ({_percent(outside, asked)}) lie outside the voxel centres of {scan}, at "
                f"{place_in_words(place, 4)} for one: a scan that covers the body, or moved(matrix) or "
                "to('LPS') where its frame is another, would be right"
            )
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
        values, below = sum(one.values for one in told), sum(one.below for one in told)
        if not below:
            return ""
        return (
            f"{below} of {values} {what} ({_percent(below, values)}) have a density from {scan} below the floor, down "
            f"to {lowest:.3g}: they have that of the floor, {relation.floor:g}"
        )


def _percent(part: int, whole: int) -> str:
    return f"{100 * part / max(whole, 1):.3g} %"
