"""The plate of Weinans et al. 1992: columns and checkerboards, by updates after equilibrium and by the implicit solver.

    python -m benchmarks.stability.weinans

Leaves weinans.md, weinans.png and weinans.csv in benchmarks/results.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import growthx as gx
from benchmarks.shared import command
from benchmarks.shared.reporting import RESULTS, Table, item, read_rows, write_rows
from growthx import baselines, plots
from growthx.baselines import checkerboard_index
from growthx.scenes.weinans import AT_BOUND, BOUNDS, column_density, weinans_plate

if TYPE_CHECKING:
    from growthx.discretisation.discretisation import Discretisation

RADIUS = 0.05  # two cells
UNTIL = 100.0
SMOOTH_MEAN = 0.7326

UPDATES: dict[str, tuple[str, dict[str, Any]]] = {
    "update, Q1P0": ("Q1P0", {}),
    "update, Q1, averaged at nodes": ("Q1", {"density_average": baselines.Smoothed()}),
    "update, Q1Q1": ("Q1Q1", {}),
    "update, Q1P0, non-local": ("Q1P0", {"source_average": baselines.NonLocal(RADIUS)}),
}
FROM_SMOOTH = "update, Q1P0, from the columns' solution"
IMPLICIT = {f"implicit, {name}": name for name in ("Q1P0", "Q1", "Q1Q1")}

INTRODUCTION = f"""\
# The plate of Weinans

The field's standard example (H. Weinans, R. Huiskes & H. J. Grootenboer 1992, J. Biomech. 25, 1425): a unit square of
40 × 40 cells, E = 100 ρ², ν = 0.3, plane strain, fixed below and pressed by 10 [1 − x] from above;
R₀ = Ψ₀/ρ − 0.25 between the densities {BOUNDS[0]:g} and {BOUNDS[1]:g}, ρ(0) = 0.8, to t = {UNTIL:g} in steps of 1.
Elasticity is linear, as theirs (`gx.scenes.weinans_plate`).

Columns that each bear the pressure above them alone are in equilibrium at ρ = [1.82 (1 − x)²]^(1/3), whose mean is
{SMOOTH_MEAN}. That is smooth and not stable: with m = 1 below n = 2 a cell that is denser than its neighbours draws
their load and grows on. `growthx weinans` runs it by the implicit solver.

Made by `python -m benchmarks.stability.weinans`.

