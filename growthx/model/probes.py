"""Growth laws and materials of one's own, tried before they are computed with: what they say must hold everywhere.

One text serves numbers, arrays and UFL: point-based variants evaluate a law with arrays, weak forms hold it in UFL.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import fields, replace
from numbers import Real
from typing import TYPE_CHECKING, Any

import numpy as np
import ufl

from growthx.common.arrays import is_law, is_uniform
from growthx.common.checks import is_function
from growthx.common.errors import InputError, shown
from growthx.common.overrides import is_foreign
from growthx.constitutive.energies import StoredEnergy
from growthx.constitutive.growth import GrowthLaw
from growthx.constitutive.material import Material
from growthx.constitutive.stimulus import StimulusDriven
from growthx.model.trials import (
    RELATIVE_DENSITIES,
    number,
    sample_states,
    try_across,
    try_energy,
    try_source,
    try_weight,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from growthx.common.arrays import Floats
    from growthx.constitutive.energies import Elasticity
    from growthx.constitutive.sources import MassSource
    from growthx.meshing.mesh import Mesh

SHARES = np.array([0.0, 1e-12, 1e-9, 1e-6, 1e-3, 0.1])  # of the stiffness: the energies at which a drive is tried
DENSE = np.geomspace(1e-14, 1.0, 500)  # … and those at which it must at least be a number, not below zero
STRETCHES = ((1.0, 1.0, 1.0), (1.1, 0.95, 1.0), (0.9, 1.05, 1.0))
SAME = 1e-9  # relative


def trouble(growth: MassSource, material: Elasticity, mesh: Mesh) -> str:
    """What makes a law of the user's unusable, as a sentence; empty if nothing does, or if it is growthx's own.

    On this rank: parameters that vary in space are taken at one of its places.
    """
    laws = (growth, material, *([] if material.is_of_a_power else [material.density_exponent]))
    if not any(is_foreign(type(law)) for law in laws) or len(mesh.domain.geometry.x) == 0:
        return ""
    try:
        for law in laws:
            _check_parameters(law)
        with np.errstate(all="ignore"):
            if not material.is_of_a_power:
                _check_weight(growth, material, mesh)
            if is_foreign(type(material)):
                numbers = _with(material, mesh, float)
                if isinstance(material, StoredEnergy):
                    try_energy(numbers)
                else:
                    _check_material(numbers)
            if is_foreign(type(growth)):
                if isinstance(growth, GrowthLaw):
                    _check_growth(growth, material, mesh)
                else:
                    _check_source(growth, material, mesh)
    except InputError as error:
        return str(error)
    return ""


def trouble_across(material: Elasticity, mesh: Mesh) -> str:
    """What makes an energy of the user's unusable in plane stress, as a sentence; empty if nothing does."""
    if not isinstance(material, StoredEnergy) or len(mesh.domain.geometry.x) == 0:
        return ""
    try:
        with np.errstate(all="ignore"):
            try_across(_with(material, mesh, float))
    except InputError as error:
        return str(error)
    return ""


def _check_parameters(law: Any) -> None:
    """Refuse parameters that vary in space without being named as such."""
    for part in fields(law):
        value = getattr(law, part.name)
        if part.name not in law.coefficients and (isinstance(value, Mapping) or hasattr(value, "function_space")):
            raise InputError(
                f"the parameter {part.name} of {type(law).__name__} is {shown(value)}, a field, but not named in its "
                f"coefficients, {', '.join(law.coefficients)}: to name it there would be right"
            )


def _with(law: Any, mesh: Mesh, form: Callable[[float], Any]) -> Any:
    """The law with the parameters that vary in space as they are at one place, each put into a form."""
    varying = {name: getattr(law, name) for name in law.coefficients if not is_uniform(getattr(law, name))}
    try:
        at_one = {
            name: _with(field, mesh, form) if is_law(field) else form(_somewhere(field, mesh))
            for name, field in varying.items()
        }
        return replace(law, **at_one)
    except Exception as error:
        raise InputError(
            f"{type(law).__name__} cannot be made anew with other values of its parameters, {shown(error)}: "
            "one whose checks let numbers, arrays and UFL pass would be right"
        ) from error


