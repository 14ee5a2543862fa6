"""Plane stress: what bears nothing across its plane, against scalar solutions, a layer in space and plane strain."""

import json
from dataclasses import replace
from functools import cache

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
    displacements,
    gathered,
    set_iterate,
    square,
    tangent,
)
from scipy.optimize import brentq, root

import growthx as gx
from growthx.cli.program import main
from growthx.constitutive.homogeneous import uniaxial_equilibrium
from growthx.discretisation.variants import CATALOGUE
from growthx.stepping.failure import inadmissible

E, NU = 17e3, 0.3  # MPa: bone's
LAM, MU = E * NU / ((1 + NU) * (1 - 2 * NU)), E / (2 * (1 + NU))
STILL = gx.EnergyDrivenGrowth(attractor=0.0, rate=0.0)
AT_ONCE = gx.Program(step=1.0, until=1.0)
every_variant = pytest.mark.parametrize("variant", CATALOGUE.values(), ids=CATALOGUE)


# -- energies by their formulas, of principal stretches, without the product's -----------------------------------------


def neo_hooke(a):
    log_J = np.log(np.prod(a))
    return LAM / 2 * log_J**2 + MU / 2 * (a @ a - 3 - 2 * log_J)


def saint_venant(a):
    strain = (a * a - 1) / 2
    return LAM / 2 * strain.sum() ** 2 + MU * strain @ strain


def hencky(a):
    logs = np.log(a)
    return LAM / 2 * logs.sum() ** 2 + MU * logs @ logs


def mooney_rivlin(a, share=0.25):
    J, first = np.prod(a), a @ a
    second = (a[0] * a[1]) ** 2 + (a[1] * a[2]) ** 2 + (a[2] * a[0]) ** 2
    one, two, bulk = (1 - share) * MU / 2, share * MU / 2, LAM - 2 * share * MU
    return (
        one * (first - 3 - 2 * np.log(J)) + two * (second - 3 - 4 * np.log(J)) + bulk / 4 * (J * J - 1 - 2 * np.log(J))
    )


def ogden(a):
    log_J = np.log(np.prod(a))
    terms = [MU / alpha**2 * (np.sum(a**alpha) - 3 - alpha * log_J) for alpha in (2.0, -2.0)]
    return sum(terms) + LAM / 2 * log_J**2


def linear(a):
    strain = a - 1
    return LAM / 2 * strain.sum() ** 2 + MU * strain @ strain


def fibred(a):
    """Fibres along the load."""
    return neo_hooke(a) + E / 4 * ((a[0] ** 2 - 1) / 2) ** 2


ENERGIES = {
    "neo-Hooke": (gx.Material(E, NU), neo_hooke),
    "Saint Venant-Kirchhoff": (gx.SaintVenantKirchhoff(E, NU), saint_venant),
    "Hencky": (gx.Hencky(E, NU), hencky),
    "Mooney-Rivlin": (gx.MooneyRivlin(E, NU), mooney_rivlin),
    "Ogden": (gx.Ogden(E, NU), ogden),
    "linear": (gx.LinearElasticity(E, NU), linear),
    "fibred": (gx.FibredNeoHooke(E, NU, fibre=E / 2), fibred),
}
every_energy = pytest.mark.parametrize(("material", "energy"), ENERGIES.values(), ids=ENERGIES)


def uniaxial(energy, traction, least, most):
    """The stretches along and across, equal ones, of a bar under a dead traction, by bisection."""

    def slope(a, number):
        moved = np.array(a, dtype=complex)
        moved[number] += 1e-30j
        return energy(moved).imag / 1e-30

    def across(stretch):
        return brentq(lambda b: slope((stretch, b, b), 1), 0.5, 1.5, xtol=1e-16, rtol=1e-15)

    along = brentq(lambda a: slope((a, across(a), across(a)), 0) - traction, least, most, xtol=1e-16, rtol=1e-15)
    return along, across(along)


