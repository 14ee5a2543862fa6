"""How many large steps from rest are solved: by plain Newton steps, with a line search, in parts, and with cut-backs.

    python -m benchmarks.robustness.globalisation

The full load and ten times as much, both ways, in one step of implicit Euler of the scene's own length, of a thousandth
and of a million units of time, in every discretisation.  Leaves globalisation.csv and .md in benchmarks/results.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

import growthx as gx
from benchmarks.shared import command
from benchmarks.shared.loads import times
from benchmarks.shared.reporting import RESULTS, Table, progress, read_rows, write_rows
from growthx.common.arrays import Floats
from growthx.scenes.bar import CONTINUOUS, DISCONTINUOUS
from growthx.solvers.newton import PREFIX, Newton
from growthx.solvers.settings import NewtonSettings
from growthx.stepping.integration import Integrator

SCENES: dict[str, Callable[[str], gx.Scene]] = {
    "bar, discontinuous": lambda shape: gx.scenes.bar(DISCONTINUOUS, 10, shape=shape),
    "bar, continuous": lambda shape: gx.scenes.bar(CONTINUOUS, 10, shape=shape),
    "plate": lambda shape: gx.scenes.plate(8, shape=shape),
    "femur": lambda shape: gx.scenes.femur(shape=shape),
}
SHAPES = ("quadrilateral", "triangle")
CELLS = {"bar, discontinuous": 10, "bar, continuous": 10, "plate": 128, "femur": 658}  # of quadrilaterals
OWN = 0.0  # length of the scene's own step
# Load, as a multiple of the scene's; length of the step.
ATTEMPTS = ((1, OWN), (1, 1e-3), (1, 1e6), (10, OWN), (10, 1e6), (-1, OWN), (-10, OWN), (-10, 1e6))
SAME = 1e-3  # largest difference of density, over the largest density, of one solution

SOLVED, ANOTHER, UNSTABLE, CUT, FAILED = "solved", "another", "unstable", "cut", "failed"


@dataclass(frozen=True)
class Row:
    """How one large step went.

    plain, searched, parted: what came of Newton steps in full, of those with a line search, and of solving in parts
    where that fails; run: of all that with cut-backs.  iterations: of `run`.  reason: why it ended, if it did.
    """

    scene: str
    shape: str
    variant: str
    load: int
    step: float
    plain: str
    searched: str
    parted: str
    run: str
    iterations: int
    reason: str


def large_step(scene: gx.Scene, load: float, length: float) -> gx.Scene:
    """The scene with a multiple of its loads, all at once, and one step to its end."""
    length = length or scene.program.step
    loads = tuple(times(each, load) for each in scene.loads)
    return replace(scene, loads=loads, program=gx.Program(step=length, until=length))


@contextmanager
def plain_steps() -> Iterator[None]:
    """Within, PETSc's Newton methods take every step in full."""
    options, name = PETSc.Options(PREFIX), "snes_linesearch_type"
    options[name] = "basic"
    try:
        yield
    finally:
        options.delValue(name)


def at_once(scene: gx.Scene, variant: gx.Variant, *, full: bool) -> tuple[str, Floats]:
    """What becomes of one Newton iteration from rest, and its densities."""
    problem = gx.discretise(scene, variant)
    newton = Newton(problem.system, NewtonSettings(full=full))
    problem.system.begin_step(scene.program.step, 1.0, scene.program.until)
    report = newton.solve()
    newton.destroy()
    outcome = SOLVED if report.converged else UNSTABLE if "not stable" in report.reason else FAILED
    return outcome, problem.system.densities.iterate().copy()


def in_parts(scene: gx.Scene, variant: gx.Variant) -> tuple[str, Floats]:
    """The same with the parts that growthx resorts to."""
    problem = gx.discretise(scene, variant)
    newton = Newton(problem.system)
    found = Integrator(problem, newton, gx.IMPLICIT_EULER).step(0.0, scene.program.until)
    newton.destroy()
    return SOLVED if found.newton.converged else FAILED, problem.system.densities.iterate().copy()


def whole_run(scene: gx.Scene, variant: gx.Variant) -> tuple[str, int, str]:
    """What becomes of a run, its iterations, and why it ended before its end."""
    try:
        result = gx.solve(scene, variant)
    except gx.RunEndedEarly as ended:
        return FAILED, ended.result.newton_iterations, ended.result.reason
    return CUT if result.steps[0].rejected else SOLVED, result.newton_iterations, ""


