"""Functions of floats, arrays and UFL expressions alike, which keep their digits near zero.

At the strains of bone, 1e-4 to 3e-3, an energy is the square of what is left of numbers near one: formed as
I₁ − 3 − 2 ln J from F, it has a relative error of 1e-16/ε² at the strain ε.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import ufl

from growthx.common.renamed import renamed

NEAR = 0.1  # |x| below which ln(1 + x) is taken from its series
TERMS = 6  # of the series, which leave a relative error below 1e-17 there


def is_symbolic(x: Any) -> bool:
    """Whether x is a UFL expression.

    Example:
        >>> gx.functions.is_symbolic(1.0)
        False
    """
    return isinstance(x, ufl.core.expr.Expr)


def sqrt(x: Any) -> Any:
    """Square root.

    Example:
        >>> float(gx.functions.sqrt(4.0))
        2.0
    """
    return ufl.sqrt(x) if is_symbolic(x) else np.sqrt(x)


def ln(x: Any) -> Any:
    """Natural logarithm.

    Example:
        >>> float(gx.functions.ln(1.0))
        0.0
    """
    return ufl.ln(x) if is_symbolic(x) else np.log(x)


def exp(x: Any) -> Any:
    """Exponential.

    Example:
        >>> float(gx.functions.exp(0.0))
        1.0
    """
    return ufl.exp(x) if is_symbolic(x) else np.exp(x)


@renamed(width="rounding")
def positive_part(x: Any, rounding: Any) -> Any:
    """X where it is above, 0 where it is below, with the corner rounded over 0 < x < r, the rounding, and nowhere else.

    There x² [2r − x]/r², whose slope is continuous, at least 0 and at most 4/3; it is below x by 4r/27 at most, at r/3.

    Example:
        >>> [f"{gx.functions.positive_part(x, 0.1):.3f}" for x in (-1.0, 0.05, 1.0)]
        ['0.000', '0.038', '1.000']
    """
    rounded = x * x * (2 * rounding - x) / (rounding * rounding)
    if is_symbolic(x) or is_symbolic(rounding):
        return ufl.conditional(ufl.lt(x, 0.0), 0.0, ufl.conditional(ufl.gt(x, rounding), x, rounded))
    real = np.real(x)
    return np.where(real < 0, 0.0, np.where(real > rounding, x, rounded))[()]


def smaller(x: Any, y: Any) -> Any:
    """The smaller of two.

    Example:
        >>> float(gx.functions.smaller(1.5, 1.0))
        1.0
    """
    return ufl.conditional(ufl.lt(x, y), x, y) if is_symbolic(x) or is_symbolic(y) else np.minimum(x, y)


def between(x: Any, low: float, high: float) -> Any:
    """x, or the bound that it lies beyond.

    Example:
        >>> float(gx.functions.between(1.5, 0.0, 1.0))
        1.0
    """
    if is_symbolic(x):
        return ufl.conditional(ufl.lt(x, low), low, ufl.conditional(ufl.gt(x, high), high, x))
    real = np.real(x)
    return np.where(real < low, low, np.where(real > high, high, x))[()]


def ln1p(x: Any) -> Any:
    """ln(1 + x), of a relative error near round-off for small x, too; not a number below −1.

    Example:
        >>> float(gx.functions.ln1p(0.0))
        0.0
    """
    # NumPy's own, of complex numbers, is ln of their sum with one.
    return x - ln1p_excess(x) if is_symbolic(x) or np.iscomplexobj(x) else np.log1p(x)


def ln1p_excess(x: Any) -> Any:
    """X − ln(1 + x) ≈ x²/2, without the difference of the two where they nearly agree; not a number below −1.

    With t = x/(2 + x), ln(1 + x) = 2 artanh t = 2 [t + t³/3 + t⁵/5 + …], and x − 2 t = x t.

    Example:
        >>> f"{gx.functions.ln1p_excess(1e-8):.6e}"
        '5.000000e-17'
    """
    if is_symbolic(x):
        return ufl.conditional(ufl.lt(abs(x), NEAR), _series(x), x - ufl.ln(1 + x))
    near = np.abs(x) < NEAR
    with np.errstate(all="ignore"):  # of the branch that is not taken
        return np.where(near, _series(x), x - np.log1p(x))[()]


def _series(x: Any) -> Any:
    t = x / (2 + x)
    square = t * t
    rest: Any = 1 / (2 * TERMS + 1)
    for power in reversed(range(3, 2 * TERMS + 1, 2)):
        rest = 1 / power + square * rest
    return t * (x - 2 * square * rest)
