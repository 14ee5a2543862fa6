"""The history of a run as CSV: a row for each step, there as soon as the step is done."""

from __future__ import annotations

import csv
import io
import logging
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from growthx.common.checks import require_path
from growthx.results.states.vtu import write_whole
from growthx.stepping.arguments import require_result

if TYPE_CHECKING:
    from growthx.stepping.record import Cost, Result, Step

NAME = "history.csv"


def write_history(folder: Path, result: Result) -> None:
    """Write `history.csv`, one row per step; a run in several ranks writes it once.

    Its last columns, `wall_s` and `peak_memory_mb`, are empty for steps of which no cost is known.

    Example:
        >>> from mpi4py import MPI
        >>> result = gx.solve(gx.scenes.plate(2), gx.Q1P0)
        >>> gx.results.write_history(gx.results.new_folder("run", MPI.COMM_WORLD), result)
    """
    require_path(folder, "the folder for results")
    require_result(result)
    if result.problem.comm.rank == 0:
        write_whole(Path(folder) / NAME, _whole(result))


class History:
    """The `history.csv` of a run on its way, on rank 0.

    A row is there when its step is done, so that a killed run keeps it.  A disk that is full ends no run: the file is
    written once more at the next step, and at the end.
    """

    def __init__(self, folder: Path, *, ours: bool = False) -> None:
        """ours: whether a file that is there is of the run that is resumed."""
        self._file, self._ours, self._rows, self._told = folder / NAME, ours, -1, False

    def add(self, result: Result) -> None:
        """Add the last step; all of them, where they are not there."""
        if result.problem.comm.rank != 0:
            return
        try:
            if self.is_whole(result, but=1):
                with self._file.open("a", newline="") as file:
                    file.write(_as_text([_row(result, len(result.steps) - 1)]))
            else:
                self.complete(result)
        except OSError as error:
            self._rows = -1
            if not self._told:
                reason = error.strerror or error
                logging.getLogger("growthx").warning(
                    "growthx: %s cannot be written (%s); the run goes on", self._file, reason
                )
            self._told = True
        else:
            self._rows = len(result.steps)

    def complete(self, result: Result) -> None:
        """Write all steps, on rank 0; OSError if that cannot be."""
        if result.problem.comm.rank == 0:
            write_whole(self._file, _whole(result), over=self._ours)
            self._rows, self._ours = len(result.steps), True

    def is_whole(self, result: Result, but: int = 0) -> bool:
        """Whether all steps but so many are there, on rank 0."""
        return self._rows == len(result.steps) - but and self._file.exists()


def _whole(result: Result) -> Iterator[bytes]:
    """The whole file."""
    directions = "xyz"[: result.scene.mesh.dim]
    header = ["time", "time_step", "error", "load", "rejected", "newton_iterations", "factorisations", "residual"]
    header += ["round_off", "mass", "mass_defect", "force_defect", "moment_defect"]
    header += ["min_density", "max_density", "lumped_cells"]
    header += [f"reaction_{name}_{direction}" for name in _supports(result) for direction in directions]
    yield _as_text([[*header, "wall_s", "peak_memory_mb"]]).encode()
    for number in range(len(result.steps)):
        yield _as_text([_row(result, number)]).encode()


def _supports(result: Result) -> list[str]:
    return list(result.steps[0].reactions) if result.steps else []


def _row(result: Result, number: int) -> list[Any]:
    """A step in numbers."""
    step: Step = result.steps[number]
    cost: Cost | None = result.costs[number] if number < len(result.costs) else None
    return [
        *(step.time, step.time_step, step.error, step.load, step.rejected, step.newton_iterations),
        *(step.newton.factorisations, step.newton.residual_norms[-1], step.newton.round_off),
        *(step.mass, step.mass_defect, step.force_defect, step.moment_defect),
        *(step.min_density, step.max_density, step.lumped_cells),
        *(float(force) for name in _supports(result) for force in step.reactions[name]),
        *((f"{cost.wall_s:.3f}", f"{cost.peak_memory:.1f}") if cost else ("", "")),
    ]


def _as_text(rows: list[list[Any]]) -> str:
    text = io.StringIO(newline="")
    csv.writer(text).writerows(rows)
    return text.getvalue()
