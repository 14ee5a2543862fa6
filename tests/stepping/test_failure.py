"""Balances that hold and are no states: corners that lumped sources look at, and that no force keeps from folding."""

import dolfinx
import numpy as np
import pytest
from blocks import block, square

import growthx as gx
from growthx.stepping.failure import Corners, inadmissible

FOLDED = 0.25  # of what the corner (1, 1) of four cells moves to where its edges are one straight line


def with_corner_moved(variant, away):
    """A square whose corner has gone to that place but for so much."""
    problem = gx.discretise(block(square(2)), variant)
    moved = dolfinx.fem.Function(problem.displacement_space)

    def move(x):
        here = np.isclose(x[0], 1.0) & np.isclose(x[1], 1.0)
        return np.where(here, away - FOLDED, 0.0) * np.ones((2, 1))

    moved.interpolate(move)
    unknown = problem.system.unknown.x.array.copy()
    for part in problem.system.unknowns.parts:
        unknown[part] = moved.x.array
    problem.system.unknown.x.array[:] = unknown
    return problem


LUMPED = gx.Q1Q1.lumped(with_source=True)


@pytest.mark.parametrize("away", [1e-10, 1e-15])
def test_a_corner_that_is_crushed_is_no_state(away):
    """The source asks for the energy there; J is so small that round-off decides whether there is one."""
    problem = with_corner_moved(LUMPED, away)
    assert inadmissible(problem) == ""
    assert Corners(problem).crushed() == (
        "det F is less than 1e-08 at a corner of the cell at (0.75, 0.75), where no force resists"
    )


def test_a_corner_that_is_folded_is_named():
    """Before, only integration points were looked at, and a run ended because no part of a step helped."""
    assert inadmissible(with_corner_moved(LUMPED, -1e-3)).startswith("det F ≤ 0 in the cell at (0.75, 0.75)")


@pytest.mark.parametrize(
    ("variant", "away"),
    [(LUMPED, 1e-6), (gx.Q1Q1, 1e-10), (gx.Q1Q1.lumped(), 1e-10), (gx.Q1, 1e-10)],
    ids=lambda value: getattr(value, "name", str(value)),
)
def test_other_corners_are_left_alone(variant, away):
    """What is small but known is a state, and so is what no energy is asked of."""
    problem = with_corner_moved(variant, away)
    assert Corners(problem).crushed() == ""
    assert inadmissible(problem) == ""