@every_energy
@pytest.mark.parametrize("strain", [1e-4, -1e-4, 0.15, -0.1])
def test_a_pulled_strip_is_its_scalar_solution(material, energy, strain):
    """At bone's modulus and at bone's and large strains: along, across and in the thickness, of energy and stress."""
    traction = E * strain
    along, across = uniaxial(energy, traction, 0.7, 1.3)
    scene = block(
        square(2, 0.1),
        material=material,
        growth=STILL,
        supports=ROLLERS,
        loads=(gx.Traction("right", (traction, 0.0)),),
        program=gx.Program(step=0.25, until=1.0, ramp=1.0),
        plane=gx.Plane.STRESS,
    )
    problem = gx.solve(scene, gx.Q1, tolerance=1e-13).problem
    corner = problem.sample_displacement(np.array([[1.0, 1.0]]))[0]
    # Stretches by bisection have 1e-16 of one, of which small strains are left with twelve digits.
    assert corner == pytest.approx([along - 1, across - 1], rel=1e-8)
    names = ["thickness_stretch", "cauchy_stress", "strain_energy", "green_lagrange_strain"]
    found = gx.results.point_fields(problem, names)
    assert found["thickness_stretch"] - 1 == pytest.approx(across - 1, rel=1e-8)
    assert np.abs(found["cauchy_stress"][..., 2, :]).max(initial=0) < 1e-10 * abs(traction)
    if not material.small_strain:
        assert found["cauchy_stress"][..., 0, 0] == pytest.approx(traction * along / (along * across**2), rel=1e-8)
        assert found["strain_energy"] == pytest.approx(energy(np.array([along, across, across])), rel=1e-6)
        assert found["green_lagrange_strain"][..., 2, 2] == pytest.approx((across**2 - 1) / 2, rel=1e-8)


# -- against plane strain and space ------------------------------------------------------------------------------------


def in_equilibrium(plane, variant):
    """A strip at biological equilibrium and small strains."""
    attractor = E * 1e-4**2 / 2
    scene = block(
        square(1, shape=variant.cells[0]),
        material=gx.Material(E, NU, 1.2),
        growth=gx.EnergyDrivenGrowth(attractor=attractor, rate=1 / attractor),
        supports=ROLLERS,
        loads=(gx.Traction("right", (E * 1.1e-4, 0.0)),),
        plane=plane,
    )
    return gx.homeostasis(scene, variant, tolerance=1e-12), scene


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1Q1, gx.P2], ids=lambda variant: variant.name)
def test_plane_strain_needs_less_bone_than_plane_stress(variant):
    """At a given traction ρ^(n + m) goes with 1/E', and E' is E in plane stress, E/[1 − ν²] in plane strain."""
    strain, stress = (in_equilibrium(plane, variant)[0].mean_density() for plane in ("strain", "stress"))
    assert strain / stress == pytest.approx(0.91**0.2, rel=1e-5)


def test_homogeneous_states_follow():
    """The semi-analytic equilibrium is that of the elements, at a large load; fibres across it break its symmetry."""
    law = gx.EnergyDrivenGrowth(0.05, 4.0)
    for material in (gx.Material(1.0, 0.3, 1.2), gx.FibredNeoHooke(1.0, 0.3, 1.2, fibre=2.0, fibre_x=0.0, fibre_y=1.0)):
        scene = block(
            square(1),
            material=material,
            growth=law,
            supports=ROLLERS,
            loads=(gx.Traction("right", (0.3, 0.0)),),
            plane="stress",
        )
        problem = gx.homeostasis(scene, gx.Q1P0, tolerance=1e-12)
        at = uniaxial_equilibrium(material, law, 0.3, gx.Plane.STRESS)
        assert problem.mean_density() == pytest.approx(at.density, rel=1e-9)
        stretch = gx.results.cell_fields(problem, ["thickness_stretch"])["thickness_stretch"]
        assert stretch == pytest.approx(at.thickness_stretch, rel=1e-9)
        assert (abs(at.thickness_stretch / at.transverse_stretch - 1) > 1e-3) == isinstance(material, gx.FibredNeoHooke)


