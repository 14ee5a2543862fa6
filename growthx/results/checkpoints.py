"""Checkpoints: a run's state and history in a file, from which another run goes on as if nothing had happened.

A file is NumPy's .npz: arrays in an order that does not depend on the number of ranks, a header in JSON and the SHA-256
of both.  It is written aside and renamed: under its name there is never a part of one.
"""

from __future__ import annotations

import logging
import os
import re
from dataclasses import asdict, dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from growthx.common.errors import GrowthxError, InputError, OutputError
from growthx.common.memory import Memory
from growthx.discretisation.transfers.grown import gathered
from growthx.fem.numbering import Numbering
from growthx.results import members
from growthx.results.fingerprint import WRITER
from growthx.results.identity import difference
from growthx.results.series import HIDDEN
from growthx.solvers.report import NewtonReport
from growthx.stepping.record import Cost, Step

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from mpi4py import MPI

    from growthx.common.arrays import Floats
    from growthx.discretisation.discretisation import Discretisation

FORMAT = 2  # 1 said nothing of the code of laws
KEPT = 2  # planned files that stay: the last one, and the one before if the last is damaged
PLANNED, INTERRUPTED = "checkpoint", "interrupted"  # first words of the names
NAME = re.compile(rf"({PLANNED}|{INTERRUPTED})-(\d+)\.npz")
# What else a run leaves on its way, before it is at its end.
BESIDE = re.compile(r"history\.csv|(fields|raw|points)(\.pvd|\.vtkhdf|\d{6,}\.pvtu|_p\d+_\d{6,}\.vtu)")
ARRAYS = [part.name for part in fields(Memory) if part.name != "numbers"]


def is_part_of(file: Path, checkpoint: Path | None) -> bool:
    """Whether a file is what a run leaves beside a checkpoint until it has ended: others, its history and states."""
    name = file.name.removeprefix(".").removesuffix(".part")
    ours = NAME.fullmatch(name) or BESIDE.fullmatch(name) or file.name == HIDDEN
    return bool(ours) and checkpoint is not None and file.parent.resolve() == checkpoint.parent.resolve()


def find(path: str | os.PathLike[str], comm: MPI.Intracomm) -> Path:
    """The checkpoint that a file means, or a folder (collective); InputError if there is none.

    Of a folder: the last planned one, which repeats an uninterrupted run to the bit, or else the last of an
    interruption.
    """
    place = Path(path)

    def look() -> Path:
        found = in_folder(place) if place.is_dir() else [place] if place.is_file() else []
        if not found:
            raise InputError(
                f"there is no checkpoint in {place}: a file that a run has left, or its folder, would be right"
            )
        return found[-1]

    return on_first_rank(look, comm)


