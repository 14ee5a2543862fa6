"""The catalogue of discretisations: elements, points and names, and how a cell's densities share its volume."""

import basix
import numpy as np
import pytest
from blocks import block, cube, inside, square

import growthx as gx
from growthx import variants
from growthx.common.errors import InputError
from growthx.discretisation.variants import CATALOGUE
from growthx.fem.cells import SIMPLICES, TENSOR_CELLS

ROWS = [(variant, cell) for variant in CATALOGUE.values() for cell in variant.cells]
rows = pytest.mark.parametrize(("variant", "cell"), ROWS, ids=[f"{variant.name}-{cell}" for variant, cell in ROWS])

# Spec §2's table as functions of the number d of dimensions: nodes of the displacement, momentum points, mass points,
# densities of a cell, and whether a cell's densities are its own.
TABLE = {
    "Q1Q1": (lambda d: 2**d, lambda d: 2**d, lambda d: 2**d, lambda d: 2**d, False),
    "Q2Q2": (lambda d: 3**d, lambda d: 3**d, lambda d: 3**d, lambda d: 3**d, False),
    "S2Q1": (lambda d: 2**d + d * 2 ** (d - 1), lambda d: 2**d, lambda d: 2**d, lambda d: 2**d, False),
    "Q1P0": (lambda d: 2**d, lambda d: 2**d, lambda d: 2**d, lambda d: 1, True),
    "Q1": (lambda d: 2**d, lambda d: 2**d, lambda d: 2**d, lambda d: 2**d, True),
    "Q2": (lambda d: 3**d, lambda d: 3**d, lambda d: 3**d, lambda d: 3**d, True),
    "Q1sri": (lambda d: 2**d, lambda d: 2**d, lambda d: 1, lambda d: 1, True),
    "S2fri": (lambda d: 2**d + d * 2 ** (d - 1), lambda d: 2**d, lambda d: 2**d, lambda d: 2**d, True),
    # A simplex has d + 1 corners, and as many edges as pairs of them; the fewest points that are exact to degree 4
    # without one outside are 6 and 14.
    "P1P1": (lambda d: d + 1, lambda d: d + 1, lambda d: d + 1, lambda d: d + 1, False),
    "P2P2": (lambda d: (d + 1) * (d + 2) // 2, lambda d: {2: 6, 3: 14}[d], lambda d: {2: 6, 3: 14}[d],
             lambda d: (d + 1) * (d + 2) // 2, False),
    "P2P1": (lambda d: (d + 1) * (d + 2) // 2, lambda d: d + 1, lambda d: d + 1, lambda d: d + 1, False),
    "P1P0": (lambda d: d + 1, lambda d: 1, lambda d: 1, lambda d: 1, True),
    "P1": (lambda d: d + 1, lambda d: 1, lambda d: 1, lambda d: 1, True),
    "P2": (lambda d: (d + 1) * (d + 2) // 2, lambda d: d + 1, lambda d: d + 1, lambda d: d + 1, True),
}  # fmt: skip


def dimension(cell):
    """Number of space dimensions of a cell."""
    return len(basix.topology(basix.CellType[cell])) - 1


def rule(cell, degree):
    """Points and weights of the rule for polynomials of a degree."""
    return basix.make_quadrature(basix.CellType[cell], degree)


@rows
def test_the_catalogue_is_the_specs_table(variant, cell):
    """Displacements, densities and the points of both balances per cell: a wrong rule is another discretisation."""
    dim = dimension(cell)
    *counts, local = TABLE[variant.name]
    nodes, momentum_points, mass_points, densities = (count(dim) for count in counts)
    displacement = variant.displacement_element(cell, dim)
    assert (displacement.dim, displacement.reference_value_shape) == (dim * nodes, (dim,))
    assert variant.points_per_cell(cell) == len(rule(cell, variant.momentum_degree)[1]) == momentum_points
    assert len(rule(cell, variant.mass_degree)[1]) == mass_points
    assert (variant.density_element(cell).dim, variant.density.local) == (densities, local)


def test_the_catalogue_has_all_rows():
    """Eight on tensor cells, six on simplices, each for the plane and for space."""
    assert {name: variant.cells for name, variant in CATALOGUE.items()} == {
        name: TENSOR_CELLS if name[0] in "QS" else SIMPLICES for name in TABLE
    }
    assert (TENSOR_CELLS, SIMPLICES) == (("quadrilateral", "hexahedron"), ("triangle", "tetrahedron"))


@pytest.mark.parametrize(
    ("degree", "places"), [(1, [0.0]), (3, [-1 / np.sqrt(3), 1 / np.sqrt(3)]), (5, [-(0.6**0.5), 0, 0.6**0.5])]
)
def test_tensor_cells_have_gauss_points(degree, places):
    """The paper's 1, 2 × 2 and 3 × 3 points; other rules of the same degree would give other densities."""
    points, weights = rule("quadrilateral", degree)
    assert np.allclose(np.unique(points.round(12)), 0.5 + np.array(places) / 2)
    assert weights.sum() == pytest.approx(1.0, rel=1e-14) and weights.min() > 0


@rows
def test_the_rules_are_as_exact_as_their_degrees_say(variant, cell):
    """∫ xᵈ over the cell, for the degree d of either balance: 1/(d + 1), or d!/(d + dim)! on simplices."""
    for degree in {variant.momentum_degree, variant.mass_degree}:
        points, weights = rule(cell, degree)
        exact = (
            np.prod([1 / (degree + i) for i in range(1, dimension(cell) + 1)])
            if cell in SIMPLICES
            else 1 / (degree + 1)
        )
        assert weights @ points[:, 0] ** degree == pytest.approx(exact, rel=1e-13)


@rows
def test_shares_sum_to_one(variant, cell):
    """A constant density must have itself as its mean over any zone."""
    X = inside(cell)
    shares = variant.density.shares(variant.density_element(cell), X)
    assert shares.shape == (len(X), variant.density_element(cell).dim)
    assert np.allclose(shares.sum(axis=1), 1.0, rtol=0, atol=1e-14)


NODAL = [row for row in ROWS if not row[0].density.local]


@pytest.mark.parametrize(("variant", "cell"), NODAL, ids=[f"{variant.name}-{cell}" for variant, cell in NODAL])
def test_nodal_shares_reproduce_what_the_nodes_can(variant, cell):
    """They are the shape functions: anything smoother or rougher would not be the density that was solved for."""
    X, element = inside(cell), variant.density_element(cell)
    nodes, degree = element.basix_element.points, variant.density.degree
    assert np.allclose(variant.density.shares(element, X) @ nodes**degree, X**degree, rtol=0, atol=1e-13)


AT_POINTS = [row for row in ROWS if row[0].name in ("Q1", "Q2", "S2fri", "P2")]


@pytest.mark.parametrize(("variant", "cell"), AT_POINTS, ids=[f"{variant.name}-{cell}" for variant, cell in AT_POINTS])
def test_the_nearest_point_has_it_all(variant, cell):
    """A density at a point stands for the part of the cell nearest to it; on simplices all corners count alike."""
    element, (points, _) = variant.density_element(cell), rule(cell, variant.mass_degree)
    assert np.array_equal(variant.density.shares(element, points), np.eye(len(points)))
    X = inside(cell)
    # A simplex is put on the one with equal sides: the unit vectors of one dimension more.
    equal = [np.column_stack([1 - x.sum(axis=1), x]) if cell in SIMPLICES else x for x in (X, points)]
    distances = np.array([[np.sqrt(np.sum((x - point) ** 2)) for point in equal[1]] for x in equal[0]])
    owner = variant.density.shares(element, X).argmax(axis=1)
    assert np.array_equal(distances[np.arange(len(X)), owner], distances.min(axis=1))


# -- which variant for which cells -------------------------------------------------------------------------------------

PLURALS = {
    "quadrilateral": "quadrilaterals",
    "hexahedron": "hexahedra",
    "triangle": "triangles",
    "tetrahedron": "tetrahedra",
}


@pytest.mark.parametrize("name", TABLE)
@pytest.mark.parametrize("cell", PLURALS)
def test_a_variant_is_for_its_own_cells(name, cell):
    """Q1sri on triangles would run and mean nothing: the sentence names the variants that do."""
    variant = CATALOGUE[name]
    if cell in variant.cells:
        variant.check(cell)
        assert variant in variants.suited(cell)
        return
    with pytest.raises(InputError) as caught:
        variant.check(cell)
    own, others = (
        " and ".join(PLURALS[own] for own in variant.cells),
        [v.name for v in CATALOGUE.values() if cell in v.cells],
    )
    assert str(caught.value) == (
        f"{name} is a discretisation for {own}, and the mesh has {PLURALS[cell]}: {', '.join(others)} would be right"
    )


@pytest.mark.parametrize(
    ("variant", "shape"),
    [(gx.Q1sri, "triangle"), (gx.P1, "quadrilateral"), (gx.Q2, "tetrahedron"), (gx.P2P1, "hexahedron")],
)
def test_a_scene_with_other_cells_is_refused(variant, shape):
    """The sentence must come before anything is assembled, by whatever road a variant was chosen."""
    mesh = square(2, shape=shape) if shape in ("triangle", "quadrilateral") else cube(1, shape=shape)
    scene = block(mesh, loads=())
    with pytest.raises(
        InputError, match=rf"^{variant.name} is a discretisation for .*, and the mesh has {PLURALS[shape]}: "
    ):
        gx.discretise(scene, variant)


def test_the_default_is_one_density_per_cell():
    """The cheapest for the mesh at hand; a shape without one is answered with those that have."""
    assert [variants.default(cell).name for cell in PLURALS] == ["Q1P0", "Q1P0", "P1P0", "P1P0"]
    with pytest.raises(InputError) as caught:
        variants.default("prism")
    assert str(caught.value) == ("the mesh has prisms: triangles, quadrilaterals, tetrahedra, hexahedra would be right")


@pytest.mark.parametrize("density", [variants.AtPoints(), variants.Nodal(1)], ids=["at points", "nodal"])
def test_two_rules_need_a_density_per_cell(density):
    """Densities at points have no value at the other balance's points, and nodal ones would be assembled wrongly."""
    with pytest.raises(InputError) as caught:
        gx.Variant("mine", TENSOR_CELLS, variants.LINEAR, density, 3, 1, "two rules")
    assert str(caught.value) == (
        "the variant mine integrates momentum to degree 3 and mass to degree 1: "
        "one degree for both, or one density per cell, would be right"
    )


def test_a_variant_of_ones_own():
    """A discretisation is data: another row works without another line of code."""
    mine = gx.Variant(
        "mine", TENSOR_CELLS, variants.QUADRATIC, variants.PerCell(), 5, 5, "quadratic, one density a cell"
    )
    result = gx.solve(block(square(2, 0.05)), mine)
    assert result.converged and result.problem.dofs == 50
    assert max(step.mass_defect for step in result.steps) < 1e-10


# -- names -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["Q1P0", "q1p0", "Q1p0"])
def test_names_in_any_case(name):
    """On a command line nobody cares for case."""
    assert variants.named(name) is gx.Q1P0


@pytest.mark.parametrize("name", ["Q2Q7", "", "Q"])
def test_an_unknown_name_is_answered_with_the_known_ones(name):
    """A part of a name is no name: "Q" could be any of them."""
    with pytest.raises(InputError) as caught:
        variants.named(name)
    assert str(caught.value) == f"there is no variant '{name}': one of {', '.join(CATALOGUE)} would be right"


def test_catalogue_goes_by_name():
    """The key a user types, the name in results and the name in Python must be one."""
    for name, variant in CATALOGUE.items():
        assert variant.name == name and getattr(gx, name) is variant
