"""A field known at integration points goes where it fits, to the bit, and is refused where it does not."""

from dataclasses import replace

import basix.ufl
import dolfinx
import numpy as np
import pytest
import ufl
from blocks import COMM, block, cube, densities, square

import growthx as gx
from growthx import plots
from growthx.discretisation.variants import CATALOGUE, AtPoints, suited

SHAPES = ("quadrilateral", "triangle", "hexahedron", "tetrahedron")
VARIANTS = [(shape, variant) for shape in SHAPES[:2] for variant in suited(shape)]
VARIANTS += [("hexahedron", gx.Q1), ("hexahedron", gx.Q1Q1), ("tetrahedron", gx.P2)]
variants = pytest.mark.parametrize(("shape", "variant"), VARIANTS, ids=[f"{shape}-{v.name}" for shape, v in VARIANTS])


def scene_of(shape, **changes):
    """A block of a few cells."""
    plane = shape in SHAPES[:2]
    return block(square(2, 0.05, shape=shape) if plane else cube(1, shape=shape), **changes)


def at_points(mesh, degree, value=lambda x: 1.0 + 0.3 * x[0]):
    """A field at the points of a rule."""
    space = dolfinx.fem.functionspace(mesh.domain, basix.ufl.quadrature_element(mesh.cell_name, degree=degree))
    field = dolfinx.fem.Function(space, name="field")
    field.interpolate(value)
    return field


@variants
def test_a_density_is_carried_or_refused(shape, variant):
    """From every kind of density: 2 × 2 Gauss points must not be taken for four corners, of which there are as many."""
    scene = scene_of(shape)
    start = lambda x: 1.0 + 0.3 * x[0] + 0.2 * x[1] * x[1]  # noqa: E731
    here = gx.discretise(replace(scene, initial_density=start), variant)
    for other in suited(shape):
        carried = replace(scene, initial_density=here.density)
        fits = not isinstance(variant.density, AtPoints) or (
            isinstance(other.density, AtPoints) and other.mass_degree == variant.mass_degree
        )
        # The one point of a linear simplex is its midpoint, where a density per cell takes its value.
        if fits or (variant.name, other.name) == ("P1", "P1P0"):
            there = gx.discretise(carried, other)
            if other is variant or (fits and isinstance(variant.density, AtPoints)):
                own = slice(here.density_space.dofmap.index_map.size_local)
                assert np.array_equal(there.density.x.array[own], here.density.x.array[own])
            continue
        with pytest.raises(gx.InputError) as caught:
            gx.discretise(carried, other)
        said = str(caught.value)
        assert said.startswith("the initial density ρ(0) has its values at ") and said.endswith(" would be right")
        assert variant.name in said and f"and {other.name} needs it at others" in said


@pytest.mark.parametrize("variant", [gx.Q1, gx.Q1P0, gx.Q2, gx.S2fri, gx.Q1Q1], ids=lambda variant: variant.name)
def test_the_end_of_a_run_is_carried_to_the_bit(variant):
    """A second phase of loading begins where the first one ended, also where a region rests."""
    result = gx.solve(block(square(3, 0.05)), variant)
    for changes in ({}, {"growing": ("bone",)}):
        problem = gx.discretise(replace(result.scene, initial_density=result.problem.density, **changes), variant)
        own = slice(problem.density_space.dofmap.index_map.size_local)
        assert np.array_equal(problem.density.x.array[own], result.problem.density.x.array[own])
        assert np.array_equal(problem.state.accepted_density, problem.density.x.array)
        assert next(gx.march(problem.scene, variant, problem)).mass > 0


def test_a_density_of_degree_one_becomes_one_of_each_cell():
    """Discontinuous fields have values everywhere in a cell: at its midpoint, their mean there."""
    mesh = square(3)
    field = dolfinx.fem.Function(dolfinx.fem.functionspace(mesh.domain, ("DG", 1)))
    field.interpolate(lambda x: 1.0 + 0.3 * x[0])
    for variant in (gx.Q1P0, gx.Q1):
        x, _, rho = densities(gx.discretise(block(mesh, initial_density=field), variant)).T
        assert rho == pytest.approx(1.0 + 0.3 * x, rel=1e-14)


def with_field(mesh, name, field):
    """A block with a field for one of its parameters."""
    if name in ("young", "reference_density"):
        return block(mesh, material=replace(gx.Material(1.0, 0.25, 1.2), **{name: field}))
    return block(mesh, growth=replace(gx.EnergyDrivenGrowth(0.01, 5.0), **{name: field}))


