"""What the rows of the stability benchmark say: sentences with their numbers, and tables."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

import stability_collapse as collapse
import stability_exponents as exponents
import stability_extremes as extremes
import stability_time_steps as time_steps
import stability_uniqueness as uniqueness
import stability_units as units
from reporting import Table
from stability_study import BODIES, CRASHED, EMPTIED, FINISHED, LUMPED, VARIANTS, Part

import growthx as gx

PARTS: tuple[Part, ...] = (
    exponents.PART,
    uniqueness.PART,
    time_steps.PART,
    time_steps.LIMIT,
    extremes.PART,
    units.PART,
    collapse.PART,
)
HEALED = tuple(variant.name for variant in LUMPED)
SAME = 1e-6  # distance below which two equilibria are one
ELSEWHERE = 1e-2  # … and above which two states are not on their way to one
WIDTH = 120  # characters of a line of text


@dataclass(frozen=True)
class Results:
    """All rows that there are."""

    exponents: list[exponents.Row]
    uniqueness: list[uniqueness.Row]
    time_steps: list[time_steps.Row]
    limits: list[time_steps.LimitRow]
    extremes: list[extremes.Row]
    units: list[units.Row]
    collapse: list[collapse.Row]

    @classmethod
    def read(cls, folder: Path) -> Results:
        """From the CSV files."""
        return cls(*(part.rows(folder) for part in PARTS))


def finished(rows: Iterable[Any]) -> str:
    """How many of them came to their end."""
    known = list(rows)
    return f"{sum(row.ended == FINISHED for row in known)} of {len(known)}"


def most(rows: Iterable[Any], name: str) -> float:
    """The largest of a number of the rows that is one."""
    return max((value for row in rows if not math.isnan(value := getattr(row, name))), default=math.nan)


def least(rows: Iterable[Any], name: str) -> float:
    """The smallest."""
    return min((value for row in rows if not math.isnan(value := getattr(row, name))), default=math.nan)


def middle(rows: Iterable[Any], name: str) -> float:
    """The median."""
    known = [value for row in rows if not math.isnan(value := getattr(row, name))]
    return median(known) if known else math.nan


def number(value: float, digits: int = 2) -> str:
    """A number, or a dash where there is none."""
    return "–" if math.isnan(value) else f"{value:.{digits}g}"


def named(names: Iterable[str]) -> str:
    """Names in a row, each once."""
    return ", ".join(dict.fromkeys(names)) or "none"


def is_local(variant: str) -> bool:
    """Whether densities are at points or in cells."""
    return variant in VARIANTS and gx.variants.named(variant).density.local


# -- exponents ---------------------------------------------------------------------------------------------------------

SIDES: dict[str, Callable[[float, float], bool]] = {
    "m > n": lambda m, n: m > n,
    "m = n": lambda m, n: m == n,
    "m < n": lambda m, n: m < n,
}


def fine(rows: Iterable[exponents.Row]) -> list[exponents.Row]:
    """Those on the finer meshes."""
    known = list(rows)
    most_cells = {row.body: max(each.cells for each in known if each.body == row.body) for row in known}
    return [row for row in known if row.cells == most_cells[row.body]]


def about_exponents(rows: Sequence[exponents.Row]) -> list[str]:
    """What the map says."""
    if not rows:
        return []
    plain = [row for row in rows if row.variant in VARIANTS]
    well = [row for row in plain if row.well_posed]
    local, nodal = ([row for row in well if is_local(row.variant) is kind] for kind in (True, False))
    lost = [row for row in well if row.ended != FINISHED]
    said = [
        f"**m > n**: {finished(local)} marches with densities at points or in cells come to their end, and "
        f"{finished(nodal)} with densities at nodes."
    ]
    if lost:
        where = named(f"{row.variant} (m = {row.m:g}, n = {row.n:g}, {row.body})" for row in lost)
        emptied = sum(row.ended == EMPTIED for row in lost)
        said.append(
            f"What is lost: {where}. In {emptied} of these {len(lost)} a nodal density falls to zero. "
            "So m > n does not protect densities at nodes by itself: the balance of mass holds "
            "between shape functions, not at each node."
        )
    healed = [row for row in rows if row.variant in HEALED]
    if healed:
        said.append(
            f"With the balance of mass lumped at the nodes, source included (Remark 4.3), {finished(healed)} of Q1Q1 "
            "and S2Q1 come to their end."
        )
    for side in ("m = n", "m < n"):
        these = [row for row in plain if SIDES[side](row.m, row.n)]
        bent = [row for row in these if row.body != "bar"]
        crashed = sum(row.ended == CRASHED for row in these)
        said.append(
            f"**{side}**: {finished(bent)} on plate and femur, {finished(set_minus(these, bent))} on the bar"
            + (f"; {crashed} ended in {CRASHED} instead of a sentence." if crashed else ".")
        )
    worst = {
        side: most((row for row in fine(plain) if SIDES[side](row.m, row.n) and row.body != "bar"), "noise")
        for side in SIDES
    }
    said.append(
        "The high-frequency part of the checkerboard index is, on the finer meshes of plate and femur, at most "
        + ", ".join(f"{value:.2g} for {side}" for side, value in worst.items())
        + ". Without bounds of density most marches without m > n end before a checkerboard has formed: when the first "
        "density vanishes."
    )
    said.append(
        "Densities on the two meshes differ by (median, largest) "
        + ", ".join(
            f"{middle(these, 'other_mesh'):.1%}, {most(these, 'other_mesh'):.1%} for {side}"
            for side in SIDES
            if (these := [row for row in fine(plain) if SIDES[side](row.m, row.n)])
        )
        + "."
    )
    return said


def set_minus(rows: Sequence[Any], without: Sequence[Any]) -> list[Any]:
    """The rows but for some."""
    return [row for row in rows if row not in without]


def exponents_table(rows: Sequence[exponents.Row]) -> Table:
    """By m and n."""
    cells = []
    for n in exponents.N:
        for m in exponents.M:
            cells.append([f"{m:g}, {n:g}" + ("" if m > n else " (not m > n)")])
            for body in BODIES:
                these = [row for row in rows if (row.body, row.n, row.m) == (body, n, m) and row.variant in VARIANTS]
                ended = [row.time for row in these if row.ended != FINISHED]
                cells[-1] += [
                    finished(these) + (f", from t = {min(ended):.3g}" if ended else ""),
                    number(most(fine(these), "noise")),
                    f"{most(these, 'empty') + 0:.0%}",
                    f"{most(these, 'other_mesh'):.1%}",
                ]
    header = ["m, n"]
    for body in BODIES:
        header += [f"{body}: finished", "noise", "empty", "meshes differ"]
    notes = (
        "Finished, of eight discretisations on two meshes, and the earliest end of the others. The bar's marches are "
        "to end at t = 6, the plate's at 10, the femur's at 160.",
        "Noise: the high-frequency part of the checkerboard index on the finer mesh. The bar's stimulus has jumps, and "
        "with it its density.",
        f"Empty: share of the volume below {exponents.EMPTY:g} ρ\\*. Each number is that of the worst discretisation.",
    )
    return Table("Exponents", header, cells, notes)


def variants_table(rows: Sequence[exponents.Row]) -> Table:
    """By discretisation."""
    cells = []
    for variant in (*VARIANTS, *HEALED):
        cells.append([variant])
        for holds in SIDES.values():
            these = [row for row in rows if row.variant == variant and holds(row.m, row.n)]
            if not these:
                cells[-1] += ["–"] * 4
                continue
            cells[-1] += [
                finished(these),
                number(most(fine(these), "jump")),
                number(most(fine(these), "noise")),
                f"{most(these, 'other_mesh'):.1%}",
            ]
    header = [""]
    for side in SIDES:
        header += [f"{side}: finished", "index", "noise", "meshes differ"]
    notes = ("Index: the whole checkerboard index; it and noise are the largest on the finer meshes.",)
    return Table("Discretisations, over all bodies and exponents", header, cells, notes)


# -- uniqueness --------------------------------------------------------------------------------------------------------


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


# -- time steps --------------------------------------------------------------------------------------------------------


def about_time_steps(rows: Sequence[time_steps.Row], limits: Sequence[time_steps.LimitRow]) -> list[str]:
    """Which steps are stable."""
    said = []
    implicit, explicit = ([row for row in rows if row.scheme == s] for s in (time_steps.IMPLICIT, time_steps.EXPLICIT))
    if implicit:
        monotone = [row for row in implicit if row.worst < 1]
        lost = [row for row in implicit if row.ended != FINISHED]
        said.append(
            f"**Implicit Euler**, Δt from {min(time_steps.STEPS):g} to {max(time_steps.STEPS):g}: {finished(implicit)} "
            f"runs of {time_steps.COUNT} steps under full load come to their end, and the distance from equilibrium "
            f"falls in every step of {len(monotone)} of {len(implicit)}."
            + (
                f" Lost: {named(f'{row.variant} on the {row.body} with Δt = {row.step:g}' for row in lost)}."
                if lost
                else ""
            )
        )
    if explicit:
        bad = [row for row in explicit if row.ended != FINISHED or row.worst >= 1]
        first = {body: min((row.step for row in bad if row.body == body), default=math.nan) for body in BODIES}
        said.append(
            "**Explicit Euler** fails, or moves away from equilibrium, from "
            + ", ".join(f"Δt = {step:g} on the {body}" for body, step in first.items())
            + f"; {finished(explicit)} runs come to their end."
        )
    known = [row for row in limits if not math.isnan(row.found)]
    if known:
        ratios = [row.found / row.linearised for row in known]
        shares = [row.at_stress / row.found for row in known]
        said.append(
            f"Its limit near equilibrium, found by bisection, is {min(ratios):.3f} to {max(ratios):.3f} times 2/|λ| of "
            f"the linearised problem, for {len(known)} of {len(limits)} discretised bodies. What the lowest density by "
            f"itself allows at constant stress, 2ρ/[(m + n) c Ψ₀\\*], is {min(shares):.2f} to {max(shares):.2f} of it: "
            "neighbours share the load."
        )
    return said


def ratio(value: float) -> str:
    """A ratio of distances, one below one always as such."""
    return "< 1" if 0.9995 <= value < 1 else number(value, 3)


def steps_table(rows: Sequence[time_steps.Row]) -> Table:
    """By Δt."""
    cells = []
    for step in time_steps.STEPS:
        cells.append([f"{step:g}"])
        for scheme in (time_steps.IMPLICIT, time_steps.EXPLICIT):
            for body in BODIES:
                these = [row for row in rows if (row.step, row.scheme, row.body) == (step, scheme, body)]
                cells[-1] += [finished(these), ratio(most(these, "worst"))]
    header = ["Δt"]
    for scheme in (time_steps.IMPLICIT, time_steps.EXPLICIT):
        for body in BODIES:
            header += [f"{scheme}, {body}", "worst"]
    notes = (
        "Finished, of eight discretisations, and the largest ratio of the distance from equilibrium after a step to "
        "that before it.",
        "Resorption takes ρ\\*/(cΨ₀\\*) = "
        + ", ".join(f"{body.resorption:g} ({body.name})" for body in BODIES.values())
        + ".",
    )
    return Table("Time steps", header, cells, notes)


def limits_table(rows: Sequence[time_steps.LimitRow]) -> Table:
    """By body and discretisation."""
    cells = [
        [
            f"{row.body}, {row.variant}",
            number(row.at_stress, 3),
            number(row.at_strain, 3),
            number(row.eigenvalue, 4),
            number(row.linearised, 4),
            number(row.found, 4),
            number(row.found / row.linearised, 4),
        ]
        for row in rows
    ]
    header = ("", "constant stress", "constant strain", "λ", "2/\\|λ\\|", "found", "found / linearised")
    notes = (
        "Constant stress and strain: 2ρ/(k c Ψ₀\\*) with k = m + n and m − n, for the lowest density and the highest "
        "attractor by themselves. λ: of ∂R₀/∂ρ with the displacement in equilibrium, by Arnoldi's method.",
        f"Found: by bisection, from random disturbances of {time_steps.DISTURBED:g}, within half a per cent.",
    )
    return Table("The limit of explicit Euler", header, cells, notes)


# -- extremes ----------------------------------------------------------------------------------------------------------


def worst_settings(rows: Sequence[extremes.Row], study: str, variant: str) -> str:
    """What of a study's settings a discretisation does not survive."""
    lost = [
        f"{row.setting:g}" for row in rows if (row.study, row.variant) == (study, variant) and row.ended != FINISHED
    ]
    return "all" if not lost else "not " + ", ".join(lost)


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


