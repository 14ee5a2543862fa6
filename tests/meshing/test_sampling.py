"""Places and volumes inside cells, against DOLFINx's own and against areas known from the corners."""

import basix
import dolfinx
import numpy as np
import pytest
from blocks import COMM, block, cube, densities, square

import growthx as gx
from growthx.discretisation.variants import CATALOGUE
from growthx.fem import compat
from growthx.meshing.mesh import Mesh
from growthx.meshing.sampling import cells_at, dof_positions, positions, pull_back, split_rule, volume_ratios

VARIANTS = pytest.mark.parametrize("variant", CATALOGUE.values(), ids=CATALOGUE)


def triangles():
    """The unit square in triangles, distorted, its boundary kept."""
    domain = dolfinx.mesh.create_unit_square(COMM, 4, 4, dolfinx.mesh.CellType.triangle)
    x = domain.geometry.x
    bump = 0.1 * np.sin(np.pi * x[:, 0]) * np.sin(np.pi * x[:, 1])
    x[:, 0] += bump
    x[:, 1] -= 0.5 * bump
    return Mesh.with_names(domain, {})


@pytest.fixture(scope="module", params=["quadrilaterals", "triangles"])
def mesh(request):
    """The unit square in distorted cells."""
    return square(cells=4, distortion=0.1) if request.param == "quadrilaterals" else triangles()


def corners(mesh):
    """Corners of the owned cells in turn, shape (cells, corners, 2)."""
    x = mesh.domain.geometry.x[compat.geometry_nodes(mesh.domain)[: len(mesh.owned_cells)], :2]
    return x[:, [0, 1, 3, 2]] if mesh.cell_name == "quadrilateral" else x


def shoelace(polygons):
    """Areas of polygons, shape (polygons, corners, 2)."""
    x, y = polygons[..., 0], polygons[..., 1]
    return np.abs(np.sum(x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1), axis=1)) / 2


def rule(mesh, degree=3):
    """Points and weights on the reference cell."""
    return basix.make_quadrature(basix.CellType[mesh.cell_name], degree)


def test_volume_ratios_integrate_to_the_area_of_each_cell(mesh):
    """Zone means weigh with them: on distorted cells they vary inside the cell."""
    points, weights = rule(mesh)
    areas = volume_ratios(mesh, points) @ weights
    assert np.allclose(areas, shoelace(corners(mesh)), rtol=1e-13, atol=0)
    assert COMM.allreduce(areas.sum()) == pytest.approx(1.0, rel=1e-13)


def test_volume_ratios_do_not_depend_on_the_sense_of_the_cells():
    """gmsh's cells may be numbered clockwise: a negative area would cancel others in a mean."""
    mesh = triangles()
    x, points = mesh.domain.geometry.x, rule(mesh)[0]
    before = volume_ratios(mesh, points)
    x[:, 0] *= -1
    assert before.min() > 0 and np.array_equal(volume_ratios(mesh, points), before)


def test_positions_are_dolfinxs_own(mesh):
    """The map from the reference cell must be DOLFINx's, in its numbering of the corners."""
    points = rule(mesh)[0]
    places, geometry = positions(mesh, points), mesh.domain.geometry
    assert places.shape == (len(mesh.owned_cells), len(points), 3)
    for cell in mesh.owned_cells:
        nodes = geometry.x[compat.geometry_nodes(mesh.domain)[cell], :2]
        assert np.allclose(places[cell, :, :2], geometry.cmap.push_forward(points, nodes), rtol=0, atol=1e-15)


@VARIANTS
def test_densities_lie_where_they_are_interpolated(mesh, variant):
    """The position of a density must be where DOLFINx puts its value: plots and the bar's reading rule rely on it."""
    space = dolfinx.fem.functionspace(mesh.domain, variant.density_element(mesh.cell_name))
    found = dof_positions(space, mesh)
    owned = space.dofmap.index_map.size_local
    assert len(found) == owned + space.dofmap.index_map.num_ghosts and np.isfinite(found[:owned]).all()
    value = dolfinx.fem.Function(space)
    for i in range(2):
        value.interpolate(lambda x, i=i: x[i])
        known = np.isfinite(found[:, i])
        assert np.allclose(value.x.array[known], found[known, i], rtol=0, atol=1e-14)


