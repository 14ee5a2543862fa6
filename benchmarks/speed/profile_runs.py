"""Where the time of a run goes: the femur to t = 160 and the plate, with Q1P0, Q1 and Q1Q1.

    ./run python -m benchmarks.speed.profile_runs --n 128

Every instant of solving is charged to one part, the innermost that is going on: clocks around the discretisation's
methods, DOLFINx' assembly and our own factors, put there from outside, and PETSc's own log for what it does within.
Leaves profile_runs.csv and .md in benchmarks/results, with percentages and counts; the seconds are on the terminal.
"""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import reduce, wraps
from pathlib import Path
from typing import Any
from unittest.mock import patch

import dolfinx
import dolfinx.fem.petsc
from petsc4py import PETSc

import growthx as gx
from benchmarks.shared import command
from benchmarks.shared.reporting import RESULTS, Table, progress, read_rows, write_rows
from growthx.fem.sums.cell_sums import CellSums
from growthx.fem.sums.node_blocks import NodeBlocks
from growthx.fem.sums.sweeps import VectorSweep
from growthx.solvers.newton import Newton
from growthx.solvers.single_factor import Factor

CSV = RESULTS / "profile_runs.csv"
VARIANTS = ("Q1P0", "Q1", "Q1Q1")

DENSITIES, ENERGIES, FORCES = "local densities", "energies that drive them", "balances assembled"
TANGENT, ORDERING, FACTOR = "tangent", "ordering and symbolic factorisation", "numerical factorisation"
TRIANGLES, NEWTON, MARCH = "triangular solves", "Newton's method itself", "predictor and step control"
STEP, ACCOUNTS = "begin and accept steps", "reactions, mass and density range"
PARTS = (DENSITIES, ENERGIES, FORCES, TANGENT, ORDERING, FACTOR, TRIANGLES, NEWTON, MARCH, STEP, ACCOUNTS)

# Methods, by the part of a discretisation that has them, and what the time in them is charged to.
METHODS = {
    "system.out_of_balance": FORCES,
    "system.densities.update": DENSITIES,
    "system.begin_step": STEP,
    "system.accept_step": STEP,
    "system.reject_step": STEP,
    "reactions": ACCOUNTS,
    "mass_rate": ACCOUNTS,
    "mass": ACCOUNTS,
    "density_range": ACCOUNTS,
}
# Events of PETSc's log in which no other begins and nothing of ours is called.
EVENTS = {
    "MatZeroEntries": TANGENT,
    "MatAssemblyBegin": TANGENT,
    "MatAssemblyEnd": TANGENT,
    "MatGetOrdering": ORDERING,
    "MatLUFactorSym": ORDERING,
    "MatCholFctrSym": ORDERING,
    "MatLUFactorNum": FACTOR,
    "MatCholFctrNum": FACTOR,
    "MatSolve": TRIANGLES,
}
COUNTED = ("MatLUFactorSym", "MatCholFctrSym", "MatLUFactorNum", "MatCholFctrNum", "MatSolve")

INTRODUCTION = """\
# Where the time goes

Made by `python -m benchmarks.speed.profile_runs`, on one rank: shares of solving, without compilation and set-up, and
how often. An instant counts once, for the innermost part that is going on.

- *local densities* and the *energies that drive them*: the balance of mass at the points or in the cells, within each
  residual. Where the density is nodal it is one of the *balances assembled*, and only its sign is looked at here.
- *balances assembled*: the rest of the residual. Its count is that of residuals.
- *tangent*: assembling it, static condensation included.
- *Newton's method itself*: what PETSc's SNES and our part of it do between residuals, tangents and solves – mixing,
  line search, norms, vectors – and all of the linear solver that is neither factor nor triangles.
- *reactions, mass and density range*: what a step reports, once it is accepted.

"""