@pytest.mark.parametrize("kind", [gx.Material, gx.Hencky, gx.LinearElasticity], ids=lambda kind: kind.__name__)
def test_a_layer_of_hexahedra_free_across_is_in_plane_stress(kind):
    """Pulled along and pressed across by loads that ramp, it grows in each step as in the plane."""
    box = dolfinx.mesh.create_box(
        COMM, [np.zeros(3), np.array([1.0, 1.0, 0.1])], [2, 2, 1], dolfinx.mesh.CellType.hexahedron
    )
    sides = {"left": (0, 0.0), "right": (0, 1.0), "bottom": (1, 0.0), "top": (1, 1.0), "back": (2, 0.0)}
    layer = gx.Mesh.with_names(
        box, {name: lambda x, i=i, at=at: np.isclose(x[i], at) for name, (i, at) in sides.items()}
    )
    common = {"material": kind(1.0, NU, 1.2), "growth": gx.EnergyDrivenGrowth(0.02, rate=5.0)}
    flat = block(square(2), supports=ROLLERS, loads=loads((0.2, 0.0), (0.0, -0.07)), plane="stress", **common)
    held = tuple(
        gx.Support(name, tuple(0.0 if i == j else None for j in range(3)))
        for i, name in enumerate(("left", "bottom", "back"))
    )
    thick = block(layer, supports=held, loads=loads((0.2, 0.0, 0.0), (0.0, -0.07, 0.0)), **common)
    plane, space = (gx.solve(scene, gx.Q1, tolerance=1e-12) for scene in (flat, thick))
    for one, other in zip(plane.steps, space.steps, strict=True):
        assert one.mass == pytest.approx(10 * other.mass, rel=1e-9)
    assert abs(plane.steps[-1].mass - 1.2) > 1e-3
    u, v = plane.problem.sample_displacement(np.array([[1.0, 1.0]]))[0]
    corner = space.problem.sample_displacement(np.array([[1.0, 1.0, 0.1]]))[0]
    assert corner[:2] == pytest.approx([u, v], rel=1e-9)
    stretch = gathered(gx.results.cell_fields(plane.problem, ["thickness_stretch"])["thickness_stretch"])
    assert stretch == pytest.approx(1 + 10 * corner[2], rel=1e-9)


def loads(right, top):
    return gx.Traction("right", right), gx.Traction("top", top)


# -- all discretisations -----------------------------------------------------------------------------------------------


@every_variant
def test_variants_agree(variant):
    """Of a homogeneous state, distorted cells or not."""
    scene = block(
        square(2, 0.08, shape=variant.cells[0]),
        supports=ROLLERS,
        loads=loads((0.2, 0.0), (0.0, 0.05)),
        plane="stress",
    )
    found = gx.solve(scene, variant, tolerance=1e-12)
    assert [step.mass for step in found.steps] == pytest.approx(grown(0.2, 0.05), rel=1e-8)
    assert max(step.mass_defect for step in found.steps) < 1e-10


@cache
def grown(right, top):
    """Densities of `block` under two tractions at the end of each step, by SciPy: its stretches and itself at once."""
    lam, mu, old, found = 0.4, 0.4, 1.2, []
    for share in (0.5, 1.0, 1.0, 1.0):

        def out_by(x, share=share, old=old):
            a, rho = np.exp(x[:3]), 1.2 * np.exp(x[3])
            log_J, weight = x[:3].sum(), (rho / 1.2) ** 2
            stress = weight * (lam * log_J + mu * (a * a - 1)) / a
            energy = lam / 2 * log_J**2 + mu / 2 * (a @ a - 3 - 2 * log_J)
            change = (rho - old) / 0.1 - 5.0 * (1.2 / rho * energy - 0.01)
            return [*(stress - share * np.array([right, top, 0.0])), change]

        solution = root(out_by, np.zeros(4), tol=1e-13).x
        old = 1.2 * np.exp(solution[3])
        found.append(old)
    return found


@pytest.mark.parametrize(
    ("variant", "changes"),
    [
        (gx.Q1P0, {}),
        (gx.Q1, {"growing": ("bone",)}),
        (gx.Q1sri, {}),
        (gx.S2fri, {}),
        (gx.Q1Q1, {"growing": ("bone",)}),
        (gx.P2P2, {}),
        (gx.Q1Q1.lumped(source=True), {}),
        (gx.Q1, {"material": gx.Hencky(1.0, 0.25, 1.2)}),
        (gx.Q1P0, {"material": gx.LinearElasticity(1.0, 0.25, 1.2)}),
        (gx.Q1P0, {"material": gx.SaintVenantKirchhoff(1.0, 0.25, 1.2)}),
        (gx.Q1P0, {"growth": gx.StrainDrivenGrowth(0.1)}),
    ],
    ids=str,
)
def test_tangent_is_the_derivative_of_the_forces(variant, changes):
    """At a far iterate, with densities that vary: what the thickness does is a part of the stiffness."""
    problem = at_an_iterate(variant, **changes)
    exact = tangent(problem)
    assert_tangent_matches_differences(problem, exact)
    if problem.system.symmetric:
        assert np.abs(exact - exact.T).max() < 1e-12 * np.abs(exact).max()


