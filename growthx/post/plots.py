"""Pictures of results with pyvista and matplotlib, made on rank 0."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import dataclass
from itertools import cycle
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from growthx.common.checks import (
    check_picture,
    require_flag,
    require_functions,
    require_whole,
)
from growthx.common.errors import InputError
from growthx.common.renamed import renamed
from growthx.discretisation.checks.arguments import require_problem, require_problems
from growthx.fem.compat import interpolation_points
from growthx.meshing.sampling import positions
from growthx.post.colour_bars import COLOUR_MAP, RESTING_COLOUR, Scale, add_colour_bars, font, write_in_greek
from growthx.post.colour_bars import WIDTH as BAR_WIDTH
from growthx.post.display import display
from growthx.post.drawing import (
    ARROW_COLOURS,
    IMAGES,
    PANEL_WIDTH,
    PICTURE_WIDTH,
    TEXT_HEIGHT,
    arrows_of,
    check_look,
    named,
    on_rank_0,
    second_scale,
)
from growthx.post.movie import movie
from growthx.post.smoothing import smoothed_density
from growthx.post.space.pictures import Look, cutaway, overview, slices, threshold
from growthx.post.subcells import Subcells, subcells, uniform

if TYPE_CHECKING:
    from growthx.common.arrays import Floats
    from growthx.discretisation.discretisation import Discretisation
    from growthx.model.arrows import Arrow
    from growthx.stepping.record import Result

    _Panel = tuple["_Body", list[Arrow]]

__all__ = ["along_length", "cutaway", "densities", "density", "movie", "slices", "threshold"]

# Suffixes of the formats that matplotlib writes.
GRAPHS = (".png", ".pdf", ".svg", ".eps", ".jpg", ".jpeg", ".tif", ".tiff", ".webp")
LINE_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
LINE_STYLES = ("-", "-.", ":")
ROUGH = 4  # straight pieces along an edge that stand for a curved one


@renamed(loads="arrows")
def density(
    problem: Discretisation | Result,
    path: str | os.PathLike[str],
    *,
    title: str = "",
    relative: bool = False,
    scale: str = "",
    smoothed: bool = False,
    magnification: float = 1.0,
    arrows: bool = True,
) -> None:
    """Draw the density on the deformed shape of a body and save it, as the path's suffix says (see `IMAGES`).

    problem: a result, or its problem.
    Of a body in space: its outside, and the middle slice across its shortest extent; `slices`, `threshold` and
    `cutaway` draw others.
    What does not grow is plain grey, as is said below the colours, and has no part in their range.
    relative: draw [ρ − ρ*]/ρ* instead, as the paper does.  magnification: of the displacement.
    title: of the colour bar, with the unit; default: what is drawn, without one.
    scale: title of a second scale, of ρ, beside that of a relative change; none if empty.
    smoothed: draw the density extrapolated to the corners of the cells and averaged there, instead of the raw one,
    which is constant over the part of a cell that belongs to an integration point.
    arrows: draw the arrows that dead loads have (`Load.arrow`), as distributed forces do, a colour for each load case.
    Raises InputError, before anything is drawn, for a picture that could not be written, and for a second scale where
    nothing relative is drawn or ρ* is not the same everywhere.

    Example:
        >>> result = gx.solve(gx.scenes.plate(2), gx.Q1P0)
        >>> gx.plots.density(result, "plate.png", title="density")
    """
    problem = require_problem(problem)
    if problem.scene.mesh.dim == 3:
        overview(problem, path, Look("density", title, relative, scale, smoothed, magnification), arrows=arrows)
        return
    require_flag(arrows, "arrows, of a picture,")
    check_look(title, relative, scale, smoothed, magnification)
    check_picture(path, IMAGES, problem.comm)
    second = second_scale([problem], scale)
    panel = _body(problem, relative, smoothed, magnification), arrows_of(problem) if arrows else []
    on_rank_0(problem, path, lambda: _draw({"": panel}, named(title, relative), second, Path(path), 1, PICTURE_WIDTH))


def densities(
    problems: Mapping[str, Discretisation | Result],
    path: str | os.PathLike[str],
    *,
    title: str = "",
    relative: bool = False,
    scale: str = "",
    smoothed: bool = False,
    magnification: float = 1.0,
    columns: int = 4,
) -> None:
    """Draw the densities of several plane bodies side by side, in one range of colours, and save them.

    problems: results, or their problems, by the text above each.  columns: most of them in a row.  Everything else as
    for `density`.

    Example:
        >>> results = {variant.name: gx.solve(gx.scenes.plate(2), variant) for variant in (gx.Q1P0, gx.Q1)}
        >>> gx.plots.densities(results, "plates.png", title="density", columns=2)
    """
    bodies = require_problems(problems)
    require_whole(columns, "the number of columns")
    check_look(title, relative, scale, smoothed, magnification)
    first = next(iter(bodies.values()))
    check_picture(path, IMAGES, first.comm)
    second = second_scale(list(bodies.values()), scale)
    panels: dict[str, _Panel] = {
        label: (_body(problem, relative, smoothed, magnification), []) for label, problem in bodies.items()
    }
    on_rank_0(first, path, lambda: _draw(panels, named(title, relative), second, Path(path), columns, PANEL_WIDTH))


def along_length(
    problems: Mapping[str, Discretisation | Result],
    path: str | os.PathLike[str],
    places: Floats,
    *,
    relative: bool = False,
    exact: Mapping[str, Callable[[float], float]] | None = None,
) -> None:
    """Plot ρ over x at places along a bar, (places, dim), as each variant knows it (formats: `GRAPHS`).

    There are gaps where nothing grows.

    problems: results, or their problems, by label.  relative: plot [ρ − ρ*]/ρ* instead, as the paper does.
    exact: functions of x by label, of what is plotted, drawn as dashed lines.
    Raises InputError, before anything is drawn, for a picture that could not be written and for what are no places.

    Example:
        >>> import numpy as np
        >>> places = np.column_stack([np.linspace(0.0, 1.0, 101), np.zeros(101)])
        >>> bars = {variant.name: gx.discretise(gx.scenes.bar(), variant) for variant in (gx.Q1P0, gx.Q2)}
        >>> gx.plots.along_length(bars, "bar.png", places)
    """
    bodies = require_problems(problems)
    require_flag(relative, "relative, of a picture,")
    if exact is not None:
        require_functions(exact, "the exact densities")
    first = next(iter(bodies.values()))
    check_picture(path, GRAPHS, first.comm, by="matplotlib")
    curves = {
        label: problem.sample_density_change(places) if relative else problem.sample_density(places)
        for label, problem in bodies.items()
    }
    for label, problem in bodies.items():
        if problem.rests:
            curves[label][problem.sample_growing(places) == 0] = np.nan
    x = np.asarray(places)[:, 0]
    if not len(x):
        raise InputError("there are no places to plot a density at: two or more along a line would be right")
    on_rank_0(first, path, lambda: _plot(curves, x, exact or {}, named("", relative), Path(path)))


def _plot(
    curves: Mapping[str, Floats], x: Floats, exact: Mapping[str, Callable[[float], float]], title: str, path: Path
) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 5.5), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot(xlabel="position along the bar", ylabel=title)
    looks = zip(cycle(LINE_COLOURS), (style for style in cycle(LINE_STYLES) for _ in LINE_COLOURS), strict=False)
    for (label, rho), (colour, style) in zip(curves.items(), looks, strict=False):
        axes.plot(x, rho, style, label=label, color=colour, linewidth=1.5)
    for label, function in exact.items():
        axes.plot(x, [function(at) for at in x], label=label, color="black", linestyle="--", linewidth=1)
    axes.grid(color="0.9")
    axes.legend(frameon=False)
    figure.savefig(path, dpi=150)


@dataclass(frozen=True)
class _Body:
    """A plane body in loose pieces, gathered on rank 0; elsewhere, this rank's part."""

    reference: Floats  # corners of the pieces at rest and deformed, shape (cells, corners, 3)
    deformed: Floats
    parts: Subcells
    values: Floats  # per corner or per piece, shape (cells, corners or pieces); NaN where nothing grows
    at_corners: bool

    def surface(self, shape: Floats) -> Any:
        """The pieces as a pyvista surface."""
        import pyvista

        cells, corners = shape.shape[:2]
        around = self.parts.pieces[:, [0, 1, 3, 2] if self.parts.shape == "quadrilateral" else [0, 1, 2]]
        polygons = (np.arange(cells)[:, np.newaxis, np.newaxis] * corners + around).reshape(-1, around.shape[1])
        faces = np.insert(polygons, 0, polygons.shape[1], axis=1)
        return pyvista.PolyData(shape.reshape(-1, 3), faces=faces.ravel())

    def coloured(self, title: str) -> Any:
        """The deformed pieces with their values."""
        surface = self.surface(self.deformed)
        (surface.point_data if self.at_corners else surface.cell_data)[title] = self.values.ravel()
        return surface

    def extent(self) -> Floats:
        """Width and height, at rest and deformed together."""
        places = np.concatenate([self.reference, self.deformed]).reshape(-1, 3)
        return np.ptp(places[:, :2], axis=0)

    def outline(self) -> Any:
        """The border of the body at rest."""
        return (
            self.surface(self.reference)
            .clean(tolerance=1e-6)
            .extract_feature_edges(boundary_edges=True, feature_edges=False, manifold_edges=False)
        )


