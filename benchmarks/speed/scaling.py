"""How time, memory and linear iterations grow with the problem, on one rank and on two.

    python -m benchmarks.speed.scaling [--largest DOFS]

The plate, and a block in space, clamped on one side and pulled and bent at the other, through the first steps of their
ramps.  Each case runs in processes of its own, so that the memory is that of the case alone.  Leaves scaling.csv, .md
and .png in benchmarks/results; what is in the CSV already is not run again.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import subprocess
import time
from collections.abc import Callable
from dataclasses import asdict, astuple, dataclass, fields, replace
from pathlib import Path
from typing import Any

import dolfinx
import numpy as np
from dolfinx.fem import petsc
from mpi4py import MPI
from petsc4py import PETSc

import growthx as gx
from benchmarks.shared import command
from benchmarks.shared.reporting import RESULTS, Table, progress, read_rows, write_csv
from growthx.solvers import linear_solvers
from growthx.solvers.newton import Newton
from growthx.solvers.tangent import assemble_tangent

COMM = MPI.COMM_WORLD
STEPS = 3
FINE = 1e-8  # tolerance at which linear iterations are counted
CSV = RESULTS / "scaling.csv"


@dataclass(frozen=True)
class Case:
    """A scene of a size (cells over its height), a variant, and how many ranks run it."""

    scene: str
    variant: str
    size: int
    ranks: int

    @property
    def dofs(self) -> int:
        """About how many unknowns it has."""
        nodal = 1 if self.variant in ("Q1Q1", "P1P1") else 0
        return (2 + nodal) * 2 * self.size**2 if self.scene == "plate" else (3 + nodal) * (self.size + 1) ** 3


@dataclass(frozen=True)
class Cost:
    """What a case took.

    solver: as in the log.  set_up: seconds to mesh and discretise.  seconds: of the steps.  memory: most bytes at any
    time beyond an imported and warm program, all ranks together.  residuals, tangents: how many.  iterations: of a
    linear solution, on average.  fine_iterations: of one at a fine tolerance.
    """

    dofs: int
    solver: str
    set_up: float
    seconds: float
    memory: int
    residuals: int
    tangents: int
    iterations: float
    fine_iterations: int


def block(size: int, cell: str) -> gx.Scene:
    """[0, 1]³, clamped on the left, pulled and bent on the right."""
    shape = getattr(dolfinx.mesh.CellType, cell)
    domain = dolfinx.mesh.create_unit_cube(COMM, size, size, size, shape)
    sides = {"left": lambda x: np.isclose(x[0], 0.0), "right": lambda x: np.isclose(x[0], 1.0)}
    return gx.Scene(
        name="block",
        mesh=gx.Mesh.with_names(domain, sides),
        material=gx.Material(young=1.0, poisson=0.2, reference_density=1.0),
        growth=gx.EnergyDrivenGrowth(attractor=0.02, rate=10.0),
        supports=(gx.Support("left"),),
        loads=(gx.Traction("right", (0.05, -0.02, 0.01)),),
        program=gx.Program(step=0.1, until=2.5, ramp=0.5),
    )


SCENES: dict[str, Callable[[int], gx.Scene]] = {
    "plate": gx.scenes.plate,
    "block": lambda size: block(size, "hexahedron"),
    "block of tetrahedra": lambda size: block(size, "tetrahedron"),
}
SIZES = {
    ("plate", "Q1P0"): (32, 64, 128, 256, 512),
    ("plate", "Q1"): (32, 64, 128, 256, 512),
    ("plate", "Q1Q1"): (32, 64, 128, 256, 512),
    ("block", "Q1P0"): (12, 25, 36, 50, 69),
    ("block", "Q1"): (12, 25, 36, 50),
    ("block", "Q1Q1"): (11, 22, 33, 45),
    ("block of tetrahedra", "P1P0"): (12, 25, 36, 50, 69),
}
CASES = [
    Case(scene, variant, size, ranks) for ranks in (1, 2) for (scene, variant), sizes in SIZES.items() for size in sizes
]


# -- one case, in processes of its own ---------------------------------------------------------------------------------


def run(case: Case) -> Cost:
    """Run a case on the ranks there are."""
    small = SCENES[case.scene](3)
    advance(small, gx.discretise(small, gx.variants.named(case.variant)))[0].destroy()  # compiles and loads everything
    base = memory("VmRSS")
    start = time.perf_counter()
    scene, variant = SCENES[case.scene](case.size), gx.variants.named(case.variant)
    problem = gx.discretise(scene, variant)
    begun = time.perf_counter()
    newton, residuals, tangents = advance(scene, problem)
    end = time.perf_counter()
    most = COMM.allreduce(memory("VmHWM") - base)
    solver = newton.linear_solver
    cost = Cost(
        problem.dofs,
        solver.description,
        COMM.allreduce(begun - start, MPI.MAX),
        COMM.allreduce(end - begun, MPI.MAX),
        most,
        residuals,
        tangents,
        solver.mean_iterations,
        0,
    )
    newton.destroy()
    return replace(cost, fine_iterations=0 if solver.direct else fine_iterations(problem))


def advance(scene: gx.Scene, problem: Any) -> tuple[Newton, int, int]:
    """Take the first steps; returns the solver and how many residuals and tangents it took."""
    newton, residuals, tangents = Newton(problem.system), 0, 0
    for end in scene.program.times()[:STEPS]:
        problem.system.begin_step(scene.program.step, scene.program.amplitude(end), end)
        report = newton.solve()
        if not report.converged:
            raise SystemExit(f"the step to t = {end:g} failed: {report.reason}")
        problem.system.accept_step()
        residuals += report.residuals
        tangents += report.factorisations
    return newton, residuals, tangents


def memory(what: str) -> int:
    """Bytes this process has (VmRSS) or had at most (VmHWM), as Linux tells."""
    lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    return next(1024 * int(line.split()[1]) for line in lines if line.startswith(what))


def fine_iterations(problem: Any) -> int:
    """Linear iterations for the forces of the load, with the tangent of the last step."""
    matrix, ksp = petsc.create_matrix(problem.system.coupling), PETSc.KSP().create(COMM)
    ksp.setOptionsPrefix("growthx_")
    solver = linear_solvers.set_up(ksp, problem.system, matrix)
    ksp.setFromOptions()
    ksp.setTolerances(rtol=FINE)
    problem.system.out_of_balance()
    assemble_tangent(problem.system, matrix)
    solver.refresh()
    forces, x = matrix.createVecLeft(), matrix.createVecRight()
    forces.array_w[:] = problem.system.loads.nodal_load
    ksp.solve(forces, x)
    return int(ksp.getIterationNumber())


# -- all of them -------------------------------------------------------------------------------------------------------


def start(case: Case, environment: dict[str, str]) -> Cost:
    """Run a case in processes of its own."""
    program = [*command.program("benchmarks.speed.scaling"), "--case", json.dumps(asdict(case))]
    # Alone, too, under mpirun: its processes and bindings are then the same.
    done = subprocess.run(["mpirun", "-n", str(case.ranks), *program], env=environment, capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"{case} failed:\n{done.stdout}{done.stderr}")
    return Cost(**json.loads(done.stdout.splitlines()[-1]))


def known(path: Path = CSV) -> dict[Case, Cost]:
    """What is in the CSV."""
    return dict(zip(read_rows(path, Case), read_rows(path, Cost), strict=True))


def write(costs: dict[Case, Cost]) -> None:
    """Write all of them to the CSV, in the order of CASES."""
    header = [field.name for kind in (Case, Cost) for field in fields(kind)]
    write_csv(CSV, header, [[*astuple(case), *astuple(costs[case])] for case in CASES if case in costs])


def tables(costs: dict[Case, Cost]) -> list[Table]:
    """One for each scene and variant."""
    header = ("dofs", "ranks", "linear solver", "µs / dof / step", "kB / dof", "tangents", "residuals")
    header += ("linear iterations", f"to {FINE:g}", "speed-up")
    found = []
    for scene, variant in SIZES:
        cases = [case for case in CASES if (case.scene, case.variant) == (scene, variant) and case in costs]
        if cases:
            found.append(Table(f"{scene}, {variant}", header, [_row(case, costs) for case in cases]))
    return found


def _row(case: Case, costs: dict[Case, Cost]) -> list[str]:
    cost, alone = costs[case], costs.get(replace(case, ranks=1))
    iterated = not math.isnan(cost.iterations)
    return [
        f"{cost.dofs}",
        f"{case.ranks}",
        cost.solver,
        f"{1e6 * cost.seconds / cost.dofs / STEPS:.1f}",
        f"{cost.memory / cost.dofs / 1e3:.2f}",
        f"{cost.tangents}",
        f"{cost.residuals}",
        f"{cost.iterations:.1f}" if iterated else "",
        f"{cost.fine_iterations}" if iterated else "",
        f"{alone.seconds / cost.seconds:.2f}" if case.ranks > 1 and alone else "",
    ]


def draw(costs: dict[Case, Cost]) -> None:
    """Time and memory over unknowns, on one rank."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(11, 4.5), layout="constrained")
    for scene, variant in SIZES:
        cases = [Case(scene, variant, size, 1) for size in SIZES[scene, variant]]
        lines = [costs[case] for case in cases if case in costs]
        dofs, style = [cost.dofs for cost in lines], "o-" if scene == "plate" else "s--"
        axes[0].loglog(dofs, [cost.seconds / STEPS for cost in lines], style, label=f"{scene}, {variant}")
        axes[1].loglog(dofs, [cost.memory / 1e9 for cost in lines], style)
    for axis, label in zip(axes, ("seconds per step", "GB"), strict=True):
        axis.set(xlabel="unknowns", ylabel=label)
        axis.grid(alpha=0.3)
    axes[0].legend()
    figure.savefig(RESULTS / "scaling.png", dpi=120)


