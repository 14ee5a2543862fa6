"""All files of a run, whole or not there."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from growthx.common.checks import require_path
from growthx.common.errors import OutputError
from growthx.common.renamed import renamed
from growthx.post.derived import check_fields
from growthx.results.density import write_density
from growthx.results.history import write_history
from growthx.results.series import Keeping, agreed, aside
from growthx.results.states.writer import StateWriter
from growthx.stepping.arguments import require_result

if TYPE_CHECKING:
    from collections.abc import Sequence

    from growthx.stepping.record import Result


@renamed(density="with_density", history="with_history")
def write(
    folder: Path,
    result: Result,
    *,
    with_density: bool = False,
    with_history: bool = True,
    vtkhdf: bool = False,
    fields: Sequence[str] | None = None,
) -> None:
    """Write the last state into a folder made by `new_folder` (collective): fields, as means and raw, and the history.

    with_density: and what `read_density` reads.  with_history: False where it is there already.
    vtkhdf, fields: see `growthx.solve`.

    All files are there afterwards, whole, or none.  Raises OutputError if they cannot be written, or if the run has no
    accepted step, whose state would be there to write.

    Example:
        >>> from mpi4py import MPI
        >>> result = gx.solve(gx.scenes.plate(2), gx.Q1P0)
        >>> gx.results.write(gx.results.new_folder("run", MPI.COMM_WORLD), result)
    """
    require_result(result)
    require_path(folder, "the folder for results")
    folder = Path(folder)
    if not result.steps:
        raise OutputError(
            f"the run of the scene '{result.scene.name}' has no accepted step: there is nothing to write, and a "
            "run that got through its first one is needed"
        )
    comm = result.problem.comm
    check_fields(fields, result.problem)
    with aside(folder, comm) as hidden:
        writer = StateWriter(hidden, result.problem, Keeping(vtkhdf=vtkhdf, fields=fields))
        writer.write(result.time)
        writer.close()
        with agreed(folder, comm):
            if with_history:
                write_history(hidden, result)
            if with_density:
                write_density(hidden, result.problem)
