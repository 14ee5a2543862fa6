"""The mass source and its slope: one law for floats, arrays and UFL, equal to the paper's formula."""

import numpy as np
import pytest
import ufl

from growthx.errors import InputError
from growthx.growth import EnergyDrivenGrowth
from growthx.material import Material

EXPONENTS = [(n, m) for n in (1, 2, 3.5) for m in (0, 1, 2, 3, 4.5)]


def laws(n, m):
    """A growth law and a material with no parameter equal to one."""
    return EnergyDrivenGrowth(0.7, 1.4, m), Material(2.0, 0.3, 1.3, n)


def number(expression):
    """The value of a UFL expression of numbers."""
    return ufl.algorithms.expand_derivatives(expression)(())


@pytest.mark.parametrize(("n", "m"), EXPONENTS)
def test_source_is_the_papers(n, m):
    """R₀ = c { [ρ/ρ*]^(−m) Ψ₀ − Ψ₀* } (6) with the weighted energy Ψ₀, not with Ψ₀ⁿᵉᵒ: n must enter."""
    growth, material = laws(n, m)
    rho, elastic = 1.9, 0.8
    energy = material.weight(rho) * elastic
    assert growth.mass_source(rho, elastic, material) == pytest.approx(1.4 * ((rho / 1.3) ** (-m) * energy - 0.7))


@pytest.mark.parametrize(("n", "m"), EXPONENTS)
def test_slope_is_the_derivative_of_the_source(n, m):
    """The local Newton is only quadratic with the exact slope; UFL's own derivative and differences must agree."""
    growth, material = laws(n, m)
    rho, elastic, step = 1.9, 0.8, 1e-5
    slope = growth.mass_source_slope(rho, elastic, material)
    ahead, back = (growth.mass_source(rho + shift, elastic, material) for shift in (step, -step))
    variable = ufl.variable(ufl.as_ufl(rho))
    derivative = ufl.diff(growth.mass_source(variable, elastic, material), variable)
    assert slope == pytest.approx((ahead - back) / (2 * step), abs=1e-9)
    assert slope == pytest.approx(number(derivative), abs=1e-14)


@pytest.mark.parametrize(("n", "m"), EXPONENTS)
def test_floats_arrays_and_ufl_give_the_same(n, m):
    """Node-based variants use UFL and point-based ones arrays: both must grow the same bone."""
    growth, material = laws(n, m)
    rho, elastic = np.array([0.2, 1.0, 3.1]), np.array([0.0, 0.4, 5.0])
    for law in (growth.stimulus, growth.mass_source, growth.mass_source_slope):
        floats = [law(float(a), float(b), material) for a, b in zip(rho, elastic, strict=True)]
        symbolic = [number(law(ufl.as_ufl(a), ufl.as_ufl(b), material)) for a, b in zip(rho, elastic, strict=True)]
        assert np.allclose(law(rho, elastic, material), floats, rtol=1e-15, atol=0)
        assert np.allclose(symbolic, floats, rtol=1e-13, atol=1e-15)


def test_no_source_where_the_stimulus_meets_the_attractor():
    """Biological equilibrium is what the model is about: R₀ must change its sign exactly there."""
    growth, material = laws(2, 3)
    rho = 1.3 * 0.9 / 0.7  # [ρ/ρ*]^(−1) 0.9 = 0.7
    assert abs(growth.mass_source(rho, 0.9, material)) < 1e-15
    assert growth.mass_source(rho, 0.91, material) > 0 > growth.mass_source(rho, 0.89, material)


@pytest.mark.parametrize(
    ("parameters", "sentence"),
    [
        ({"attractor": -0.1}, "the attractor stimulus Ψ₀* is -0.1: a number of at least 0 would be right"),
        ({"attractor": float("inf")}, "the attractor stimulus Ψ₀* is inf: a number of at least 0 would be right"),
        (
            {"attractor": {"bone": 1, "stem": float("nan")}},
            "the attractor stimulus Ψ₀* of 'stem' is nan: a number of at least 0 would be right",
        ),
        ({"rate": -1}, "the growth rate c is -1: a number of at least 0 would be right"),
        ({"exponent": -3}, "the exponent m is -3: a number of at least 0 would be right"),
        ({"exponent": "3"}, "the exponent m is '3': a number of at least 0 would be right"),
    ],
)
def test_impossible_parameters_are_refused(parameters, sentence):
    """The sentence must name symbol, value and remedy."""
    with pytest.raises(InputError) as caught:
        EnergyDrivenGrowth(**{"attractor": 1.0, **parameters})
    assert str(caught.value) == sentence


def test_no_attractor_and_no_growth_are_allowed():
    """Ψ₀* = 0 and c = 0 are the limits a user tries first to see pure apposition, or none."""
    law, material = EnergyDrivenGrowth(attractor=0.0, rate=0.0), Material(1.0)
    assert law.mass_source(1.0, 1.0, material) == 0.0
