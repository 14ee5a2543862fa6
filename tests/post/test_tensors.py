"""Principal values in closed form: those that NumPy finds, with all digits, wherever two or three of them meet."""

import numpy as np
import pytest

from growthx.post.fields.principal import outer_values
from growthx.post.fields.tensors import symmetric

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


@pytest.mark.parametrize("count", [0, 1, 63, 64, 65, 130])
def test_of_any_number_and_layout(count):
    """Columns of a longer row, rows the other way round and single precision, as arrays come: no lane is left over, and
    nothing is read beside the array; what is no number spoils its own tensor alone."""
    random = np.random.default_rng(count)
    wide = random.normal(size=(count, 9))
    wide[count // 2 : count // 2 + 1, 3] = np.nan
    entries = wide[:, 2:8]
    exact = np.full((count, 2), np.nan)
    fine = np.isfinite(entries).all(axis=1)
    exact[fine] = np.linalg.eigvalsh(symmetric(entries[fine]))[:, [0, -1]]
    for found in (outer_values(entries), outer_values(entries[::-1])[::-1], outer_values(np.asfortranarray(entries))):
        assert found == pytest.approx(exact, abs=1e-14 * 9, nan_ok=True)
    assert outer_values(entries.astype(np.float32)) == pytest.approx(exact, abs=1e-5, nan_ok=True)
