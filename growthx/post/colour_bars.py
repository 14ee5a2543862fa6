"""What the colours of a picture stand for, told beside it: by one scale, or by two of the same colours."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

COLOUR_MAP = "viridis"  # reads the same with and without colour vision
RESTING_COLOUR = "#a9a9a9"  # of what does not grow, and has no part in the range of colours
MOST_LETTERS = 18  # in a line of a title
WIDTH = 220  # pixels, of a bar with its numbers
COLOUR_BAR = {
    "vertical": True,
    "color": "black",
    "title_font_size": 24,
    "label_font_size": 22,
    "position_y": 0.08,
    "height": 0.45,
}
LABELS = 5  # numbers at a bar
VTK_FONT_FILE = 4  # family of a text property that takes its font from a file


@dataclass(frozen=True)
class Scale:
    """What the lowest and the highest colour stand for, under a title."""

    title: str
    low: float
    high: float


def add_colour_bars(plotter: Any, mapper: Any, scales: Sequence[Scale], rests: bool) -> None:
    """A bar for each scale, side by side in the plotter's current part, of the colours that a mapper has.

    rests: whether there is a colour of what does not grow.
    """
    for place, scale in enumerate(scales):
        bar = plotter.add_scalar_bar(
            mapper=mapper,
            title=_in_lines(scale.title) + "\n",  # a line clear between title and bar
            nan_annotation=rests,
            position_x=(place + 0.2) / len(scales),
            width=0.5 / len(scales),
            fmt=f"%.{_digits(scale)}f",
            **COLOUR_BAR,
        )
        colours = bar.GetLookupTable().NewInstance()
        colours.DeepCopy(bar.GetLookupTable())
        colours.SetRange(scale.low, scale.high)
        bar.SetLookupTable(colours)
        bar.SetNanAnnotation("")  # there is no room beside it
        write_in_greek(bar.GetTitleTextProperty())
    if rests:
        plotter.add_text("does not grow", (0.1, 0.04), color="black", font_size=11, viewport=True)


def _in_lines(title: str) -> str:
    """A title in lines that are no wider than a bar with its numbers."""
    return "\n".join(textwrap.wrap(title, MOST_LETTERS, break_long_words=False))


def _digits(scale: Scale) -> int:
    """Digits after the point that tell the numbers of a bar apart, two or more."""
    apart = (scale.high - scale.low) / (LABELS - 1)
    return min(9, max(2, math.ceil(-math.log10(apart)))) if apart > 0 else 2


def font() -> str:
    """File of a font with Greek letters, which VTK's own leave out without a word."""
    from matplotlib.font_manager import findfont

    return str(findfont("DejaVu Sans"))


def write_in_greek(text: Any) -> None:
    """Let a text property of VTK write with that font."""
    text.SetFontFamily(VTK_FONT_FILE)
    text.SetFontFile(font())
