"""What laws of the user's return, as UFL expressions, and exponents as compilers want them."""

from __future__ import annotations

import math
from typing import Any

import ufl

from growthx.common.arrays import is_uniform
from growthx.common.errors import InputError, shown


def expression(value: Any, shape: tuple[int, ...], what: str) -> Any:
    """What a law of the user's returned as a UFL expression; InputError if it is none of that shape."""
    wanted = f"a vector of {shape[0]}" if shape else "a scalar"
    try:
        found = ufl.as_ufl(value)
    except (TypeError, ValueError):  # UFL's own error is one of these
        raise InputError(f"{what} has the values {shown(value)}: {wanted} in UFL is needed") from None
    if found.ufl_shape != shape:
        raise InputError(f"{what} has values of shape {found.ufl_shape or 'of a scalar'}: {wanted} is needed")
    if isinstance(value, float) and not math.isfinite(value):
        raise InputError(f"{what} has the values {value}: finite ones are needed")
    return found


def exact_exponent(value: Any) -> Any:
    """The exponent as an integer where it is one: compilers turn integer powers into products; no number, as it is."""
    if not is_uniform(value):
        return value
    number = float(value)
    return int(number) if number.is_integer() else number