def _somewhere(field: Any, mesh: Mesh) -> float:
    """The value of a field at some place of this rank."""
    if isinstance(field, Mapping):
        return _somewhere(next(iter(field.values()), 1.0), mesh)
    if is_function(field):
        field = field(mesh.domain.geometry.x[:1].T)
    elif hasattr(field, "function_space"):
        field = field.x.array
    return float(np.ravel(field)[0])


# -- growth ------------------------------------------------------------------------------------------------------------


def _check_source(growth: MassSource, material: Elasticity, mesh: Mesh) -> None:
    """Refuse a source of any form that is not the same for numbers, arrays and in UFL."""
    numbers = _with(growth, mesh, float), _with(material, mesh, float)
    count = len(sample_states(numbers[1])[0])
    arrays, symbols = (
        (_with(growth, mesh, form), _with(material, mesh, form))
        for form in (lambda value: np.full(count, value), lambda value: ufl.variable(ufl.as_ufl(value)))
    )
    try_source(numbers, arrays, symbols)


def _check_growth(growth: GrowthLaw, material: Elasticity, mesh: Mesh) -> None:
    """Refuse a law whose power or drive is not what it must be, for arrays or in UFL."""
    energies = SHARES * _with(material, mesh, float).stiffness
    forms: list[Callable[[float], Any]] = [
        float,
        lambda value: np.full(len(energies), value),
        lambda value: ufl.variable(ufl.as_ufl(value)),
    ]
    if not material.is_of_a_power:  # of which the law knows nothing but by n
        material = replace(material, density_exponent=2.0)
    number, array, symbol = ((_with(growth, mesh, form), _with(material, mesh, form)) for form in forms)
    _check_power([number, array, symbol])
    drives = _drives(*array, energies)
    for one, drive in zip(energies, drives, strict=True):
        _require_same(number[0], float(one), drive, _drives(*number, np.array([one]))[0], "an array with others")
        _require_same(number[0], float(one), drive, _drive_in_ufl(*symbol, float(one)), "UFL")
    _drives(*number, DENSE * energies[-1] / SHARES[-1])
    _check_linear(number[0], energies, drives)


def _check_power(laws: list[tuple[GrowthLaw, Elasticity]]) -> None:
    found = []
    name = f"the power of {type(laws[0][0]).__name__}"
    for growth, material in laws:
        try:
            found.append(growth.power(material))
        except Exception as error:
            raise InputError(f"{name} fails, {shown(error)}: a number would be right") from error
    for power in found:
        if isinstance(power, bool) or not isinstance(power, Real) or not math.isfinite(power):
            raise InputError(f"{name} is {shown(power)}: a finite number, the same everywhere, would be right")


def _drives(growth: GrowthLaw, material: Elasticity, energies: Floats) -> Floats:
    """The drive at energies; InputError if it is not a number of at least 0 for each."""
    name = f"the drive of {type(growth).__name__}"
    try:
        found = np.asarray(growth.drive(energies, material))
    except Exception as error:
        raise InputError(
            f"{name} fails for an array of energies, {shown(error)}{_hint(growth)}: arithmetic, or functions such as "
            "gx.functions.sqrt and ln that take numbers, arrays and UFL, would be right"
        ) from error
    if found.dtype.kind not in "fiu" or found.shape != energies.shape:
        raise InputError(f"{name} gives {shown(found)} for {energies.size} energies: a number for each would be right")
    wrong = np.flatnonzero(~(np.isfinite(found) & (found >= 0)))
    if len(wrong):
        raise InputError(
            f"{name} is {found[wrong[0]]:g} at an elastic energy of {energies[wrong[0]]:g}: a finite stimulus of at "
            "least 0 would be right"
        )
    return found


def _drive_in_ufl(growth: GrowthLaw, material: Elasticity, energy: float) -> float:
    """The same at one energy by the UFL expression; InputError if it is none, or has no finite slope."""
    name = f"the drive of {type(growth).__name__}"
    variable = ufl.variable(ufl.as_ufl(energy))
    try:
        found = ufl.as_ufl(growth.drive(variable, material))
        value = number(found)
    except Exception as error:
        raise InputError(
            f"{name} fails for an energy in UFL, {shown(error)}{_hint(growth)}: arithmetic, or functions such as "
            "gx.functions.sqrt and ln that take numbers, arrays and UFL, would be right"
        ) from error
    try:
        slope = number(ufl.diff(found, variable))
    except (ArithmeticError, ValueError):
        slope = math.nan
    if not math.isfinite(slope):
        raise InputError(
            f"{name} has no finite slope at an elastic energy of {energy:g}, where Newton's method needs one: a drive "
            "that is rounded there, as growthx.constitutive.stimulus.equivalent_strain is, would be right"
        )
    return value


