"""Error against run time: all discretisations of quadrilaterals on several meshes, with fixed and adaptive time steps.

    ./run python benchmarks/error_vs_runtime.py [--scenes bar plate femur] [--again]

Two studies.  The first runs bar, plate and femur with every discretisation, mesh and way through time, and measures the
final state against an over-resolved one: which choices lie on the Pareto front of error and time?  The second keeps
mesh and discretisation, measures the error of time integration alone and compares adaptive steps with the paper's
scheme at equal error.  Rows of the CSV files are not run again; every group of runs is kept as soon as it is done.
`--quick` is a rehearsal on coarse meshes and wants a folder of its own, `--out`.

Times are those of solving, without set-up and compilation, as ratios to a run of the same scene measured in turn with
them; the seconds of that run are on the terminal.  Leaves error_vs_runtime.md, .png, .csv, _references.csv and
_stepping.csv in benchmarks/results.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import astuple, dataclass, replace
from functools import cache
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Any, TypeVar

import basix
import numpy as np
from mpi4py import MPI
from reporting import RESULTS, Table, progress, read_rows, write_rows

import growthx as gx
from growthx.sampling import locate, positions, volume_ratios
from growthx.variants import suited

if TYPE_CHECKING:
    from growthx.arrays import Floats
    from growthx.discretisation import Discretisation
    from growthx.stepping import Stepping

VARIANTS = tuple(variant.name for variant in suited("quadrilateral"))
LONG = 3.0  # seconds of one setting after which it is not run again: long runs scatter less
EULER, TR_BDF2, ADAPTIVE = "implicit Euler", "TR-BDF2", "adaptive"
Name = TypeVar("Name")

ROWS, REFERENCES, STEPPING = (f"error_vs_runtime{part}.csv" for part in ("", "_references", "_stepping"))


# -- scenes ------------------------------------------------------------------------------------------------------------


def bar(elements: int, until: float = 6.0) -> gx.Scene:
    """The bar with discontinuous stimulus; beyond 100 elements its cells stay square, in several rows."""
    rows = max(1, elements // 100)
    scene = gx.scenes.bar(elements=elements // rows, until=until)
    if rows == 1:
        return scene
    bar_geo = gx.meshing.locate("bar.geo")
    return replace(scene, mesh=gx.meshing.read(bar_geo, elements=elements // rows, refine=rows))


def femur(refine: int) -> gx.Scene:
    """The femur, each of its 658 cells split into refine × refine."""
    return gx.scenes.femur(refine=refine)


@dataclass(frozen=True)
class Run:
    """A discretisation on a mesh; adaptive steps of that tolerance where it is a reference."""

    variant: str
    mesh: int
    tolerance: float

    def __str__(self) -> str:
        return f"{self.variant}, mesh {self.mesh}, {self.tolerance:g}"


@dataclass(frozen=True)
class Plan:
    """What is run of a scene in the first study.

    unit: what the mesh numbers count.  linear, quadratic: meshes for displacements of that degree.
    clock: the mesh of the run that others are measured in: Q1P0 with the program's fixed steps.
    first, second: references; the second, of another kind, shows how good the first is.
    """

    name: str
    scene: Callable[[int], gx.Scene]
    unit: str
    linear: tuple[int, ...]
    quadratic: tuple[int, ...]
    clock: int
    first: Run
    second: Run

    def meshes(self, variant: str) -> tuple[int, ...]:
        """The meshes for a discretisation."""
        return self.linear if gx.variants.named(variant).displacement.degree == 1 else self.quadratic


PLANS = (
    Plan(
        "bar",
        cache(bar),
        "cells along the bar",
        (10, 20, 40, 100, 200),
        (10, 20, 40, 100),
        40,
        Run("S2fri", 600, 1e-4),
        Run("Q2", 600, 1e-3),
    ),
    Plan(
        "plate",
        cache(gx.scenes.plate),
        "cells over the height",
        (8, 16, 32, 64),
        (4, 8, 16, 32),
        16,
        Run("S2fri", 96, 1e-5),
        Run("Q2", 96, 1e-4),
    ),
    Plan(
        "femur",
        cache(femur),
        "parts of each side of 658 cells",
        (1, 2, 3),
        (1, 2),
        1,
        Run("S2fri", 6, 1e-4),
        Run("Q2", 5, 1e-3),
    ),
)
QUICK = (
    replace(
        PLANS[0], linear=(10, 20), quadratic=(10,), clock=10, first=Run("S2fri", 200, 1e-3), second=Run("Q2", 200, 1e-2)
    ),
    replace(PLANS[1], linear=(4, 8), quadratic=(4,), clock=8, first=Run("S2fri", 24, 1e-4), second=Run("Q2", 24, 1e-3)),
    replace(PLANS[2], linear=(1,), quadratic=(1,), clock=1, first=Run("S2fri", 3, 1e-3), second=Run("Q2", 2, 1e-2)),
)


# -- ways through time -------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Way:
    """A scheme, and its number of steps in the load ramp, which go on to the end, or its tolerance."""

    scheme: str
    setting: float

    def through(self, scene: gx.Scene) -> tuple[gx.Scene, Stepping]:
        """The scene with its steps: the ramp stays as it is, and steps end where it does."""
        if self.scheme == ADAPTIVE:
            return scene, gx.AdaptiveSteps(self.setting)
        program = replace(scene.program, step=scene.program.ramp / self.setting)
        scheme = gx.TR_BDF2 if self.scheme == TR_BDF2 else gx.IMPLICIT_EULER
        return replace(scene, program=program), gx.FixedSteps(scheme=scheme)

    def __str__(self) -> str:
        return f"{self.scheme}, {self.setting:.1e}" if self.scheme == ADAPTIVE else f"{self.scheme}, {self.setting:g}"


WAYS = (
    *(Way(EULER, parts) for parts in (1, 2, 5)),
    *(Way(TR_BDF2, parts) for parts in (1, 2)),
    *(Way(ADAPTIVE, tolerance) for tolerance in (3e-2, 1e-2, 1e-3)),
)


def solve(scene: gx.Scene, variant: str, way: Way, **options: Any) -> gx.Result:
    """Run a scene to its end, or to where a step cannot be solved; options as of `growthx.solve`."""
    timed, stepping = way.through(scene)
    try:
        return gx.solve(timed, gx.variants.named(variant), **{"stepping": stepping, **options})
    except gx.RunEndedEarly as ended:
        return ended.result


@dataclass(frozen=True)
class Work:
    """What a run took: accepted steps, and Newton iterations, residuals and factorisations in them."""

    steps: int
    iterations: int
    residuals: int
    factorisations: int


def work(result: gx.Result) -> Work:
    """Counts of a run."""
    reports = [step.newton for step in result.steps]
    names = ("iterations", "residuals", "factorisations")
    return Work(len(reports), *(sum(getattr(report, name) for report in reports) for name in names))


def in_turn(
    runs: dict[Name, Callable[[], gx.Result]], repeats: int, look: Callable[[Name, gx.Result], None]
) -> dict[Name, list[float]]:
    """Seconds of solving of several runs, round by round, so that what else happens meets all.

    A rehearsal, which compiles, comes before; its results are looked at.  Where it was long, it counts as the only one.
    """
    seconds: dict[Name, list[float]] = {}
    for name, run in runs.items():
        result = run()
        look(name, result)
        seconds[name] = [result.solve_s]
    short = [name for name, (rehearsal,) in seconds.items() if rehearsal < LONG]
    seconds.update({name: [] for name in short})
    for _ in range(repeats):
        for name in short:
            seconds[name].append(runs[name]().solve_s)
    return seconds


# -- errors ------------------------------------------------------------------------------------------------------------


class Reference:
    """An over-resolved final state that is read anywhere in the body."""

    def __init__(self, plan: Plan, run: Run) -> None:
        self._problem = solve(plan.scene(run.mesh), run.variant, Way(ADAPTIVE, run.tolerance)).problem

    def density(self, places: Floats) -> Floats:
        """By the polynomial through the integration points of each cell, which are where its density is most exact."""
        space = self._problem.density_space
        points = space.ufl_element().custom_quadrature()[0]
        cells, X = locate(self._problem.scene.mesh, places)
        if (cells < 0).any():
            raise gx.GrowthxError(f"{np.sum(cells < 0)} points of a mesh lie outside the reference's")
        shares = monomials(X, len(points)) @ np.linalg.inv(monomials(points, len(points)))
        return np.einsum("pd,pd->p", shares, self._problem.density.x.array[space.dofmap.list[cells]])

    def displacement(self, places: Floats) -> Floats:
        """As it is."""
        return self._problem.sample_displacement(places)


def monomials(X: Floats, count: int) -> Floats:
    """xⁱ yʲ at points, as many as a tensor rule has points, shape (points, count)."""
    powers = range(math.isqrt(count))
    return np.column_stack([X[:, 0] ** i * X[:, 1] ** j for i in powers for j in powers])


@dataclass(frozen=True)
class Errors:
    """Of a final state, relative: of density and displacement in L², at the integration points of the momentum.

    density_at_its_points: where it is solved for – midpoints, integration points, nodes – weighted by their volumes.
    """

    density: float
    density_at_its_points: float
    displacement: float


FAILED = Errors(math.nan, math.nan, math.nan)


class Yardstick:
    """The reference, read where a discretisation on a mesh is to be compared with it."""

    def __init__(self, reference: Reference, problem: Discretisation) -> None:
        mesh = problem.scene.mesh
        self._X, weights = basix.make_quadrature(basix.CellType[mesh.cell_name], problem.variant.momentum_degree)
        places = positions(mesh, self._X).reshape(-1, 3)[:, : mesh.dim]
        self._volumes = (weights * volume_ratios(mesh, self._X)).ravel()
        self._density = reference.density(places)
        self._displacement = reference.displacement(places)
        own = problem.density_positions()[:, : mesh.dim]
        # A hair inwards: a node on the border of the body may lie outside by a rounding error.
        self._own_density = reference.density(own + 1e-9 * (own.mean(axis=0) - own))

    def errors(self, problem: Discretisation) -> Errors:
        """Of the final state of a run."""
        density = problem.density_at(self._X).ravel()
        displacement = problem.displacement_at(self._X).reshape(self._displacement.shape)
        own = problem.density.x.array
        return Errors(
            relative(density, self._density, self._volumes),
            relative(own, self._own_density, problem.volumes),
            relative(displacement, self._displacement, self._volumes),
        )


def relative(values: Floats, exact: Floats, volumes: Floats) -> float:
    """‖values − exact‖ / ‖exact‖ of numbers or vectors at points with volumes."""
    gaps, sizes = (np.square(each).reshape(len(volumes), -1).sum(axis=1) for each in (values - exact, exact))
    return float(np.sqrt(volumes @ gaps / (volumes @ sizes)))


# -- the first study: everything ---------------------------------------------------------------------------------------

DENSITY, DISPLACEMENT = "density", "displacement"


@dataclass(frozen=True)
class Row:
    """A run: its mesh, discretisation and way through time, errors, counts, and times over that of the clock's run.

    setting: steps in the ramp, or tolerance.  time, low, high: median, lowest and highest of the rounds.
    setup: likewise, of spaces and forms without their compilation.  Errors are NaN where the run ended early.
    """

    scene: str
    mesh: int
    cells: int
    variant: str
    scheme: str
    setting: float
    dofs: int
    steps: int
    iterations: int
    residuals: int
    factorisations: int
    density: float
    density_at_its_points: float
    displacement: float
    time: float
    low: float
    high: float
    setup: float

    @property
    def key(self) -> tuple[str, int, str, Way]:
        """What was run."""
        return self.scene, self.mesh, self.variant, self.way

    @property
    def way(self) -> Way:
        """The way through time."""
        return Way(self.scheme, self.setting)


@dataclass(frozen=True)
class Check:
    """How far two references of a scene are apart: in density and in displacement, relative, see `difference`."""

    scene: str
    first: str
    second: str
    density: float
    displacement: float


def references(plan: Plan, folder: Path) -> Reference:
    """The first reference of a scene; the check of it against the second is kept unless it is known."""
    first = Reference(plan, plan.first)
    known = read_rows(folder / REFERENCES, Check)
    if not any((check.scene, check.first, check.second) == checked(plan) for check in known):
        apart = difference(first, Reference(plan, plan.second), plan.scene(plan.linear[-1]))
        check = Check(*checked(plan), *(float(f"{each:.3e}") for each in apart))
        write_rows(folder / REFERENCES, [*(check for check in known if check.scene != plan.name), check])
    return first


def difference(first: Reference, second: Reference, scene: gx.Scene) -> tuple[float, float]:
    """Of two references in density and displacement, at the integration points of Q1 on a mesh."""
    X, weights = basix.make_quadrature(basix.CellType[scene.mesh.cell_name], gx.Q1.momentum_degree)
    places = positions(scene.mesh, X).reshape(-1, 3)[:, : scene.mesh.dim]
    volumes = (weights * volume_ratios(scene.mesh, X)).ravel()
    return (
        relative(second.density(places), first.density(places), volumes),
        relative(second.displacement(places), first.displacement(places), volumes),
    )


def checked(plan: Plan) -> tuple[str, str, str]:
    """What a check is of."""
    return plan.name, str(plan.first), str(plan.second)


def measure(
    plan: Plan, reference: Reference, variant: str, mesh: int, ways: Sequence[Way], repeats: int
) -> tuple[list[Row], float]:
    """All ways of a discretisation on a mesh, and the seconds of the clock's run, measured in turn with them."""
    scene, yardstick = plan.scene(mesh), None
    found: dict[Way, tuple[gx.Result, Errors]] = {}

    def look(way: Way | None, result: gx.Result) -> None:
        nonlocal yardstick
        if way is None:
            return
        yardstick = yardstick or Yardstick(reference, result.problem)
        found[way] = result, yardstick.errors(result.problem) if result.converged else FAILED

    runs: dict[Way | None, Callable[[], gx.Result]] = {None: lambda: solve(plan.scene(plan.clock), "Q1P0", CLOCK)}
    runs.update({way: lambda way=way: solve(scene, variant, way) for way in ways})
    seconds = in_turn(runs, repeats, look)
    tick = median(seconds[None])
    rows = [row(plan, mesh, way, *found[way], [each / tick for each in seconds[way]], tick) for way in ways]
    return rows, tick


