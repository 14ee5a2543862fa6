"""What the parts of a run must remember to go on from an accepted step as if nothing had happened."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from growthx.common.arrays import Floats


@dataclass
class Memory:
    """Numbers, as JSON knows them, and arrays over this rank's degrees of freedom, by name.

    unknowns, densities, displacements: of the problem's unknown, its density and the displacement of one load case,
    entries as in `x.array`.
    """

    numbers: dict[str, Any] = field(default_factory=dict)
    unknowns: dict[str, Floats] = field(default_factory=dict)
    densities: dict[str, Floats] = field(default_factory=dict)
    displacements: dict[str, Floats] = field(default_factory=dict)

    def join(self, other: Memory) -> None:
        """Remember what another one does as well; their names differ."""
        for kind in fields(self):
            getattr(self, kind.name).update(getattr(other, kind.name))
