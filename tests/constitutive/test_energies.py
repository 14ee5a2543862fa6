"""Stored energies beside the paper's: each against formulas of principal stretches, written here once more."""

from dataclasses import replace
from functools import cache

import dolfinx
import numpy as np
import pytest
import ufl
from blocks import COMM, assert_tangent_matches_differences, block, cube, densities, run, set_iterate, square, tangent
from mpi4py import MPI
from scipy.optimize import brentq

import growthx as gx
from growthx.cli import command
from growthx.common.errors import InputError
from growthx.constitutive.elastic.catalogue import NAMED, named
from growthx.constitutive.elastic.isotropic import Hencky, MooneyRivlin, Ogden, SaintVenantKirchhoff
from growthx.constitutive.homogeneous import uniaxial_equilibrium
from growthx.discretisation.variants import CATALOGUE
from growthx.fem import kernels
from growthx.model.trials import number

E, NU = 2.0, 0.3
LAM, MU = E * NU / ((1 + NU) * (1 - 2 * NU)), E / (2 * (1 + NU))
OGDEN = Ogden(E, NU, powers=(1.3, 4.0, -3.0), shares=(0.4, 0.3, 0.3))
FIBRED = gx.FibredNeoHooke.along(0.0, E, poisson=NU, fibre=3.0)
MATERIALS = [
    gx.Material(E, NU),
    SaintVenantKirchhoff(E, NU),
    Hencky(E, NU),
    MooneyRivlin(E, NU),
    OGDEN,
    gx.LinearElasticity(E, NU),
    FIBRED,
]
each = pytest.mark.parametrize("material", MATERIALS, ids=lambda material: type(material).__name__)


def textbook(material, stretches):
    """Ψ₀ᵉˡ of principal stretches as books have it, by NumPy; fibres along the first."""
    stretches = np.asarray(stretches)
    logs, squares, J = np.log(stretches), stretches**2, np.prod(stretches)
    strains, log_J = (squares - 1) / 2, np.log(np.prod(stretches))
    if isinstance(material, SaintVenantKirchhoff):
        return LAM / 2 * strains.sum() ** 2 + MU * strains @ strains
    if isinstance(material, Hencky):
        return LAM / 2 * logs.sum() ** 2 + MU * logs @ logs
    if isinstance(material, gx.LinearElasticity):
        return LAM / 2 * (stretches.sum() - 3) ** 2 + MU * np.sum((stretches - 1) ** 2)
    if isinstance(material, MooneyRivlin):
        c1, c2 = (1 - material.share) * MU / 2, material.share * MU / 2
        second = squares[0] * squares[1] + squares[1] * squares[2] + squares[2] * squares[0]
        shape = c1 * (squares.sum() - 3 - 2 * log_J) + c2 * (second - 3 - 4 * log_J)
        return shape + (LAM - 4 * c2) / 4 * (J**2 - 1 - 2 * log_J)
    if isinstance(material, Ogden):
        found = LAM / 2 * log_J**2
        for alpha, share in zip(material.powers, material.shares, strict=True):
            found += 2 * share * MU / alpha**2 * (np.sum(stretches**alpha) - 3 - alpha * log_J)
        return found
    neo = LAM / 2 * log_J**2 + MU / 2 * (squares.sum() - 3 - 2 * log_J)
    return neo + (material.fibre / 2 * strains[0] ** 2 if material is FIBRED else 0)


@cache
def compiled(kind):
    """Energy, stress and the stress's derivative along a direction of each of the materials, compiled once."""
    material = MATERIALS[kind]
    mesh = dolfinx.mesh.create_unit_cube(MPI.COMM_SELF, 1, 1, 1)
    H, along = (dolfinx.fem.Constant(mesh, np.zeros((3, 3))) for _ in range(2))
    variable = ufl.variable(H)
    stress = material.stress(variable, material.reference_density)
    i, j, k, m = ufl.indices(4)
    slope = ufl.as_tensor(ufl.diff(stress, variable)[i, j, k, m] * along[k, m], (i, j))
    entries = [tensor[a, b] for tensor in (stress, slope) for a in range(3) for b in range(3)]
    values = ufl.as_vector([material.energy_at(variable), *entries])
    return mesh, H, along, kernels.expression(values, np.array([[0.2, 0.2, 0.2]]))


