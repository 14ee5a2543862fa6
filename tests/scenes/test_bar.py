"""The paper's two bars: levels, taper and loads as published, and the reading rule of its tables."""

import dolfinx
import numpy as np
import pytest
import ufl
from blocks import COMM, gathered

import growthx as gx
from growthx.common.errors import InputError
from growthx.fem import kernels
from growthx.meshing.fields import per_cell
from growthx.scenes.bar import (
    CONTINUOUS,
    DISCONTINUOUS,
    bar,
    end_displacement,
    equilibrium,
    midpoint_axis_density_change,
    midpoint_density_change,
)

LEVELS = [2.0, 1.75, 1.5, 1.25, 1.0, 1.0, 1.25, 1.5, 1.75, 2.0]


def attractors(scene):
    """Ψ₀* of all cells, from left to right."""
    mesh = scene.mesh
    x = dolfinx.mesh.compute_midpoints(mesh.domain, mesh.dim, mesh.owned_cells)[:, 0]
    found = gathered(np.column_stack([x, per_cell(scene.growth.attractor, mesh).x.array[: len(x)]]))
    return found[np.argsort(found[:, 0]), 1]


def integral(integrand, measure):
    return COMM.allreduce(dolfinx.fem.assemble_scalar(kernels.form(integrand * measure)))


