"""What the benchmarks share: a progress bar, and tables on the terminal, as CSV and as Markdown."""

from __future__ import annotations

import csv
import textwrap
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import astuple, dataclass, fields
from pathlib import Path
from typing import Any, TypeVar

from mpi4py import MPI
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from growthx import report

Row = TypeVar("Row")
WIDTH = 120  # characters of a line of text
RESULTS = Path(__file__).parents[1] / "results"


@dataclass(frozen=True)
class Table:
    """A table of text, with notes below it that are numbered from 1."""

    title: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    notes: Sequence[str] = ()

    def show(self) -> None:
        """Print it on the terminal, on rank 0."""
        report.table(self.title, self.header, self.rows, MPI.COMM_WORLD)
        if MPI.COMM_WORLD.rank == 0 and self.notes:
            print(*self._numbered(), sep="\n")

    def markdown(self) -> str:
        """The table with its title as a section, the first column to the left and the others to the right."""
        lines = [f"## {self.title}", "", _line(self.header), _line([":--"] + ["--:"] * (len(self.header) - 1))]
        return "\n".join([*lines, *map(_line, self.rows), "", *self._numbered(), ""])

    def _numbered(self) -> list[str]:
        return [f"{number}. {note}" for number, note in enumerate(self.notes, start=1)]


def _line(cells: Iterable[str]) -> str:
    return f"| {' | '.join(cells)} |"


def item(sentence: str) -> str:
    """An entry of a list, in lines."""
    return textwrap.fill(f"- {sentence}", WIDTH, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False)


def write_csv(path: Path, header: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Write numbers in full."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        writer.writerows(rows)


def write_rows(path: Path, rows: Sequence[Any]) -> None:
    """Write dataclasses of numbers and texts, at least one, all of one kind: a column for each field."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_csv(path, [field.name for field in fields(rows[0])], map(astuple, rows))


def read_rows(path: Path, kind: type[Row]) -> list[Row]:
    """The rows of a CSV file, see `rows_of`; none without a file."""
    if not path.exists():
        return []
    with path.open(newline="", encoding="utf-8") as file:
        return rows_of(file, kind)


def rows_of(lines: Iterable[str], kind: type[Row]) -> list[Row]:
    """The rows of CSV that has a column for each field of a dataclass of numbers and texts.

    The dataclass is of a module whose annotations are text (`from __future__ import annotations`).
    """
    types = {"int": int, "float": float, "str": str}
    read = {field.name: types[field.type] for field in fields(kind)}
    return [kind(**{name: value(row[name]) for name, value in read.items()}) for row in csv.DictReader(lines)]


@contextmanager
def progress(title: str, jobs: int) -> Iterator[Callable[[str], None]]:
    """A progress bar over the jobs, told of each as it begins; on rank 0 and a terminal only."""
    console = Console(stderr=True)
    if MPI.COMM_WORLD.rank != 0 or not console.is_terminal:
        yield lambda name: None
        return
    columns = (TextColumn(title), BarColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
    with Progress(*columns, console=console) as bar:
        task = bar.add_task("", total=jobs, completed=-1)
        yield lambda name: bar.update(task, advance=1, description=name)
        bar.update(task, completed=jobs, description="done")
