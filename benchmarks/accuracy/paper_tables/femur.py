"""The femur in all discretisations, and with one of them on finer meshes: counts, and mean densities of zones."""

from __future__ import annotations

import csv
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from mpi4py import MPI

import growthx as gx
from benchmarks.shared.reporting import Table
from growthx import scenes
from growthx.scenes.femur import zones

if TYPE_CHECKING:
    from growthx.discretisation.discretisation import Discretisation

REFINEMENTS = {1: 658, 2: 2632, 3: 5922}  # of each cell's edges, and the cells that makes
# Of the tables, by the CSV files of their texts.
FEMUR_TITLES = {
    "femur": "Femur at t = 160: counts and mean densities of zones (g/cm³)",
    "femur_meshes": "Femur with Q1P0 on finer meshes (g/cm³)",
}


@cache
def femur_problem(variant: gx.Variant, refine: int = 1) -> Discretisation:
    """The femur at t = 160."""
    return gx.solve(scenes.femur(refine=refine), variant).problem


def femur_table(problems: dict[str, Discretisation], reference: str) -> tuple[list[str], list[list[str]]]:
    """Header and rows: counts and zone means, and the largest deviation of a mean from that of a reference."""
    means = {label: gx.zones.area_means(problem, zones()) for label, problem in problems.items()}
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
    return ["", *problems], rows


def read_femur_table(name: str, folder: Path) -> Table:
    """The table in a CSV file."""
    with (folder / f"{name}.csv").open(newline="", encoding="utf-8") as file:
        header, *rows = csv.reader(file)
    return Table(FEMUR_TITLES[name], header, rows)


def count_densities(problem: Discretisation) -> int:
    """Number of densities on all ranks."""
    return int(MPI.COMM_WORLD.allreduce(len(problem.growing_dofs)))
