"""The rows of the scenes that are done, in a folder, and what is counted of them for the page."""

from __future__ import annotations

import csv
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import astuple, dataclass, fields
from math import floor, log10
from typing import TYPE_CHECKING

import numpy as np

from benchmarks.robustness.random_scenes.running import FAILURES, SOLVED, Row
from benchmarks.shared.reporting import read_rows, write_csv, write_rows

if TYPE_CHECKING:
    from pathlib import Path

SCENES = "scenes.csv"  # in the folder of a user's choice
COUNTS, NUMBERS, FAILED = "random_scenes.csv", "random_scenes_numbers.csv", "random_scenes_failures.csv"
HEADER = [each.name for each in fields(Row)]


@dataclass(frozen=True)
class Count:
    """How many scenes, of a kind of scenes, ended so."""

    by: str
    what: str
    outcome: str
    kind: str
    count: int


@dataclass(frozen=True)
class Number:
    """A number over all scenes."""

    name: str
    value: float


@dataclass(frozen=True)
class Failure:
    """A scene that neither ended with a solution nor with a reason that has a name."""

    seed: int
    recipe: str
    shape: str
    variant: str
    outcome: str
    kind: str
    sentence: str


def _decade(value: float) -> str:
    return f"1e{floor(log10(value))}" if value > 0 else "none"


WAYS: dict[str, Callable[[Row], str]] = {
    "all": lambda row: "all",
    "program": lambda row: row.program,
    "dimension": lambda row: "space" if row.shape in ("hexahedron", "tetrahedron") else "plane",
    "shape": lambda row: row.shape,
    "variant": lambda row: f"{row.variant}, {row.shape}",
    "recipe": lambda row: row.recipe,
    "model": lambda row: "well posed" if row.well_posed else "ill-posed",
    "strain": lambda row: _decade(row.strain) + (", well posed" if row.well_posed else ", ill-posed"),
    "quality": lambda row: _decade(min(row.quality, 0.99)),
}


def read(folder: Path) -> list[Row]:
    """All rows of a folder, the last one of each number."""
    return list({row.seed: row for row in read_rows(folder / SCENES, Row)}.values())


class Appending:
    """A file of rows that grows, row by row."""

    def __init__(self, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        file = folder / SCENES
        new = not file.exists()
        self._file = file.open("a", newline="", encoding="utf-8")
        self._writer = csv.writer(self._file, lineterminator="\n")
        if new:
            self._writer.writerow(HEADER)

    def add(self, row: Row) -> None:
        """Keep a row."""
        self._writer.writerow(astuple(row))
        self._file.flush()

    def close(self) -> None:
        """Let the file go."""
        self._file.close()


def summarise(rows: Iterable[Row], folder: Path) -> None:
    """Write counts, numbers and failures."""
    rows = sorted(rows, key=lambda row: row.seed)
    counter = Counter((by, way(row), row.outcome, row.kind) for row in rows for by, way in WAYS.items())
    write_rows(folder / COUNTS, [Count(*key, count) for key, count in sorted(counter.items())])
    write_rows(folder / NUMBERS, [Number(name, value) for name, value in _numbers(rows).items()])
    failures = [
        Failure(row.seed, row.recipe, row.shape, row.variant, row.outcome, row.kind, row.sentence)
        for row in rows
        if row.outcome in FAILURES
    ]
    write_csv(folder / FAILED, [each.name for each in fields(Failure)], map(astuple, failures))


def _numbers(rows: list[Row]) -> dict[str, float]:
    checked = [row for row in rows if row.steps and row.outcome not in FAILURES]
    seconds = np.array([row.seconds for row in rows])
    found = {
        "first": float(rows[0].seed),
        "last": float(rows[-1].seed),
        "scenes": float(len(rows)),
        "checked": float(len(checked)),
        "seconds": float(seconds.sum()),
        "median seconds": float(np.median(seconds)),
        "mean seconds of solved": float(np.mean([row.seconds for row in rows if row.outcome == SOLVED] or [0.0])),
    }
    for name in ("momentum", "balance", "mass"):
        values = np.array([getattr(row, name) for row in checked])
        found |= {
            f"{name}, {share:g}": float(np.quantile(values, share)) if checked else 0.0 for share in (0.5, 0.99, 1.0)
        }
    return found
