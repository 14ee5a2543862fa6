"""What the femur is given, by the paper and by us, and what each of our choices changes in its mean densities."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import growthx as gx
from benchmarks.accuracy.paper_tables.femur import read_table, write_table
from benchmarks.shared.reporting import RESULTS, Table, read_rows, write_rows
from growthx import scenes
from growthx.scenes.femur import COMBINATIONS, LOAD_CASES, combination, loaded_arcs, zones

if TYPE_CHECKING:
    from growthx.discretisation.discretisation import Discretisation

VARIANT = gx.Q1P0
CHOSEN = "chosen"  # the defaults: average, 30 mm
CHANGES = "femur_inputs"
CHANGES_TITLE = "Mean densities of the femur's zones (g/cm³) by what it is given"


@dataclass(frozen=True)
class LoadCase:
    """A load case of the paper's table, and what is ours of it: weights in the combinations, and mm of arc."""

    name: str
    joint: float
    joint_angle: float
    joint_arc: float
    abductor: float
    abductor_angle: float
    abductor_arc: float
    average: float
    superposed: float
    stimulus: float


def load_file(folder: Path) -> Path:
    """Where the load cases are."""
    return folder / "femur_loads.csv"


def choices() -> dict[str, Mapping[str, Any]]:
    """Arguments of the femur by what they change, the chosen ones first."""
    alone = {
        f"{case.name} alone": {"weights": tuple(float(other is case) for other in LOAD_CASES)} for case in LOAD_CASES
    }
    others = {
        name: {"weights": chosen.weights, "separate": chosen.separate}
        for name, chosen in COMBINATIONS.items()
        if name != "average"
    }
    return {CHOSEN: {}, "20 mm": {"thickness": 20.0}, "40 mm": {"thickness": 40.0}, **others, **alone}


@cache
def chosen(name: str) -> Discretisation:
    """The femur at its end by one of the choices."""
    return gx.solve(scenes.femur(**choices()[name]), VARIANT).problem


def run_inputs(begin: Callable[[str], None], folder: Path = RESULTS) -> None:
    """Run the femur with each choice and leave the tables (collective)."""
    means: dict[str, dict[str, float]] = {}
    for name in choices():
        begin(f"{VARIANT.name}, femur, {name}")
        problem = chosen(name)
        means[name] = {**gx.zones.area_means(problem, zones()), "whole bone": problem.mean_density()}
    rows = [[zone.replace("_", " "), *(f"{mean[zone]:.3f}" for mean in means.values())] for zone in means[CHOSEN]]
    off = [max(abs(mean[zone] / means[CHOSEN][zone] - 1) for zone in mean) for mean in means.values()]
    rows.append([f"largest change from {CHOSEN}", *(f"{share:.0%}" for share in off)])
    write_table(folder, CHANGES, ["", *means], rows)
    cases = load_cases()
    if problem.comm.rank == 0:
        write_rows(load_file(folder), cases)


def load_cases() -> list[LoadCase]:
    """As the scene has them (collective)."""
    arcs = {(arc.case, arc.force): arc.length for arc in loaded_arcs(scenes.femur())}
    weights = [combination(name).weights for name in COMBINATIONS]
    return [
        LoadCase(
            case.name,
            case.joint,
            case.joint_angle,
            arcs[case.name, "joint"],
            case.abductor,
            case.abductor_angle,
            arcs[case.name, "abductor"],
            *(each[number] for each in weights),
        )
        for number, case in enumerate(LOAD_CASES)
    ]


def input_tables(folder: Path = RESULTS) -> list[Table]:
    """The load cases, and what the choices change, from their files."""
    rows = [
        [
            case.name,
            *(f"{case.joint:g}", f"{case.joint_angle:g}°", f"{case.joint_arc:.1f}"),
            *(f"{case.abductor:g}", f"{case.abductor_angle:g}°", f"{case.abductor_arc:.1f}"),
            *(f"{case.average:g}", f"{case.superposed:g}", f"{case.stimulus:g}"),
        ]
        for case in read_rows(load_file(folder), LoadCase)
    ]
    loads = Table(
        "Inputs of the femur: load cases",
        (
            "load case (forces in N, arcs in mm)",
            *("joint", "angle", "arc", "abductor", "angle", "arc"),
            *(f"weight, {name}" for name in COMBINATIONS),
        ),
        rows,
        [
            "Forces and angles from the vertical are the paper's: the joint's pushes the head down and, at positive "
            "angles, laterally; the abductor's pulls the trochanter up and medially. Arcs and weights are ours."
        ],
    )
    return [loads, read_table(folder, CHANGES, CHANGES_TITLE)]
