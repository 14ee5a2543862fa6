"""Where steps begin: polynomials are continued exactly, and of the degree that serves."""

import numpy as np
import pytest
from blocks import COMM

from growthx.stepping.prediction import Prediction

PLACES = np.linspace(1.0, 2.0, 7)


def told(values, times):
    prediction = Prediction(COMM)
    for time in times:
        prediction.remember(time, values(time))
    return prediction


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_polynomials_are_continued_exactly(degree):
    """At uneven times, too, as steps from error have them."""
    times = np.array([0.0, 0.1, 0.15, 0.4, 0.5, 0.9])
    prediction = told(lambda time: PLACES * time**degree + 1.0, times)
    assert prediction.at(1.3) == pytest.approx(PLACES * 1.3**degree + 1.0, rel=1e-12)


def test_what_stood_still_stays_to_the_bit():
    """Densities at a bound must be foretold at the bound: a rounding error off it they would be held by nothing."""
    prediction = told(lambda time: np.array([1.1, 0.3, 1.0 + time**2]), [0.0, 0.1, 0.2, 0.3, 0.4])
    assert prediction.at(0.5)[:2].tolist() == [1.1, 0.3]


def test_the_first_step_is_foretold_by_nothing_and_the_second_by_a_line():
    """There is no more to go by."""
    prediction = told(lambda time: PLACES * time, [0.0])
    assert prediction.at(0.1) is None
    prediction.remember(0.1, PLACES * 0.1)
    assert prediction.at(0.3) == pytest.approx(PLACES * 0.3, rel=1e-14)


def test_nothing_goes_on_as_it_went_after_a_restart():
    """After a bend of the load the old course would lead astray."""
    prediction = told(lambda time: PLACES * time, [0.0, 0.1, 0.2])
    prediction.restart()
    assert prediction.at(0.3) is None
    prediction.remember(0.3, PLACES * 0.2)
    assert prediction.at(0.4) == pytest.approx(PLACES * 0.2, rel=1e-14)


def test_high_degrees_are_not_trusted_where_they_failed():
    """Noise is made worse by every degree: what would have foretold the last time best foretells the next."""
    noise = np.random.default_rng(0).normal(size=(8, 50))
    prediction = Prediction(COMM)
    for k in range(7):
        prediction.remember(0.1 * k, 1.0 + 1e-3 * noise[k])
    foretold = prediction.at(0.7)
    assert foretold is None or np.abs(foretold - 1.0).max() < 2 * 1e-3 * np.abs(noise).max()


def test_a_time_told_twice_counts_once():
    """The state at the start is found anew where the load is there at once."""
    prediction = told(lambda time: PLACES, [0.0])
    prediction.remember(0.0, 2 * PLACES)
    prediction.remember(0.1, 3 * PLACES)
    assert prediction.at(0.2) == pytest.approx(4 * PLACES, rel=1e-14)
