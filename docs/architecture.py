"""The rooms of growthx and their arrows, read from its imports: `python docs/architecture.py` tells them anew.

It writes the table in `architecture.md` between its two marks and draws `architecture.png`; a test holds both to the
code.
"""

from __future__ import annotations

import ast
import re
import textwrap
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
PACKAGE = HERE.parent / "growthx"
PAGE, PICTURE = HERE / "architecture.md", HERE / "architecture.png"
MARKS = "<!-- rooms: written by docs/architecture.py -->", "<!-- end of rooms -->"


@dataclass(frozen=True)
class Room:
    """A folder of growthx, or a module beside them.

    purpose: the first sentence of its docstring.  modules: by name, those of a folder in it as "formats/gmsh".
    knows: the rooms it imports.
    """

    name: str
    purpose: str
    modules: tuple[str, ...]
    knows: frozenset[str]


@cache
def rooms() -> dict[str, Room]:
    """All rooms by their names, from below."""
    found = {"run": _room("run", PACKAGE / "run.py", [PACKAGE / "run.py"])}
    for door in PACKAGE.glob("*/__init__.py"):
        found[door.parent.name] = _room(door.parent.name, door, sorted(door.parent.rglob("*.py")))
    return dict(sorted(found.items(), key=lambda item: (floor(item[0], found), item[0])))


def _room(name: str, door: Path, files: list[Path]) -> Room:
    inside = [file for file in files if file.name != "__init__.py" and file != door]
    modules = tuple(file.relative_to(door.parent).with_suffix("").as_posix() for file in inside)
    knows = frozenset(other for file in files for other in _imported(file)) - {name}
    return Room(name, _first_sentence(door), modules, knows)


def _imported(file: Path) -> set[str]:
    """The rooms that a file imports, for types too."""
    names = set()
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("growthx."):
            names.add((node.module or "").split(".")[1])
    return names


def _first_sentence(file: Path) -> str:
    text = " ".join((ast.get_docstring(ast.parse(file.read_text(encoding="utf-8"))) or "").split())
    return re.split(r"(?<=\w)\.(?: |$)", text, maxsplit=1)[0]


def floor(name: str, all_rooms: dict[str, Room] | None = None) -> int:
    """How many rooms lie one above another below a room."""
    known = rooms() if all_rooms is None else all_rooms
    return max((1 + floor(other, known) for other in known[name].knows), default=0)


def below(name: str) -> set[str]:
    """All that a room reaches by way of others."""
    near = rooms()[name].knows
    return set(near).union(*(below(other) for other in near))


def arrows() -> list[tuple[str, str]]:
    """From a room to those it knows, without what follows from other arrows."""
    return [
        (name, other)
        for name, room in rooms().items()
        for other in sorted(room.knows)
        if not any(other in below(between) for between in room.knows)
    ]


def table() -> str:
    """The rooms from above, as the page has them."""
    rows = ["| room | is for | knows |", "|---|---|---|"]
    for name, room in reversed(rooms().items()):
        link = f"[`{name}`](../growthx/{name})" if room.modules else f"[`{name}`](../growthx/{name}.py)"
        knows = ", ".join(other for other in rooms() if other in room.knows) or "none"
        rows.append(f"| {link} | {room.purpose} | {knows} |")
    return "\n".join(rows)


def drawn() -> str:
    """All that the picture says, which it has in its metadata."""
    inside = (f"{name}: {room.purpose}: {' '.join(room.modules)}" for name, room in rooms().items())
    return "\n".join([*inside, *(f"{start} > {end}" for start, end in arrows())])


def page(text: str) -> str:
    """The page with its table brought up to date."""
    start, end = MARKS
    return f"{text[: text.index(start)]}{start}\n{table()}\n{text[text.index(end) :]}"


# -- the picture -------------------------------------------------------------------------------------------------------

WIDTH, GAP, LINE = 13.0, 0.42, 0.165  # inches: of the picture, between floors, of a line of small text
ROOM_WIDTHS = {1: 5.4, 2: 4.5, 3: 3.9}  # by the number of rooms on a floor
ORDER = ("solvers", "fem", "constitutive", "stepping", "post", "baselines", "results", "scenes")  # from the left
COLOURS = ("#eceff1", "#dcedf5", "#d3ebe6", "#d9edd0", "#fdf0c4", "#fde3c8", "#f9d8cf", "#efd5e3", "#e0d8ee")
INK, SOFT = "#1d2b36", "#5b6b78"


@dataclass(frozen=True)
class Box:
    """Where a room is in the picture, in inches, and the lines of text in it."""

    x: float
    top: float
    width: float
    height: float
    purpose: list[str]
    modules: list[str]

    @property
    def bottom(self) -> float:
        """Its lower edge."""
        return self.top - self.height