# -- units and collapse ------------------------------------------------------------------------------------------------


def about_units(rows: Sequence[units.Row]) -> list[str]:
    """How many digits agree."""
    if not rows:
        return []
    return [
        f"**Units**: in N, mm, MPa, g/cm³, d and in SI the densities agree to {-math.log10(most(rows, 'density')):.0f} "
        f"digits or more, the displacements to {-math.log10(most(rows, 'displacement')):.0f}, with the same steps in "
        f"{sum(row.steps == row.steps_si for row in rows)} of {len(rows)} runs."
    ]


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


# -- the page ----------------------------------------------------------------------------------------------------------

INTRODUCTION = """\
# Numerical stability

Made by `python benchmarks/stability.py` on one rank; the rows are in `stability_*.csv`. The paper's claim is that a
well-posed model, m > n, integrated by implicit steps is stable in every discretisation, and that the instabilities of
the literature come from the continuous model. Bar, plate and femur, of {cells} cells and, where meshes are
compared, with every cell in four; all discretisations of quadrilaterals. No density is bounded, averaged or smoothed
unless said so.

![The map](stability.png)

Above: high-frequency part of the checkerboard index over exponents and discretisations; a cross is a march that did not
come to its end, the frame is m > n. Middle: densities. Below: steps, the explicit limit, locking.

*Checkerboard index*: mean jump of density between neighbours over the mean of the two. Its *high-frequency part*, the
noise, is what a linear function of position around each neighbour does not explain. Densities at points enter as means
of their cell; patterns inside cells are not seen.

## What the numbers say

"""


def write(results: Results, path: Path) -> None:
    """The page, from what is known."""
    sentences = [
        *about_exponents(results.exponents),
        *about_uniqueness(results.uniqueness),
        *about_time_steps(results.time_steps, results.limits),
        *about_extremes(results.extremes),
        *about_units(results.units),
        *about_collapse(results.collapse),
    ]
    tables = [
        (results.exponents, exponents_table),
        (results.exponents, variants_table),
        (results.uniqueness, uniqueness_table),
        (results.time_steps, steps_table),
        (results.limits, limits_table),
        (results.extremes, survival_table),
        (results.extremes, locking_table),
        (results.extremes, shapes_table),
        (results.collapse, collapse_table),
    ]
    made = [table(rows).markdown() for rows, table in tables if rows]
    *first, last = (body.scene(1).mesh.cell_count for body in BODIES.values())
    introduction = INTRODUCTION.format(cells=f"{', '.join(map(str, first))} and {last}")
    text = introduction + "\n".join(map(_item, sentences)) + "\n\n" + "\n".join(made)
    path.write_text(text, encoding="utf-8")


def _item(sentence: str) -> str:
    """An entry of a list, in lines."""
    return textwrap.fill(f"- {sentence}", WIDTH, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False)
