"""A statement of the paper, how it is measured, and what the numbers say of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

CONFIRMED, REFUTED, OPEN = "confirmed", "refuted", "open"
Numbers = Mapping[str, float]
Verdict = tuple[str, str]  # one of the three words, and a sentence why
Sentence = str | Callable[[Numbers], str]


@dataclass(frozen=True)
class Claim:
    """One statement.

    name: of the command.  place: in the paper.  statement: in our words.  measure: runs what it takes, numbers by their
    labels, "row: column" or plain.  verdict: what these say, and why.  quick: whether it takes no more than some ten
    seconds.  timed: whether its numbers are of times, which differ from run to run.
    """

    name: str
    place: str
    statement: str
    measure: Callable[[], dict[str, float]]
    verdict: Callable[[Numbers], Verdict]
    quick: bool = True
    timed: bool = False


def decide(
    condition: Callable[[Numbers], bool], so: Sentence, if_not: Sentence, otherwise: str = REFUTED
) -> Callable[[Numbers], Verdict]:
    """Confirmed where a condition on the numbers holds, else what `otherwise` says; each with its own sentence."""

    def verdict(numbers: Numbers) -> Verdict:
        word, why = (CONFIRMED, so) if condition(numbers) else (otherwise, if_not)
        return word, why if isinstance(why, str) else why(numbers)

    return verdict


def values(numbers: Numbers, part: str) -> list[float]:
    """The numbers whose labels have a part."""
    return [value for label, value in numbers.items() if part in label]


def row(numbers: Numbers, name: str) -> list[float]:
    """The numbers of a row."""
    return [value for label, value in numbers.items() if label.startswith(f"{name}: ")]


def column(numbers: Numbers, name: str) -> dict[str, float]:
    """The numbers of a column, by their rows."""
    ends = f": {name}"
    return {label.removesuffix(ends): value for label, value in numbers.items() if label.endswith(ends)}


def largest(numbers: Numbers, part: str) -> str:
    """The largest of some numbers, for a sentence."""
    return f"{max(values(numbers, part)):.3g}"
