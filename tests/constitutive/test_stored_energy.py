"""Stored energies of one's own, each a function of F: every variant, and what is computed with numbers, obeys them."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
import ufl
from blocks import (
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
from scipy.optimize import root

import growthx as gx
from growthx import results
from growthx.common.errors import InputError
from growthx.constitutive.homogeneous import uniaxial_equilibrium
from growthx.solvers.newton import Newton
from growthx.solvers.settings import NewtonSettings

REFERENCE, N = 1.2, 2.0
QUADRILATERAL = [gx.Q1Q1, gx.Q2Q2, gx.S2Q1, gx.Q1P0, gx.Q1, gx.Q2, gx.Q1sri, gx.S2fri]
each_variant = pytest.mark.parametrize("variant", QUADRILATERAL, ids=lambda variant: variant.name)


@dataclass(frozen=True)
class SaintVenantKirchhoff(gx.StoredEnergy):
    """½ λ tr²E + μ E : E, E = ½ [FᵀF − I]."""

    lam: Any = 0.6
    mu: Any = 0.9

    coefficients = (*gx.StoredEnergy.coefficients, "lam", "mu")

    @property
    def stiffness(self):
        """Young's modulus."""
        return self.mu * (3 * self.lam + 2 * self.mu) / (self.lam + self.mu)

    def energy(self, F):
        """Of Green's strain."""
        E = (F.T * F - ufl.Identity(3)) / 2
        return self.lam / 2 * ufl.tr(E) ** 2 + self.mu * ufl.inner(E, E)


@dataclass(frozen=True)
class MooneyRivlin(gx.StoredEnergy):
    """Compressible: c₁ [I₁ − 3] + c₂ [I₂ − 3] − 2 [c₁ + 2 c₂] ln J + ½ K [J − 1]²."""

    c1: Any = 0.3
    c2: Any = 0.1
    bulk: Any = 1.1

    coefficients = (*gx.StoredEnergy.coefficients, "c1", "c2", "bulk")

    @property
    def stiffness(self):
        """Six times the sum: E, were it incompressible."""
        return 6 * (self.c1 + self.c2)

    def energy(self, F):
        """Of the invariants of FᵀF."""
        C = F.T * F
        first, J = ufl.tr(C), ufl.det(F)
        second = (first**2 - ufl.inner(C, C)) / 2
        shape = self.c1 * (first - 3) + self.c2 * (second - 3) - 2 * (self.c1 + 2 * self.c2) * ufl.ln(J)
        return shape + self.bulk / 2 * (J - 1) ** 2


@dataclass(frozen=True)
class NeoHooke(gx.StoredEnergy):
    """That of `gx.Material`, written by F."""

    young: Any = 1.0
    poisson: float = 0.25

    coefficients = (*gx.StoredEnergy.coefficients, "young")

    @property
    def stiffness(self):
        """E."""
        return self.young

    def energy(self, F):
        """½ λ ln²J + ½ μ [I₁ − 3 − 2 ln J]."""
        E, nu = self.young, self.poisson
        lam, mu = E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu))
        log_J = ufl.ln(ufl.det(F))
        return lam / 2 * log_J**2 + mu / 2 * (ufl.tr(F.T * F) - 3 - 2 * log_J)


def energy_of(material, stretches):
    """The same energies by NumPy, of principal stretches."""
    a, b, c = (np.asarray(stretch) ** 2 for stretch in stretches)
    if isinstance(material, SaintVenantKirchhoff):
        strains = [(square_ - 1) / 2 for square_ in (a, b, c)]
        return material.lam / 2 * sum(strains) ** 2 + material.mu * sum(strain**2 for strain in strains)
    J, first, second = np.sqrt(a * b * c), a + b + c, a * b + b * c + c * a
    shape = material.c1 * (first - 3) + material.c2 * (second - 3) - 2 * (material.c1 + 2 * material.c2) * np.log(J)
    return shape + material.bulk / 2 * (J - 1) ** 2


def stress_of(material, stretches, which):
    """∂Ψ/∂λ by NumPy: a complex step."""
    moved = [stretch + (1e-30j if i == which else 0) for i, stretch in enumerate(stretches)]
    return energy_of(material, moved).imag / 1e-30


