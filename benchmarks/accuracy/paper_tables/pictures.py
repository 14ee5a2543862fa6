"""The pictures of the page, in form those of the paper: relative changes of density along the bars and in the femur."""

from __future__ import annotations

from pathlib import Path

from mpi4py import MPI

from benchmarks.accuracy.paper_tables.bars import bar_problem
from benchmarks.accuracy.paper_tables.elements import draw_elements
from benchmarks.accuracy.paper_tables.femur import COLLAPSING, REFINED, by_mesh, by_variant, collapsed
from benchmarks.accuracy.paper_tables.inputs import chosen
from benchmarks.accuracy.paper_tables.newton import draw_newton, read_norms
from benchmarks.accuracy.paper_tables.paper import ELEMENTS, VARIANTS
from benchmarks.shared.pictures import blank
from benchmarks.shared.reporting import RESULTS
from growthx import plots, scenes
from growthx.scenes.bar import PROBLEMS, Problem, equilibrium, lower_edge

COMM = MPI.COMM_WORLD
LOOKS = dict(zip(ELEMENTS, (("#56b4e9", 2.4), ("#d55e00", 1.6), ("#000000", 1.0)), strict=True))  # colour, width
DENSITY = "density (g/cm³)"


def draw(folder: Path = RESULTS) -> None:
    """All of them (collective)."""
    for name, problem in PROBLEMS.items():
        _draw_bars(problem, folder / f"bar_{name}.png")
    draw_elements(folder / "elements.png")
    draw_newton(read_norms(folder), folder / "newton.png")
    femurs = by_variant()
    local = {name: each for name, each in femurs.items() if each.variant.density.local}
    nodal = {name: each for name, each in femurs.items() if name not in local}
    finer = {f"{each.name}, {label}": problem for each in REFINED for label, problem in by_mesh(each).items()}
    plots.densities(finer, folder / "femur_meshes.png", relative=True, scale=DENSITY, columns=3)
    collapses = {variant.name: collapsed(variant) for variant in COLLAPSING}
    plots.densities(collapses, folder / "femur_collapse.png", relative=True, scale=DENSITY)
    plots.density(chosen("stimulus"), folder / "femur_loads.png", relative=True, scale=DENSITY)
    cells = {"Q1P0": local.pop("Q1P0")}
    plots.densities(nodal | cells, folder / "femur_nodes.png", relative=True, scale=DENSITY)
    plots.densities(local, folder / "femur_points.png", relative=True, scale=DENSITY)
    plots.densities(local, folder / "femur_smoothed.png", relative=True, scale=DENSITY, smoothed=True)


def _draw_bars(problem: Problem, path: Path) -> None:
    """Density change along the lower edge in a panel for each variant, on all meshes, as the paper draws it."""
    places = lower_edge(problem)
    scene = scenes.bar(problem, ELEMENTS[0])
    curves = {
        (variant.name, elements): bar_problem(problem, elements, variant).sample_density_change(places)
        for variant in VARIANTS
        for elements in ELEMENTS
    }
    if COMM.rank != 0:
        return
    figure = blank(15, 7)
    panels = figure.subplots(2, 4, sharex=True, sharey=True)
    exact = [equilibrium(scene, problem, x).density / scene.material.reference_density - 1 for x in places[:, 0]]
    for axes, variant in zip(panels.flat, VARIANTS, strict=True):
        axes.plot(places[:, 0], exact, color="0.75", linewidth=4, label="semi-analytic")
        for elements, (colour, width) in LOOKS.items():
            curve = curves[variant.name, elements]
            axes.plot(places[:, 0], curve, color=colour, linewidth=width, label=f"{elements} elements")
        axes.set_title(variant.name)
        axes.grid(color="0.92")
    for axes in panels[-1]:
        axes.set_xlabel("position along the bar")
    for axes in panels[:, 0]:
        axes.set_ylabel("density change [ρ − ρ*]/ρ*")
    panels[0, 0].legend(frameon=False, fontsize="small")
    figure.savefig(path, dpi=110)
