"""Loads, influxes and supports on facets inside the body, or on a boundary that is partly inside: right, or refused."""

from dataclasses import replace
from functools import partial

import dolfinx
import numpy as np
import pytest
import ufl
from blocks import (
    COMM,
    ROLLERS,
    assert_tangent_matches_differences,
    block,
    cube,
    densities,
    displacements,
    run,
    set_iterate,
    square,
    tangent,
)
from mpi4py import MPI

import growthx as gx
from growthx.common.errors import InputError
from growthx.fem import kernels
from growthx.post import drawing

FEW = (gx.Q1P0, gx.Q1, gx.Q1sri, gx.Q2, gx.S2fri, gx.Q1Q1, gx.S2Q1, gx.P1P0, gx.P1, gx.P2P1)
variants = pytest.mark.parametrize("variant", FEW, ids=lambda variant: variant.name)
NODAL = (gx.Q1Q1, gx.Q2Q2, gx.P2P1)
nodal = pytest.mark.parametrize("variant", NODAL, ids=lambda variant: variant.name)
STILL = gx.EnergyDrivenGrowth(attractor=0.0, rate=0.0)
SOFT = gx.Material(young=1.0, poisson=0.0)
LINES = (gx.Support("left", (0.0, None)), gx.PointSupport((0.0, 0.0), (None, 0.0)))


def with_middle(mesh):
    """The mesh with "middle", its facets at x = 1/2, and "both", those and its right side."""
    dim, domain = mesh.dim, mesh.domain
    half = COMM.allreduce(np.abs(domain.geometry.x[:, 0]).max(initial=0.0), MPI.MAX) / 2
    found = dolfinx.mesh.locate_entities(domain, dim - 1, lambda x: np.isclose(x[0], half))
    middle = np.sort(found).astype(np.int32)
    both = np.union1d(middle, mesh.boundary("right")).astype(np.int32)
    return replace(mesh, boundaries={**mesh.boundaries, "middle": middle, "both": both})


def plane(variant=gx.Q1, cells=2, **options):
    return with_middle(square(cells, shape=variant.cells[0], **options))


def integral(integrand, measure):
    return COMM.allreduce(dolfinx.fem.assemble_scalar(kernels.form(integrand * measure)))


# -- the measure -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("ghosts", ["none", "shared_facet"])
@pytest.mark.parametrize("shape", ["triangle", "quadrilateral", "tetrahedron", "hexahedron"])
def test_each_facet_is_there_once(shape, ghosts):
    """Also those between two ranks, which both may know, whether each knows the cells of the other or not."""
    cell, mode = getattr(dolfinx.mesh.CellType, shape), getattr(dolfinx.mesh.GhostMode, ghosts)
    if shape in ("triangle", "quadrilateral"):
        domain, dim = dolfinx.mesh.create_unit_square(COMM, 6, 6, cell, ghost_mode=mode), 2
    else:
        domain, dim = dolfinx.mesh.create_unit_cube(COMM, 4, 4, 4, cell, ghost_mode=mode), 3
    facets = dolfinx.mesh.locate_entities(domain, dim - 1, lambda x: np.isclose(x[0], 0.5) | np.isclose(x[0], 1.0))
    mesh = gx.Mesh(domain, {"both": np.sort(facets)})
    x = ufl.SpatialCoordinate(domain)
    measure = mesh.boundary_measure("both", 4)
    assert integral(1.0, measure) == pytest.approx(2.0, rel=1e-13)
    assert integral(x[0] ** 2 * x[dim - 1] ** 2, measure) == pytest.approx(1.25 / 3, rel=1e-13)
    inner, count = mesh.facet_counts("both")
    assert 2 * inner == count > 0


def test_facets_that_are_named_twice_count_once():
    """Names of one's own need not be unique, or sorted."""
    mesh = square(4)
    twice = np.concatenate([mesh.boundary("right"), mesh.boundary("right")[::-1]])
    mesh = replace(mesh, boundaries={"right": twice})
    assert integral(1.0, mesh.boundary_measure("right", 1)) == pytest.approx(1.0)
    assert mesh.facet_counts("right") == (0, 4)