CLOCK = Way(EULER, 5)


def row(plan: Plan, mesh: int, way: Way, result: gx.Result, errors: Errors, times: list[float], tick: float) -> Row:
    """A row of the table, with as many digits as mean something."""
    return Row(
        plan.name,
        mesh,
        result.scene.mesh.cell_count,
        result.variant.name,
        way.scheme,
        way.setting,
        result.problem.dofs,
        *astuple(work(result)),
        *(float(f"{error:.3e}") for error in astuple(errors)),
        *(float(f"{time:.3g}") for time in (median(times), min(times), max(times), result.setup_s / tick)),
    )


def error_study(plans: Sequence[Plan], folder: Path, again: bool, repeats: int) -> None:
    """Run what is missing, a discretisation on a mesh at a time."""
    measured = read_rows(folder / ROWS, Row)
    known = [] if again else measured
    others = [each for each in measured if again and each.scene not in {plan.name for plan in plans}]
    done = {each.key for each in known}
    jobs = {
        (plan, variant, mesh): ways
        for plan in plans
        for variant in VARIANTS
        for mesh in plan.meshes(variant)
        if (ways := [way for way in WAYS if (plan.name, mesh, variant, way) not in done])
    }
    rows = [*others, *known]
    of_plan: dict[str, Reference] = {}
    with progress("error and run time", len(jobs)) as begin:
        for (plan, variant, mesh), ways in jobs.items():
            if plan.name not in of_plan:
                begin(f"{plan.name}: references")
                of_plan = {plan.name: references(plan, folder)}
            begin(f"{plan.name}: {variant}, {mesh} {plan.unit}")
            found, tick = measure(plan, of_plan[plan.name], variant, mesh, ways, repeats)
            rows += found
            write_rows(folder / ROWS, rows)
            print(f"{plan.name}, {variant}, mesh {mesh}: 1 is {tick:.3f} s", flush=True)


