"""Principal values in closed form: those that NumPy finds, with all digits, wherever two or three of them meet."""

import numpy as np
import pytest

from growthx.post.fields.tensors import outer_values, symmetric

ABOVE = {dim: np.triu_indices(dim) for dim in (2, 3)}


def turned(values, random):
    """Symmetric tensors of these principal values, (points, dim), about axes of their own; as entries."""
    dim = values.shape[1]
    axes = np.linalg.qr(random.normal(size=(len(values), dim, dim)))[0]
    tensors = np.einsum("pij,pj,pkj->pik", axes, values, axes)
    return tensors[:, ABOVE[dim][0], ABOVE[dim][1]]


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("apart", [1.0, 1e-4, 1e-8, 1e-12, 0.0])
def test_against_numpy(dim, apart):
    """Two values near one another are where an arc cosine would lose half of the digits: errors stay at round-off."""
    random = np.random.default_rng(7)
    base = random.uniform(-2, 2, (2000, dim))
    base[:, 1] = base[:, 0] + apart * random.uniform(-1, 1, 2000)
    entries = turned(base, random)
    exact = np.linalg.eigvalsh(symmetric(entries))
    assert np.abs(outer_values(entries) - exact[:, [0, -1]]).max() < 1e-14


@pytest.mark.parametrize("factor", [1e-150, 1e-60, 1.0, 1e60, 1e150])
def test_of_any_size(factor):
    """No unit is too small or too large: nothing of the powers up to the sixth over- or underflows."""
    random = np.random.default_rng(3)
    entries = turned(random.uniform(-2, 2, (500, 3)), random)
    exact = np.linalg.eigvalsh(symmetric(entries))[:, [0, -1]]
    assert outer_values(factor * entries) == pytest.approx(factor * exact, rel=1e-13, abs=1e-14 * factor)


def test_of_a_pressure_and_of_nothing():
    """Three equal values, and none at all: no division by zero."""
    assert outer_values(np.zeros((1, 6))).tolist() == [[0.0, 0.0]]
    assert outer_values(np.array([-3.0, 0, 0, -3.0, 0, -3.0])).tolist() == [-3.0, -3.0]
    assert outer_values(np.array([2.0, 0, 2.0])).tolist() == [2.0, 2.0]
