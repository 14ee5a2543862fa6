"""Files for ParaView that are whole or not there, as all ranks agree."""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from growthx.common.errors import OutputError, raise_on_all
from growthx.results.states import vtkhdf, vtu

if TYPE_CHECKING:
    from mpi4py import MPI

    from growthx.results.states.grid import Grid, State

HIDDEN = ".growthx-unfinished"  # folder for files that are not yet all there
ORDER = (".vtu", ".pvtu", ".pvd", ".vtkhdf", ".zip", ".csv")  # in which files appear: those that name others after them
SAME = 1e-9  # relative, of times


@contextmanager
def agreed(folder: Path, comm: MPI.Comm) -> Iterator[None]:
    """Raise OutputError on all ranks if any of them cannot write to the folder (collective)."""
    problem = ""
    try:
        yield
    except (OSError, RuntimeError) as error:  # HDF5's are RuntimeErrors
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
            os.fsync(content)
    for file in files:
        file.rename(folder / file.name)
    hidden.rmdir()


@dataclass(frozen=True)
class Keeping:
    """How a series is kept.

    until: go on with the states up to this time of a series that is there, if one is; None: there is to be none.
    vtkhdf: in one file in HDF5, whose name ends so; else in a file for each time and rank, and a .pvd that names them.
    fields: names of those that are kept, see `growthx.solve`; None: those that are told without being asked for.
    """

    until: float | None = None
    vtkhdf: bool = False
    fields: Sequence[str] | None = None


def open_series(file: Path, grid: Grid, comm: MPI.Intracomm, keeping: Keeping | None = None) -> Series | SeriesInOne:
    """A series under the name of its .pvd, in a folder that exists (collective)."""
    keeping = keeping or Keeping()
    return (SeriesInOne if keeping.vtkhdf else Series)(file, grid, comm, keeping.until)


class Series:
    """States on one grid, one after another in time, as files with a .pvd that names them all.

    The .pvd is written anew, in one go, when all of a state is there: whoever reads it, or kills the run, finds whole
    states, all but the one that was being written.
    """

    def __init__(self, file: Path, grid: Grid, comm: MPI.Intracomm, until: float | None = None) -> None:
        """file: the .pvd, in a folder that exists.  until: see `Keeping`."""
        self._path, self._comm, self._part = file, comm, vtu.Part(grid)
        self._entries: list[tuple[float, str]] = []
        self._written: Path | None = None
        with agreed(file.parent, comm):
            if until is not None and comm.rank == 0 and file.exists():
                self._go_on(until)
        self._entries = comm.bcast(self._entries)
        self._goes_on = until is not None

    @property
    def last(self) -> float | None:
        """The time of the last state, None if there is none."""
        return self._entries[-1][0] if self._entries else None

    @property
    def written(self) -> Path | None:
        """This rank's file of the last state, None where this series has written none yet."""
        return self._written

    def write(self, state: State, time: float, twin: Path | None = None) -> None:
        """Append a state; OutputError, on all ranks, if it does not become whole, and nothing of it stays.

        twin: a file of this rank that has all of it, and maybe more: it gets a second name.
        """
        comm, folder, stem, number = self._comm, self._path.parent, self._path.stem, len(self._entries)
        parts = [folder / f"{stem}_p{rank}_{number:06d}.vtu" for rank in range(comm.size)]
        joint = folder / f"{stem}{number:06d}.pvtu"
        entries = [*self._entries, (float(time), joint.name)]
        made: list[Path] = []
        try:
            with agreed(folder, comm):
                if twin is None:
                    vtu.write_whole(parts[comm.rank], self._part.content(state, float(time)))
                else:
                    _twin_of(twin, parts[comm.rank])
                made.append(parts[comm.rank])
            with agreed(folder, comm):
                if comm.rank == 0:
                    vtu.write_whole(joint, [vtu.joined(state, [part.name for part in parts]).encode()])
                    made.append(joint)
                    over = bool(self._entries) or self._goes_on
                    vtu.write_whole(self._path, [vtu.listed(entries).encode()], over=over)
        except OutputError:
            for file in made:
                file.unlink(missing_ok=True)
            raise
        self._entries, self._written = entries, parts[comm.rank]

    def close(self) -> None:
        """Finish the files, which are whole after each state."""

    def _go_on(self, until: float) -> None:
        """Keep the states up to a time, and remove those after it, which are to come once more."""
        found = vtu.entries(self._path)
        self._entries = [entry for entry in found if entry[0] <= until * (1 + SAME)]
        if len(self._entries) < len(found):
            vtu.write_whole(self._path, [vtu.listed(self._entries).encode()], over=True)
        for file in self._path.parent.iterdir():
            name = file.name.removeprefix(".").removesuffix(".part")  # of one that was not finished, too
            number = re.fullmatch(rf"{self._path.stem}(?:_p\d+_)?(\d{{6,}})\.p?vtu", name)
            if number and int(number[1]) >= len(self._entries):
                file.unlink()


