"""The rows of all scenes as they are kept with the pages: a compressed table for each ten thousand numbers.

Whoever goes on, on another machine, runs only what is not there.  A line of a table has a name and what all rows have
under it, sizes and balances are kept to a digit, and sentences of failures alone: that makes fifteen bytes of a row.
"""

from __future__ import annotations

import csv
import io
import lzma
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import astuple, fields, replace
from math import floor, log10
from typing import TYPE_CHECKING

from benchmarks.robustness.random_scenes.running import FAILURES, Row
from benchmarks.shared.reporting import rows_of

if TYPE_CHECKING:
    from pathlib import Path

FOLDER = "random_scenes"  # beside the pages
BLOCK = 10_000  # numbers in a file
LONGEST = 200  # letters of a sentence


def read(folder: Path) -> list[Row]:
    """All rows that are kept with the pages of a folder, by their numbers."""
    return [row for file in sorted((folder / FOLDER).glob("*.csv.xz")) for row in _block(file)]


def add(folder: Path, rows: Iterable[Row]) -> None:
    """Keep these, too; a row takes the place of an older one of the same number."""
    blocks: dict[int, list[Row]] = defaultdict(list)
    for row in rows:
        blocks[row.seed // BLOCK].append(row)
    (folder / FOLDER).mkdir(parents=True, exist_ok=True)
    for number, new in blocks.items():
        file = folder / FOLDER / f"{number:03d}.csv.xz"
        together = {row.seed: row for row in [*_block(file), *map(shortened, new)]}
        _write(file, [together[seed] for seed in sorted(together)])


def shortened(row: Row) -> Row:
    """As a row is kept."""
    return replace(
        row,
        strain=_down(row.strain),
        quality=_down(row.quality),
        **{name: float(f"{getattr(row, name):.0e}") for name in ("momentum", "balance", "mass")},
        seconds=float(f"{row.seconds:.1e}"),
        sentence=row.sentence[:LONGEST] if row.outcome in FAILURES else "",
    )


def _down(value: float) -> float:
    """To a digit towards zero, so that no power of ten is reached that was not."""
    if value <= 0:
        return value
    unit = 10.0 ** floor(log10(value))
    return float(f"{floor(value / unit) * unit:.0e}")


def _block(file: Path) -> list[Row]:
    if not file.exists():
        return []
    columns = csv.reader(lzma.decompress(file.read_bytes()).decode().splitlines())
    text = io.StringIO()
    csv.writer(text).writerows(zip(*columns, strict=True))
    return rows_of(text.getvalue().splitlines(), Row)


def _write(file: Path, rows: list[Row]) -> None:
    """Whole, or not at all."""
    text = io.StringIO()
    columns = zip([each.name for each in fields(Row)], *map(astuple, rows), strict=True)
    csv.writer(text, lineterminator="\n").writerows(columns)
    aside = file.with_suffix(".unfinished")
    aside.write_bytes(lzma.compress(text.getvalue().encode(), preset=9))
    aside.replace(file)