def boxes() -> dict[str, Box]:
    """The rooms' places, from the top of the picture at zero downwards."""
    floors: dict[int, list[str]] = {}
    for name in rooms():
        floors.setdefault(floor(name), []).append(name)
    found, top = {}, -0.25
    for level in sorted(floors, reverse=True):
        names = sorted(floors[level], key=lambda name: (ORDER.index(name) if name in ORDER else len(ORDER), name))
        width = ROOM_WIDTHS.get(len(names), (WIDTH - 0.5) / len(names) - 0.3)
        texts = {name: _texts(rooms()[name], width) for name in names}
        height = 0.5 + LINE * max(len(purpose) + len(modules) for purpose, modules in texts.values())
        step = (WIDTH - 0.5) / 3 if len(names) == 3 else width + 0.4
        for number, name in enumerate(names):
            x = WIDTH / 2 + (number - (len(names) - 1) / 2) * step
            found[name] = Box(x, top, width, height, *texts[name])
        top -= height + GAP
    return found


def _texts(room: Room, width: float) -> tuple[list[str], list[str]]:
    purpose = re.split(r"[:;] ", room.purpose)[0] if len(room.purpose) > 70 else room.purpose
    names = "  ".join(room.modules)
    return textwrap.wrap(purpose.replace("`", ""), round(13.6 * width)), textwrap.wrap(names, round(13.9 * width))


def draw(path: Path) -> None:
    """Draw the rooms, and arrows from each to those it knows, but for those that other arrows lead to."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    places = boxes()
    height = 0.25 - min(box.bottom for box in places.values())
    figure = Figure(figsize=(WIDTH, height), facecolor="white")
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0, 0, 1, 1), xlim=(0, WIDTH), ylim=(-height, 0))
    axes.set_axis_off()
    for start, end in arrows():
        _draw_arrow(axes, places, start, end)
    for name, box in places.items():
        _draw_box(axes, name, box)
    figure.savefig(path, dpi=120, metadata={"Description": drawn(), "Software": None})


def _draw_box(axes: Any, name: str, box: Box) -> None:
    from matplotlib.patches import FancyBboxPatch

    left = box.x - box.width / 2
    shape = "round,pad=0,rounding_size=0.1"
    colour = COLOURS[floor(name) % len(COLOURS)]
    edge = {"facecolor": colour, "edgecolor": INK, "linewidth": 1.1, "zorder": 2}
    axes.add_patch(FancyBboxPatch((left, box.bottom), box.width, box.height, boxstyle=shape, **edge))
    y = box.top - 0.24
    axes.text(box.x, y, name, ha="center", va="center", fontsize=14, fontweight="bold", color=INK, zorder=3)
    y -= 0.225
    for line in box.purpose:
        axes.text(box.x, y, line, ha="center", va="center", fontsize=9.2, color=INK, zorder=3)
        y -= LINE
    for line in box.modules:
        axes.text(box.x, y, line, ha="center", va="center", fontsize=8.4, color=SOFT, zorder=3, style="italic")
        y -= LINE


def _draw_arrow(axes: Any, places: dict[str, Box], start: str, end: str) -> None:
    """From the lower edge of a room to the upper one of another; over several floors from its side, past the others."""
    from matplotlib.patches import FancyArrowPatch
    from matplotlib.path import Path as Curve

    above, under = places[start], places[end]
    shift = 0.3 * above.width
    if floor(start) - floor(end) > 1 and abs(under.x - above.x) > above.width / 2:
        side = above.x + (above.width if under.x > above.x else -above.width) / 2
        y = above.top - above.height / 2
        points = [(side, y), (under.x, y), (under.x, y), (under.x, under.top)]
    else:
        x = above.x + max(-shift, min(shift, 0.35 * (under.x - above.x)))
        to = under.x + max(-0.3 * under.width, min(0.3 * under.width, 0.35 * (above.x - under.x)))
        middle = (above.bottom + under.top) / 2
        points = [(x, above.bottom), (x, middle), (to, middle), (to, under.top)]
    path = Curve(points, [Curve.MOVETO, Curve.CURVE4, Curve.CURVE4, Curve.CURVE4])
    look = {"arrowstyle": "-|>,head_length=7,head_width=3.6", "shrinkA": 0, "shrinkB": 0, "zorder": 1}
    axes.add_patch(FancyArrowPatch(path=path, color=SOFT, linewidth=1.5, **look))


if __name__ == "__main__":
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
    draw(PICTURE)
