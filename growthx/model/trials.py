"""Mass sources and stored energies of any form, tried before they are computed with.

What is stated once must be the same for numbers, arrays and UFL, and what follows by differentiation must be finite.
"""

from __future__ import annotations

import math
from numbers import Real
from typing import TYPE_CHECKING, Any

import numpy as np
import ufl

from growthx.common.errors import InputError, shown

if TYPE_CHECKING:
    from growthx.common.arrays import Floats
    from growthx.constitutive.energies import Elasticity, StoredEnergy
    from growthx.constitutive.sources import MassSource

RELATIVE_DENSITIES = np.array([0.03, 0.4, 1.0, 1.7])
SHARES = np.array([0.0, 1e-9, 1e-6, 1e-3, 0.1])  # of the stiffness: energies
SAME, ALIKE = 1e-9, 1e-6  # relative: values, slopes
GRADIENTS = (  # displacement gradients, of which some are of a strain in the plane
    np.diag([0.1, -0.05, 0.0]),
    np.diag([-0.1, 0.05, 0.02]),
    np.array([[0.05, 0.1, 0.0], [-0.03, 0.02, 0.0], [0.0, 0.0, 0.0]]),
    np.array([[0.05, 0.1, -0.04], [-0.03, 0.02, 0.07], [0.06, 0.01, -0.08]]),
)
FUNCTIONS = "arithmetic, or functions such as gx.functions.sqrt and ln that take numbers, arrays and UFL,"
PRESTRESS = 1e-8  # of the stiffness: what is round-off at rest

Laws = tuple["MassSource", "Elasticity"]


def number(expression: Any) -> float:
    """The value of a UFL expression of numbers."""
    return float(ufl.algorithms.expand_derivatives(ufl.as_ufl(expression))(()))


# -- mass sources ------------------------------------------------------------------------------------------------------


def try_source(in_numbers: Laws, in_arrays: Laws, in_ufl: Laws) -> None:
    """Refuse a source that is not the same function of numbers, arrays and UFL, or has not the slope it must have.

    The laws with parameters that are numbers, arrays of the shape (states,) and UFL; states: see `sample_states`.
    """
    growth, material = in_numbers
    name = f"the mass source of {type(growth).__name__}"
    densities, energies = sample_states(material)
    values = _values(name, *in_arrays, densities, energies)
    slopes = _slopes(name, *in_arrays, densities, energies)
    for state, value, slope in zip(zip(densities, energies, strict=True), values, slopes, strict=True):
        one = tuple(np.array([each]) for each in state)
        _require_same(name, state, value, _values(name, growth, material, *one)[0], "alone", SAME)
        found = _in_ufl(name, *in_ufl, *map(float, state))
        _require_same(name, state, value, found[0], "in UFL", SAME)
        scale = ALIKE * abs(value) / state[0]
        for other, how in ((found[1], "in UFL"), (found[2], "by differentiation")):
            if abs(slope - other) > ALIKE * abs(other) + scale:
                raise InputError(
                    f"the slope of {name} is {slope:.6g} at {_at(state)} in an array and {other:.6g} {how}: the same, "
                    "of functions that take complex numbers, would be right"
                )
    _try_linear(name, growth, densities, values, energies)
    _try_resting_rate(growth, material)


def sample_states(material: Elasticity) -> tuple[Floats, Floats]:
    """Densities and energies at which sources are tried, for parameters that are numbers, shape (states,) each."""
    densities, shares = np.meshgrid(RELATIVE_DENSITIES, SHARES, indexing="ij")
    return densities.ravel() * material.reference_density, shares.ravel() * material.stiffness


def _values(name: str, growth: MassSource, material: Elasticity, densities: Floats, energies: Floats) -> Floats:
    try:
        found = np.asarray(growth.mass_source(densities, energies, material))
    except Exception as error:
        raise InputError(f"{name} fails for arrays, {shown(error)}: {FUNCTIONS} would be right") from error
    if found.dtype.kind not in "fiu" or found.shape not in ((), densities.shape):
        raise InputError(f"{name} gives {shown(found)} for {densities.size} states: a number for each would be right")
    found = np.broadcast_to(found, densities.shape)
    _require_finite(name, found, densities, energies)
    return found


def _slopes(name: str, growth: MassSource, material: Elasticity, densities: Floats, energies: Floats) -> Floats:
    try:
        found = np.broadcast_to(growth.mass_source_slope(densities, energies, material), densities.shape)
    except Exception as error:
        raise InputError(
            f"{name} has no slope for arrays, {shown(error)}: functions that take complex numbers, or a "
            "mass_source_slope of its own, would be right"
        ) from error
    _require_finite(f"the slope of {name}", found, densities, energies)
    return found


