"""Places and volumes inside cells, against DOLFINx's own and against areas known from the corners."""

import basix
import dolfinx
import numpy as np
import pytest
from blocks import COMM, square

from growthx import compat
from growthx.mesh import Mesh
from growthx.sampling import dof_positions, positions, volume_ratios
from growthx.variants import CATALOGUE

VARIANTS = pytest.mark.parametrize("variant", CATALOGUE.values(), ids=lambda variant: variant.name)


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