INTERFACE = """
Point(1) = {0, 0, 0}; Point(2) = {1, 0, 0}; Point(3) = {2, 0, 0};
Point(4) = {0, 1, 0}; Point(5) = {1, 1, 0}; Point(6) = {2, 1, 0};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 6}; Line(4) = {6, 5}; Line(5) = {5, 4}; Line(6) = {4, 1};
Line(7) = {2, 5};
Curve Loop(1) = {1, 7, 5, 6}; Curve Loop(2) = {2, 3, 4, -7}; Plane Surface(1) = {1}; Plane Surface(2) = {2};
Mesh.MeshSizeMax = 0.15;
Physical Surface("soft") = {1}; Physical Surface("stiff") = {2};
Physical Curve("left") = {6}; Physical Curve("right") = {3}; Physical Curve("interface") = {7};
Physical Curve("both") = {7, 3};
"""


@pytest.mark.parametrize("refine", [1, 2])
def test_an_interface_of_a_file(shared_folder, refine):
    """Where regions meet, a script names a curve inside: its facets are found on every rank."""
    path = shared_folder / "interface.geo"
    if COMM.rank == 0:
        path.write_text(INTERFACE)
    mesh = gx.meshing.read(path, refine=refine)
    x = ufl.SpatialCoordinate(mesh.domain)
    assert integral(1.0, mesh.boundary_measure("interface", 1)) == pytest.approx(1.0, rel=1e-12)
    assert integral(x[0] * x[1], mesh.boundary_measure("both", 2)) == pytest.approx(1.5, rel=1e-12)
    scene = block(mesh, material=SOFT, growth=STILL, supports=LINES, loads=(gx.Traction("interface", (0.1, 0.0)),))
    steps, problem = run(scene, gx.P1P0, tolerance=1e-12)
    ends = problem.sample_displacement(np.array([[1.0, 0.3], [2.0, 0.7]]))[:, 0]
    assert ends == pytest.approx(stretch(0.1) - 1, rel=1e-9)
    assert steps[-1].reactions["left"] == pytest.approx([-0.1, 0.0], abs=1e-9)


# -- forces that do not depend on the state ----------------------------------------------------------------------------


def stretch(traction):
    """Of a bar of Young's modulus 1 without Poisson's effect: P = (l − 1/l)/2."""
    return traction + np.sqrt(traction**2 + 1)


def bent(dim):
    """A traction that varies over the facet, with the mean 0.1 along the bar."""
    return lambda x: np.stack([0.2 * x[dim - 1], *(0 * x[1] for _ in range(dim - 1))])


FORCES = {
    "traction": lambda on, dim: gx.Traction(on, (0.1, 0.0, 0.0)[:dim]),
    "force": lambda on, dim: gx.DistributedForce(on, (0.1 if on == "middle" else 0.2, 0.0, 0.0)[:dim]),
    "open": lambda on, dim: gx.OpenTraction(on, lambda u, rho, x: ufl.as_vector((0.1, 0.0, 0.0)[:dim])),
    "of time": lambda on, dim: gx.Traction(on, (0.2, 0.0, 0.0)[:dim], history=lambda time: time / 0.8),
}
forces = pytest.mark.parametrize("make", FORCES.values(), ids=FORCES)


@variants
@forces
def test_a_force_inside_stretches_what_is_between_it_and_the_support(variant, make):
    """Silently nothing, or on some versions of DOLFINx all of it, twice: here exactly once, on every variant."""
    mesh = plane(variant)
    for on, behind in (("middle", 0.0), ("both", 0.1)):
        scene = block(mesh, material=SOFT, growth=STILL, supports=ROLLERS, loads=(make(on, 2),))
        steps, problem = run(scene, variant, tolerance=1e-12)
        x, _, u, v = displacements(problem).T
        near, far = stretch(behind + 0.1) - 1, stretch(behind) - 1
        assert u == pytest.approx(near * np.minimum(x, 0.5) + far * np.maximum(x - 0.5, 0.0), abs=1e-10)
        assert v == pytest.approx(0 * v, abs=1e-10)
        assert steps[-1].reactions["left"] == pytest.approx([-0.1 - behind, 0.0], abs=1e-9)


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1Q1, gx.P1P0, gx.P2P1], ids=lambda variant: variant.name)
@forces
def test_a_force_inside_a_body_in_space(variant, make):
    """The same on surfaces."""
    mesh = with_middle(cube(2, shape=variant.cells[1]))
    supports = (*ROLLERS, gx.Support("front", (None, None, 0.0)))
    supports = tuple(replace(each, displacement=(*each.displacement, None)[:3]) for each in supports)
    scene = block(mesh, material=SOFT, growth=STILL, supports=supports, loads=(make("both", 3),))
    steps, problem = run(scene, variant, tolerance=1e-12)
    x, _, _, u, _, _ = displacements(problem).T
    near, far = stretch(0.2) - 1, stretch(0.1) - 1
    assert u == pytest.approx(near * np.minimum(x, 0.5) + far * np.maximum(x - 0.5, 0.0), abs=1e-10)
    assert steps[-1].reactions["left"] == pytest.approx([-0.2, 0.0, 0.0], abs=1e-9)


