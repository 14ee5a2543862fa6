"""Sums Σ f(xᵢ) over the principal values of a tensor by its invariants alone: no principal value is ever computed.

Roots of the characteristic polynomial have no derivatives where two of them coincide, and lose half of their digits
beside it.  But ln(1 + x) and (1 + x)^β are means of simple fractions,

    ln(1 + x) = ∫ x/(1 + t x) dt,      (1 + x)^(−β) = ∫ w(t)/(1 + t x) dt  for 0 < β < 1,  over 0 < t < 1,

of which Gauss's rules make Padé approximants, and Σ xᵢ²/(1 + t xᵢ) is a fraction of the invariants.  What is left out
has the relative size [(λ − 1)/(λ + 1)]^(2 × points) at a stretch λ: round-off up to stretches of 1.3 and 0.8, 1e-9 at
1.6 and at 0.6, 4e-8 at 2 and at ½, and the sums are smooth at any.  xᵢ = λᵢ² − 1; invariants: see
`Invariants.of_strain`.
"""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np

POINTS = 8  # of Gauss's rules

Three = tuple[Any, Any, Any]


def sum_of_squared_logarithms(of_strain: Three) -> Any:
    """Σ ln²λᵢ = ¼ Σ ln²(1 + xᵢ)."""
    poles, shares = _of_squared_logarithm()
    return sum(share * _sums(of_strain, pole, 2)[0] for pole, share in zip(poles, shares, strict=True)) / 4


def sum_of_powers(of_strain: Three, exponent: float) -> Any:
    """Σ [λᵢ^α − 1 − ½ α xᵢ], for α > 0: what the powers have beyond their linear part."""
    half = exponent / 2
    whole = math.ceil(half)
    ways = [math.comb(whole, j) for j in range(whole + 1)]
    if whole == half:
        powers = _power_sums(of_strain, whole)
        return sum((ways[j] * powers[j] for j in range(2, whole + 1)), 0 * of_strain[0])
    total: Any = 0.0
    # (1 + x)^whole/(1 + t x) without its linear part, of which the mean over t is meant.
    for pole, share in zip(*_of_power(whole - half), strict=True):
        sums = _sums(of_strain, pole, max(whole, 2))
        total += share * (pole * pole - whole * pole) * sums[0]
        total += sum(share * ways[j] * sums[j - 2] for j in range(2, whole + 1))
    return total


def inverse(of_strain: Three) -> Three:
    """The same invariants of C⁻¹ − I."""
    first, second, third = of_strain
    determinant = 1 + (first + (second + third))
    return (
        -(first + 2 * second + 3 * third) / determinant,
        (second + 3 * third) / determinant,
        -third / determinant,
    )


def sum_beyond_inverse(of_strain: Three) -> Any:
    """Σ [xᵢ + yᵢ] = Σ xᵢ²/(1 + xᵢ), with yᵢ = λᵢ⁻² − 1."""
    return _sums(of_strain, 1.0, 2)[0]


def _sums(of_strain: Three, pole: float, highest: int) -> list[Any]:
    """Σ xᵢʲ/(1 + t xᵢ) for j from 2 to the highest."""
    first, second, third = of_strain
    powers = _power_sums(of_strain, highest + 1)
    below = 1 + pole * (first + pole * (second + pole * third))
    return [
        (powers[j] + pole * ((first * powers[j] - powers[j + 1]) + pole * (third * powers[j - 1]))) / below
        for j in range(2, highest + 1)
    ]


def _power_sums(of_strain: Three, highest: int) -> list[Any]:
    """Σ xᵢʲ for j from 0 to the highest, by Newton's identities."""
    first, second, third = of_strain
    sums = [3.0, first, first * first - 2 * second]
    while len(sums) <= highest:
        sums.append(first * sums[-1] - second * sums[-2] + third * sums[-3])
    return sums


@cache
def _of_squared_logarithm() -> tuple[list[float], list[float]]:
    """Poles t and shares of ln²(1 + x) = Σ share x²/(1 + t x): the product of two rules that have no pole in common."""
    (one, of_one), (other, of_other) = (_legendre(count) for count in (POINTS, POINTS + 1))
    apart = 1 / (one[:, np.newaxis] - other)
    shares = np.concatenate([of_one * one * (apart @ of_other), -of_other * other * (of_one @ apart)])
    return [*map(float, one), *map(float, other)], shares.tolist()


def _legendre(count: int) -> tuple[Any, Any]:
    places, weights = np.polynomial.legendre.leggauss(count)
    return (1 + places) / 2, weights / 2


@cache
def _of_power(exponent: float) -> tuple[list[float], list[float]]:
    """Poles t and shares of (1 + x)^(−β) = Σ share/(1 + t x), 0 < β < 1; shares: of the sum one."""
    from scipy.special import roots_jacobi  # asked for by few

    with np.errstate(invalid="ignore"):  # of 0/0 that SciPy does not use
        places, weights = roots_jacobi(POINTS, -exponent, exponent - 1)
    return ((1 + places) / 2).tolist(), (weights / weights.sum()).tolist()