def _in_ufl(name: str, growth: MassSource, material: Elasticity, density: float, energy: float) -> list[float]:
    """Source, slope as the law has it and slope by differentiation, in UFL at one state."""
    rho, psi = ufl.variable(ufl.as_ufl(density)), ufl.variable(ufl.as_ufl(energy))
    try:
        source = ufl.as_ufl(growth.mass_source(rho, psi, material))
        stated = ufl.as_ufl(growth.mass_source_slope(rho, psi, material))
        value = number(source)
    except Exception as error:
        raise InputError(f"{name} fails in UFL, {shown(error)}: {FUNCTIONS} would be right") from error
    found = [value]
    for slope in (stated, ufl.diff(source, rho), ufl.diff(source, psi)):
        try:
            found.append(number(slope))
        except (ArithmeticError, ValueError):
            found.append(math.nan)
    if not all(map(math.isfinite, found)):
        raise InputError(
            f"{name} has no finite slope at {_at((density, energy))}, where Newton's method needs one: a source that "
            "is rounded there would be right"
        )
    return found[:3]


def _try_linear(name: str, growth: MassSource, densities: Floats, values: Floats, energies: Floats) -> None:
    if not isinstance(growth.linear, bool):
        raise InputError(f"linear, of {type(growth).__name__}, is {shown(growth.linear)}: True or False would be right")
    shape = len(RELATIVE_DENSITIES), len(SHARES)
    rows, shares = values.reshape(shape), energies.reshape(shape) / energies.max()
    line = rows[:, :1] + shares * (rows[:, -1:] - rows[:, :1])
    if growth.linear and not np.allclose(rows, line, rtol=SAME, atol=SAME * np.abs(rows).max(initial=0.0)):
        raise InputError(f"{name} is said to be linear in the energy, and is not: linear = False would be right")


def _try_resting_rate(growth: MassSource, material: Elasticity) -> None:
    rate = growth.resting_rate(material)
    if isinstance(rate, bool) or not isinstance(rate, Real) or not (0 <= float(rate) < math.inf):
        raise InputError(
            f"the resting rate of {type(growth).__name__} is {shown(rate)}: a number of at least 0 would be right"
        )


def _require_finite(name: str, found: Floats, densities: Floats, energies: Floats) -> None:
    wrong = np.flatnonzero(~np.isfinite(found))
    if len(wrong):
        at = _at((densities[wrong[0]], energies[wrong[0]]))
        raise InputError(f"{name} is {found[wrong[0]]:g} at {at}: a finite one would be right")


def _require_same(name: str, state: Any, value: float, other: float, how: str, share: float) -> None:
    if not math.isclose(value, other, rel_tol=share, abs_tol=1e-300):
        raise InputError(
            f"{name} is {value:.10g} at {_at(state)} in an array and {other:.10g} {how}: the same would be right"
        )


def _at(state: Any) -> str:
    return f"a density of {state[0]:g} and an elastic energy of {state[1]:g}"


# -- weights -----------------------------------------------------------------------------------------------------------


def try_weight(in_numbers: Elasticity, in_arrays: Elasticity, in_ufl: Elasticity) -> None:
    """Refuse a weight that is not the same function of numbers, arrays and UFL, or has not the slope it must have."""
    name = f"the weight of {type(in_numbers.density_exponent).__name__}"
    densities = RELATIVE_DENSITIES * in_numbers.reference_density
    weights, exponents = _weights(name, in_arrays, densities)
    for density, weight, exponent in zip(map(float, densities), weights, exponents, strict=True):
        at = f"a density of {density:g}"
        if not (math.isfinite(weight) and weight > 0 and math.isfinite(exponent)):
            raise InputError(f"{name} is {weight:g}, its exponent {exponent:g}, at {at}: a positive one would be right")
        alone = [each[0] for each in _weights(name, in_numbers, np.array([density]))]
        for other, how in ((alone, "alone"), (_weight_in_ufl(name, in_ufl, density), "in UFL")):
            if not math.isclose(weight, other[0], rel_tol=SAME):
                raise InputError(
                    f"{name} is {weight:.10g} at {at} in an array and {other[0]:.10g} {how}: the same would be right"
                )
            for found in other[1:]:
                if not math.isclose(exponent, found, rel_tol=ALIKE, abs_tol=ALIKE):
                    raise InputError(
                        f"the exponent of {name} is {exponent:.6g} at {at} in an array and {found:.6g} {how}: the "
                        "same, of functions that take complex numbers, would be right"
                    )