@pytest.mark.parametrize("shape", ["quadrilateral", "triangle"])
def test_places_are_located_in_their_cells(shape):
    """Where a place lies in its cell: mapped forward it must be the place, also in distorted cells and at corners."""
    mesh = square(4, 0.1, shape=shape)
    places = np.vstack([np.random.default_rng(0).uniform(size=(200, 2)), [[0.0, 0.0], [1.0, 1.0], [0.0, 0.5]]])
    cells, X = cells_at(mesh, places)
    here = cells >= 0
    assert np.all(COMM.allreduce(here.astype(int)) >= 1)
    at = np.array([positions(mesh, X[i : i + 1])[cells[i], 0, :2] for i in np.flatnonzero(here)])
    assert at == pytest.approx(places[here], abs=1e-12)
    assert X[here].min() > -1e-9 and X[here].max() < 1 + 1e-9


@pytest.mark.parametrize("shape", ["hexahedron", "tetrahedron"])
def test_places_are_located_in_three_dimensions(shape):
    """The same map, inverted in space."""
    mesh = cube(2, 0.05, shape=shape)
    places = np.random.default_rng(0).uniform(0.01, 0.99, size=(50, 3))
    cells, X = cells_at(mesh, places)
    here = cells >= 0
    assert np.all(COMM.allreduce(here.astype(int)) >= 1)
    at = np.array([positions(mesh, X[i : i + 1])[cells[i], 0] for i in np.flatnonzero(here)]).reshape(-1, 3)
    assert at == pytest.approx(places[here], abs=1e-12)


@VARIANTS
def test_densities_of_volumes_have_places_too(variant):
    """Serendipity and integration points on hexahedra, all variants on their cells of space: on each rank its own."""
    problem = gx.discretise(block(cube(2, 0.05, shape=variant.cells[1])), variant)
    found, own = problem.density_positions(), problem.density_space.dofmap.index_map.size_local
    assert np.isfinite(found[:own]).all()
    x = np.array(COMM.allgather((found[:own].min(axis=0, initial=9.0), found[:own].max(axis=0, initial=-9.0))))
    assert x[:, 0].min(axis=0).min() >= -1e-12 and x[:, 1].max(axis=0).max() <= 1 + 1e-12
    assert problem.sample_density(np.full((1, 3), 0.3)) == pytest.approx([1.2])


def test_places_outside_are_in_no_cell():
    """A place beside the body has no density: NaN when sampled, not that of the nearest cell."""
    mesh = square(4)
    assert np.all(cells_at(mesh, np.array([[1.2, 0.5], [-3.0, 0.1]]))[0] == -1)
    problem = gx.discretise(block(mesh), gx.Q1)
    assert np.isnan(problem.sample_density(np.array([[1.2, 0.5], [0.5, 0.5]]))).tolist() == [True, False]


@VARIANTS
def test_samples_are_the_density_as_the_variant_knows_it(variant):
    """Each integration point's at its own place, a nodal density at its nodes, the same on all ranks."""
    start = lambda x: 1 + 0.5 * x[0] + 0.2 * x[1]  # noqa: E731
    problem = gx.discretise(block(square(3, 0.05, shape=variant.cells[0]), initial_density=start), variant)
    x, y, rho = densities(problem).T
    found = problem.sample_density(np.column_stack([x, y]))
    assert found == pytest.approx(rho, rel=1e-12)
    assert all(np.array_equal(found, other) for other in COMM.allgather(found))


PLACES = [
    ([0.5, 0.5], r"are of shape \(2,\): shape \(places, 2\), a row for each, would be right"),
    ([[0.5, 0.5, 0.1]], r"are of shape \(1, 3\): shape \(places, 2\), a row for each, would be right"),
    ([], r"are of shape \(0,\)"),
    (0.5, r"are of shape \(\)"),
    ([[[0.5, 0.5]]], r"are of shape \(1, 1, 2\)"),
    ([[0.5, 0.5], [np.nan, 0.5]], r"have \[nan, 0.5\] among them: finite coordinates would be right"),
    ([[np.inf, 0.5]], r"have \[inf, 0.5\] among them"),
    ("one", "are 'one'"),
    ([["a", "b"]], "are "),
    ([[True, False]], "are "),
    ([[0.5 + 0j, 0.5]], "are "),
    ([[0.5], [0.5, 0.5]], "are "),
    (None, "are None"),
]


@pytest.mark.parametrize(("places", "sentence"), PLACES, ids=[repr(places) for places, _ in PLACES])
@pytest.mark.parametrize("method", ["sample_density", "sample_displacement"])
def test_what_are_no_places_is_refused(places, sentence, method):
    """A flat point was broadcast to two places before, and gave two values without a word."""
    problem = gx.discretise(block(square(2)), gx.Q1)
    with pytest.raises(gx.InputError, match=f"^the places to sample {sentence}"):
        getattr(problem, method)(places)


