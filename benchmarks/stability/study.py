"""What the parts of the stability benchmark share: bodies, marches and how they end, rows kept case by case."""

from __future__ import annotations

import csv
from collections.abc import Callable, Sequence
from dataclasses import astuple, dataclass, fields, replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from petsc4py import PETSc

import growthx as gx
from benchmarks.shared.integrals import rule
from benchmarks.shared.reporting import progress, read_rows
from growthx.common.memory import Memory
from growthx.meshing.sampling import cells_at, positions
from growthx.stepping.control import Halving

if TYPE_CHECKING:
    from growthx.common.arrays import Floats
    from growthx.discretisation.discretisation import Discretisation
    from growthx.discretisation.variants import Variant
    from growthx.stepping.control import StepControl, Stepping
    from growthx.stepping.record import Step

VARIANTS = tuple(variant.name for variant in gx.variants.suited("quadrilateral"))
LUMPED = tuple(variant.lumped(with_source=True) for variant in (gx.Q1Q1, gx.S2Q1))  # Remark 4.3


def named(name: str) -> Variant:
    """A discretisation of the catalogue, or a lumped one."""
    return next((variant for variant in LUMPED if variant.name == name), None) or gx.variants.named(name)


# -- bodies ------------------------------------------------------------------------------------------------------------

# Of the coarse meshes: cells along the bar and over the height of the plate, and the size of the femur's (mm).
BAR_CELLS, PLATE_CELLS, FEMUR_SIZE = 20, 6, 7.0


@dataclass(frozen=True)
class Body:
    """A benchmark scene on two nested meshes, and what its sizes are.

    scene: by the number of parts that each side of the coarse cells is split into.
    resorption: ρ*/(c Ψ₀*), the time in which unloaded material vanishes.
    """

    name: str
    scene: Callable[[int], gx.Scene]
    resorption: float


@cache
def _bar(refine: int) -> gx.Scene:
    """The discontinuous bar; in two rows where it is refined."""
    mesh = gx.meshing.read(gx.meshing.locate("bar.geo"), elements=BAR_CELLS, refine=refine)
    return replace(gx.scenes.bar(elements=BAR_CELLS), mesh=mesh, program=gx.Program(step=0.2, until=6.0, ramp=1.0))


@cache
def _plate(refine: int) -> gx.Scene:
    """The plate, for twice as long as unloaded material lasts."""
    return replace(gx.scenes.plate(PLATE_CELLS * refine), program=gx.Program(step=0.25, until=10.0, ramp=0.5))


@cache
def _femur(refine: int) -> gx.Scene:
    """The femur."""
    return gx.scenes.femur(size=FEMUR_SIZE, refine=refine)


BODIES = {
    "bar": Body("bar", _bar, 0.5),
    "plate": Body("plate", _plate, 5.0),
    "femur": Body("femur", _femur, 120.0),
}


def with_exponents(scene: gx.Scene, n: float, m: float, **growth: Any) -> gx.Scene:
    """The same with other exponents of density, and what else of the growth law is to change."""
    return replace(
        scene,
        material=replace(scene.material, density_exponent=n),
        growth=replace(scene.growth, exponent=m, **growth),
    )


@dataclass(frozen=True)
class BodyCase:
    """A body and a discretisation."""

    body: str
    variant: str


# -- steps that become longer ------------------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class LengtheningSteps(gx.FixedSteps):
    """Steps of the length `loading` up to the time `loaded`, then the program's step, each `factor` times the last."""

    loading: float
    loaded: float
    factor: float = 1.0

    def control(self, program: gx.Program) -> StepControl:
        """What chooses the steps of one run."""
        return _Lengthening(program, self)


class _Lengthening(Halving):
    """Of steps that become longer, all or a share."""

    def __init__(self, program: gx.Program, stepping: LengtheningSteps) -> None:
        super().__init__(program)
        self._stepping, self._step = stepping, program.step

    def targets(self) -> Floats:
        return np.array([self._stepping.loaded, self._program.until])

    def end(self, time: float, target: float) -> float:
        step = self.cut * (self._stepping.loading if target == self._stepping.loaded else self._step)
        return target if time + step > target - 1e-6 * step else time + step

    def accepts(self, time_step: float, error: float) -> bool:
        if time_step >= self._step * (1 - 1e-9):
            self._step *= self._stepping.factor
        return super().accepts(time_step, error)

    def memory(self) -> Memory:
        memory = super().memory()
        memory.numbers["step"] = self._step
        return memory

    def recall(self, memory: Memory) -> None:
        super().recall(memory)
        self._step = memory.numbers["step"]


INSTANT = 1e-9  # of the time of resorption: loads that come in so short a time find the initial density
LOAD_STEPS = 10


def at_once(scene: gx.Scene, body: Body, step: float, count: int) -> tuple[gx.Scene, LengtheningSteps]:
    """The scene under full load from the start, for a count of steps of that length."""
    ramp = INSTANT * body.resorption
    program = gx.Program(step=step, until=ramp + count * step, ramp=ramp)
    return replace(scene, program=program), LengtheningSteps(loading=ramp / LOAD_STEPS, loaded=ramp)


AT_REST = 1e-10  # of unloaded resorption: a rate of density that counts as none
LAST = 1e3  # times of resorption after which a march is over, at rest or not


def to_rest(scene: gx.Scene, body: Body, loaded: float) -> tuple[gx.Scene, LengtheningSteps]:
    """The scene until its density rests, in steps that double from the time at which it is loaded."""
    program = replace(scene.program, step=body.resorption / 5, until=loaded + LAST * body.resorption)
    stepping = LengtheningSteps(loading=scene.program.step, loaded=loaded, factor=2.0, equilibrium=AT_REST)
    return replace(scene, program=program), stepping


