"""The density of one run as the start of another: to the bit where nothing differs, else with its mass, or refused."""

from dataclasses import replace

import numpy as np
import pytest
from blocks import COMM, block, cube, densities, square

import growthx as gx
from growthx.discretisation.variants import CATALOGUE

SMOOTH = lambda x: 1 + 0.5 * x[0] ** 2 + 0.2 * np.sin(3 * x[1])  # noqa: E731
BODIES = {
    "quadrilateral": lambda n, bent=0.05: square(n, bent),
    "triangle": lambda n, bent=0.05: square(n, bent, shape="triangle"),
    "hexahedron": lambda n, bent=0.03: cube(n, bent),
    "tetrahedron": lambda n, bent=0.03: cube(n, bent, shape="tetrahedron"),
}
ONE_OF_EACH = (gx.Q1P0, gx.Q1, gx.Q2, gx.Q1Q1, gx.Q2Q2, gx.P1P0, gx.P1, gx.P2, gx.P1P1, gx.P2P2)


def started(mesh, variant, start, **changes):
    """A body with that density."""
    return gx.discretise(block(mesh, initial_density=start, **changes), variant)


def apart(problem, function):
    """Root mean square of what a density is off a function that the same variant knows."""
    exact = started(problem.scene.mesh, problem.variant, function)
    return problem.measures.root_mean_square(problem.density.x.array - exact.density.x.array)


@pytest.mark.parametrize("shape", BODIES)
def test_by_any_two_variants_on_one_mesh(shape):
    """To the bit where densities live alike, else with the mass of the body, within the bounds there were."""
    mesh = BODIES[shape](3)
    variants = [variant for variant in CATALOGUE.values() if shape in variant.cells]
    for one in variants:
        old = started(mesh, one, SMOOTH)
        low, high = old.density_range()
        for other in variants:
            given = gx.transfer(old, mesh, other)
            new = started(mesh, other, given)
            alike = one.density_element(shape) == other.density_element(shape)
            assert given.exact == alike
            if alike:
                assert np.array_equal(new.density.x.array, old.density.x.array)
            assert new.mass() == pytest.approx(old.mass(), rel=1e-12)
            if other.density.local or other.density.degree == 1:
                assert low - 1e-12 <= new.density_range()[0] and new.density_range()[1] <= high + 1e-12
            assert apart(new, SMOOTH) < 0.1


@pytest.mark.parametrize("variant", ONE_OF_EACH, ids=lambda variant: variant.name)
def test_a_run_goes_on_to_the_bit_on_the_mesh_made_anew(variant):
    """The same cells in the same order are the same mesh; a nodal density keeps both of its sides where one rests."""
    for growing in (None, ("bone",)):
        grown = gx.solve(block(square(4, 0.05, shape=variant.cells[0]), growing=growing), variant)
        mesh = square(4, 0.05, shape=variant.cells[0])
        new = started(mesh, variant, gx.transfer(grown, mesh, variant), growing=growing)
        assert np.array_equal(densities(new), densities(grown.problem))
        assert np.array_equal(new.densities_of_cells(), grown.problem.densities_of_cells())


PAIRS = [(a, b) for a in ("quadrilateral", "triangle") for b in ("quadrilateral", "triangle")]