# -- the second study: time integration alone --------------------------------------------------------------------------

IN_TIME = 1e-6  # tolerance of the reference in time
PER_DECADE = 8  # tolerances that are tried
COARSEST, TIGHTEST = 1, 6  # negative powers of ten
TRIALS = 8  # of Δt, until one just reaches the error
PAPERS = {"stepping": gx.FixedSteps(predicted=False), "full_newton": True}


@dataclass(frozen=True)
class Case:
    """Adaptive steps against the paper's scheme on one mesh, at equal errors; targets: least ratio wanted at 1e-3."""

    name: str
    scene: Callable[[], gx.Scene]
    errors: tuple[float, ...]
    target: float


CASES = (
    Case("bar of 40 cells, to t = 1.5", lambda: bar(40, until=1.5), (1e-2, 1e-3, 1e-4), 5),
    Case("bar of 40 cells, to t = 6", lambda: bar(40), (1e-3,), 5),
    Case("plate, N = 16", lambda: gx.scenes.plate(16), (1e-2, 1e-3, 1e-4), 10),
    Case("plate, N = 64", lambda: gx.scenes.plate(64), (1e-2, 1e-3), 10),
    Case("femur of 658 cells", lambda: femur(1), (1e-2, 1e-3, 1e-4), 10),
    Case("femur of 2632 cells", lambda: femur(2), (1e-2, 1e-3), 10),
)
QUICK_CASES = (
    Case("bar of 40 cells, to t = 1.5", lambda: bar(40, until=1.5), (1e-2,), 5),
    Case("plate, N = 8", lambda: gx.scenes.plate(8), (1e-2,), 10),
)
COMPARED = ("Q1P0", "Q1", "Q1Q1")