@pytest.mark.parametrize("variant", [gx.Q1, gx.Q1P0], ids=lambda variant: variant.name)
def test_each_load_case_has_its_own_thickness(variant):
    """In one system, whose density is driven by the mean of their energies."""
    cases = gx.LoadCase("a", 2.0, ()), gx.LoadCase("b", 1.0, ())
    problem = gx.discretise(block(square(2, 0.06), cases=cases, plane="stress"), variant)
    problem.system.begin_step(0.1, 0.7)
    u, unknown = dolfinx.fem.Function(problem.displacement_space), problem.system.unknown
    u.interpolate(lambda x: x[0] * np.stack([0.3 + 0.1 * x[1], 0.2 * x[1] - 0.15 * x[0]]))
    for case, part in enumerate(problem.system.unknowns.parts):
        unknown.x.array[part] = u.x.array / (1 + case)
    assert_tangent_matches_differences(problem, tangent(problem))


@pytest.mark.parametrize("variant", [gx.Q1Q1, gx.Q2Q2, gx.P2P2], ids=lambda variant: variant.name)
def test_balances_lumped_about_nodes_know_the_thickness_there(variant):
    """Where nodal densities would vanish, storage and source are taken at the nodes of the cells."""
    problem = at_an_iterate(variant)
    plain, lumped = tangent(problem), problem.system.densities.lumped
    assert lumped.spread(np.ones(len(problem.density.x.array), dtype=bool))
    exact = tangent(problem)
    assert_tangent_matches_differences(problem, exact)
    assert np.abs(exact - plain).max() > 1e-4 * np.abs(plain).max()


def at_an_iterate(variant, **changes):
    scene = block(square(2, 0.06, shape=variant.cells[0]), **{"plane": "stress"} | changes)
    problem = gx.discretise(scene, variant)
    problem.system.begin_step(0.1, 0.7)
    set_iterate(
        problem,
        lambda x: np.stack([0.3 * np.sin(2 * x[0]) + 0.1 * x[1], 0.2 * x[0] * x[1] - 0.15 * x[1]]),
        lambda x: np.full_like(x[0], 1.2) if "growing" in changes else 1.0 + 0.3 * np.cos(3 * x[0] + x[1]),
    )
    return problem


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1, gx.Q1Q1], ids=lambda variant: variant.name)
def test_newton_converges_quadratically(variant):
    """Without a part of the tangent it would not."""
    scene = block(square(3, 0.1), loads=(gx.Traction("right", (0.3, -0.1)),), program=AT_ONCE, plane="stress")
    norms = np.array(gx.solve(scene, variant, full_newton=True, tolerance=1e-13).steps[-1].newton.residual_norms)
    norms = norms[norms > 1e-13 * norms[0]]
    orders = np.log(norms[2:] / norms[1:-1]) / np.log(norms[1:-1] / norms[:-2])
    assert orders[-1] > 1.7 or norms[-1] < 1e-9, norms


# -- what a run is asked for -------------------------------------------------------------------------------------------


def test_a_state_is_judged():
    """The check assembles a tangent of its own."""
    problem = gx.solve(block(plane="stress"), gx.Q1P0).problem
    judged = gx.wellposedness.check(problem)
    assert judged.holds and judged.negative == 0


def test_updates_after_equilibrium_come_to_the_same_densities():
    """Small explicit steps of a baseline, and the steps of growthx."""
    scene = block(
        square(1),
        supports=ROLLERS,
        loads=loads((0.2, 0.0), (0.0, 0.05)),
        program=gx.Program(step=0.002, until=0.4, ramp=0.2),
        plane="stress",
    )
    *_, last = gx.baselines.update(scene, gx.Q1P0)
    assert last.mass == pytest.approx(gx.solve(scene, gx.Q1P0).steps[-1].mass, rel=1e-3)


