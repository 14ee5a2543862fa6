"""What all dead loads have in common, wherever they act: forces that do not depend on the state."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import TYPE_CHECKING

from growthx.common.overrides import Sealed

if TYPE_CHECKING:
    from growthx.meshing.mesh import Mesh
    from growthx.model.arrows import Arrow


class DeadLoad(Sealed, ABC, replaceable=("place", "history", "arrow")):
    """A load that does not depend on the state."""

    @property
    @abstractmethod
    def place(self) -> str:
        """Where it acts, as a part of a sentence."""

    @property
    def history(self) -> Callable[[float], float] | None:
        """Its share as a function of time, in place of the program's ramp."""
        return None

    def arrow(self, mesh: Mesh) -> Arrow | None:
        """What shows it in pictures, if anything does (collective)."""
        return None