def measure(name: str, shape: str, variant: gx.Variant, load: int, length: float) -> Row:
    """All four ways to one solution."""
    scene = large_step(SCENES[name](shape), load, length)
    with plain_steps():
        plain, first = at_once(scene, variant, full=True)
    searched, second = at_once(scene, variant, full=False)
    parted, last = in_parts(scene, variant)
    if parted == SOLVED:
        plain, searched = _compared(plain, first, last), _compared(searched, second, last)
    return Row(name, shape, variant.name, load, scene.program.step, plain, searched, parted, *whole_run(scene, variant))


def _compared(outcome: str, found: Floats, right: Floats) -> str:
    """A solution, or another one than in parts."""
    differs = np.abs(found - right).max() > SAME * np.abs(right).max()
    return ANOTHER if outcome == SOLVED and differs else outcome


def counts(rows: list[Row]) -> Table:
    """How many of the discretisations each way solved for, by scene, load and step."""
    body = []
    for key in dict.fromkeys((row.scene, row.load, row.step) for row in rows):
        these = [row for row in rows if (row.scene, row.load, row.step) == key]
        body.append([f"{key[0]}, load × {key[1]}, Δt = {key[2]:g}", str(len(these)), *_solved(these)])
    body.append(["all", str(len(rows)), *_solved(rows)])
    header = ("", "tried", "plain", "line search", "and in parts", "and cut back", "refused")
    return Table("Large steps that were solved", header, body, NOTES)


def _solved(rows: list[Row]) -> list[str]:
    cells = []
    for way in ("plain", "searched", "parted"):
        outcomes = [getattr(row, way) for row in rows]
        others = outcomes.count(ANOTHER)
        cells.append(f"{outcomes.count(SOLVED)}" + (f" + {others} other" if others else ""))
    runs = [row.run for row in rows]
    return [*cells, str(len(runs) - runs.count(FAILED)), str(runs.count(FAILED))]


def refusals(rows: list[Row]) -> Table:
    """What is refused, and why, in the words of the runs."""
    found: dict[tuple[str, int, float, str], list[str]] = {}
    for row in rows:
        if row.run == FAILED:
            found.setdefault((row.scene, row.load, row.step, _cause(row.reason)), []).append(row.variant)
    body = [
        [f"{scene}, load × {load}, Δt = {step:g}", cause, ", ".join(variants)]
        for (scene, load, step, cause), variants in found.items()
    ]
    return Table("Refused", ("", "because", "of"), body)


def _cause(reason: str) -> str:
    """Of "the run ended at …: CAUSE, and a time step cut …" the cause, without where and in how many directions."""
    cause = reason.split(": ", 1)[1].rsplit(", and a time step", 1)[0]
    return cause.split(": the body")[0].split(" in the cell at")[0].split(" at (")[0]


INTRODUCTION = """\
# Large steps

Made by `python -m benchmarks.robustness.globalisation`: one step of implicit Euler from rest with the whole load at
once, in all discretisations for quadrilaterals and for triangles. Cells of the meshes of quadrilaterals: {cells}.

"""
NOTES = (
    "plain: Newton's method with the tangent of each iteration and full steps. line search: growthx's method, with "
    "shares of steps where they leave det F > 0 and ρ > 0. in parts: what growthx does where that fails or winds too "
    "much, first the load at frozen densities, then time (`growthx/stepping/continuation.py`). cut back: a whole run.",
    "other: a solution whose density differs by more than a thousandth from that in parts. Where a tangent is "
    "symmetric, a balance that is not stable is none.",
    "A negative load presses the bar, which gives way under a hundred-thousandth of it: to refuse is right.",
)


def page(folder: Path = RESULTS) -> str:
    """The page, from the CSV file of a folder."""
    rows = read_rows(folder / "globalisation.csv", Row)
    cells = ", ".join(f"{name} {count}" for name, count in CELLS.items())
    return INTRODUCTION.format(cells=cells) + "\n".join(table.markdown() for table in (counts(rows), refusals(rows)))


def main() -> None:
    """Measure, print and write."""
    command.parser("benchmarks.robustness.globalisation", __doc__).parse_args()
    jobs = [(name, shape, variant) for name in SCENES for shape in SHAPES for variant in gx.variants.suited(shape)]
    rows = []
    with progress("Large steps", len(jobs)) as begin:
        for name, shape, variant in jobs:
            begin(f"{name}, {variant.name}")
            rows += [measure(name, shape, variant, load, length) for load, length in ATTEMPTS]
    for table in (counts(rows), refusals(rows)):
        table.show()
    if MPI.COMM_WORLD.rank == 0:
        write_rows(RESULTS / "globalisation.csv", rows)
        command.write_page(RESULTS, "globalisation", page())


if __name__ == "__main__":
    raise SystemExit(gx.guarded(main))
