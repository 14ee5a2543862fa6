"""Orders of convergence of the coupled problem in h and Δt, and the proof of the solution they are measured by."""

from dataclasses import replace

import dolfinx
import mpmath
import numpy as np
import pytest
import sympy as sp
import ufl
from mpi4py import MPI

import growthx as gx
from benchmarks.accuracy import manufactured
from benchmarks.accuracy.convergence import orders, page, study
from growthx.constitutive.kinematics import displacement_gradient
from growthx.discretisation.variants import CATALOGUE, suited
from growthx.fem import kernels
from growthx.meshing.sampling import positions

DIGITS = 40
DIMENSIONS = pytest.mark.parametrize("dim", [2, 3])


def case(family, name):
    return pytest.param(family, gx.variants.named(name), id=f"{name}-{family.name}")


# -- the manufactured solution -----------------------------------------------------------------------------------------


def assert_zero(expressions, dim):
    """All expressions vanish at some points of the body, to almost 40 digits."""
    function = sp.lambdify(manufactured.COORDINATES[:dim], list(expressions), "mpmath", cse=True)
    with mpmath.workdps(DIGITS):
        for point in ((5, 31, 83), (23, 70, 44), (58, 92, 19), (96, 61, 37)):
            values = function(*(mpmath.mpf(number) / 97 for number in point[:dim]))
            assert max(abs(value) for value in values) < mpmath.mpf(10) ** (5 - DIGITS)


@DIMENSIONS
def test_the_stress_of_the_solution_is_the_derivative_of_its_energy(dim):
    """Stress (7) and energy are typed independently: one that is not the other's derivative would be a typing error."""
    problem = manufactured.manufactured(dim)
    F = sp.Matrix(dim, dim, sp.symbols(f"F:{dim * dim}"))
    rho = sp.Symbol("rho")
    energy = (rho / manufactured.REFERENCE) ** manufactured.N * manufactured.elastic_energy(F)
    solution = {rho: problem.density, **dict(zip(F, problem.gradient + sp.eye(dim), strict=True))}
    derivative = [energy.diff(entry).subs(solution) for entry in F]
    assert_zero([a - b for a, b in zip(derivative, problem.stress, strict=True)], dim)


@DIMENSIONS
def test_the_body_force_balances_momentum(dim):
    """(4) with Div P̄ by hand, through Piola's identity Div F⁻ᵀ = −F⁻ᵀ ∇ln J: not by the derivation that is tested."""
    problem, x = manufactured.manufactured(dim), manufactured.COORDINATES[:dim]
    lam, mu = manufactured.lame()
    weight = (problem.density / manufactured.REFERENCE) ** manufactured.N
    F = problem.gradient + sp.eye(dim)
    log_J = sp.log(F.det())
    cofactor = F.cofactor_matrix() / F.det()
    laplacian = sp.Matrix([sum(component.diff(at, 2) for at in x) for component in problem.displacement])
    grad_log_J = sp.Matrix([log_J.diff(at) for at in x])
    grad_weight = sp.Matrix([weight.diff(at) for at in x])
    divergence = (mu * F + (lam * log_J - mu) * cofactor) * grad_weight
    divergence += weight * (mu * laplacian + (lam - lam * log_J + mu) * cofactor * grad_log_J)
    assert_zero(divergence + problem.body_force, dim)


@DIMENSIONS
def test_the_attractor_balances_mass(dim):
    """(3) with (6) in the form of (17): the residual vanishes as an expression, not only at points."""
    problem = manufactured.manufactured(dim)
    relative = problem.density / manufactured.REFERENCE
    energy = relative**manufactured.N * manufactured.elastic_energy(problem.gradient + sp.eye(dim))
    source = manufactured.RATE * (relative**-manufactured.M * energy - problem.attractor)
    assert sp.expand(problem.density - manufactured.REFERENCE - manufactured.STEP * source) == 0