def evaluated(material, F, direction=None):
    """Energy, stress, (3, 3), and its derivative along a direction at F, (3, 3)."""
    mesh, H, along, expression = compiled(MATERIALS.index(material))
    H.value[:] = F - np.eye(3)
    along.value[:] = 0 if direction is None else direction
    found = np.ravel(expression.eval(mesh, np.array([0], dtype=np.int32)))
    return found[0], found[1:10].reshape(3, 3), found[10:].reshape(3, 3)


def energy(material, F):
    """Ψ₀ᵉˡ by UFL."""
    return evaluated(material, F)[0]


def stress(material, H):
    """Stress by UFL."""
    return evaluated(material, np.eye(3) + H)[1]


def rotation(dim, seed):
    """A random one."""
    Q = np.linalg.qr(np.random.default_rng(seed).standard_normal((dim, dim)))[0]
    Q[0] *= np.sign(np.linalg.det(Q))
    return Q


STRETCHES = [(1.3, 0.8, 1.1), (1.2, 0.9, 0.9), (1.1, 1.1, 1.1), (0.75, 1.3, 1.0)]


@each
def test_energies_are_those_of_books(material):
    """By formulas of principal stretches, in numbers and in UFL, also where stretches coincide."""
    for stretches in STRETCHES:
        expected = textbook(material, stretches)
        assert material.principal_energy(tuple(np.array(stretches) - 1)) == pytest.approx(expected, rel=1e-11)
        assert energy(material, np.diag(stretches)) == pytest.approx(expected, rel=1e-11)


@each
def test_principal_stresses(material):
    """Semi-analytic solutions rest on them: against differences of the books' formulas, weighted by the density."""
    for stretches in STRETCHES:
        extensions = tuple(np.array(stretches) - 1)
        expected = [
            (textbook(material, stretches + shift) - textbook(material, stretches - shift)) / 2e-5
            for shift in 1e-5 * np.eye(3)
        ]
        found = material.principal_stresses(extensions, 2.0)
        assert found == pytest.approx(4 * np.array(expected), rel=1e-7, abs=1e-8)


@each
def test_stress_and_tangent_are_derivatives(material):
    """Against differences of the energy and of the stress, in general and where principal stretches coincide."""
    random = np.random.default_rng(3)
    for H in (random.uniform(-0.15, 0.15, (3, 3)), 0.1 * np.eye(3), np.diag([0.2, -0.05, -0.05])):
        F, step = np.eye(3) + H, 1e-5
        for direction in (np.eye(3), *random.uniform(-1, 1, (3, 3, 3))):
            _, exact, slope = evaluated(material, F, direction)
            ahead, behind = (evaluated(material, F + sign * step * direction) for sign in (1, -1))
            assert np.sum(exact * direction) == pytest.approx((ahead[0] - behind[0]) / (2 * step), rel=1e-7, abs=1e-8)
            assert slope == pytest.approx((ahead[1] - behind[1]) / (2 * step), rel=1e-6, abs=1e-7)


@each
def test_frame_indifference(material):
    """Ψ(Q F) = Ψ(F), P(Q F) = Q P(F); small strains alone see rotations, and are meant to."""
    F = np.eye(3) + np.random.default_rng(7).uniform(-0.15, 0.15, (3, 3))
    for seed in range(3):
        Q = rotation(3, seed)
        if material.small_strain:
            assert abs(energy(material, Q @ F) - energy(material, F)) > 1e-3
            continue
        assert energy(material, Q @ F) == pytest.approx(energy(material, F), rel=1e-12)
        turned = stress(material, Q @ F - np.eye(3))
        assert turned == pytest.approx(Q @ stress(material, F - np.eye(3)), rel=1e-11, abs=1e-12)


@each
def test_isotropy(material):
    """Ψ(F Q) = Ψ(F), but for fibres, which would be none if it held."""
    F = np.eye(3) + np.random.default_rng(8).uniform(-0.15, 0.15, (3, 3))
    change = energy(material, F @ rotation(3, 1)) / energy(material, F) - 1
    assert abs(change) > 1e-3 if material is FIBRED or material.small_strain else abs(change) < 1e-12


@each
def test_nothing_at_rest(material):
    """Or bone would grow without a load."""
    assert energy(material, np.eye(3)) == 0
    assert np.abs(stress(material, np.zeros((3, 3)))).max() == 0
    assert material.principal_energy((0.0, 0.0, 0.0)) == 0


