"""Values that may vary in space: numbers, functions of position, DOLFINx functions, or a value per named region."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, TypeVar

import dolfinx
import numpy as np

from growthx.errors import InputError, is_function, raise_on_all, shown

if TYPE_CHECKING:
    from growthx.arrays import Floats, Indices
    from growthx.mesh import Mesh

# A number; a function of x, shape (3, points), to values, shape (points,); a scalar DOLFINx Function; or any of the
# first two per named region.
Field = Any
Law = TypeVar("Law", bound="Any")


def is_uniform(field: Field) -> bool:
    """Whether the field is one number everywhere."""
    return bool(np.isscalar(field))


def as_ufl(field: Field, mesh: Mesh) -> Any:
    """The field as a UFL coefficient: a Constant, or a Function with one value per cell (midpoint), or the user's own.

    Raises InputError for a mapping that leaves cells without a value or names an unknown region.
    """
    if is_uniform(field):
        return dolfinx.fem.Constant(mesh.domain, dolfinx.default_scalar_type(field))
    if isinstance(field, dolfinx.fem.Function):
        if field.ufl_shape:
            raise InputError(f"the field '{field.name}' has values of shape {field.ufl_shape}: a scalar one is needed")
        if field.function_space.mesh is not mesh.domain:
            raise InputError(f"the field '{field.name}' is on another mesh: one on the scene's mesh would be right")
        return field
    return per_cell(field, mesh)


def per_cell(field: Field, mesh: Mesh) -> dolfinx.fem.Function:
    """The field as a Function of one value per cell; same errors as `as_ufl`."""
    values = dolfinx.fem.Function(dolfinx.fem.functionspace(mesh.domain, ("DG", 0)))
    if not isinstance(field, Mapping):
        _fill(values, field, mesh.local_cells, "the value of a field")
        return values
    without = np.ones(len(mesh.local_cells), dtype=bool)
    for name, part in field.items():
        cells = mesh.region(name)
        _fill(values, part, cells, "the value of a region")
        without[cells] = False
    missing = mesh.domain.comm.allreduce(int(without[mesh.owned_cells].sum()))
    if missing:
        regions = ", ".join(map(repr, field)) or "none at all"
        raise InputError(
            f"a field given for the regions {regions} has no value in {missing} of {mesh.cell_count} cells: "
            "one in each is needed"
        )
    return values


def _fill(values: dolfinx.fem.Function, part: Field, cells: Indices, what: str) -> None:
    if is_uniform(part):
        values.x.array[cells] = part
    elif not is_function(part):
        raise InputError(f"{what} is {shown(part)}: a number or a function of position would be right")
    else:
        interpolate(values, scalar(part), cells)


def interpolate(values: dolfinx.fem.Function, function: Callable[[Floats], Any], cells: Indices | None = None) -> None:
    """Put a function of position on a Function (collective); an InputError of the function comes on all ranks."""
    problem = ""
    try:
        values.interpolate(function, cells)
    except InputError as error:
        problem = str(error)
    raise_on_all(values.function_space.mesh.comm, problem)


def scalar(function: Callable[[Floats], Any]) -> Callable[[Floats], Floats]:
    """The function of position with one value for each point, also where it returns one number for all.

    Raises InputError for values of another shape, and for what is no real number.
    """

    def values(x: Floats) -> Floats:
        found = _numbers(function, x)
        if found.shape not in ((), (x.shape[1],)):
            raise InputError(f"a function of position returned shape {found.shape} for {x.shape[1]} points: one each")
        return np.broadcast_to(found, x.shape[1])

    return values


def vector(function: Callable[[Floats], Any]) -> Callable[[Floats], Floats]:
    """The function of position with one vector for each point, (dim, points), also where it returns one for all.

    Raises InputError for values of another shape, and for what is no real number.
    """

    def values(x: Floats) -> Floats:
        found = _numbers(function, x)
        if found.ndim == 1:
            found = np.repeat(found[:, np.newaxis], x.shape[1], axis=1)
        if found.ndim != 2 or found.shape[1] != x.shape[1]:
            raise InputError(
                f"a vector function of position returned shape {found.shape} for {x.shape[1]} points: one row for "
                "each direction and one column for each point would be right"
            )
        return found

    return values


def _numbers(function: Callable[[Floats], Any], x: Floats) -> Floats:
    """What a function of position returned, as an array of floats."""
    try:
        found = function(x)
    except InputError:
        raise
    except Exception as error:  # on one rank, perhaps: as it is, it would leave the others waiting
        raise InputError(f"a function of position failed, {shown(error)}: numbers would be right") from error
    try:
        values = np.asarray(found)
        if np.iscomplexobj(values) or values.dtype == bool:
            raise TypeError
        return np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"a function of position returned {shown(found)}: real numbers would be right") from None


def law_as_ufl(law: Law, mesh: Mesh) -> Law:
    """The same law (a frozen dataclass with a tuple `coefficients` of names) with those parameters in UFL."""
    return replace(law, **{name: as_ufl(getattr(law, name), mesh) for name in law.coefficients})


def law_as_arrays(law: Law, mesh: Mesh, average: Callable[[Any], Floats]) -> Law:
    """The same law with its varying parameters as arrays: `average` turns a coefficient into one value per density."""
    varying = {name: getattr(law, name) for name in law.coefficients if not is_uniform(getattr(law, name))}
    return replace(law, **{name: average(as_ufl(field, mesh)) for name, field in varying.items()})