@dataclass(frozen=True)
class Comparison:
    """A case at one error: that is wanted; the paper's scheme, the same steps with a kept factor, and adaptive steps.

    parts: steps of the paper's scheme in the ramp.  kept, ratio: the paper's time over that of the other two.
    """

    case: str
    variant: str
    wanted: float
    parts: int
    paper_error: float
    paper_steps: int
    paper_iterations: int
    paper_residuals: int
    paper_factorisations: int
    kept_residuals: int
    kept_factorisations: int
    kept: float
    tolerance: float
    error: float
    steps: int
    iterations: int
    residuals: int
    factorisations: int
    ratio: float
    low: float
    high: float


def error_in_time(result: gx.Result, exact: Discretisation) -> float:
    """Of the final density, relative, against another way through time with the same mesh and discretisation."""
    if not result.converged:
        return math.inf
    gap = exact.density.x.array - result.problem.density.x.array
    return exact.root_mean_square(gap) / exact.root_mean_square(exact.density.x.array)


def fewest_parts(error: Callable[[int], float], wanted: float) -> int:
    """Steps in the ramp with which implicit Euler just reaches an error, which goes with Δt."""
    known: dict[int, float] = {}
    parts = 1
    while parts not in known and len(known) < TRIALS:
        known[parts] = error(parts)
        parts = max(1, math.ceil(parts * known[parts] / wanted)) if known[parts] < math.inf else 2 * parts
    return min((parts for parts, error in known.items() if error <= wanted), default=max(known))


