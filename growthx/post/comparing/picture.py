"""A picture of two densities of one body, and of their difference, by matplotlib on rank 0."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI

from growthx.common.errors import OutputError, raise_on_all
from growthx.meshing.sampling import cells_at

if TYPE_CHECKING:
    from growthx.common.arrays import Floats
    from growthx.discretisation.discretisation import Discretisation

IMAGES = (".png", ".pdf", ".svg", ".jpg", ".jpeg", ".tif", ".tiff")
PIXELS = 400  # along the longer side of the body


def draw(
    problem: Discretisation, one: Floats, two: Floats, *, path: str | os.PathLike[str], labels: Any, unit: str
) -> None:
    """Draw means of the owned cells, (cells,) each, where the body grows; of one in space in its coronal plane.

    What does not grow is grey.
    """
    low, high = _box(problem)
    across = (0, 1) if problem.scene.mesh.dim == 2 else (0, 2)
    ends = [(low[i], high[i]) for i in across]
    step = max(end - start for start, end in ends) / PIXELS
    ticks = [np.arange(start + step / 2, end, step) for start, end in ends]
    places = np.tile((low + high) / 2, (len(ticks[0]) * len(ticks[1]), 1))[:, : problem.scene.mesh.dim]
    for axis, grid in zip(across, np.meshgrid(*ticks, indexing="xy"), strict=True):
        places[:, axis] = grid.ravel()
    cells, _ = cells_at(problem.scene.mesh, places)
    grows = np.isin(cells, problem.growing_cells)
    rests = np.zeros(len(one))
    images: list[Floats] = []
    for values, there in ((one, grows), (two, grows), (rests, (cells >= 0) & ~grows)):
        raster = np.full(len(cells), -np.inf)
        raster[there] = values[cells[there]]
        problem.comm.Allreduce(MPI.IN_PLACE, raster, MPI.MAX)
        images.append(np.where(np.isfinite(raster), raster, np.nan).reshape(len(ticks[1]), len(ticks[0])))
    trouble = ""
    if problem.comm.rank == 0:
        try:
            _draw(
                images, [bound for end in ends for bound in end], "xz" if across[1] == 2 else "xy", path, labels, unit
            )
        except OSError as error:
            reason = error.strerror or str(error)
            trouble = f"the picture {path} cannot be written ({reason}): another folder would be right"
    raise_on_all(problem.comm, trouble, OutputError)


def _box(problem: Discretisation) -> tuple[Floats, Floats]:
    x = problem.scene.mesh.domain.geometry.x
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    problem.comm.Allreduce(np.ascontiguousarray(x.min(axis=0, initial=np.inf)), low, MPI.MIN)
    problem.comm.Allreduce(np.ascontiguousarray(x.max(axis=0, initial=-np.inf)), high, MPI.MAX)
    return low, high


def _draw(
    images: list[Floats], extent: list[Any], axes: str, path: str | os.PathLike[str], labels: Any, unit: str
) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.colors import ListedColormap
    from matplotlib.figure import Figure

    one, two, rests = images
    width, height = extent[1] - extent[0], extent[3] - extent[2]
    tall = 5.5
    figure = Figure(figsize=(3 * max(tall * min(width / height, 2.0), 2.2) + 3.2, tall), layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(1, 3, sharex=True, sharey=True)
    limits = {"vmin": np.nanmin([one, two]), "vmax": np.nanmax([one, two])}
    apart = max(float(np.nanmax(np.abs(one - two))), 1e-12)
    looks = [{"cmap": "viridis", **limits}] * 2 + [{"cmap": "RdBu_r", "vmin": -apart, "vmax": apart}]
    drawn = [
        panel.imshow(image, origin="lower", extent=extent, interpolation="nearest", **look)
        for panel, image, look in zip(panels, (one, two, one - two), looks, strict=True)
    ]
    titles = (*labels, f"{labels[0]} − {labels[1]}")
    for panel, title in zip(panels, titles, strict=True):
        panel.imshow(rests, origin="lower", extent=extent, interpolation="nearest", cmap=ListedColormap(["#8c8c8c"]))
        panel.set_title(title)
        panel.set_facecolor("white" if title != titles[2] else "0.86")
        panel.set_xlabel(axes[0])
        panel.locator_params(nbins=4)
    panels[0].set_ylabel(axes[1])
    figure.colorbar(drawn[1], ax=panels[:2], label=f"density ({unit})" if unit else "density", shrink=0.9)
    figure.colorbar(drawn[2], ax=panels[2], label=f"difference ({unit})" if unit else "difference", shrink=0.9)
    figure.savefig(path, dpi=120)