class Clock:
    """Charges all time to the innermost part that is going on, and counts how often each was begun.

    What PETSc's log says it did in the meantime is taken off that part and charged to the event's own.
    """

    def __init__(self) -> None:
        self.seconds: Counter[str] = Counter()
        self.counts: Counter[str] = Counter()
        self._going_on: list[str] = []
        self._events = {name: PETSc.Log.Event(name) for name in EVENTS}
        self._logged = self._log()
        self._since = time.perf_counter()

    @property
    def part(self) -> str | None:
        """The innermost part that is going on."""
        return self._going_on[-1] if self._going_on else None

    @contextmanager
    def on(self, part: str) -> Iterator[None]:
        """Charge what is done meanwhile to a part."""
        self._charge()
        self._going_on.append(part)
        try:
            yield
        finally:
            self._charge()
            self._going_on.pop()

    def around(self, function: Callable[..., Any], part: str) -> Callable[..., Any]:
        """A function that is charged to a part and counts for it."""

        @wraps(function)
        def clocked(*arguments: Any, **named: Any) -> Any:
            self.counts[part] += 1
            with self.on(part):
                return function(*arguments, **named)

        return clocked

    def _charge(self) -> None:
        now, logged = time.perf_counter(), self._log()
        if self.part is not None:
            rest = now - self._since
            for name, (count, seconds) in logged.items():
                more = seconds - self._logged[name][1]
                self.seconds[EVENTS[name]] += more
                rest -= more
                if name in COUNTED:
                    self.counts[EVENTS[name]] += count - self._logged[name][0]
            self.seconds[self.part] += rest
        self._since, self._logged = now, logged

    def _log(self) -> dict[str, tuple[int, float]]:
        infos = {name: event.getPerfInfo() for name, event in self._events.items()}
        return {name: (info["count"], info["time"]) for name, info in infos.items()}


@dataclass(frozen=True)
class Profile:
    """A run: seconds of set-up, and seconds and counts of the parts of solving."""

    dofs: int
    steps: int
    iterations: int
    setup: float
    seconds: dict[str, float]
    counts: dict[str, int]

    @property
    def solving(self) -> float:
        """Seconds of solving."""
        return sum(self.seconds.values())

    def share(self, part: str) -> float:
        """Of solving."""
        return self.seconds.get(part, 0.0) / self.solving


def profile(scene: gx.Scene, variant: gx.Variant) -> Profile:
    """March a scene to its end, on the clocks."""
    start = time.perf_counter()
    problem = gx.discretise(scene, variant)
    setup = time.perf_counter() - start - problem.compile.seconds
    clock = Clock()
    for path, part in METHODS.items():
        *owners, name = path.split(".")
        owner = reduce(getattr, owners, problem)
        setattr(owner, name, clock.around(getattr(owner, name), part))
    with assembly_on(clock), clock.on(MARCH):
        steps = list(gx.march(scene, variant, problem))
    iterations = sum(step.newton_iterations for step in steps)
    clock.counts[MARCH] = len(steps)
    return Profile(problem.dofs, len(steps), iterations, setup, dict(clock.seconds), dict(clock.counts))


@contextmanager
def assembly_on(clock: Clock) -> Iterator[None]:
    """Clocks around Newton's method, the tangent's assembly, and that of energies where densities are solved for."""
    assemble_vector = dolfinx.fem.assemble_vector
    of_energies = clock.around(assemble_vector, ENERGIES)

    def assemble(*arguments: Any, **named: Any) -> Any:
        return (of_energies if clock.part == DENSITIES else assemble_vector)(*arguments, **named)

    sweep = VectorSweep.__call__
    of_cells = clock.around(sweep, ENERGIES)

    def add(*arguments: Any) -> None:
        (of_cells if clock.part == DENSITIES else sweep)(*arguments)

    matrix = clock.around(dolfinx.fem.petsc.assemble_matrix, TANGENT)
    with ExitStack() as clocks:
        clocks.enter_context(patch.object(dolfinx.fem, "assemble_vector", assemble))
        clocks.enter_context(patch.object(VectorSweep, "__call__", add))
        clocks.enter_context(patch.object(dolfinx.fem.petsc, "assemble_matrix", matrix))
        for owner, name, part in (
            (Newton, "solve", NEWTON),
            (CellSums, "__call__", TANGENT),
            (Factor, "factorise", FACTOR),
            (Factor, "approximate", TRIANGLES),
            (NodeBlocks, "add_up", TANGENT),
        ):
            clocks.enter_context(patch.object(owner, name, clock.around(getattr(owner, name), part)))
        for name in ("of_rows", "of_blocks"):
            analysis = staticmethod(clock.around(getattr(Factor, name), ORDERING))
            clocks.enter_context(patch.object(Factor, name, analysis))
        yield


