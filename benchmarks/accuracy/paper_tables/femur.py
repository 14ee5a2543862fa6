"""The femur in all discretisations, and with two of them on finer meshes: counts, and mean densities of zones."""

from __future__ import annotations

import csv
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from mpi4py import MPI

import growthx as gx
from benchmarks.accuracy.paper_tables.paper import VARIANTS
from benchmarks.shared.reporting import RESULTS, Table, write_csv
from growthx import scenes
from growthx.scenes.femur import zones

if TYPE_CHECKING:
    from growthx.discretisation.discretisation import Discretisation

REFINEMENTS = {1: 658, 2: 2632, 3: 5922}  # of each cell's edges, and the cells that makes
REFINED = (gx.Q1Q1, gx.Q1P0)  # the paper's own choice, and ours
REFERENCE = gx.Q1P0
COLLAPSING = (gx.Q1P0, gx.Q1sri)  # of which Remark 6.1 tells
# Of the tables, by the CSV files of their texts.
FEMUR_TITLES = {
    "femur": "Femur at t = 160: counts and mean densities of zones (g/cm³)",
    **{f"femur_meshes_{each.name}": f"Femur with {each.name} on finer meshes (g/cm³)" for each in REFINED},
}


@cache
def femur_problem(variant: gx.Variant, refine: int = 1) -> Discretisation:
    """The femur at t = 160."""
    return gx.solve(scenes.femur(refine=refine), variant).problem


@cache
def collapsed(variant: gx.Variant) -> Discretisation:
    """The femur with m = 0 in its last good state; GrowthxError if it reaches its end, as the paper's does not."""
    try:
        gx.solve(scenes.femur(m=0.0), variant)
    except gx.RunEndedEarly as ended:
        return ended.result.problem
    raise gx.GrowthxError(f"{variant.name} reached the end of a femur with m = 0, which Remark 6.1 says it cannot")


def by_variant() -> dict[str, Discretisation]:
    """The femur in all discretisations."""
    return {variant.name: femur_problem(variant) for variant in VARIANTS}


def by_mesh(variant: gx.Variant) -> dict[str, Discretisation]:
    """The femur on all meshes."""
    return {f"{cells} cells": femur_problem(variant, refine) for refine, cells in REFINEMENTS.items()}


def run_femurs(begin: Callable[[str], None], folder: Path = RESULTS) -> None:
    """Run the femur in all discretisations and on all meshes, and leave the tables (collective)."""
    for variant in VARIANTS:
        begin(f"{variant.name}, femur")
        femur_problem(variant)
    for variant in REFINED:
        for refine, cells in REFINEMENTS.items():
            begin(f"{variant.name}, femur of {cells} cells")
            femur_problem(variant, refine)
    coarse = f"{REFINEMENTS[1]} cells"
    found = [(by_variant(), REFERENCE.name), *((by_mesh(variant), coarse) for variant in REFINED)]
    for name, (problems, reference) in zip(FEMUR_TITLES, found, strict=True):
        write_table(folder, name, *_table(problems, reference))


def _table(problems: dict[str, Discretisation], reference: str) -> tuple[list[str], list[list[str]]]:
    """Header and rows: counts and zone means, and the largest deviation of a mean from that of a reference."""
    means = {label: gx.zones.area_means(problem, zones()) for label, problem in problems.items()}
    off = {label: max(abs(mean[zone] / means[reference][zone] - 1) for zone in mean) for label, mean in means.items()}
    rows = [
        ["cells", *(f"{problem.scene.mesh.cell_count}" for problem in problems.values())],
        ["dofs", *(f"{problem.dofs}" for problem in problems.values())],
        ["integration points", *(f"{problem.points}" for problem in problems.values())],
        ["densities", *(f"{_count_densities(problem)}" for problem in problems.values())],
        *([zone.replace("_", " "), *(f"{mean[zone]:.3f}" for mean in means.values())] for zone in zones()),
        ["whole bone", *(f"{problem.mean_density():.3f}" for problem in problems.values())],
        [f"largest change from {reference}", *(f"{share:.1%}" for share in off.values())],
    ]
    return ["", *problems], rows


def write_table(folder: Path, name: str, header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Leave a table of texts as a CSV file, on rank 0."""
    if MPI.COMM_WORLD.rank == 0:
        write_csv(folder / f"{name}.csv", header, rows)


def read_table(folder: Path, name: str, title: str) -> Table:
    """The table in a CSV file."""
    with (folder / f"{name}.csv").open(newline="", encoding="utf-8") as file:
        header, *rows = csv.reader(file)
    return Table(title, header, rows)


def femur_tables(folder: Path = RESULTS) -> list[Table]:
    """All of the femur, from their files."""
    return [read_table(folder, name, title) for name, title in FEMUR_TITLES.items()]


def _count_densities(problem: Discretisation) -> int:
    """Number of densities on all ranks."""
    return int(MPI.COMM_WORLD.allreduce(len(problem.growing_dofs)))
