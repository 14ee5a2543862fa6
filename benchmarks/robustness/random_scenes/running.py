"""One scene from its number to a row: made, run, checked, and what came of it in one word."""

from __future__ import annotations

import logging
import re
import time
import traceback
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

import growthx as gx
from benchmarks.robustness.random_scenes import check, scenes
from benchmarks.robustness.random_scenes.assembly import State
from benchmarks.robustness.random_scenes.model import Model
from benchmarks.robustness.random_scenes.program import program
from growthx.solvers.settings import NewtonSettings

if TYPE_CHECKING:
    from benchmarks.robustness.random_scenes.scenes import Trial
    from growthx.common.arrays import Floats, Indices
    from growthx.stepping.record import Step

MOST_STEPS = 300  # after which a scene is left where it is, and checked there

SOLVED, STOPPED, EARLY, REFUSED = "solved", "stopped", "ended early", "refused"
WRONG, TRACEBACK, CRASH, HANG = "wrong", "traceback", "crash", "hang"
FAILURES = (WRONG, TRACEBACK, CRASH, HANG)

# Of a run that ended early, by what its sentence says; the first one that is found counts.
EARLY_KINDS = {
    "no positive density balances": "no positive density",
    "between the nodes of the cell": "no positive density between nodes",
    "det F ≤ 0": "det F ≤ 0",
    "where no force resists": "a corner is crushed",
    "is not stable": "the balance is not stable",
    "no solution was found that continues": "no solution that continues the last state",
    "stagnates": "the residual stagnates",
    "estimated error": "the error of density is too large",
    "singular": "the linear system is singular",
    "linear system could not be solved": "the linear system could not be solved",
    "not a number": "the residual is not a number",
    "no part of a Newton step": "no part of a Newton step helps",
    "within its number of iterations": "Newton's method did not converge",
    "grows without bound": "the residual grows without bound",
}


@dataclass(frozen=True)
class Row:
    """What came of one scene.

    program: that ran it.  seconds: of the processor, without those of the C compiler; where it hung, of the clock.
    outcome: one of the words above; kind: of refusals, early ends and failures; sentence: as it was said.
    strain: nominal, of the loads.  quality: of the poorest cell.  momentum, balance, mass: see `check.Verdict`.
    """

    seed: int
    program: str
    recipe: str
    shape: str
    variant: str
    cells: int
    well_posed: int
    strain: float
    quality: float
    outcome: str
    kind: str
    steps: int
    rejected: int
    iterations: int
    momentum: float
    balance: float
    mass: float
    seconds: float
    sentence: str


@dataclass
class Watched:
    """A march as far as it got: its steps, and what was before the last one.

    old: densities then; base, length: what the last stage began with, and how long it was, in schemes with stages.
    """

    problem: Any
    steps: list[Step] = field(default_factory=list)
    old: Floats = field(default_factory=lambda: np.zeros(0))
    base: Floats = field(default_factory=lambda: np.zeros(0))
    length: float = 0.0
    motion: tuple[Floats, Floats] | None = None

    def go(self, march: Any) -> bool:
        """Take all steps, or as many as are allowed; whether it came to its end."""
        system = self.problem.system
        u, velocity = self._displacements()[0], 0.0 * self._displacements()[0]
        density = self.problem.density.x.array.copy()
        for step in march:
            self.old, self.motion = density, (u, velocity)
            now = self._displacements()[0]
            u, velocity = now, (now - u) / step.time_step
            density = system.state.accepted_density.copy()
            self.base, self.length = system.state.old_density.x.array.copy(), float(system.state.time_step.value)
            self.steps.append(step)
            if len(self.steps) == MOST_STEPS:
                march.close()
                return False
        return True

    def _displacements(self) -> list[Floats]:
        dim = self.problem.scene.mesh.dim
        return [each.x.array.reshape(-1, dim).copy() for each in self.problem.displacements]

    def state(self, scheme: gx.TimeScheme) -> State:
        """The last accepted one; of schemes with stages, the last stage is the step of implicit Euler."""
        step, euler = self.steps[-1], scheme is gx.IMPLICIT_EULER
        return State(
            u=np.array(self._displacements()),
            density=self.problem.density.x.array.copy(),
            old=self.old if euler else self.base,
            time_step=step.time_step if euler else self.length,
            share=step.load,
            motion=self.motion,
            lumped=self._lumped(),
        )

    def _lumped(self) -> Indices:
        """Cells in which the balance of mass of the last step was lumped."""
        nodes = self.problem.system.densities.lumped
        if nodes is None:
            return np.zeros(0, dtype=np.int32)
        marks = nodes.memory() > 0
        return np.flatnonzero(marks[self.problem.density_space.dofmap.list].any(axis=1)).astype(np.int32)


