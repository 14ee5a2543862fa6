"""The first study, everything: each discretisation on each mesh by each way through time, and what errors it leaves."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import astuple, dataclass
from pathlib import Path
from statistics import median

import growthx as gx
from benchmarks.accuracy.error_vs_runtime.cases import CLOCK, VARIANTS, WAYS, Plan, Way
from benchmarks.accuracy.error_vs_runtime.references import FAILED, Errors, Reference, Yardstick, difference
from benchmarks.accuracy.error_vs_runtime.runs import in_turn, solve, work
from benchmarks.shared.reporting import progress, read_rows, write_rows

ROWS, REFERENCES = "error_vs_runtime.csv", "error_vs_runtime_references.csv"


@dataclass(frozen=True)
class Row:
    """A run: its mesh, discretisation and way through time, errors, counts, and times over that of the clock's run.

    setting: steps in the ramp, or tolerance.  time, low, high: median, lowest and highest of the rounds.
    setup: likewise, of spaces and forms without their compilation.  Errors are NaN where the run ended early.
    """

    scene: str
    mesh: int
    cells: int
    variant: str
    scheme: str
    setting: float
    dofs: int
    steps: int
    iterations: int
    residuals: int
    factorisations: int
    density: float
    density_at_its_points: float
    displacement: float
    time: float
    low: float
    high: float
    setup: float

    @property
    def key(self) -> tuple[str, int, str, Way]:
        """What was run."""
        return self.scene, self.mesh, self.variant, self.way

    @property
    def way(self) -> Way:
        """The way through time."""
        return Way(self.scheme, self.setting)


@dataclass(frozen=True)
class Check:
    """How far two references of a scene are apart: in density and in displacement, relative, see `difference`."""

    scene: str
    first: str
    second: str
    density: float
    displacement: float


def references(plan: Plan, folder: Path) -> Reference:
    """The first reference of a scene; the check of it against the second is kept unless it is known."""
    first = Reference(plan, plan.first)
    known = read_rows(folder / REFERENCES, Check)
    if not any((check.scene, check.first, check.second) == checked(plan) for check in known):
        apart = difference(first, Reference(plan, plan.second), plan.scene(plan.linear[-1]))
        check = Check(*checked(plan), *(float(f"{each:.3e}") for each in apart))
        write_rows(folder / REFERENCES, [*(check for check in known if check.scene != plan.name), check])
    return first


def checked(plan: Plan) -> tuple[str, str, str]:
    """What a check is of."""
    return plan.name, str(plan.first), str(plan.second)


def measure(
    plan: Plan, reference: Reference, variant: str, mesh: int, ways: Sequence[Way], repeats: int
) -> tuple[list[Row], float]:
    """All ways of a discretisation on a mesh, and the seconds of the clock's run, measured in turn with them."""
    scene, yardstick = plan.scene(mesh), None
    found: dict[Way, tuple[gx.Result, Errors]] = {}

    def look(way: Way | None, result: gx.Result) -> None:
        nonlocal yardstick
        if way is None:
            return
        yardstick = yardstick or Yardstick(reference, result.problem)
        found[way] = result, yardstick.errors(result.problem) if result.converged else FAILED

    runs: dict[Way | None, Callable[[], gx.Result]] = {None: lambda: solve(plan.scene(plan.clock), "Q1P0", CLOCK)}
    runs.update({way: lambda way=way: solve(scene, variant, way) for way in ways})
    seconds = in_turn(runs, repeats, look)
    tick = median(seconds[None])
    rows = [row(plan, mesh, way, *found[way], [each / tick for each in seconds[way]], tick) for way in ways]
    return rows, tick


def row(plan: Plan, mesh: int, way: Way, result: gx.Result, errors: Errors, times: list[float], tick: float) -> Row:
    """A row of the table, with as many digits as mean something."""
    return Row(
        plan.name,
        mesh,
        result.scene.mesh.cell_count,
        result.variant.name,
        way.scheme,
        way.setting,
        result.problem.dofs,
        *astuple(work(result)),
        *(float(f"{error:.3e}") for error in astuple(errors)),
        *(float(f"{time:.3g}") for time in (median(times), min(times), max(times), result.setup_s / tick)),
    )


def error_study(plans: Sequence[Plan], folder: Path, again: bool, repeats: int) -> None:
    """Run what is missing, a discretisation on a mesh at a time."""
    measured = read_rows(folder / ROWS, Row)
    known = [] if again else measured
    others = [each for each in measured if again and each.scene not in {plan.name for plan in plans}]
    done = {each.key for each in known}
    jobs = {
        (plan, variant, mesh): ways
        for plan in plans
        for variant in VARIANTS
        for mesh in plan.meshes(variant)
        if (ways := [way for way in WAYS if (plan.name, mesh, variant, way) not in done])
    }
    rows = [*others, *known]
    of_plan: dict[str, Reference] = {}
    with progress("error and run time", len(jobs)) as begin:
        for (plan, variant, mesh), ways in jobs.items():
            if plan.name not in of_plan:
                begin(f"{plan.name}: references")
                of_plan = {plan.name: references(plan, folder)}
            begin(f"{plan.name}: {variant}, {mesh} {plan.unit}")
            found, tick = measure(plan, of_plan[plan.name], variant, mesh, ways, repeats)
            rows += found
            write_rows(folder / ROWS, rows)
            print(f"{plan.name}, {variant}, mesh {mesh}: 1 is {tick:.3f} s", flush=True)
