"""Reference elements in NumPy alone: corners, edges, faces, shape functions and integration rules.

Written anew, so that a solution is checked by other code than what has found it.  Points have shape (points, dim).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from itertools import permutations, product
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from growthx.common.arrays import Floats

# In DOLFINx's order of corners the bits of a corner's number are its coordinates, on tensor cells; on simplices the
# origin comes first.
TENSOR = {"quadrilateral": 2, "hexahedron": 3}
SIMPLEX = {"triangle": 2, "tetrahedron": 3}
DIMENSION = {**TENSOR, **SIMPLEX}
EDGES: dict[str, tuple[tuple[int, ...], ...]] = {
    "triangle": ((1, 2), (0, 2), (0, 1)),
    "quadrilateral": ((0, 1), (0, 2), (1, 3), (2, 3)),
    "tetrahedron": ((2, 3), (1, 3), (1, 2), (0, 3), (0, 2), (0, 1)),
    "hexahedron": ((0, 1), (0, 2), (0, 4), (1, 3), (1, 5), (2, 3), (2, 6), (3, 7), (4, 5), (4, 6), (5, 7), (6, 7)),
}
FACES: dict[str, tuple[tuple[int, ...], ...]] = {
    "triangle": ((0, 1, 2),),
    "quadrilateral": ((0, 1, 2, 3),),
    "tetrahedron": ((1, 2, 3), (0, 2, 3), (0, 1, 3), (0, 1, 2)),
    "hexahedron": ((0, 1, 2, 3), (0, 1, 4, 5), (0, 2, 4, 6), (1, 3, 5, 7), (2, 3, 6, 7), (4, 5, 6, 7)),
}
SIDES = {shape: EDGES[shape] if dim == 2 else FACES[shape] for shape, dim in DIMENSION.items()}
SHAPE_OF_SIDES = {
    "triangle": "interval",
    "quadrilateral": "interval",
    "tetrahedron": "triangle",
    "hexahedron": "quadrilateral",
}


def corners(shape: str) -> Floats:
    """Corners of the reference cell, (corners, dim)."""
    if shape in SIMPLEX:
        return np.vstack([np.zeros(SIMPLEX[shape]), np.eye(SIMPLEX[shape])])
    dim = TENSOR[shape]
    return np.array([[(corner >> axis) & 1 for axis in range(dim)] for corner in range(2**dim)], dtype=float)


# -- integration -------------------------------------------------------------------------------------------------------


def gauss(count: int, dim: int) -> tuple[Floats, Floats]:
    """Gauss points of the unit interval, square or cube, so many per direction, and their weights."""
    x, w = np.polynomial.legendre.leggauss(count)
    points = np.array(list(product((x + 1) / 2, repeat=dim)))
    return points, np.prod(list(product(w / 2, repeat=dim)), axis=1)


def _orbit(*barycentric: float) -> list[tuple[float, ...]]:
    """All places that the same barycentric coordinates in another order mean, without the first of them."""
    return sorted({each[1:] for each in permutations(barycentric)})


# Strang and Fix's rules, on tetrahedra Keast's of degree 4: by shape and degree, barycentric coordinates and weight.
_TABLES: dict[tuple[str, int], tuple[tuple[tuple[float, ...], float], ...]] = {
    ("triangle", 1): (((1 / 3, 1 / 3, 1 / 3), 1 / 2),),
    ("triangle", 2): (((2 / 3, 1 / 6, 1 / 6), 1 / 6),),
    ("triangle", 4): (
        ((0.816847572980459, 0.091576213509771, 0.091576213509771), 0.054975871827661),
        ((0.108103018168070, 0.445948490915965, 0.445948490915965), 0.1116907948390055),
    ),
    ("tetrahedron", 1): (((0.25, 0.25, 0.25, 0.25), 1 / 6),),
    ("tetrahedron", 2): (((0.585410196624969, *[0.138196601125011] * 3), 1 / 24),),
    ("tetrahedron", 4): (
        ((0.5, 0.5, 0.0, 0.0), 0.00317460317460317),
        ((0.6984197043243866, *[0.1005267652252045] * 3), 0.01476497079049678),
        ((0.0568813795204234, *[0.3143728734931922] * 3), 0.02213979111426512),
    ),
}


@cache
def rule(shape: str, degree: int) -> tuple[Floats, Floats]:
    """Points and weights of the rule that a discretisation means by a degree."""
    if shape in TENSOR or shape == "interval":
        return gauss(degree // 2 + 1, TENSOR.get(shape, 1))
    points, weights = [], []
    for barycentric, weight in _TABLES[shape, degree]:
        places = _orbit(*barycentric)
        points += places
        weights += [weight] * len(places)
    return np.array(points), np.array(weights)


# -- shape functions ---------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Element:
    """Scalar shape functions on a reference cell.

    family: "P" (of all polynomials to the degree, per direction on tensor cells) or "S" (serendipity, of degree 2).
    """

    shape: str
    family: str
    degree: int

    @property
    def supports(self) -> list[tuple[int, ...]]:
        """Corners of the corner, edge, face or cell that each function belongs to."""
        found: list[tuple[int, ...]] = [(corner,) for corner in range(len(corners(self.shape)))]
        if self.degree == 2:
            found += EDGES[self.shape]
            if self.family == "P" and self.shape in TENSOR:
                found += FACES[self.shape]
                found += [tuple(range(8))] if self.shape == "hexahedron" else []
        return found

    @property
    def _exponents(self) -> Floats:
        dim, top = DIMENSION[self.shape], self.degree
        every = np.array(list(product(range(top + 1), repeat=dim)))
        if self.shape in SIMPLEX:
            return every[every.sum(axis=1) <= top]
        if self.family == "P":
            return every
        return every[np.where(every > 1, every, 0).sum(axis=1) <= 2]  # superlinear degree

    def _monomials(self, X: Floats) -> Floats:
        return np.prod(X[:, None, :] ** self._exponents, axis=2)

    def _slopes(self, X: Floats) -> Floats:
        exponents = self._exponents
        slopes = []
        for axis in range(X.shape[1]):
            lower = exponents.copy()
            lower[:, axis] = np.maximum(lower[:, axis] - 1, 0)
            slopes.append(exponents[:, axis] * np.prod(X[:, None, :] ** lower, axis=2))
        return np.stack(slopes, axis=2)

    @property
    def _coefficients(self) -> Floats:
        """Of the monomials in each shape function, (monomials, functions)."""
        places, rows = corners(self.shape), []
        for support in self.supports:
            if self.family == "S" and len(support) == 2:  # unknowns of edges are means, not values
                s, w = gauss(2, 1)
                along = places[support[0]] + s * (places[support[1]] - places[support[0]])
                rows.append(w @ self._monomials(along))
            else:
                rows.append(self._monomials(places[list(support)].mean(axis=0)[None])[0])
        return np.linalg.inv(np.array(rows))

    def tabulate(self, X: Floats) -> tuple[Floats, Floats]:
        """Values, (points, functions), and derivatives, (points, functions, dim)."""
        values, slopes = self._monomials(X), self._slopes(X)
        coefficients = _coefficients(self)
        return values @ coefficients, np.einsum("pmi,mf->pfi", slopes, coefficients)


@cache
def _coefficients(element: Element) -> Floats:
    return element._coefficients


def places_on_side(shape: str, side: int, X: Floats) -> tuple[Floats, Floats]:
    """Points of a side's own reference cell in that of the cell, and the tangents there, (dim, dim − 1)."""
    ends = corners(shape)[list(SIDES[shape][side])]
    directions = np.stack([ends[1 + axis] - ends[0] for axis in range(X.shape[1])], axis=1)
    return ends[0] + X @ directions.T, directions
