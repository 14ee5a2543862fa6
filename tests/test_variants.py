"""The catalogue of discretisations: points, degrees and names, and how a cell's densities share its area."""

import basix
import numpy as np
import pytest

from growthx.errors import InputError
from growthx.variants import CATALOGUE, Q1, Q1P0, Q1Q1, named

CORNERS = {"quadrilateral": 4, "triangle": 3}
CELLS = sorted(CORNERS)


def inside(cell, count=200):
    """Points of the reference cell, shape (count, 2)."""
    X = np.random.default_rng(0).uniform(size=(count, 2))
    return np.where(X.sum(axis=1, keepdims=True) > 1, 1 - X, X) if cell == "triangle" else X


def gauss(variant, cell):
    """Points and weights of a variant's rule."""
    return basix.make_quadrature(basix.CellType[cell], variant.degree)


@pytest.mark.parametrize("variant", CATALOGUE.values(), ids=lambda variant: variant.name)
def test_two_by_two_points(variant):
    """Spec §2's table: all of these variants integrate both balances with 2 × 2 points."""
    assert (variant.points, variant.degree, variant.points_per_cell("quadrilateral")) == (2, 3, 4)
    points, weights = gauss(variant, "quadrilateral")
    assert np.allclose(np.unique(points.round(12)), 0.5 + np.array([-1, 1]) / np.sqrt(12))
    assert np.allclose(weights, 0.25)


@pytest.mark.parametrize("cell", CELLS)
@pytest.mark.parametrize("variant", CATALOGUE.values(), ids=lambda variant: variant.name)
def test_the_rule_is_as_exact_as_its_degree_says(variant, cell):
    """Simplices have rules of their own: ∫ x³ must be exact there, too."""
    points, weights = gauss(variant, cell)
    assert len(weights) == variant.points_per_cell(cell)
    assert weights @ points[:, 0] ** 3 == pytest.approx({"quadrilateral": 1 / 4, "triangle": 1 / 20}[cell], rel=1e-13)


@pytest.mark.parametrize("cell", CELLS)
def test_degrees_of_freedom_per_cell(cell):
    """What is solved for: displacements at the corners; densities at the corners, per cell or at the points."""
    for variant, densities in ((Q1Q1, CORNERS[cell]), (Q1P0, 1), (Q1, Q1.points_per_cell(cell))):
        assert variant.displacement_element(cell, 2).dim == 2 * CORNERS[cell]
        assert variant.displacement_element(cell, 2).reference_value_shape == (2,)
        assert variant.density_element(cell).dim == densities
        assert variant.density.local == (variant is not Q1Q1)


@pytest.mark.parametrize("cell", CELLS)
@pytest.mark.parametrize("variant", CATALOGUE.values(), ids=lambda variant: variant.name)
def test_shares_sum_to_one(variant, cell):
    """A constant density must have itself as its mean over any zone."""
    X = inside(cell)
    shares = variant.density.shares(variant.density_element(cell), X)
    assert shares.shape == (len(X), variant.density_element(cell).dim)
    assert np.allclose(shares.sum(axis=1), 1.0, rtol=0, atol=1e-14) and shares.min() > -1e-14


@pytest.mark.parametrize("cell", CELLS)
def test_nodal_shares_reproduce_linear_fields(cell):
    """They are the shape functions: anything smoother or rougher would not be the density that was solved for."""
    X, element = inside(cell), Q1Q1.density_element(cell)
    nodes = basix.geometry(basix.CellType[cell])
    assert np.allclose(Q1Q1.density.shares(element, X) @ nodes, X, rtol=0, atol=1e-14)


@pytest.mark.parametrize("cell", CELLS)
def test_the_nearest_point_has_it_all(cell):
    """A density at a point stands for the part of the cell nearest to it: a quarter, on quadrilaterals."""
    element, points = Q1.density_element(cell), gauss(Q1, cell)[0]
    assert np.array_equal(Q1.density.shares(element, points), np.eye(len(points)))
    X = inside(cell)
    owner = Q1.density.shares(element, X).argmax(axis=1)
    distances = np.array([[np.hypot(*(x - point)) for point in points] for x in X])
    assert np.array_equal(distances[np.arange(len(X)), owner], distances.min(axis=1))


@pytest.mark.parametrize("name", ["Q1P0", "q1p0", "Q1p0"])
def test_names_in_any_case(name):
    """On a command line nobody cares for case."""
    assert named(name) is Q1P0


@pytest.mark.parametrize("name", ["Q2Q7", "", "Q"])
def test_an_unknown_name_is_answered_with_the_known_ones(name):
    """A part of a name is no name: "Q" could be any of them."""
    with pytest.raises(InputError) as caught:
        named(name)
    assert str(caught.value) == f"there is no variant '{name}': one of {', '.join(CATALOGUE)} would be right"


def test_catalogue_goes_by_name():
    """The key a user types and the name in results must be one."""
    assert all(variant.name == name for name, variant in CATALOGUE.items()) and {"Q1Q1", "Q1P0", "Q1"} <= set(CATALOGUE)
