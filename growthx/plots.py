"""Pictures of results with pyvista, made on rank 0."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from growthx.errors import GrowthxError, InputError
from growthx.sampling import positions
from growthx.variants import AtPoints, Nodal

if TYPE_CHECKING:
    from growthx.arrays import Floats, Indices
    from growthx.discretisation import Discretisation
    from growthx.scene import DistributedForce

    Arrow = tuple[DistributedForce, Floats]  # a force and where it acts

COLOUR_MAP = "viridis"  # reads the same with and without colour vision
PICTURE = (1200, 1400)
COLOUR_BAR = {
    "vertical": True,
    "color": "black",
    "title_font_size": 34,
    "label_font_size": 30,
    "position_x": 0.82,
    "position_y": 0.08,
    "height": 0.45,
    "width": 0.08,
    "fmt": "%.2f",
}
ARROW_COLOURS = ("#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#000000")


def density(
    problem: Discretisation,
    path: str | os.PathLike[str],
    *,
    title: str = "density",
    relative: bool = False,
    magnification: float = 1.0,
    loads: bool = True,
) -> None:
    """Draw the density, raw, on the deformed shape of a plane body and save it as PNG.

    title: of the colour bar, with the unit.  relative: draw [ρ − ρ*]/ρ* instead.  magnification: of the displacement.
    loads: draw distributed forces as arrows, one colour for each load case.
    Densities at integration points are drawn over the part of the cell that belongs to the point.
    """
    mesh = problem.scene.mesh
    if mesh.dim != 2:
        raise InputError(
            f"the body has {mesh.dim} dimensions: pictures are drawn of plane ones, ParaView draws the others"
        )
    X, pieces, middles = _pieces(mesh.cell_name, _ticks(problem))
    at_corners = isinstance(problem.variant.density, Nodal)
    values = problem.density_at(X if at_corners else middles)
    if relative:
        values = values / problem.scene.material.reference_density - 1
    reference = positions(mesh, X)
    deformed = reference.copy()
    deformed[:, :, :2] += magnification * problem.displacement_at(X)
    gathered = problem.comm.gather((reference, deformed, values))
    arrows = _arrows(problem) if loads else []
    failure: Exception | None = None
    if gathered is not None:
        try:
            at_rest, shape, parts = (np.concatenate(part) for part in zip(*gathered, strict=True))
            _draw(_Body(at_rest, shape, pieces, parts, at_corners), arrows, title, Path(path))
        except Exception as error:  # the other ranks must hear of it whatever it is
            failure = error
    if problem.comm.bcast(failure is not None):
        raise failure or GrowthxError(f"the picture {path} could not be drawn")


def along_length(
    problems: Mapping[str, Discretisation],
    path: str | os.PathLike[str],
    *,
    exact: Mapping[str, Callable[[float], float]] | None = None,
) -> None:
    """Plot ρ over x along the lower edge of bars of one row of quadrilaterals, as each variant knows it, to a PNG.

    problems: results by label.  exact: densities as functions of x by label, drawn as dashed lines.
    """
    curves = {label: _profile(problem) for label, problem in problems.items()}
    comm = next(iter(problems.values())).comm
    if comm.rank != 0:
        return
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 5.5), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot(xlabel="position along the bar", ylabel="density")
    for (label, (x, rho)), colour in zip(curves.items(), ARROW_COLOURS, strict=False):
        axes.plot(x, rho, label=label, color=colour, linewidth=1.5)
    for label, function in (exact or {}).items():
        x = np.linspace(1e-6, 1 - 1e-6, 401)
        axes.plot(x, [function(at) for at in x], label=label, color="black", linestyle="--", linewidth=1)
    axes.grid(color="0.9")
    axes.legend(frameon=False)
    figure.savefig(path, dpi=150)


def _profile(problem: Discretisation) -> tuple[Floats, Floats]:
    """Positions along the lower edge and densities there, gathered on rank 0, in order."""
    s = np.linspace(1e-9, 1 - 1e-9, 41)
    X = np.stack([s, np.zeros_like(s)], axis=1)
    parts = problem.comm.gather((positions(problem.scene.mesh, X)[:, :, 0], problem.density_at(X)))
    if parts is None:
        return np.empty(0), np.empty(0)
    x, rho = (np.concatenate(part).ravel() for part in zip(*parts, strict=True))
    order = np.argsort(x, kind="stable")
    return x[order], rho[order]


def _ticks(problem: Discretisation) -> Floats:
    """Where a cell is cut, per direction, so that each part belongs to one integration point."""
    if isinstance(problem.variant.density, AtPoints) and problem.scene.mesh.cell_name == "quadrilateral":
        gauss = np.unique(problem.density_space.ufl_element().custom_quadrature()[0][:, 0].round(12))
        return np.concatenate([[0.0], (gauss[1:] + gauss[:-1]) / 2, [1.0]])
    return np.array([0.0, 1.0])


def _pieces(cell_name: str, ticks: Floats) -> tuple[Floats, Indices, Floats]:
    """Points of the reference cell, the pieces they span (anticlockwise), and the pieces' middles."""
    if cell_name == "triangle":
        return np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]), np.array([[0, 1, 2]]), np.array([[1 / 3, 1 / 3]])
    k = len(ticks)
    X = np.stack(np.meshgrid(ticks, ticks, indexing="ij"), axis=-1).reshape(-1, 2)
    first = (np.arange(k - 1)[:, np.newaxis] * k + np.arange(k - 1)).ravel()
    pieces = np.stack([first, first + k, first + k + 1, first + 1], axis=1)
    return X, pieces, X[pieces].mean(axis=1)


