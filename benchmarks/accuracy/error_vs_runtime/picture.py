"""Errors over run time, all runs and their fronts."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.accuracy.error_vs_runtime.cases import ADAPTIVE, EULER, TR_BDF2, Plan
from benchmarks.accuracy.error_vs_runtime.fronts import QUANTITIES, front
from benchmarks.accuracy.error_vs_runtime.whole_error import Row
from benchmarks.shared.pictures import COLOURS, blank

MARKERS = {EULER: "s", TR_BDF2: "^", ADAPTIVE: "o"}


def draw(plans: Sequence[Plan], rows: Sequence[Row], path: Path) -> None:
    """Errors over time, one panel per quantity (rows) and scene (columns)."""
    figure = blank(5.2 * len(plans), 4.0 * len(QUANTITIES) + 0.8)
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
