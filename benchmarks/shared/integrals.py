"""Integrals over a body, and distances between what two solutions have at its points."""

from __future__ import annotations

from typing import TYPE_CHECKING

import basix
import numpy as np

from growthx.meshing.sampling import volume_ratios

if TYPE_CHECKING:
    import growthx as gx
    from growthx.common.arrays import Floats


def rule(mesh: gx.Mesh, degree: int) -> tuple[Floats, Floats]:
    """Points of the reference cell that integrate a degree, and the volume of each in each cell, (cells, points)."""
    X, weights = basix.make_quadrature(basix.CellType[mesh.cell_name], degree)
    return X, weights * volume_ratios(mesh, X)


def relative(values: Floats, exact: Floats, volumes: Floats) -> float:
    """‖values − exact‖ / ‖exact‖ of numbers or vectors at points with volumes."""
    gaps, sizes = (np.square(each).reshape(len(volumes), -1).sum(axis=1) for each in (values - exact, exact))
    return float(np.sqrt(volumes @ gaps / (volumes @ sizes)))