@pytest.mark.parametrize("variant", [gx.Q1, gx.Q1Q1], ids=["Q1", "Q1Q1"])
def test_whole_numbers_lists_and_no_places_are_fine(variant):
    """Whatever says where is taken: the corner (1, 0) in whole numbers is the one in floats."""
    start = lambda x: 1 + 0.5 * x[0]  # noqa: E731
    problem = gx.discretise(block(square(2), initial_density=start), variant)
    known = problem.sample_density(np.array([[1.0, 0.0]]))
    for same in ([[1, 0]], ((1.0, 0),), np.array([[1, 0]], dtype=np.int8), np.array([[1.0, 0.0]], dtype=np.float32)):
        assert problem.sample_density(same) == known
    assert problem.sample_density(np.empty((0, 2))).shape == (0,)
    assert problem.sample_displacement(np.empty((0, 2))).shape == (0, 2)


def test_each_rank_may_sample_places_of_its_own():
    """Functions of position are called with other points on each rank, and on some with none at all."""
    start = lambda x: 1 + 0.5 * x[0] + 0.2 * x[1]  # noqa: E731
    problem = gx.discretise(block(square(4, 0.05), initial_density=start), gx.Q1Q1)
    everywhere = np.random.default_rng(0).uniform(size=(12, 2))
    known, moved = problem.sample_density(everywhere), problem.sample_displacement(everywhere)
    for own in (slice(COMM.rank, None, COMM.size), slice(0, 5 * COMM.rank), slice(0, 0 if COMM.rank else 3)):
        assert np.array_equal(problem.sample_density(everywhere[own]), known[own])
        assert np.array_equal(problem.sample_displacement(everywhere[own]), moved[own])
        flat = np.column_stack([everywhere[own], np.zeros(len(everywhere[own]))])
        assert np.array_equal(problem.sample_density(flat), known[own])
    with pytest.raises(gx.InputError, match="the places to sample"):
        problem.sample_density(np.full((1, 2), np.nan if COMM.rank == COMM.size - 1 else 0.5))


@pytest.mark.parametrize("variant", [gx.Q1, gx.Q1P0, gx.Q1Q1], ids=lambda variant: variant.name)
def test_a_sample_is_a_function_of_position(variant):
    """The start of another run, as DOLFINx asks for it: also where a part of it rests, for which it is asked twice."""
    start = lambda x: 1 + 0.5 * x[0] + 0.2 * x[1]  # noqa: E731
    old = gx.discretise(block(square(3), initial_density=start), gx.Q1Q1)
    changes = {"initial_density": lambda x: old.sample_density(x.T)}
    for growing in (None, ("bone",)):
        new = gx.discretise(block(square(4), growing=growing, **changes), variant)
        places = new.density_positions()[: len(new.volumes)]
        assert new.density.x.array[: len(places)] == pytest.approx(start(places.T), abs=1e-12)


@pytest.mark.parametrize("cell", ["quadrilateral", "triangle", "hexahedron", "tetrahedron"])
@pytest.mark.parametrize("parts", [1, 2, 3])
def test_rules_in_parts_of_a_cell(cell, parts):
    """Each part is there once, and has its share: polynomials of the rule's degree are integrated, by more points."""
    X, weights = split_rule(cell, parts, 4)
    finer, exact = (np.asarray(part) for part in basix.make_quadrature(basix.CellType[cell], 8))
    dim = X.shape[1]
    assert len(X) == parts**dim * len(split_rule(cell, 1, 4)[0])
    for powers in np.ndindex(*(5,) * dim):
        if sum(powers) <= 4:
            integrals = [np.sum(w * np.prod(x**powers, axis=1)) for x, w in ((X, weights), (finer, exact))]
            assert integrals[0] == pytest.approx(integrals[1], rel=1e-12)
    last = X.max(axis=1) if cell in ("quadrilateral", "hexahedron") else X.sum(axis=1)
    assert X.min() >= -1e-12 and last.max() <= 1 + 1e-12
    assert weights.min() > 0  # as means of what is positive need them


def test_a_rank_may_have_no_places():
    """Of places that are all in other ranks' cells; basix aborts the whole program when it is given no points."""
    mesh = square(2)
    none = np.zeros((0, 2))
    assert pull_back(mesh, np.zeros(0, dtype=np.int32), none).shape == (0, 2)
    cells, X = cells_at(mesh, none)
    assert cells.shape == (0,) and X.shape == (0, 2)
    assert cells_at(mesh, none + 9.0)[1].shape == (0, 2)
