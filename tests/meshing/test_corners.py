"""Corners of cells: sound ones pass in either sense, and what has no inverse map is refused on all ranks."""

import numpy as np
import pytest
from blocks import block, cube, square

import growthx as gx
from growthx.common.errors import InputError
from growthx.meshing.corners import check_cells, corner_sines


def test_sines_of_known_corners():
    """A square has four right angles; a rhombus of 30 degrees has sines of one half, turned over of minus that."""
    rhombus = np.array([[0.0, 0.0], [1.0, 0.0], [np.sqrt(3) / 2, 0.5], [1 + np.sqrt(3) / 2, 0.5]])
    unit = np.array([[0.0, 0.0], [3.0, 0.0], [0.0, 1.0], [3.0, 1.0]])
    sines = corner_sines("quadrilateral", np.array([unit, rhombus, rhombus * [1, -1]]))
    assert sines == pytest.approx(np.outer([1.0, 0.5, -0.5], np.ones(4)))
    tetrahedron = np.vstack([np.zeros(3), np.diag([1.0, 2.0, 3.0])])
    assert corner_sines("tetrahedron", tetrahedron[np.newaxis]) == pytest.approx(np.ones((1, 1)))


@pytest.mark.parametrize("shape", ["quadrilateral", "triangle", "hexahedron", "tetrahedron"])
@pytest.mark.parametrize("size", [1e-12, 1.0, 1e12])
def test_sound_cells_pass_in_any_unit_and_sense(shape, size):
    """Distorted, mirrored, in micrometres: none of it is a fault."""
    mesh = (square if shape in ("quadrilateral", "triangle") else cube)(3, 0.05, shape=shape)
    mesh.domain.geometry.x[:] *= size
    check_cells(mesh)
    mesh.domain.geometry.x[:, 0] *= -1
    check_cells(mesh)


def test_no_thickness_at_all():
    """A body whose width is nil has cells without volume, and no map back to the reference cell."""
    mesh = square(2)
    mesh.domain.geometry.x[:, 1] = 0.0
    with pytest.raises(InputError, match=r"^4 of the 4 cells of the mesh are inverted or have a corner of 180 degrees"):
        gx.discretise(block(mesh), gx.Q1)


@pytest.mark.parametrize(
    ("shape", "wrong"),
    [
        *((shape, wrong) for shape in ("triangle", "tetrahedron") for wrong in (np.nan, np.inf)),
        *((shape, wrong) for shape in ("quadrilateral", "hexahedron") for wrong in (np.nan, np.inf, 3.0)),
    ],
)
def test_cells_turned_inside_out_are_refused(shape, wrong):
    """One node in a wrong place, or in none, of a mesh that was not made by gmsh."""
    mesh = (square if shape in ("quadrilateral", "triangle") else cube)(2, shape=shape)
    x = mesh.domain.geometry.x
    x[np.linalg.norm(x[:, : mesh.dim] - 0.5, axis=1) < 1e-6, 0] = wrong
    with pytest.raises(InputError, match=r"cells of the mesh are inverted"):
        gx.discretise(block(mesh), gx.variants.default(mesh.cell_name))
