"""The page on the paper's statements is what its program finds: each is measured anew, and judged by the same rule."""

import pytest
from blocks import COMM

from benchmarks.accuracy.paper_claims.claim import CONFIRMED, OPEN, REFUTED
from benchmarks.accuracy.paper_claims.page import CLAIMS, PAGE, named, page, read_numbers

pytestmark = pytest.mark.skipif(COMM.size > 1, reason="the statements are measured on one rank")
TIMED = ("costs", "cheapest")  # ratios of times: measured, but a machine in use may say otherwise


def test_the_page_is_what_the_program_writes():
    """To the letter, from the numbers that are kept beside the other pages."""
    assert PAGE.read_text(encoding="utf-8") == page()


def test_every_statement_has_a_name_of_its_own():
    """By which its command finds it."""
    assert len({claim.name for claim in CLAIMS}) == len(CLAIMS)
    assert all(named(claim.name) is claim for claim in CLAIMS)
    assert named("no-such-statement") is None


@pytest.mark.parametrize(
    "claim",
    [pytest.param(claim, id=claim.name, marks=() if claim.quick else (pytest.mark.slow,)) for claim in CLAIMS],
)
def test_a_statement_is_what_the_page_says(claim):
    """Measured anew: the same verdict, and the same numbers but for round-off on another machine."""
    kept = read_numbers()[claim.name]
    numbers = claim.measure()
    assert numbers.keys() == kept.keys()
    if claim.name in TIMED:
        return
    verdict, why = claim.judge(numbers)
    assert verdict in (CONFIRMED, REFUTED, OPEN) and why
    assert verdict == claim.judge(kept)[0]
    for what, value in numbers.items():
        assert value == pytest.approx(kept[what], rel=1e-3, abs=1e-8), what
