"""A statement of the paper, how it is measured, and what the numbers say of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

CONFIRMED, REFUTED, OPEN = "confirmed", "refuted", "open"
Numbers = Mapping[str, float]
Judgement = tuple[str, str]  # one of the three, and why


@dataclass(frozen=True)
class Claim:
    """One statement.

    name: of the command.  place: in the paper.  statement: in our words.  measure: runs what it takes, numbers by what
    they are.  judge: what these say, and why.  quick: whether it takes no more than some ten seconds.
    """

    name: str
    place: str
    statement: str
    measure: Callable[[], dict[str, float]]
    judge: Callable[[Numbers], Judgement]
    quick: bool = True


def holds_if(condition: Callable[[Numbers], bool], why: str) -> Callable[[Numbers], Judgement]:
    """Confirmed where a condition holds, else refuted; why: what is compared."""
    return lambda numbers: (CONFIRMED if condition(numbers) else REFUTED, why)


def undecided(why: str) -> Callable[[Numbers], Judgement]:
    """Open whatever the numbers are."""
    return lambda numbers: (OPEN, why)


def values(numbers: Numbers, part: str) -> list[float]:
    """The numbers whose names have a part."""
    return [value for name, value in numbers.items() if part in name]