NOTES = f"""\
# How time and memory grow

Made by `python -m benchmarks.speed.scaling`: the first {STEPS} steps of the ramp. Memory is the most that all ranks
together had at any time beyond an imported and warm program; linear iterations are those of a solution within Newton's
method, on average, and of one to {FINE:g}.  The machine is shared, and its speed changed by a half and more while the
cases ran one after another: memory and counts hold, times and speed-ups by the clock within that.

"""


def page(folder: Path = RESULTS) -> str:
    """The page, from the CSV file of a folder."""
    return NOTES + "\n".join(table.markdown() for table in tables(known(folder / CSV.name)))


def main() -> None:
    """Run what is not known yet, print and write."""
    environment = dict(os.environ)  # as it was before MPI: its children must not take themselves for ranks
    parser = command.parser("benchmarks.speed.scaling", __doc__)
    parser.add_argument("--largest", type=int, default=10**9, metavar="DOFS", help="leave larger cases out")
    parser.add_argument("--case", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.case:
        cost = run(Case(**json.loads(arguments.case)))
        if COMM.rank == 0:
            print(json.dumps(asdict(cost)))
        return
    costs = known()
    missing = [case for case in CASES if case not in costs and case.dofs <= arguments.largest]
    with progress("Scaling", len(missing)) as begin:
        for case in missing:
            begin(f"{case.scene}, {case.variant}, {case.size}, {case.ranks} ranks")
            costs[case] = start(case, environment)
            write(costs)
    for table in tables(costs):
        table.show()
    command.write_page(RESULTS, "scaling", page())
    draw(costs)


if __name__ == "__main__":
    raise SystemExit(gx.guarded(main))
