"""What the benchmarks share: a progress bar, and tables on the terminal, as CSV and as Markdown."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from mpi4py import MPI
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from growthx import report

RESULTS = Path(__file__).parent / "results"


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


def write_csv(path: Path, header: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Write numbers in full."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        writer.writerows(rows)


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
