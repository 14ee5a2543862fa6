"""Densities of a cell as polynomials in it, and back."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import basix
import numpy as np

from growthx.discretisation.variants import AtPoints
from growthx.meshing.sampling import volume_ratios

if TYPE_CHECKING:
    from growthx.common.arrays import Floats
    from growthx.meshing.mesh import Mesh

HIGHEST = 8  # degree of polynomials through the integration points of a cell


def values_in_cell(density: Any, element: Any, X: Floats) -> Floats:
    """What each density of a cell adds at points X, (points, dim), of the reference cell, (points, densities).

    Densities at integration points are those of the polynomial through them, or nearest to them.
    """
    if not isinstance(density, AtPoints):
        return np.asarray(density.shares(element, X))
    points, weights = element.custom_quadrature()
    root = np.sqrt(weights)[:, np.newaxis]
    fit = np.linalg.pinv(root * through(element.cell_type, points, points)) * root.T
    return through(element.cell_type, points, X) @ fit


def through(cell: basix.CellType, points: Floats, X: Floats) -> Floats:
    """Polynomials that values at some points of a cell determine, at points X, shape (points of X, polynomials)."""
    known, degree = 1, 0
    for higher in range(1, HIGHEST + 1):
        more = _polynomials(cell, higher, points)
        if more.shape[1] > len(points) or np.linalg.matrix_rank(more, tol=1e-8) < more.shape[1]:
            break
        known, degree = more.shape[1], higher
    return _polynomials(cell, degree, X) if known > 1 else np.ones((len(X), 1))


def _polynomials(cell: basix.CellType, degree: int, X: Floats) -> Floats:
    return np.asarray(basix.tabulate_polynomials(basix.PolynomialType.legendre, cell, degree, X)).T


def volumes_of_densities(mesh: Mesh, density: Any, element: Any, degree: int) -> Floats:
    """∫ N dV of each owned cell's densities, by a rule, (owned cells, densities of a cell): of what mass is made."""
    X, weights = (np.asarray(part) for part in basix.make_quadrature(basix.CellType[mesh.cell_name], degree))
    return np.asarray((weights * volume_ratios(mesh, X)) @ density.shares(element, X))


def limited(values: Floats, weights: Floats, means: Floats, low: Floats, high: Floats) -> Floats:
    """Values of each cell, (cells, values), drawn to their mean until they are within bounds, (cells,); means stay.

    weights: of the values in the mean.  means: that they are to have, (cells,).
    """
    values = values + (means - np.einsum("ci,ci->c", weights, values) / weights.sum(axis=1))[:, np.newaxis]
    low, high = np.minimum(low, means), np.maximum(high, means)
    share = np.ones(len(values))
    for room, reach in ((high - means, values.max(axis=1) - means), (means - low, means - values.min(axis=1))):
        np.minimum(share, np.divide(room, reach, out=np.ones(len(values)), where=reach > room), out=share)
    return means[:, np.newaxis] + share[:, np.newaxis] * (values - means[:, np.newaxis])