MATERIALS = [SaintVenantKirchhoff(reference_density=REFERENCE), MooneyRivlin(reference_density=REFERENCE)]
each_material = pytest.mark.parametrize("material", MATERIALS, ids=lambda material: type(material).__name__)
ATTRACTOR, TRACTION, STEP = 0.06, 0.3, 0.25


def pulled(material, mesh, **changes):
    """A homogeneous block in tension on rollers."""
    sides = [(name, i) for i, name in enumerate(("left", "bottom", "front")[: mesh.dim])]
    scene = block(
        mesh,
        material=material,
        growth=gx.EnergyDrivenGrowth(ATTRACTOR, 4.0),
        supports=tuple(gx.Support(name, tuple(0.0 if k == i else None for k in range(mesh.dim))) for name, i in sides),
        loads=(gx.Traction("right", (TRACTION, 0.0, 0.0)[: mesh.dim]),),
        program=gx.Program(step=STEP, until=2 * STEP),
    )
    return replace(scene, **changes)


def recursion(material, dim=2):
    """Densities of two steps of implicit Euler of that block, by NumPy and a root finder alone."""

    def balances(state, old):
        a, b, rho = state
        stretches, weight = (a, b, b if dim == 3 else 1.0), (rho / REFERENCE) ** N
        stimulus = (rho / REFERENCE) ** (N - 3.0) * energy_of(material, stretches)
        return [
            weight * stress_of(material, stretches, 0) - TRACTION,
            weight * stress_of(material, stretches, 1),
            rho - old - STEP * 4.0 * (stimulus - ATTRACTOR),
        ]

    state = np.array([1.1, 0.95, REFERENCE])
    for _ in range(2):
        solution = root(balances, state, args=(state[2],), tol=1e-14)
        assert np.abs(solution.fun).max() < 1e-12
        state = solution.x
    return state


@each_variant
@each_material
def test_every_variant_obeys_an_energy_of_ones_own(material, variant):
    """The few numbers of a homogeneous block, found without UFL, to 1e-8."""
    _, problem = run(pulled(material, square(2, 0.05)), variant, tolerance=1e-12)
    a, b, rho = recursion(material)
    assert abs(rho - REFERENCE) > 0.02
    assert densities(problem)[:, 2] == pytest.approx(rho, rel=1e-8)
    corner = displacements(problem)[-1]
    assert corner[2:] == pytest.approx([a - 1, b - 1], rel=1e-8)


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1Q1, gx.P1P0], ids=lambda variant: variant.name)
@each_material
def test_energies_in_space(material, variant):
    """The same text for three dimensions."""
    _, problem = run(pulled(material, cube(1, shape=variant.cells[1])), variant, tolerance=1e-12)
    assert densities(problem)[:, 3] == pytest.approx(recursion(material, dim=3)[2], rel=1e-8)


@each_variant
@each_material
def test_tangents_are_consistent(material, variant):
    """Stress, condensed and monolithic tangents follow by differentiation: bent, in a state that is none of rest."""
    scene = block(square(2, 0.05), material=material)
    problem = gx.discretise(scene, variant)
    problem.system.begin_step(0.1, 1.0)
    set_iterate(
        problem,
        lambda x: np.stack([0.1 * x[0] + 0.03 * x[1] ** 2, -0.05 * x[0] * x[1]]),
        lambda x: 1.2 + 0.1 * x[0] - 0.05 * x[1],
    )
    assert_tangent_matches_differences(problem, tangent(problem), count=2)


def residuals(scene, variant):
    """Residual norms of the first step of a run with full tangents."""
    problem = gx.discretise(scene, variant)
    with Newton(problem.system, NewtonSettings(tolerance=1e-13, full=True)) as newton:
        norms = []
        newton._snes.setMonitor(lambda snes, iteration, norm: norms.append(norm))
        problem.system.begin_step(scene.program.step, 1.0)
        report = newton.solve()
    return np.array(norms), report


def is_quadratic(norms):
    """Whether the last steps square the residual, before round-off."""
    norms = norms[norms > 1e-13 * norms[0]]
    orders = np.log(norms[2:] / norms[1:-1]) / np.log(norms[1:-1] / norms[:-2])
    return orders.max() > 1.7 and norms[-1] < 1e-5 * norms[0]


