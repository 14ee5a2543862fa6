"""What a run tells the person at the terminal at its end."""

import pytest
from blocks import COMM, block

import growthx as gx
from growthx.stepping.record import Cost


@pytest.fixture(scope="module")
def result():
    """Of a run of a few steps."""
    return gx.solve(block(), gx.Q1P0)


def test_times_come_with_the_memory(result, capsys):
    """Of all ranks together, once: what the next larger mesh will need is guessed from it."""
    gx.report.times(result)
    told = capsys.readouterr().out
    if COMM.rank:
        assert not told
    else:
        assert f", at most {result.costs[-1].peak_memory:.0f} MB of memory\n" in told


@pytest.mark.parametrize("costs", [[], [Cost(1.0, float("nan"))]], ids=["a march", "no such system"])
def test_no_memory_is_told_where_none_is_known(result, costs, monkeypatch, capsys):
    """A march keeps no costs, and some systems do not say."""
    monkeypatch.setattr(result, "costs", costs)
    gx.report.times(result)
    assert "memory" not in capsys.readouterr().out
