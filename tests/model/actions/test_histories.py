"""Loads and supports through time: what a table says is what acts, and its jumps are ends of steps."""

from dataclasses import replace

import numpy as np
import pytest
import ufl
from blocks import COMM, ROLLERS, block, densities, displacements, run, square

import growthx as gx
from growthx.common.errors import InputError

STILL = gx.EnergyDrivenGrowth(attractor=0.0, rate=0.0)
KINDS = (gx.Q1P0, gx.Q1, gx.Q1Q1, gx.P2P1)
kinds = pytest.mark.parametrize("variant", KINDS, ids=lambda variant: variant.name)
JUMPING = gx.Table(((0.0, 0.0), (0.13, 0.5), (0.13, 1.0), (0.27, 1.0), (0.27, -0.5)))


def test_a_table_is_linear_between_rows_and_steady_beyond():
    """At a jump it is what it was before: the step that ends there had that load."""
    table = gx.Table([(1.0, 2.0), (2.0, 4.0), (2.0, 1.0), (4.0, 0.0)])
    shares = {0.0: 2.0, 1.0: 2.0, 1.5: 3.0, 2.0: 4.0, 2.000001: 1.0, 3.0: 0.5, 4.0: 0.0, 9.0: 0.0}
    assert {t: table(t) for t in shares} == pytest.approx(shares, abs=1e-6)
    assert table.jumps == (2.0,) and table.peak == 4.0
    assert table(2.0 * (1 + 1e-15)) == 4.0, "round-off does not jump"
    steps = gx.Table.steps(((0.0, 1.0), (10.0, 2.0)))
    assert (steps(5.0), steps(10.0), steps(11.0)) == (1.0, 1.0, 2.0)


@pytest.mark.parametrize(
    "text", ["t,share\n0,0\n1,0.5\n\n# a jump\n1,1\n", "0;0\n1;0.5\n1;1\n", "\ufefftime share\n0 0\n1\t0.5\n1 1.0\n"]
)
def test_a_table_is_read_from_a_file(shared_folder, text):
    """As spreadsheets and scripts write them."""
    path = shared_folder / "history.csv"
    if COMM.rank == 0:
        path.write_text(text, encoding="utf-8")
    COMM.barrier()
    assert gx.Table.read(path) == gx.Table(((0.0, 0.0), (1.0, 0.5), (1.0, 1.0)))


REFUSED = {
    "order": (((0.0, 0.0), (2.0, 1.0), (1.0, 1.0)), "row 3 of a table of a history has t = 1 after t = 2: times that"),
    "three": (((1.0, 0.0), (1.0, 1.0), (1.0, 2.0)), "three rows of t = 1: one, or two for a jump, would be right"),
    "empty": ((), "a table of a history has no rows: one (time, share) at least would be right"),
    "nan": (((0.0, np.nan),), "the share in row 1 of a table of a history is nan: a finite number would be right"),
    "shape": (((0.0, 1.0, 2.0),), "row 1 of a table of a history is (0.0, 1.0, 2.0): (time, share) would be right"),
    "text": ("0 1", "a table of a history is '0 1': rows (time, share) would be right"),
}


@pytest.mark.parametrize(("rows", "sentence"), REFUSED.values(), ids=REFUSED)
def test_what_is_no_table_is_refused(rows, sentence):
    """When it is made, with the row."""
    with pytest.raises(InputError) as caught:
        gx.Table(rows)
    assert sentence in str(caught.value)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("t,share\n0,0\n1;x\n", "line 3 of the history .*csv is '1;x': two numbers, time and share, with a point"),
        ("0,0,0\n1,1\n", "line 1 of the history .*csv is '0,0,0': two numbers"),
        ("0,5;1,0\n1,0;2,0\n", "line 1 of the history .*csv is '0,5;1,0': two numbers, time and share, with a point"),
        ("0,0\n2,1\n1,1\n", "csv: row 3 of a table of a history has t = 1 after t = 2"),
        ("a\nb\n", "line 2 of the history"),
        (None, "cannot be read .No such file or directory.: a file of two columns would be right"),
    ],
)
def test_a_file_that_holds_no_table_is_refused(shared_folder, text, sentence):
    """On all ranks, with file and line."""
    path = shared_folder / "history.csv"
    if COMM.rank == 0 and text is not None:
        path.write_text(text)
    COMM.barrier()
    with pytest.raises(InputError, match=sentence):
        gx.Table.read(path)


@kinds
@pytest.mark.parametrize("stepping", [None, gx.AdaptiveSteps(0.02)], ids=["fixed", "adaptive"])
def test_steps_end_where_a_history_jumps(variant, stepping):
    """With the share before the jump at its end, and the one after it at the end of the next."""
    load = gx.Traction("right", (0.05, 0.0), history=JUMPING)
    scene = block(square(2, shape=variant.cells[0]), loads=(load,))
    steps, _ = run(scene, variant, stepping=stepping)
    times = [step.time for step in steps]
    assert {0.13, 0.27} <= {round(time, 12) for time in times}
    for step in steps:
        share = JUMPING(step.time)
        assert step.reactions["left"] == pytest.approx([-0.05 * share, 0.0], abs=1e-4 if stepping else 1e-9)
    after = min(step.time for step in steps if step.time > 0.131)
    assert JUMPING(after) == 1.0