# -- what is shown -----------------------------------------------------------------------------------------------------


def title(scene: gx.Scene) -> str:
    """The scene and its mesh."""
    return f"The {scene.name} of {scene.mesh.cell_count} cells"


@dataclass(frozen=True)
class Row:
    """A part of a run: its share of solving, NaN where it has none, and how often it was, or how many there are."""

    scene: str
    variant: str
    part: str
    share: float
    times: int


def rows_of(profiles: dict[str, dict[str, Profile]]) -> list[Row]:
    """What is kept of profiles by scene and variant."""
    found = []
    for scene, of_scene in profiles.items():
        for variant, p in of_scene.items():
            found += [Row(scene, variant, part, round(p.share(part), 4), p.counts.get(part, 0)) for part in PARTS]
            counts = ("unknowns", p.dofs), ("steps", p.steps), ("Newton iterations", p.iterations)
            found += [Row(scene, variant, label, math.nan, count) for label, count in counts]
            found.append(Row(scene, variant, "set-up, beside solving", round(p.setup / p.solving, 4), 0))
    return found


def share_table(name: str, rows: list[Row]) -> Table:
    """Percentages and counts of each part of a scene, a pair of columns for each variant."""
    ours = [row for row in rows if row.scene == name]
    variants = list(dict.fromkeys(row.variant for row in ours))
    lines: dict[str, list[str]] = {}
    for row in ours:
        none = "–" if row.part in PARTS else ""
        share = "" if math.isnan(row.share) else f"{row.share:.1%}"
        lines.setdefault(row.part, []).extend((share, f"{row.times or none}"))
    header = ("", *(text for variant in variants for text in (variant, "times")))
    return Table(name, header, [[part, *cells] for part, cells in lines.items()])


def seconds_table(name: str, profiles: dict[str, Profile]) -> Table:
    """Seconds, for the terminal."""
    rows = [[part, *(f"{p.seconds.get(part, 0.0):.3f}" for p in profiles.values())] for part in PARTS]
    rows.append(["solving", *(f"{p.solving:.3f}" for p in profiles.values())])
    rows.append(["set-up", *(f"{p.setup:.3f}" for p in profiles.values())])
    return Table(f"{name}: seconds", ("", *profiles), rows)


def page(folder: Path = RESULTS) -> str:
    """The page, from the CSV file of a folder."""
    rows = read_rows(folder / CSV.name, Row)
    return INTRODUCTION + "\n".join(share_table(name, rows).markdown() for name in dict.fromkeys(r.scene for r in rows))


def main() -> None:
    """Run, print and write."""
    parser = command.parser("benchmarks.speed.profile_runs", __doc__)
    parser.add_argument("--n", type=int, default=128, help="cells over the plate's height (128)")
    options = parser.parse_args()
    command.require_one_rank("would wait for one another, of which the clocks know nothing")
    command.require_counts(n=options.n)
    PETSc.Log.begin()
    scenes = {title(scene): scene for scene in (gx.scenes.femur(), gx.scenes.plate(options.n))}
    profiles: dict[str, dict[str, Profile]] = {}
    with progress("profiles", len(scenes) * len(VARIANTS)) as begin:
        for name, scene in scenes.items():
            for variant in VARIANTS:
                begin(f"{variant}, {name[4:]}")
                profiles.setdefault(name, {})[variant] = profile(scene, gx.variants.named(variant))
    for name, found in profiles.items():
        share_table(name, rows_of(profiles)).show()
        seconds_table(name, found).show()
    write_rows(CSV, rows_of(profiles))
    command.write_page(RESULTS, "profile_runs", page())


if __name__ == "__main__":
    raise SystemExit(gx.guarded(main))
