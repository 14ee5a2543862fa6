"""The paper's elements, drawn: where a cell has its displacements, its densities and its integration points."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from mpi4py import MPI

from benchmarks.accuracy.paper_tables.paper import VARIANTS
from benchmarks.shared.pictures import blank
from growthx.discretisation.variants import AtPoints, Nodal
from growthx.meshing.sampling import reference_corners

if TYPE_CHECKING:
    from growthx.common.arrays import Floats
    from growthx.discretisation.variants import Variant

CELL = "quadrilateral"


def displacement_nodes(variant: Variant) -> Floats:
    """Nodes of a cell's displacement, shape (nodes, 2): its corners and, of degree 2, middles of sides and its own."""
    corners = reference_corners(CELL)
    if variant.displacement.degree == 1:
        return corners
    grid = np.array([(x, y) for x in (0.0, 0.5, 1.0) for y in (0.0, 0.5, 1.0)])
    nodes = variant.displacement_element(CELL, 2).dim // 2
    return grid if nodes == len(grid) else grid[(grid != 0.5).any(axis=1)]


def density_places(variant: Variant) -> Floats:
    """Where a cell has its densities, shape (densities, 2)."""
    if isinstance(variant.density, Nodal):
        return np.asarray(variant.density_element(CELL).basix_element.points)
    return variant.integration_points(CELL) if isinstance(variant.density, AtPoints) else np.array([[0.5, 0.5]])


def draw_elements(path: Path) -> None:
    """A panel for each variant, on rank 0."""
    if MPI.COMM_WORLD.rank != 0:
        return
    figure = blank(9, 5)
    square = np.array([(0, 0), (1, 0), (1, 1), (0, 1), (0, 0)])
    for axes, variant in zip(figure.subplots(2, 4).flat, VARIANTS, strict=True):
        axes.plot(*square.T, color="0.6", linewidth=1.5, zorder=0)
        for places, look, label in (
            (density_places(variant), {"marker": "o", "ms": 14, "mfc": "white", "mec": "black"}, "density"),
            (displacement_nodes(variant), {"marker": "o", "ms": 7, "color": "black"}, "displacement"),
            (
                variant.integration_points(CELL),
                {"marker": "x", "ms": 7, "mew": 1.8, "color": "#d55e00"},
                "integration point of momentum",
            ),
        ):
            axes.plot(*places.T, linestyle="none", label=label, zorder=2, clip_on=False, **look)
        axes.set_title(variant.name)
        axes.set_aspect("equal")
        axes.margins(0.15)
        axes.set_axis_off()
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False)
    figure.savefig(path, dpi=110)
