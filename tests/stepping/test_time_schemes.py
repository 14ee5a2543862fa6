"""The schemes of time integration: their orders and their stability, from their weights alone."""

import numpy as np
import pytest

from growthx.stepping.time_schemes import IMPLICIT_EULER, SCHEMES, TR_BDF2

schemes = pytest.mark.parametrize("scheme", SCHEMES.values(), ids=SCHEMES)


def square(scheme):
    """The weights aᵢⱼ with the row of the start, and the times cᵢ."""
    rows = [(0.0,), *scheme.weights]
    size = len(rows)
    weights = np.array([[*row, *[0.0] * (size - len(row))] for row in rows])
    return weights, np.array([0.0, *scheme.times])


def amplification(scheme, z):
    """What a step of length one makes of y' = z y, y = 1."""
    weights, _ = square(scheme)
    slopes = np.linalg.solve(np.eye(len(weights)) - z * weights, z * np.ones(len(weights)))
    return 1 + weights[-1] @ slopes


@schemes
def test_a_step_is_as_long_as_it_says(scheme):
    """The rows sum to the times, the last of which is the end: a slope of one must change the density by Δt."""
    weights, times = square(scheme)
    assert weights.sum(axis=1) == pytest.approx(times, abs=1e-15)
    assert scheme.times[-1] == 1.0
    assert sum(scheme.compared) == pytest.approx(1.0, abs=1e-15)


@schemes
def test_the_order_is_the_one_it_states(scheme):
    """Halving the step of y' = −y² divides the error by 2^order."""
    errors = []
    for steps in (20, 40, 80):
        y, length = 1.0, 1.0 / steps
        slope = -(y**2)
        for _ in range(steps):
            slopes = [slope]
            for row in scheme.weights:
                base = y + length * np.dot(row[:-1], slopes)
                here = row[-1] * length
                stage = (np.sqrt(1 + 4 * here * base) - 1) / (2 * here)
                slopes.append(-(stage**2))
            y, slope = stage, slopes[-1]
        errors.append(abs(y - 0.5))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx(scheme.order, abs=0.1)


@schemes
def test_stiff_densities_are_damped(scheme):
    """L-stable: no growth for any decay or oscillation, and nothing left of what decays infinitely fast."""
    for z in -np.logspace(-3, 8, 50):
        assert abs(amplification(scheme, z)) < 1.0
    for z in 1j * np.logspace(-3, 4, 50):
        assert abs(amplification(scheme, z)) <= 1 + 1e-14
    assert abs(amplification(scheme, -1e6)) < 1e-4


def test_the_compared_scheme_is_of_the_next_order():
    """The estimate is then that of the error itself, not of something larger."""
    weights, times = square(TR_BDF2)
    compared = np.array(TR_BDF2.compared)
    assert compared @ times == pytest.approx(1 / 2, abs=1e-15)
    assert compared @ times**2 == pytest.approx(1 / 3, abs=1e-15)
    assert compared @ weights @ times == pytest.approx(1 / 6, abs=1e-15)
    assert np.dot(IMPLICIT_EULER.compared, (0.0, 1.0)) == 1 / 2