@each
def test_digits_at_small_strains(material):
    """At 1e-4 and 17 000 MPa no digit is lost: Ψ₀ᵉˡ over Hooke's less one falls with the strain down to round-off."""
    material = replace(material, young=17000.0)
    small = np.array([1e-4, -3e-5, -3e-5])
    lam, mu = material.lame
    for factor in (1.0, 1e-2, 1e-4, 1e-6):
        strains = factor * small
        hooke = lam / 2 * strains.sum() ** 2 + mu * strains @ strains
        hooke += 1.5 * strains[0] ** 2 if isinstance(material, gx.FibredNeoHooke) else 0
        assert abs(material.principal_energy(tuple(strains)) / hooke - 1) < 3e-4 * factor + 1e-13


@each
def test_uniaxial_tension_and_shear_against_scalar_solutions(material):
    """A block on rollers with a free side, and one in simple shear, by Q1P0 against root finders and formulas."""
    still = gx.EnergyDrivenGrowth(0.0, 0.0)
    traction = 0.2

    def across(a):
        return brentq(lambda b: material.principal_stresses((a, b, 0.0), 1.0)[1], -0.2, 0.05, xtol=1e-15)

    a = brentq(lambda a: material.principal_stresses((a, across(a), 0.0), 1.0)[0] - traction, 1e-3, 0.3, xtol=1e-15)
    scene = gx.Scene(
        name="pulled",
        mesh=square(1),
        material=material,
        growth=still,
        supports=(gx.Support("left", (0.0, None)), gx.Support("bottom", (None, 0.0))),
        loads=(gx.Traction("right", (traction, 0.0)),),
        program=gx.Program(step=1.0, until=1.0),
    )
    _, problem = run(scene, gx.Q1P0, tolerance=1e-12)
    corner = problem.sample_displacement(np.array([[1.0, 1.0]]))[0]
    assert corner == pytest.approx([a, across(a)], rel=1e-8)
    # Of simple shear by γ, everywhere held: the stress P₁₂ by a difference of the book's energy in γ.
    gamma = 0.2

    def sheared(g):
        stretches = np.linalg.svd(np.array([[1.0, g, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]))[1]
        if isinstance(material, gx.LinearElasticity):
            return MU * g**2 / 2
        if material is FIBRED:  # along x, which shear in x does not stretch
            return textbook(gx.Material(E, NU), stretches)
        return textbook(material, stretches)

    step = 1e-4
    ahead = 8 * (sheared(gamma + step) - sheared(gamma - step)) - (
        sheared(gamma + 2 * step) - sheared(gamma - 2 * step)
    )
    found = stress(material, np.array([[0.0, gamma, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]))
    assert found[0, 1] == pytest.approx(ahead / (12 * step), rel=1e-8)


@each
def test_growth_of_a_homogeneous_block_is_its_equation(material):
    """ρ of two steps by Q1P0 and Q1Q1 where all displacements are held: implicit Euler of one number."""
    stretch, rate, attractor, step = 0.1, 4.0, 0.005, 0.25
    scene = block(
        square(2, 0.05),
        material=replace(material, reference_density=1.2),
        growth=gx.EnergyDrivenGrowth(attractor, rate),
        supports=(
            gx.Support("left", (0.0, None)),
            gx.Support("right", (stretch, None)),
            gx.Support("bottom", (None, 0.0)),
            gx.Support("top", (None, 0.0)),
        ),
        loads=(),
        program=gx.Program(step=step, until=2 * step),
    )
    energy_ = textbook(material, (1 + stretch, 1.0, 1.0))
    rho = 1.2
    for _ in range(2):
        old = rho
        rho = brentq(lambda r, old=old: r - old - step * rate * (energy_ * 1.2 / r - attractor), 0.1, 10, xtol=1e-15)
    for variant in (gx.Q1P0, gx.Q1Q1):
        _, problem = run(scene, variant, tolerance=1e-12)
        assert densities(problem)[:, 2] == pytest.approx(rho, rel=1e-8)


@pytest.mark.parametrize("variant", [gx.Q1, gx.Q1Q1], ids=lambda variant: variant.name)
@pytest.mark.parametrize("material", [Hencky(1.0, 0.25), gx.LinearElasticity(1.0, 0.25)], ids=["Hencky", "linear"])
def test_tangents_are_consistent(material, variant):
    """Condensed and monolithic, by the same text."""
    scene = block(square(2, 0.05), material=replace(material, reference_density=1.2))
    problem = gx.discretise(scene, variant)
    problem.system.begin_step(0.1, 1.0)
    set_iterate(
        problem,
        lambda x: np.stack([0.1 * x[0] + 0.03 * x[1] ** 2, -0.05 * x[0] * x[1]]),
        lambda x: 1.2 + 0.1 * x[0] - 0.05 * x[1],
    )
    assert_tangent_matches_differences(problem, tangent(problem), count=1)


def test_energies_in_space():
    """Three dimensions, of cells that are no bricks: equilibrium and growth run, of each parameter a field."""
    fields = {"young": {"bone": 1.0, "implant": 5.0}, "poisson": {"bone": 0.3, "implant": 0.25}}
    material = Ogden(
        **fields, reference_density={"bone": 1.2, "implant": 1.3}, density_exponent={"bone": 2.0, "implant": 1.5}
    )
    steps, _ = run(block(cube(2, 0.05), material=material, program=gx.Program(step=0.1, until=0.1)), gx.Q1P0)
    assert steps[-1].newton.converged


def test_ogden_and_its_kin():
    """One term with α = 2 is neo-Hooke, and many small exponents near zero Hencky's."""
    extensions = (0.3, -0.2, 0.1)
    neo = Ogden(E, NU, powers=(2.0,)).principal_energy(extensions)
    assert neo == pytest.approx(gx.Material(E, NU).principal_energy(extensions), rel=1e-13)
    flat = Ogden(E, NU, powers=(0.01, -0.01)).principal_energy(extensions)
    assert flat == pytest.approx(Hencky(E, NU).principal_energy(extensions), rel=1e-5)


# -- fibres ------------------------------------------------------------------------------------------------------------


def tip(material, **changes):
    """Displacement of the corner of a square that is pulled, and the problem."""
    scene = gx.Scene(
        name="fibres",
        mesh=square(2),
        material=material,
        growth=gx.EnergyDrivenGrowth(0.0, 0.0),
        supports=(gx.Support("left", (0.0, None)), gx.PointSupport((0.0, 0.0), (None, 0.0))),
        loads=(gx.Traction("right", (0.2, 0.0)),),
        program=gx.Program(step=1.0, until=1.0),
    )
    result = gx.solve(replace(scene, **changes), gx.Q1P0)
    return result.problem.sample_displacement(np.array([[1.0, 1.0]]))[0]


def test_directions_may_be_numbers_functions_cells_and_regions():
    """One field of fibres said in five ways: the same body."""
    known = {"poisson": NU, "fibre": 3.0}
    vector = (np.cos(np.pi / 6), np.sin(np.pi / 6))
    ways = [
        30.0,
        vector,
        lambda x: vector,
        lambda x: np.stack([2 * vector[0] + 0 * x[0], 2 * vector[1] + 0 * x[0]]),
        np.tile(vector, (4, 1)),
        {"bone": 30.0, "implant": lambda x: vector},
    ]
    found = [tip(gx.FibredNeoHooke.along(way, E, **known)) for way in ways]
    assert np.ptp(found, axis=0) == pytest.approx(0, abs=1e-12)
    assert np.abs(found[0] - tip(gx.FibredNeoHooke.along(0.0, E, **known))).max() > 1e-3


def test_turning_fibres_and_load_turns_the_answer():
    """Fibres at 90° and a strain along y are those at 0° and along x."""
    turned = gx.FibredNeoHooke.along(90.0, E, poisson=NU, fibre=3.0)
    assert turned.principal_energy((-0.1, 0.2, 0.0)) == pytest.approx(
        FIBRED.principal_energy((0.2, -0.1, 0.0)), rel=1e-13
    )


def test_fibres_that_cancel_on_the_mean_can_be_checkpointed(shared_folder):
    """Directions all around have no mean; a run is known again all the same."""
    around = gx.FibredNeoHooke.along(lambda x: np.stack([x[1] - 0.5, 0.5 - x[0]]), E, poisson=NU)
    scene = block(square(2), material=around, program=gx.Program(step=0.1, until=0.2))
    gx.solve(scene, gx.Q1P0, out=shared_folder / "around", checkpoint=1)
    assert gx.solve(scene, gx.Q1P0, resume=shared_folder / "around").converged


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (
            lambda: gx.FibredNeoHooke.along((0.0, 0.0), E),
            r"^the direction of the fibres is \(0\.0, 0\.0, 0\.0\): a vec",
        ),
        (
            lambda: gx.FibredNeoHooke.along("x", E),
            r"^the direction of the fibres is 'x': an angle in degrees, a vector",
        ),
        (
            lambda: gx.FibredNeoHooke.along((1.0, 0.0, 0.0, 0.0), E),
            r"^the direction of the fibres is \(1\.0, 0\.0, 0\.",
        ),
        (lambda: gx.FibredNeoHooke(E, fibre=-1.0), r"^the modulus k of fibres is -1: a number of at least 0 would be"),
        (lambda: Ogden(E, powers=(0.0,)), r"^the powers α of stretches are \(0\.0,\): one or more, none of them"),
        (lambda: Ogden(E, powers=()), r"^the powers α of stretches are \(\): one or more"),
        (
            lambda: Ogden(E, powers=(1.0, 2.0), shares=(1.0, 1.0)),
            r"^the shares of the terms .* with the sum 1 would",
        ),
        (
            lambda: MooneyRivlin(E, 0.1),
            r"^Poisson's ratio ν beside the share 0\.25 of the second invariant is 0\.1: one",
        ),
        (lambda: MooneyRivlin(E, share=2.0), r"^the share s of the second invariant is 2: a number from 0 to 1 would"),
        (lambda: Hencky(-1.0), r"^Young's modulus E is -1: a positive number would be right$"),
        (lambda: gx.LinearElasticity(E, 0.5), r"^Poisson's ratio ν is 0\.5: a number above -1 and below 0\.5 would be"),
        (lambda: SaintVenantKirchhoff("stiff"), r"^Young's modulus E is 'stiff': a positive number would be right$"),
        (lambda: named("rubber"), r"^there is no stored energy 'rubber': one of neo-hooke, saint-venant-kirchhoff, h"),
    ],
)
def test_impossible_parameters_are_refused(make, sentence):
    """In one sentence with the value and what would be right."""
    with pytest.raises(InputError, match=sentence):
        make()