class SeriesInOne:
    """States on one grid, one after another in time, all in one file in HDF5.

    It is whole whenever it is read or the run is killed: a second file beside it, one state behind, gets that one and
    the next, and becomes the first; that becomes the second, unless somebody still reads it.
    """

    def __init__(self, file: Path, grid: Grid, comm: MPI.Intracomm, until: float | None = None) -> None:
        """See `Series`; .vtkhdf takes the place of the .pvd."""
        self._path, self._comm = file.with_suffix(".vtkhdf"), comm
        name = f".{self._path.name}"
        self._next, self._before = file.with_name(f"{name}.part"), file.with_name(name)
        self._grids: list[Grid] = comm.gather(grid) or []
        self._behind: tuple[list[State], float] | None = None  # what the second file lacks
        times: list[float] = []
        with agreed(file.parent, comm):
            if comm.rank == 0:
                self._clear()
                if self._path.exists():
                    times = self._go_on(until)
        self._times: list[float] = comm.bcast(times)

    @property
    def last(self) -> float | None:
        """The time of the last state, None if there is none."""
        return self._times[-1] if self._times else None

    def write(self, state: State, time: float) -> None:
        """Append a state; OutputError, on all ranks, if it does not become whole, and nothing of it stays."""
        states = self._comm.gather(state)
        with agreed(self._path.parent, self._comm):
            if states is not None:
                self._append(states, float(time))
        self._times.append(float(time))

    def close(self) -> None:
        """Remove the second file."""
        if self._comm.rank == 0:
            self._clear()

    def _append(self, states: list[State], time: float) -> None:
        try:
            self._catch_up()
            vtkhdf.append(self._next, states, time)
            if self._times:
                _second_name(self._path, self._before)
            self._next.replace(self._path)
            if self._times:
                self._before.replace(self._next)
        except OSError:
            self._clear()
            raise
        self._behind = states, time

    def _catch_up(self) -> None:
        """Have a second file with all that the first one has."""
        if self._behind is not None and self._next.exists():
            try:
                vtkhdf.append(self._next, *self._behind)
                return
            except OSError:  # somebody has had it open since it was the first: it stays as they see it
                self._next.unlink()
        if self._times:
            shutil.copyfile(self._path, self._next)
        else:
            vtkhdf.begin(self._next, self._grids)

    def _go_on(self, until: float | None) -> list[float]:
        """The times up to that one, and no others in the file any more."""
        if until is None:
            raise FileExistsError(0, f"{self._path.name} is there already")
        found = vtkhdf.times(self._path)
        kept = [time for time in found if time <= until * (1 + SAME)]
        if len(kept) < len(found):
            shutil.copyfile(self._path, self._next)
            vtkhdf.cut(self._next, len(kept))
            self._next.replace(self._path)
        return kept

    def _clear(self) -> None:
        for file in (self._next, self._before):
            file.unlink(missing_ok=True)


def _second_name(file: Path, name: Path) -> None:
    """Have a file under another name, too; where that cannot be, a copy of it."""
    try:
        name.hardlink_to(file)
    except OSError:
        shutil.copyfile(file, name)


def _twin_of(file: Path, name: Path) -> None:
    """The same under a name that is not there yet; OSError if that cannot be, and then it is not there."""
    try:
        name.hardlink_to(file)
    except FileExistsError:
        raise
    except OSError:  # of a file system without such names
        vtu.write_whole(name, [file.read_bytes()])