@pytest.mark.parametrize("mesh", [partial(square, 4), partial(cube, 2)], ids=["plane", "space"])
def test_a_traction_that_varies_is_met_at_the_nodes(mesh):
    """The nodal forces of a traction 0.2 y on a facet row, summed and turned about, inside as on the outer side."""
    mesh = with_middle(mesh())
    found = {}
    for on in ("middle", "right"):
        load = gx.Traction(on, bent(mesh.dim))
        problem = gx.discretise(block(mesh, loads=(load,)), gx.Q1)
        x = problem.displacement_space.tabulate_dof_coordinates()[: problem.system.owned // mesh.dim]
        along = problem.system.loads.nodal_load[:: mesh.dim]
        found[on] = COMM.allreduce(np.array([along.sum(), along @ x[:, mesh.dim - 1]]))
    assert found["middle"] == pytest.approx([0.1, 0.2 / 3], rel=1e-12)
    assert found["right"] == pytest.approx([0.1, 0.2 / 3], rel=1e-12)


def test_a_force_inside_is_met_and_weighted():
    """The resultant on every mesh, and the arrow of the picture where the force is."""
    force = gx.DistributedForce("both", (0.0, -0.3), weight=lambda x: np.where(x[0] < 0.75, 1.0 + x[1], 0.0))
    problem = gx.discretise(block(plane(cells=4, distortion=0.0), loads=(force,)), gx.Q1)
    assert problem.system.loads.resultant(problem.system.loads.nodal_load) == pytest.approx([0.0, -0.3], abs=1e-14)
    (arrow,) = drawing.arrows_of(problem)
    assert arrow.place == pytest.approx([0.5, 0.5 + 1 / 18], abs=0.01)


# -- forces that depend on the state -----------------------------------------------------------------------------------


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1, gx.Q1Q1, gx.P2P1], ids=lambda variant: variant.name)
def test_a_spring_inside_shares_the_load(variant):
    """Pulled at its end and held back at its middle by −k u: each half has its own stretch."""
    pull, spring = 0.3, 0.4
    springs = gx.OpenTraction("middle", lambda u, rho, x: -spring * u)
    loads = (gx.Traction("right", (pull, 0.0)), springs)
    scene = block(plane(variant), material=SOFT, growth=STILL, supports=ROLLERS, loads=loads)
    steps, problem = run(scene, variant, tolerance=1e-13)
    x, _, u, _ = displacements(problem).T
    # (s − 1/s)/2 = t − k (s − 1)/2 in the half that is held.
    held = np.roots([1 + spring, -(2 * pull + spring), -1.0]).max()
    expected = (held - 1) * np.minimum(x, 0.5) + (stretch(pull) - 1) * np.maximum(x - 0.5, 0.0)
    assert u == pytest.approx(expected, abs=1e-10)
    assert steps[-1].reactions["left"] == pytest.approx([-(pull - spring * (held - 1) / 2), 0.0], abs=1e-9)


STATE = {
    "spring": lambda u, rho, x: -0.5 * (1 + x[1]) * u,
    "not linear": lambda u, rho, x: -ufl.dot(u, u) * u + ufl.as_vector([0.1 * x[1], 0.0]),
}


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1, gx.S2fri, gx.Q1Q1, gx.P2P1], ids=lambda variant: variant.name)
@pytest.mark.parametrize("law", STATE.values(), ids=STATE)
@pytest.mark.parametrize("growing", [None, ("bone",)], ids=["all grow", "some rest"])
def test_tangent_is_the_derivative_of_the_forces(variant, law, growing):
    """Where a region that grows meets one that rests, too."""
    changes = {} if growing is None else {"growing": growing}
    mesh = with_middle(square(2, shape=variant.cells[0]))
    problem = gx.discretise(block(mesh, loads=(gx.OpenTraction("both", law),), **changes), variant)
    assert_right_tangent(problem, growing)