def loosest_tolerance(error: Callable[[float], float], wanted: float) -> float:
    """The loosest tolerance with which adaptive steps reach an error, on a logarithmic scale, by bisection."""

    def tolerance(notch: int) -> float:
        return float(f"{10 ** (-notch / PER_DECADE):.3g}")

    loose, tight = PER_DECADE * COARSEST - 1, PER_DECADE * TIGHTEST
    while tight - loose > 1:
        middle = (loose + tight) // 2
        loose, tight = (loose, middle) if error(tolerance(middle)) <= wanted else (middle, tight)
    return tolerance(tight)


def compare(case: Case, variant: str, wanted: Sequence[float], repeats: int) -> list[Comparison]:
    """The comparisons of a case with one discretisation."""
    scene = case.scene()
    exact = solve(scene, variant, Way(ADAPTIVE, IN_TIME)).problem

    @cache
    def error(way: Way) -> float:
        return error_in_time(solve(scene, variant, way), exact)

    results = []
    for each in wanted:
        euler = Way(EULER, fewest_parts(lambda parts: error(Way(EULER, parts)), each))
        adaptive = Way(ADAPTIVE, loosest_tolerance(lambda tolerance: error(Way(ADAPTIVE, tolerance)), each))
        results.append(at_equal_error(case, scene, variant, each, euler, adaptive, error, repeats))
    return results


def at_equal_error(
    case: Case,
    scene: gx.Scene,
    variant: str,
    wanted: float,
    euler: Way,
    adaptive: Way,
    error: Callable[[Way], float],
    repeats: int,
) -> Comparison:
    """The paper's scheme, its steps with a kept factor and adaptive steps, timed in turn."""
    done: dict[str, Work] = {}
    seconds = in_turn(
        {
            "paper": lambda: solve(scene, variant, euler, **PAPERS),
            "kept": lambda: solve(scene, variant, euler),
            "adaptive": lambda: solve(scene, variant, adaptive),
        },
        repeats,
        lambda name, result: done.update({name: work(result)}),
    )
    paper = median(seconds["paper"])
    ratios = (paper / median(seconds["adaptive"]), paper / max(seconds["adaptive"]), paper / min(seconds["adaptive"]))
    return Comparison(
        case.name,
        variant,
        wanted,
        int(euler.setting),
        float(f"{error(euler):.3e}"),
        *astuple(done["paper"]),
        done["kept"].residuals,
        done["kept"].factorisations,
        round(paper / median(seconds["kept"]), 2),
        adaptive.setting,
        float(f"{error(adaptive):.3e}"),
        *astuple(done["adaptive"]),
        *(round(ratio, 2) for ratio in ratios),
    )


def stepping_study(cases: Sequence[Case], folder: Path, again: bool, repeats: int) -> None:
    """Run what is missing, a case with one discretisation at a time."""
    results = [] if again else read_rows(folder / STEPPING, Comparison)
    done = {(each.case, each.variant, each.wanted) for each in results}
    jobs = {
        (case, variant): wanted
        for case in cases
        for variant in COMPARED
        if (wanted := [error for error in case.errors if (case.name, variant, error) not in done])
    }
    with progress("time integration", len(jobs)) as begin:
        for (case, variant), wanted in jobs.items():
            begin(f"{case.name}: {variant}")
            results += compare(case, variant, wanted, repeats)
            write_rows(folder / STEPPING, results)


# -- the Pareto front --------------------------------------------------------------------------------------------------

QUANTITIES = {
    "density": "density at integration points",
    "density_at_its_points": "density where it is solved for",
    "displacement": "displacement",
}
LEVELS = (0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001, 0.0005, 0.0002, 0.0001)
ALIKE = 1.2  # times the cheapest run's time: hardly more


def front(rows: Iterable[Row], quantity: str) -> list[Row]:
    """The runs that no other beats in both time and error, the fastest first."""
    members: list[Row] = []
    for each in sorted(rows, key=lambda row: (row.time, getattr(row, quantity))):
        if not math.isnan(getattr(each, quantity)) and (
            not members or getattr(each, quantity) < getattr(members[-1], quantity)
        ):
            members.append(each)
    return members


