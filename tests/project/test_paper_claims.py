"""The page on the paper's statements is what its program finds: each is measured anew, and judged by the same rule."""

import contextlib
import re

import numpy as np
import pytest
from blocks import COMM

from benchmarks.accuracy.paper_claims.page import CLAIMS, PAGE, WORDS, named, numbers_file, page, read_numbers, told

pytestmark = pytest.mark.skipif(COMM.size > 1, reason="the statements are measured on one rank")

PLACES = (
    *(f"T{number}" for number in range(1, 15)),
    *(f"F{number}" for number in range(1, 13)),
    *("R3.2", "R3.3", "R4.1", "R4.2", "R4.3", "R4.4", "R5.1", "R5.2", "R5.3", "R6.1"),
    *("§4.4", "§4.4.1", "§4.4.2", "§5.4", "§6", "§7"),
)


def test_the_page_is_what_the_program_writes():
    """To the letter, from the numbers that are kept beside the other pages."""
    assert PAGE.read_text(encoding="utf-8") == page()


def test_every_table_figure_and_remark_is_spoken_of():
    """None of the fourteen tables and twelve figures, and no remark that states something, is passed over."""
    spoken = {place for claim in CLAIMS for place in claim.place.split(", ")}
    assert spoken >= set(PLACES)


def test_every_statement_has_a_name_of_its_own():
    """By which its command finds it."""
    assert len({claim.name for claim in CLAIMS}) == len(CLAIMS)
    assert all(named(claim.name) is claim and re.fullmatch(r"[a-z0-9-]+", claim.name) for claim in CLAIMS)
    assert named("no-such-statement") is None


def test_numbers_are_those_of_the_statements():
    """Each has its own in the file, and the file has no others."""
    kept = [line.partition(",")[0] for line in numbers_file().read_text(encoding="utf-8").splitlines()[1:]]
    assert list(dict.fromkeys(kept)) == [claim.name for claim in CLAIMS]


def test_numbers_are_told_in_rows_and_columns():
    """Where all rows have the same columns; else one beneath the other."""
    assert told({"a: x": 1.0, "a: y": 2.0, "b: x": 3.0, "b: y": 4.0})[3:] == ["| a | 1 | 2 |", "| b | 3 | 4 |"]
    assert told({"a: x": 1.0, "b: y": 2.0})[3:] == ["| a: x | 1 |", "| b: y | 2 |"]


def others(numbers):
    """Other numbers than those that were found: of another size, sign or order."""
    values, rng = list(numbers.values()), np.random.default_rng(0)
    yield from (dict.fromkeys(numbers, each) for each in (0.0, 1.0))
    yield from ({label: factor * value for label, value in numbers.items()} for factor in (-1, 1e-9, 0.3, 2.25, 3, 1e9))
    yield {label: value if value > 1 else 0.0 for label, value in numbers.items()}
    for _ in range(300):
        factors = 10.0 ** rng.uniform(-3, 3, len(values))
        yield dict(zip(numbers, factors * rng.permutation(values), strict=True))
        yield {label: value * rng.choice([0.01, 1.0, 100.0]) for label, value in numbers.items()}


def words_of(claim, numbers):
    """What a statement would be called with other numbers, where these can be judged at all."""
    for each in others(numbers):
        with contextlib.suppress(ZeroDivisionError, ValueError):
            yield claim.verdict(each)[0]


@pytest.mark.parametrize("claim", CLAIMS, ids=lambda claim: claim.name)
def test_a_verdict_follows_from_the_numbers(claim):
    """With other numbers it would be another one: none is a foregone conclusion."""
    kept = read_numbers()[claim.name]
    word = claim.verdict(kept)[0]
    assert any(other != word for other in words_of(claim, kept))


@pytest.mark.parametrize(
    "claim",
    [pytest.param(claim, id=claim.name, marks=() if claim.quick else (pytest.mark.slow,)) for claim in CLAIMS],
)
def test_a_statement_is_what_the_page_says(claim):
    """Measured anew: the same verdict, and the same numbers but for round-off on another machine.

    Of ratios of times only that they are measured: a machine in use may say otherwise.
    """
    kept = read_numbers()[claim.name]
    numbers = claim.measure()
    assert numbers and numbers.keys() == kept.keys()
    word, why = claim.verdict(numbers)
    assert word in WORDS and why
    if claim.timed:
        return
    assert word == claim.verdict(kept)[0]
    for label, value in numbers.items():
        assert value == pytest.approx(kept[label], rel=1e-3, abs=1e-8), label
