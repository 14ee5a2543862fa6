"""Whether there is one equilibrium."""

from __future__ import annotations

import math
from collections.abc import Sequence

from benchmarks.shared.reporting import Table
from benchmarks.stability import uniqueness
from benchmarks.stability.findings.words import finished, least, most, named, number
from benchmarks.stability.study import BODIES, FINISHED, VARIANTS

SAME = 1e-6  # distance below which two equilibria are one
ELSEWHERE = 1e-2  # … and above which two states are not on their way to one


def about_uniqueness(rows: Sequence[uniqueness.Row]) -> list[str]:
    """Whether there is one equilibrium."""
    if not rows:
        return []
    well, ill = ([row for row in rows if row.m == m] for m in uniqueness.EXPONENTS)
    said = [
        f"**One equilibrium for m = 3, n = 2**: {finished(well)} ways to it come to rest; the densities they end with "
        f"are at most {most(well, 'farthest'):.1e} apart "
        + ("(" if most(well, "farthest") < SAME else "(which is not ")
        + f"below {SAME:g}, at any place, over the root mean square)."
    ]
    others = [row for row in well if row.ended != FINISHED]
    if others:
        lost = "; ".join(f"{row.variant} on the {row.body}, '{row.way}' ({row.ended})" for row in others)
        said.append(f"Not at rest: {lost}.")
    low, high = uniqueness.BOUNDS
    for body in BODIES:
        known = [row for row in ill if row.body == body and not math.isnan(row.apart)]
        random = [row for row in known if row.way in uniqueness.RANDOM]
        others = [row for row in known if row not in random and row.way != uniqueness.REFERENCE]
        if not random:
            continue
        same = [row for row in random if row.apart <= ELSEWHERE]
        said.append(
            f"m = 0 on the {body}, between bounds of {low:g} and {high:g} ρ\\*: elsewhere than the first way, by more "
            f"than {ELSEWHERE:.0%} (root mean square), lead {elsewhere(random)} from random densities, by up to "
            f"{most(random, 'apart'):.0%}, and {elsewhere(others)} under other histories of load, by up to "
            f"{most(others, 'apart'):.0%}. {least(known, 'at_bounds'):.0%} to {most(known, 'at_bounds'):.0%} of the "
            "volume is then at a bound."
            + (f" From random densities to where the first led: {named(row.variant for row in same)}." if same else "")
        )
    noise = {
        m: [row for row in these if row.body != "bar" and row.ended == FINISHED]
        for m, these in zip(uniqueness.EXPONENTS, (well, ill), strict=True)
    }
    said.append(
        "The high-frequency part of the checkerboard index of these end states on plate and femur: "
        + ", ".join(
            f"{least(these, 'noise'):.2g} to {most(these, 'noise'):.2g} for m = {m:g}" for m, these in noise.items()
        )
        + f". Those with m = 0 have had {uniqueness.ENOUGH:g} ρ\\*/(cΨ₀\\*) and are not all at rest."
    )
    return said


def elsewhere(rows: Sequence[uniqueness.Row]) -> str:
    """How many of them lead elsewhere."""
    return f"{sum(row.apart > ELSEWHERE for row in rows)} of {len(rows)} ways"


def uniqueness_table(rows: Sequence[uniqueness.Row]) -> Table:
    """By discretisation."""
    cells = []
    for variant in VARIANTS:
        cells.append([variant])
        for m in uniqueness.EXPONENTS:
            for body in BODIES:
                these = [row for row in rows if (row.variant, row.m, row.body) == (variant, m, body)]
                others = [row for row in these if row.way != uniqueness.REFERENCE]
                text = number(most(others, "farthest"))
                lost = sum(row.ended != FINISHED for row in these)
                cells[-1].append(text + (f" ({lost} not at an end)" if lost else ""))
    header = ["", *(f"m = {m:g}, {body}" for m in uniqueness.EXPONENTS for body in BODIES)]
    notes = (
        "Largest distance of a density from that of the first way, a uniform density under a ramp of the load. The "
        f"other ways: densities at random by ±{uniqueness.SCATTER:.0%} (two seeds), the whole load in one step, "
        f"{uniqueness.OVERLOAD:g} times the load and back, and, where there are several loads, one after the other in "
        "both orders.",
        f"With m = 0 densities keep to bounds, marches end after {uniqueness.ENOUGH:g} ρ\\*/(cΨ₀\\*), at rest or not, "
        "and the overload is left out.",
        "The bar is statically determinate: its stress does not follow the density. A density per cell and one row of "
        "cells then have a stable equilibrium for m = 0, too; several densities in a cross-section have not.",
    )
    return Table("Ways to equilibrium", header, cells, notes)
