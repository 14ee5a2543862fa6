"""What is survived, and what locks."""

from __future__ import annotations

import math
from collections.abc import Sequence

from benchmarks.shared.reporting import Table
from benchmarks.stability import extremes
from benchmarks.stability.findings.words import finished, least, most, named, number
from benchmarks.stability.study import FINISHED, VARIANTS

SURVIVAL = tuple(name for name in extremes.STUDIES if not name.startswith("locking"))
SHAPES = ("aspect", "degenerate", *(name for name in extremes.STUDIES if name.startswith("shaken")))


def about_extremes(rows: Sequence[extremes.Row]) -> list[str]:
    """What is survived, and what locks."""
    if not rows:
        return []
    tried = [row for row in rows if row.study in SURVIVAL]
    said = [f"**Extremes**: {finished(tried)} marches come to their end."]
    for name in SURVIVAL:
        lost = [row for row in rows if row.study == name and row.ended != FINISHED]
        if lost:
            settings = ", ".join(
                f"{setting:g} ({named(row.variant for row in lost if row.setting == setting)})"
                for setting in sorted({row.setting for row in lost})
            )
            said.append(f"{name}, {extremes.STUDIES[name].setting}: lost at {settings}.")
    survived = [row for row in rows if row.ended == FINISHED]
    said.append(
        f"Largest stretch survived {most([r for r in survived if r.study == 'stretch'], 'measured'):.3g}, smallest J "
        f"{least([r for r in survived if r.study == 'compression'], 'measured'):.2g}. On distorted cells the "
        f"deflection is off that on regular ones by at most {worst_shape(rows):.1%}."
    )
    found = locking(rows, extremes.ELASTIC)
    if found:
        nearly = max(setting for _, setting in found)
        stiff = [f"{name} {value:.0%}" for (name, setting), value in found.items() if setting == nearly]
        said.append(f"**Locking**: at ν = {nearly:g} the elastic deflection is, of the reference, {', '.join(stiff)}.")
    return said


def locking(rows: Sequence[extremes.Row], study: str) -> dict[tuple[str, float], float]:
    """Deflection over that of the reference, by discretisation and Poisson's ratio, where both came to their end."""
    done = [row for row in rows if row.ended == FINISHED]
    reference = {row.setting: row.measured for row in done if row.study == f"{study}, reference"}
    return {
        (row.variant, row.setting): row.measured / reference[row.setting]
        for row in done
        if row.study == study and row.setting in reference
    }


def shape_change(rows: Sequence[extremes.Row], study: str, variant: str) -> float:
    """Largest relative change of the deflection on distorted cells, from those of the study's first setting."""
    these = [row for row in rows if (row.study, row.variant) == (study, variant) and row.ended == FINISHED]
    return max((abs(row.measured / these[0].measured - 1) for row in these), default=math.nan)


def worst_shape(rows: Sequence[extremes.Row]) -> float:
    """Of all discretisations."""
    return max(shape_change(rows, study, variant) for study in SHAPES for variant in VARIANTS)


def worst_settings(rows: Sequence[extremes.Row], study: str, variant: str) -> str:
    """What of a study's settings a discretisation does not survive."""
    lost = [
        f"{row.setting:g}" for row in rows if (row.study, row.variant) == (study, variant) and row.ended != FINISHED
    ]
    return "all" if not lost else "not " + ", ".join(lost)


def survival_table(rows: Sequence[extremes.Row]) -> Table:
    """Which settings each discretisation survives."""
    cells = [
        [
            f"{name}: {study.setting} = {', '.join(f'{setting:g}' for setting in study.settings)}",
            *(worst_settings(rows, name, variant) for variant in VARIANTS),
        ]
        for name, study in extremes.STUDIES.items()
        if name in SURVIVAL
    ]
    notes = (
        "Contrast: the initial density in waves, over so many orders of magnitude, on a plate that is stretched before "
        "it grows; from zero: while it grows. What is ten thousand times as dense as ρ\\* is 10⁸ times as stiff, while "
        "Newton's default tolerance is 10⁻¹⁰ of a force that belongs to ρ\\*: what the looser tolerance survives "
        "beyond the default one was lost to that, and the rest was not.",
    )
    return Table("What is survived", ("", *VARIANTS), cells, notes)


def lost_table(rows: Sequence[extremes.Row]) -> Table:
    """What is not survived, with the reason that the run gives."""
    cells = [
        [f"{row.study}, {row.setting:g}", row.variant, f"{row.time:.3g}", reason(row)]
        for row in rows
        if row.study in SURVIVAL and row.ended != FINISHED
    ]
    notes = (
        "Where a residual stagnates, the body is 10⁸ to 10¹⁶ times as stiff in some cells as in others, which double "
        "precision does not resolve; that there is a solution to less digits the looser tolerance shows.",
        "Where a density is lost at t = 0, from 10⁻⁶ or 10⁻⁸ ρ\\*, there is none: cells without energy lose "
        "c Ψ₀\\* per time, which is more than they have in the shortest step that is tried.",
        "A hundred times the load on the plate: stretches of 2 to 4 and cells that turn over, or a balance that the "
        "body leaves by itself.",
    )
    return Table("What is not survived, and why", ("", "", "t", "reason"), cells, notes)


def reason(row: extremes.Row) -> str:
    """Why a run ended, without when and what was tried."""
    return row.why.partition(": ")[2].partition(", and a time step")[0]


def locking_table(rows: Sequence[extremes.Row]) -> Table:
    """Deflections over that of the reference."""
    cells = []
    for variant in VARIANTS:
        cells.append([variant])
        for study in (extremes.ELASTIC, extremes.GROWN):
            found = locking(rows, study)
            cells[-1] += [number(found.get((variant, ratio), math.nan), 3) for ratio in extremes.RATIOS]
    header = ["", *(f"{word}, ν = {ratio:g}" for word in ("elastic", "grown") for ratio in extremes.RATIOS)]
    notes = (
        f"Deflection of the plate with {extremes.CELLS} cells over its height, over that of Q2 with {extremes.FINE}. "
        "Grown: at t = 2.5. Newton's tolerance is 10⁻⁶ here: with ν = 0.499 on the finer mesh the default one, 10⁻¹⁰, "
        "is below the round-off of the forces.",
    )
    return Table("Locking", header, cells, notes)


def shapes_table(rows: Sequence[extremes.Row]) -> Table:
    """Changes of the deflection."""
    cells = [[variant, *(f"{shape_change(rows, study, variant):.2%}" for study in SHAPES)] for variant in VARIANTS]
    notes = (
        "Largest change of the grown plate's deflection from that on squares: cells up to 1000 times as high as long "
        "at the clamped end; every fourth cell nearly a triangle; nodes moved at random by up to 0.3 of a cell (three "
        "seeds).",
    )
    return Table("Distorted cells", ("", *SHAPES), cells, notes)