def test_fibres_of_zero_length_somewhere_are_refused_on_all_ranks():
    """Of a function and of cells: 0/0 would become a body without numbers."""
    for way in (
        lambda x: np.stack([np.where(x[0] < 0.5, 0.0, 1.0), 0 * x[0]]),
        np.array([[0.0, 0.0]] + [[1.0, 0.0]] * 3),
    ):
        with pytest.raises(InputError, match=r"^the direction of the fibres is zero somewhere: vectors that are not "):
            tip(gx.FibredNeoHooke.along(way, E))
    assert COMM.allreduce(1) == COMM.size


# -- what follows ------------------------------------------------------------------------------------------------------


def test_small_strains_know_no_deformed_body():
    """A pressure would follow the deformation; a body pressed flat is no failure; stress and strain are Hooke's."""
    small = gx.LinearElasticity(1.0, 0.25, 1.2)
    with pytest.raises(
        InputError, match=r"^the pressure on 'right' follows the deformation, and LinearElasticity is of"
    ):
        block(square(2), material=small, loads=(gx.Pressure("right", 0.1),))
    scene = block(square(1), material=small, loads=(gx.Traction("right", (-8.0, 0.0)),))
    result = gx.solve(scene, gx.Q1P0)
    assert result.converged and result.problem.sample_displacement(np.array([[1.0, 0.5]]))[0, 0] < -1
    H = np.array([[0.0, 0.4], [0.1, 0.0]])
    variable = ufl.as_matrix(H.tolist())
    for value, expected in ((small.strain(variable), 0.25), (small.true_stress(variable, 1.2), 2 * 0.4 * 0.25)):
        assert number(value[0, 1]) == pytest.approx(expected) == number(value[1, 0])