def test_a_run_goes_on_in_its_own_plane(shared_folder):
    """A resumed run ends as the one it is a part of; one in the other plane is another run."""
    scene, first = block(plane="stress"), shared_folder / "first"
    begun = replace(scene, program=replace(scene.program, until=0.2))
    gx.solve(begun, gx.Q1, out=first, checkpoint=2, fields=("thickness_stretch",))
    whole, resumed = gx.solve(scene, gx.Q1), gx.solve(scene, gx.Q1, resume=first)
    assert resumed.steps[-1].mass == pytest.approx(whole.steps[-1].mass, rel=1e-13)
    with pytest.raises(gx.InputError, match=r"plane is stress, here strain"):
        gx.solve(block(), gx.Q1, resume=first)


def test_energies_of_ones_own_thicken():
    """By its three lines in UFL, the same as the paper's."""

    class Own(gx.StoredEnergy):
        stiffness = 1.0

        def energy(self, F):
            log_J = ufl.ln(ufl.det(F))
            return 0.4 * (ufl.inner(F, F) - 3 - 2 * log_J) / 2 + 0.4 * log_J**2 / 2

    # λ = μ = 0.4: ν = 1/4, E = 1.
    scenes = (
        block(material=material, plane="stress")
        for material in (Own(reference_density=1.2), gx.Material(1.0, 0.25, 1.2))
    )
    own, ours = (gx.solve(scene, gx.Q1P0, tolerance=1e-12) for scene in scenes)
    assert displacements(own.problem) == pytest.approx(displacements(ours.problem), abs=1e-9)


def test_what_cannot_be_in_plane_stress_is_refused():
    """In one sentence that says what would be right."""
    with pytest.raises(
        gx.InputError, match=r"^the plane of the scene 'block' is 'axial': Plane.STRAIN or Plane.STRESS"
    ):
        block(plane="axial")
    with pytest.raises(gx.InputError, match=r"^the scene 'block' is in plane stress, and its body in 3 dimensions"):
        block(cube(1), plane="stress")
    with pytest.raises(gx.InputError, match=r"^there is no field 'thickness_stretch' of the law \w+ in plane strain"):
        gx.results.cell_fields(gx.discretise(block(), gx.Q1P0), ["thickness_stretch"])


def test_shear_across_the_plane_is_refused():
    """Fibres that rise out of the plane would shear a plate, which plane stress leaves no room for."""

    class Oblique(gx.StoredEnergy):
        stiffness = 1.0

        def energy(self, F):
            along = F * ufl.as_vector([1.0, 0.0, 1.0])
            return ufl.inner(F, F) / 2 - 1.5 - ufl.ln(ufl.det(F)) + (ufl.inner(along, along) - 2) ** 2

    assert block(square(1), material=Oblique()).plane is gx.Plane.STRAIN
    with pytest.raises(gx.InputError, match=r"^the energy of Oblique bears a shear stress of .* across the plane"):
        block(square(1), material=Oblique(), plane="stress")


def test_no_thickness_is_told():
    """Saint Venant–Kirchhoff's energy, stretched far in both directions, bears pressure across at any thickness."""
    problem = gx.discretise(block(square(1), material=gx.SaintVenantKirchhoff(1.0, 0.4), plane="stress"), gx.Q1P0)
    problem.system.begin_step(0.1, 1.0)
    set_iterate(problem, lambda x: 1.5 * x[:2], lambda x: np.full_like(x[0], 1.2))
    assert inadmissible(problem).startswith("at no thickness σ₃₃ = 0 in the cell at")


@pytest.mark.serial
def test_the_command_line_knows_it(capsys):
    """The plate bends more where it may become thinner; a scene in space has no plane."""
    tips = []
    for plane in ("strain", "stress"):
        assert main(["plate", "--n", "2", "--plane", plane, "--json"]) == 0
        tips.append(json.loads(capsys.readouterr().out)["tip_displacement"])
    assert tips[1] < 1.01 * tips[0] < 0
    assert main(["plate", "--n", "2", "--plane", "axial"]) != 0
    assert "the plane of the scene 'plate' is 'axial'" in capsys.readouterr().err
    assert main(["femur3d", "--plane", "stress"]) == 2
    assert "unrecognized arguments: --plane stress" in capsys.readouterr().err