@pytest.mark.parametrize(("one", "other"), [*PAIRS, ("hexahedron", "tetrahedron"), ("tetrahedron", "hexahedron")])
def test_another_mesh_of_the_same_body_has_the_mass(one, other):
    """Whatever its cells; the error falls with their size."""
    sizes = (4, 8) if one in ("quadrilateral", "triangle") else (2, 4)
    sources = [variant for variant in ONE_OF_EACH if one in variant.cells]
    for variant in (variant for variant in ONE_OF_EACH if other in variant.cells):
        for source in (sources[1], sources[3]):
            errors = []
            for n in sizes:
                old = started(BODIES[one](n), source, SMOOTH)
                mesh = BODIES[other](n + n // 2, 0.02)
                given = gx.transfer(old, mesh, variant)
                new = started(mesh, variant, given)
                assert new.mass() == pytest.approx(old.mass(), rel=1e-10)
                assert 0 < given.correction < 0.03 and given.beside == given.outside == 0 and not given.exact
                errors.append(apart(new, SMOOTH))
            assert errors[1] < 0.75 * errors[0], (source.name, variant.name, errors)


def test_what_grows_and_what_rests_keep_their_masses():
    """On another mesh that parts them along the same line: metal gives nothing to bone."""
    start = {"bone": lambda x: 1 + x[1], "implant": 8.0}
    old = started(square(4), gx.Q1, start, growing=("bone",))
    for variant in (gx.Q1P0, gx.Q2, gx.Q1Q1, gx.Q2Q2):
        for mesh in (square(4), square(6)):
            new = started(mesh, variant, gx.transfer(old, mesh, variant), growing=("bone",))
            assert new.mass() == pytest.approx(old.mass(), rel=1e-10)
            assert new.mass("implant") == pytest.approx(old.mass("implant"), rel=1e-10)
            assert new.density_range()[1] <= 2.0 + 1e-12 and new.density_range("implant")[0] >= 8.0 - 1e-9


@pytest.mark.parametrize("variant", [gx.Q1, gx.Q1P0, gx.Q1Q1], ids=lambda variant: variant.name)
def test_an_implant_where_bone_was(variant):
    """Region by region: the bone that is left begins as it was, the implant as it is given."""
    mesh = square(4)
    old = started(mesh, gx.Q1, SMOOTH)
    whole = gx.transfer(old, mesh, variant)
    new = started(mesh, variant, {"bone": whole, "implant": 7.0}, growing=("bone",))
    bone = new.cells_of("bone")
    assert new.densities_of_cells()[bone] == pytest.approx(whole.of_cells()[bone], rel=1e-15)
    assert new.density_range("implant") == (7.0, 7.0)
    assert list(gx.march(new.scene, variant, new))


def test_a_part_of_a_body_has_what_was_there():
    """Less bone than there was: no mass is put where it was not."""
    import dolfinx

    part = dolfinx.mesh.create_rectangle(COMM, [(0.0, 0.0), (0.5, 1.0)], (3, 7), dolfinx.mesh.CellType.quadrilateral)
    mesh = gx.Mesh.with_names(part, {"left": lambda x: np.isclose(x[0], 0), "right": lambda x: np.isclose(x[0], 0.5)})
    old = started(square(8), gx.Q1, SMOOTH)
    given = gx.transfer(old, mesh, gx.Q1)
    assert np.isnan(given.correction)
    assert apart(started(mesh, gx.Q1, given), SMOOTH) < 0.01


@pytest.mark.parametrize("variant", [gx.P1P0, gx.P2, gx.P1P1], ids=lambda variant: variant.name)
def test_cells_that_two_meshes_share_keep_what_they_had(variant):
    """To the bit on some of the run's cells; and points on the border of a cell have its field, not a neighbour's."""
    import dolfinx

    from growthx.discretisation.transfers.samples import means_of_cells

    rough = lambda x: 1 + 0.5 * np.sin(40 * x[0] + 30 * x[1] + 50 * x[2])  # noqa: E731
    shape = dolfinx.mesh.CellType.tetrahedron
    part = dolfinx.mesh.create_box(COMM, [(0.0, 0.0, 0.0), (0.5, 1.0, 1.0)], (2, 4, 4), shape)
    mesh = gx.Mesh.with_names(part, {"left": lambda x: np.isclose(x[0], 0), "right": lambda x: np.isclose(x[0], 0.5)})
    old = started(cube(4, shape="tetrahedron"), variant, rough)
    given = gx.transfer(old, mesh, variant)
    own, new = started(mesh, variant, rough), started(mesh, variant, given)
    assert given.exact and np.ptp(densities(own)[:, 3]) > 0.3
    assert densities(new) == pytest.approx(densities(own), rel=1e-12)
    means = means_of_cells(old, old.densities_of_cells().mean(axis=1), mesh, mesh.owned_cells)
    assert means == pytest.approx(own.densities_of_cells().mean(axis=1), rel=1e-12)


def wider(by):
    """The unit square, stretched to the right."""
    mesh = square(4)
    mesh.domain.geometry.x[:, 0] *= 1 + by
    return mesh


def test_what_lies_outside_is_named_with_its_share_or_given():
    """A density from nowhere would be silent; what another mesh has of the same curve is not outside."""
    old = started(square(4), gx.Q1, 1.5)
    with pytest.raises(gx.InputError, match=r"^4\d\.?\d* % of the mesh, at \(.*\) for one, lie outside the body of"):
        gx.transfer(old, wider(1.0), gx.Q1)
    given = gx.transfer(old, wider(1.0), gx.Q1, outside=0.5)
    assert 0.4 < given.outside < 0.5 and "outside" in repr(given)
    assert started(given.mesh, gx.Q1, given).density_range() == pytest.approx((0.5, 1.5))
    near = gx.transfer(old, wider(0.04), gx.Q1)
    assert 0 < near.beside < 0.1 and started(near.mesh, gx.Q1, near).density_range() == pytest.approx((1.5, 1.5))


def test_it_is_for_its_mesh_and_variant_alone():
    """Elsewhere its numbers would mean something else."""
    mesh, old = square(3), started(square(3), gx.Q1, SMOOTH)
    given = gx.transfer(old, mesh, gx.Q1)
    with pytest.raises(gx.InputError, match=r"with Q1 at t = 0 for Q1 was made for that variant.*Q1P0"):
        started(mesh, gx.Q1P0, given)
    with pytest.raises(gx.InputError, match="was made for another mesh"):
        started(square(3), gx.Q1, given)
    with pytest.raises(gx.InputError, match="was made for that variant"):
        started(mesh, gx.Q2, {"bone": given, "implant": 1.0})
    started(mesh, gx.S2fri, given)  # whose densities live at the same points
    for wrong, sentence in (
        ((None, mesh, gx.Q1), "the density to transfer is that of None"),
        ((gx.Q1, mesh, gx.Q1), "the density to transfer is that of"),
        ((old, "mesh", gx.Q1), "the mesh to transfer a density to is 'mesh'"),
        ((old, mesh, "Q1"), "the variant to transfer a density to is 'Q1'"),
        ((old, mesh, gx.P1), "P1 is a discretisation for triangles"),
        ((old, cube(2), gx.Q1), "in 2 dimensions and the mesh is in 3"),
    ):
        with pytest.raises(gx.InputError, match=sentence):
            gx.transfer(*wrong)
    with pytest.raises(gx.InputError, match="the density outside is -1"):
        gx.transfer(old, mesh, gx.Q1, outside=-1)


def test_the_next_run_begins_under_its_load():
    """Without a ramp the displacement is found at once, and what was in equilibrium stays."""
    loads = (gx.Traction("right", (0.2, -0.02)),)
    scene = block(square(4), loads=loads, program=gx.Program(step=2.0, until=400.0, ramp=4.0))
    grown = gx.solve(scene, gx.Q1, stepping=gx.FixedSteps(equilibrium=1e-6))
    for mesh, variant, change in ((scene.mesh, gx.Q1, 1e-4), (scene.mesh, gx.Q2, 0.02), (square(6), gx.Q1, 0.02)):
        program = gx.Program(step=0.1, until=0.1)
        after = replace(scene, mesh=mesh, initial_density=gx.transfer(grown, mesh, variant), program=program)
        problem = gx.discretise(after, variant)
        before = problem.mass()
        (step,) = gx.march(after, variant, problem)
        assert step.load == 1.0 and step.mass == pytest.approx(before, rel=change)
        assert before == pytest.approx(grown.problem.mass(), rel=1e-10)


def test_the_femur_by_another_variant():
    """Zone means of the femur by Q1 stay where they are by Q2 and by Q1P0, and the mass does."""
    scene = gx.scenes.femur(step=4.0, until=8.0)
    grown = gx.solve(scene, gx.Q1)
    zones = gx.zones.area_means(grown.problem, scene.zones)
    for variant in (gx.Q2, gx.Q1P0, gx.Q1Q1):
        problem = gx.discretise(replace(scene, initial_density=gx.transfer(grown, scene.mesh, variant)), variant)
        assert problem.mass() == pytest.approx(grown.problem.mass(), rel=1e-12)
        if variant is not gx.Q1Q1:
            assert gx.zones.area_means(problem, scene.zones) == pytest.approx(zones, rel=0.005)