def test_the_command_line_names_the_energies():
    """`--energy` says which there are, and the scene keeps its parameters."""
    import argparse

    parser = argparse.ArgumentParser()
    command.add_energy(parser)
    text = " ".join(parser.format_help().split())
    assert all(name in text for name in NAMED)
    for kind in NAMED.values():
        material = command.with_energy(block(square(1)), kind).material
        assert type(material) is kind and (material.young, material.poisson, material.reference_density) == (
            1,
            0.25,
            1.2,
        )


def test_homogeneous_states_follow():
    """Biological equilibrium of a bar of Hencky's energy by its formula."""
    material, growth = Hencky(1.0, 0.25, 1.2), gx.EnergyDrivenGrowth(0.05, 4.0)
    at = uniaxial_equilibrium(material, growth, 0.3)
    logs = np.log([at.stretch, at.transverse_stretch])
    lam, mu = material.lame
    energy_ = lam / 2 * logs.sum() ** 2 + mu * logs @ logs
    assert 1.2 / at.density * energy_ == pytest.approx(0.05, rel=1e-9)
    assert (at.density / 1.2) ** 2 * (lam * logs.sum() + 2 * mu * logs[0]) / at.stretch == pytest.approx(0.3, rel=1e-9)
    assert lam * logs.sum() + 2 * mu * logs[1] == pytest.approx(0, abs=1e-12)


