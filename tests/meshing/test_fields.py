"""Values that vary in space: every way to give one must put the same number into the same cell, on any rank."""

import dolfinx
import numpy as np
import pytest
from blocks import COMM, gathered, square

import growthx as gx
from growthx.common.arrays import is_uniform
from growthx.common.errors import InputError
from growthx.meshing.fields import as_ufl, law_as_arrays, law_as_ufl, per_cell


@pytest.fixture(scope="module")
def mesh():
    """Four by four cells, halved into "bone" and "implant"."""
    return square(cells=4)


def values(field, mesh):
    """Pairs (x of the cell's middle, value) of all cells of all ranks, shape (cells, 2)."""
    x = dolfinx.mesh.compute_midpoints(mesh.domain, mesh.dim, mesh.owned_cells)[:, 0]
    return gathered(np.column_stack([x, per_cell(field, mesh).x.array[: len(x)]]))


def test_a_number_becomes_a_constant(mesh):
    """Uniform parameters must stay constants: as a Function they would cost time in every cell."""
    constant = as_ufl(2.5, mesh)
    assert isinstance(constant, dolfinx.fem.Constant) and float(constant) == 2.5
    assert is_uniform(2.5) and is_uniform(np.float64(2)) and not is_uniform(lambda x: x[0]) and not is_uniform({})


def test_a_function_of_position_is_taken_at_midpoints(mesh):
    """One value per cell is promised, the one in the middle: a corner's would shift stepped fields by half a cell."""
    x, value = values(lambda x: 3 * x[0] + 1, mesh).T
    assert len(x) == 16 and np.allclose(value, 3 * x + 1, rtol=0, atol=1e-14)


def test_a_function_may_return_one_number(mesh):
    """`lambda x: 2.0` is what users write first."""
    assert (values(lambda x: 2.0, mesh)[:, 1] == 2.0).all()


def test_one_value_per_region(mesh):
    """Numbers and functions of position mix, and each stays in its region."""
    x, value = values({"bone": 1.0, "implant": lambda x: 10 * x[0]}, mesh).T
    assert np.allclose(value, np.where(x < 0.5, 1.0, 10 * x), rtol=0, atol=1e-13)


def test_ghosts_hold_the_value_of_their_cell(mesh):
    """Assembly over ghost cells reads them: a value missing there would show on several ranks only."""
    field = per_cell({"bone": 1.0, "implant": lambda x: 10 * x[0]}, mesh)
    before = field.x.array.copy()
    field.x.scatter_forward()
    assert np.array_equal(before, field.x.array)


def test_a_function_of_the_users_is_taken_as_it_is(mesh):
    """A field from another computation must not be averaged over cells behind the user's back."""
    field = dolfinx.fem.Function(dolfinx.fem.functionspace(mesh.domain, ("Lagrange", 1)))
    assert as_ufl(field, mesh) is field


def test_an_unknown_region_is_refused(mesh):
    """A misspelt region must not be ignored."""
    with pytest.raises(InputError, match=r"^the mesh has no region named 'bne'; it has 'bone', 'implant'$"):
        per_cell({"bne": 1.0}, mesh)


def test_cells_without_a_value_are_refused_and_counted(mesh):
    """Left at some default they would be wrong without a sign; the count is over all ranks."""
    with pytest.raises(InputError, match=r"^a field given for the regions 'bone' has no value in 8 of 16 cells: "):
        per_cell({"bone": 1.0}, mesh)
    with pytest.raises(InputError, match="regions none at all has no value in 16 of 16 cells"):
        per_cell({}, mesh)


def test_a_region_takes_numbers_and_functions_of_position_only(mesh):
    """Anything else would end deep inside DOLFINx with an error about C++ types."""
    field = dolfinx.fem.Function(dolfinx.fem.functionspace(mesh.domain, ("DG", 0)))
    for part in (None, [1.0, 2.0], field):
        with pytest.raises(InputError, match=r"^the value of a region is .*: a number or a function of position "):
            per_cell({"bone": part, "implant": 1.0}, mesh)


@pytest.mark.parametrize(("wrong", "shown"), [(np.nan, "nan"), (np.inf, "inf"), (-2.0, "-2")])
@pytest.mark.parametrize("per_region", [False, True])
def test_a_law_refuses_wrong_values_of_its_fields_by_name(mesh, wrong, shown, per_region):
    """A function of position is checked only here, and may be wrong on one rank alone."""

    def corner(x):
        return np.where((x[0] > 0.8) & (x[1] > 0.8), wrong, 1.0)

    young = {"bone": 1.0, "implant": corner} if per_region else corner
    with pytest.raises(InputError, match=f"^Young's modulus E is {shown} somewhere: a positive number would be right$"):
        law_as_ufl(gx.Material(young=young), mesh)


def test_a_law_in_ufl_keeps_what_is_no_coefficient(mesh):
    """Exponents must stay numbers, so that compilers see integer powers."""
    law = law_as_ufl(gx.Material(young=lambda x: 1 + x[0], density_exponent=3), mesh)
    assert isinstance(law.young, dolfinx.fem.Function) and isinstance(law.poisson, dolfinx.fem.Constant)
    assert law.density_exponent == 3


def test_a_law_as_arrays_averages_only_what_varies(mesh):
    """The pointwise Newton takes arrays where parameters vary and plain numbers, which are faster, elsewhere."""
    law = gx.EnergyDrivenGrowth(attractor=lambda x: 1 + x[0], rate=2.0)
    arrays = law_as_arrays(law, mesh, lambda field: field.x.array[: len(mesh.owned_cells)])
    total = COMM.allreduce(float(arrays.attractor.sum()))
    assert total == pytest.approx(16 * 1.5, rel=1e-14) and arrays.rate == 2.0 and arrays.exponent == 3.0
