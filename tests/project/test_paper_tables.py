"""How the page on the paper's tables counts and compares: a rule that were loose, or tuned, would make agreement."""

import math

import numpy as np
import pytest

import growthx as gx
from benchmarks.accuracy.paper_tables import paper
from benchmarks.accuracy.paper_tables.bars import Compared, compared, read_bars
from benchmarks.accuracy.paper_tables.elements import density_places, displacement_nodes
from benchmarks.accuracy.paper_tables.nearest import RULES, Named, nearest, read_readings
from benchmarks.accuracy.paper_tables.newton import orders
from benchmarks.accuracy.paper_tables.readings import density_readings, displacement_readings
from growthx.scenes.bar import (
    CONTINUOUS,
    PROBLEMS,
    end_displacement,
    midpoint_axis_density_change,
    midpoint_density_change,
)


@pytest.mark.parametrize(
    ("value", "printed", "quantity", "agrees"),
    [
        (0.5274414, 0.527441, "density", True),
        (0.5274424, 0.527441, "density", True),
        (0.5274426, 0.527441, "density", False),
        (2.937324, 2.93732, "displacement", True),
        (2.937336, 2.93732, "displacement", False),
    ],
)
def test_agreement_in_print(value, printed, quantity, agrees):
    """One unit of the last digit that the paper prints of that quantity, after rounding, and no more."""
    assert paper.to_print(value, printed, quantity) is agrees


def test_all_numbers_of_the_paper_are_compared():
    """Two problems, eight elements, three meshes, two quantities: each once, and by one rule."""
    numbers = compared(read_bars())
    assert len(numbers) == 96
    assert len({(each.problem, each.variant, each.elements, each.quantity) for each in numbers}) == 96
    assert {name: set(rows) for name, rows in paper.PAPER.items()} == {
        name: {variant.name for variant in paper.VARIANTS} for name in PROBLEMS
    }


def test_every_element_has_the_readings_of_its_columns():
    """The same names whatever the number that is looked for; and the first of them is our rule, to the last bit."""
    readings, numbers = read_readings(), compared(read_bars())
    names: dict[tuple[str, str], set[tuple[str, ...]]] = {}
    for number in numbers:
        own = [reading for reading in readings if reading.is_of(number)]
        assert own[0].reading == RULES[number.quantity]
        assert own[0].value == number.ours
        names.setdefault((number.variant, number.quantity), set()).add(tuple(reading.reading for reading in own))
    assert all(len(found) == 1 for found in names.values())
    of = {variant: len(next(iter(names[variant, "density"]))) for variant, _ in names}
    assert of["Q1P0"] == of["Q1sri"] < of["Q1Q1"] == of["S2Q1"] == of["Q1"] == of["S2fri"] < of["Q2"] == of["Q2Q2"]


@pytest.mark.parametrize("variant", [gx.Q2Q2, gx.Q2, gx.Q1, gx.Q1P0, gx.S2Q1], ids=lambda variant: variant.name)
def test_readings_of_a_known_density(variant):
    """On ρ = 1 + x each has the value of its place, a mean that of its cell; extrapolation is exact for the linear."""
    problem = gx.discretise(gx.scenes.bar(CONTINUOUS, 10), variant)
    problem.density.interpolate(lambda x: 1 + x[0])
    problem.displacement.interpolate(lambda x: np.stack([x[0] + x[1], 0 * x[0]]))
    found = density_readings(problem, 10)
    assert found["right cell: column 1, edge"] == pytest.approx(midpoint_density_change(problem), abs=1e-14)
    assert found["right cell: column 1, axis"] == pytest.approx(midpoint_axis_density_change(problem), abs=1e-14)
    for cell, middle in {"left": 0.45, "right": 0.55}.items():
        assert found[f"{cell} cell: mean of its densities"] == pytest.approx(middle, abs=1e-12)
    shift = 0.0 if variant is gx.Q1P0 else 0.1 * 0.1 / 12 / 0.65  # its width falls from 0.7 to 0.6 from left to right
    assert found["second cell to the left: mean over its area"] == pytest.approx(0.35 - shift, abs=1e-9)
    both = "mean of the right and left cell"
    assert found[f"{both}: mean over its area"] == pytest.approx(0.5, abs=1e-9)  # the taper is symmetric
    if variant is not gx.Q1P0:
        for name in ("linearly", "through all densities"):
            for row in ("edge", "axis"):
                assert found[f"left cell: extrapolated {name} to the end, {row}"] == pytest.approx(0.5, abs=1e-9)
    ends = displacement_readings(problem)
    assert ends["corner"] == pytest.approx(end_displacement(problem), abs=1e-14)
    assert (ends["corner"], ends["axis"], ends["upper corner"], ends["mean over the end"]) == pytest.approx(
        (0.995, 1.0, 1.005, 1.0), abs=1e-12
    )


def test_rows_are_told_apart():
    """Edge and axis are where the density differs across the bar: of a row at the rim and one in the middle."""
    problem = gx.discretise(gx.scenes.bar(CONTINUOUS, 10), gx.Q2)
    problem.density.interpolate(lambda x: 1 + np.where(np.abs(x[1]) < 1e-6, 0.1, np.where(x[1] < 0, 0.4, 0.7)))
    found = density_readings(problem, 10)
    for column in (1, 2, 3):
        rows = [found[f"left cell: column {column}, {row}"] for row in ("edge", "axis", "mean of its rows")]
        assert rows == pytest.approx([0.4, 0.1, 0.4], abs=1e-12)


def test_the_nearest_reading_is_the_first_of_equals():
    """Of readings that are one, that with the simplest name; their number is told, since some will fit by chance."""
    number = Compared("continuous", "Q2", 10, "density", 0.51, 0.514584)
    values = {"far": 0.6, "simple": 0.514581, "the same": 0.514581 + 1e-13, "other": 0.5145}
    readings = [Named("continuous", "Q2", 10, "density", name, value) for name, value in values.items()]
    readings.append(Named("continuous", "Q2", 40, "density", "of another mesh", number.paper))
    best, different = nearest(number, readings)
    assert (best.reading, different) == ("simple", 3)
    assert not best.to_print


def test_observed_orders():
    """Two for squares, one for halves; none of the first two norms, nor of what round-off has left."""
    assert orders([1e-1, 1e-2, 1e-4, 1e-8])[2:] == pytest.approx([2.0, 2.0])
    assert orders([1.0, 0.5, 0.25])[2] == pytest.approx(1.0)
    assert all(map(math.isnan, orders([1e-1, 1e-6, 1e-13, 1e-14])))
    assert all(map(math.isnan, orders([1.0])))


def test_elements_have_the_unknowns_of_the_paper():
    """Nodes, densities and points that are drawn are as many as the variant has in a cell."""
    found = {
        variant.name: (len(displacement_nodes(variant)), len(density_places(variant))) for variant in paper.VARIANTS
    }
    assert found == {
        "Q1Q1": (4, 4),
        "Q2Q2": (9, 9),
        "S2Q1": (8, 4),
        "Q1P0": (4, 1),
        "Q1": (4, 4),
        "Q2": (9, 9),
        "Q1sri": (4, 1),
        "S2fri": (8, 4),
    }