def _hint(law: Any) -> str:
    """Which parameters of a law look like fields that it has not declared, as a part of a sentence."""
    names = [part.name for part in fields(law) if is_function(getattr(law, part.name))]
    return f" (parameters that vary in space, {', '.join(names)} perhaps, go into its coefficients)" if names else ""


def _require_same(growth: GrowthLaw, energy: float, drive: float, other: float, how: str) -> None:
    if not math.isclose(drive, other, rel_tol=SAME, abs_tol=1e-300):
        raise InputError(
            f"the drive of {type(growth).__name__} is {drive:.10g} at an elastic energy of {energy:g} in an array and "
            f"{other:.10g} {'alone' if how != 'UFL' else 'in UFL'}: the same would be right"
        )


def _check_linear(growth: GrowthLaw, energies: Floats, drives: Floats) -> None:
    """Refuse a drive that is said to be proportional to the energy and is not."""
    linear = growth.linear
    if not isinstance(linear, bool):
        raise InputError(f"linear, of {type(growth).__name__}, is {shown(linear)}: True or False would be right")
    if linear and not np.allclose(drives, energies / energies[-1] * drives[-1], rtol=SAME, atol=0.0):
        raise InputError(
            f"the drive of {type(growth).__name__} is said to be linear, and is {drives[-2]:g} and {drives[-1]:g} at "
            f"the elastic energies {energies[-2]:g} and {energies[-1]:g}: linear = False would be right"
        )


# -- weight ------------------------------------------------------------------------------------------------------------


def _check_weight(growth: MassSource, material: Elasticity, mesh: Mesh) -> None:
    """Refuse a weight that is not the same for numbers, arrays and in UFL, and a law that cannot follow it."""
    forms: list[Callable[[float], Any]] = [
        float,
        lambda value: np.full(len(RELATIVE_DENSITIES), value),
        lambda value: ufl.variable(ufl.as_ufl(value)),
    ]
    try_weight(*(_with(material, mesh, form) for form in forms))
    if isinstance(growth, StimulusDriven):
        growth.powers(material)


# -- material ----------------------------------------------------------------------------------------------------------


def _check_material(material: Material) -> None:
    """Refuse an elastic energy that is not a number for numbers, or another one in UFL."""
    name = f"the elastic energy of {type(material).__name__}"
    for stretches in STRETCHES:
        try:
            number, symbolic = _energies(material, stretches)
            stresses = material.principal_stresses((stretches[0] - 1, stretches[1] - 1, stretches[2] - 1), 1.0)
        except Exception as error:
            raise InputError(
                f"{name} fails at the stretches {stretches}, {shown(error)}: arithmetic, or functions such as "
                "gx.functions.sqrt and ln that take numbers, complex ones too, and UFL, would be right"
            ) from error
        if not (isinstance(number, Real) and math.isfinite(number) and all(map(math.isfinite, stresses))):
            raise InputError(
                f"{name} is {shown(number)}, with the stresses {shown(stresses)}, at the stretches {stretches}: "
                "finite ones would be right"
            )
        if not math.isclose(number, symbolic, rel_tol=1e-6, abs_tol=1e-12):
            raise InputError(
                f"{name} is {number:.10g} at the stretches {stretches} and {symbolic:.10g} in UFL: the same would be "
                "right"
            )


def _energies(material: Material, stretches: tuple[float, float, float]) -> tuple[Any, float]:
    """The elastic energy at principal stretches, for numbers and by the UFL expression."""
    extensions = stretches[0] - 1, stretches[1] - 1, stretches[2] - 1
    H = ufl.as_tensor([[extension if i == k else 0.0 for k in range(3)] for i, extension in enumerate(extensions)])
    return material.principal_energy(extensions), number(material.energy_at(H))