def _body(problem: Discretisation, relative: bool, smoothed: bool, magnification: float) -> _Body:
    mesh = problem.scene.mesh
    if mesh.dim != 2:
        raise InputError(
            f"the body has {mesh.dim} dimensions: several side by side are drawn of plane ones, gx.plots.density and "
            "gx.plots.slices draw one of the others"
        )
    parts, values = _values(problem, relative, smoothed)
    at_corners = smoothed or not problem.variant.density.local
    reference = positions(mesh, parts.X)
    deformed = reference.copy()
    deformed[:, :, :2] += magnification * problem.displacement_at(parts.X)
    values[problem.spaces.resting_cells] = np.nan
    gathered = problem.comm.gather((reference, deformed, values)) or [(reference, deformed, values)]
    at_rest, shape, known = (np.concatenate(part) for part in zip(*gathered, strict=True))
    return _Body(at_rest, shape, parts, known, at_corners)


def _values(problem: Discretisation, relative: bool, smoothed: bool) -> tuple[Subcells, Floats]:
    """Pieces of a cell, and what is drawn of each owned cell's pieces or, where it is continuous, at their corners."""
    cell_name, space, density = problem.scene.mesh.cell_name, problem.density_space, problem.variant.density
    of_cells = problem.density_changes_of_cells() if relative else problem.densities_of_cells()
    if smoothed:
        smooth = smoothed_density(problem, of_cells=of_cells)
        cells = len(problem.scene.mesh.owned_cells)
        return uniform(cell_name, 1), smooth.x.array[smooth.function_space.dofmap.list[:cells]]
    if density.local:
        parts = subcells(cell_name, interpolation_points(space.element))
        return parts, of_cells[:, parts.points]
    parts = uniform(cell_name, 1 if space.element.basix_element.degree == 1 else ROUGH)
    return parts, of_cells @ density.shares(space.ufl_element(), parts.X).T


