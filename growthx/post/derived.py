"""Fields that follow from a state, read as means over cells, averaged to nodes and at points.

What they are in UFL is in `fields.table`.  A new one is a row there, or one of the user's given to `register`: it is in
`cell_fields`, in `fields.pvd` and, at integration points, in `raw.pvd`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import dolfinx
import numpy as np
import ufl

from growthx.common.checks import require_kind
from growthx.common.errors import InputError
from growthx.discretisation.checks.arguments import require_problem
from growthx.fem.assembly import CellAverages, CellMeans, values_at_points
from growthx.meshing.sampling import reference_corners
from growthx.post.fields.choice import Choice, check_known, check_name, chosen
from growthx.post.fields.row import SHAPES, DerivedField, read_all
from growthx.post.fields.table import TABLE
from growthx.post.smoothing import corner_space, corners_from_points

if TYPE_CHECKING:
    from growthx.common.arrays import Floats
    from growthx.discretisation.discretisation import Discretisation
    from growthx.stepping.record import Result

FIELDS = {field.name: field for field in TABLE}
OTHERS = ("grows", "smoothed_density")  # that files have beside them


def register(field: DerivedField) -> None:
    """Have one more field told from now on (on all ranks), or another of one's own in place of one of its name.

    Raises InputError for what is no field, and for names that growthx's own fields have.

    Example:
        >>> growth = gx.results.DerivedField("growth", lambda problem: problem.density - 1.0, unit="mass per volume")
        >>> gx.results.register(growth)
        >>> "growth" in gx.results.cell_fields(gx.discretise(gx.scenes.plate(2), gx.Q1P0))
        True
    """
    require_kind(field, DerivedField, "a field to be told", "a DerivedField")
    if field.name in (*_OURS, *OTHERS):
        raise InputError(f"there is a field '{field.name}' already: a name of its own would be right")
    FIELDS[field.name] = field


_OURS = tuple(FIELDS)


def chosen_fields(wanted: Any) -> Choice | None:
    """The choice of some of `FIELDS`, see `fields.choice.chosen`."""
    return chosen(wanted, FIELDS)


def check_fields(wanted: Any, problem: Discretisation) -> None:
    """Raise InputError for what is no choice of `FIELDS`, or of one that a problem does not have."""
    choice = chosen_fields(wanted)
    if choice is not None:
        check_known(choice.names, FIELDS, problem)


def cell_fields(problem: Discretisation | Result, fields: Sequence[str] | None = None) -> dict[str, Floats]:
    """Means over the owned cells of the `FIELDS` of these names.

    Shapes (cells,), of vectors (cells, 3), of tensors (cells, 3, 3).
    problem: a result, or its problem.
    fields: None: density ρ, relative_change [ρ − ρ*]/ρ*, stimulus [ρ/ρ*]^(−m) Ψ₀ (energy per volume; of laws that have
    one), mass_source R₀ (density per time, zero where nothing grows), major_stress and minor_stress: principal Cauchy
    stresses (in the plane, in two dimensions; of several load cases, those of the mean stress), and the user's own.
    grows: one in cells that grow, zero in the others; only if there are such.  These have the density of the start, and
    energy, stimulus and stress of a stiffness without the weight [ρ/ρ*]ⁿ.
    What is read off a tensor, such as von Mises' stress, is that of the cell's mean tensor.
    Raises InputError for names that are no fields, or of which the problem has none.

    Example:
        >>> problem = gx.discretise(gx.scenes.plate(2), gx.Q1P0)
        >>> list(gx.results.cell_fields(problem, ["density"]))
        ['density']
    """
    problem = require_problem(problem)
    return CellFields(problem, _names(fields, problem)).values()


def node_fields(problem: Discretisation | Result, fields: Sequence[str]) -> dict[str, Floats]:
    """The `FIELDS` of these names at the nodes of `smoothing.corner_space`, this rank's and those it shares.

    Extrapolated in each cell from its integration points, linearly, and averaged over the cells around a node; at nodes
    of cells that grow over these alone.  Shapes as of `cell_fields`, and the same errors.  What is read off a tensor is
    that of the averaged tensor.

    Example:
        >>> problem = gx.discretise(gx.scenes.plate(2), gx.Q1P0)
        >>> list(gx.results.node_fields(problem, ["density"]))
        ['density']
    """
    problem = require_problem(problem)
    return NodeFields(problem, _names(fields, problem) or ()).values()


def point_fields(problem: Discretisation | Result, fields: Sequence[str]) -> dict[str, Floats]:
    """The `FIELDS` of these names at the integration points of each owned cell.

    Shapes (cells, points), of vectors (cells, points, 3), of tensors (cells, points, 3, 3); errors as of `cell_fields`.

    Example:
        >>> problem = gx.discretise(gx.scenes.plate(2), gx.Q1P0)
        >>> list(gx.results.point_fields(problem, ["density"]))
        ['density']
    """
    problem = require_problem(problem)
    points = problem.variant.integration_points(problem.scene.mesh.cell_name)
    return PointFields(problem, points, _names(fields, problem)).values()


def _names(fields: Any, problem: Discretisation) -> tuple[str, ...] | None:
    """The names of fields that a problem has."""
    if fields is None:
        return None
    require_kind(fields, (tuple, list), "the fields", "a tuple of names")
    for name in fields:
        require_kind(name, str, "the name of a field", "a name in quotes")
        check_name(name, FIELDS)
    check_known(fields, FIELDS, problem)
    return tuple(dict.fromkeys(fields))


class CellFields:
    """The fields of a problem as means over cells, compiled once for all of its states."""

    def __init__(self, problem: Discretisation, names: Sequence[str] | None = None, *, often: bool = False) -> None:
        """names: of `FIELDS`; None: of all that are told without being asked for.  often: for state after state."""
        self._problem, self._fields = problem, _known(problem, names)
        scalars, self._columns = _once_each(self._fields, problem)
        volume = problem.spaces.whole_volume
        self._means = CellMeans(problem.scene.mesh.domain, scalars, volume, problem.compile, often=often)

    def values(self) -> dict[str, Floats]:
        """Those of the state as it is, by name, each of shape (owned cells,) and that of its rank."""
        means, problem = self._means(), self._problem
        found = read_all(self._fields, lambda field: means[:, self._columns[field.value]])
        return found | ({"grows": problem.grows.x.array[: len(means)]} if problem.rests else {})


class PointFields:
    """The fields of a problem at points X of the reference cell, (points, dim), compiled once for all of its states."""

    def __init__(self, problem: Discretisation, X: Floats, names: Sequence[str] | None = None) -> None:
        """names: of `FIELDS`; None: of all that are told raw without being asked for."""
        self._problem, self._X = problem, X
        self._fields = told_raw(problem) if names is None else _known(problem, names)
        self._entries = _Entries(problem, X, [field for field in self._fields if field.exact is None])

    def values(self) -> dict[str, Floats]:
        """Those of the state as it is, by name, each of shape (owned cells, points) and that of its rank."""
        problem, entries = self._problem, self._entries.values()
        read = read_all((field for field in self._fields if field.exact is None), lambda field: entries[field.name])
        found = {
            field.name: read[field.name] if field.exact is None else field.exact(problem, self._X)
            for field in self._fields
        }
        if problem.rests:
            size = len(problem.scene.mesh.owned_cells), len(self._X)
            found["grows"] = np.broadcast_to(problem.grows.x.array[: size[0], np.newaxis], size)
        return found


class NodeFields:
    """The fields of a problem averaged to the corners of its cells, compiled once for all of its states."""

    def __init__(self, problem: Discretisation, names: Sequence[str]) -> None:
        cell_name = problem.scene.mesh.cell_name
        self._problem, self._fields = problem, _known(problem, names)
        self._averages = CellAverages(corner_space(problem), problem.growing_cells if problem.rests else None)
        self._points, self._corners = problem.variant.integration_points(cell_name), reference_corners(cell_name)
        self._extrapolation = corners_from_points(cell_name, self._points)
        self._entries = _Entries(problem, self._points, [field for field in self._fields if field.exact is None])

    def values(self) -> dict[str, Floats]:
        """Those of the state as it is, by name, each of shape (local nodes,) and that of its rank."""
        entries = self._entries.values()
        averaged: dict[Any, Floats] = {}  # by value: several fields read one

        def numbers(field: DerivedField) -> Floats:
            if field.value not in averaged:
                averaged[field.value] = self._averaged(self._extrapolated(entries[field.name]))
            return averaged[field.value]

        read = read_all((field for field in self._fields if field.exact is None), numbers)
        return {
            field.name: read[field.name]
            if field.exact is None
            else self._averaged(self._exact(field)).reshape(-1, *SHAPES[field.rank])
            for field in self._fields
        }

    def _exact(self, field: DerivedField) -> Floats:
        """An exact field at the corners of each owned cell, (owned cells, corners, entries)."""
        problem, exact = self._problem, field.exact
        assert exact is not None
        cells = len(problem.scene.mesh.owned_cells)
        if field.continuous is not None and field.continuous(problem):
            return exact(problem, self._corners).reshape(cells, len(self._corners), -1)
        return self._extrapolated(exact(problem, self._points).reshape(cells, len(self._points), -1))

    def _extrapolated(self, at_points: Floats) -> Floats:
        return np.einsum("np,cpe->cne", self._extrapolation, at_points)

    def _averaged(self, at_corners: Floats) -> Floats:
        """Means over the cells around each local node, (local nodes, entries)."""
        return np.stack([self._averages(each) for each in np.moveaxis(at_corners, 2, 0)], axis=-1)


class _Entries:
    """The scalars of some fields at points X of the reference cell, compiled together."""

    def __init__(self, problem: Discretisation, X: Floats, fields: Sequence[DerivedField]) -> None:
        self._problem, self._fields = problem, fields
        scalars, self._columns = _once_each(fields, problem)
        self._shape = len(problem.scene.mesh.owned_cells), len(X), len(scalars)
        self._compiled = None
        if scalars:
            # A constant of the mesh tells where a value lives that is the same everywhere.
            one = dolfinx.fem.Constant(problem.scene.mesh.domain, dolfinx.default_scalar_type(1.0))
            self._compiled = problem.compile.expression(one * ufl.as_vector(scalars), X)

    def values(self) -> dict[str, Floats]:
        """Those of the state as it is, by the names of the fields, (owned cells, points, scalars of the field)."""
        if self._compiled is None:
            return {}
        mesh = self._problem.scene.mesh
        numbers = values_at_points(self._compiled, mesh.domain, mesh.owned_cells).reshape(self._shape)
        return {field.name: numbers[..., self._columns[field.value]] for field in self._fields}


def told_raw(problem: Discretisation) -> tuple[DerivedField, ...]:
    """The fields of a problem that are told raw without being asked for."""
    return tuple(field for field in _known(problem, None) if field.raw)


def _known(problem: Discretisation, names: Sequence[str] | None) -> tuple[DerivedField, ...]:
    """The fields of these names; None: those that a problem has and that are told without being asked for."""
    if names is not None:
        return tuple(FIELDS[name] for name in names)
    return tuple(field for field in FIELDS.values() if field.told and (field.known is None or field.known(problem)))


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
