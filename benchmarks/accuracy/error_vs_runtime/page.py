"""The page, from the CSV files of both studies."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from benchmarks.accuracy.error_vs_runtime.cases import CASES, CLOCK, PLANS, Case, Plan
from benchmarks.accuracy.error_vs_runtime.error_in_time import IN_TIME, STEPPING, Comparison
from benchmarks.accuracy.error_vs_runtime.fronts import QUANTITIES, advice, front_table, level_table
from benchmarks.accuracy.error_vs_runtime.whole_error import REFERENCES, ROWS, Check, Row
from benchmarks.shared.reporting import RESULTS, Table, read_rows

INTRODUCTION = """\
# Error against run time

Made by `python -m benchmarks.accuracy.error_vs_runtime` on one rank. Every discretisation of quadrilaterals runs bar,
plate and femur on several meshes, with fixed steps of implicit Euler and TR-BDF2, so many in the load ramp and on to
the end, and with adaptive steps of some tolerances. The ramp is the same for all.

*Time* is that of solving, without set-up and compilation, over that of a run of the same scene that is measured in turn
with it: implicit Euler with {parts:g} steps in the ramp, {clocks}. It is the median of the rounds, with the
lowest and highest. All times are in `error_vs_runtime.csv`, with what set-up takes, and the counts.

Meshes are numbered by {units}.

*Errors* are those of the final state, relative and in L²:

- of *density at integration points*, as the discretisation knows it: constant in a cell for Q1P0 and Q1sri, which reads
  their error of first order at points that are not the midpoint;
- of *density where it is solved for*: midpoints (Q1P0, Q1sri), integration points or nodes. At the jumps of the bar's
  stimulus nodes have two right densities, so that there this error of the node-based ones means nothing;
- of *displacement* at the integration points.

Densities of the reference are read by the polynomial through the integration points of its cells. A second one of
another kind is this far from it, at the integration points of the finest mesh of Q1: errors much below that are not to
be told apart. (Discretisation, mesh, tolerance of adaptive steps.)

{references}
![Errors over run time](error_vs_runtime.png)
"""
CHOICE = """\
## Which discretisation when

Drawn from the tables below: for each quantity and scene, among errors of 0.1, 0.05, 0.02, 0.01 … that some reach. (The
bar ends at biological equilibrium: its errors are those of space alone, and the fewest steps are the cheapest.)

"""
IN_TIME_ALONE = """\
## Time integration alone

On one mesh and with one discretisation, the error of the final density against that of adaptive steps of tolerance
{tolerance:g}. *Paper*: implicit Euler with the fewest fixed steps in the ramp that reach the error, full Newton from
the last state, direct solver. *Kept factor*: the same steps and the same answers, as growthx solves them by default.
*Adaptive*: the loosest tolerance, of eight per decade from 0.1, that reaches the error. The last columns are the
paper's time over that of the other two, by medians of rounds in turn, with the lowest and highest. At t = 6 the bar is
at biological equilibrium, where no Δt has an error to speak of: what counts is t = 1.5, soon after the ramp.

"""


def reference_table(checks: Sequence[Check]) -> str:
    """The references and how far they are apart, as a list."""
    return "".join(
        f"- {each.scene}: {each.first}; {each.second}; apart by {each.density:.1e} in density and "
        f"{each.displacement:.1e} in displacement\n"
        for each in checks
    )


def stepping_table(results: Sequence[Comparison]) -> Table:
    """All comparisons."""
    rows = [
        [
            each.case,
            each.variant,
            f"{each.wanted:g}",
            f"{each.parts}",
            f"{each.paper_steps} / {each.paper_residuals} / {each.paper_factorisations}",
            f"{each.kept_residuals} / {each.kept_factorisations}",
            f"{each.tolerance:g}",
            f"{each.steps} / {each.residuals} / {each.factorisations}",
            f"{each.kept:.1f}",
            f"**{each.ratio:.1f}** ({each.low:.1f}–{each.high:.1f})",
        ]
        for each in results
    ]
    header = (
        "",
        "",
        "error",
        "paper: steps in the ramp",
        "steps / residuals / factorisations",
        "kept factor: residuals / factorisations",
        "adaptive: tolerance",
        "steps / residuals / factorisations",
        "kept factor ×",
        "adaptive ×",
    )
    return Table("The paper's scheme, and adaptive steps, at equal error", header, rows)


AT = 1e-3  # the error that the targets are for
VERDICT = """\
At an error of 1e-3 the targets come to what follows. Where a residual takes as long as the paper's, factors are so
cheap on that mesh that keeping them saves nothing: only fewer residuals do.
"""


def verdict(results: Sequence[Comparison], cases: Sequence[Case]) -> str:
    """What the targets come to at 1e-3, and where the time goes that is left."""
    targets = {case.name: case.target for case in cases}
    lines = []
    for each in results:
        if each.case not in targets or each.wanted != AT:
            continue
        target, fewer = targets[each.case], each.paper_residuals / each.residuals
        word = "reached" if each.ratio >= target else "missed"
        lines.append(
            f"- {each.case}, {each.variant}: {each.ratio:.1f}, target {target:g} {word}; "
            f"{each.paper_factorisations / max(each.factorisations, 1):.1f} times fewer factorisations, {fewer:.1f} "
            f"times fewer residuals ({each.residuals / each.steps:.0f} a step), and with all that goes with it a "
            f"residual takes {fewer / each.ratio:.2f} of the paper's time"
        )
    return "\n".join([VERDICT, *lines, ""])


def page(folder: Path = RESULTS, plans: Sequence[Plan] = PLANS, cases: Sequence[Case] = CASES) -> str:
    """The page, from the CSV files of a folder."""
    rows, checks, results = (
        read_rows(folder / name, kind) for kind, name in ((Row, ROWS), (Check, REFERENCES), (Comparison, STEPPING))
    )
    clocks = ", ".join(f"Q1P0 on the {plan.name} of mesh {plan.clock}" for plan in plans)
    units = "; ".join(f"{plan.unit} ({plan.name})" for plan in plans)
    words = {"parts": CLOCK.setting, "clocks": clocks, "units": units, "references": reference_table(checks)}
    parts = [INTRODUCTION.format(**words)]
    if rows:
        parts += [CHOICE, "\n".join(advice(rows)), ""]
    if results:
        parts += [IN_TIME_ALONE.format(tolerance=IN_TIME), stepping_table(results).markdown(), verdict(results, cases)]
    for plan in plans:
        ours = [row for row in rows if row.scene == plan.name]
        if ours:
            parts += [level_table(plan, ours, quantity).markdown() for quantity in QUANTITIES]
            parts += [front_table(plan, ours, quantity).markdown() for quantity in QUANTITIES]
    return "\n".join(parts)
