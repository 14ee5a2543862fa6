"""The page on Remark 6.1, from its CSV files, and its pictures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING

from benchmarks.shared.pictures import COLOURS, blank
from benchmarks.shared.reporting import RESULTS, Table, item, read_rows
from benchmarks.stability.study import FINISHED
from benchmarks.stability.zero_one.runs import BOUNDS, ILL, PART, STEP, UNTIL, VARIANTS, WELL, Moment, Row
from growthx import plots

if TYPE_CHECKING:
    from growthx.discretisation.discretisation import Discretisation

RESORPTION = 1.2 / 0.01  # ρ*/(c Ψ₀*): how long a cell without energy lasts


def history_file(folder: Path) -> Path:
    """Where the shares in time are."""
    return folder / "zero_one_history.csv"


def _chosen(rows: Sequence[Row], m: float, bounded: int) -> list[Row]:
    return [row for row in rows if (row.m, row.bounded) == (m, bounded)]


def _of(rows: Sequence[Row], variant: str, refine: int = 1, step: float = STEP) -> Row:
    return next(row for row in rows if (row.variant, row.refine, row.step) == (variant, refine, step))


def ends_table(rows: list[Row]) -> Table:
    """All three models on the 658 cells in steps of 4."""
    lines = []
    for variant in VARIANTS:
        for m, bounded, model in ((ILL, 0, "m = 0"), (ILL, 1, "m = 0, bounds"), (WELL, 1, "m = 3, bounds")):
            row = _of(_chosen(rows, m, bounded), variant)
            lines.append([f"{variant}, {model}", f"{row.time:.4g}", f"{row.low:.1%}", f"{row.high:.1%}"])
            lines[-1] += [f"{row.lowest:.2g}", f"{row.highest:.2f}", f"{row.jump:.2f}", f"{row.noise:.2f}"]
    low, high = BOUNDS
    return Table(
        f"At the end, t = {UNTIL:g} or earlier",
        ("", "t", f"≤ {low:g}", f"≥ {high:g}", "lowest", "highest", "checkerboard index", "noise"),
        lines,
        [
            f"≤ {low:g}, ≥ {high:g}: shares of the volume with such a density (g/cm³), the bounds where there are any.",
            "Checkerboard index: mean jump of density between neighbours over the mean of the two; noise: its part "
            "that a linear function around each neighbour does not explain.",
        ],
    )


def dependence_table(rows: list[Row]) -> Table:
    """What mesh and time step change."""
    lines = []
    for variant in VARIANTS:
        for m in (ILL, WELL):
            these = [row for row in _chosen(rows, m, 1) if row.variant == variant]
            ways = [*((refine, STEP) for refine in (2, 3)), *((1, step) for step in (1.0, 2.0, 8.0))]
            apart = [_of(these, variant, *way).apart for way in ways]
            lines.append([f"{variant}, m = {m:g}", *("–" if isnan(each) else f"{each:.1%}" for each in apart)])
    return Table(
        "How the densities at the end depend on mesh and time step, between bounds",
        ("", "2632 cells", "5922 cells", "Δt = 1", "Δt = 2", "Δt = 8"),
        lines,
        [
            "Distance of the mean densities of the 658 cells from those of the run on them with Δt = 4: root mean "
            "square over the volume, relative."
        ],
    )


def ends_of_unbounded(rows: list[Row]) -> Table:
    """When the runs without bounds end."""
    lines = []
    for variant in VARIANTS:
        these = [row for row in _chosen(rows, ILL, 0) if row.variant == variant]
        ways = [(1, STEP), (2, STEP), (3, STEP), (1, 1.0), (1, 2.0), (1, 8.0)]
        lines.append([variant, *(f"{_of(these, variant, *way).time:.4g}" for way in ways)])
    return Table(
        "When the runs without bounds end",
        ("", "658 cells, Δt = 4", "2632 cells", "5922 cells", "Δt = 1", "Δt = 2", "Δt = 8"),
        lines,
    )


INTRODUCTION = """\
# Remark 6.1: the femur with m = 0

Made by `python -m benchmarks.stability.zero_one`; the rows are in `stability_zero_one.csv` and `zero_one_history.csv`.
The paper: with n = 2 and m = 0 the femur goes to a field of zeros and ones with a tendency to checkerboards; its run
stopped after half of the time by loss of convergence, and Fig. 12 shows the last state.

![Shares in time](zero_one.png)