TINY = 1e-4  # nominal strain


def tiny(material, shape="quadrilateral"):
    """A block at bone's modulus and strains, that grows by a few per cent in two steps."""
    energy = material.young * TINY**2
    return block(
        square(2, 0.1, shape=shape),
        material=material,
        loads=(gx.Traction("right", (material.young * TINY, -0.3 * material.young * TINY)),),
        growth=gx.EnergyDrivenGrowth(0.4 * energy, rate=1 / energy),
        program=gx.Program(step=0.05, until=0.1),
    )


@pytest.mark.parametrize("variant", CATALOGUE.values(), ids=CATALOGUE)
def test_at_small_strains_all_are_hookes_law_in_every_variant(variant):
    """Where they must agree, at 17 000 MPa and 1e-4, linear elasticity and the paper's energy do, to the strain."""
    results = [
        gx.solve(tiny(kind(17e3, NU, 1.2), variant.cells[0]), variant) for kind in (gx.Material, NAMED["linear"])
    ]
    grown, linear = (result.problem.mass() - 1.2 for result in results)
    assert abs(grown) > 0.01
    assert linear == pytest.approx(grown, rel=50 * TINY)
    assert linear != grown
    assert all(result.steps[-1].mass_defect < 1e-10 for result in results)


@pytest.mark.parametrize("kind", [Hencky, MooneyRivlin, SaintVenantKirchhoff, Ogden])
def test_at_small_strains_the_others_are_too(kind):
    """With a density per cell."""
    paper, other = (gx.solve(tiny(each(17e3, NU, 1.2)), gx.Q1P0).problem.mass() - 1.2 for each in (gx.Material, kind))
    assert other == pytest.approx(paper, rel=50 * TINY)


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1Q1], ids=lambda variant: variant.name)
def test_updates_after_equilibrium_take_them(variant):
    """The staggered baseline with linear elasticity is that with the paper's energy at small strains."""
    ends = []
    for kind in (gx.Material, gx.LinearElasticity):
        *_, last = gx.baselines.update(tiny(kind(17e3, NU, 1.2)), variant)
        ends.append(last.mass - 1.2)
    assert abs(ends[0]) > 0.01
    assert ends[1] == pytest.approx(ends[0], rel=50 * TINY)


def test_the_check_of_a_state_takes_them():
    """m > n by its numbers: of linear elasticity as of the paper's energy; and a law that is not well posed is told."""
    for exponent, holds in ((3.0, True), (1.0, False)):
        scene = tiny(gx.LinearElasticity(17e3, NU, 1.2))
        scene = replace(scene, growth=replace(scene.growth, exponent=exponent))
        assert gx.wellposedness.check(gx.solve(scene, gx.Q1P0).problem).holds == holds


@pytest.mark.parametrize("plane", ["strain", "stress"])
@pytest.mark.parametrize(
    "direction",
    [
        (0.0, 0.0, 1.0),
        (1.0, 0.0, -1.0),
        lambda x: np.stack([np.ones(x.shape[1]), 0 * x[0], x[0]]),
        np.array([[1.0, 0.0, 0.0]] * 3 + [[1.0, 0.0, 0.5]]),
    ],
    ids=["across", "oblique", "function", "cells"],
)
def test_fibres_out_of_a_plane_body_are_refused(plane, direction):
    """Their part across was left out, and with all of it across there was no direction left."""
    material = gx.FibredNeoHooke.along(direction, E, poisson=NU, fibre=3.0)
    with pytest.raises(
        InputError, match=r"^fibre_z of FibredNeoHooke is .*, which points out of a plane body: 0 would"
    ):
        gx.discretise(block(square(2), material=material, plane=plane), gx.Q1)
