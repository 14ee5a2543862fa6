"""Values that may vary in space: numbers, functions of position, DOLFINx functions, a value per region or cell."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import dolfinx
import numpy as np

from growthx.common.arrays import Field, Law, is_law, is_uniform
from growthx.common.checks import is_function
from growthx.common.communicators import steady
from growthx.common.errors import InputError, raise_on_all, shown
from growthx.common.overrides import is_foreign
from growthx.meshing.cell_data import of_cells
from growthx.meshing.images.density import ScanDensity
from growthx.meshing.transferred import TransferredDensity

if TYPE_CHECKING:
    from growthx.common.arrays import Floats, Indices
    from growthx.meshing.mesh import Mesh


def as_ufl(field: Field, mesh: Mesh) -> Any:
    """The field as a UFL coefficient: a Constant, or a Function with one value per cell (midpoint), or the user's own.

    A law that is a parameter of another has its own parameters so.
    Raises InputError for a mapping that leaves cells without a value or names an unknown region.
    """
    if is_uniform(field):
        return dolfinx.fem.Constant(mesh.domain, dolfinx.default_scalar_type(field))
    if is_law(field):
        return law_as_ufl(field, mesh)
    if isinstance(field, TransferredDensity):
        return field.on(mesh)
    if isinstance(field, dolfinx.fem.Function):
        if field.ufl_shape:
            raise InputError(f"the field '{field.name}' has values of shape {field.ufl_shape}: a scalar one is needed")
        if field.function_space.mesh is not mesh.domain:
            raise InputError(f"the field '{field.name}' is on another mesh: one on the scene's mesh would be right")
        return field
    return mesh.cell_values(field) if isinstance(field, np.ndarray) else per_cell(field, mesh)


def per_cell(field: Field, mesh: Mesh) -> dolfinx.fem.Function:
    """The field as a Function of one value per cell, or of those of a density of another run; errors as `as_ufl`."""
    values = dolfinx.fem.Function(_space_for(field, mesh))
    rows = values.function_space.dofmap.list
    if not isinstance(field, Mapping):
        _fill(values, field, mesh, mesh.local_cells, "the value of a field")
        return values
    without = np.ones(len(mesh.local_cells), dtype=bool)
    for name, part in field.items():
        cells = mesh.region(name)
        if isinstance(part, np.ndarray):
            values.x.array[rows[cells]] = of_cells(part, mesh.origin, mesh.comm)[cells, np.newaxis]
        elif isinstance(part, TransferredDensity):
            values.x.array[rows[cells]] = part.on(mesh).x.array[rows[cells]]
        else:
            _fill(values, part, mesh, cells, "the value of a region")
        without[cells] = False
    missing = mesh.comm.allreduce(int(without[mesh.owned_cells].sum()))
    if missing:
        regions = ", ".join(map(repr, field)) or "none at all"
        raise InputError(
            f"a field given for the regions {regions} has no value in {missing} of {mesh.cell_count} cells: "
            "one in each is needed"
        )
    return values


def _space_for(field: Field, mesh: Mesh) -> dolfinx.fem.FunctionSpace:
    """One value per cell; where a density of another run is in one of the regions, those that it has in each cell."""
    parts = field.values() if isinstance(field, Mapping) else ()
    spaces = [part.own_space for part in parts if isinstance(part, TransferredDensity)]
    if len({space.ufl_element() for space in spaces}) > 1:
        raise InputError("densities of other runs were made for unlike variants: for the one of the run would be right")
    return spaces[0] if spaces else dolfinx.fem.functionspace(mesh.domain, ("DG", 0))


def _fill(values: dolfinx.fem.Function, part: Field, mesh: Mesh, cells: Indices, what: str) -> None:
    if is_uniform(part):
        values.x.array[values.function_space.dofmap.list[cells]] = part
    elif not is_function(part):
        raise InputError(f"{what} is {shown(part)}: a number or a function of position would be right")
    else:
        put(values, part, mesh, cells)


def has_points(field: Field) -> bool:
    """Whether a field is a function of position; the mean of a scan over cells is none, and neither is a number."""
    return is_function(field) and not (isinstance(field, ScanDensity) and field.of_cells)


def put(values: dolfinx.fem.Function, field: Field, mesh: Mesh, cells: Indices | None = None) -> None:
    """Put a function of position, or what a scan says, on a Function, on some of its cells or all (collective)."""
    if isinstance(field, ScanDensity):
        field.put_on(values, mesh, cells)  # of whose points ranks speak together
    else:
        interpolate(values, scalar(field), cells)


def interpolate(values: dolfinx.fem.Function, function: Callable[[Floats], Any], cells: Indices | None = None) -> None:
    """Put a function of position on a Function (collective); an InputError of the function comes on all ranks."""
    problem = ""
    try:
        values.interpolate(function, cells)
    except InputError as error:
        problem = str(error)
    raise_on_all(steady(values.function_space.mesh.comm), problem)


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
        raise InputError(
            f"a function of position failed, {shown(error)}: one of x alone, an array of shape (3, points), that "
            "returns a number for each point, by numpy.where instead of if, would be right"
        ) from error
    try:
        values = np.asarray(found)
        if np.iscomplexobj(values) or values.dtype == bool:
            raise TypeError
        return np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"a function of position returned {shown(found)}: real numbers would be right") from None


def law_as_ufl(law: Law, mesh: Mesh) -> Law:
    """The same law (a frozen dataclass with a tuple `coefficients` of names) with those parameters in UFL.

    Those that it names in `exponents` stay numbers where they are numbers: integer powers compile to products.
    """
    exponents = getattr(law, "exponents", ())
    given = {name: getattr(law, name) for name in law.coefficients}
    stay = [name for name in exponents if is_uniform(given[name])]
    return _with(law, mesh, {name: as_ufl(field, mesh) for name, field in given.items() if name not in stay})


def law_as_arrays(law: Law, mesh: Mesh, average: Callable[[Any], Floats]) -> Law:
    """The same law with its varying parameters as arrays: `average` turns a coefficient into one value per density."""
    varying = {name: getattr(law, name) for name in law.coefficients if not is_uniform(getattr(law, name))}
    return _with(law, mesh, {name: _as_array(field, mesh, average) for name, field in varying.items()})


def _as_array(field: Field, mesh: Mesh, average: Callable[[Any], Floats]) -> Any:
    return law_as_arrays(field, mesh, average) if is_law(field) else average(as_ufl(field, mesh))


def _with(law: Law, mesh: Mesh, parameters: dict[str, Any]) -> Law:
    """The same law with other parameters; InputError on all ranks if the checks of the user's own refuse them."""
    if not is_foreign(type(law)):
        return replace(law, **parameters)
    problem = ""
    try:
        law = replace(law, **parameters)
    except Exception as error:  # on one rank, perhaps: as it is, it would leave the others waiting
        problem = (
            f"{type(law).__name__} cannot be made anew with {', '.join(parameters)} as arrays or in UFL, "
            f"{shown(error)}: one whose checks let those pass would be right"
        )
    raise_on_all(mesh.comm, problem)
    return law
