"""The picture of the stability benchmark: the map of exponents, densities, steps, the explicit limit, locking."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

import growthx as gx
from benchmarks.shared.pictures import COLOURS, blank
from benchmarks.stability import collapse, exponents, extremes, time_steps, uniqueness
from benchmarks.stability.findings.exponents import fine
from benchmarks.stability.findings.extremes import locking
from benchmarks.stability.findings.words import HEALED
from benchmarks.stability.page import Results
from benchmarks.stability.study import BODIES, FINISHED, VARIANTS
from growthx.meshing.sampling import positions, reference_corners

if TYPE_CHECKING:
    from growthx.common.arrays import Floats
    from growthx.discretisation.discretisation import Discretisation

MARKERS = dict(zip(BODIES, ("o", "s", "^"), strict=True))
NOISE = (3e-3, 0.6)  # range of the map's colours
DRAWN = "Q1P0"  # whose densities are drawn


def draw(results: Results, path: Path) -> None:
    """All of it."""
    figure = blank(17, 17)
    above, between, below = figure.subfigures(3, 1, height_ratios=(1.05, 1.1, 0.9))
    _maps(above, results.exponents)
    _fields(between)
    panels = below.subplots(1, 3)
    _approach(panels[0], results.time_steps)
    _limits(panels[1], results.limits)
    _locking(panels[2], results.extremes)
    figure.savefig(path, dpi=75, pil_kwargs={"optimize": True})


# -- the map -----------------------------------------------------------------------------------------------------------


def _maps(figure: Any, rows: list[exponents.Row]) -> None:
    from matplotlib.colors import LogNorm

    panels = figure.subplots(1, len(BODIES), sharey=True)
    columns = [(n, m) for n in exponents.N for m in exponents.M]
    names = (*VARIANTS, *HEALED)
    for axes, body in zip(panels, BODIES, strict=True):
        noise = np.full((len(names), len(columns)), np.nan)
        for row in fine(rows):
            if row.body == body:
                at = names.index(row.variant), columns.index((row.n, row.m))
                noise[at] = row.noise
                if row.ended != FINISHED:
                    axes.text(at[1], at[0], "×", ha="center", va="center", color="white", fontsize=13, weight="bold")
        image = axes.imshow(noise, cmap="viridis", norm=LogNorm(*NOISE), aspect="auto", interpolation="nearest")
        axes.set_title(body, fontsize=14)
        axes.set_xticks(range(len(columns)), [f"{m:g}" for _, m in columns])
        axes.set_yticks(range(len(names)), [name.replace(" with its source", "") for name in names])
        _frames(axes, columns, len(names))
    figure.colorbar(image, ax=panels, label="high-frequency part of the checkerboard index", extend="both", pad=0.01)


def _frames(axes: Any, columns: list[tuple[float, float]], height: int) -> None:
    """A line between the blocks of n, a frame around the well-posed exponents of each, and the labels below."""
    from matplotlib.patches import Rectangle

    below = {"xycoords": ("data", "axes fraction"), "textcoords": "offset points", "annotation_clip": False}
    for text, down in (("m", -15), ("n", -34)):
        axes.annotate(text, (-1.0, 0), xytext=(0, down), ha="center", style="italic", fontsize=12, **below)
    for block, n in enumerate(exponents.N):
        first = block * len(exponents.M)
        well = [place for place, (of, m) in enumerate(columns) if of == n and m > n]
        corner, size = (well[0] - 0.46, -0.46), (len(well) - 0.08, height - 0.08)
        axes.add_patch(Rectangle(corner, *size, fill=False, edgecolor="red", linewidth=2))
        middle = first + (len(exponents.M) - 1) / 2
        axes.annotate(f"{n:g}", (middle, 0), xytext=(0, -34), ha="center", fontsize=12, **below)
        if block:
            axes.axvline(first - 0.5, color="white", linewidth=4)


# -- densities ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Picture:
    """Densities of a body, of pieces on the deformed shape: corners, (pieces, 4, 2), and values over ρ*."""

    title: str
    corners: Floats
    values: Floats

    @classmethod
    def of(cls, title: str, problem: Discretisation) -> Picture:
        """The mean of each cell."""
        around = reference_corners("quadrilateral")[[0, 1, 3, 2]]
        places = positions(problem.scene.mesh, around)[:, :, :2] + problem.displacement_at(around)
        means = problem.density.x.array[problem.density_space.dofmap.list].mean(axis=1)
        return cls(title, places, means / problem.scene.material.reference_density)


def _femurs() -> list[Picture]:
    with TemporaryDirectory() as folder:
        ended = collapse.collapse(DRAWN, Path(folder) / "run")
    whole = gx.solve(gx.scenes.femur(), gx.variants.named(DRAWN))
    return [
        Picture.of(f"m = 3, n = 2\nt = {whole.time:.3g}", whole.problem),
        Picture.of(f"m = 0, n = 2\nended at t = {ended.time:.4g}", ended.problem),
    ]


def _plates() -> list[Picture]:
    pictures = []
    for m in uniqueness.EXPONENTS:
        scene = uniqueness.scene_of(replace(BODIES["plate"], scene=lambda _: BODIES["plate"].scene(2)), m)
        for way in uniqueness.ways(scene)[:2]:
            each = uniqueness.reach(BODIES["plate"], scene, DRAWN, way)
            start = "uniform" if way.seed is None else "random"
            pictures.append(Picture.of(f"m = {m:g} from {start} densities", each.problem))
    return pictures


def _fields(figure: Any) -> None:
    left, right = figure.subfigures(1, 2, width_ratios=(1, 1.75))
    femurs, plates = left.subplots(1, 2), right.subplots(2, 2)
    for axes, picture in zip(femurs, _femurs(), strict=True):
        image = _paint(axes, picture)
    for axes, picture in zip(plates.ravel(), _plates(), strict=True):
        image = _paint(axes, picture)
    left.suptitle(f"Remark 6.1, femur, {DRAWN}", fontsize=13)
    low, high = uniqueness.BOUNDS
    right.suptitle(
        f"one equilibrium or many: plate, {DRAWN}; m = 0 between bounds of {low:g} and {high:g} ρ*", fontsize=13
    )
    right.colorbar(image, ax=plates, label="density / ρ*", extend="max", shrink=0.8)


def _paint(axes: Any, picture: Picture) -> Any:
    from matplotlib.collections import PolyCollection

    pieces = PolyCollection(picture.corners, array=picture.values, cmap="viridis", edgecolors="face", linewidths=0.3)
    pieces.set_clim(0, uniqueness.BOUNDS[1])
    axes.add_collection(pieces)
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.set_axis_off()
    axes.set_title(picture.title, fontsize=12)
    return pieces


# -- curves ------------------------------------------------------------------------------------------------------------


def _approach(axes: Any, rows: list[time_steps.Row]) -> None:
    """Distance from equilibrium after some steps, over Δt; on the plate."""
    for scheme, style in ((time_steps.IMPLICIT, "-"), (time_steps.EXPLICIT, "--")):
        for variant in VARIANTS:
            these = [row for row in rows if (row.body, row.scheme, row.variant) == ("plate", scheme, variant)]
            far = [min(row.last, 1e2) if row.ended == FINISHED else math.nan for row in these]
            lost = [(row.step, 30.0) for row in these if row.ended != FINISHED]
            axes.loglog([row.step for row in these], far, style, color=COLOURS[variant], marker="o", markersize=3)
            if lost:
                axes.plot(*zip(*lost, strict=True), "x", color=COLOURS[variant], markersize=7)
    axes.plot([], [], "-k", label="implicit Euler")
    axes.plot([], [], "--k", label="explicit Euler")
    axes.plot([], [], "xk", label="ended early")
    axes.set_xlabel("time step Δt")
    axes.set_ylabel(f"distance from equilibrium after {time_steps.COUNT} steps")
    axes.set_title("plate, m = 3, n = 2", fontsize=13)
    axes.legend(frameon=False, loc="center right", title="colours: as to the right")
    axes.grid(color="0.92")


def _limits(axes: Any, rows: list[time_steps.LimitRow]) -> None:
    """The explicit limit found over the one of the linearised problem."""
    for row in rows:
        axes.loglog(row.linearised, row.found, MARKERS[row.body], color=COLOURS[row.variant], markersize=8, alpha=0.8)
        axes.loglog(
            row.at_stress, row.found, MARKERS[row.body], markeredgecolor="0.75", markerfacecolor="none", zorder=0
        )
    ends = [min((row.at_stress for row in rows), default=0.1), max((row.found for row in rows), default=1.0)]
    axes.loglog(ends, ends, color="0.4", linewidth=1)
    for body, marker in MARKERS.items():
        axes.plot([], [], marker, color="0.3", markersize=8, label=body)
    axes.plot([], [], "o", markeredgecolor="0.75", markerfacecolor="none", label="by itself, at constant stress")
    axes.set_xlabel("limit 2/|λ| of the linearised problem")
    axes.set_ylabel("limit found by bisection")
    axes.set_title("the longest stable step of explicit Euler", fontsize=13)
    axes.legend(frameon=False, loc="upper left")
    axes.grid(color="0.92")


def _locking(axes: Any, rows: list[extremes.Row]) -> None:
    """Deflections over the reference's, over the distance of Poisson's ratio from one half."""
    for study, style in ((extremes.ELASTIC, "-"), (extremes.GROWN, ":")):
        found = locking(rows, study)
        for variant in VARIANTS:
            known = [(0.5 - ratio, found[variant, ratio]) for ratio in extremes.RATIOS if (variant, ratio) in found]
            if known:
                label = variant if style == "-" else None
                axes.semilogx(
                    *zip(*known, strict=True), style, color=COLOURS[variant], marker="o", markersize=4, label=label
                )
    axes.plot([], [], ":k", label="grown")
    axes.invert_xaxis()
    axes.set_xlabel("½ − ν")
    axes.set_ylabel(f"deflection / that of Q2 with {extremes.FINE} cells")
    axes.set_title(f"locking: plate with {extremes.CELLS} cells over the height", fontsize=13)
    axes.legend(frameon=False, ncols=2, loc="lower left")
    axes.grid(color="0.92")
