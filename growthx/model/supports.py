"""Where a body is held: prescribed displacements of boundaries and of nodes."""

from __future__ import annotations

from dataclasses import dataclass

from growthx.common.checks import require_kind, require_name, require_number, require_vector
from growthx.common.errors import InputError, shown
from growthx.common.overrides import Sealed
from growthx.common.words import place_in_words
from growthx.model.actions.histories import History, check_history


class Held(Sealed, replaceable=()):
    """What supports share: a displacement, of which some directions may be free."""

    displacement: tuple[float | None, ...] | None
    history: History | None

    @property
    def place(self) -> str:
        """Where it holds, as a part of a sentence and as its name."""
        raise NotImplementedError

    def _check_displacement(self) -> None:
        what = f"the displacement of the support '{self.place}'"
        if self.displacement is not None:
            require_kind(self.displacement, (tuple, list), what, "a tuple of numbers or None")
        for value in self.displacement or ():
            if value is not None:
                require_number(value, what, "a finite number", lambda _: True)
        check_history(self.history, f"the support '{self.place}'")

    def components(self, dim: int) -> list[tuple[int, float]]:
        """Pairs (direction, prescribed value) of the directions that are held."""
        values = (0.0,) * dim if self.displacement is None else self.displacement
        if len(values) != dim:
            raise InputError(
                f"the displacement {shown(values)} of the support '{self.place}' has {len(values)} entries: "
                f"the mesh needs {dim}"
            )
        return [(i, float(value)) for i, value in enumerate(values) if value is not None]


@dataclass(frozen=True)
class Support(Held, replaceable=()):
    """Prescribed displacement of a named boundary.

    displacement: one entry (length) per direction, None where the boundary is free to move; default: clamped.
    Values other than zero grow with the load.
    history: share of the displacement as a function of time, or a `Table`, in place of the program's ramp.

    Example:
        >>> rollers = gx.Support("left", displacement=(0.0, None))  # held along x, free along y
        >>> rollers.displacement
        (0.0, None)
    """

    on: str
    displacement: tuple[float | None, ...] | None = None
    history: History | None = None

    def __post_init__(self) -> None:
        require_name(self.on, "the boundary of a support")
        self._check_displacement()

    @property
    def place(self) -> str:
        """The boundary."""
        return self.on


@dataclass(frozen=True)
class PointSupport(Held, replaceable=()):
    """Prescribed displacement of the node at a place.

    at: the place at rest, one entry (length) per direction.  displacement, history: as in `Support`.

    Example:
        >>> pin = gx.PointSupport(at=(0.0, 0.5), displacement=(None, 0.0))
        >>> pin.at
        (0.0, 0.5)
    """

    at: tuple[float, ...]
    displacement: tuple[float | None, ...] | None = None
    history: History | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "at", require_vector(self.at, "the place of a support"))
        self._check_displacement()

    @property
    def place(self) -> str:
        """The place, as text."""
        return place_in_words(self.at)