class _Log(logging.Handler):
    """What growthx's log says, in place of the terminal."""

    def __init__(self) -> None:
        super().__init__()
        self.sentences: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.sentences.append(record.getMessage())


def run(seed: int) -> Row:
    """The row of a number; no exception leaves it."""
    start, log, logger = time.process_time(), _Log(), logging.getLogger("growthx")
    logger.addHandler(log)
    found: dict[str, Any] = {"outcome": TRACEBACK, "kind": "", "sentence": ""}
    each: Trial | None = None
    try:
        each = scenes.trial(seed)
        found = _outcome(each, log)
    except gx.InputError as error:
        found = {"outcome": REFUSED, "kind": _refusal(str(error)), "sentence": str(error)}
    except Exception as error:
        where = traceback.extract_tb(error.__traceback__)[-1]
        kind = f"{type(error).__name__} in {where.name}"
        found = {"outcome": TRACEBACK, "kind": kind, "sentence": " ".join(str(error).split())}
    finally:
        logger.removeHandler(log)
    return row(seed, each, time.process_time() - start, **found)


def row(seed: int, each: Trial | None, seconds: float, **found: Any) -> Row:
    """The row of a scene, which there may be none of, with what was found."""
    told = {"recipe": "", "shape": "", "variant": "", "cells": 0, "well_posed": 0, "strain": 0.0, "quality": 0.0}
    if each is not None:
        told = {
            "recipe": each.recipe,
            "shape": each.body.shape,
            "variant": each.variant.name,
            "cells": len(each.body.cells),
            "well_posed": int(each.well_posed),
            "strain": each.strain,
            "quality": each.body.quality,
        }
    nothing = {"sentence": "", "steps": 0, "rejected": 0, "iterations": 0, "momentum": 0.0, "balance": 0.0, "mass": 0.0}
    return Row(**{"seed": seed, "program": program(), **told, **nothing, **found, "seconds": seconds})


def _outcome(each: Trial, log: _Log) -> dict[str, Any]:
    problem = gx.discretise(each.scene, each.variant)
    march = gx.march(
        each.scene,
        each.variant,
        problem,
        each.tolerance,
        stepping=each.stepping,
        full_newton=each.full_newton,
    )
    watched, start = Watched(problem), problem.density.x.array.copy()
    found: dict[str, Any] = {"outcome": STOPPED, "kind": "", "sentence": ""}
    try:
        if watched.go(march):
            found["outcome"] = SOLVED
    except gx.EndedEarly as ended:
        found = {"outcome": EARLY, "kind": early_kind(str(ended), each), "sentence": str(ended)}
    steps = watched.steps
    found.update(
        steps=len(steps),
        rejected=sum(step.rejected for step in steps),
        iterations=sum(step.newton_iterations for step in steps),
    )
    if not steps:
        return found
    settings = NewtonSettings(each.tolerance)
    tolerance = each.stepping.newton_tolerance(settings.tolerance)
    model = Model.of(problem, each.body)
    verdict = check.verdict(model, watched.state(each.stepping.scheme), steps[-1], tolerance, start)
    found.update(momentum=verdict.momentum, balance=verdict.balance, mass=verdict.mass)
    warned = next((each for each in log.sentences if "not to be trusted" in each), "")
    if verdict.wrong or warned:
        found.update(outcome=WRONG, kind=verdict.wrong or "the witness warned", sentence=warned or found["sentence"])
    return found


def early_kind(sentence: str, each: Trial) -> str:
    """Why a run ended early, in short."""
    kind = next((kind for part, kind in EARLY_KINDS.items() if part in sentence), "otherwise")
    if kind == "no positive density" and not each.variant.density.local:
        return "a nodal density reached zero"
    return kind


def _refusal(sentence: str) -> str:
    """A refusal without its numbers, names and places."""
    words = re.sub(r"'[^']*'", "'…'", sentence.partition(":")[0])
    return re.sub(r"\(?-?\d[\d.e+\-, ]*\)?", "…", words)[:80]
