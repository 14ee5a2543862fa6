"""Fronts of density in the discontinuous bar with Q1Q1: what a mass flux and a lumped density matrix do to them.

    python demos/fronts.py

Leaves tables of the width of a front, of overshoots and of the size effect on the terminal, and plots of density over
length in results/fronts (or the next free name).
"""

from dataclasses import replace

import numpy as np
from mpi4py import MPI
from scipy.optimize import root

import growthx as gx
from growthx.scenes.bar import DISCONTINUOUS, bar, equilibrium, lower_edge

ELEMENTS = 100
CONDUCTIONS = (1e-5, 1e-4, 1e-3)  # R₀ᶠ, length² per time
LENGTHS = (1.0, 0.5, 0.25)
EARLY = 0.3  # after three of the load's ten steps
FRONT, MIDDLE = (0.35, 0.45), (0.25, 0.75)  # the parts of the length that hold one front, and the inner levels
CLOSE = (0.33, 0.47)  # … and the one that is drawn closely


def scaled(length, conduction=None):
    """The discontinuous bar, its mesh and the levels of its stimulus scaled to a length."""
    scene = bar(DISCONTINUOUS, ELEMENTS)
    scene.mesh.domain.geometry.x[:] *= length
    return replace(
        scene,
        growth=replace(scene.growth, attractor=lambda x: DISCONTINUOUS.attractor(x[0] / length)),
        flux=None if conduction is None else gx.MassFlux(conduction),
    )


def profile(problem, part, length=1.0):
    """Places x and densities on the bar's lower edge, over a part of the length."""
    places = lower_edge(DISCONTINUOUS)
    places = places[(places[:, 0] > part[0]) & (places[:, 0] < part[1])]
    return places[:, 0], problem.sample_density(length * places)


def width(problem, low, high):
    """Width of the front at 0.4: the step between its levels over the steepest slope."""
    x, rho = profile(problem, FRONT)
    return (high - low) / np.abs(np.gradient(rho, x)).max()


def peak(problem, length=1.0):
    """Highest density of the inner levels, where the clamped end is not felt."""
    return profile(problem, MIDDLE, length)[1].max()


def plateau(scene, until):
    """Density of the middle level at a time: uniaxial plane strain by implicit Euler, as if nothing were beside it."""
    (lam, mu), program = scene.material.lame, scene.program
    attractor, traction = DISCONTINUOUS.attractor(np.array([0.5]))[0], DISCONTINUOUS.traction(np.array([0.5]))[0]
    state = np.ones(3)  # the stretches along and across, ρ/ρ*
    for time in program.times()[: round(until / program.step)]:

        def balances(at, old=state[2], time=time):
            a, b, rho = at
            log, weight = np.log(a * b), rho**2
            energy = lam / 2 * log**2 + mu / 2 * (a**2 + b**2 - 2 - 2 * log)
            return (
                weight * (mu * a + (lam * log - mu) / a) - program.amplitude(time) * traction,
                weight * (mu * b + (lam * log - mu) / b),
                rho - old - program.step * (energy / rho - attractor),
            )

        state = root(balances, state, tol=1e-12).x
    return state[2]


def defect(steps):
    """The largest imbalance of mass in a step, as text."""
    return f"{max(step.mass_defect for step in steps):.0e}"


def fronts(folder, comm):
    """Width of a front and overshoot, by conduction."""
    results = {"no flux": gx.solve(scaled(1.0), gx.Q1Q1)}
    for conduction in CONDUCTIONS:
        results[f"conduction {conduction:g}"] = gx.solve(scaled(1.0, conduction), gx.Q1Q1)
    plain = results["no flux"].scene
    exact = replace(plain, growth=bar().growth)
    high, low = (equilibrium(exact, DISCONTINUOUS, x).density for x in (0.45, 0.35))
    gx.report.table(
        f"{plain.name}, {ELEMENTS} elements, t = {plain.program.until:g}",
        ("", "width of the front at 0.4", "overshoot over the highest plateau", "mass defect"),
        [
            (
                label,
                f"{width(result.problem, low, high):.4f}",
                f"{peak(result.problem) - high:+.5f}",
                defect(result.steps),
            )
            for label, result in results.items()
        ],
        comm,
    )
    gx.plots.along_length(
        {label: result.problem for label, result in results.items()},
        folder / "conduction.png",
        lower_edge(DISCONTINUOUS),
        exact={"semi-analytic, no flux": lambda x: equilibrium(exact, DISCONTINUOUS, x).density},
    )
    return results["no flux"]


def size_effect(comm):
    """Peak densities of bars of several lengths, with and without flux."""
    conduction = CONDUCTIONS[-1]
    rows = []
    for length in LENGTHS:
        without, flux = (gx.solve(scaled(length, how), gx.Q1Q1) for how in (None, conduction))
        rows.append(
            (
                f"{length:g}",
                f"{peak(without.problem, length):.6f}",
                f"{peak(flux.problem, length):.6f}",
                defect(without.steps + flux.steps),
            )
        )
    gx.report.table(
        "size effect: peak densities",
        ("length of the bar", "no flux", f"conduction {conduction:g}", "mass defect"),
        rows,
        comm,
    )


def lumping(folder, comm):
    """Overshoots of the middle level early in the transient and at equilibrium, with and without lumping."""
    scene = scaled(1.0)
    kinds = {
        "consistent": gx.Q1Q1,
        "lumped": gx.Q1Q1.lumped(),
        "lumped with its source": gx.Q1Q1.lumped(with_source=True),
    }
    rows, early = [], {}
    levels = [plateau(scene, EARLY), equilibrium(replace(scene, growth=bar().growth), DISCONTINUOUS, 0.45).density]
    until = replace(scene.program, until=EARLY)
    for label, variant in kinds.items():
        start = gx.solve(replace(scene, program=until), variant)
        early[label] = start.problem
        end = gx.homeostasis(scene, variant)
        rows.append(
            (
                label,
                f"{peak(start.problem) - levels[0]:+.5f}",
                f"{peak(end) - levels[1]:+.5f}",
                defect(start.steps),
            )
        )
    gx.report.table(
        "lumping: overshoot over the highest plateau",
        ("density matrix", f"t = {EARLY:g}", "at equilibrium", "mass defect"),
        rows,
        comm,
    )
    places = lower_edge(DISCONTINUOUS)
    gx.plots.along_length(
        {f"{label}, t = {EARLY:g}": problem for label, problem in early.items()},
        folder / "lumping.png",
        places[(places[:, 0] > CLOSE[0]) & (places[:, 0] < CLOSE[1])],
        exact={"plateau of the middle level": lambda x: levels[0] if x > 0.4 else np.nan},
    )


def main():
    comm = MPI.COMM_WORLD
    folder = gx.results.free_folder("results/fronts", comm)
    plain = fronts(folder, comm)
    size_effect(comm)
    lumping(folder, comm)
    for sentence in (
        "A flux widens the fronts, the more the higher its conduction, and the overshoots beside them vanish.",
        "It has a length of its own: without it bars of any length have the same peak, with it the short ones a lower.",
        "Lumping damps overshoots while they arise; at equilibrium only a lumped source makes them smaller.",
        f"The plots are in {folder}.",
    ):
        gx.report.say(plain, sentence)


if __name__ == "__main__":
    raise SystemExit(gx.guarded(main))
