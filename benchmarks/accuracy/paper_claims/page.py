"""The page, from the numbers of all statements."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from pathlib import Path

from benchmarks.accuracy.paper_claims import (
    bar_tables,
    costs,
    counts,
    femurs,
    fronts,
    newton,
    remarks,
    smooth,
    strategies,
    zero_one,
)
from benchmarks.accuracy.paper_claims.claim import CONFIRMED, OPEN, REFUTED, Claim
from benchmarks.shared.reporting import RESULTS, write_csv

CLAIMS: tuple[Claim, ...] = (
    *counts.CLAIMS,
    *bar_tables.CLAIMS,
    *fronts.CLAIMS,
    *smooth.CLAIMS,
    *remarks.CLAIMS,
    *strategies.CLAIMS,
    *newton.CLAIMS,
    *femurs.CLAIMS,
    *zero_one.CLAIMS,
    *costs.CLAIMS,
)
PAGE = RESULTS.parents[1] / "docs" / "paper.md"
MODULE = "benchmarks.accuracy.paper_claims"
WORDS = (CONFIRMED, REFUTED, OPEN)
MOST_COLUMNS, WIDEST_COLUMN = 8, 40  # characters

INTRODUCTION = """\
# The paper, statement by statement

Kuhl, Menzel & Steinmann, *Computational modeling of growth*, Computational Mechanics 32 (2003) 71–88: what it says and
shows, in our words, each with a command that measures it anew in less than two minutes, the numbers, and what they say:
{counts}.
The verdict follows from the numbers by a rule in the program; none is set by hand. T is a table of the paper, F a
figure, R a remark, § a section.

Made by `python -m benchmarks.accuracy.paper_claims --all`; one statement by its name, as told below it.

The paper's tables and pictures as a whole are beside ours on
[the page of the tables](../benchmarks/results/paper_tables.md). More on stability is on
[its page](../benchmarks/results/stability.md) and on that of [Remark 6.1](../benchmarks/results/zero_one.md).
"""


def named(name: str) -> Claim | None:
    """The statement of that name."""
    return next((claim for claim in CLAIMS if claim.name == name), None)


def numbers_file(folder: Path = RESULTS) -> Path:
    """Where the numbers of all are."""
    return folder / "paper_claims.csv"


def write_numbers(found: Mapping[str, Mapping[str, float]], folder: Path = RESULTS) -> None:
    """Keep the numbers in full."""
    rows = [(name, label, value) for name, numbers in found.items() for label, value in numbers.items()]
    write_csv(numbers_file(folder), ("name", "label", "value"), rows)


def read_numbers(folder: Path = RESULTS) -> dict[str, dict[str, float]]:
    """Those that were kept, by the names of the statements, in the order of the page."""
    found: dict[str, dict[str, float]] = {claim.name: {} for claim in CLAIMS}
    with numbers_file(folder).open(newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            found.setdefault(row["name"], {})[row["label"]] = float(row["value"])
    return {name: numbers for name, numbers in found.items() if named(name)}


def told(numbers: Mapping[str, float]) -> list[str]:
    """The numbers as a table: of rows and columns where all have the same ones, else one beneath the other."""
    rows, columns = (list(dict.fromkeys(label.partition(": ")[which] for label in numbers)) for which in (0, 2))
    full = len(rows) * len(columns) == len(numbers) and 1 < len(columns) <= MOST_COLUMNS
    if not full or max(map(len, columns)) > WIDEST_COLUMN:
        lines = [f"| {label} | {value:.6g} |" for label, value in numbers.items()]
        return ["", "| measured | |", "| :-- | --: |", *lines]
    lines = ["", f"| | {' | '.join(columns)} |", f"| :-- |{' --: |' * len(columns)}"]
    for name in rows:
        values = (f"{numbers[f'{name}: {column}']:.6g}" for column in columns)
        lines.append(f"| {name} | {' | '.join(values)} |")
    return lines


def page(folder: Path = RESULTS) -> str:
    """The page, from the CSV file of a folder."""
    kept = read_numbers(folder)
    verdicts = {claim.name: claim.verdict(kept[claim.name]) for claim in CLAIMS}
    parts = [f"{sum(word == each for word, _ in verdicts.values())} {each}" for each in WORDS]
    lines = [INTRODUCTION.format(counts=", ".join(parts))]
    lines += ["| statement | place | verdict |", "| :-- | :-- | :-- |"]
    lines += [
        f"| [{claim.statement}](#{claim.name}) | {claim.place} | *{verdicts[claim.name][0]}* |" for claim in CLAIMS
    ]
    for claim in CLAIMS:
        word, why = verdicts[claim.name]
        lines += ["", f"## {claim.name}", "", f"{claim.place}: {claim.statement}", "", f"*{word}* – {why}."]
        lines += [*told(kept[claim.name]), "", f"`./run python -m {MODULE} {claim.name}`"]
    return "\n".join(lines) + "\n"
