"""Folders for results, in which nothing is overwritten."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from growthx.common.checks import require_path
from growthx.common.errors import InputError
from growthx.results.series import HIDDEN

if TYPE_CHECKING:
    from collections.abc import Callable

    from mpi4py import MPI


def new_folder(
    path: str | os.PathLike[str], comm: MPI.Comm, beside: Callable[[Path], bool] = lambda file: False
) -> Path:
    """Make a folder for results, on all ranks; InputError if it holds anything already or cannot be written.

    beside: whether a file may be there already.

    Example:
        >>> from mpi4py import MPI
        >>> gx.results.new_folder("run", MPI.COMM_WORLD).name
        'run'
    """
    problem = ""
    require_path(path, "the folder for results")
    folder = Path(path)
    if comm.rank == 0:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            if not all(beside(file) for file in folder.iterdir() if file.name != HIDDEN):
                problem = f"the folder {folder} is not empty: a new or empty one would keep what is there"
            elif not os.access(folder, os.W_OK):
                problem = f"the folder {folder} is not writable: one you may write to would be right"
        except (OSError, ValueError) as error:  # ValueError: a name that no file may have
            reason = error.strerror if isinstance(error, OSError) else error
            problem = f"the folder {folder} cannot be made ({reason}): one you may write to would be right"
    if problem := comm.bcast(problem):
        raise InputError(problem)
    return folder


def free_folder(path: str | os.PathLike[str], comm: MPI.Comm) -> Path:
    """Make `path`, or the first of `path-2`, `path-3`, … that is new or empty, on all ranks.

    Example:
        >>> from mpi4py import MPI
        >>> gx.results.free_folder("run", MPI.COMM_WORLD).name
        'run'
    """
    require_path(path, "the folder for results")
    folder, count = Path(path), 1
    if comm.rank == 0:
        with suppress(OSError):  # which `new_folder` meets again
            while folder.is_dir() and any(folder.iterdir()):
                count += 1
                folder = Path(f"{path}-{count}")
    return new_folder(comm.bcast(folder), comm)
