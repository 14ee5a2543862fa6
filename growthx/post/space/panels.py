"""Panels of a picture in space: what is seen in each, from where, and all of them beside their colour bar."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from growthx.post.colour_bars import COLOUR_MAP, RESTING_COLOUR, Scale, add_colour_bars, font
from growthx.post.colour_bars import WIDTH as BAR_WIDTH
from growthx.post.display import display
from growthx.post.drawing import ARROW_COLOURS, PANEL_WIDTH, TEXT_HEIGHT
from growthx.post.space.body import MOVED, VALUE, SpaceBody

if TYPE_CHECKING:
    from growthx.common.arrays import Floats
    from growthx.model.arrows import Arrow
    from growthx.post.space.planes import Plane

OUTSIDE = (0.6, -1.0, 0.5)  # from where the outside is seen
COLOURS = tuple(ARROW_COLOURS[i] for i in (0, 2, 5, 4, 3, 1))  # of arrows: first those far from the densities' greens
LIGHT = {"ambient": 0.45, "diffuse": 0.6, "specular": 0.0}  # colours in the shade, too, are near those of the bar
NOTHING = "#000000"  # behind a picture in grey, as air is black in a CT
THINNEST = 0.08  # of an arrow's length, the radius of the shaft of a short one
MOST_LETTERS = 52  # in a line above a panel
MARGIN = 1.08
NUDGE = (
    1e-6  # of a body's size, by which a plane is off its point: sides of cells that lie in it belong to neither cell
)
HIDDEN = 1e-3  # of a body's size, along an arrow: where it is told to be inside
ARROW_LENGTH = 0.28  # of the body's extent, of the largest force


@dataclass(frozen=True)
class Panel:
    """What is seen in one part of a picture.

    parts: meshes with pyvista's options of how they look, the coloured ones by `VALUE`.  toward: from where it is seen.
    up: what is upwards.  axes: whether they are drawn.  legend: names and colours.
    """

    label: str
    parts: list[tuple[Any, dict[str, Any]]]
    toward: tuple[float, ...]
    up: tuple[float, ...]
    grey: bool = False
    axes: bool = True
    legend: list[tuple[str, str]] = field(default_factory=list)


def outside(body: SpaceBody, arrows: Sequence[Arrow], label: str = "outside") -> Panel:
    """The whole surface, with the loads."""
    grid = body.whole
    parts = _coloured(body, lambda grid: grid.extract_surface(), LIGHT)
    shafts, legend = _arrows(grid.extract_surface(), arrows)
    return Panel(label, parts + shafts, OUTSIDE, (0.0, 0.0, 1.0), legend=legend)


def section(body: SpaceBody, plane: Plane, *, grey: bool = False, label: str = "") -> Panel:
    """Where a plane cuts the body at rest, as that has moved since; grey: as a CT shows it."""
    look: dict[str, Any] = {"lighting": False}
    whole = body.whole
    inward = np.sign((np.array(whole.center) - plane.point) @ plane.normal) or 1.0
    origin = np.array(plane.point) + inward * NUDGE * whole.length * np.array(plane.normal)
    parts = _coloured(body, lambda grid: grid.slice(normal=plane.normal, origin=origin), look)
    if not grey:
        cut = whole.slice(normal=plane.normal, origin=origin).warp_by_vector(MOVED)
        border = cut.extract_feature_edges(feature_edges=False, manifold_edges=False, non_manifold_edges=False)
        parts.append((border, {"color": "black", "line_width": 1.5, "lighting": False}))
    return Panel(label or plane.label, parts, plane.normal, plane.up, grey, axes=not plane.is_named)


def grey_range(limits: tuple[float, float]) -> tuple[float, float]:
    """What is black and what is white in grey: nothing is as air, the most as the densest bone."""
    return min(0.0, limits[0]), limits[1]


def cut_away(body: SpaceBody, plane: Plane, arrows: Sequence[Arrow]) -> Panel:
    """What lies behind a plane, with the loads on the whole body, seen from before it and a little from the side."""
    parts = _coloured(body, lambda grid: grid.clip(normal=plane.normal, origin=plane.point).extract_surface(), LIGHT)
    whole = body.whole.extract_surface()
    parts.append(_edges(whole))
    shafts, legend = _arrows(whole, arrows)
    aside = np.cross(plane.up, plane.normal)
    toward = np.array(plane.normal) + 0.35 * aside + 0.3 * np.array(plane.up)
    return Panel(f"cut away: {plane.label}", parts + shafts, tuple(toward), plane.up, legend=legend)


def threshold(body: SpaceBody, above: float | None, below: float | None, label: str) -> Panel:
    """What has values above and below some, in the body's outline."""

    def within(grid: Any) -> Any:
        for bound, upper in ((above, False), (below, True)):
            if bound is None or grid.n_cells == 0:
                continue
            if body.at_corners:
                grid = grid.clip_scalar(scalars=VALUE, value=bound, invert=upper)
            else:
                grid = grid.threshold(bound, scalars=VALUE, invert=upper)
        return grid.extract_surface()

    parts = _coloured(body, within, LIGHT, resting=False)
    skin = body.whole.extract_surface()
    parts.append((skin.warp_by_vector(MOVED), {"color": "#9fb6c8", "opacity": 0.15, "lighting": False}))
    parts.append(_edges(skin))
    return Panel(label, parts, OUTSIDE, (0.0, 0.0, 1.0))


