"""The history of a run as CSV."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import TYPE_CHECKING

from growthx.common.checks import require_path
from growthx.stepping.arguments import require_result

if TYPE_CHECKING:
    from growthx.stepping.record import Result


def write_history(folder: Path, result: Result) -> None:
    """Write `history.csv`, one row per step; a run in several ranks writes it once."""
    require_path(folder, "the folder for results")
    require_result(result)
    if result.problem.comm.rank != 0:
        return
    directions = "xyz"[: result.scene.mesh.dim]
    with (Path(folder) / "history.csv").open("x", newline="") as file:
        writer = csv.writer(file)
        supports = list(result.steps[0].reactions) if result.steps else []
        writer.writerow(
            ["time", "time_step", "error", "load", "rejected", "newton_iterations", "factorisations", "residual"]
            + ["round_off", "mass", "mass_defect", "force_defect", "min_density", "max_density", "lumped_cells"]
            + [f"reaction_{name}_{direction}" for name in supports for direction in directions]
        )
        for step in result.steps:
            writer.writerow(
                [step.time, step.time_step, step.error, step.load, step.rejected, step.newton_iterations]
                + [step.newton.factorisations, step.newton.residual_norms[-1], step.newton.round_off]
                + [
                    step.mass,
                    step.mass_defect,
                    step.force_defect,
                    step.min_density,
                    step.max_density,
                    step.lumped_cells,
                ]
                + [float(force) for name in supports for force in step.reactions[name]]
            )
