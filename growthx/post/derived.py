"""Fields that follow from a state: a table of what they are in UFL, read as means over cells and at points.

A new one is a row of `FIELDS`, or one of the user's given to `register`: it is in `cell_fields`, in `fields.pvd` and,
at integration points, in `raw.pvd`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from growthx.common.checks import require_flag, require_function, require_kind, require_name
from growthx.common.errors import InputError, shown
from growthx.constitutive.growth import GrowthLaw
from growthx.discretisation.checks.arguments import require_problem
from growthx.fem.assembly import CellMeans

if TYPE_CHECKING:
    from growthx.common.arrays import Floats
    from growthx.discretisation.discretisation import Discretisation


@dataclass(frozen=True)
class DerivedField:
    """A field that follows from a state.

    value: what it is in UFL, of a problem: a scalar, or several in a list, of which `reading` makes one.
    reading: of numbers for these, (…, scalars) to (…): of their means over cells, or of what they are at points.
    raw: whether it is also told at integration points.
    known: whether a problem has it; None: all have.
    exact: where it is more exact than UFL at points, of a problem and points X, (points, dim), shape (cells, points).
    """

    name: str
    value: Callable[[Discretisation], Any]
    reading: Callable[[Floats], Floats] | None = None
    raw: bool = True
    exact: Callable[[Discretisation, Floats], Floats] | None = None
    known: Callable[[Discretisation], bool] | None = None

    def __post_init__(self) -> None:
        require_name(self.name, "the name of a field")
        require_function(self.value, f"the value of the field '{self.name}'", "a function of a problem")
        for what, function in (("reading", self.reading), ("exact", self.exact), ("known", self.known)):
            if function is not None:
                require_function(function, f"{what}, of the field '{self.name}',", "a function or None")
        require_flag(self.raw, f"raw, of the field '{self.name}',")

    def scalars(self, problem: Discretisation) -> list[Any]:
        """Its value for a problem; InputError if that is nothing that can be told."""
        value = self.value(problem)
        scalars = [value] if self.reading is None else value
        if not isinstance(scalars, list) or any(getattr(each, "ufl_shape", None) != () for each in scalars):
            right = "a scalar in UFL" if self.reading is None else "a list of scalars in UFL"
            raise InputError(f"the value of the field '{self.name}' is {shown(value)}: {right} would be right")
        return scalars

    def read(self, numbers: Floats) -> Floats:
        """What it is, (…), of numbers for its scalars, (…, scalars)."""
        return numbers[..., 0] if self.reading is None else self.reading(numbers)


def _relative_change(problem: Discretisation) -> Any:
    return problem.expressions.density() / problem.material.reference_density - 1


def _has_stimulus(problem: Discretisation) -> bool:
    return isinstance(problem.growth, GrowthLaw)


def _stress(problem: Discretisation) -> list[Any]:
    """The entries of the Cauchy stress on and above its diagonal, row by row."""
    sigma, dim = problem.expressions.stress(), problem.scene.mesh.dim
    return [sigma[i, j] for i in range(dim) for j in range(i, dim)]


def _principal(number: int, entries: Floats) -> Floats:
    """A principal stress, counted from the lowest, of these entries."""
    dim = {3: 2, 6: 3}[entries.shape[-1]]
    stress = np.empty((*entries.shape[:-1], dim, dim))
    above = np.triu_indices(dim)
    stress[..., above[0], above[1]] = stress[..., above[1], above[0]] = entries
    return np.asarray(np.linalg.eigvalsh(stress)[..., number])


FIELDS = {
    field.name: field
    for field in (
        # ρ
        DerivedField("density", lambda problem: problem.expressions.density(), exact=lambda p, X: p.density_at(X)),
        # [ρ − ρ*]/ρ*
        DerivedField(
            "relative_change",
            _relative_change,
            exact=lambda problem, X: problem.density_at(X) / problem.reference_density_at(X) - 1,
        ),
        # [ρ/ρ*]^(−m) Ψ₀, energy per volume
        DerivedField("stimulus", lambda problem: problem.expressions.stimulus(), known=_has_stimulus),
        # R₀, density per time, zero where nothing grows
        DerivedField("mass_source", lambda problem: problem.expressions.mass_source(), raw=False),
        # Principal Cauchy stresses, in the plane, in two dimensions; of several load cases, those of the mean stress.
        DerivedField("major_stress", _stress, partial(_principal, -1), raw=False),
        DerivedField("minor_stress", _stress, partial(_principal, 0), raw=False),
    )
}
OTHERS = ("grows", "displacement", "smoothed_density")  # that files have beside them


def register(field: DerivedField) -> None:
    """Have one more field told from now on (on all ranks), or another of one's own in place of one of its name.

    Raises InputError for what is no field, and for names that growthx's own fields have.
    """
    require_kind(field, DerivedField, "a field to be told", "a DerivedField")
    if field.name in (*_OURS, *OTHERS):
        raise InputError(f"there is a field '{field.name}' already: a name of its own would be right")
    FIELDS[field.name] = field


_OURS = tuple(FIELDS)


def cell_fields(problem: Discretisation) -> dict[str, Floats]:
    """Means over the owned cells of all `FIELDS`, each of shape (cells,).

    density ρ, relative_change [ρ − ρ*]/ρ*, stimulus [ρ/ρ*]^(−m) Ψ₀ (energy per volume; of laws that have one),
    mass_source R₀ (density per time, zero where nothing grows), major_stress and minor_stress: principal Cauchy
    stresses (in the plane, in two dimensions; of several load cases, those of the mean stress).
    grows: one in cells that grow, zero in the others; only if there are such.  These have the density of the start, and
    stimulus and stress of a stiffness without the weight [ρ/ρ*]ⁿ.
    """
    require_problem(problem)
    return CellFields(problem).values()


class CellFields:
    """The fields of a problem as means over cells, compiled once for all of its states."""

    def __init__(self, problem: Discretisation) -> None:
        self._problem, self._fields = problem, _known(problem)
        scalars, self._columns = _once_each(self._fields, problem)
        self._means = CellMeans(problem.scene.mesh.domain, scalars, problem.spaces.whole_volume, problem.compile)

    def values(self) -> dict[str, Floats]:
        """Those of the state as it is, by name, each of shape (owned cells,)."""
        means, problem = self._means(), self._problem
        found = {field.name: field.read(means[:, self._columns[field.value]]) for field in self._fields}
        return found | ({"grows": problem.grows.x.array[: len(means)]} if problem.rests else {})


class PointFields:
    """The fields of a problem at points X of the reference cell, (points, dim), compiled once for all of its states."""

    def __init__(self, problem: Discretisation, X: Floats) -> None:
        self._problem, self._X = problem, X
        self._fields = tuple(field for field in _known(problem) if field.raw)
        scalars, self._columns = _once_each([field for field in self._fields if field.exact is None], problem)
        self._compiled = [problem.compile.expression(scalar, X) for scalar in scalars]

    def values(self) -> dict[str, Floats]:
        """Those of the state as it is, by name, each of shape (owned cells, points)."""
        problem, mesh = self._problem, self._problem.scene.mesh
        size = len(mesh.owned_cells), len(self._X)
        parts = [each.eval(mesh.domain, mesh.owned_cells).reshape(size) for each in self._compiled]
        numbers = np.stack(parts, axis=-1) if parts else np.empty((*size, 0))
        found = {}
        for field in self._fields:
            if field.exact is None:
                found[field.name] = field.read(numbers[..., self._columns[field.value]])
            else:
                found[field.name] = field.exact(problem, self._X)
        if problem.rests:
            found["grows"] = np.broadcast_to(problem.grows.x.array[: size[0], np.newaxis], size)
        return found


def _known(problem: Discretisation) -> tuple[DerivedField, ...]:
    """The fields that a problem has."""
    return tuple(field for field in FIELDS.values() if field.known is None or field.known(problem))


def _once_each(fields: Sequence[DerivedField], problem: Discretisation) -> tuple[list[Any], dict[Any, slice]]:
    """The scalars of some fields, those of a value that several read once, and where those of each value are."""
    scalars: list[Any] = []
    columns: dict[Any, slice] = {}
    for field in fields:
        if field.value not in columns:
            own = field.scalars(problem)
            columns[field.value] = slice(len(scalars), len(scalars) + len(own))
            scalars += own
    return scalars, columns
