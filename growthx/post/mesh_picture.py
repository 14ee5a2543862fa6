"""A picture of a mesh as a file has it: regions, boundaries, and their names."""

from __future__ import annotations

from contextlib import closing
from typing import TYPE_CHECKING, Any

import numpy as np

from growthx.meshing.content import AROUND
from growthx.post.display import display

if TYPE_CHECKING:
    from pathlib import Path

    from growthx.meshing.parts import Parts

REGIONS = ("#a8a8a8", "#7fb3d5", "#d9b26f", "#8fc08f", "#b0a0d0", "#dba0a0", "#c8c860", "#808080")
BOUNDARIES = ("#d55e00", "#0072b2", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
_CELLS = {"triangle": 5, "quadrilateral": 9, "tetrahedron": 10, "hexahedron": 12}  # VTK's numbers
SIZE = (1200, 900)
MOST = 16  # names in the legend


def mesh_picture(parts: Parts, path: Path) -> None:
    """Draw a whole mesh, on this rank: cells in the colour of their region, sides in that of their boundary.

    A body in space is seen from two opposite corners, so that no side of it is hidden.
    """
    import pyvista

    space = parts.dim == 3
    with (
        display(),
        closing(pyvista.Plotter(off_screen=True, window_size=SIZE, shape=(1, 1 + space), border=False)) as plotter,
    ):
        plotter.set_background("white", all_renderers=True)
        for view in range(1 + space):
            plotter.subplot(0, view)
            legend = _draw(plotter, parts)
            if not space:
                plotter.view_xy()
                plotter.enable_parallel_projection()
                continue
            plotter.view_vector((1, 1, 1) if view == 0 else (-1, -1, -1), viewup=(0, 0, 1))
            plotter.enable_lightkit()
        plotter.subplot(0, 0)
        size = (0.25 * (1 + space), 0.035 * min(len(legend), MOST))
        plotter.add_legend(legend[:MOST], bcolor="white", face="rectangle", size=size, loc="upper left")
        plotter.screenshot(str(path))


def _draw(plotter: Any, parts: Parts) -> list[tuple[str, str]]:
    """Put regions and boundaries before the plotter's eye; returns their names and colours."""
    import pyvista

    points = np.pad(parts.points, ((0, 0), (0, 3 - parts.dim)))
    grid = pyvista.UnstructuredGrid({_CELLS[parts.shape]: parts.cells[:, list(AROUND[parts.shape])]}, points)
    legend: list[tuple[str, str]] = []
    # In space half of the light comes from all around: in the shade, too, colours are those of the legend.
    light: dict[str, Any] = {"ambient": 0.5, "diffuse": 0.55} if parts.dim == 3 else {"lighting": False}
    edges = {"show_edges": True, "edge_color": "#707070", "line_width": 0.5}
    for number, (name, rows) in enumerate(parts.regions.items()):
        colour = REGIONS[number % len(REGIONS)]
        plotter.add_mesh(grid.extract_cells(rows), color=colour, **light, **edges)
        legend.append((f" {name}", colour))
    for number, (name, facets) in enumerate(parts.boundaries.items()):
        colour = BOUNDARIES[number % len(BOUNDARIES)]
        whole = facets[(facets >= 0).all(axis=1)]
        if len(whole):
            # The later ones narrower, and in front: where several are, each is seen.
            width = max(3, 15 - 4 * number) if parts.dim == 2 else 0.5
            sides = {"line_width": width, "show_edges": parts.dim == 3}
            actor = plotter.add_mesh(_sides(points, whole, parts.dim), color=colour, **light, **sides)
            actor.mapper.SetResolveCoincidentTopologyToPolygonOffset()
            actor.mapper.SetRelativeCoincidentTopologyPolygonOffsetParameters(0, -66.0 * (number + 1))
        legend.append((f" {name}", colour))
    return legend


def _sides(points: Any, facets: Any, dim: int) -> Any:
    """Facets as lines or as a surface just in front of the cells."""
    import pyvista

    width = facets.shape[1]
    around = facets if width < 4 else facets[:, list(AROUND["quadrilateral"])]
    rows = np.column_stack([np.full(len(around), width), around]).reshape(-1)
    return pyvista.PolyData(points, lines=rows) if dim == 2 else pyvista.PolyData(points, faces=rows)
