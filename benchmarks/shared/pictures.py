"""What the benchmarks' pictures have in common."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Of discretisations: Okabe and Ito's, told apart by all.
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


def blank(width: float, height: float) -> Figure:
    """A figure in inches that needs no screen."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure
