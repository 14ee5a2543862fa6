"""Where a run keeps what it finds, and what it goes on from: looked at before it costs time."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from numbers import Integral
from pathlib import Path
from typing import TYPE_CHECKING, Any

from growthx.common.checks import (
    require_flag,
    require_function,
    require_path,
)
from growthx.common.errors import InputError, shown
from growthx.post.derived import chosen_fields
from growthx.results import density
from growthx.results.checkpoints import find, is_part_of, on_first_rank
from growthx.results.folders import free_folder, new_folder
from growthx.results.states.choice import Choice, check_choice
from growthx.results.states.vtkhdf import require_h5py

if TYPE_CHECKING:
    from collections.abc import Sequence

    from mpi4py import MPI


@dataclass(frozen=True)
class Plan:
    """Where a run keeps what it finds.

    folder: for results and checkpoints, None if nowhere.  every: steps from one planned checkpoint to the next, None
    for none.  source: the checkpoint that the run goes on from.  refuge: a name for a folder, to be made for the last
    state where there is none.  states: those that are kept on the way.  vtkhdf: all of
    them in one file.  fields: names of the fields that are written, None for those that always are.
    """

    folder: Path | None = None
    every: int | None = None
    source: Path | None = None
    refuge: str | os.PathLike[str] | None = None
    states: Choice = field(default_factory=Choice)
    vtkhdf: bool = False
    fields: tuple[str, ...] | None = None

    @property
    def goes_on(self) -> bool:
        """Whether what was resumed is in the same folder."""
        there = self.folder is not None and self.source is not None
        return there and self.source.parent.resolve() == self.folder.resolve()  # type: ignore[union-attr]

    @property
    def keeps_start(self) -> bool:
        """Whether a checkpoint of the start is kept: what was resumed from the same folder is there already."""
        return self.folder is not None and self.every is not None and not self.goes_on

    def is_due(self, steps: int) -> bool:
        """Whether a planned checkpoint is to be kept after so many steps."""
        return self.folder is not None and self.every is not None and steps % self.every == 0

    def folder_for_last_state(self, comm: MPI.Comm) -> Path | None:
        """A new folder for a run without one; None if there is to be none, or can be none where nobody may write."""
        try:
            return None if self.refuge is None else free_folder(self.refuge, comm)
        except InputError:
            return None


def plan(
    out: str | os.PathLike[str] | None,
    every: int | None,
    resume: str | os.PathLike[str] | None,
    refuge: str | os.PathLike[str] | None,
    comm: MPI.Intracomm,
    states: Choice,
    vtkhdf: bool,
    fields: Sequence[str] | None = None,
) -> Plan:
    """The plan with its folder made and its checkpoint found (collective); same errors as `new_folder`, `find`."""
    source = None if resume is None else find(resume, comm)
    if out is not None and source is not None:
        on_first_rank(lambda: _check_not_ended(out, source), comm)
    folder = None if out is None else new_folder(out, comm, lambda file: is_part_of(file, source))
    places = Plan(folder, every, source, refuge, states, vtkhdf, None if fields is None else tuple(fields))
    if places.goes_on:
        on_first_rank(lambda: _check_same_files(places), comm)
    return places


def _check_not_ended(out: str | os.PathLike[str], checkpoint: Path) -> None:
    """Refuse to go on, in its own folder, with a run that has come to its end, as a script started once more would."""
    require_path(out, "the folder for results")
    folder = Path(out)
    if folder.resolve() == checkpoint.parent.resolve() and (folder / density.NAME).exists():
        raise InputError(
            f"the run in {folder} has ended, and its results stay as they are: to go on to a later end, a new folder, "
            "with this one to resume from, would be right"
        )


def _check_same_files(places: Plan) -> None:
    """Refuse to go on with one kind of files where there are others: each would have a part of the states."""
    there, here = (".pvd", "vtkhdf") if places.vtkhdf else (".vtkhdf", "files without vtkhdf")
    if places.folder is not None and (other := next(places.folder.glob(f"*{there}"), None)):
        raise InputError(
            f"the run that is resumed keeps its states in {other}, and {here} is asked for: the same would be right"
        )
    _check_same_fields(places)


def _check_same_fields(places: Plan) -> None:
    """Refuse to go on with other fields than those of which there are states, as the names of their files tell."""
    assert places.folder is not None
    suffix = ".vtkhdf" if places.vtkhdf else ".pvd"
    there = {name for name in ("fields", "raw", "points") if (places.folder / f"{name}{suffix}").exists()}
    choice = chosen_fields(places.fields)
    here = {"fields", "raw"} if choice is None else choice.files
    if there and there != here:
        asked = "the usual ones are" if choice is None else f"{', '.join(choice.names)} are"
        raise InputError(
            f"the run that is resumed keeps the states of its fields in {', '.join(sorted(there))} of {places.folder}, "
            f"and {asked} asked for: the same fields would be right"
        )


def check_plan(
    *,
    out: Any,
    watch: Any,
    checkpoint: Any,
    resume: Any,
    refuge: Any,
    every: Any,
    times: Any,
    frames: Any,
    vtkhdf: Any,
    fields: Any = None,
) -> None:
    """Refuse what a run cannot keep its results in, go on from, or tell of its steps."""
    for place, what in (
        (out, "the folder for results"),
        (resume, "the checkpoint to resume from"),
        (refuge, "the folder for the last state"),
    ):
        if place is not None:
            require_path(place, what)
    if watch is not None:
        require_function(watch, "watch", "a function of the result so far")
    if chosen_fields(fields) is not None and out is None:
        raise InputError(
            f"the fields {', '.join(fields)} are to be written, but nowhere: a folder to write to is needed"
        )
    check_choice(every, times, frames)
    require_flag(vtkhdf, "vtkhdf")
    if vtkhdf:
        require_h5py()
    for name, value in (("every", every), ("times", times), ("frames", frames), ("vtkhdf", vtkhdf or None)):
        if value is not None and out is None:
            raise InputError(
                f"states are to be kept by {name} = {shown(value)}, but nowhere: a folder to write to is needed"
            )
    if checkpoint is None:
        return
    if not isinstance(checkpoint, Integral) or isinstance(checkpoint, bool) or checkpoint < 1:
        raise InputError(
            f"checkpoints are to be kept every {shown(checkpoint)} steps: a whole number from 1 would be right"
        )
    if out is None:
        raise InputError(
            f"checkpoints are to be kept every {checkpoint} steps, but nowhere: a folder to write to is needed"
        )