def cheapest(rows: Iterable[Row], quantity: str, level: float) -> dict[str, float]:
    """The least time of each discretisation that reaches an error."""
    found: dict[str, float] = {}
    for each in rows:
        if getattr(each, quantity) <= level:
            found[each.variant] = min(each.time, found.get(each.variant, math.inf))
    return found


def levels(rows: Sequence[Row], quantity: str) -> list[float]:
    """The errors that some discretisation reaches and that the coarsest runs do not all reach."""
    errors = [getattr(row, quantity) for row in rows if not math.isnan(getattr(row, quantity))]
    return [level for level in LEVELS if min(errors) <= level < max(errors)]


def front_table(plan: Plan, rows: Sequence[Row], quantity: str) -> Table:
    """The members of a front."""
    cells = [
        [
            each.variant,
            f"{each.mesh}",
            f"{each.way}",
            f"{getattr(each, quantity):.1e}",
            f"{each.time:.2f} ({each.low:.2f}–{each.high:.2f})",
            f"{each.steps}",
            f"{each.residuals}",
            f"{each.factorisations}",
        ]
        for each in front(rows, quantity)
    ]
    header = (plan.name, plan.unit, "scheme, setting", "error", "time", "steps", "residuals", "factorisations")
    return Table(f"The {plan.name}: front of {QUANTITIES[quantity]}", header, cells)


def level_table(plan: Plan, rows: Sequence[Row], quantity: str) -> Table:
    """Least times for an error, of each discretisation; the cheapest and what costs hardly more are bold."""
    cells = []
    for level in levels(rows, quantity):
        found = cheapest(rows, quantity, level)
        best = min(found.values())
        texts = [_marked(found[name], best) if name in found else "–" for name in VARIANTS]
        cells.append([f"{level:g}", *texts])
    return Table(f"The {plan.name}: least time for an error of {QUANTITIES[quantity]}", ("error", *VARIANTS), cells)


def _marked(time: float, best: float) -> str:
    return f"**{time:.2f}**" if time <= ALIKE * best else f"{time:.2f}"


def advice(rows: Sequence[Row]) -> list[str]:
    """A sentence on each discretisation: where it is the cheapest way to an error, and what it costs elsewhere."""
    return [f"- **{name}** {_sentence(rows, name)}." for name in VARIANTS]


def _sentence(rows: Sequence[Row], name: str) -> str:
    places, elsewhere, missed = [], [], 0
    for quantity, words in QUANTITIES.items():
        for scene in dict.fromkeys(row.scene for row in rows):
            ours = [row for row in rows if row.scene == scene]
            wins = []
            for level in levels(ours, quantity):
                found = cheapest(ours, quantity, level)
                costs = found.get(name, math.inf) / min(found.values())
                if costs <= ALIKE:
                    wins.append(level)
                elif costs < math.inf:
                    elsewhere.append(costs)
                else:
                    missed += 1
            if wins:
                places.append(f"{words} on the {scene} to {_range(wins)}")
    text = f"is the cheapest, or within a fifth of it, for {'; '.join(places)}" if places else "is never the cheapest"
    if elsewhere:
        text += f"; elsewhere it takes {min(elsewhere):.1f} to {max(elsewhere):.1f} times as long"
        text += f" (median {median(elsewhere):.1f})"
    return text + (f"; {missed} of the errors it does not reach with these meshes" if missed else "")


def _range(errors: Sequence[float]) -> str:
    return f"{errors[0]:.2g}" if len(errors) == 1 else f"{errors[0]:.2g} … {errors[-1]:.2g}"


# -- the page ----------------------------------------------------------------------------------------------------------

INTRODUCTION = """\
# Error against run time

Made by `python benchmarks/error_vs_runtime.py` on one rank. Every discretisation of quadrilaterals runs bar, plate and
femur on several meshes, with fixed steps of implicit Euler and TR-BDF2, so many in the load ramp and on to the end, and
with adaptive steps of some tolerances. The ramp is the same for all.

*Time* is that of solving, without set-up and compilation, over that of a run of the same scene that is measured in turn
with it: implicit Euler with {parts:g} steps in the ramp, {clocks}. It is the median of the rounds, with the
lowest and highest. All times are in `error_vs_runtime.csv`, with what set-up takes, and the counts.

Meshes are numbered by {units}.

*Errors* are those of the final state, relative and in L²:

- of *density at integration points*, as the discretisation knows it: constant in a cell for Q1P0 and Q1sri, which reads
  their error of first order at points that are not the midpoint;
- of *density where it is solved for*: midpoints (Q1P0, Q1sri), integration points or nodes. At the jumps of the bar's
  stimulus nodes have two right densities, so that there this error of the node-based ones means nothing;
- of *displacement* at the integration points.

Densities of the reference are read by the polynomial through the integration points of its cells. A second one of
another kind is this far from it, at the integration points of the finest mesh of Q1: errors much below that are not to
be told apart. (Discretisation, mesh, tolerance of adaptive steps.)

{references}
![Errors over run time](error_vs_runtime.png)
"""

