"""Names of boundaries and regions: found, counted and integrated over all ranks, and refused when they do not exist."""

import dolfinx
import numpy as np
import pytest
import ufl
from blocks import COMM, square

from growthx.common.errors import InputError
from growthx.fem import compat, kernels
from growthx.meshing.mesh import Mesh

TRIANGLE = dolfinx.mesh.CellType.triangle


@pytest.fixture(scope="module")
def mesh():
    """The unit square in 4 × 4 quadrilaterals."""
    return square(cells=4)


def owned(mesh, indices, dim):
    """Number of entities in a local index array, counted once over all ranks."""
    return COMM.allreduce(int(np.sum(indices < mesh.domain.topology.index_map(dim).size_local)))


def integral(integrand, measure):
    return COMM.allreduce(dolfinx.fem.assemble_scalar(kernels.form(integrand * measure)))


def test_named_parts_hold_their_facets_and_cells(mesh):
    """Index arrays are local and may hold ghosts: each facet and cell must still be there once over all ranks."""
    assert {name: owned(mesh, mesh.boundary(name), 1) for name in mesh.boundaries} == dict.fromkeys(mesh.boundaries, 4)
    assert [owned(mesh, mesh.region(name), 2) for name in ("bone", "implant")] == [8, 8]
    assert mesh.boundary("left").dtype == np.int32


def test_counts_and_shape(mesh):
    """Cells are counted once; every rank's own cells come first, then its ghosts."""
    assert (mesh.dim, mesh.cell_count, mesh.cell_name) == (2, 16, "quadrilateral")
    assert COMM.allreduce(len(mesh.owned_cells)) == 16
    assert np.array_equal(mesh.local_cells[: len(mesh.owned_cells)], mesh.owned_cells)
    assert len(mesh.local_cells) == compat.geometry_nodes(mesh.domain).shape[0]


def test_boundaries_lie_outside_only():
    """A locator that also fits facets inside the body must not put loads there."""
    domain = dolfinx.mesh.create_unit_square(COMM, 4, 4, TRIANGLE)
    mesh = Mesh.with_names(domain, {"everywhere": lambda x: x[0] < 2})
    assert owned(mesh, mesh.boundary("everywhere"), 1) == 16


@pytest.mark.parametrize(
    ("kind", "sentence"),
    [
        ("boundary", "the mesh has no boundary named 'lef'; it has 'bottom', 'left', 'right', 'top'"),
        ("region", "the mesh has no region named 'lef'; it has 'bone', 'implant'"),
    ],
)
def test_an_unknown_name_is_answered_with_the_known_ones(mesh, kind, sentence):
    """Misspelling is the commonest mistake with an own mesh; the sentence must show what was meant."""
    with pytest.raises(InputError) as caught:
        getattr(mesh, kind)("lef")
    assert str(caught.value) == sentence


def test_a_mesh_without_names_says_so():
    """The list of known names must not end in nothing."""
    mesh = Mesh.with_names(dolfinx.mesh.create_unit_square(COMM, 2, 2), {})
    with pytest.raises(InputError, match=r"^the mesh has no region named 'bone'; it has none at all$"):
        mesh.region("bone")


def test_an_empty_boundary_is_refused_on_all_ranks():
    """A support on nothing would leave the body free; one that is empty on some ranks only is fine."""
    domain = dolfinx.mesh.create_unit_square(COMM, 4, 4)
    mesh = Mesh.with_names(domain, {"corner": lambda x: (x[0] < 0.3) & (x[1] < 1e-6), "nowhere": lambda x: x[0] > 5})
    assert owned(mesh, mesh.boundary("corner"), 1) == 1
    with pytest.raises(InputError, match=r"^the boundary 'nowhere' of the mesh is empty: .* from \(0, 0\) to \(1, 1\)"):
        mesh.boundary("nowhere")


@pytest.mark.parametrize("kind", ["boundary", "region"])
def test_a_place_that_matches_nothing_is_told_where_the_mesh_is(kind):
    """In mm or in m? The sentence shows how far the mesh reaches."""
    domain = dolfinx.mesh.create_box(COMM, ([-1.0, 0.0, 2.0], [3.0, 0.5, 2.5]), (2, 2, 2))
    mesh = Mesh.with_names(domain, {"far": lambda x: x[0] > 500}, {"far": lambda x: x[2] < 1})
    with pytest.raises(
        InputError, match=r"'far' of the mesh is empty: .* extends from \(-1, 0, 2\) to \(3, 0.5, 2.5\)"
    ):
        getattr(mesh, kind)("far")


@pytest.mark.parametrize("name", [1, None, ["left"]], ids=repr)
def test_names_are_texts(mesh, name):
    """A list, which has no place in a mapping, is answered as any other wrong name."""
    with pytest.raises(InputError, match=r"^the name of a boundary is .*: a name in quotes would be right$"):
        mesh.boundary(name)


@pytest.mark.parametrize(("name", "expected"), [("left", 0.0), ("right", 2.0 / 7), ("top", 2.0 / 3), ("bottom", 0.0)])
def test_a_boundary_measure_integrates_over_its_boundary_only(mesh, name, expected):
    """A bare `ds` next to tagged facets integrates the whole boundary: each side has its own ∫ 2 x² y⁶ ds here."""
    x = ufl.SpatialCoordinate(mesh.domain)
    measure = mesh.boundary_measure(name, 6)
    assert integral(1.0, measure) == pytest.approx(1.0, rel=1e-14)
    assert integral(2 * x[0] ** 2 * x[1] ** 6, measure) == pytest.approx(expected, abs=1e-14)


def test_the_degree_of_a_boundary_measure_is_kept(mesh):
    """Loads are integrated with it: with too few points ∫ y⁶ would be wrong, with a default it would be slow."""
    y = ufl.SpatialCoordinate(mesh.domain)[1]
    assert abs(integral(y**6, mesh.boundary_measure("right", 1)) - 1 / 7) > 1e-3