def _edges(surface: Any) -> tuple[Any, dict[str, Any]]:
    """The sharp edges of a body's surface, if it has any."""
    edges = surface.extract_feature_edges(feature_angle=75).warp_by_vector(MOVED)
    return edges, {"color": "grey", "line_width": 1.0, "lighting": False}


def _coloured(
    body: SpaceBody, seen: Callable[[Any], Any], look: dict[str, Any], *, resting: bool = True
) -> list[tuple[Any, dict[str, Any]]]:
    """What is seen of a body where it has moved to: what grows in colours, the rest plain."""
    parts = []
    shown = [(body.growing, {"scalars": VALUE})]
    shown += [(body.resting, {"color": RESTING_COLOUR})] if resting else []
    for grid, options in shown:
        shape = None if grid is None else seen(grid)
        if shape is not None and shape.n_points:
            parts.append((shape.warp_by_vector(MOVED), {**options, **look}))
    return parts


def _arrows(surface: Any, arrows: Sequence[Arrow]) -> tuple[list[tuple[Any, dict[str, Any]]], list[tuple[str, str]]]:
    """The forces in proportion, at the surface of the body: pushing on it, or pulling at it; and their legend."""
    import pyvista

    if not arrows:
        return [], []
    size, moved = surface.length, surface.warp_by_vector(MOVED)
    scale = ARROW_LENGTH * size / max(arrow.size for arrow in arrows)
    labels = dict.fromkeys(arrow.label for arrow in arrows)
    colours = {label: COLOURS[i % len(COLOURS)] for i, label in enumerate(labels)}
    shafts = []
    for arrow in arrows:
        shaft, place = scale * np.array(arrow.force), _nearest(surface, np.array(arrow.place))
        place = place + np.asarray(surface.point_data[MOVED])[surface.find_closest_point(place)]
        length = float(np.linalg.norm(shaft))
        radius = min(THINNEST, 0.006 * size / length)
        shape = pyvista.Arrow(
            start=place - shaft if _pushes(moved, place, shaft) else place,
            direction=shaft,
            scale=length,
            shaft_radius=radius,
            tip_radius=2.5 * radius,
            tip_length=min(0.6, 6 * radius),
        )
        shafts.append((shape, {"color": colours[arrow.label], "lighting": False}))
    return shafts, list(colours.items())


def _nearest(surface: Any, place: Floats) -> Floats:
    """The place of the surface that is nearest: where a boundary is curved, the middle of a force lies inside it."""
    return np.asarray(surface.find_closest_cell(place, return_closest_point=True)[1])


def _pushes(surface: Any, place: Floats, shaft: Floats) -> bool:
    """Whether an arrow is to end at a place, instead of beginning there, where the body would hide it."""
    way = surface.length * shaft / np.linalg.norm(shaft)
    # A ray from inside meets the surface an odd number of times.
    before, after = (len(surface.ray_trace(place + sign * HIDDEN * way, place + sign * way)[0]) % 2 for sign in (-1, 1))
    if before != after:
        return bool(after)
    return bool(shaft @ (place - np.array(surface.center)) < 0)