def _draw(
    panels: Mapping[str, _Panel], title: str, reference: tuple[str, float] | None, path: Path, columns: int, width: int
) -> None:
    """Draw panels of that width (pixels) in a grid, in one range of colours and one scale, beside their colour bar.

    reference: title of a second scale, of the density that changes, and its ρ*; None for no such scale.
    """
    import pyvista

    columns = min(columns, len(panels))
    rows = -(-len(panels) // columns)
    bodies = [body for body, _ in panels.values()]
    proportion = max(height / across for across, height in (body.extent() for body in bodies))
    height = round(width * min(2.0, max(0.5, proportion))) + 2 * TEXT_HEIGHT
    limits = min(np.nanmin(body.values) for body in bodies), max(np.nanmax(body.values) for body in bodies)
    scales = [Scale(title, *limits)]
    if reference is not None:
        scales.append(Scale(reference[0], *(reference[1] * (1 + limit) for limit in limits)))
    options = {
        "window_size": (columns * width + len(scales) * BAR_WIDTH, rows * height),
        "shape": (rows, columns + 1),
        "col_weights": [width] * columns + [len(scales) * BAR_WIDTH],
        "groups": [(slice(None), columns)],
        "border": False,
    }
    # Closed before the display goes, whatever happens in between: else it takes the process with it.
    with display(), closing(pyvista.Plotter(off_screen=True, **options)) as plotter:
        plotter.set_background("white")
        for place, (label, (body, arrows)) in zip(np.ndindex(rows, columns), panels.items(), strict=False):
            plotter.subplot(*place)
            outline, mapper = _add_body(plotter, body, title, limits)
            if legend := _add_arrows(plotter, outline, arrows):
                size = (0.4, 0.03 * len(legend))
                box = plotter.add_legend(legend, bcolor="white", face="rectangle", size=size, loc="upper left")
                write_in_greek(box.GetEntryTextProperty())
            if label:
                plotter.add_text(label, position="upper_left", color="black", font_size=14, font_file=font())
        _look_from_above(plotter, list(np.ndindex(rows, columns))[: len(panels)], (width, height - 2 * TEXT_HEIGHT))
        plotter.subplot(0, columns)
        rests = any(np.isnan(body.values).any() for body in bodies)
        add_colour_bars(plotter, mapper, scales, rests)
        plotter.screenshot(str(path))


def _look_from_above(plotter: Any, places: list[tuple[int, ...]], room: tuple[int, int]) -> None:
    """Show what is in each panel in the same scale, as large as `room` (pixels) lets the largest be."""
    sizes = []
    for place in places:
        plotter.subplot(*place)
        left, right, low, high, *_ = plotter.renderer.bounds
        sizes.append(max((right - left) / room[0], (high - low) / room[1]))
    for place in places:
        plotter.subplot(*place)
        plotter.view_xy()
        plotter.enable_parallel_projection()
        plotter.camera.parallel_scale = 0.52 * max(sizes) * (room[1] + 2 * TEXT_HEIGHT)


def _add_body(plotter: Any, body: _Body, title: str, limits: tuple[float, float]) -> tuple[Any, Any]:
    """Draw the deformed body and its outline at rest; returns the outline and what maps densities to colours."""
    surface, outline = body.coloured(title), body.outline()
    options = {"cmap": COLOUR_MAP, "clim": limits, "nan_color": RESTING_COLOUR, "lighting": False}
    actor = plotter.add_mesh(surface, scalars=title, show_scalar_bar=False, **options)
    plotter.add_mesh(outline, color="grey", line_width=1.5, lighting=False)
    return outline, actor.mapper


def _add_arrows(plotter: Any, outline: Any, arrows: list[Arrow]) -> list[tuple[str, str]]:
    """Draw the forces in proportion, pushing on the body or pulling at it; entries of the legend, one per label."""
    import pyvista

    if not arrows:
        return []
    extent = max(outline.bounds[1] - outline.bounds[0], outline.bounds[3] - outline.bounds[2])
    scale = 0.22 * extent / max(arrow.size for arrow in arrows)
    centre = np.array(outline.center[:2])
    labels = dict.fromkeys(arrow.label for arrow in arrows)
    colours = {label: ARROW_COLOURS[i % len(ARROW_COLOURS)] for i, label in enumerate(labels)}
    # The small ones on top, where they would hide behind the large.
    for height, arrow in enumerate(sorted(arrows, key=lambda arrow: -arrow.size), start=1):
        shaft, place = scale * np.array(arrow.force), np.array(arrow.place)
        length = float(np.linalg.norm(shaft))
        start = place - shaft if shaft @ (place - centre) < 0 else place
        thickness = 0.006 * extent / length
        shape = pyvista.Arrow(
            start=(*start, 0.01 * extent * height),
            direction=(*shaft, 0.0),
            scale=length,
            shaft_radius=thickness,
            tip_radius=2.5 * thickness,
            tip_length=min(0.6, 6 * thickness),
        )
        plotter.add_mesh(shape, color=colours[arrow.label], lighting=False)
    return [(f" {label}", colour) for label, colour in colours.items()]
