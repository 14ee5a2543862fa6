"""What became slower or larger between two results of one benchmark: CSV files before and after a change.

./run python -m benchmarks.compare OLD NEW [--more-than 1.2]
"""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Iterator
from pathlib import Path

COSTS = ("seconds", "memory", "residual", "tangent", "step", "set_up", "solve_s", "setup_s", "compile_s", "time_s")
WORK = ("iterations", "newton_iterations", "factorisations", "residuals", "tangents", "fine_iterations")


def read(path: Path) -> dict[tuple[str, ...], dict[str, float]]:
    """Costs of each row, by the values of its first columns up to the first cost."""
    with path.open(encoding="utf-8", newline="") as file:
        table = csv.DictReader(file)
        columns = table.fieldnames or []
        costs = [name for name in columns if name in COSTS + WORK]
        if not costs:
            raise SystemExit(f"{path} has no column of costs: one of {', '.join(COSTS + WORK)} is needed")
        keys = columns[: columns.index(costs[0])]
        return {tuple(row[key] for key in keys): {cost: float(row[cost]) for cost in costs} for row in table}


def changes(
    old: dict[tuple[str, ...], dict[str, float]], new: dict[tuple[str, ...], dict[str, float]]
) -> Iterator[tuple[tuple[str, ...], str, float, float, float]]:
    """Row, cost, before, after, and after by before, for all that both have and neither has as zero or NaN."""
    for key in old.keys() & new.keys():
        for cost in old[key].keys() & new[key].keys():
            before, after = old[key][cost], new[key][cost]
            if before > 0 and after > 0:
                yield key, cost, before, after, after / before


def main(arguments: list[str] | None = None) -> int:
    """Print what changed by more than a factor; status 1 if anything became dearer."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.compare", description=__doc__)
    parser.add_argument("old", type=Path)
    parser.add_argument("new", type=Path)
    parser.add_argument("--more-than", type=float, default=1.2, help="the factor that is worth a line (1.2)")
    options = parser.parse_args(arguments)
    old, new = read(options.old), read(options.new)
    if not old.keys() & new.keys():
        raise SystemExit(f"{options.old} and {options.new} have no row in common")
    found = sorted(changes(old, new), key=lambda change: -change[-1])
    for key, cost, before, after, factor in found:
        if max(factor, 1 / factor) > options.more_than:
            print(f"{factor:8.2f} x  {cost:14} {before:.4g} -> {after:.4g}  {', '.join(key)}")
    for name, missing in (("new", old.keys() - new.keys()), ("old", new.keys() - old.keys())):
        if missing:
            print(f"{len(missing)} rows are not in the {name} one")
    dearer = sum(change[-1] > options.more_than for change in found)
    print(f"{dearer} of {len(found)} costs grew by more than {options.more_than:g} times")
    return int(dearer > 0)


if __name__ == "__main__":
    sys.exit(main())
