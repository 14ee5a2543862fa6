"""The page, from the numbers of all statements."""

from __future__ import annotations

import csv
from pathlib import Path

from benchmarks.accuracy.paper_claims import femurs, profiles, tables, theory
from benchmarks.accuracy.paper_claims.claim import CONFIRMED, OPEN, REFUTED, Claim
from benchmarks.shared.reporting import RESULTS, write_csv

CLAIMS: tuple[Claim, ...] = (*tables.CLAIMS, *profiles.CLAIMS, *theory.CLAIMS, *femurs.CLAIMS)
PAGE = RESULTS.parents[1] / "docs" / "paper.md"
MODULE = "benchmarks.accuracy.paper_claims"

INTRODUCTION = """\
# The paper, statement by statement

Kuhl, Menzel & Steinmann, *Computational modeling of growth*, Computational Mechanics 32 (2003) 71–88: what it says and
shows, in our words, each with a command that measures it anew in less than two minutes, the numbers, and what they say:
{counts}. The verdict follows from the numbers by a rule in the program; none is set by hand.

Made by `python -m benchmarks.accuracy.paper_claims --all`; one statement by its name:

```sh
./run python -m benchmarks.accuracy.paper_claims q2q2-worst
```

All of the paper's tables are beside ours on [the page of the tables](../benchmarks/results/paper_tables.md), with the
pictures in the paper's form. More on stability is on [its page](../benchmarks/results/stability.md) and on that of
[Remark 6.1](../benchmarks/results/zero_one.md).
"""


def named(name: str) -> Claim | None:
    """The statement of that name."""
    return next((claim for claim in CLAIMS if claim.name == name), None)


def numbers_file(folder: Path = RESULTS) -> Path:
    """Where the numbers of all are."""
    return folder / "paper_claims.csv"


def write_numbers(found: dict[str, dict[str, float]], folder: Path = RESULTS) -> None:
    """Keep the numbers in full."""
    rows = [(name, what, value) for name, numbers in found.items() for what, value in numbers.items()]
    write_csv(numbers_file(folder), ("claim", "what", "value"), rows)


def read_numbers(folder: Path = RESULTS) -> dict[str, dict[str, float]]:
    """Those that were kept, by the names of the statements."""
    found: dict[str, dict[str, float]] = {claim.name: {} for claim in CLAIMS}
    with numbers_file(folder).open(newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            found[row["claim"]][row["what"]] = float(row["value"])
    return found


def told(numbers: dict[str, float]) -> list[str]:
    """The numbers as a table; where all are zero, in a line."""
    if len(numbers) > 1 and not any(numbers.values()):
        return ["", f"Measured: {next(iter(numbers))}; and {len(numbers) - 1} more, all 0."]
    rows = [f"| {what} | {value:.4g} |" for what, value in numbers.items()]
    return ["", "| measured | |", "| :-- | --: |", *rows] if rows else []


def page(folder: Path = RESULTS) -> str:
    """The page, from the CSV file of a folder."""
    kept = read_numbers(folder)
    verdicts = {claim.name: claim.judge(kept[claim.name]) for claim in CLAIMS}
    parts = [f"{sum(word == each for word, _ in verdicts.values())} {each}" for each in (CONFIRMED, REFUTED, OPEN)]
    lines = [INTRODUCTION.format(counts=f"{parts[0]}, {parts[1]}, {parts[2]}")]
    lines += ["| statement | place | verdict |", "| :-- | :-- | :-- |"]
    lines += [
        f"| [{claim.statement}](#{claim.name}) | {claim.place} | *{verdicts[claim.name][0]}* |" for claim in CLAIMS
    ]
    for claim in CLAIMS:
        word, why = verdicts[claim.name]
        lines += ["", f"## {claim.name}", "", f"{claim.place}: {claim.statement}", "", f"*{word}* – {why}."]
        lines += told(kept[claim.name])
    return "\n".join(lines) + "\n"
