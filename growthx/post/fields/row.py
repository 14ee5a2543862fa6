"""One field that follows from a state, as a row of a table."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from growthx.common.checks import require_flag, require_function, require_kind, require_name
from growthx.common.errors import InputError, shown

if TYPE_CHECKING:
    from growthx.common.arrays import Floats
    from growthx.discretisation.discretisation import Discretisation

SHAPES = ((), (3,), (3, 3))  # by rank: in the plane, too


@dataclass(frozen=True)
class DerivedField:
    """A field that follows from a state.

    value: what it is in UFL, of a problem: a scalar, or several in a list, of which `reading` makes one.
    reading: of numbers for these, (…, scalars) to (…) or, of a rank, (…, 3) or (…, 3, 3): of their means over cells or
    at nodes, or of what they are at points.
    common: what is made of the numbers before, once for all fields of the same value that have it; None: nothing.
    raw: whether it is also told at integration points.
    known: whether a problem has it; None: all have.
    exact: where it is more exact than UFL at points, of a problem and points X, (points, dim), shape (cells, points)
    and that of its rank.
    title: what it is called in tables and pictures; unit: of what kind its unit is, 'no unit' if it has none.
    rank: 0 of a scalar, 1 of a vector, 2 of a tensor, both of them in space.
    told: whether it is told where no fields were asked for by name.
    continuous: whether it is so between cells in a problem, which `exact` then tells at their corners; None: in none.

    Example:
        >>> field = gx.results.DerivedField("squared", lambda problem: problem.density**2, title="ρ²")
        >>> problem = gx.discretise(gx.scenes.plate(2), gx.Q1P0)
        >>> gx.results.register(field)
        >>> values = gx.results.cell_fields(problem)["squared"]
        >>> float(values.max())
        1.0
    """

    name: str
    value: Callable[[Discretisation], Any]
    reading: Callable[[Floats], Floats] | None = None
    raw: bool = True
    exact: Callable[[Discretisation, Floats], Floats] | None = None
    known: Callable[[Discretisation], bool] | None = None
    title: str = ""
    unit: str = ""
    rank: int = 0
    told: bool = True
    continuous: Callable[[Discretisation], bool] | None = None
    common: Callable[[Floats], Floats] | None = None

    def __post_init__(self) -> None:
        require_name(self.name, "the name of a field")
        require_function(self.value, f"the value of the field '{self.name}'", "a function of a problem")
        for what in ("reading", "exact", "known", "continuous", "common"):
            function = getattr(self, what)
            if function is not None:
                require_function(function, f"{what}, of the field '{self.name}',", "a function or None")
        for what, flag in (("raw", self.raw), ("told", self.told)):
            require_flag(flag, f"{what}, of the field '{self.name}',")
        for what, text in (("title", self.title), ("unit", self.unit)):
            require_kind(text, str, f"the {what} of the field '{self.name}'", "a text")
        if self.rank not in range(len(SHAPES)):
            raise InputError(f"the rank of the field '{self.name}' is {shown(self.rank)}: 0, 1 or 2 would be right")

    def scalars(self, problem: Discretisation) -> list[Any]:
        """Its value for a problem; InputError if that is nothing that can be told."""
        value = self.value(problem)
        scalars = [value] if self.reading is None else value
        if not isinstance(scalars, list) or any(getattr(each, "ufl_shape", None) != () for each in scalars):
            right = "a scalar in UFL" if self.reading is None else "a list of scalars in UFL"
            raise InputError(f"the value of the field '{self.name}' is {shown(value)}: {right} would be right")
        return scalars


def read_all(fields: Iterable[DerivedField], numbers: Callable[[DerivedField], Floats]) -> dict[str, Floats]:
    """What some fields are, by name, each (…) and the shape of its rank; what several have in common is made once.

    numbers: for the scalars of a field, (…, scalars).
    """
    found, made = {}, {}
    for field in fields:
        source = field.value, field.common
        if source not in made:
            made[source] = numbers(field) if field.common is None else field.common(numbers(field))
        found[field.name] = made[source][..., 0] if field.reading is None else field.reading(made[source])
    return found
