"""What the paper argues against, beside what it proposes: densities updated after equilibrium, averaged and smoothed,
and densities in balance together with the deformation, for a well-posed law (m > n) and an ill-posed one.

    python demos/stability.py

Leaves tables on the terminal and, in results/stability (or the next free name), a picture for each law and the numbers
of all runs as CSV.
"""

import csv
import logging
from dataclasses import replace

import growthx as gx
from growthx.baselines.averaging import NonLocal, Smoothed
from growthx.baselines.staggered import FLOOR, frozen, update
from growthx.post.checkerboards import checkerboard_index

CELLS = 12  # over the height of the plate
LAWS = {"well-posed": (3.0, 20.0), "ill-posed": (0.0, 8.0)}  # m and the end time; n = 2
DENSEST = 2.5  # a bound of the law
BELOW, ABOVE = 0.25, 2.0  # time steps on either side of what an explicit update is stable for
HEADER = ("", "Δt", "until", "density from", "to", "mass", "checkerboard", "at the floor", "above ρ*")


def plate(m, until, step):
    """The benchmark plate at small strains, under a tenth of its load: hollow, it would otherwise fold up."""
    benchmark = gx.scenes.plate(CELLS)
    return replace(
        benchmark,
        growth=gx.EnergyDrivenGrowth(attractor=2e-4, rate=1e3, exponent=m, bounds=(None, DENSEST)),
        loads=(gx.Traction("right", (0.0, -0.002)),),
        program=gx.Program(step=step, until=until, ramp=2 * BELOW),
    )


def together(scene, variant):
    """growthx: both balances at the end of the time step.  Returns the time reached and the discretised scene."""
    try:
        result = gx.solve(scene, variant)
    except gx.RunEndedEarly as ended:
        result = ended.result
    return result.time, result.problem


def afterwards(scene, variant, **averages):
    """A baseline: equilibrium, then the density.  Returns the same."""
    problem, time = frozen(scene, variant), 0.0
    try:
        for step in update(scene, variant, problem, **averages):
            time = step.time
    except gx.EndedEarly:
        pass
    return time, problem


def runs(m, until):
    """(label, Δt, time reached, discretised scene) of all runs with an exponent m."""
    short, long = plate(m, until, BELOW), plate(m, until, ABOVE)
    of_source, of_density = {"source_average": NonLocal(1.5 / CELLS)}, {"density_average": Smoothed()}
    for variant in (gx.Q1P0, gx.Q1, gx.Q1Q1):
        yield f"{variant.name} together", ABOVE, *together(long, variant)
        yield f"{variant.name} after", BELOW, *afterwards(short, variant)
        yield f"{variant.name} after", ABOVE, *afterwards(long, variant)
    yield "Q1P0 after, non-local", BELOW, *afterwards(short, gx.Q1P0, **of_source)
    yield "Q1P0 after, non-local", ABOVE, *afterwards(long, gx.Q1P0, **of_source)
    yield "Q1P0 after, smoothed", BELOW, *afterwards(short, gx.Q1P0, **of_density)


def share(problem, marks):
    """Share of the growing volume whose densities are marked."""
    dofs, volumes = problem.growing_dofs, problem.volumes
    marked = problem.comm.allreduce(float(volumes[dofs] @ marks(problem.density.x.array[dofs])))
    return marked / problem.comm.allreduce(float(volumes.sum()))


def numbers(label, step, time, problem):
    """A row of the table."""
    low, high = problem.density_range()
    return (
        label,
        f"{step:g}",
        f"{time:.4g}",
        f"{low:.3f}",
        f"{high:.3f}",
        f"{problem.mass():.4f}",
        f"{checkerboard_index(problem):.3f}",
        f"{share(problem, lambda rho: rho <= FLOOR):.0%}",
        f"{share(problem, lambda rho: rho > 1.0):.0%}",
    )


def main():
    logging.getLogger("growthx").setLevel(logging.ERROR)  # that m = 0 is ill-posed is what is shown here
    folder, rows = None, []
    for name, (m, until) in LAWS.items():
        made = list(runs(m, until))
        comm = made[0][-1].comm
        folder = folder or gx.results.free_folder("results/stability", comm)
        table = [numbers(*run) for run in made]
        gx.report.table(f"{name}: n = 2, m = {m:g}, until t = {until:g}", HEADER, table, comm)
        panels = {f"{label}, Δt = {step:g}, t = {time:.3g}": problem for label, step, time, problem in made}
        gx.plots.densities(panels, folder / f"{name}.png", columns=3, magnification=0.0)
        rows += [(m, *row) for row in table]
    if comm.rank == 0:
        with (folder / "runs.csv").open("x", newline="") as file:
            csv.writer(file).writerows([("m", "run", *HEADER[1:]), *rows])
        print(f"{WHAT_TO_SEE}\nPictures and numbers are in {folder}.")


WHAT_TO_SEE = """\
m = 3: updated after equilibrium, densities are right below the limit of the time step and noise above it, where those
in balance together with the deformation still hold.  Non-local averaging makes waves of the noise; smoothing takes off
the peaks of a solution in which nothing was wrong.
m = 0: together, the run ends by itself when a density reaches zero.  Afterwards, a floor hides that end, and what grows
depends on where the densities live.  Averages blur the checkerboard and not its cause: density still runs to the
floor."""

if __name__ == "__main__":
    raise SystemExit(gx.guarded(main))
