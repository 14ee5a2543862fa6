"""Which time steps are stable."""

from __future__ import annotations

import math
from collections.abc import Sequence

from benchmarks.shared.reporting import Table
from benchmarks.stability import time_steps
from benchmarks.stability.findings.words import finished, most, named, number
from benchmarks.stability.study import BODIES, FINISHED


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