def _arrows(problem: Discretisation) -> list[Arrow]:
    """Distributed forces and where they act: the mean position of the boundary, weighted by traction."""
    import dolfinx

    from growthx.scene import DistributedForce

    mesh = problem.scene.mesh
    arrows: list[Arrow] = []
    for load in problem.scene.loads:
        if not isinstance(load, DistributedForce):
            continue
        facets = mesh.boundary(load.on)
        middles = dolfinx.mesh.compute_midpoints(mesh.domain, mesh.dim - 1, facets)
        size = np.linalg.norm(load.intensity(middles.T), axis=0) if len(facets) else np.zeros(0)
        total = problem.comm.allreduce(np.append(size @ middles, size.sum()))
        arrows.append((load, total[:2] / total[3]))
    return arrows


@dataclass(frozen=True)
class _Body:
    """A plane body in loose pieces, gathered on rank 0."""

    reference: Floats  # corners of the pieces at rest and deformed, shape (cells, corners, 3)
    deformed: Floats
    pieces: Indices  # corners of each piece of a cell, anticlockwise
    values: Floats  # per corner or per piece, shape (cells, corners or pieces)
    at_corners: bool

    def surface(self, shape: Floats) -> Any:
        """The pieces as a pyvista surface."""
        import pyvista

        cells, corners = shape.shape[:2]
        polygons = (np.arange(cells)[:, np.newaxis, np.newaxis] * corners + self.pieces).reshape(
            -1, self.pieces.shape[1]
        )
        faces = np.insert(polygons, 0, polygons.shape[1], axis=1)
        return pyvista.PolyData(shape.reshape(-1, 3), faces=faces.ravel())


def _draw(body: _Body, arrows: list[Arrow], title: str, path: Path) -> None:
    import pyvista

    surface = body.surface(body.deformed)
    (surface.point_data if body.at_corners else surface.cell_data)[title] = body.values.ravel()
    outline = (
        body.surface(body.reference)
        .clean(tolerance=1e-6)
        .extract_feature_edges(boundary_edges=True, feature_edges=False, manifold_edges=False)
    )
    with _display():
        plotter = pyvista.Plotter(off_screen=True, window_size=PICTURE)
        plotter.set_background("white")
        colour_bar = COLOUR_BAR | {"title": f"{title}\n"}  # the line break keeps the title clear of the labels
        plotter.add_mesh(surface, scalars=title, cmap=COLOUR_MAP, lighting=False, scalar_bar_args=colour_bar)
        plotter.add_mesh(outline, color="grey", line_width=1.5, lighting=False)
        if legend := _add_arrows(plotter, outline, arrows):
            plotter.add_legend(
                legend, bcolor="white", face="rectangle", size=(0.4, 0.03 * len(legend)), loc="upper left"
            )
        plotter.view_xy()
        plotter.camera.zoom(1.25)
        plotter.screenshot(str(path))
        plotter.close()


def _add_arrows(plotter: Any, outline: Any, arrows: list[Arrow]) -> list[tuple[str, str]]:
    """Draw the forces in proportion, pushing on the body or pulling at it; entries of the legend, one per load case."""
    import pyvista

    if not arrows:
        return []
    extent = max(outline.bounds[1] - outline.bounds[0], outline.bounds[3] - outline.bounds[2])
    scale = 0.22 * extent / max(float(np.linalg.norm(load.force)) for load, _ in arrows)
    centre = np.array(outline.center[:2])
    cases = dict.fromkeys(load.case for load, _ in arrows)
    colours = {case: ARROW_COLOURS[i % len(ARROW_COLOURS)] for i, case in enumerate(cases)}
    # The small ones on top, where they would hide behind the large.
    for height, (load, place) in enumerate(sorted(arrows, key=_size), start=1):
        arrow = scale * np.array(load.force)
        length = float(np.linalg.norm(arrow))
        start = place - arrow if arrow @ (place - centre) < 0 else place
        thickness = 0.006 * extent / length
        shape = pyvista.Arrow(
            start=(*start, 0.01 * extent * height),
            direction=(*arrow, 0.0),
            scale=length,
            shaft_radius=thickness,
            tip_radius=2.5 * thickness,
            tip_length=min(0.6, 6 * thickness),
        )
        plotter.add_mesh(shape, color=colours[load.case], lighting=False)
    return list(colours.items())


def _size(arrow: Arrow) -> float:
    """The size of a force, negative: sorts the largest first."""
    return -float(np.linalg.norm(arrow[0].force))


@contextmanager
def _display() -> Iterator[None]:
    """Debian's VTK draws on an X server: an invisible one where there is none."""
    if os.environ.get("DISPLAY") or os.name == "nt":
        yield
        return
    read, write = os.pipe()
    try:
        server = subprocess.Popen(
            ["Xvfb", "-displayfd", str(write), "-screen", "0", "1600x1600x24", "-nolisten", "tcp"],
            pass_fds=(write,),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
    except FileNotFoundError:
        raise GrowthxError("no picture without a display: set DISPLAY or install Xvfb") from None
    os.close(write)
    with os.fdopen(read) as answer:
        number = answer.readline().strip()
    os.environ["DISPLAY"] = f":{number}"
    try:
        yield
    finally:
        del os.environ["DISPLAY"]
        server.terminate()
        server.wait()