@nodal
def test_tangent_of_a_traction_by_density_inside(variant):
    """Nodal densities have one value on a facet inside."""
    traction = gx.OpenTraction("both", lambda u, rho, x: rho**2 * ufl.as_vector([0.05, 0.0]))
    assert_right_tangent(gx.discretise(block(plane(variant), loads=(traction,)), variant))


@nodal
def test_tangent_of_an_influx_inside(variant):
    influx = gx.Influx("both", lambda u, rho, x: 0.3 * (1 + x[1]) * (1.5 - rho) * (1 + ufl.dot(u, u)))
    assert_right_tangent(gx.discretise(block(plane(variant), influx=(influx,)), variant))


def assert_right_tangent(problem, growing=None):
    problem.system.begin_step(0.1, 0.7)
    set_iterate(
        problem,
        lambda x: np.stack([0.3 * np.sin(2 * x[0]) + 0.1 * x[1], 0.2 * x[0] * x[1] - 0.15 * x[1]]),
        lambda x: np.full_like(x[0], 1.2) if growing else 1.0 + 0.3 * np.cos(3 * x[0] + x[1]),
    )
    assert_tangent_matches_differences(problem, tangent(problem))


# -- mass --------------------------------------------------------------------------------------------------------------


@nodal
def test_mass_enters_through_facets_inside(variant):
    """r times length and time, once: a source of mass on a surface."""
    mesh = plane(variant, 4, length=2.0)
    influx = (gx.Influx("both", 0.2),)
    scene = block(mesh, growth=STILL, loads=(), flux=gx.MassFlux(0.1), influx=influx)
    for step in run(scene, variant)[0]:
        assert step.mass == pytest.approx(4 * 1.2 + step.time * 4.0 * 0.2, rel=1e-11)
        assert step.mass_defect < 1e-10


@nodal
def test_influx_inside_is_carried_away_to_where_density_is_held(variant):
    """ρ = ρ₁ + r x/R₀ᶠ up to the facets that let r in, and constant behind them."""
    changes = {
        "growth": STILL,
        "loads": (),
        "program": gx.Program(step=100.0, until=600.0),
        "flux": gx.MassFlux(0.1),
        "prescribed_densities": (gx.PrescribedDensity("left", 1.0),),
        "influx": (gx.Influx("middle", lambda u, rho, x: 0.06),),
    }
    _, problem = run(block(plane(variant, 4), **changes), variant)
    x, _, rho = densities(problem).T
    assert rho == pytest.approx(1.0 + 0.6 * np.minimum(x, 0.5), rel=1e-9)


@nodal
def test_a_density_may_be_held_inside(variant):
    """Its nodes are those of the facets, as of a support."""
    held = (gx.PrescribedDensity("middle", 1.5),)
    scene = block(plane(variant, 4), growth=STILL, loads=(), flux=gx.MassFlux(0.1), prescribed_densities=held)
    steps, problem = run(scene, variant)
    x, _, rho = densities(problem).T
    assert np.all(rho[np.isclose(x, 0.5)] == 1.5) and np.isclose(x, 0.5).sum() >= 5
    assert max(step.mass_defect for step in steps) < 1e-10


@pytest.mark.parametrize("variant", [gx.Q1Q1, gx.P2P1], ids=lambda variant: variant.name)
def test_mass_enters_where_a_region_that_rests_begins(variant):
    """All that is let in goes to the side that grows."""
    influx = (gx.Influx("middle", 0.2),)
    scene = block(plane(variant, 4), growing=("bone",), growth=STILL, loads=(), flux=gx.MassFlux(0.1), influx=influx)
    for step in run(scene, variant)[0]:
        assert step.mass == pytest.approx(0.5 * 1.2 + 0.2 * step.time, rel=1e-11)


# -- supports ----------------------------------------------------------------------------------------------------------