@DIMENSIONS
def test_the_solution_is_what_the_study_says_it_is(dim):
    """The clamped side rests, strains are finite, the density varies, and a positive one exists also at rest."""
    ticks = np.linspace(0, 1, 15)
    x = np.reshape(np.meshgrid(*[ticks] * dim, [0.0] * (4 - dim)), (-1, 15**dim * (4 - dim)))[:3]
    field = {name: manufactured.numeric(dim, name)(x) for name in ("displacement", "gradient", "density", "attractor")}
    assert np.all(field["displacement"][:, x[0] == 0] == 0)
    stretches = np.linalg.svd(field["gradient"].transpose(2, 0, 1) + np.eye(dim), compute_uv=False)
    assert 0.75 < stretches.min() < 0.9 and 1.3 < stretches.max() < 1.45
    relative = field["density"] / float(manufactured.REFERENCE)
    assert (relative.min(), relative.max()) == pytest.approx((0.8, 1.2), abs=0.01)
    resorbed = field["attractor"] * float(manufactured.RATE * manufactured.STEP / manufactured.REFERENCE)
    assert np.all(resorbed > 0) and np.all(resorbed < 1)


def one_cell(dim):
    """The unit square or cube as one cell, on this rank."""
    if dim == 2:
        return dolfinx.mesh.create_unit_square(MPI.COMM_SELF, 1, 1, dolfinx.mesh.CellType.quadrilateral)
    return dolfinx.mesh.create_unit_cube(MPI.COMM_SELF, 1, 1, 1, dolfinx.mesh.CellType.hexahedron)


@DIMENSIONS
def test_the_laws_of_growthx_give_the_same_data(dim):
    """Were a law of growthx not the paper's, all variants would converge, to something else than this solution."""
    domain = one_cell(dim)
    problem, x = manufactured.manufactured(dim), ufl.SpatialCoordinate(domain)

    def in_ufl(expressions):
        language = [{"sin": ufl.sin, "cos": ufl.cos}]
        return sp.lambdify(manufactured.COORDINATES[:dim], list(expressions), language)(*(x[i] for i in range(dim)))

    u, rho = ufl.as_vector(in_ufl(problem.displacement)), in_ufl([problem.density])[0]
    scene = manufactured.scene(manufactured.QUADRILATERALS.mesh(2) if dim == 2 else manufactured.HEXAHEDRA.mesh(2))
    material, growth = scene.material, replace(scene.growth, attractor=0.0)
    H = displacement_gradient(u)
    P = material.stress(H, rho)
    rate = (rho - material.reference_density) / scene.program.step
    attractor = (growth.mass_source(rho, material.energy_at(H), material) - rate) / growth.rate

    X = np.random.default_rng(1).uniform(size=(20, dim))
    places = positions(gx.Mesh(domain, {}), X)[0].T  # the axes of the cell may be others than those of space
    for name, expression in {"stress": P, "body_force": -ufl.div(P), "attractor": attractor}.items():
        values = kernels.expression(expression, X).eval(domain, np.array([0], dtype=np.int32))
        expected = manufactured.numeric(dim, name)(places)
        error = values.reshape(len(X), -1) - expected.reshape(-1, len(X)).T
        assert np.abs(error).max() < 1e-12 * np.abs(expected).max(), name


# -- orders in space ---------------------------------------------------------------------------------------------------


def check_orders(curves):
    """Each observed order reaches theory, and not more where a constant or the degree allows no more."""
    for curve in curves:
        said = f"{curve.variant} on {curve.family}: {curve.quantity} of order {curve.order:.2f}, theory {curve.theory}"
        assert curve.order > curve.theory.expected - orders.SLACK, said
        constant = not isinstance(CATALOGUE[curve.variant].density, gx.variants.Nodal)
        if curve.quantity == orders.GRADIENT or (curve.quantity == orders.EVERYWHERE and constant):
            assert curve.order < curve.theory.expected + 0.2, said


PLANE = [
    case(family, variant.name)
    for family in (manufactured.QUADRILATERALS, manufactured.TRIANGLES)
    for variant in suited(family.cell)
]


