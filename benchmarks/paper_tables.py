"""The paper's tables and pictures beside ours: both bars and the femur, in all eight discretisations.

    python benchmarks/paper_tables.py

Prints tables and leaves them as CSV and Markdown, with pictures, in benchmarks/results.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from itertools import chain
from typing import TYPE_CHECKING

import numpy as np
from mpi4py import MPI
from reporting import RESULTS, Table, progress, write_csv

import growthx as gx
from growthx import plots, scenes
from growthx.scenes.bar import (
    CONTINUOUS,
    DISCONTINUOUS,
    PROBLEMS,
    Problem,
    end_displacement,
    equilibrium,
    lower_edge,
    midpoint_density_change,
)
from growthx.scenes.femur import zones
from growthx.variants import suited
from growthx.zones import area_means

if TYPE_CHECKING:
    from pathlib import Path

    from growthx.discretisation import Discretisation

COMM = MPI.COMM_WORLD
ELEMENTS = (10, 40, 100)
VARIANTS = suited("quadrilateral")
REFINEMENTS = {1: 658, 2: 2632, 3: 5922}  # of each cell's edges, and the cells that makes
AS_PRINTED = {"density": 5e-7, "displacement": 5e-6}  # half of the last digit the paper prints
CLOSE = 3e-5  # reproduced but for rounding and the paper's tolerance

# The paper's discontinuous problem: density change at mid-length and end displacement at 10, 40 and 100 elements.
PAPER = {
    "Q1Q1": ((0.321502, 0.297437, 0.305828), (2.32251, 2.37135, 2.36629)),
    "Q2Q2": ((0.256541, 0.302062, 0.306116), (2.37124, 2.37151, 2.37156)),
    "Q1P0": ((0.300028, 0.306185, 0.306171), (2.32239, 2.37122, 2.36624)),
    "S2Q1": ((0.318560, 0.305875, 0.306171), (2.37221, 2.37181, 2.37166)),
    "Q1": ((0.300028, 0.306185, 0.306418), (2.32239, 2.37122, 2.36624)),
    "Q2": ((0.306443, 0.306186, 0.306188), (2.37095, 2.37146, 2.37154)),
    "Q1sri": ((0.300028, 0.306168, 0.306171), (2.32239, 2.37135, 2.36630)),
    "S2fri": ((0.306504, 0.306282, 0.306171), (2.37156, 2.37155, 2.37155)),
}


# -- the bars ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Reading:
    """What the paper's tables tell of a bar, and what else could have been read there."""

    variant: str
    elements: int
    dofs: int
    points: int
    density: float
    displacement: float
    near: tuple[tuple[float, float], ...]  # x and density change of all densities in the cells around mid-length

    def paper(self) -> tuple[float, float]:
        """The paper's density change and displacement."""
        density, displacement = PAPER[self.variant]
        return density[ELEMENTS.index(self.elements)], displacement[ELEMENTS.index(self.elements)]


@cache
def bar_problem(problem: Problem, elements: int, variant: gx.Variant) -> Discretisation:
    """A bar at the end of its run."""
    return gx.solve(scenes.bar(problem, elements), variant).problem


def reading(problem: Problem, elements: int, variant: gx.Variant) -> Reading:
    """Run a bar and read it as the paper does."""
    done = bar_problem(problem, elements, variant)
    owned = done.density_space.dofmap.index_map.size_local
    x = done.density_positions()[:owned, 0]
    here = np.abs(x - 0.5) < 1 / elements + 1e-9
    change = done.density.x.array[:owned] / done.scene.material.reference_density - 1
    near = COMM.allgather(list(zip(x[here].tolist(), change[here].tolist(), strict=True)))
    return Reading(
        variant.name,
        elements,
        done.dofs,
        done.points,
        midpoint_density_change(done),
        end_displacement(done),
        tuple(sorted(chain(*near))),
    )


def remark(ours: Reading) -> str:
    """Why a row differs from the paper's, as far as we know; empty if it does not."""
    density, displacement = ours.paper()
    apart = ours.density - density, ours.displacement - displacement
    if abs(apart[1]) > CLOSE:
        return (
            "Not to be reproduced: with linear displacements the paper's end displacement is half a cell's length "
            "shorter, while Q2 and S2 agree on the same mesh: its stimulus must have been laid out otherwise there."
        )
    if abs(apart[0]) <= CLOSE:
        return ""
    x, value = min(ours.near, key=lambda entry: abs(entry[1] - density))
    if abs(value - density) <= 2 * AS_PRINTED["density"]:
        return f"The paper's density is ours at x = {x:.4f}: it reads another point."
    return "None of our densities around mid-length is the paper's, while the end displacement is, to the last digit."