class Checkpoints:
    """Writes and reads the checkpoints of one problem."""

    def __init__(self, problem: Discretisation, identity: Callable[[], Memory]) -> None:
        """identity: of the run, see `identity.identity`, to be found when it is needed."""
        self._problem, self._find_identity, self._comm = problem, identity, problem.comm
        self._numberings: dict[str, Numbering] = {}

    @cached_property
    def _identity(self) -> Memory:
        return self._find_identity()

    def save(self, folder: Path, kind: str, memory: Memory, steps: Sequence[Step], costs: Sequence[Cost] = ()) -> Path:
        """Write a state and the steps up to it (collective); returns the file, named by the number of steps.

        kind: `PLANNED`, of which the last ones are kept, or `INTERRUPTED`.
        Raises OutputError if it cannot be written; what was there before stays.
        """
        file = folder / f"{kind}-{len(steps):06d}.npz"
        header = {"format": FORMAT, "state": memory.numbers, "scene": self._identity.numbers}
        header["steps"] = [asdict(step) for step in steps]
        header["costs"] = [[cost.wall_s, cost.peak_memory] for cost in costs]
        arrays = {**self._gather("state", memory), **self._gather("scene", self._identity)}
        if grown := gathered(self._problem):  # for runs on other meshes, which cannot resume this one
            header["body"], of_body = grown.as_numbers()
            arrays |= of_body

        def write() -> None:
            try:
                members.write(file, header, arrays)
                planned = [other for other in in_folder(folder) if other.name.startswith(PLANNED)]
                for old in planned[:-KEPT]:
                    old.unlink()
            except OSError as error:
                raise OutputError(
                    f"the checkpoint {file} cannot be written ({error.strerror}): a folder with room would be right"
                ) from error

        on_first_rank(write, self._comm)
        return file

    def load(self, file: Path) -> tuple[Memory, list[Step], list[Cost]]:
        """The state in a file, the steps up to it and what they cost (collective).

        Raises InputError if it is damaged, or of another format or run.
        """
        here = {**self._identity.numbers, **self._gather("scene", self._identity)}
        content: list[_Content] = []

        def read() -> tuple[dict[str, Any], list[str], list[dict[str, Any]], list[list[float]]]:
            found = _read(file)
            if apart := difference({**found.scene, **found.arrays_of("scene")}, here):
                raise InputError(
                    f"the checkpoint {file} is of another run, where {apart}: "
                    "the same scene, discretisation and time steps would be right"
                )
            if found.scene[WRITER] != here[WRITER]:
                logging.getLogger("growthx").warning(
                    "growthx: the checkpoint %s was left under UFL %s, here it is %s: laws of one's own are compared "
                    "by their values at sample states alone",
                    file,
                    found.scene[WRITER],
                    here[WRITER],
                )
            content.append(found)
            return found.state, list(found.arrays_of("state")), found.steps, found.costs

        numbers, names, steps, costs = on_first_rank(read, self._comm)
        memory = Memory(numbers)
        for name in names:
            _, kind, own = name.split("/")
            whole = content[0].arrays[name] if content else None
            getattr(memory, kind)[own] = self._numbering(kind).scatter(whole)
        return memory, list(map(_as_step, steps)), [Cost(*cost) for cost in costs]

    def _gather(self, what: str, memory: Memory) -> dict[str, Floats]:
        """All arrays by "what/kind/name" on rank 0, nothing elsewhere (collective)."""
        found = {}
        for kind in ARRAYS:
            for name, local in getattr(memory, kind).items():
                whole = self._numbering(kind).gather(local)
                if whole is not None:
                    found[f"{what}/{kind}/{name}"] = whole
        return found

    def _numbering(self, kind: str) -> Numbering:
        if kind not in self._numberings:
            problem = self._problem
            spaces = {
                "unknowns": problem.system.unknown.function_space,
                "densities": problem.density_space,
                "displacements": problem.displacement_space,
            }
            self._numberings[kind] = Numbering(spaces[kind])
        return self._numberings[kind]


@dataclass(frozen=True)
class _Content:
    """What a file holds."""

    state: dict[str, Any]
    scene: dict[str, Any]
    steps: list[dict[str, Any]]
    costs: list[list[float]]
    arrays: dict[str, Floats]

    def arrays_of(self, what: str) -> dict[str, Floats]:
        return {name: array for name, array in self.arrays.items() if name.startswith(f"{what}/")}


def on_first_rank(task: Callable[[], Any], comm: MPI.Intracomm) -> Any:
    """What a task returns on rank 0, on all ranks; its errors are raised on all of them."""
    answer, problem = None, None
    if comm.rank == 0:
        try:
            answer = task()
        except GrowthxError as error:
            problem = error
    answer, problem = comm.bcast((answer, problem))
    if problem is not None:
        raise problem
    return answer


def in_folder(folder: Path) -> list[Path]:
    """The checkpoints in a folder, those of interruptions first, the last planned one last."""
    found = [
        (match[1] == PLANNED, int(match[2]), file) for file in folder.iterdir() if (match := NAME.fullmatch(file.name))
    ]
    return [file for _, _, file in sorted(found)]


def _read(file: Path) -> _Content:
    """What a file holds; InputError if it is no checkpoint, damaged, or of another format."""
    header, arrays = members.read(file, "checkpoint", FORMAT, lambda: instead_of(file))
    costs = header.get("costs", [])  # of an earlier growthx there are none
    return _Content(header["state"], header["scene"], header["steps"], costs, arrays)


def instead_of(file: Path) -> str:
    """Which other checkpoint there is beside a damaged one, as the end of a sentence."""
    others = [other for other in in_folder(file.parent) if other != file]
    return f": to resume {others[-1]} would be right" if others else ": another checkpoint would be right"


def _as_step(values: dict[str, Any]) -> Step:
    newton = {**values["newton"], "residual_norms": tuple(values["newton"]["residual_norms"])}
    reactions = {name: np.array(force) for name, force in values["reactions"].items()}
    return Step(**{**values, "newton": NewtonReport(**newton), "reactions": reactions})