@pytest.mark.parametrize(("family", "variant"), PLANE)
def test_orders_in_h_in_the_plane(family, variant):
    """An element, a rule or a coupling term that is slightly wrong still gives plausible fields, but not the order."""
    check_orders(study.in_space(variant, family, (12, 24)))


def test_a_law_that_is_off_by_one_per_cent_has_no_order(monkeypatch):
    """The proof that the slopes can fail: errors of that size must not hide behind those of the mesh."""
    right = manufactured.scene

    def wrong(mesh):
        scene = right(mesh)
        return replace(scene, growth=replace(scene.growth, rate=1.01 * scene.growth.rate))

    monkeypatch.setattr(manufactured, "scene", wrong)
    for curve in study.in_space(gx.Q2Q2, manufactured.QUADRILATERALS, (12, 24)):
        assert curve.order < 0.5, curve


@pytest.mark.parametrize("variant", [gx.Q2, gx.S2Q1, gx.S2fri], ids=lambda variant: variant.name)
def test_serendipity_loses_an_order_on_trapezoids(variant):
    """Which is why Q2 is worth its ninth node on meshes that are not smooth: 3 in L², where serendipity keeps 2."""
    curve = study.in_space(variant, manufactured.TRAPEZOIDS, (12, 24))[0]
    assert curve.quantity == orders.DISPLACEMENT
    assert curve.order == pytest.approx(3 if variant is gx.Q2 else 2, abs=orders.SLACK)


@pytest.mark.parametrize(
    ("family", "variant"), [case(manufactured.HEXAHEDRA, "Q2"), case(manufactured.TETRAHEDRA, "P2P1")]
)
def test_orders_in_h_in_space(family, variant):
    """The third dimension has rules and elements of its own; two variants stand for the others in every run."""
    check_orders(study.in_space(variant, family, (2, 4)))


SOLID = [
    case(family, variant.name)
    for family in (manufactured.HEXAHEDRA, manufactured.TETRAHEDRA)
    for variant in suited(family.cell)
]


@pytest.mark.slow
@pytest.mark.parametrize(("family", "variant"), SOLID)
def test_orders_in_h_in_space_of_every_variant(family, variant):
    """All of them on meshes that are still coarse: orders there are within 0.35 of theory, from below or above."""
    for curve in study.in_space(variant, family, (4, 8)):
        assert curve.order > curve.theory.expected - 0.35, curve


# -- order in time -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("variant", [gx.Q1Q1, gx.Q1P0, gx.Q1, gx.P2], ids=lambda variant: variant.name)
def test_order_in_time_is_one(variant):
    """Implicit Euler at the end of the step, of density and displacement: not at its start, nor of one of them only."""
    for curve in study.in_time(variant, (16, 32)):
        assert curve.order == pytest.approx(1, abs=0.05), curve


# -- what the study leaves ---------------------------------------------------------------------------------------------


def test_the_study_leaves_tables_and_a_picture(shared_folder):
    """A picture or table that fails after minutes of computing is noticed here, in seconds."""
    curves, family = [], manufactured.QUADRILATERALS
    for variant in study.members(family):
        for quantity, order in orders.theory(variant, family).items():
            errors = tuple(1 / n**order.guaranteed for n in (2, 4, 8))
            curves.append(study.Curve(family.name, variant.name, quantity, order, (2, 4, 8), errors))
    assert not any(curve.below_theory for curve in curves)
    page.write(curves, shared_folder)
    MPI.COMM_WORLD.barrier()
    assert "Q2Q2 | 3.00 / 3 | 2.00 / 2 | 2.00 / 2" in (shared_folder / "convergence.md").read_text(encoding="utf-8")
    assert len((shared_folder / "convergence.csv").read_text(encoding="utf-8").splitlines()) == 1 + 3 * len(curves)
    assert (shared_folder / "convergence.png").stat().st_size > 10_000
