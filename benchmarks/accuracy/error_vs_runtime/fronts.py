"""The Pareto fronts of error and time, the cheapest way to an error, and what follows for the choice."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from statistics import median

from benchmarks.accuracy.error_vs_runtime.cases import VARIANTS, Plan
from benchmarks.accuracy.error_vs_runtime.whole_error import Row
from benchmarks.shared.reporting import Table

QUANTITIES = {
    "density": "density at integration points",
    "density_at_its_points": "density where it is solved for",
    "displacement": "displacement",
}
LEVELS = (0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001, 0.0005, 0.0002, 0.0001)
ALIKE = 1.2  # times the cheapest run's time: hardly more


def front(rows: Iterable[Row], quantity: str) -> list[Row]:
    """The runs that no other beats in both time and error, the fastest first."""
    members: list[Row] = []
    for each in sorted(rows, key=lambda row: (row.time, getattr(row, quantity))):
        if not math.isnan(getattr(each, quantity)) and (
            not members or getattr(each, quantity) < getattr(members[-1], quantity)
        ):
            members.append(each)
    return members


def cheapest(rows: Iterable[Row], quantity: str, level: float) -> dict[str, float]:
    """The least time of each discretisation that reaches an error."""
    found: dict[str, float] = {}
    for each in rows:
        if getattr(each, quantity) <= level:
            found[each.variant] = min(each.time, found.get(each.variant, math.inf))
    return found


def levels(rows: Sequence[Row], quantity: str) -> list[float]:
    """The errors that some discretisation reaches and that the coarsest runs do not all reach."""
    errors = [getattr(row, quantity) for row in rows if not math.isnan(getattr(row, quantity))]
    return [level for level in LEVELS if min(errors) <= level < max(errors)]


def front_table(plan: Plan, rows: Sequence[Row], quantity: str) -> Table:
    """The members of a front."""
    cells = [
        [
            each.variant,
            f"{each.mesh}",
            f"{each.way}",
            f"{getattr(each, quantity):.1e}",
            f"{each.time:.2f} ({each.low:.2f}–{each.high:.2f})",
            f"{each.steps}",
            f"{each.residuals}",
            f"{each.factorisations}",
        ]
        for each in front(rows, quantity)
    ]
    header = (plan.name, plan.unit, "scheme, setting", "error", "time", "steps", "residuals", "factorisations")
    return Table(f"The {plan.name}: front of {QUANTITIES[quantity]}", header, cells)


def level_table(plan: Plan, rows: Sequence[Row], quantity: str) -> Table:
    """Least times for an error, of each discretisation; the cheapest and what costs hardly more are bold."""
    cells = []
    for level in levels(rows, quantity):
        found = cheapest(rows, quantity, level)
        best = min(found.values())
        texts = [_marked(found[name], best) if name in found else "–" for name in VARIANTS]
        cells.append([f"{level:g}", *texts])
    return Table(f"The {plan.name}: least time for an error of {QUANTITIES[quantity]}", ("error", *VARIANTS), cells)


def _marked(time: float, best: float) -> str:
    return f"**{time:.2f}**" if time <= ALIKE * best else f"{time:.2f}"


def advice(rows: Sequence[Row]) -> list[str]:
    """A sentence on each discretisation: where it is the cheapest way to an error, and what it costs elsewhere."""
    return [f"- **{name}** {_sentence(rows, name)}." for name in VARIANTS]


def _sentence(rows: Sequence[Row], name: str) -> str:
    places, elsewhere, missed = [], [], 0
    for quantity, words in QUANTITIES.items():
        for scene in dict.fromkeys(row.scene for row in rows):
            ours = [row for row in rows if row.scene == scene]
            wins = []
            for level in levels(ours, quantity):
                found = cheapest(ours, quantity, level)
                costs = found.get(name, math.inf) / min(found.values())
                if costs <= ALIKE:
                    wins.append(level)
                elif costs < math.inf:
                    elsewhere.append(costs)
                else:
                    missed += 1
            if wins:
                places.append(f"{words} on the {scene} to {_range(wins)}")
    text = f"is the cheapest, or within a fifth of it, for {'; '.join(places)}" if places else "is never the cheapest"
    if elsewhere:
        text += f"; elsewhere it takes {min(elsewhere):.1f} to {max(elsewhere):.1f} times as long"
        text += f" (median {median(elsewhere):.1f})"
    return text + (f"; {missed} of the errors it does not reach with these meshes" if missed else "")


def _range(errors: Sequence[float]) -> str:
    return f"{errors[0]:.2g}" if len(errors) == 1 else f"{errors[0]:.2g} … {errors[-1]:.2g}"
