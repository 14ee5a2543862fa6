"""The rate of momentum, where a scene is not quasi-static."""

from __future__ import annotations

from dataclasses import dataclass

from growthx.common.checks import require_kind
from growthx.common.overrides import Sealed


@dataclass(frozen=True)
class Inertia(Sealed, replaceable=()):
    """The rate of momentum ρ ṗ in the balance of momentum (4), by implicit Euler (Remark 4.2).

    The density must then be in units consistent with force, length and time.
    lumped: mass at the corners of the cells, which densities at integration points do not know.

    Example:
        >>> from dataclasses import replace
        >>> scene = replace(gx.scenes.plate(2), inertia=gx.Inertia(lumped=True))
        >>> scene.inertia
        Inertia(lumped=True)
    """

    lumped: bool = False

    def __post_init__(self) -> None:
        require_kind(self.lumped, bool, "lumped, of the inertia,", "True or False")
