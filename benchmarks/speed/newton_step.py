"""What one Newton step costs in each discretisation, and how node-based and point-based compare as the mesh grows.

    python -m benchmarks.speed.newton_step

On the plate, from the end of its load ramp, with a direct solver.  All costs are ratios to Q1 on the same mesh,
measured in turn in the same run, medians of several.  Leaves newton_step.csv and .md in benchmarks/results.
"""

from __future__ import annotations

import csv
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from statistics import median

import numpy as np
from dolfinx.fem import petsc
from mpi4py import MPI

import growthx as gx
from benchmarks.shared import command
from benchmarks.shared.reporting import RESULTS, Table, progress, write_csv
from growthx.solvers.newton import Newton
from growthx.solvers.settings import NewtonSettings
from growthx.solvers.tangent import assemble_tangent

COMM = MPI.COMM_WORLD
CSV = RESULTS / "newton_step.csv"
REPEATS = 7
LINEAR, QUADRATIC = (
    (16, 32, 64, 128),
    (16, 32, 64),
)  # cells over the height; quadratic elements have four times the dofs
SIZE = 64  # at which all eight are compared in detail
PAIRS = (("Q1Q1", "Q1"), ("S2Q1", "S2fri"), ("Q2Q2", "Q2"))  # node-based, and point-based on the same displacement


@dataclass(frozen=True)
class Cost:
    """Seconds of one Newton step: tangent, factorisation, solution and two residuals; and of its assembled parts."""

    dofs: int
    step: float
    residual: float
    tangent: float

    @property
    def solver(self) -> float:
        """Seconds of the linear solver: what assembling leaves."""
        return max(self.step - self.tangent - 2 * self.residual, 0.0)


class Clocked:
    """A plate at the end of its ramp, about to do the Newton step that is clocked."""

    def __init__(self, variant: gx.Variant, size: int) -> None:
        scene = gx.scenes.plate(size)
        self.problem = gx.discretise(scene, variant)
        for step in gx.march(scene, variant, self.problem):
            if step.load == 1.0:
                break
        self.newton = Newton(self.problem.system, NewtonSettings(maximum_iterations=1, full=True))
        self.matrix = petsc.create_matrix(self.problem.system.coupling)
        self.problem.system.begin_step(scene.program.step, 1.0)
        self.step()  # the first one also analyses the matrix

    def step(self) -> None:
        """One Newton step, taken back before."""
        self.problem.system.reject_step()
        self.newton.solve()

    def residual(self) -> None:
        """The out-of-balance forces; the local balances of mass with them."""
        self.problem.system.out_of_balance()

    def tangent(self) -> None:
        """The assembled tangent."""
        assemble_tangent(self.problem.system, self.matrix)

    def close(self) -> None:
        """Free the memory."""
        self.newton.destroy()
        self.matrix.destroy()


def measure(names: list[str], size: int, begin: Callable[[str], None]) -> dict[str, Cost]:
    """The costs of some variants on one mesh, clocked in turn."""
    clocked = {}
    for name in names:
        begin(f"{name} on 2 x {size} x {size} cells")
        clocked[name] = Clocked(gx.variants.named(name), size)
    seconds: dict[tuple[str, str], list[float]] = {}
    for _ in range(REPEATS):
        for name, plate in clocked.items():
            for part in ("step", "residual", "tangent"):
                seconds.setdefault((name, part), []).append(seconds_of(getattr(plate, part)))
    costs = {
        name: Cost(plate.problem.dofs, *(median(seconds[name, part]) for part in ("step", "residual", "tangent")))
        for name, plate in clocked.items()
    }
    for plate in clocked.values():
        plate.close()
    return costs


def seconds_of(action: Callable[[], None]) -> float:
    """Seconds an action takes, on the slowest rank."""
    COMM.barrier()
    start = time.perf_counter()
    action()
    return float(COMM.allreduce(time.perf_counter() - start, MPI.MAX))


def detail_table(costs: dict[str, Cost]) -> Table:
    """All eight on one mesh."""
    one = costs["Q1"].step
    rows = [
        [name, f"{cost.dofs}"]
        + [f"{part / one:.2f}" for part in (cost.residual, cost.tangent, cost.solver, cost.step)]
        + [f"{cost.dofs / costs['Q1'].dofs:.2f}"]
        for name, cost in costs.items()
    ]
    title = f"One Newton step on the plate of 2 x {SIZE} x {SIZE} cells; 1 is the whole step of Q1"
    return Table(title, ("", "dofs", "one residual", "tangent", "linear solver", "whole step", "dofs / Q1"), rows)


def growth_table(costs: dict[int, dict[str, Cost]]) -> Table:
    """Node-based over point-based, as the mesh grows."""
    rows = []
    for nodal, local in PAIRS:
        ratios = [f"{found[nodal].step / found[local].step:.2f}" if nodal in found else "–" for found in costs.values()]
        rows.append([f"{nodal} / {local}", *ratios])
    title = "One Newton step: node-based over point-based with the same displacement"
    return Table(title, ("", *(f"2 x {size} x {size} cells" for size in costs)), rows)


NOTES = """\
# What one Newton step costs

Made by `python -m benchmarks.speed.newton_step`: on one rank, factorised by CHOLMOD where the tangent is symmetric,
else by MUMPS (LU), medians in one run. A step is one tangent, one factorisation and solution and two residuals; the
local balances of mass are part of the residual.

"""


def tables(costs: dict[int, dict[str, Cost]]) -> list[Table]:
    """What the page shows of costs by size and variant, in any unit of time."""
    return [detail_table(costs[SIZE]), growth_table(costs)]


def page(folder: Path = RESULTS) -> str:
    """The page, from the CSV file of a folder, whose unit of time is the whole step of Q1 on the same mesh."""
    costs: dict[int, dict[str, Cost]] = {}
    with (folder / CSV.name).open(newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            cost = Cost(int(row["dofs"]), *(float(row[part]) for part in ("step", "residual", "tangent")))
            costs.setdefault(int(row["N"]), {})[row["variant"]] = cost
    return NOTES + "\n".join(table.markdown() for table in tables(costs))


def main() -> None:
    """Measure, print and write."""
    command.parser("benchmarks.speed.newton_step", __doc__).parse_args()
    eight = [variant.name for variant in gx.variants.suited("quadrilateral")]
    linear = [name for name in eight if gx.variants.named(name).displacement.degree == 1]
    plan = {size: eight if size in QUADRATIC else linear for size in LINEAR}
    with progress("Newton steps", sum(map(len, plan.values()))) as begin:
        costs = {size: measure(names, size, begin) for size, names in plan.items()}
    for table in tables(costs):
        table.show()
    if COMM.rank == 0:
        RESULTS.mkdir(exist_ok=True)
        rows = [
            [size, name, cost.dofs, *np.round(np.array([cost.residual, cost.tangent, cost.step]) / found["Q1"].step, 3)]
            for size, found in costs.items()
            for name, cost in found.items()
        ]
        write_csv(CSV, ["N", "variant", "dofs", "residual", "tangent", "step"], rows)
        command.write_page(RESULTS, "newton_step", page())


if __name__ == "__main__":
    raise SystemExit(gx.guarded(main))