"""


def findings(rows: list[Row]) -> list[str]:
    """What the numbers say."""
    bounded, free, well = (_chosen(rows, *model) for model in ((ILL, 1), (ILL, 0), (WELL, 1)))
    base, low, high = _of(bounded, "Q1P0"), *BOUNDS
    local = [row.time for row in free if row.variant != "Q1Q1"]
    nodal = [row.time for row in free if row.variant == "Q1Q1"]
    grey = [1 - row.low - row.high for row in free if (row.refine, row.step) == (1, STEP)]
    extremes = [row.low + row.high for row in bounded]
    lost = [row for row in bounded if row.ended != FINISHED]
    others = "; ".join(
        f"{row.variant} with Δt = {row.step:g} ends at t = {row.time:.4g}, since "
        + row.why.partition(": ")[2].partition(", and a time step")[0]
        for row in lost
    )
    meshes = [[row.apart for row in these if row.refine > 1] for these in (bounded, well)]
    steps = [[row.apart for row in these if row.refine == 1 and row.step != STEP] for these in (bounded, well)]
    return [
        f"**Without bounds** the runs end with: {', '.join(sorted({row.ended for row in free}))}. With densities per "
        f"cell "
        f"or at points that is at t = {min(local):.4g} to {max(local):.4g} on all meshes and for all Δt. It is the "
        f"model "
        "that ends there, neither the step control nor Newton's method: for m = 0 the source of a cell without "
        "energy is "
        f"−c Ψ₀\\*, whatever its density, which uses up ρ\\* in ρ\\*/(c Ψ₀\\*) = {RESORPTION:g}, and the first cell "
        "without a positive density is such a one. Nodal densities (Q1Q1) are lost earlier, at "
        f"t = {min(nodal):.4g} to {max(nodal):.4g}, depending on mesh and Δt: there it is the overshoot beside a steep "
        f"slope. {min(grey):.0%} to {max(grey):.0%} of the volume is then still between {low:g} and {high:g} g/cm³: "
        f"grey, "
        "not yet the paper's zeros and ones.",
        f"**Between bounds** of {low:g} and {high:g} g/cm³ (`growthx femur --m 0 --bounds {low:g} {high:g} --until "
        f"{UNTIL:g}`) {len(bounded) - len(lost)} of {len(bounded)} runs come to their end, in the field of the "
        f"remark: with Q1P0 "
        f"{base.low:.0%} of the volume is at the low bound and {base.high:.0%} at the high one, and the checkerboard "
        f"index "
        f"is {base.jump:.2f}, where the well-posed model, m = 3, has {_of(well, 'Q1P0').jump:.2f}. Over all "
        f"discretisations, meshes and steps {min(extremes):.0%} to {max(extremes):.0%} of the volume is at a bound."
        + (f" The others: {others}; with m below n the density that a deformation asks for can jump." if lost else ""),
        "**The answer is the mesh's and the step's**, which is the point of the remark. Between meshes the densities "
        "of "
        f"m = 0 differ by {min(meshes[0]):.0%} to {max(meshes[0]):.0%}, those of m = 3 by {min(meshes[1]):.1%} to "
        f"{max(meshes[1]):.1%}; between time steps by {min(steps[0]):.1%} to {max(steps[0]):.0%}, those of m = 3 by "
        f"{max(steps[1]):.1g} at most.",
        "Q1sri behaves as Q1P0 does: *confirmed*. Zeros, ones and checkerboards: *confirmed*, between bounds. The "
        "end by "
        "itself: *confirmed*, without bounds, but in a field that is still grey. Half of the time: *open*, since the "
        "paper "
        f"does not tell of which; ours end at {min(local) / 160:.0%} of the 160 of the other pictures.",
    ]


MODELS = {  # pictures by what they show: m, and whether there are bounds
    "free": (ILL, 0, "m = 0 without bounds, in its last state"),
    "bounded": (ILL, 1, f"m = 0 between bounds, at t = {UNTIL:g}"),
    "well_posed": (WELL, 1, f"m = 3, at t = {UNTIL:g}"),
}


def page(folder: Path = RESULTS) -> str:
    """The page, from the CSV files of a folder."""
    rows = read_rows(PART.file(folder), Row)
    tables = ends_table(rows), dependence_table(rows), ends_of_unbounded(rows)
    text = INTRODUCTION + "\n".join(map(item, findings(rows))) + "\n"
    pictures = [f"{text}:\n\n![{text}](zero_one_{name}.png)\n" for name, (_, _, text) in MODELS.items()]
    return "\n".join([text, *(table.markdown() for table in tables), "## Densities", "", *pictures])


def draw_history(folder: Path) -> None:
    """The shares in time, a panel for each discretisation."""
    moments = read_rows(history_file(folder), Moment)
    figure = blank(15, 4)
    panels = figure.subplots(1, len(VARIANTS), sharey=True)
    for axes, variant in zip(panels, VARIANTS, strict=True):
        for m, bounded, style, model in (
            (ILL, 1, "-", "m = 0, bounds"),
            (ILL, 0, ":", "m = 0"),
            (WELL, 1, "--", "m = 3, bounds"),
        ):
            these = [each for each in moments if (each.variant, each.m, each.bounded) == (variant, m, bounded)]
            times = [each.time for each in these]
            for name, colour in (("low", COLOURS["Q1Q1"]), ("high", COLOURS["Q1P0"])):
                bound = BOUNDS[0] if name == "low" else BOUNDS[1]
                label = f"{'≤' if name == 'low' else '≥'} {bound:g} g/cm³, {model}"
                axes.plot(times, [getattr(each, name) for each in these], style, color=colour, label=label)
        axes.set_title(variant)
        axes.set_xlabel("time")
        axes.grid(color="0.92")
    panels[0].set_ylabel("share of the volume")
    panels[-1].legend(frameon=False, fontsize="small")
    figure.savefig(folder / "zero_one.png", dpi=110)


def draw_femurs(problems: Mapping[str, Mapping[str, Discretisation]], folder: Path) -> None:
    """Densities of all discretisations, a picture for each model, which has its own range of them."""
    for name, these in problems.items():
        plots.densities(these, folder / f"zero_one_{name}.png", title="density (g/cm³)", columns=len(VARIANTS))