def _weights(name: str, material: Elasticity, densities: Floats) -> tuple[Floats, Floats]:
    try:
        found = [np.asarray(value(densities)) for value in (material.weight, material.exponent_at)]
    except Exception as error:
        raise InputError(f"{name} fails for arrays, {shown(error)}: {FUNCTIONS} would be right") from error
    for values in found:
        if values.dtype.kind not in "fiu" or values.shape not in ((), densities.shape):
            raise InputError(f"{name} gives {shown(values)} for {densities.size} densities: one each would be right")
    return np.broadcast_to(found[0], densities.shape), np.broadcast_to(found[1], densities.shape)


def _weight_in_ufl(name: str, material: Elasticity, density: float) -> tuple[float, float, float]:
    """Weight, exponent as it is stated and exponent by differentiation."""
    rho = ufl.variable(ufl.as_ufl(density))
    try:
        weight = ufl.as_ufl(material.weight(rho))
        value, stated = number(weight), number(material.exponent_at(rho))
        return value, stated, density * number(ufl.diff(weight, rho)) / value
    except Exception as error:
        raise InputError(f"{name} fails in UFL, {shown(error)}: {FUNCTIONS} would be right") from error


# -- stored energies ---------------------------------------------------------------------------------------------------


def try_energy(material: StoredEnergy) -> None:
    """Refuse an energy that is no number, or that stores or bears anything at rest; parameters: numbers."""
    name = f"the energy of {type(material).__name__}"
    _try_stiffness(material)
    at_rest = np.zeros((3, 3))
    for H in (at_rest, *GRADIENTS):
        for dim in (3, 2) if not H[2].any() and not H[:, 2].any() else (3,):
            try:
                energy, stress = _energy(material, H[:dim, :dim])
                stated = number(material.energy(ufl.as_matrix((np.eye(3) + H).tolist())))
            except InputError:
                raise
            except Exception as error:
                raise InputError(
                    f"{name} fails at the displacement gradient {H.tolist()}, {shown(error)}: UFL of F, of the shape "
                    "(3, 3) in the plane, too, would be right"
                ) from error
            if not (
                math.isfinite(energy) and np.all(np.isfinite(stress)) and energy >= -PRESTRESS * material.stiffness
            ):
                raise InputError(
                    f"{name} is {energy:g} at the displacement gradient {H.tolist()}: a finite one of at least 0, "
                    "with finite stresses, would be right"
                )
            if abs(energy - stated) > ALIKE * abs(stated) + 1e-12 * material.stiffness:
                raise InputError(
                    f"{name} is {stated:.10g} by F and {energy:.10g} by H at the displacement gradient {H.tolist()}: "
                    "the same would be right"
                )
            if H is at_rest and max(energy, np.abs(stress).max()) > PRESTRESS * material.stiffness:
                raise InputError(
                    f"{name} is {energy:g}, with a stress of {np.abs(stress).max():g}, in a body at rest, which would "
                    "move and grow by itself: none would be right"
                )


def try_across(material: StoredEnergy) -> None:
    """Refuse an energy that bears shear across a plane body that is deformed in its plane; parameters: numbers."""
    for H in GRADIENTS:
        if not (H[2, :2].any() or H[:2, 2].any()):
            _, stress = _energy(material, H + np.diag([0.0, 0.0, 0.01]))
            shear = max(np.abs(stress[2, :2]).max(), np.abs(stress[:2, 2]).max())
            if shear > PRESTRESS * material.stiffness:
                raise InputError(
                    f"the energy of {type(material).__name__} bears a shear stress of {shear:g} across the plane at "
                    f"the displacement gradient {H.tolist()}, for which plane stress has no strain: one whose "
                    "directions lie in the plane or across it, or plane strain, would be right"
                )


def _try_stiffness(material: StoredEnergy) -> None:
    stiffness = material.stiffness
    if isinstance(stiffness, bool) or not isinstance(stiffness, Real) or not (0 < float(stiffness) < math.inf):
        raise InputError(
            f"the stiffness of {type(material).__name__} is {shown(stiffness)}: a positive number would be right"
        )


def _energy(material: StoredEnergy, H: Floats) -> tuple[float, Floats]:
    """Energy and stress, without the weight, at a displacement gradient of shape (dim, dim)."""
    variable = ufl.variable(ufl.as_matrix(H.tolist()))
    energy = material.energy_at(variable)
    stress = ufl.algorithms.expand_derivatives(ufl.diff(energy, variable))
    entries = [float(stress[index](())) for index in np.ndindex(H.shape)]
    return number(energy), np.reshape(entries, H.shape)
