"""Files for ParaView that are whole or not there: each is looked at once written, and all move into place together.

DOLFINx says nothing when a disk is full: what it leaves is cut off.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from dolfinx.io import VTKFile

from growthx.common.errors import OutputError, raise_on_all

if TYPE_CHECKING:
    import dolfinx
    from mpi4py import MPI

HIDDEN = ".growthx-unfinished"  # folder for files that are not yet all there
END = b"</VTKFile>"
ORDER = (".vtu", ".pvtu", ".pvd", ".zip", ".csv")  # in which files appear: those that name others after them


@contextmanager
def agreed(folder: Path, comm: MPI.Comm) -> Iterator[None]:
    """Raise OutputError on all ranks if any of them cannot write to the folder (collective)."""
    problem = ""
    try:
        yield
    except (OSError, RuntimeError) as error:  # DOLFINx's are RuntimeErrors
        reason = (error.strerror if isinstance(error, OSError) else "") or str(error)
        place = folder.parent if folder.name == HIDDEN else folder
        problem = f"the results cannot be written to {place} ({reason}): a folder with room would be right"
    raise_on_all(comm, problem, OutputError)


@contextmanager
def aside(folder: Path, comm: MPI.Comm) -> Iterator[Path]:
    """A hidden folder inside the folder, whose files move to it at the end, if all went well (collective).

    Raises OutputError, on all ranks, if they cannot be written there; nothing of them stays then.
    """
    hidden = folder / HIDDEN
    try:
        with agreed(folder, comm):
            if comm.rank == 0:
                shutil.rmtree(hidden, ignore_errors=True)  # of a run that was killed
                hidden.mkdir(parents=True)
        yield hidden
        with agreed(folder, comm):
            if comm.rank == 0:
                _move(hidden, folder)
    except OutputError:  # which all ranks have met
        comm.barrier()  # none still writes
        if comm.rank == 0:
            shutil.rmtree(hidden, ignore_errors=True)
        comm.barrier()  # when a rank goes on, nothing is there
        raise


def _move(hidden: Path, folder: Path) -> None:
    """Move all files of the hidden folder up, over none that is there."""
    files = sorted(hidden.iterdir(), key=lambda file: (ORDER.index(file.suffix), file.name))
    for file in files:
        if (folder / file.name).exists():
            raise FileExistsError(0, f"{file.name} is there already")
        with file.open("rb") as content:
            os.fsync(content)  # what a slow disk or a quota refuses late shows here
    for file in files:
        file.rename(folder / file.name)
    hidden.rmdir()


class Series:
    """Functions of a mesh, one state after another in time, as files with a .pvd that names them all."""

    def __init__(self, file: Path, comm: MPI.Comm) -> None:
        """file: the .pvd, in a folder that exists."""
        self._path, self._comm = file, comm
        with agreed(file.parent, comm):
            self._file = VTKFile(comm, file, "w")

    def write(self, functions: list[dolfinx.fem.Function], time: float) -> None:
        """Append the functions at a time; OutputError, on all ranks, if a file does not become whole."""
        try:
            with agreed(self._path.parent, self._comm):
                before = self._own()
                self._file.write_function(functions, time)
                _check_whole(self._own() - before)
        except OutputError:
            del self._file
            raise

    def close(self) -> None:
        """Finish the files; errors as in `write`."""
        with agreed(self._path.parent, self._comm):
            # DOLFINx's file writes once more when it goes, so it must go now.
            del self._file
            if self._comm.rank == 0:
                _check_whole({self._path})

    def _own(self) -> set[Path]:
        """The files this rank has written, but for the .pvd."""
        stem, folder = self._path.stem, self._path.parent
        of_first = folder.glob(f"{stem}*.pvtu") if self._comm.rank == 0 else ()
        return {*folder.glob(f"{stem}_p{self._comm.rank}_*.vtu"), *of_first}


def _check_whole(files: set[Path]) -> None:
    """Raise OSError for a file without its end, or if there are none."""
    if not files:
        raise OSError(0, "files are missing")
    for file in sorted(files):
        with file.open("rb") as content:
            content.seek(0, os.SEEK_END)
            content.seek(max(0, content.tell() - 2 * len(END)))
            if not content.read().rstrip().endswith(END):
                raise OSError(0, f"{file.name} is cut off: the disk may be full")
