"""Cells cut into the parts of their integration points: they fill the cell, each around its own point."""

import basix
import basix.ufl
import numpy as np
import pytest

from growthx.common.errors import InputError
from growthx.post.subcells import subcells, uniform

RULES = [
    *(("quadrilateral", degree) for degree in (1, 3, 5, 7)),
    *(("hexahedron", degree) for degree in (1, 3, 5)),
    *((simplex, degree) for simplex in ("triangle", "tetrahedron") for degree in (1, 2)),
]
VOLUME = {"quadrilateral": 1.0, "hexahedron": 1.0, "triangle": 1 / 2, "tetrahedron": 1 / 6}


def points_of(cell, degree):
    """Points and weights of a rule."""
    return basix.make_quadrature(basix.CellType[cell], degree)


def volumes(parts):
    """Volume of each piece; NaN if it is turned over or folded somewhere."""
    element = basix.ufl.element("Lagrange", parts.shape, 1)
    points, weights = points_of(parts.shape, 4)
    jacobian = np.einsum("dqn,pni->pqid", element.tabulate(1, points)[1:], parts.X[parts.pieces])
    size = np.linalg.det(jacobian)
    return np.where(size.min(axis=1) > 0, size @ weights, np.nan)


@pytest.mark.parametrize(("cell", "degree"), RULES)
def test_the_pieces_fill_the_cell(cell, degree):
    """A gap or an overlap would show as a hole, or hide a value, in a picture; a piece turned over is not drawn."""
    parts = subcells(cell, points_of(cell, degree)[0])
    assert volumes(parts).sum() == pytest.approx(VOLUME[cell], rel=1e-14)


@pytest.mark.parametrize(("cell", "degree"), RULES)
def test_each_piece_is_around_its_own_point(cell, degree):
    """Every point has one piece, and lies inside it: in the frame of the piece's corners it is no corner or outside."""
    points, _ = points_of(cell, degree)
    parts = subcells(cell, points)
    assert sorted(parts.points) == list(range(len(points)))
    corners = parts.X[parts.pieces]
    inside = (corners.min(axis=1) < points[parts.points]) & (points[parts.points] < corners.max(axis=1))
    assert inside.all()


@pytest.mark.parametrize("cell", ["triangle", "tetrahedron"])
def test_corners_of_a_simplex_are_alike(cell):
    """A simplex has no first corner: its points' parts have the same volume."""
    parts = subcells(cell, points_of(cell, 2)[0])
    assert volumes(parts) == pytest.approx(VOLUME[cell] / len(parts.pieces), rel=1e-14)


def test_shares_agree_with_the_pieces():
    """A mean over a zone gives each place the density of the piece that is drawn there."""
    from growthx.discretisation.variants import P2, Q2, S2fri

    for variant in (Q2, S2fri, P2):
        for cell in variant.cells:
            element = variant.density_element(cell)
            parts = subcells(cell, element.custom_quadrature()[0])
            corners = parts.X[parts.pieces]
            middles = corners.mean(axis=1, keepdims=True)
            towards = middles + 0.9 * (corners - middles)
            for point, places in zip(parts.points, towards, strict=True):
                assert np.all(variant.density.shares(element, places).argmax(axis=1) == point)


def test_other_rules_are_refused():
    """Six points of a triangle have no parts of one shape: a sentence, not a picture with values misplaced."""
    with pytest.raises(InputError) as caught:
        subcells("triangle", points_of("triangle", 4)[0])
    assert str(caught.value).startswith("a triangle with 6 integration points cannot be cut into one piece for each: ")


@pytest.mark.parametrize(("cell", "parts", "pieces"), [("triangle", 3, 9), ("quadrilateral", 3, 9), ("triangle", 1, 1)])
def test_a_lattice_has_equal_pieces(cell, parts, pieces):
    """Continuous densities of higher degree are drawn on it: equal pieces that fill the cell."""
    found = uniform(cell, parts)
    assert volumes(found) == pytest.approx(np.full(pieces, VOLUME[cell] / pieces), rel=1e-13)