@each_variant
@each_material
def test_newton_converges_quadratically(material, variant):
    """With full tangents."""
    scene = block(square(3, 0.05), material=material, program=gx.Program(step=0.1, until=0.1))
    norms, report = residuals(scene, variant)
    assert report.converged and is_quadratic(norms)


@each_material
def test_uniaxial_answer(material):
    """Biological equilibrium of a bar, against a root finder's and NumPy's, and that of a long march."""
    at = uniaxial_equilibrium(material, gx.EnergyDrivenGrowth(ATTRACTOR, 4.0), TRACTION)

    def balances(state):
        a, b, rho = state
        stretches, weight = (a, b, 1.0), (rho / REFERENCE) ** N
        return [
            weight * stress_of(material, stretches, 0) - TRACTION,
            stress_of(material, stretches, 1),
            (rho / REFERENCE) ** -1.0 * energy_of(material, stretches) - ATTRACTOR,
        ]

    solution = root(balances, [1.1, 0.95, 1.2], tol=1e-14)
    assert np.abs(solution.fun).max() < 1e-12
    assert [at.stretch, at.transverse_stretch, at.density] == pytest.approx(solution.x, rel=1e-8)
    for variant in (gx.Q1P0, gx.Q1Q1):
        problem = gx.homeostasis(pulled(material, square(2)), variant)
        assert problem.mean_density() == pytest.approx(at.density, rel=1e-8)


@each_variant
def test_the_papers_energy_written_by_F_is_the_papers(variant):
    """A user's text and growthx's must be one law, bent and in outputs, too."""
    mesh = square(2, 0.05)
    mine = NeoHooke(reference_density=1.2)
    one, other = (run(block(mesh, material=law), variant, tolerance=1e-12)[1] for law in (mine, block(mesh).material))
    assert densities(one) == pytest.approx(densities(other), rel=1e-9)
    assert displacements(one) == pytest.approx(displacements(other), abs=1e-9)
    theirs = results.cell_fields(other)
    for name, values in results.cell_fields(one).items():
        assert values == pytest.approx(theirs[name], rel=1e-7, abs=1e-9)
    assert one.system.force_scale() == pytest.approx(other.system.force_scale())


@pytest.mark.parametrize("growth", [gx.StrainDrivenGrowth(0.1, 1.0), gx.StressDrivenGrowth(0.1, 1.0)])
@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1Q1, gx.Q1sri], ids=lambda variant: variant.name)
def test_fields_and_what_is_measured_against_the_stiffness(variant, growth):
    """Equivalent strains, supports that move, regions at rest: what Young's modulus was for."""
    mesh = square(2, 0.05)
    changes = {
        "supports": (gx.Support("left"), gx.Support("right", (0.05, 0.0))),
        "loads": (),
        "growing": ("bone",),
        "growth": growth,
    }
    young = {"bone": 1.0, "implant": 5.0}
    laws = NeoHooke(young=young, reference_density=1.2), gx.Material(young, 0.25, 1.2)
    one, other = (run(block(mesh, material=law, **changes), variant, tolerance=1e-12)[1] for law in laws)
    assert densities(one) == pytest.approx(densities(other), rel=1e-9)
    assert one.system.force_scale() == pytest.approx(other.system.force_scale(), rel=1e-12)


def test_a_stiffness_that_is_an_expression_scales_forces():
    """λ and μ may vary, and no one number is E."""
    material = SaintVenantKirchhoff(mu=lambda x: 0.9 + 0.1 * x[0], reference_density=1.2)
    scene = block(
        square(2), material=material, supports=(gx.Support("left"), gx.Support("right", (0.05, 0.0))), loads=()
    )
    for variant in (gx.Q1P0, gx.Q1Q1):
        scale = gx.discretise(scene, variant).system.force_scale()
        assert 0.05 * 2.2 < scale < 0.05 * 2.5
        steps, _ = run(scene, variant)
        assert steps[-1].newton.converged


def test_a_changed_energy_is_another_run(shared_folder):
    """Of the same name and parameters."""

    def mine(factor):
        def energy(self, F):
            return factor * SaintVenantKirchhoff.energy(self, F)

        return type("Mine", (SaintVenantKirchhoff,), {"energy": energy})(reference_density=1.2)

    scene = block(square(2), material=mine(1.0), program=gx.Program(step=0.1, until=0.2))
    gx.solve(scene, gx.Q1P0, out=shared_folder / "first", checkpoint=1)
    assert gx.solve(replace(scene, material=mine(1.0)), gx.Q1P0, resume=shared_folder / "first").converged
    with pytest.raises(InputError, match=r"a stress of Mine at sample stretches is .* somewhere, here"):
        gx.solve(replace(scene, material=mine(1.1)), gx.Q1P0, resume=shared_folder / "first")