def render(panels: Sequence[Panel], scales: Sequence[Scale], rests: bool, path: Path, columns: int) -> None:
    """Draw panels in rows, all in one size and one range of colours, beside their colour bars."""
    import pyvista

    columns = min(columns, len(panels))
    rows = -(-len(panels) // columns)
    across, upward = np.max([_size(panel) for panel in panels], axis=0)
    height = round(PANEL_WIDTH * min(1.6, max(0.6, upward / across))) + 2 * TEXT_HEIGHT
    bars = len(scales) * BAR_WIDTH
    options = {
        "window_size": (columns * PANEL_WIDTH + bars, rows * height),
        "shape": (rows, columns + 1),
        "col_weights": [PANEL_WIDTH] * columns + [bars],
        "groups": [(slice(None), columns)],
        "border": False,
    }
    scale = MARGIN / 2 * max(upward * height / (height - 2 * TEXT_HEIGHT), across * height / PANEL_WIDTH)
    with display(), closing(pyvista.Plotter(off_screen=True, **options)) as plotter:
        plotter.set_background("white", all_renderers=True)
        mapper = None
        for place, panel in zip(np.ndindex(rows, columns), panels, strict=False):
            plotter.subplot(*place)
            found = _draw(plotter, panel, (scales[0].low, scales[0].high))
            mapper = mapper or found
            plotter.camera.parallel_scale = scale
        plotter.subplot(0, columns)
        if mapper is not None:
            add_colour_bars(plotter, mapper, scales, rests)
        plotter.screenshot(str(path))


def _draw(plotter: Any, panel: Panel, limits: tuple[float, float]) -> Any:
    """Put a panel into the plotter's current part; returns what maps its values to colours, None if grey."""
    mapper = None
    limits = grey_range(limits) if panel.grey else limits
    for mesh, look in panel.parts:
        colours = {}
        if "scalars" in look:
            colours = {"cmap": "gray" if panel.grey else COLOUR_MAP, "clim": limits, "show_scalar_bar": False}
        if not mesh.n_points:
            continue
        actor = plotter.add_mesh(mesh, **look, **colours)
        if colours and not panel.grey:
            actor.mapper.lookup_table.nan_color = RESTING_COLOUR
            mapper = actor.mapper
    text = "white" if panel.grey else "black"
    if panel.grey:
        plotter.set_background(NOTHING, all_renderers=False)
    lines = textwrap.wrap(panel.label, MOST_LETTERS, drop_whitespace=False) or [""]
    place = 0.02, 0.955 - 0.03 * (len(lines) - 1)
    plotter.add_text("\n".join(lines), place, color=text, font_size=12, font_file=font(), viewport=True)
    if panel.axes:
        plotter.add_axes(color=text, line_width=3, viewport=(0.0, 0.0, 0.18, 0.1))
    for row, (name, colour) in enumerate(panel.legend):
        place = (0.66, 0.03 * len(panel.legend) - 0.03 * row)
        plotter.add_text(f"→ {name}", place, color=colour, font_size=10, font_file=font(), viewport=True)
    plotter.enable_parallel_projection()
    right, up = _axes(panel)
    middle = np.mean([_span(panel, axis) for axis in (right, up, np.cross(right, up))], axis=1)
    focus = middle @ np.array([right, up, np.cross(right, up)])
    reach = 10 * max(np.ptp(_span(panel, axis)) for axis in (right, up, np.cross(right, up)))
    plotter.camera_position = [focus + reach * np.cross(right, up), focus, up]
    plotter.renderer.reset_camera_clipping_range()
    return mapper


def _axes(panel: Panel) -> tuple[Floats, Floats]:
    """What is to the right and what is upwards in a panel."""
    toward = np.array(panel.toward) / np.linalg.norm(panel.toward)
    right = np.cross(panel.up, toward)
    right /= np.linalg.norm(right)
    return right, np.cross(toward, right)


def _span(panel: Panel, axis: Floats) -> tuple[float, float]:
    """From where to where what is seen reaches along an axis."""
    along = np.concatenate([np.asarray(mesh.points) @ axis for mesh, _ in panel.parts if mesh.n_points])
    return float(along.min()), float(along.max())


def _size(panel: Panel) -> tuple[float, float]:
    """Width and height of what is seen."""
    right, up = _axes(panel)
    return float(np.ptp(_span(panel, right))), float(np.ptp(_span(panel, up)))
