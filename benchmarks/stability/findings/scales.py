"""Whether units, vanishing densities and small strains change anything."""

from __future__ import annotations

import math
from collections.abc import Sequence

from benchmarks.shared.reporting import Table
from benchmarks.stability import collapse, strains, units
from benchmarks.stability.findings.words import finished, least, most, number
from benchmarks.stability.study import BODIES

# -- units -------------------------------------------------------------------------------------------------------------


def about_units(rows: Sequence[units.Row]) -> list[str]:
    """How many digits agree."""
    if not rows:
        return []
    return [
        f"**Units**: in N, mm, MPa, g/cm³, d and in SI the densities agree to {-math.log10(most(rows, 'density')):.0f} "
        f"digits or more, the displacements to {-math.log10(most(rows, 'displacement')):.0f}, with the same steps in "
        f"{sum(row.steps == row.steps_si for row in rows)} of {len(rows)} runs."
    ]


# -- Remark 6.1 --------------------------------------------------------------------------------------------------------


def about_collapse(rows: Sequence[collapse.Row]) -> list[str]:
    """How Remark 6.1 comes out."""
    if not rows:
        return []
    kept = sum(row.kept == row.time for row in rows)
    return [
        f"**Remark 6.1**: the femur with m = 0 ends by itself for all {len(rows)} discretisations, between "
        f"t = {least(rows, 'time'):.4g} and {most(rows, 'time'):.4g} (ρ\\*/(cΨ₀\\*) = {BODIES['femur'].resorption:g}), "
        f"with a sentence, exit status {rows[0].status}, and the last good state on disk in {kept}. That is when the "
        f"first densities vanish: {least(rows, 'empty'):.0%} to {most(rows, 'empty'):.0%} of the volume is then below "
        f"{collapse.EMPTY:g} ρ\\*, {least(rows, 'dense'):.0%} to {most(rows, 'dense'):.0%} above {collapse.DENSE:g} "
        "ρ\\*. The field on its way to 0 and 1 is still grey in between."
    ]


def collapse_table(rows: Sequence[collapse.Row]) -> Table:
    """By discretisation."""
    cells = [
        [
            row.variant,
            f"{row.time:.4g}",
            f"{row.kept:.4g}",
            f"{row.lowest:.1e}",
            f"{row.highest:.3g}",
            f"{row.empty:.1%}",
            f"{row.dense:.1%}",
            number(row.jump),
            number(row.noise),
            row.why.partition(": ")[2].partition(", and")[0],
        ]
        for row in rows
    ]
    header = ("", "end", "on disk", "lowest", "highest", "empty", "dense", "index", "noise", "why")
    return Table("Remark 6.1: the femur with m = 0", header, cells)


# -- small strains -----------------------------------------------------------------------------------------------------


def about_strains(rows: Sequence[strains.Row]) -> list[str]:
    """What small strains change."""
    if not rows:
        return []
    found = strains.ladders(rows).values()
    more = max(row.iterations / these[0].iterations for these in found for row in these)
    small = [[row for row in these if row.strain < 2e-4] for these in found]
    apart = max(abs(row.greatest / these[-1].greatest - 1) for these in small for row in these)
    floored = [row for row in rows if row.round_off]
    return [
        f"**Small strains**: {finished(rows)} marches come to their end, from strains of {most(rows, 'strain'):.1g} at "
        f"the set point to {least(rows, 'strain'):.0e}; those of bone are 1e-4 to 3e-3. They take at most {more:.2f} "
        "times the iterations of the largest strain, and below 2e-4 the largest density changes by at most "
        f"{apart:.1%}: what is left is geometry. The residual's round-off ended a step in {len(floored)} of them"
        + (f", at {most(floored, 'round_off'):.0e} of the loads at most" if floored else "")
        + f"; masses and forces balance to {most(rows, 'defect'):.0e}. Formed from F, as the paper writes it, the "
        "energy has no digit left at a strain of 1e-8, and marches ended early below 3e-4."
    ]


def strains_table(rows: Sequence[strains.Row]) -> Table:
    """Iterations and largest densities of each ladder, from its largest strain to its smallest."""
    cells = [
        [
            f"{body}, {shape}s".replace("hexahedrons", "hexahedra").replace("tetrahedrons", "tetrahedra"),
            variant,
            f"{these[0].strain:.0e} … {these[-1].strain:.0e}",
            " ".join(str(row.iterations) for row in these),
            " ".join(f"{row.greatest:.4f}" for row in these),
        ]
        for (body, shape, variant), these in strains.ladders(rows).items()
    ]
    header = ("", "", "strains", "iterations", "largest density")
    return Table("Small strains: each row is one scene at smaller and smaller strains", header, cells)
