"""Errors over the size of cells and over the time step."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.accuracy.convergence.orders import END_DENSITY, END_DISPLACEMENT, QUANTITIES
from benchmarks.accuracy.convergence.study import FAMILIES, Curve
from benchmarks.shared.pictures import COLOURS, blank

# What is alike on tensor cells and on simplices looks alike.
LOOKS = {
    ("Q1Q1", "P1P1"): (COLOURS["Q1Q1"], "o"),
    ("Q2Q2", "P2P2"): (COLOURS["Q2Q2"], "s"),
    ("S2Q1", "P2P1"): (COLOURS["S2Q1"], "D"),
    ("Q1P0", "P1P0"): (COLOURS["Q1P0"], "^"),
    ("Q1", "P1"): (COLOURS["Q1"], "v"),
    ("Q2", "P2"): (COLOURS["Q2"], "P"),
    ("Q1sri",): (COLOURS["Q1sri"], "x"),
    ("S2fri",): (COLOURS["S2fri"], "*"),
}
SLOPE = "0.35"  # grey of the reference lines
TICKS = (2, 3, 4, 6, 8, 12, 16, 24, 32, 64, 128)


def draw(curves: list[Curve], path: Path) -> None:
    """Errors over h, one panel per quantity (rows) and family of meshes (columns)."""
    families = [family.name for family in FAMILIES if any(curve.family == family.name for curve in curves)]
    figure = blank(3.3 * len(families), 3.0 * len(QUANTITIES) + 0.9)
    panels = figure.subplots(len(QUANTITIES), len(families), sharex="col", sharey="row", squeeze=False)
    for row, quantity in zip(panels, QUANTITIES, strict=True):
        for axes, family in zip(row, families, strict=True):
            _panel(axes, [c for c in curves if (c.family, c.quantity) == (family, quantity)])
        row[0].set_ylabel(f"error in {quantity}")
    for axes, family in zip(panels[0], families, strict=True):
        axes.set_title(family)
    for axes in panels[-1]:
        axes.set_xlabel("h = 1 / cells per side")
    figure.suptitle("Errors of the manufactured problem over the size of cells")
    _legend(figure)
    figure.savefig(path, dpi=110)


def draw_time(curves: list[Curve], path: Path) -> None:
    """Errors over Δt, one panel per quantity."""
    figure = blank(8, 4.2)
    for axes, quantity in zip(figure.subplots(1, 2), (END_DENSITY, END_DISPLACEMENT), strict=True):
        _panel(axes, [curve for curve in curves if curve.quantity == quantity])
        axes.set_xlabel("Δt = 1 / time steps")
        axes.set_ylabel(f"error in {quantity}")
    figure.suptitle("Errors of a block in homogeneous tension over the time step: the same for all variants")
    figure.savefig(path, dpi=110)


def _panel(axes: Any, curves: list[Curve]) -> None:
    """Errors over h or Δt, and a dashed line for each order that theory expects."""
    for curve in curves:
        index, look = next((i, LOOKS[names]) for i, names in enumerate(LOOKS) if curve.variant in names)
        axes.loglog(1 / np.array(curve.parts), curve.errors, **_style(index, *look))
    for order in sorted({curve.theory.expected for curve in curves}):
        _slope(axes, order, [curve for curve in curves if curve.theory.expected == order])
    ticks = sorted({parts for curve in curves for parts in curve.parts if parts in TICKS})
    axes.set_xticks([1 / parts for parts in ticks], [f"1/{parts}" for parts in ticks])
    axes.minorticks_off()
    axes.grid(color="0.9")


def _style(index: int, colour: str, marker: str) -> dict[str, Any]:
    """Hollow markers, smaller and smaller, so that curves that coincide are seen as such."""
    return {
        "color": colour,
        "marker": marker,
        "markerfacecolor": "none",
        "markersize": 10 - 0.7 * index,
        "markeredgewidth": 1.5,
        "linewidth": 1.2,
    }


def _slope(axes: Any, order: float, curves: list[Curve]) -> None:
    """A line of this slope at the finest meshes, half as high as the lowest of the curves it belongs to."""
    lowest = min(curves, key=lambda curve: curve.errors[-1])
    h = 1 / np.array([lowest.parts[-3:][0], lowest.parts[-1]])
    line = 0.5 * lowest.errors[-1] * (h / h[-1]) ** order
    axes.loglog(h, line, color=SLOPE, linestyle="--", linewidth=1)
    box = {"facecolor": "white", "edgecolor": "none", "alpha": 0.7, "pad": 0.5}
    axes.annotate(
        f"{order:g}", (h[0], line[0]), (3, -4), textcoords="offset points", va="center", color=SLOPE, bbox=box
    )


def _legend(figure: Any) -> None:
    """Below all panels: the variants, and the dashed lines."""
    from matplotlib.lines import Line2D

    entries = [
        Line2D([], [], label=" / ".join(names), **_style(index, *look))
        for index, (names, look) in enumerate(LOOKS.items())
    ]
    entries.append(Line2D([], [], color=SLOPE, linestyle="--", label="slope of the order to expect"))
    figure.legend(handles=entries, loc="outside lower center", ncols=len(entries), frameon=False)
