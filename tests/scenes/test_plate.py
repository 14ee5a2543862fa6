"""The plate against digits that three independent codes and DOLFINx agree on."""

import numpy as np
import pytest

import growthx as gx
from growthx import scenes
from growthx.common.errors import InputError
from growthx.scenes.plate import tip_displacement

# (variant, N): u_y at (2, ½), lowest and highest density
DIGITS = {
    ("Q1", 16): (-0.977558381103, 0.50140796289, 1.30563420424),
    ("Q1", 64): (-0.979847242852, 0.500680916101, 1.53344722965),
    ("Q1Q1", 16): (-0.977998317637, 0.501543959201, 1.43914318868),
    ("Q1Q1", 64): (-0.979879395487, 0.49880690748, 1.6845174158),
    ("Q1P0", 16): (-0.980390316794, 0.503006644527, 1.19545381986),
    ("Q1P0", 64): (-0.980055893301, 0.501369760864, 1.41836774514),
}


SLOW = [("Q1Q1", 64), ("Q1", 64)]
CASES = [pytest.param(*case, marks=pytest.mark.slow if case in SLOW else ()) for case in DIGITS]


@pytest.mark.parametrize(("variant", "cells"), CASES)
def test_known_digits(variant, cells):
    """Model, tangent, time program and tolerance all enter: eleven digits do not agree by chance."""
    result = gx.solve(scenes.plate(cells), gx.variants.named(variant))
    found = (tip_displacement(result.problem), *result.problem.density_range())
    assert found == pytest.approx(DIGITS[variant, cells], rel=1e-9)
    assert result.time == 2.5
    assert len(result.steps) == 25


@pytest.mark.parametrize("cells", [3, 4], ids=["odd", "even"])
@pytest.mark.parametrize("variant", [gx.Q1P0, gx.S2fri, gx.P1P0, gx.P2], ids=lambda variant: variant.name)
def test_the_tip_is_the_middle_of_the_end(variant, cells):
    """With an odd number of cells it is no corner; other shapes and orders have it elsewhere in their cells."""
    problem = gx.discretise(scenes.plate(cells, shape=variant.cells[0]), variant)
    problem.displacement.interpolate(lambda x: np.stack([100 + x[0], x[0] + 10 * x[1]]))
    assert tip_displacement(problem) == pytest.approx(7.0, rel=1e-12)


def test_triangles_halve_the_quadrilaterals():
    """The same plate and load: two cells for one."""
    meshes = [scenes.plate(4, shape=shape).mesh for shape in ("quadrilateral", "triangle")]
    assert [(mesh.cell_name, mesh.cell_count) for mesh in meshes] == [("quadrilateral", 32), ("triangle", 64)]
    problem = gx.discretise(scenes.plate(4, shape="triangle"), gx.P2P1)
    assert problem.system.loads.resultant(problem.system.loads.nodal_load) == pytest.approx([0.0, -0.02], abs=1e-15)


# of the block, N = 4, in all four codes: u_y at (2, ½, ½), lowest and highest density
BLOCK = {
    "Q1": (-0.96524495668, 0.51281277798, 1.0966799703),
    "Q1P0": (-0.99888944024, 0.52464254285, 0.95585234727),
    "P1P0": (-0.88467778302, 0.51098276504, 1.1463971278),
}


@pytest.mark.parametrize("variant", BLOCK)
def test_known_digits_in_space(variant):
    """NGSolve, felupe and scikit-fem find them, too, with multigrid or a factor, each written by itself."""
    shape = "tetrahedron" if variant.startswith("P") else "hexahedron"
    result = gx.solve(scenes.block(4, shape=shape), gx.variants.named(variant))
    found = (tip_displacement(result.problem), *result.problem.density_range())
    assert found == pytest.approx(BLOCK[variant], rel=1e-9)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"cells": 0}, "the number of cells over the block's height is 0: a whole number from 1 to 292 is needed"),
        ({"shape": "triangle"}, "there are no cells 'triangle' in space: hexahedron or tetrahedron would be right"),
    ],
)
def test_a_block_of_nothing_is_refused(options, said):
    """In the words that the plate has."""
    with pytest.raises(InputError) as caught:
        scenes.block(**options)
    assert str(caught.value) == said


def test_unknown_cells_are_refused():
    """Before a mesh is made."""
    with pytest.raises(InputError) as caught:
        scenes.plate(4, shape="tetrahedron")
    assert (
        str(caught.value) == "there are no cells 'tetrahedron' in the plane: quadrilateral or triangle would be right"
    )


@pytest.mark.parametrize("variant", [gx.Q2Q2, gx.S2Q1, gx.Q2, gx.S2fri, gx.P2P2, gx.P2P1, gx.P2], ids=lambda v: v.name)
def test_quadratic_variants_bend_alike(variant):
    """One limit: on 8 × 4 cells they are within 2·10⁻³ of the 64 rows of Q1P0, which itself is far off on these."""
    result = gx.solve(scenes.plate(4, shape=variant.cells[0]), variant)
    assert tip_displacement(result.problem) == pytest.approx(DIGITS["Q1P0", 64][0], rel=2e-3)
    assert max(step.mass_defect for step in result.steps) < 1e-10


def test_linear_variants_are_still_coarse_there():
    """Else the test above would tell nothing of the order."""
    for variant in (gx.Q1, gx.P1):
        result = gx.solve(scenes.plate(4, shape=variant.cells[0]), variant)
        assert tip_displacement(result.problem) != pytest.approx(DIGITS["Q1P0", 64][0], rel=5e-3)


@pytest.mark.parametrize("kind", [np.int64, np.uint8, int])
def test_numbers_of_cells_may_be_of_numpy(kind):
    """Those of a loop over an array, in each scene that counts its cells."""
    made = (gx.scenes.plate(kind(2)), gx.scenes.block(kind(1)), gx.scenes.bar(elements=kind(10)))
    assert [scene.mesh.cell_count for scene in (*made, gx.scenes.weinans_plate(kind(3)))] == [8, 2, 10, 9]
