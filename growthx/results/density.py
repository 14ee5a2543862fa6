"""The density of a run in a file of its own, and read back from the files that a run leaves."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from mpi4py import MPI

from growthx.common.checks import require_path
from growthx.common.communicators import steady
from growthx.common.errors import InputError
from growthx.discretisation.transfers.grown import GrownDensity, gathered
from growthx.results import checkpoints, members

if TYPE_CHECKING:
    from growthx.discretisation.discretisation import Discretisation

NAME = "density.zip"  # of NumPy arrays
FORMAT = 1


def write_density(folder: Path, problem: Discretisation) -> None:
    """Write the density with its body, with all digits, to a folder (collective); OSError if there is no room."""
    if grown := gathered(problem):
        numbers, arrays = grown.as_numbers()
        members.write(folder / NAME, {"format": FORMAT, "body": numbers}, arrays, compressed=True)


def read_density(path: str | os.PathLike[str], *, comm: MPI.Comm = MPI.COMM_WORLD) -> GrownDensity:
    """The density that a run has left in a folder, with all digits, as `transfer` takes it (collective).

    path: the folder, of which the density at the end is read, or else the last checkpoint; or one of these files.
    comm: the ranks that are to have it, as many as there are, whatever number the run had.
    Raises InputError if there is neither, or if the file is damaged or of an earlier growthx.

    Example:
        >>> result = gx.solve(gx.scenes.plate(2), gx.Q1P0, out="run")
        >>> gx.transfer(gx.read_density("run"), result.scene.mesh, gx.Q1P0).correction
        0.0
    """
    require_path(path, "the folder of the run")
    return checkpoints.on_first_rank(lambda: _read(_find(Path(path))), steady(comm))


def _find(place: Path) -> Path:
    """The file that a path means."""
    if place.is_file():
        return place
    kept = checkpoints.in_folder(place) if place.is_dir() else []
    if place.is_dir() and (place / NAME).is_file():
        return place / NAME
    if kept:
        return kept[-1]
    raise InputError(
        f"there is no density of a run in {place}, neither {NAME} nor a checkpoint: the folder of a run that "
        "solve(…, out=…) has written, or with checkpoint= leaves on its way, would be right"
    )


def _read(file: Path) -> GrownDensity:
    if checkpoints.NAME.fullmatch(file.name):
        header, arrays = members.read(file, "checkpoint", checkpoints.FORMAT, lambda: checkpoints.instead_of(file))
    else:
        header, arrays = members.read(file, "density of a run", FORMAT)
    if "body" not in header:
        raise InputError(
            f"{file} was left by an earlier growthx and does not know the mesh of its run: one that this growthx has "
            "left would be right"
        )
    return GrownDensity.from_numbers(header["body"], arrays)