@kinds
def test_displacements_follow_a_history(variant):
    """Of a boundary and of a point, beside what is held still; the body is stretched to and fro."""
    history = gx.Table(((0.0, 0.0), (0.2, 1.0), (0.4, -1.0)))
    scene = block(
        square(2, shape=variant.cells[0]),
        growth=STILL,
        material=gx.Material(young=1.0, poisson=0.0),
        supports=(*ROLLERS, gx.Support("right", (0.1, None), history=history)),
        loads=(),
    )
    problem = gx.discretise(scene, variant)
    for step in gx.march(scene, variant, problem):
        x, _, u, _ = displacements(problem).T
        moved = 0.1 * history(step.time)
        assert u == pytest.approx(moved * x, abs=1e-9)
        stretch = 1 + moved
        assert step.reactions["right"][0] == pytest.approx((stretch - 1 / stretch) / 2, abs=1e-8)
    pin = replace(scene, supports=(gx.Support("left"), gx.PointSupport((1.0, 0.5), (0.05, None), history=history)))
    steps, problem = run(pin, variant)
    assert problem.sample_displacement(np.array([[1.0, 0.5]]))[0, 0] == pytest.approx(0.05 * history(steps[-1].time))


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1Q1], ids=lambda variant: variant.name)
def test_a_pressure_follows_a_history(variant):
    """In place of the ramp: as one that is ramped likewise, and not at all where its share is zero."""
    plain = block(square(2), loads=(gx.Pressure("right", -0.05),))
    timed = replace(plain, loads=(gx.Pressure("right", -0.05, history=plain.program.amplitude),))
    first, second = (run(scene, variant, tolerance=1e-12)[1] for scene in (plain, timed))
    assert densities(first) == pytest.approx(densities(second), rel=1e-10)
    assert displacements(first) == pytest.approx(displacements(second), rel=1e-8, abs=1e-12)
    none = replace(plain, loads=(gx.Pressure("right", -0.05, history=lambda t: 0.0),))
    assert np.abs(displacements(run(none, variant)[1])[:, 2:]).max() == 0.0


def test_open_loads_of_ones_own_say_when_they_act_and_what_they_hold():
    """Their history, whether they are ramped, and along what they resist are taken from the class."""
    law = lambda u, rho, x: ufl.as_vector([0.05, 0.0])  # noqa: E731
    timed = type("Timed", (gx.OpenTraction,), {"history": property(lambda self: lambda t: 2 * t)})("right", law)
    at_once = type("AtOnce", (gx.OpenTraction,), {"ramped": False})("right", law)
    for load, share in ((timed, lambda step: 2 * step.time), (at_once, lambda step: 1.0)):
        for step in run(block(square(2), loads=(load,)), gx.Q1)[0]:
            assert step.reactions["left"] == pytest.approx([-0.05 * share(step), 0.0], abs=1e-9)
    sliding = type("Sliding", (gx.OpenTraction,), {"holds": (1,)})("right", lambda u, rho, x: -u)
    with pytest.raises(InputError, match="is free to move along x"):
        gx.discretise(block(square(2), supports=(), loads=(sliding,)), gx.Q1)


def test_places_of_ones_own_are_loaded():
    """A class that says places and forces is a load with all that belongs to one."""

    class Comb(gx.NodalLoad):
        place = "at the comb"

        def points(self, mesh):
            return np.array([[1.05, 0.2], [1.05, 0.7]]), np.array([[0.02, 0.0], [0.03, 0.01]])

    near = type("Near", (Comb,), {"within": 0.1})
    for step in run(block(square(2), loads=(near(),)), gx.Q1)[0]:
        assert step.reactions["left"] == pytest.approx(-step.load * np.array([0.05, 0.01]), abs=1e-9)
    with pytest.raises(InputError, match=r"the load at the comb, at \(1.05, 0.2\), is 0.05 away from the body"):
        block(square(2), loads=(Comb(),))


def test_a_run_with_tables_is_resumed_with_them(shared_folder):
    """Also with a table that goes on longer; with other shares up to there it is refused."""

    def scene(table, until):
        supports = (gx.Support("left"), gx.Support("right", (0.02, None), history=table))
        return block(square(2), supports=supports, loads=(), program=gx.Program(step=0.1, until=until))

    table = gx.Table(((0.0, 0.0), (0.15, 0.5), (0.15, 1.0), (0.4, 0.8)))
    longer = gx.Table((*table.rows, (0.6, 0.2)))
    gx.solve(scene(table, 0.4), gx.Q1P0, out=shared_folder / "run", checkpoint=1)
    resumed = gx.solve(scene(longer, 0.6), gx.Q1P0, resume=shared_folder / "run")
    whole = gx.solve(scene(longer, 0.6), gx.Q1P0)
    assert densities(resumed.problem) == pytest.approx(densities(whole.problem), rel=1e-10)
    other = gx.Table(((0.0, 0.0), (0.4, 0.8)))
    with pytest.raises(InputError, match="the history of support 'right'"):
        gx.solve(scene(other, 0.6), gx.Q1P0, resume=shared_folder / "run")
