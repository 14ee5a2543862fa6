"""Fields that have values at the integration points of one rule alone: refused where other points are meant.

Basix compares the number of points alone: values at 2 × 2 Gauss points would be taken for values at the four corners.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import basix
import numpy as np
import ufl

from growthx.common.errors import InputError
from growthx.fem.compat import cell_name

if TYPE_CHECKING:
    from growthx.common.arrays import Floats


SAME = 1e-10  # of a reference cell's size: distance of points that are the same


def points_of(field: Any) -> Floats | None:
    """The points of the reference cell, (points, dim), at which alone a field has values; None if it has them anywhere.

    field: anything a scene may take for one.
    """
    if not hasattr(field, "function_space"):
        return None
    element = field.function_space.ufl_element()
    return element.custom_quadrature()[0] if getattr(element, "has_custom_quadrature", False) else None


def check_form(form: ufl.Form) -> None:
    """Raise InputError if a form needs a field at other points than those at which it has values."""
    if all(points_of(field) is None for field in form.coefficients()):
        return
    for integral in form.integrals():
        told = integral.integral_type() == "cell" and integral.metadata().get("quadrature_degree") is not None
        _check_coefficients(integral.integrand(), rule_of(integral)[0] if told else None)


def check_expression(value: Any, X: Floats) -> None:
    """Raise InputError if an expression needs a field at other points X, (points, dim), than those it has values at."""
    _check_coefficients(value, X)


def _check_coefficients(value: Any, points: Floats | None) -> None:
    """points: where the value is needed, None outside of the points of any cell."""
    for field in ufl.algorithms.extract_coefficients(value):
        known = points_of(field)
        if known is not None and (points is None or not are_same(known, points)):
            raise InputError(
                f"the field '{getattr(field, 'name', field)}' has its values at {len(known)} integration points of a "
                "cell alone, and is needed at others: one of values per cell or at nodes would be right"
            )


def rule_of(integral: Any) -> tuple[Floats, Floats]:
    """Points, (points, dim), and weights of an integral over cells whose degree is told."""
    rule = dict(integral.metadata())
    degree, scheme = rule["quadrature_degree"], rule.get("quadrature_rule", "default")
    if scheme == "custom":
        return np.array(rule["quadrature_points"]), np.array(rule["quadrature_weights"])
    return _rule(cell_name(integral.ufl_domain()), degree, scheme)


def rule_points(shape: str, degree: int, scheme: str = "default") -> Floats:
    """The points of an integration rule, shape (points, dim)."""
    return _rule(shape, degree, scheme)[0]


def _rule(shape: str, degree: int, scheme: str) -> tuple[Floats, Floats]:
    cell = basix.CellType[shape]
    if scheme == "vertex":
        points, size = np.asarray(basix.geometry(cell)), float(np.sum(basix.make_quadrature(cell, 1)[1]))
        return points, np.full(len(points), size / len(points))
    kind = basix.QuadratureType.gll if scheme == "GLL" else basix.QuadratureType.default
    points, weights = map(np.asarray, basix.make_quadrature(cell, degree, rule=kind))
    return points, weights


def are_same(one: Floats, other: Floats) -> bool:
    """Whether two sets of points of the reference cell are the same, in the same order."""
    return one.shape == other.shape and bool(np.abs(one - other).max(initial=0.0) < SAME)
