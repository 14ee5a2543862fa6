"""Panels of a picture in space: what is seen in each, from where, and all of them beside their colour bar."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from growthx.post.colour_bars import WIDTH as BAR_WIDTH
from growthx.post.colour_bars import Scale, add_colour_bars, font, write_in_greek
from growthx.post.display import display
from growthx.post.drawing import ARROW_COLOURS, COLOUR_MAP, PANEL_WIDTH, RESTING_COLOUR, TEXT_HEIGHT
from growthx.post.space.body import MOVED, VALUE, SpaceBody

if TYPE_CHECKING:
    from growthx.common.arrays import Floats
    from growthx.model.arrows import Arrow
    from growthx.post.space.planes import Plane

OUTSIDE = (0.6, -1.0, 0.5)  # from where the outside is seen
LIGHT = {"ambient": 0.45, "diffuse": 0.6, "specular": 0.0}  # colours in the shade, too, are near those of the bar
NOTHING = "#000000"  # behind a picture in grey, as air is black in a CT
MARGIN = 1.08
ARROW_LENGTH = 0.28  # of the body's extent, of the largest force


@dataclass(frozen=True)
class Panel:
    """What is seen in one part of a picture.

    parts: meshes with pyvista's options of how they look, the coloured ones by `VALUE`.  toward: from where it is seen.
    up: what is upwards.  legend: names and colours.
    """

    label: str
    parts: list[tuple[Any, dict[str, Any]]]
    toward: tuple[float, ...]
    up: tuple[float, ...]
    grey: bool = False
    legend: list[tuple[str, str]] = field(default_factory=list)


def outside(body: SpaceBody, arrows: Sequence[Arrow], label: str = "outside") -> Panel:
    """The whole surface, with the loads."""
    grid = _whole(body)
    parts = _coloured(body, lambda grid: grid.extract_surface(), LIGHT)
    shafts, legend = _arrows(grid.extract_surface(), arrows)
    return Panel(label, parts + shafts, OUTSIDE, (0.0, 0.0, 1.0), legend=legend)


def section(body: SpaceBody, plane: Plane, *, grey: bool = False, label: str = "") -> Panel:
    """Where a plane cuts the body at rest, as that has moved since; grey: as a CT shows it."""
    look: dict[str, Any] = {"lighting": False}
    parts = _coloured(body, lambda grid: grid.slice(normal=plane.normal, origin=plane.point), look)
    if not grey:
        cut = _whole(body).slice(normal=plane.normal, origin=plane.point).warp_by_vector(MOVED)
        border = cut.extract_feature_edges(feature_edges=False, manifold_edges=False, non_manifold_edges=False)
        parts.append((border, {"color": "black", "line_width": 1.5, "lighting": False}))
    return Panel(label or plane.label, parts, plane.normal, plane.up, grey)


def cut_away(body: SpaceBody, plane: Plane, arrows: Sequence[Arrow]) -> Panel:
    """What lies behind a plane, with the loads on the whole body, seen from before it and a little from the side."""
    parts = _coloured(body, lambda grid: grid.clip(normal=plane.normal, origin=plane.point).extract_surface(), LIGHT)
    whole = _whole(body).extract_surface()
    edges = whole.extract_feature_edges(feature_angle=60).warp_by_vector(MOVED)
    parts.append((edges, {"color": "grey", "line_width": 1.0, "lighting": False}))
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
    skin = _whole(body).extract_surface().warp_by_vector(MOVED)
    parts.append((skin, {"color": "#9fb6c8", "opacity": 0.15, "lighting": False}))
    return Panel(label, parts, OUTSIDE, (0.0, 0.0, 1.0))


def _whole(body: SpaceBody) -> Any:
    return body.grid(np.ones(len(body.grows), dtype=bool))


def _coloured(
    body: SpaceBody, seen: Callable[[Any], Any], look: dict[str, Any], *, resting: bool = True
) -> list[tuple[Any, dict[str, Any]]]:
    """What is seen of a body where it has moved to: what grows in colours, the rest plain."""
    parts = []
    for cells, options in ((body.grows, {"scalars": VALUE}), (~body.grows, {"color": RESTING_COLOUR})):
        grid = body.grid(cells) if resting or "scalars" in options else None
        shape = None if grid is None else seen(grid)
        if shape is not None and shape.n_points:
            parts.append((shape.warp_by_vector(MOVED), {**options, **look}))
    return parts


def _arrows(surface: Any, arrows: Sequence[Arrow]) -> tuple[list[tuple[Any, dict[str, Any]]], list[tuple[str, str]]]:
    """The forces in proportion, at the surface of the body: pushing on it, or pulling at it; and their legend."""
    import pyvista

    if not arrows:
        return [], []
    size = surface.length
    scale = ARROW_LENGTH * size / max(arrow.size for arrow in arrows)
    labels = dict.fromkeys(arrow.label for arrow in arrows)
    colours = {label: ARROW_COLOURS[i % len(ARROW_COLOURS)] for i, label in enumerate(labels)}
    centre, shafts = np.array(surface.center), []
    for arrow in arrows:
        shaft, place = scale * np.array(arrow.force), np.array(arrow.place)
        pushes = shaft @ (place - centre) < 0
        way = (-1 if pushes else 1) * shaft / np.linalg.norm(shaft)
        # Where the boundary is curved, the middle of a force lies inside it.
        out, _ = surface.ray_trace(place + 1e-6 * size * way, place + size * way)
        place = out[-1] if len(out) else place
        length = float(np.linalg.norm(shaft))
        radius = 0.006 * size / length
        shape = pyvista.Arrow(
            start=place - shaft if pushes else place,
            direction=shaft,
            scale=length,
            shaft_radius=radius,
            tip_radius=2.5 * radius,
            tip_length=min(0.6, 6 * radius),
        )
        shafts.append((shape, {"color": colours[arrow.label], "lighting": False}))
    return shafts, [(f" {label}", colour) for label, colour in colours.items()]


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
    low, high = (min(0.0, limits[0]), limits[1]) if panel.grey else limits
    for mesh, look in panel.parts:
        colours = {}
        if "scalars" in look:
            colours = {"cmap": "gray" if panel.grey else COLOUR_MAP, "clim": (low, high), "show_scalar_bar": False}
        actor = plotter.add_mesh(mesh, **look, **colours)
        if colours and not panel.grey:
            actor.mapper.lookup_table.nan_color = RESTING_COLOUR
            mapper = actor.mapper
    text = "white" if panel.grey else "black"
    if panel.grey:
        plotter.set_background(NOTHING, all_renderers=False)
    plotter.add_text(panel.label, position="upper_left", color=text, font_size=12, font_file=font())
    plotter.add_axes(color=text, line_width=3)
    if panel.legend:
        size = (0.4, 0.035 * len(panel.legend))
        box = plotter.add_legend(panel.legend, bcolor=None, face="rectangle", size=size, loc="upper right")
        write_in_greek(box.GetEntryTextProperty())
        box.GetEntryTextProperty().SetColor(0.0, 0.0, 0.0)
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
    along = np.concatenate([np.asarray(mesh.points) @ axis for mesh, _ in panel.parts])
    return float(along.min()), float(along.max())


def _size(panel: Panel) -> tuple[float, float]:
    """Width and height of what is seen."""
    right, up = _axes(panel)
    return float(np.ptp(_span(panel, right))), float(np.ptp(_span(panel, up)))