def discontinuous_table(readings: list[Reading]) -> Table:
    """Ours beside the paper's, with deviations."""
    rows = []
    notes = list(dict.fromkeys(filter(None, map(remark, readings))))
    for ours in readings:
        density, displacement = ours.paper()
        numbers = (f"{ours.density:.6f}", f"{density:.6f}", f"{ours.density - density:+.1e}")
        numbers += (f"{ours.displacement:.5f}", f"{displacement:.5f}", f"{ours.displacement - displacement:+.1e}")
        rows.append([ours.variant, f"{ours.elements}", f"{ours.dofs}", f"{ours.points}", *numbers])
        rows[-1].append(f"{notes.index(remark(ours)) + 1}" if remark(ours) else "")
    header = ("", "elements", "dofs", "points", "density change", "paper", "apart")
    return Table(
        "Discontinuous bar: density change at mid-length and end displacement at t = 6",
        (*header, "end displacement", "paper", "apart", "note"),
        rows,
        notes,
    )


def continuous_table(readings: list[Reading]) -> Table:
    """The same columns; the paper's numbers are not at hand."""
    scene = scenes.bar(CONTINUOUS, 10)
    exact = equilibrium(scene, CONTINUOUS, 0.5).density / scene.material.reference_density - 1  # of a section alone
    rows = [
        [
            *(r.variant, f"{r.elements}", f"{r.dofs}", f"{r.points}"),
            *(f"{r.density:.6f}", f"{r.density - exact:+.1e}", f"{r.displacement:.6f}"),
        ]
        for r in readings
    ]
    return Table(
        "Tapered bar: density change at mid-length and end displacement at t = 6",
        ("", "elements", "dofs", "points", "density change", "from semi-analytic", "end displacement"),
        rows,
        [f"Semi-analytic is the narrowest section alone, under uniform uniaxial stress: {exact:.6f}."],
    )


def write_readings(path: Path, readings: list[Reading], published: bool) -> None:
    """All numbers of a bar, in full."""
    header = ["variant", "elements", "dofs", "points", "midpoint_density_change", "end_displacement"]
    header += ["paper_density_change", "paper_end_displacement", "remark"] if published else []
    write_csv(
        path,
        header,
        (
            [r.variant, r.elements, r.dofs, r.points, r.density, r.displacement]
            + ([*r.paper(), remark(r)] if published else [])
            for r in readings
        ),
    )


def draw_bars(problem: Problem, path: Path) -> None:
    """Density change along the lower edge in a panel for each variant, on all meshes, as the paper draws it."""
    places = lower_edge(problem)
    scene = scenes.bar(problem, 10)
    curves = {
        (variant.name, elements): bar_problem(problem, elements, variant).sample_density(places) - 1
        for variant in VARIANTS
        for elements in ELEMENTS
    }
    if COMM.rank != 0:
        return
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(15, 7), layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(2, 4, sharex=True, sharey=True)
    exact = [equilibrium(scene, problem, x).density - 1 for x in places[:, 0]]
    looks = zip(ELEMENTS, ("#56b4e9", "#d55e00", "#000000"), (2.4, 1.6, 1.0), strict=True)
    looks = list(looks)
    for axes, variant in zip(panels.flat, VARIANTS, strict=True):
        axes.plot(places[:, 0], exact, color="0.75", linewidth=4, label="semi-analytic")
        for elements, colour, width in looks:
            axes.plot(
                places[:, 0],
                curves[variant.name, elements],
                color=colour,
                linewidth=width,
                label=f"{elements} elements",
            )
        axes.set_title(variant.name)
        axes.grid(color="0.92")
    for axes in panels[-1]:
        axes.set_xlabel("position along the bar")
    for axes in panels[:, 0]:
        axes.set_ylabel("density change [ρ − ρ*]/ρ*")
    panels[0, 0].legend(frameon=False, fontsize="small")
    figure.savefig(path, dpi=110)


# -- the femur ---------------------------------------------------------------------------------------------------------


@cache
def femur_problem(variant: gx.Variant, refine: int = 1) -> Discretisation:
    """The femur at t = 160."""
    return gx.solve(scenes.femur(refine=refine), variant).problem


def femur_table(problems: dict[str, Discretisation], title: str, reference: str) -> Table:
    """Counts and zone means, and the largest deviation of a mean from that of a reference."""
    means = {label: area_means(problem, zones()) for label, problem in problems.items()}
    off = {label: max(abs(mean[zone] / means[reference][zone] - 1) for zone in mean) for label, mean in means.items()}
    rows = [
        ["cells", *(f"{problem.scene.mesh.cell_count}" for problem in problems.values())],
        ["dofs", *(f"{problem.dofs}" for problem in problems.values())],
        ["integration points", *(f"{problem.points}" for problem in problems.values())],
        ["densities", *(f"{count_densities(problem)}" for problem in problems.values())],
        *([zone.replace("_", " "), *(f"{mean[zone]:.3f}" for mean in means.values())] for zone in zones()),
        ["whole bone", *(f"{problem.mean_density():.3f}" for problem in problems.values())],
        [f"largest change from {reference}", *(f"{share:.1%}" for share in off.values())],
    ]
    return Table(title, ["", *problems], rows)