"""


@dataclass(frozen=True)
class Row:
    """A run at its end.

    low, high: shares of the volume at the bounds.  jump: checkerboard index.  apart: distance from the columns'
    solution, root mean square.  why: what ended it early.
    """

    run: str
    time: float
    mean: float
    low: float
    high: float
    jump: float
    apart: float
    why: str


def _row(run: str, problem: Discretisation, time: float, why: str = "") -> Row:
    dofs = problem.growing_dofs
    density, volumes = problem.density.x.array[dofs], problem.volumes[dofs]
    shares = volumes / volumes.sum()
    low = shares[density <= BOUNDS[0] * (1 + AT_BOUND)].sum()
    high = shares[density >= BOUNDS[1] * (1 - AT_BOUND)].sum()
    apart = density - column_density(problem.density_positions()[dofs, 0])
    jump = float(checkerboard_index(problem))
    return Row(run, time, float(shares @ density), low, high, jump, float(np.sqrt(shares @ apart**2)), why)


def updated(run: str) -> tuple[Row, Discretisation]:
    """A run by updates after equilibrium."""
    variant, averages = UPDATES.get(run, ("Q1P0", {}))
    scene = weinans_plate(until=UNTIL)
    if run == FROM_SMOOTH:
        scene = replace(scene, initial_density=lambda x: np.maximum(column_density(x[0]), BOUNDS[0]))
    problem = baselines.frozen(scene, gx.variants.named(variant))
    for _ in baselines.update(scene, problem.variant, problem, **averages):
        pass
    return _row(run, problem, UNTIL), problem


def marched(run: str) -> tuple[Row, Discretisation]:
    """A run by the implicit solver, to its end or as far as it comes."""
    scene, variant = weinans_plate(until=UNTIL), gx.variants.named(IMPLICIT[run])
    problem, time, why = gx.discretise(scene, variant), 0.0, ""
    try:
        for step in gx.march(scene, variant, problem):
            time = step.time
    except gx.EndedEarly as ended:
        why = str(ended)
    return _row(run, problem, time, why), problem


def page(folder: Path = RESULTS) -> str:
    """The page, from the CSV file of a folder."""
    rows = read_rows(folder / "weinans.csv", Row)
    lines = [
        [
            row.run,
            *(f"{row.time:.4g}", f"{row.mean:.4f}", f"{row.low:.1%}", f"{row.high:.1%}"),
            *(f"{row.jump:.2f}", f"{row.apart:.2f}"),
        ]
        for row in rows
    ]
    table = Table(
        "At the end",
        ("", "t", "mean density", f"at {BOUNDS[0]:g}", f"at {BOUNDS[1]:g}", "checkerboard index", "from the columns"),
        lines,
        [
            "At the bounds: shares of the volume, of node-based densities that of the nodes.",
            "Checkerboard index: mean jump of density between neighbours over the mean of the two.",
            "From the columns: root mean square distance from their smooth solution.",
            f"Non-local: the source is averaged over exp(−distance/{RADIUS:g}).",
        ],
    )
    text = INTRODUCTION + "\n".join(map(item, findings(rows))) + "\n"
    return "\n".join([text, "![Densities at the end](weinans.png)\n", table.markdown()])


def findings(rows: list[Row]) -> list[str]:
    """What the numbers say, as sentences."""
    by = {row.run: row for row in rows}
    bare, smooth = by["update, Q1P0"], by[FROM_SMOOTH]
    early = [f"{row.run.removeprefix('implicit, ')} at t = {row.time:.4g}" for row in rows if row.why]
    ends = "the other implicit runs come to the end" if len(early) < len(IMPLICIT) else "none comes to the end"
    return [
        f"**Zeros and ones.** By the element-based update {bare.low + bare.high:.0%} of the plate is at a bound, with "
        f"the mean density {bare.mean:.4f}: columns, and checkerboards between them (index {bare.jump:.2f}).",
        f"**The smooth solution is left.** Begun at it, mean {SMOOTH_MEAN}, the same update ends at "
        f"{smooth.mean:.4f} with {smooth.low + smooth.high:.0%} at a bound.",
        "**Averages** make fewer of them: at the nodes they leave layers (index "
        f"{by['update, Q1, averaged at nodes'].jump:.2f}), a non-local source columns alone "
        f"({by['update, Q1P0, non-local'].jump:.2f}). Zeros and ones remain.",
        "**The implicit solver says that the model is not well posed** before it begins. "
        + (f"It ends early with {', '.join(early)}, where a density has no continuation; " if early else "")
        + f"the pictures show last states; {ends}.",
    ]


def draw(problems: dict[str, Discretisation], folder: Path) -> None:
    """The densities at the end, on the body at rest: the strains of linear elasticity would fold soft corners."""
    plots.densities(problems, folder / "weinans.png", title="density", magnification=0.0, columns=4)


def main() -> None:
    """Run all, and write the page and the picture."""
    parser = command.parser("benchmarks.stability.weinans", __doc__)
    command.add_out(parser)
    options = parser.parse_args()
    command.require_one_rank("would write the same rows")
    logging.getLogger("growthx").setLevel(logging.ERROR)  # that m ≤ n is ill-posed is what is shown here
    done = {run: updated(run) for run in (*UPDATES, FROM_SMOOTH)} | {run: marched(run) for run in IMPLICIT}
    write_rows(options.out / "weinans.csv", [row for row, _ in done.values()])
    draw({run: problem for run, (_, problem) in done.items()}, options.out)
    command.write_page(options.out, "weinans", page(options.out))


if __name__ == "__main__":
    main()