CHOICE = """\
## Which discretisation when

Drawn from the tables below: for each quantity and scene, among errors of 0.1, 0.05, 0.02, 0.01 … that some reach. (The
bar ends at biological equilibrium: its errors are those of space alone, and the fewest steps are the cheapest.)

"""

IN_TIME_ALONE = """\
## Time integration alone

On one mesh and with one discretisation, the error of the final density against that of adaptive steps of tolerance
{tolerance:g}. *Paper*: implicit Euler with the fewest fixed steps in the ramp that reach the error, full Newton from
the last state, direct solver. *Kept factor*: the same steps and the same answers, as growthx solves them by default.
*Adaptive*: the loosest tolerance, of eight per decade from 0.1, that reaches the error. The last columns are the
paper's time over that of the other two, by medians of rounds in turn, with the lowest and highest. At t = 6 the bar is
at biological equilibrium, where no Δt has an error to speak of: what counts is t = 1.5, soon after the ramp.

"""


def reference_table(checks: Sequence[Check]) -> str:
    """The references and how far they are apart, as a list."""
    return "".join(
        f"- {each.scene}: {each.first}; {each.second}; apart by {each.density:.1e} in density and "
        f"{each.displacement:.1e} in displacement\n"
        for each in checks
    )


def stepping_table(results: Sequence[Comparison]) -> Table:
    """All comparisons."""
    rows = [
        [
            each.case,
            each.variant,
            f"{each.wanted:g}",
            f"{each.parts}",
            f"{each.paper_steps} / {each.paper_residuals} / {each.paper_factorisations}",
            f"{each.kept_residuals} / {each.kept_factorisations}",
            f"{each.tolerance:g}",
            f"{each.steps} / {each.residuals} / {each.factorisations}",
            f"{each.kept:.1f}",
            f"**{each.ratio:.1f}** ({each.low:.1f}–{each.high:.1f})",
        ]
        for each in results
    ]
    header = (
        "",
        "",
        "error",
        "paper: steps in the ramp",
        "steps / residuals / factorisations",
        "kept factor: residuals / factorisations",
        "adaptive: tolerance",
        "steps / residuals / factorisations",
        "kept factor ×",
        "adaptive ×",
    )
    return Table("The paper's scheme, and adaptive steps, at equal error", header, rows)


def verdict(results: Sequence[Comparison], cases: Sequence[Case]) -> str:
    """What the targets come to at 1e-3, and where the time goes that is left."""
    targets = {case.name: case.target for case in cases}
    lines = []
    for each in results:
        if each.case not in targets or each.wanted != AT:
            continue
        target, fewer = targets[each.case], each.paper_residuals / each.residuals
        word = "reached" if each.ratio >= target else "missed"
        lines.append(
            f"- {each.case}, {each.variant}: {each.ratio:.1f}, target {target:g} {word}; "
            f"{each.paper_factorisations / max(each.factorisations, 1):.1f} times fewer factorisations, {fewer:.1f} "
            f"times fewer residuals ({each.residuals / each.steps:.0f} a step), and with all that goes with it a "
            f"residual takes {fewer / each.ratio:.2f} of the paper's time"
        )
    return "\n".join([VERDICT, *lines, ""])


AT = 1e-3  # the error that the targets are for
VERDICT = """\
At an error of 1e-3 the targets come to what follows. Where a residual takes as long as the paper's, factors are so
cheap on that mesh that keeping them saves nothing: only fewer residuals do.
"""


def write_page(plans: Sequence[Plan], cases: Sequence[Case], folder: Path) -> None:
    """The page and the picture, from what is known."""
    rows, checks, results = (
        read_rows(folder / name, kind) for kind, name in ((Row, ROWS), (Check, REFERENCES), (Comparison, STEPPING))
    )
    clocks = ", ".join(f"Q1P0 on the {plan.name} of mesh {plan.clock}" for plan in plans)
    units = "; ".join(f"{plan.unit} ({plan.name})" for plan in plans)
    words = {"parts": CLOCK.setting, "clocks": clocks, "units": units, "references": reference_table(checks)}
    parts = [INTRODUCTION.format(**words)]
    if rows:
        draw(plans, rows, folder / "error_vs_runtime.png")
        parts += [CHOICE, "\n".join(advice(rows)), ""]
    if results:
        parts += [IN_TIME_ALONE.format(tolerance=IN_TIME), stepping_table(results).markdown(), verdict(results, cases)]
    for plan in plans:
        ours = [row for row in rows if row.scene == plan.name]
        if ours:
            parts += [level_table(plan, ours, quantity).markdown() for quantity in QUANTITIES]
            parts += [front_table(plan, ours, quantity).markdown() for quantity in QUANTITIES]
    (folder / "error_vs_runtime.md").write_text("\n".join(parts), encoding="utf-8")


