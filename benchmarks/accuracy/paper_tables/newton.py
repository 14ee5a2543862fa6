"""Newton's method as the paper has it: the norms of the residual in one step, density solved for or eliminated."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING

from mpi4py import MPI

import growthx as gx
from benchmarks.shared.pictures import COLOURS, blank
from benchmarks.shared.reporting import RESULTS, Table, read_rows
from growthx import scenes
from growthx.scenes.bar import CONTINUOUS

if TYPE_CHECKING:
    from growthx.model.scene import Scene

VARIANTS = (gx.Q1Q1, gx.Q1)  # node-based and integration-point based, the cheapest of either
STEP = 3  # of the march: what is left is large, and densities change
TOLERANCE = 1e-14  # below what round-off leaves
SCENES: dict[str, Callable[[], Scene]] = {"tapered bar": lambda: scenes.bar(CONTINUOUS, 40), "femur": scenes.femur}
RUNS = len(SCENES) * len(VARIANTS)
LEAST = 1e-15  # in the picture
ROUND_OFF = 1e-12  # norms below it say nothing of an order


@dataclass(frozen=True)
class Norm:
    """‖R‖₂ over the scale of the forces after so many iterations of a step."""

    scene: str
    variant: str
    time: float
    iteration: int
    norm: float


def newton_file(folder: Path) -> Path:
    """Where the norms are."""
    return folder / "newton.csv"


def read_norms(folder: Path = RESULTS) -> list[Norm]:
    """From their file."""
    return read_rows(newton_file(folder), Norm)


def norms(begin: Callable[[str], None]) -> list[Norm]:
    """Of one step of each scene by each variant, with the full method."""
    found = []
    for name, make in SCENES.items():
        scene = make()
        for variant in VARIANTS:
            begin(f"Newton's method, {variant.name}, {name}")
            march = gx.march(scene, variant, tolerance=TOLERANCE, full_newton=True)
            step = next(islice(march, STEP - 1, None))
            found += [
                Norm(name, variant.name, step.time, iteration, norm)
                for iteration, norm in enumerate(step.newton.residual_norms)
            ]
    return found


def orders(sizes: list[float]) -> list[float]:
    """ln(rₖ₊₁/rₖ) / ln(rₖ/rₖ₋₁) for each of the norms; NaN for the first two, and where round-off speaks."""
    found = [math.nan] * min(2, len(sizes))
    for before, here, after in zip(sizes, sizes[1:], sizes[2:], strict=False):
        told = after > ROUND_OFF and after < here < before
        found.append(math.log(after / here) / math.log(here / before) if told else math.nan)
    return found


def _by_run(found: Iterable[Norm]) -> dict[tuple[str, str, float], list[float]]:
    runs: dict[tuple[str, str, float], list[float]] = {}
    for each in found:
        runs.setdefault((each.scene, each.variant, each.time), []).append(each.norm)
    return runs


def newton_table(found: list[Norm]) -> Table:
    """Norms and observed orders, a row for each iteration."""
    runs = _by_run(found)
    columns = []
    for sizes in runs.values():
        columns.append([f"{size:.1e}" for size in sizes])
        columns.append([f"{order:.2f}" if math.isfinite(order) else "" for order in orders(sizes)])
    length = max(map(len, columns))
    rows = [[f"{k}", *(column[k] if k < len(column) else "" for column in columns)] for k in range(length)]
    header = [
        "iteration",
        *(word for scene, name, time in runs for word in (f"{scene}, {name}, t = {time:.3g}", "order")),
    ]
    return Table(
        "Newton's method: norms of the residual in one step",
        header,
        rows,
        [
            f"Step {STEP}, with the load still rising, the tangent assembled and factorised at every iteration. Norms "
            "are ‖R‖₂ over that of the loads.",
            "Observed order: ln(rₖ₊₁/rₖ) / ln(rₖ/rₖ₋₁), two for quadratic convergence; none is told of norms below "
            f"{ROUND_OFF:g}, where round-off is what is left.",
        ],
    )


def draw_newton(found: list[Norm], path: Path) -> None:
    """Norms over iterations, on rank 0."""
    if MPI.COMM_WORLD.rank != 0:
        return
    runs = _by_run(found)
    figure = blank(9, 4)
    titles = list(dict.fromkeys(scene for scene, _, _ in runs))
    for axes, title in zip(figure.subplots(1, len(titles), sharey=True), titles, strict=True):
        for (scene, name, time), sizes in runs.items():
            if scene == title:
                axes.semilogy(range(len(sizes)), sizes, "o-", color=COLOURS[name], label=name)
                axes.set_title(f"{scene}, t = {time:.3g}")
        axes.axhspan(LEAST, ROUND_OFF, color="0.94")
        axes.set_ylim(LEAST, 10)
        axes.set_xlabel("iteration")
        axes.xaxis.get_major_locator().set_params(integer=True)
        axes.grid(color="0.92")
        axes.legend(frameon=False)
    figure.axes[0].set_ylabel("‖R‖₂ over the loads")
    figure.savefig(path, dpi=110)
