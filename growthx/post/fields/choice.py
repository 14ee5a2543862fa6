"""Which fields a run is to leave, and where: by name, and as means over cells, averaged to nodes or at points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from growthx.common.checks import require_kind, require_name
from growthx.common.errors import InputError

if TYPE_CHECKING:
    from growthx.discretisation.discretisation import Discretisation
    from growthx.post.fields.row import DerivedField

PLACES = ("cells", "nodes", "points")
ENDINGS = {"cells": "_in_cells", "nodes": "_at_nodes", "points": "_at_points"}  # of names in files


@dataclass(frozen=True)
class Choice:
    """The names of fields that are wanted as means over cells, averaged to nodes and at integration points."""

    cells: tuple[str, ...] = ()
    nodes: tuple[str, ...] = ()
    points: tuple[str, ...] = ()

    @property
    def files(self) -> set[str]:
        """Names of the series that they are kept in."""
        return ({"fields"} if self.cells or self.nodes else set()) | ({"points"} if self.points else set())

    @property
    def names(self) -> tuple[str, ...]:
        """All of them, each once."""
        return tuple(dict.fromkeys(self.cells + self.nodes + self.points))


def chosen(wanted: Any, table: Mapping[str, DerivedField]) -> Choice | None:
    """The choice of fields by names of a table; None for None.

    wanted: a tuple or list of names, or of names with their place, as 'von_mises:cells'; without one, in all places.
    Raises InputError for what is no such name, with those there are.
    """
    if wanted is None:
        return None
    require_kind(wanted, Sequence, "the fields", "a tuple of names")
    if isinstance(wanted, str):
        raise InputError(f"the fields are the text {wanted!r}: a tuple of names, as ({wanted!r},), would be right")
    found: dict[str, list[str]] = {place: [] for place in PLACES}
    for entry in wanted:
        require_name(entry, "the name of a field")
        name, there, place = entry.partition(":")
        check_name(name, table)
        if there and place not in PLACES:
            raise InputError(
                f"the field '{name}' is wanted at '{place}': one of {', '.join(PLACES)}, or '{name}' alone for all of "
                "them, would be right"
            )
        for each in (place,) if there else PLACES:
            found[each].append(name)
    if not any(found.values()):
        raise InputError(f"no field is named: some of {', '.join(table)} would be right")
    return Choice(*(tuple(dict.fromkeys(found[place])) for place in PLACES))


def check_name(name: str, table: Mapping[str, DerivedField]) -> None:
    """Raise InputError for a name that a table does not have."""
    if name not in table:
        raise InputError(f"there is no field '{name}': one of {', '.join(table)} would be right")


def check_known(names: Sequence[str], table: Mapping[str, DerivedField], problem: Discretisation) -> None:
    """Raise InputError for a field that a problem does not have."""
    for name in names:
        known = table[name].known
        if known is not None and not known(problem):
            scene = problem.scene
            law, plane = type(scene.growth).__name__, f" in plane {scene.plane}" * (scene.mesh.dim == 2)
            right = ", ".join(each.name for each in table.values() if each.known is None or each.known(problem))
            raise InputError(f"there is no field '{name}' of the law {law}{plane}: some of {right} would be right")
