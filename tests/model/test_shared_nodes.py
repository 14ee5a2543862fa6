"""A node has one displacement: supports that share nodes agree, at all times, or are refused, in any order."""

import numpy as np
import pytest
from blocks import COMM, block, cube, square

import growthx as gx
from growthx.common.errors import InputError

STILL = gx.EnergyDrivenGrowth(attractor=0.0, rate=0.0)
KINDS = (gx.Q1P0, gx.Q1Q1, gx.S2Q1, gx.P2P1)
UP = gx.Table(((0.0, 0.0), (1.0, 1.0)))


def held(variant, *supports, mesh=None):
    mesh = mesh or square(2, shape=variant.cells[0])
    scene = block(mesh, growth=STILL, supports=supports, loads=(), program=gx.Program(0.5, 1.0, ramp=1.0))
    return gx.discretise(scene, variant)


@pytest.mark.parametrize("variant", KINDS, ids=lambda variant: variant.name)
@pytest.mark.parametrize("turned", [False, True], ids=["", "reversed"])
def test_two_displacements_of_a_corner_are_refused(variant, turned):
    """Which of them won was up to their order."""
    supports = (gx.Support("left"), gx.PointSupport((0.0, 0.0), (0.1, None)))
    with pytest.raises(
        InputError, match=r"share nodes, and hold them along x at (0 and 0\.05|0\.05 and 0) at t = 0\.5"
    ):
        held(variant, *(supports[::-1] if turned else supports))


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (gx.Support("left"), gx.Support("bottom", (None, -0.1))),
        (gx.Support("left", (0.1, 0.0)), gx.Support("left", (0.1, 0.0), history=np.sin)),
        (gx.Rotation("left", 0.2), gx.Support("bottom", (None, 0.0))),
        (gx.Support("left", (0.1, 0.0)), gx.Support("left", (0.1000001, 0.0))),
    ],
    ids=["faces", "histories", "rotation", "digits"],
)
def test_what_differs_is_told(one, other):
    """Values, histories and rotations, on all ranks."""
    with pytest.raises(InputError, match=f"'{one.on}' and '{other.on}' share nodes, .* would be right"):
        held(gx.Q1P0, one, other)


@pytest.mark.parametrize(
    "supports",
    [
        (gx.Support("left"), gx.Support("bottom", (None, 0.0))),
        (gx.Support("left", (0.1, None)), gx.Support("bottom", (None, -0.1))),
        (gx.Support("left", (0.1, 0.0)), gx.PointSupport((0.0, 0.0), (0.1, None), history=UP)),
        (gx.Rotation("left", 0.2, about=(0.0, 0.0)), gx.PointSupport((0.0, 0.0))),
        (gx.Rotation("left", 0.2), gx.Rotation("left", 0.2)),
    ],
    ids=["still", "directions", "same history", "pivot", "twice"],
)
def test_those_that_agree_hold(supports):
    """As they always have: corners of boundaries that are still, the pivot of a rotation."""
    problem = held(gx.Q1Q1, *supports)
    *_, last = gx.march(problem.scene, problem.variant, problem)
    assert last.force_defect < 1e-9


def test_many_nodes_cost_little():
    """Each of a face of its own, none shared: no pair of them is looked at."""
    body = cube(6)
    places = [(0.0, y, z) for y in np.linspace(0, 1, 7) for z in np.linspace(0, 1, 7)]
    problem = held(gx.Q1P0, *(gx.PointSupport(place) for place in places), mesh=body)
    own = COMM.allreduce(sum(len(each.dofs) for each in problem.system.supports.held) > 0)
    assert own and len(problem.system.supports.held) == 3 * 49
