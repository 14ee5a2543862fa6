"""Where the time of a run goes: the femur to t = 160 and the plate, with Q1P0, Q1 and Q1Q1.

    ./run python benchmarks/profile_runs.py --n 128

Every instant of solving is charged to one part, the innermost that is going on: clocks around the discretisation's
methods and DOLFINx' assembly, put there from outside, and PETSc's own log for what it does within.  Leaves
profile_runs.csv and .md in benchmarks/results, with percentages and counts; the seconds are on the terminal.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import wraps
from typing import Any
from unittest.mock import patch

import dolfinx
import dolfinx.fem.petsc
from mpi4py import MPI
from petsc4py import PETSc
from reporting import RESULTS, Table, progress, write_csv

import growthx as gx
from growthx.newton import Newton

VARIANTS = ("Q1P0", "Q1", "Q1Q1")

DENSITIES, ENERGIES, FORCES = "local densities", "energies that drive them", "balances assembled"
TANGENT, ORDERING, FACTOR = "tangent", "ordering and symbolic factorisation", "numerical factorisation"
TRIANGLES, NEWTON, MARCH = "triangular solves", "Newton's method itself", "predictor and step control"
STEP, ACCOUNTS = "begin and accept steps", "reactions, mass and density range"
PARTS = (DENSITIES, ENERGIES, FORCES, TANGENT, ORDERING, FACTOR, TRIANGLES, NEWTON, MARCH, STEP, ACCOUNTS)

# Methods of a discretisation, and what the time in them is charged to.
METHODS = {
    "out_of_balance": FORCES,
    "update": DENSITIES,
    "begin_step": STEP,
    "accept_step": STEP,
    "reject_step": STEP,
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

Made by `python benchmarks/profile_runs.py`, on one rank: shares of solving, without compilation and set-up, and how
often. An instant counts once, for the innermost part that is going on.

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
    for name, part in METHODS.items():
        setattr(problem, name, clock.around(getattr(problem, name), part))
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

    matrix = clock.around(dolfinx.fem.petsc.assemble_matrix, TANGENT)
    with ExitStack() as clocks:
        clocks.enter_context(patch.object(dolfinx.fem, "assemble_vector", assemble))
        clocks.enter_context(patch.object(dolfinx.fem.petsc, "assemble_matrix", matrix))
        clocks.enter_context(patch.object(Newton, "solve", clock.around(Newton.solve, NEWTON)))
        yield


# -- what is shown -----------------------------------------------------------------------------------------------------


def title(scene: gx.Scene) -> str:
    """The scene and its mesh."""
    return f"The {scene.name} of {scene.mesh.cell_count} cells"


def share_table(name: str, profiles: dict[str, Profile]) -> Table:
    """Percentages and counts of each part, a pair of columns for each variant."""
    rows = []
    for part in PARTS:
        cells = [(f"{p.share(part):.1%}", f"{p.counts.get(part, 0) or '–'}") for p in profiles.values()]
        rows.append([part, *(text for pair in cells for text in pair)])
    for label, number in (("unknowns", "dofs"), ("steps", "steps"), ("Newton iterations", "iterations")):
        rows.append([label, *(text for p in profiles.values() for text in ("", f"{getattr(p, number)}"))])
    rows.append(["set-up, beside solving", *(t for p in profiles.values() for t in (f"{p.setup / p.solving:.1%}", ""))])
    header = ("", *(text for variant in profiles for text in (variant, "times")))
    return Table(name, header, rows)


def seconds_table(name: str, profiles: dict[str, Profile]) -> Table:
    """Seconds, for the terminal."""
    rows = [[part, *(f"{p.seconds.get(part, 0.0):.3f}" for p in profiles.values())] for part in PARTS]
    rows.append(["solving", *(f"{p.solving:.3f}" for p in profiles.values())])
    rows.append(["set-up", *(f"{p.setup:.3f}" for p in profiles.values())])
    return Table(f"{name}: seconds", ("", *profiles), rows)


def write(profiles: dict[str, dict[str, Profile]]) -> None:
    """The numbers and the page."""
    RESULTS.mkdir(exist_ok=True)
    rows = [
        [scene, variant, part, round(found.share(part), 4), found.counts.get(part, 0)]
        for scene, of_scene in profiles.items()
        for variant, found in of_scene.items()
        for part in PARTS
    ]
    write_csv(RESULTS / "profile_runs.csv", ["scene", "variant", "part", "share", "times"], rows)
    page = INTRODUCTION + "\n".join(share_table(name, found).markdown() for name, found in profiles.items())
    (RESULTS / "profile_runs.md").write_text(page, encoding="utf-8")


def main() -> None:
    """Run, print and write."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--n", type=int, default=128, help="cells over the plate's height (128)")
    options = parser.parse_args()
    if MPI.COMM_WORLD.size > 1:
        raise gx.InputError("the clocks know nothing of waiting for other ranks: one rank would be right")
    PETSc.Log.begin()
    scenes = {title(scene): scene for scene in (gx.scenes.femur(), gx.scenes.plate(options.n))}
    profiles: dict[str, dict[str, Profile]] = {}
    with progress("profiles", len(scenes) * len(VARIANTS)) as begin:
        for name, scene in scenes.items():
            for variant in VARIANTS:
                begin(f"{variant}, {name[4:]}")
                profiles.setdefault(name, {})[variant] = profile(scene, gx.variants.named(variant))
    for name, found in profiles.items():
        share_table(name, found).show()
        seconds_table(name, found).show()
    write(profiles)


if __name__ == "__main__":
    raise SystemExit(gx.guarded(main))
