"""Which reading of a bar is nearest to what the paper prints, of all that there are, and which rule serves it best."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from benchmarks.accuracy.paper_tables.bars import TITLES, Compared, bar_problem
from benchmarks.accuracy.paper_tables.paper import CLOSER, ELEMENTS, VARIANTS, closely, papers, to_print
from benchmarks.accuracy.paper_tables.readings import (
    DENSITY_RULE,
    DISPLACEMENT_RULE,
    density_readings,
    displacement_readings,
)
from benchmarks.shared.reporting import RESULTS, Table, read_rows
from growthx.scenes.bar import PROBLEMS

SAME = 1e-9  # readings as near to each other are one
RULES = {"density": DENSITY_RULE, "displacement": DISPLACEMENT_RULE}
FAR = 1e-3
BEST = 6  # rules that are told of


@dataclass(frozen=True)
class Named:
    """One reading of one bar, by its name."""

    problem: str
    variant: str
    elements: int
    quantity: str
    reading: str
    value: float

    @property
    def paper(self) -> float:
        """What the paper prints."""
        return papers(self.problem, self.variant, self.elements, self.quantity)

    @property
    def to_print(self) -> bool:
        """Whether it is the paper's number, but for one unit of the last digit."""
        return to_print(self.value, self.paper, self.quantity)

    def is_of(self, number: Compared) -> bool:
        """Whether that is what it could have been read as."""
        mine = (self.problem, self.variant, self.elements, self.quantity)
        return mine == (number.problem, number.variant, number.elements, number.quantity)


def readings_file(folder: Path) -> Path:
    """Where all readings are."""
    return folder / "bar_readings.csv"


def all_readings(begin: Callable[[str], None]) -> list[Named]:
    """Of all bars, ours first."""
    found = []
    for name, problem in PROBLEMS.items():
        begin(f"readings, {name}")
        for variant in VARIANTS:
            for elements in ELEMENTS:
                done = bar_problem(problem, elements, variant)
                by_quantity = {
                    "density": density_readings(done, elements),
                    "displacement": displacement_readings(done),
                }
                found += [
                    Named(name, variant.name, elements, quantity, reading, value)
                    for quantity, readings in by_quantity.items()
                    for reading, value in readings.items()
                ]
    return found


def read_readings(folder: Path = RESULTS) -> list[Named]:
    """From their file."""
    return read_rows(readings_file(folder), Named)


def nearest(number: Compared, readings: Sequence[Named]) -> tuple[Named, int]:
    """The reading nearest to the paper's number, the first of those that are one, and how many different ones exist."""
    own = [reading for reading in readings if reading.is_of(number)]
    values = sorted(reading.value for reading in own)
    different = 1 + sum(upper - lower > SAME for lower, upper in pairwise(values))
    least = min(abs(reading.value - number.paper) for reading in own)
    return next(reading for reading in own if abs(reading.value - number.paper) <= least + SAME), different


def left_table(numbers: Sequence[Compared], readings: Sequence[Named]) -> Table:
    """Of the numbers that our rule does not reproduce, the reading that is nearest."""
    left = [number for number in numbers if not number.closely]
    return Table(
        "The numbers that are left, and the reading nearest to each",
        _HEADER,
        [_row(number, readings) for number in left],
        [_found(left, readings), *_short_by_cells(left)],
    )


def close_table(numbers: Sequence[Compared], readings: Sequence[Named]) -> Table:
    """The same of those that agree, but not to the last digit."""
    close = [number for number in numbers if number.closely and not number.to_print]
    rows = [_row(number, readings) for number in close]
    return Table("Those that agree, but not to the last digit", _HEADER, rows, [_found(close, readings)])


_HEADER = ("", "elements", "paper", "ours", "apart", "nearest reading", "its value", "apart", "of")


def _row(number: Compared, readings: Sequence[Named]) -> list[str]:
    best, different = nearest(number, readings)
    digits = 6 if number.quantity == "density" else 5
    apart = "=" if best.to_print else f"{best.value - number.paper:+.1e}"
    return [
        f"{TITLES[number.problem]}, {number.variant}, {number.quantity}",
        f"{number.elements}",
        *(f"{number.paper:.{digits}f}", f"{number.ours:.{digits}f}", f"{number.ours - number.paper:+.1e}"),
        *(best.reading, f"{best.value:.{digits}f}", apart, f"{different}"),
    ]


def _found(numbers: Sequence[Compared], readings: Sequence[Named]) -> str:
    best = [nearest(number, readings)[0] for number in numbers]
    return (
        f"Another reading is the paper's number to the last printed digit (=) in {sum(b.to_print for b in best)} of "
        f"{len(numbers)} cases. *of*: how many different readings there are to choose from."
    )


def _short_by_cells(left: Sequence[Compared]) -> list[str]:
    """How far the end displacements that are far off fall short, in cells."""
    far = [each for each in left if each.quantity == "displacement" and abs(each.ours - each.paper) > FAR]
    if not far:
        return []
    short = [(each.ours - each.paper) * each.elements for each in far]
    names, meshes, problems = (
        ", ".join(dict.fromkeys(map(str, words)))
        for words in zip(*((each.variant, each.elements, TITLES[each.problem].lower()) for each in far), strict=True)
    )
    return [
        f"{len(far)} displacements are off by more than {FAR:g}: those of {names} ({problems}; {meshes} elements). The "
        f"paper's end moves less by {min(short):.2f} to {max(short):.2f} lengths of a cell. Its other elements agree "
        "on the same meshes, and these agree on the others: the steps of its stimulus must have lain otherwise in "
        "these runs, which no reading of ours can tell."
    ]


def rules_table(readings: Sequence[Named]) -> Table:
    """Of all readings of the density, those that are the paper's number most often, each as one rule for all bars."""
    names = dict.fromkeys(reading.reading for reading in readings if reading.quantity == "density")
    counts = {
        name: [
            (found.to_print, closely(found.value, found.paper))
            for found in readings
            if found.quantity == "density" and found.reading == name
        ]
        for name in names
    }
    ranked = sorted(names, key=lambda name: -sum(printed for printed, _ in counts[name]))
    rows = [
        [name, f"{len(counts[name])}", f"{sum(p for p, _ in counts[name])}", f"{sum(c for _, c in counts[name])}"]
        for name in ranked[:BEST]
    ]
    return Table(
        "Which reading of the density is the paper's most often",
        ("taken as the one rule", "bars that have it", "to the last printed digit", CLOSER),
        rows,
        [f"Of {len(names)} readings, each taken for all elements, meshes and both problems."],
    )