@pytest.mark.parametrize("name", ["young", "reference_density", "attractor", "rate"])
@pytest.mark.parametrize("variant", CATALOGUE.values(), ids=CATALOGUE)
def test_parameters_at_points_are_used_or_refused(name, variant):
    """Where the variant integrates both balances at these points they count as the function does; elsewhere, not."""
    value = lambda x: 1.0 + 0.3 * x[0]  # noqa: E731
    mesh = square(2, shape=variant.cells[0])
    for degree in (1, 2, 3, 5):
        scene = replace(with_field(mesh, name, at_points(mesh, degree, value)), initial_density=1.2)
        points = [
            basix.make_quadrature(basix.CellType[mesh.cell_name], each)[0].tolist()
            for each in (degree, variant.momentum_degree, variant.mass_degree)
        ]
        if not points[0] == points[1] == points[2]:
            with pytest.raises(
                gx.InputError, match=rf"^the field given for '{name}' has its values at {len(points[0])} i"
            ):
                gx.discretise(scene, variant)
            continue
        one = gx.discretise(scene, variant)
        if name == "young":
            element = basix.ufl.quadrature_element(mesh.cell_name, degree=degree)
            x = ufl.SpatialCoordinate(mesh.domain)
            energy = one.evaluate(one.material.young - (1.0 + 0.3 * x[0]), element.custom_quadrature()[0])
            assert energy == pytest.approx(0.0, abs=1e-14)


def test_parameters_at_points_give_the_run_of_the_function():
    """The same digits, of momentum and growth alike."""
    mesh = square(3, 0.05)
    value = lambda x: 1.0 + 0.3 * x[0]  # noqa: E731
    at = at_points(mesh, 3, value)
    linear = dolfinx.fem.Function(dolfinx.fem.functionspace(mesh.domain, ("Lagrange", 1)))
    linear.interpolate(value)
    for name in ("young", "attractor"):
        ends = [gx.solve(with_field(mesh, name, field), gx.Q1).problem.density.x.array for field in (at, linear)]
        assert ends[0] == pytest.approx(ends[1], rel=1e-12)


@pytest.mark.parametrize("shape", ["quadrilateral", "triangle"])
def test_lumped_sources_refuse_values_of_other_points(shape):
    """The corners of a quadrilateral are as many as its Gauss points."""
    mesh = square(2, shape=shape)
    variant = gx.Q1Q1 if shape == "quadrilateral" else gx.P1P1
    scene = block(mesh, growth=gx.EnergyDrivenGrowth(at_points(mesh, variant.momentum_degree), 5.0))
    gx.discretise(scene, variant.lumped())
    with pytest.raises(gx.InputError, match="needs it at others"):
        gx.discretise(scene, variant.lumped(with_source=True))


def test_laws_of_the_users_own_are_looked_at_too():
    """What a function of u, ρ and x brings along shows only in the form."""
    mesh = square(2, shape="triangle")
    one, three = (at_points(mesh, degree) for degree in (1, 2))
    in_body = lambda field: (gx.OpenBodyForce(lambda u, rho, x: -field * u),)  # noqa: E731
    on_side = lambda field: (gx.OpenTraction("right", lambda u, rho, x: -field * u),)  # noqa: E731
    gx.discretise(block(mesh, loads=in_body(one)), gx.P1)
    for loads in (in_body(three), on_side(one), on_side(three)):
        with pytest.raises(gx.InputError, match=r"the field 'field' has its values at . integration"):
            gx.discretise(block(mesh, loads=loads), gx.P1)


def test_pictures_of_what_is_known_at_other_points_are_refused(tmp_path):
    """Continuous densities are drawn at the corners of cells, where such a ρ* has no values."""
    mesh = square(2)
    scene = block(mesh, material=gx.Material(1.0, reference_density=at_points(mesh, 3)), initial_density=1.2)
    problem = gx.discretise(scene, gx.Q1Q1)
    with pytest.raises(gx.InputError, match="the field 'field' has its values at 4 integration points"):
        plots.density(problem, "never.png", relative=True)


def test_the_sentence_names_both_and_what_would_be_right():
    """In full, once."""
    scene = block(square(2))
    density = gx.discretise(scene, gx.Q1).density
    with pytest.raises(gx.InputError) as caught:
        gx.discretise(replace(scene, initial_density=density), gx.Q2)
    assert str(caught.value) == (
        "the initial density ρ(0) has its values at 4 integration points of a cell alone, as Q1 and S2fri have them, "
        "and Q2 needs it at others: a function of position or a field of values per cell or at nodes, or Q1 or S2fri "
        "for the variant, would be right"
    )
    assert len(set(COMM.allgather(str(caught.value)))) == 1