@pytest.mark.parametrize("elements", [10, 40, 100])
def test_levels_of_the_discontinuous_bar(elements):
    """Each level covers a tenth of the length: a value taken at a cell's edge would shift the steps."""
    assert attractors(bar(DISCONTINUOUS, elements)).tolist() == np.repeat(LEVELS, elements // 10).tolist()


def test_the_continuous_bar_tapers_linearly():
    """Width 0.01 at both ends and 0.005 at mid-length, symmetric about the axis; Ψ₀* = 2."""
    scene = bar(CONTINUOUS, 10)
    assert (attractors(scene) == 2.0).all()
    nodes = gathered(scene.mesh.domain.geometry.x)
    assert np.allclose(nodes[:, 1].max() + nodes[:, 1].min(), 0.0, atol=1e-12)
    half = 0.005 * (1 - 0.5 * (1 - np.abs(2 * nodes[:, 0] - 1)))
    assert np.allclose(np.abs(nodes[:, 1] - nodes[:, 1].mean()), half, rtol=1e-9)
    assert integral(1.0, ufl.dx(domain=scene.mesh.domain)) == pytest.approx(0.0075, rel=1e-12)


@pytest.mark.parametrize("problem", [DISCONTINUOUS, CONTINUOUS], ids=lambda problem: problem.name)
def test_traction_along_the_bar_balances_the_end(problem):
    """The semi-analytic solution of a section uses it: traction times width is the same force everywhere."""
    x = np.linspace(0, 1, 11)
    width = 1 - (1 - problem.taper) * (1 - np.abs(2 * x - 1))
    assert np.allclose(problem.traction(x) * width, 2.0, rtol=1e-14)
    assert problem.traction(np.array([0.5]))[0] == pytest.approx(2.0 / problem.taper)


@pytest.mark.parametrize("problem", [DISCONTINUOUS, CONTINUOUS], ids=lambda problem: problem.name)
def test_the_load_is_two_per_area_at_the_right_end(problem):
    """(2, 0) per reference area on the width of 0.01, nothing across, whatever the taper."""
    discretised = gx.discretise(bar(problem, 10), gx.Q1P0)
    assert np.allclose(
        discretised.system.loads.resultant(discretised.system.loads.nodal_load), [0.02, 0.0], rtol=0, atol=1e-15
    )


def test_the_published_setting():
    """Spec §3: every default is part of the published numbers."""
    scene = bar()
    assert scene.mesh.cell_count == 40
    assert scene.material == gx.Material(young=1.0, poisson=0.2, reference_density=1.0, density_exponent=2.0)
    assert (scene.growth.rate, scene.growth.exponent, scene.start_density) == (1.0, 3.0, 1.0)
    times = scene.program.times()
    assert len(times) == 60 and times[-1] == 6.0
    assert np.allclose([scene.program.amplitude(t) for t in times], np.minimum(np.arange(1, 61) / 10, 1), rtol=1e-14)


def test_exponents_and_program_can_be_changed():
    """They are what the theory is explored with."""
    scene = bar(n=1.5, m=4.0, step=0.25, until=2.0)
    assert (scene.material.density_exponent, scene.growth.exponent) == (1.5, 4.0)
    assert (scene.program.step, scene.program.until, scene.program.ramp) == (0.25, 2.0, 1.0)


@pytest.mark.parametrize(
    ("elements", "sentence"),
    [
        (0, "the number of elements is 0: a whole number from 1 to 100000 would be right"),
        (-10, "the number of elements is -10: a whole number from 1 to 100000 would be right"),
        (10.0, "the number of elements is 10.0: a whole number from 1 to 100000 would be right"),
        (15, "the discontinuous bar has 15 elements: a multiple of 10 would meet its ten levels"),
    ],
)
def test_impossible_numbers_of_elements_are_refused(elements, sentence):
    """With 15 elements some would lie across two levels, and the result would be of another bar."""
    with pytest.raises(InputError) as caught:
        bar(DISCONTINUOUS, elements)
    assert str(caught.value) == sentence


def test_a_tapered_bar_needs_an_even_number():
    """An odd number would cut off the kink at mid-length, where the density is read."""
    with pytest.raises(InputError, match="a tapered bar of 5 elements has no mesh line at mid-length: an even number "):
        bar(CONTINUOUS, 5)


@pytest.mark.parametrize(("x", "density"), [(0.05, 1.152298), (0.45, 1.306171), (0.55, 1.306171), (0.75, 1.214209)])
def test_equilibrium_of_a_section(x, density):
    """Demos draw it next to the computed density: it must take the level of its own tenth."""
    assert round(equilibrium(bar(DISCONTINUOUS, 10), DISCONTINUOUS, x).density, 6) == density


@pytest.mark.parametrize(
    ("variant", "elements", "place"),
    [
        (gx.Q1Q1, 10, 0.5),
        (gx.Q1P0, 10, 0.55),
        (gx.Q1, 10, 0.55 - 0.05 / np.sqrt(3)),
        (gx.Q1P0, 40, 0.5125),
    ],
    ids=lambda value: getattr(value, "name", None),
)
def test_density_is_read_right_of_mid_length(variant, elements, place):
    """The reading rule, on ρ = 1 + x: the cell to the right of x = 0.5, the point nearest to 0.5."""
    scene = bar(CONTINUOUS, elements)
    discretised = gx.discretise(scene, variant)
    discretised.density.interpolate(lambda x: 1 + x[0])
    assert midpoint_density_change(discretised) == pytest.approx(place, abs=1e-9)


def test_density_is_read_in_the_outermost_row():
    """Rows differ where the load is not uniform: the lowest one is read, on every number of ranks."""
    discretised = gx.discretise(bar(CONTINUOUS, 10), gx.Q1)
    discretised.density.interpolate(lambda x: 1 + np.where(x[1] < 0, 0.25, 0.75))
    assert midpoint_density_change(discretised) == pytest.approx(0.25, abs=1e-12)


@pytest.mark.parametrize(
    ("variant", "edge", "axis"),
    [(gx.Q2Q2, 0.75, 0.25), (gx.Q2, 0.75, 0.25), (gx.Q1Q1, 0.75, 0.75), (gx.S2fri, 0.75, 0.75), (gx.Q1P0, 0.25, 0.25)],
    ids=lambda value: getattr(value, "name", None),
)
def test_density_on_the_axis(variant, edge, axis):
    """A second reading, of three rows the inner one, in the same cell and column; of two or one there is no other."""
    discretised = gx.discretise(bar(CONTINUOUS, 10), variant)
    middle = 1e-6 if variant is not gx.Q1P0 else 1.0
    discretised.density.interpolate(lambda x: 1 + np.where(abs(x[1]) < middle, 0.25, 0.75))
    assert midpoint_density_change(discretised) == pytest.approx(edge, abs=1e-12)
    assert midpoint_axis_density_change(discretised) == pytest.approx(axis, abs=1e-12)
    discretised.density.interpolate(lambda x: 1 + x[0])
    assert midpoint_axis_density_change(discretised) == pytest.approx(midpoint_density_change(discretised), abs=1e-12)


@pytest.mark.parametrize("variant", [gx.Q1Q1, gx.Q1P0], ids=lambda variant: variant.name)
def test_displacement_is_read_at_a_corner_of_the_right_end(variant):
    """Spec's rule is the axial displacement of a corner: the other component or end would be far off."""
    discretised = gx.discretise(bar(CONTINUOUS, 10), variant)
    discretised.displacement.interpolate(lambda x: np.stack([3 * x[0] ** 2, 100 + x[1]]))
    assert end_displacement(discretised) == pytest.approx(3.0, rel=1e-12)


# -- triangles ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("problem", [DISCONTINUOUS, CONTINUOUS], ids=lambda problem: problem.name)
def test_triangles_halve_the_quadrilaterals(problem):
    """The same bar: two cells for one, each with the level of its own tenth, the same load."""
    scene = bar(problem, 20, shape="triangle")
    assert (scene.mesh.cell_name, scene.mesh.cell_count) == ("triangle", 40)
    assert (
        attractors(scene).tolist() == (np.repeat(LEVELS, 4) if problem is DISCONTINUOUS else np.full(40, 2.0)).tolist()
    )
    discretised = gx.discretise(scene, gx.P1P0)
    assert np.allclose(
        discretised.system.loads.resultant(discretised.system.loads.nodal_load), [0.02, 0.0], rtol=0, atol=1e-15
    )
    assert discretised.mass() == pytest.approx(0.01 if problem is DISCONTINUOUS else 0.0075, rel=1e-12)


@pytest.mark.parametrize(("cells", "shown"), [("hexahedron", "hexahedron"), ("triangles", "triangles"), ("", "")])
def test_unknown_cells_are_refused(cells, shown):
    """A bar in the plane has no hexahedra, and a plural is a mistake easily made."""
    with pytest.raises(InputError) as caught:
        bar(shape=cells)
    assert str(caught.value) == f"there are no cells '{shown}' in the plane: quadrilateral or triangle would be right"


@pytest.mark.parametrize("variant", [gx.P1P1, gx.P2P1, gx.P2, gx.P1P0], ids=lambda variant: variant.name)
def test_density_and_displacement_are_read_alike_on_triangles(variant):
    """The reading rule, on ρ = 1 + x: the point nearest to x = 0.5 to the right of it, whatever the diagonals."""
    discretised = gx.discretise(bar(CONTINUOUS, 40, shape="triangle"), variant)
    discretised.density.interpolate(lambda x: 1 + x[0])
    place = {"P1P1": 0.0, "P2P1": 0.0, "P2": 1 / 6, "P1P0": 1 / 3}[variant.name] / 40
    assert midpoint_density_change(discretised) == pytest.approx(0.5 + place, abs=1e-9)
    discretised.displacement.interpolate(lambda x: np.stack([3 * x[0] ** 2, 100 + x[1]]))
    assert end_displacement(discretised) == pytest.approx(3.0, rel=1e-12)


@pytest.mark.parametrize(
    ("variant", "place"),
    [
        (gx.Q2Q2, 0.0),
        (gx.S2Q1, 0.0),
        (gx.Q2, 0.5 - np.sqrt(0.15)),
        (gx.Q1sri, 0.5),
        (gx.S2fri, 0.5 - 0.5 / np.sqrt(3)),
    ],
    ids=lambda value: getattr(value, "name", None),
)
def test_density_and_displacement_of_other_quadrilaterals(variant, place):
    """The same rule for three rows of densities and for mid-edge nodes, whose displacement is not what is asked."""
    discretised = gx.discretise(bar(CONTINUOUS, 40), variant)
    discretised.density.interpolate(lambda x: 1 + x[0])
    assert midpoint_density_change(discretised) == pytest.approx(0.5 + place / 40, abs=1e-9)
    discretised.density.interpolate(lambda x: 1 + np.where(x[1] < -1e-4, 0.25, 0.75))
    if discretised.density_space.dofmap.dof_layout.num_dofs > 1:
        assert midpoint_density_change(discretised) == pytest.approx(0.25, abs=1e-12)
    discretised.displacement.interpolate(lambda x: np.stack([1 + x[1] / 0.005, 100 + x[1]]))
    assert end_displacement(discretised) == pytest.approx(0.0, abs=1e-12)