def count_densities(problem: Discretisation) -> int:
    """Number of densities on all ranks."""
    return int(COMM.allreduce(len(problem.density_dofs)))


# -- all of it ---------------------------------------------------------------------------------------------------------

INTRODUCTION = """\
# The paper's tables and pictures, recomputed

Made by `python benchmarks/paper_tables.py`. The numbers in full are in the CSV files beside this page.

Readings: the density in the cell to the right of x = 0.5, at the point nearest to x = 0.5 in the outermost row; the
axial displacement of a corner of the loaded end. *dofs* counts the unknowns of the global system, *points* those at
which the stress is evaluated, *densities* the values of density in all.

What agrees: the end displacements of Q2Q2, S2Q1, Q2 and S2fri at all three meshes and of all eight elements at 40
elements, within one of the last printed digit; the densities of S2Q1 at all three, to the last printed digit. What does
not is marked with what we know of the reason. Q1P0 (driven by the cell's mean source) and Q1sri (by the source at the
midpoint) differ in the end displacement, as in the paper: 2.37122 and 2.37135 at 40 elements.
"""

# Below each table.
COMMENTS = (
    """\
![The discontinuous bar](bar_discontinuous.png)

Nodal densities overshoot at the steps of the stimulus; densities at integration points or per cell do not.

""",
    """\
![The tapered bar](bar_continuous.png)

The kink is at mid-length, where the density is read: a reading half a cell away, or a mean over a cell, is of first
order there, and so is the deviation of the linear elements and of those that read a point beside it. The edge has a
corner there, too, and the stress around it is not quite uniaxial: Q2Q2, which reads the corner itself, finds more than
the section alone would have, and the more so the finer the mesh.

""",
    """\
Raw densities: constant over the part of a cell that belongs to an integration point, or continuous where the density is
nodal.

![The femur, raw](femur_raw.png)

The same extrapolated from the integration points to the corners of the cells and averaged there (for the eye alone: an
extrapolated density may lie outside the range of those computed):

![The femur, smoothed](femur_smoothed.png)

""",
    """\
As by `growthx femur --refine 2` and `--refine 3`:

![The femur on finer meshes](femur_meshes.png)
""",
)


def main() -> None:
    """Run everything, print the tables, write them and draw."""
    if COMM.rank == 0:
        RESULTS.mkdir(exist_ok=True)
    runs = len(PROBLEMS) * len(VARIANTS) * len(ELEMENTS) + len(VARIANTS) + len(REFINEMENTS)
    with progress("the paper's tables", runs) as begin:
        readings: dict[str, list[Reading]] = {problem.name: [] for problem in PROBLEMS.values()}
        for problem in PROBLEMS.values():
            for variant in VARIANTS:
                for elements in ELEMENTS:
                    begin(f"{variant.name}, {elements} elements, {problem.name}")
                    readings[problem.name].append(reading(problem, elements, variant))
        femurs = {}
        for variant in VARIANTS:
            begin(f"{variant.name}, femur")
            femurs[variant.name] = femur_problem(variant)
        meshes = {}
        for refine, cells in REFINEMENTS.items():
            begin(f"Q1P0, femur of {cells} cells")
            meshes[f"{cells} cells"] = femur_problem(gx.Q1P0, refine)
    tables = [
        discontinuous_table(readings["discontinuous"]),
        continuous_table(readings["continuous"]),
        femur_table(femurs, "Femur at t = 160: counts and mean densities of zones (g/cm³)", "Q1P0"),
        femur_table(meshes, "Femur with Q1P0 on finer meshes (g/cm³)", f"{REFINEMENTS[1]} cells"),
    ]
    for table in tables:
        table.show()
    if COMM.rank == 0:
        for name, rows in readings.items():
            write_readings(RESULTS / f"bar_{name}.csv", rows, published=name == DISCONTINUOUS.name)
        for name, table in zip(("femur", "femur_meshes"), tables[2:], strict=True):
            write_csv(RESULTS / f"{name}.csv", table.header, table.rows)
        page = "\n".join(
            [
                INTRODUCTION,
                *(
                    text
                    for table, comment in zip(tables, COMMENTS, strict=True)
                    for text in (table.markdown(), comment)
                ),
            ]
        )
        (RESULTS / "paper_tables.md").write_text(page, encoding="utf-8")
    for problem in PROBLEMS.values():
        draw_bars(problem, RESULTS / f"bar_{problem.name}.png")
    local = {name: problem for name, problem in femurs.items() if problem.variant.density.local}
    unit = "density (g/cm³)"
    plots.densities(femurs, RESULTS / "femur_raw.png", title=unit)
    plots.densities(local, RESULTS / "femur_smoothed.png", title=unit, smoothed=True, columns=5)
    plots.densities(meshes, RESULTS / "femur_meshes.png", title=unit)


if __name__ == "__main__":
    raise SystemExit(gx.guarded(main))
