"""The paper's Remark 6.1: the femur with m = 0 ends by itself, in a field of zeros and ones."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import growthx as gx
from benchmarks.stability.study import VARIANTS, Part, share
from growthx.baselines import checkerboard_index, high_frequency_index

EMPTY, DENSE = 0.1, 2.0  # of ρ*


@dataclass(frozen=True)
class Case:
    """A discretisation."""

    variant: str


@dataclass(frozen=True)
class Row:
    """How the run ended, with the sentence that says so; empty, dense: shares of the volume.

    kept: time of the last state on disk.  status: exit status of such a run on the command line.
    """

    variant: str
    time: float
    lowest: float
    highest: float
    empty: float
    dense: float
    jump: float
    noise: float
    kept: float
    status: int
    why: str


def collapse(variant: str, folder: str | Path) -> gx.Result:
    """The femur in 658 cells with m = 0, as far as it gets; GrowthxError if it comes to its end after all."""
    try:
        gx.solve(gx.scenes.femur(m=0.0), gx.variants.named(variant), out=folder)
    except gx.RunEndedEarly as ended:
        return ended.result
    raise gx.GrowthxError(f"{variant} reached the end of a femur with m = 0, which Remark 6.1 says it cannot")


def run(case: Case) -> list[Row]:
    """One run, with its results in a folder that is read again."""
    with TemporaryDirectory() as parent:
        folder = Path(parent) / "run"
        result = collapse(case.variant, folder)
        with (folder / "history.csv").open(newline="") as file:
            kept = float(list(csv.DictReader(file))[-1]["time"])
    problem = result.problem
    reference = problem.scene.material.reference_density
    return [
        Row(
            case.variant,
            result.time,
            *problem.density_range(),
            share(problem, lambda rho: np.less(rho, EMPTY * reference)),
            share(problem, lambda rho: np.greater(rho, DENSE * reference)),
            checkerboard_index(problem),
            high_frequency_index(problem),
            kept,
            gx.RunEndedEarly.exit_status,
            result.reason,
        )
    ]


def cases() -> list[Case]:
    """Every discretisation."""
    return [Case(variant) for variant in VARIANTS]


PART = Part("collapse", Row, cases, run)