def test_a_support_inside_holds():
    """As it did: what is behind it bears the load alone."""
    mesh = plane(gx.Q1)
    supports = (gx.Support("middle"), gx.Support("left"))
    steps, problem = run(block(mesh, material=SOFT, growth=STILL, supports=supports), gx.Q1)
    x, _, u, _ = displacements(problem).T
    assert u[x < 0.5 + 1e-9] == pytest.approx(0.0, abs=1e-12) and u[x > 0.9].min() > 0.01
    assert steps[-1].reactions["middle"] == pytest.approx([-0.1, 0.02], abs=1e-9)


# -- what has no side --------------------------------------------------------------------------------------------------


def of_cells(mesh):
    """A law by a function that jumps between cells."""
    jumps = dolfinx.fem.Function(dolfinx.fem.functionspace(mesh.domain, ("DG", 0)))
    jumps.x.array[:] = 0.1
    return lambda u, rho, x: jumps * u


SIDED = {
    "pressure": lambda on, mesh: gx.Pressure(on, 0.1),
    "normal": lambda on, mesh: gx.OpenTraction(on, lambda u, rho, x: -0.1 * ufl.FacetNormal(mesh.domain)),
    "gradient": lambda on, mesh: gx.OpenTraction(on, lambda u, rho, x: -0.1 * ufl.dot(ufl.grad(u), u)),
    "divergence": lambda on, mesh: gx.OpenTraction(on, lambda u, rho, x: -0.1 * ufl.div(u) * u),
    "cells": lambda on, mesh: gx.OpenTraction(on, of_cells(mesh)),
    "size of cells": lambda on, mesh: gx.OpenTraction(on, lambda u, rho, x: -u * ufl.det(ufl.Jacobian(mesh.domain))),
}


@pytest.mark.parametrize("make", SIDED.values(), ids=SIDED)
@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1Q1], ids=lambda variant: variant.name)
def test_what_depends_on_the_side_is_refused_inside(make, variant):
    """A facet inside has two normals, and gradients of two cells: nobody can know which is meant."""
    mesh = plane()
    for on, inner, count in (("middle", 2, 2), ("both", 2, 4)):
        with pytest.raises(InputError) as caught:
            gx.discretise(block(mesh, loads=(make(on, mesh),)), variant)
        kind = "pressure" if make is SIDED["pressure"] else "open load"
        assert str(caught.value) == (
            f"the {kind} on '{on}' depends on the side from which its boundary is seen, and {inner} of the {count} "
            f"facets of '{on}' lie inside the body, where they have two: "
            "a boundary of outer facets alone would be right"
        )
    gx.discretise(block(mesh, loads=(make("right", mesh),)), variant)


@pytest.mark.parametrize("cells", gx.Q1.cells, ids=["plane", "space"])
def test_pressure_is_refused_inside_in_every_dimension(cells):
    mesh = with_middle(square(2) if cells == "quadrilateral" else cube(2))
    with pytest.raises(InputError, match=r"the pressure on 'both' .* of the .* facets of 'both' lie inside the body"):
        gx.discretise(block(mesh, loads=(gx.Pressure("both", 0.1),)), gx.Q1)


def test_an_influx_by_a_gradient_is_refused_inside():
    influx = (gx.Influx("middle", lambda u, rho, x: ufl.grad(rho)[0]),)
    with pytest.raises(InputError, match=r"^the influx on 'middle' depends on the side .* 2 of the 2 facets"):
        gx.discretise(block(plane(), influx=influx), gx.Q1Q1)
    influx = (gx.Influx("right", lambda u, rho, x: ufl.grad(rho)[0]),)
    gx.discretise(block(plane(), influx=influx), gx.Q1Q1)


def test_what_only_looks_as_if_it_had_sides_is_taken():
    """The gradient of the position, and derivatives that are none, are the same on both sides."""

    def law(u, rho, x):
        factor = ufl.variable(u[0] + 1)
        return ufl.dot(ufl.grad(x), ufl.as_vector([0.1, 0.0])) - 0.1 * ufl.diff(factor**2, factor) * u

    problem = gx.discretise(block(plane(), loads=(gx.OpenTraction("both", law),)), gx.Q1)
    assert_right_tangent(problem)