# -- the picture -------------------------------------------------------------------------------------------------------

# The colours of convergence.py: Okabe and Ito's, told apart by all.
COLOURS = {
    "Q1Q1": "#0072b2",
    "Q2Q2": "#56b4e9",
    "S2Q1": "#009e73",
    "Q1P0": "#d55e00",
    "Q1": "#e69f00",
    "Q2": "#cc79a7",
    "Q1sri": "#000000",
    "S2fri": "#999999",
}
MARKERS = {EULER: "s", TR_BDF2: "^", ADAPTIVE: "o"}


def draw(plans: Sequence[Plan], rows: Sequence[Row], path: Path) -> None:
    """Errors over time, one panel per quantity (rows) and scene (columns)."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(5.2 * len(plans), 4.0 * len(QUANTITIES) + 0.8), layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(len(QUANTITIES), len(plans), sharex="col", squeeze=False)
    for panels_of, (quantity, words) in zip(panels, QUANTITIES.items(), strict=True):
        for axes, plan in zip(panels_of, plans, strict=True):
            _panel(axes, [row for row in rows if row.scene == plan.name], quantity)
        panels_of[0].set_ylabel(f"error in {words}")
    for axes, plan in zip(panels[0], plans, strict=True):
        axes.set_title(plan.name)
    for axes in panels[-1]:
        axes.set_xlabel("time of solving / that of the reference run")
    _legend(figure)
    figure.savefig(path, dpi=110)


def _panel(axes: Any, rows: Sequence[Row], quantity: str) -> None:
    """All runs, pale; those of the front in full colour and joined."""
    members = front(rows, quantity)
    axes.loglog(
        [row.time for row in members],
        [getattr(row, quantity) for row in members],
        color="0.4",
        linewidth=1,
        drawstyle="steps-post",
    )
    for these, alpha, size in ((rows, 0.3, 5), (members, 1.0, 9)):
        for row in these:
            axes.loglog(
                row.time,
                getattr(row, quantity),
                color=COLOURS[row.variant],
                marker=MARKERS[row.scheme],
                markersize=size,
                alpha=alpha,
                markeredgewidth=0,
            )
    axes.grid(color="0.92", which="both", linewidth=0.6)


def _legend(figure: Any) -> None:
    """Below all panels: discretisations by colour, schemes by marker, the front."""
    from matplotlib.lines import Line2D

    entries = [Line2D([], [], color=c, marker="o", markersize=9, linestyle="", label=n) for n, c in COLOURS.items()]
    entries += [
        Line2D([], [], color="0.4", marker=m, markersize=8, linestyle="", label=scheme) for scheme, m in MARKERS.items()
    ]
    entries.append(Line2D([], [], color="0.4", label="the front"))
    figure.legend(handles=entries, loc="outside lower center", ncols=6, frameon=False)


# -- the command -------------------------------------------------------------------------------------------------------


def parser() -> argparse.ArgumentParser:
    """The options."""
    found = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    names = [plan.name for plan in PLANS]
    found.add_argument("--scenes", nargs="*", choices=names, default=names, help="of the first study (all)")
    found.add_argument("--repeats", type=int, default=3, help="rounds (3)")
    found.add_argument("--again", action="store_true", help="run also what is known")
    found.add_argument("--quick", action="store_true", help="a rehearsal on coarse meshes; wants --out")
    found.add_argument("--out", type=Path, default=RESULTS, help="folder for the results (default: %(default)s)")
    return found


def main() -> None:
    """Run what is missing, and write the page."""
    options = parser().parse_args()
    if MPI.COMM_WORLD.size > 1:
        raise gx.InputError(f"{MPI.COMM_WORLD.size} ranks would measure one another: one rank would be right")
    if options.repeats < 1:
        raise gx.InputError("--repeats is a count: a whole number from 1 would be right")
    if options.quick and options.out == RESULTS:
        raise gx.InputError("a rehearsal would mix with the results: a folder of its own, --out FOLDER, would be right")
    plans, cases = (QUICK, QUICK_CASES) if options.quick else (PLANS, CASES)
    error_study([plan for plan in plans if plan.name in options.scenes], options.out, options.again, options.repeats)
    stepping_study(cases, options.out, options.again, options.repeats)
    write_page(plans, cases, options.out)


if __name__ == "__main__":
    raise SystemExit(gx.guarded(main))