# -- marches -----------------------------------------------------------------------------------------------------------

FINISHED = "finished"
EMPTIED = "a density reached zero"
STUCK = "no convergence"
INVERTED = "det F ≤ 0"
UNSTABLE = "a balance that is not stable"
CRASHED = "an error of PETSc's"
ENDLESS = "ever shorter steps"
PATIENCE = 600  # steps and failed attempts at some


@dataclass
class March:
    """How a run went: how it ended, when, and after how many steps and failed attempts.

    lumped: steps in which the balance of mass was lumped somewhere.  cells: largest share of the cells where it was.
    """

    problem: Discretisation
    ended: str = FINISHED
    why: str = ""
    time: float = 0.0
    steps: int = 0
    rejected: int = 0
    lumped: int = 0
    cells: float = 0.0

    @property
    def finished(self) -> bool:
        """Whether it came to its end."""
        return self.ended == FINISHED


def march(
    scene: gx.Scene,
    variant: Variant,
    *,
    stepping: Stepping | None = None,
    problem: Discretisation | None = None,
    tolerance: float = 1e-10,
    patience: int = PATIENCE,
    watch: Callable[[Step, Discretisation], None] = lambda step, problem: None,
) -> March:
    """March through a scene's program, to its end or to where that is impossible; the last good state is kept.

    patience: steps and failed attempts after which it counts as endless.
    """
    problem = gx.discretise(scene, variant) if problem is None else problem
    result = March(problem)
    steps = gx.march(scene, variant, problem, tolerance, stepping=stepping)
    try:
        for step in steps:
            result.time, result.steps = step.time, result.steps + 1
            result.rejected += step.rejected
            result.lumped += step.lumped_cells > 0
            result.cells = max(result.cells, step.lumped_cells / scene.mesh.cell_count)
            watch(step, problem)
            if result.steps + result.rejected > patience:
                result.ended = ENDLESS
                break
    except gx.EndedEarly as ended:
        result.why = str(ended)
        result.ended = _kind(result.why)
    except PETSc.Error as error:
        result.ended, result.why = CRASHED, str(error)
        problem.system.reject_step()
    finally:
        steps.close()
    return result


def _kind(reason: str) -> str:
    for part, kind in (("no positive density", EMPTIED), ("det F", INVERTED), ("not stable", UNSTABLE)):
        if part in reason:
            return kind
    return STUCK


# -- what is compared --------------------------------------------------------------------------------------------------


def cell_means(problem: Discretisation) -> tuple[Floats, Floats]:
    """Mean density and volume of each cell, of any discretisation, both of shape (cells,)."""
    X, volumes = rule(problem.scene.mesh, problem.variant.momentum_degree)
    return (problem.density_at(X) * volumes).sum(axis=1) / volumes.sum(axis=1), volumes.sum(axis=1)


def means_over(coarse: gx.Mesh, fine: gx.Mesh, means: Floats, volumes: Floats) -> Floats:
    """Means over coarse cells of what the finer cells nested in them have."""
    middle = np.full((1, 2), 0.5)
    parents, _ = cells_at(coarse, positions(fine, middle)[:, 0, :2])
    total, whole = (np.bincount(parents, each) for each in (means * volumes, volumes))
    return np.asarray(total / whole)


def share(problem: Discretisation, marks: Callable[[Floats], Any]) -> float:
    """Share of the volume whose densities are marked."""
    dofs, volumes = problem.growing_dofs, problem.volumes
    return float(volumes[dofs] @ marks(problem.density.x.array[dofs]) / volumes[dofs].sum())


# -- rows that are kept ------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Part:
    """A part of the benchmark: its cases, and the rows that each of them gives, which begin with the case's fields."""

    name: str
    row: type
    cases: Callable[[], Sequence[Any]]
    run: Callable[[Any], list[Any]]

    def file(self, folder: Path) -> Path:
        """Where its rows are."""
        return folder / f"stability_{self.name}.csv"

    def rows(self, folder: Path) -> list[Any]:
        """What is known, in the order of the cases."""
        order = {astuple(case): number for number, case in enumerate(self.cases())}
        known = [row for row in read_rows(self.file(folder), self.row) if self._case(row, order) in order]
        return sorted(known, key=lambda row: order[self._case(row, order)])

    def complete(self, folder: Path, again: bool) -> None:
        """Run what is missing; the rows of each case are on disk as soon as it is done."""
        path = self.file(folder)
        if again:
            path.unlink(missing_ok=True)
        known = {astuple(row) for row in read_rows(path, self.row)}
        missing = [
            case for case in self.cases() if not any(row[: len(astuple(case))] == astuple(case) for row in known)
        ]
        with progress(f"{self.name:12}", len(missing)) as announce:
            for case in missing:
                announce(", ".join(f"{each}" for each in astuple(case)))
                append_rows(path, self.run(case))

    def _case(self, row: Any, order: dict[Any, int]) -> Any:
        return astuple(row)[: len(next(iter(order)))]


def append_rows(path: Path, rows: Sequence[Any]) -> None:
    """Add dataclasses of numbers and texts to a CSV file with a column for each field."""
    path.parent.mkdir(parents=True, exist_ok=True)
    new = not path.exists()
    with path.open("a", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        if new:
            writer.writerow([each.name for each in fields(rows[0])])
        writer.writerows(map(astuple, rows))