@dataclass(frozen=True)
class Exact(NeoHooke):
    """With the digits of small strains, by H."""

    def energy_at(self, H):
        """As `gx.Material` has it."""
        return gx.Material(self.young, self.poisson).energy_at(H)


def test_digits_of_small_strains():
    """At a strain of 1e-7 an energy by I₁ − 3 − 2 ln J has few digits left; one by H has them all."""
    extensions = (1e-7, -3e-8, 0.0)
    exact = gx.Material(1.0, 0.25).principal_energy(extensions)
    assert Exact().principal_energy(extensions) == pytest.approx(exact, rel=1e-13)
    assert abs(NeoHooke().principal_energy(extensions) / exact - 1) > 1e-6
    assert Exact().principal_stresses(extensions, 1.0) == pytest.approx(
        gx.Material(1.0, 0.25).principal_stresses(extensions, 1.0), rel=1e-12
    )


def toy(**parts):
    """A class by what it replaces."""
    return type("Mine", (SaintVenantKirchhoff,), parts)


NONSENSE = [
    ({"energy": lambda self, F: F}, r"^the energy of Mine has values of shape \(3, 3\): a scalar is needed"),
    ({"energy": lambda self, F: None}, r"^the energy of Mine has the values None: a scalar in UFL is needed"),
    ({"energy": lambda self, F: np.linalg.det(F)}, r"^the energy of Mine fails at the displacement gradient"),
    ({"energy": lambda self, F: ufl.tr(F)}, r"^the energy of Mine is 3, with a stress of 1, in a body at rest"),
    (
        {"energy": lambda self, F: ufl.tr(F.T * F) - 3},
        r"^the energy of Mine is 0, with a stress of 2, in a body at rest",
    ),
    ({"energy": lambda self, F: -((ufl.det(F) - 1) ** 2)}, r"^the energy of Mine is -.* a finite one of at least 0"),
    ({"energy": lambda self, F: ufl.sqrt(ufl.det(F) - 1)}, r"^the energy of Mine "),
    ({"energy_at": lambda self, H: ufl.inner(H, H)}, r"^the energy of Mine is .* by F and .* by H .* the same"),
    ({"stiffness": property(lambda self: -1.0)}, r"^the stiffness of Mine is -1\.0: a positive number would be right$"),
    ({"stiffness": property(lambda self: "soft")}, r"^the stiffness of Mine is 'soft': a positive number would"),
]


@pytest.mark.parametrize(("parts", "sentence"), NONSENSE)
def test_an_energy_that_cannot_be_used_is_refused(parts, sentence):
    """With the scene, before it is differentiated in the middle of a form."""
    with pytest.raises(InputError, match=sentence):
        block(square(2), material=toy(**parts)())


def test_what_is_not_used_is_refused_by_name():
    """An energy is one function; stress and principal stresses follow from it."""
    for part in ("stress", "principal_stresses", "principal_energy", "weight", "scales"):
        with pytest.raises(
            InputError,
            match=f"^the class Mine replaces {part} of .*: to replace any of coefficients, energy, energy_at, st",
        ):
            toy(**{part: lambda self, *values: 0.0})
    with pytest.raises(InputError, match=r"^the class Mine replaces energy_at of "):
        type("Mine", (gx.Material,), {"energy_at": lambda self, H: H[0, 0] ** 2})


def test_a_material_that_is_none_is_refused():
    """By the scene."""
    with pytest.raises(InputError, match=r"a Material or a StoredEnergy of one's own would be right$"):
        block(square(2), material=1.0)


@pytest.mark.parametrize("variant", [gx.P1P0, gx.P2P1], ids=lambda variant: variant.name)
def test_triangles(variant):
    """Of other points."""
    _, problem = run(pulled(MATERIALS[0], square(1, shape="triangle"), supports=ROLLERS), variant, tolerance=1e-12)
    assert densities(problem)[:, 2] == pytest.approx(recursion(MATERIALS[0])[2], rel=1e-8)
