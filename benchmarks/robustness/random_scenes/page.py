"""The page on random scenes, from the CSV files beside it."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from benchmarks.robustness.random_scenes import running
from benchmarks.robustness.random_scenes.storing import COUNTS, FAILED, NUMBERS, Count, Failure, Number
from benchmarks.shared.reporting import RESULTS, Table, read_rows

if TYPE_CHECKING:
    from pathlib import Path

INTRODUCTION = """\
# Random scenes

Made by `python -m benchmarks.robustness.random_scenes`: {scenes:.0f} scenes, numbers {first:.0f} to {last:.0f}, each
made from its number alone. Bodies of 2 to 60 cells of all four shapes, in space of 2 to 30, graded, shaken and in
every other one with a sliver of a quality down to 1e-5; moduli, reference and initial densities, attractors and rates
over up to four orders of magnitude from cell to cell; nominal strains of the loads from 3e-6 to 3; exponents n from 0.1
to 6, m from 1 to 4, one model in five not well posed somewhere; tractions, forces, body forces; two load cases,
superposed, averaged or with a displacement each; all discretisations, lumped ones too; fixed and adaptive steps of
three schemes; dead zones, bounds, regions that rest, flux with influx and held densities, inertia.

Every scene has to end by itself, with a solution in which both balances hold, or with a reason in a sentence. The
{checked:.0f} scenes that took a step are checked in their last accepted state, also where they ended early after it, by
an assembly in NumPy that shares no code with growthx: shape functions, integration rules, stress and energy from the
paper's formulas, mass sources. Newton's method ends where the norm of the out-of-balance forces is the tolerance, 1e-10
of the loads, or at the round-off of the forces, which it tells; of the check's own forces that norm may be ten times as
much, and thirty times what the last places of unknowns and coordinates make of them. Densities that no two cells share
must balance to 1e-9 of the terms, nodal ones as the forces do. det F and densities must be positive, densities within
their bounds, supports where they should be, and the defects in the run's record small.

Largest and median of what was found, over all that was checked: out-of-balance forces over the sizes of the forces of
cells, {momentum_all:.0e} and {momentum_half:.0e}; over what they may be, {balance_all:.2g} and {balance_half:.0e};
the balance of mass over what it may be off, {mass_all:.2g} and {mass_half:.0e}. A scene that is solved takes
{mean:.2g} s of the processor on the mean, any scene {median:.2g} s in the median, without those of the C compiler.
All {scenes:.0f} took {hours:.2g} hours.

The rows are kept in `random_scenes`, and the same command goes on after them, on any machine.
"""


def page(folder: Path = RESULTS) -> str:
    """The page, from the CSV files of a folder."""
    counts, failures = read_rows(folder / COUNTS, Count), read_rows(folder / FAILED, Failure)
    numbers = {each.name: each.value for each in read_rows(folder / NUMBERS, Number)}
    told = {
        f"{name}_{word}": numbers[f"{name}, {share}"]
        for name in ("momentum", "balance", "mass")
        for word, share in (("all", "1"), ("half", "0.5"))
    }
    introduction = INTRODUCTION.format(
        scenes=numbers["scenes"],
        first=numbers["first"],
        last=numbers["last"],
        checked=numbers["checked"],
        mean=numbers["mean seconds of solved"],
        median=numbers["median seconds"],
        hours=numbers["seconds"] / 3600,
        **told,
    )
    tables = [_kinds(counts), *(_outcomes(title, counts, by) for by, title in TITLES.items()), _failures(failures)]
    return "\n".join([introduction, *(table.markdown() for table in tables)]).rstrip() + "\n"


TITLES = {
    "program": "By the program that ran them: growthx's version, and a digest of its source and of the scenes'",
    "dimension": "In the plane and in space",
    "model": "By whether m > n everywhere",
    "strain": "By the nominal strain of the loads",
    "quality": "By the quality of the poorest cell",
    "recipe": "By what a scene is about",
    "variant": "By discretisation",
}


def _kinds(counts: list[Count]) -> Table:
    """Reasons, by whether the model is well posed."""
    found: dict[tuple[str, str], Counter[str]] = {}
    for each in counts:
        if each.by == "model":
            found.setdefault((each.outcome, each.kind), Counter())[each.what] += each.count
    order = sorted(found.items(), key=lambda item: (item[0][0] != running.SOLVED, item[0][0], -item[1].total()))
    rows = [
        [": ".join(filter(None, key)), str(each["well posed"]), str(each["ill-posed"]), str(each.total())]
        for key, each in order
    ]
    return Table("How they ended", ("", "well posed", "ill-posed", "all"), rows)


def _outcomes(title: str, counts: list[Count], by: str) -> Table:
    """Outcomes of each kind of scenes."""
    found: dict[str, Counter[str]] = {}
    for each in counts:
        if each.by == by:
            outcome = "failed" if each.outcome in running.FAILURES else each.outcome
            found.setdefault(each.what, Counter())[outcome] += each.count
    words = (running.SOLVED, running.STOPPED, running.EARLY, running.REFUSED, "failed")
    rows = [
        [what, str(each.total()), *(str(each[word]) for word in words), f"{each[running.SOLVED] / each.total():.1%}"]
        for what, each in sorted(found.items(), key=lambda item: _place(item[0]))
    ]
    return Table(title, ("", "scenes", *words, "solved, share"), rows)


def _place(what: str) -> tuple[float, str]:
    """Powers of ten by their size, all else by name."""
    head, _, rest = what.partition(",")
    return (float(head), rest) if head.startswith("1e") else (0.0, what)


def _failures(failures: list[Failure]) -> Table:
    """The scenes that failed."""
    rows = [
        [
            str(each.seed),
            f"{each.variant}, {each.shape}",
            each.recipe,
            f"{each.outcome}: {each.kind}",
            each.sentence[:150],
        ]
        for each in failures
    ]
    return Table("Failed: no solution, and no reason with a name", ("number", "of", "about", "how", "said"), rows)
