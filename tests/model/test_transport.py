"""What moves mass: Fick's flux smooths, boundaries hold densities or let mass in, and no mass gets lost on the way."""

from dataclasses import replace
from itertools import pairwise

import dolfinx
import numpy as np
import pytest
import ufl
from blocks import (
    COMM,
    assert_tangent_matches_differences,
    block,
    densities,
    run,
    set_iterate,
    square,
    tangent,
)

import growthx as gx
from growthx.common.errors import InputError
from growthx.constitutive.kinematics import displacement_gradient
from growthx.fem import kernels
from growthx.scenes.bar import bar

NODAL = (gx.Q1Q1, gx.Q2Q2, gx.P2P1)
variants = pytest.mark.parametrize("variant", NODAL, ids=lambda variant: variant.name)
LOCAL = (gx.Q1P0, gx.Q1, gx.Q1sri, gx.P1)
CONDUCTION = 0.3
STILL = gx.EnergyDrivenGrowth(attractor=0.01, rate=0.0)  # no source: what moves is moved


def inward(u, rho, x):
    """An influx towards a density of 1.4, the more the further along: a law with state and place."""
    return 0.5 * (1.4 - rho) * (1 + x[0])


INGREDIENTS = {
    "flux": {"flux": gx.MassFlux(CONDUCTION)},
    "flux by density": {"flux": gx.MassFlux(CONDUCTION, lambda relative: relative**2)},
    "flux by region": {"flux": gx.MassFlux({"bone": 0.3, "implant": 0.1})},
    "prescribed": {"flux": gx.MassFlux(CONDUCTION), "prescribed_densities": (gx.PrescribedDensity("right", 1.5),)},
    "influx": {"influx": (gx.Influx("top", 0.2),)},
    "influx by law": {"influx": (gx.Influx("top", inward),)},
    "influx by deformation": {"influx": (gx.Influx("top", lambda u, rho, x: 0.3 * ufl.dot(u, u) * rho),)},
    "all": {
        "flux": gx.MassFlux(CONDUCTION),
        "prescribed_densities": (gx.PrescribedDensity("right", 1.5),),
        "influx": (gx.Influx("top", inward),),
    },
}
ingredients = pytest.mark.parametrize("changes", INGREDIENTS.values(), ids=INGREDIENTS)


# -- the tangent -------------------------------------------------------------------------------------------------------


def tangent_at_an_iterate(variant, changes):
    problem = gx.discretise(block(square(2, 0.06, shape=variant.cells[0]), **changes), variant)
    problem.system.begin_step(0.1, 0.7)
    set_iterate(
        problem,
        lambda x: np.stack([0.3 * np.sin(2 * x[0]) + 0.1 * x[1], 0.2 * x[0] * x[1] - 0.15 * x[1]]),
        lambda x: 1.0 + 0.3 * np.cos(3 * x[0] + x[1]),
    )
    return problem, tangent(problem)


@variants
@ingredients
def test_tangent_is_the_derivative_of_the_balances(variant, changes):
    """Each term enters Newton's method with its derivative, laws with that of both fields, and is there at all."""
    problem, exact = tangent_at_an_iterate(variant, changes)
    assert_tangent_matches_differences(problem, exact)
    _, plain = tangent_at_an_iterate(variant, {})
    changed = np.abs(exact - plain).max() > 1e-6 * np.abs(plain).max()
    # A number for an influx is no function of the state.
    assert changed == (changes is not INGREDIENTS["influx"])


# -- where it makes sense ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("variant", LOCAL, ids=lambda variant: variant.name)
@ingredients
def test_densities_that_jump_between_cells_are_refused(variant, changes):
    """They have no gradient: the flux would be zero, silently; the sentence names what would do."""
    with pytest.raises(InputError) as caught:
        gx.discretise(block(square(2, shape=variant.cells[0]), **changes), variant)
    right = "Q1Q1, Q2Q2, S2Q1" if variant.cells[0] == "quadrilateral" else "P1P1, P2P2, P2P1"
    assert str(caught.value) == (
        f"{variant.name} has densities that jump between cells, on which no flux, influx or prescribed density acts: "
        f"{right} would be right"
    )


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: gx.MassFlux(-0.1), "the conduction R₀ᶠ is -0.1: a number of at least 0 would be right"),
        (
            lambda: gx.MassFlux({"bone": -1}),
            "the conduction R₀ᶠ of 'bone' is -1: a number of at least 0 would be right",
        ),
        (
            lambda: gx.PrescribedDensity("top", 0.0),
            "the density held on 'top' is 0: a positive number would be right",
        ),
        (lambda: gx.Influx("top", float("nan")), "the influx on 'top' is nan: a finite number would be right"),
        (
            lambda: block(influx=(gx.Influx("tip", 1.0),)),
            "the mesh has no boundary named 'tip'; it has 'bottom', 'left', 'right', 'top'",
        ),
        (
            lambda: block(prescribed_densities=(gx.PrescribedDensity("tip", 1.0),)),
            "the mesh has no boundary named 'tip'; it has 'bottom', 'left', 'right', 'top'",
        ),
    ],
)
def test_impossible_parameters_are_refused(make, sentence):
    """The sentence must name quantity, place, value and remedy."""
    with pytest.raises(InputError) as caught:
        make()
    assert str(caught.value) == sentence


# -- exact solutions ---------------------------------------------------------------------------------------------------


def at_rest(variant, cells=3, distortion=0.05, step=100.0, until=600.0, **changes):
    """A body without loads and without a source."""
    mesh = square(cells, distortion, shape=variant.cells[0])
    program = gx.Program(step=step, until=until)
    return block(mesh, growth=STILL, loads=(), program=program, **changes)


@variants
def test_between_two_prescribed_densities_the_profile_is_linear(variant):
    """Steady conduction: exact on distorted cells too, and every node, the held ones included, is on the line."""
    held = (gx.PrescribedDensity("left", 1.0), gx.PrescribedDensity("right", 1.5))
    _, problem = run(at_rest(variant, flux=gx.MassFlux(CONDUCTION), prescribed_densities=held), variant)
    x, _, rho = densities(problem).T
    assert rho == pytest.approx(1.0 + 0.5 * x, rel=1e-11)


def test_conduction_that_grows_with_density_bends_the_profile():
    """For R₀ᶠ ∝ ρ, ρ² is linear in x: linear cells in a row meet √(a² + (b² − a²) x) at their nodes exactly."""
    held = (gx.PrescribedDensity("left", 1.0), gx.PrescribedDensity("right", 2.0))
    flux = gx.MassFlux(CONDUCTION, lambda relative: relative)
    _, problem = run(at_rest(gx.Q1Q1, 4, 0.0, flux=flux, prescribed_densities=held), gx.Q1Q1)
    x, _, rho = densities(problem).T
    assert rho == pytest.approx(np.sqrt(1 + 3 * x), rel=1e-11)


@variants
def test_influx_is_carried_away_to_where_density_is_held(variant):
    """ρ = ρ₁ + r x/R₀ᶠ between a held side and one that lets in r: the influx has its sign and its size."""
    rate, held = 0.06, (gx.PrescribedDensity("left", 1.0),)
    influx = (gx.Influx("right", rate),)
    scene = at_rest(variant, flux=gx.MassFlux(CONDUCTION), prescribed_densities=held, influx=influx)
    steps, problem = run(scene, variant)
    x, _, rho = densities(problem).T
    assert rho == pytest.approx(1.0 + rate / CONDUCTION * x, rel=1e-11)
    assert problem.mass_rate() == pytest.approx(0.0, abs=1e-10)  # as much leaves on the left
    assert max(step.mass_defect for step in steps) < 1e-10


def wave(variant, cells, step, count):
    """Ratio per step of a cosine's amplitude, and whether it kept its shape (it does on a regular mesh)."""
    scene = at_rest(
        variant,
        cells,
        0.0,
        step,
        count * step,
        flux=gx.MassFlux(CONDUCTION),
        initial_density=lambda x: 1.2 + 0.1 * np.cos(np.pi * x[0]),
    )
    _, problem = run(scene, variant, tolerance=1e-12)
    x, _, rho = densities(problem).T
    amplitude = (rho - 1.2)[x < 1e-9].mean()
    if variant is gx.Q1Q1:
        assert rho - 1.2 == pytest.approx(amplitude * np.cos(np.pi * x), abs=1e-10)
    return (amplitude / 0.1) ** (1 / count)


@pytest.mark.parametrize("step", [0.01, 0.5])
def test_a_wave_of_density_decays_as_implicit_euler_says(step):
    """1/(1 + Δt R₀ᶠ k²) per step, met to the second order in h; with the wrong sign of the flux it would grow."""
    factor = 1 / (1 + step * CONDUCTION * np.pi**2)
    errors = []
    for cells in (4, 8):
        found = wave(gx.Q1Q1, cells, step, 3)
        h = 1 / cells
        # Linear cells with a consistent mass matrix have the wave number k² = 6 (1 − cos πh)/(2 + cos πh)/h².
        discrete = 6 * (1 - np.cos(np.pi * h)) / (2 + np.cos(np.pi * h)) / h**2
        assert found == pytest.approx(1 / (1 + step * CONDUCTION * discrete), rel=1e-9)
        errors.append(abs(found - factor))
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.1)


def test_quadratic_densities_diffuse_more_exactly():
    """The order follows the element of the density: four, where linear cells have two."""
    factor = 1 / (1 + 0.1 * CONDUCTION * np.pi**2)
    errors = [abs(wave(gx.Q2Q2, cells, 0.1, 1) - factor) for cells in (2, 4)]
    assert np.log2(errors[0] / errors[1]) > 3.5


# -- the balance of mass -----------------------------------------------------------------------------------------------

LOADED = {"growth": gx.EnergyDrivenGrowth(0.01, 5.0)}


@variants
@ingredients
def test_mass_balance_closes(variant, changes):
    """Change of mass = Δt (source + influx + what holds the prescribed densities), in every step."""
    steps, _ = run(block(square(4, 0.0, shape=variant.cells[0]), **LOADED, **changes), variant)
    assert max(step.mass_defect for step in steps) < 1e-10
    assert abs(steps[-1].mass - 1.2) > 1e-3, "mass must change for its balance to mean something"


@pytest.mark.parametrize("variant", [gx.Q1Q1, gx.P2P1], ids=lambda variant: variant.name)
def test_mass_comes_from_source_and_influx(variant):
    """Both integrated here anew from the state after the step, so that the defect is not measured by itself."""
    mesh = square(3, 0.05, shape=variant.cells[0])
    scene = block(mesh, **LOADED, flux=gx.MassFlux(CONDUCTION), influx=(gx.Influx("top", inward),))
    problem = gx.discretise(scene, variant)
    old, gains = problem.mass(), []
    energy = scene.material.energy_at(displacement_gradient(problem.displacement))
    dV = ufl.dx(domain=mesh.domain, metadata={"quadrature_degree": variant.mass_degree})
    source = scene.growth.mass_source(problem.density, energy, scene.material) * dV
    x = ufl.SpatialCoordinate(mesh.domain)
    influx = inward(problem.displacement, problem.density, x) * mesh.boundary_measure("top", 4)
    forms = [kernels.form(form) for form in (source, influx)]
    for step in gx.march(scene, variant, problem):
        gains = [COMM.allreduce(dolfinx.fem.assemble_scalar(form)) for form in forms]
        assert step.mass - old == pytest.approx(step.time_step * sum(gains), rel=1e-8)
        old = step.mass
    assert min(abs(gain) for gain in gains) > 1e-3


@variants
def test_flux_alone_keeps_the_mass(variant):
    """Nothing crosses a boundary that nothing is said of; meanwhile the densities even out."""
    start = {"bone": 1.0, "implant": 2.0}
    scene = at_rest(variant, 4, 0.0, 0.1, 0.5, flux=gx.MassFlux(CONDUCTION), initial_density=start)
    steps, problem = run(scene, variant)
    for step in steps:
        assert step.mass == pytest.approx(1.5, rel=1e-12)
    assert np.ptp(densities(problem)[:, 2]) < 0.5
    assert steps[-1].max_density < steps[0].max_density


def test_mass_enters_at_the_given_rate():
    """r times the length of the side times the time, on sides of a length other than one; out of it if r < 0."""
    for rate in (0.2, -0.1):
        scene = block(
            square(3, 0.05, length=2.0),
            growth=STILL,
            loads=(),
            flux=gx.MassFlux(CONDUCTION),
            influx=(gx.Influx("top", rate),),
        )
        for step in run(scene, gx.Q1Q1)[0]:
            assert step.mass == pytest.approx(4 * 1.2 + step.time * 2.0 * rate, rel=1e-11)


def test_transport_beside_a_region_that_rests():
    """What does not grow takes no part: no mass crosses the interface, and the balance still closes."""
    scene = block(
        square(4),
        growing=("bone",),
        flux=gx.MassFlux(CONDUCTION),
        influx=(gx.Influx("left", 0.2),),
        growth=STILL,
        loads=(),
    )
    steps, problem = run(scene, gx.Q1Q1)
    x, _, rho = densities(problem).T
    assert np.all(rho[x > 0.5 + 1e-9] == 1.2)
    for step in steps:
        assert step.mass == pytest.approx(0.5 * 1.2 + 0.2 * step.time, rel=1e-11)


# -- what flux is for --------------------------------------------------------------------------------------------------


def profile(conduction):
    """Density along the discontinuous bar on its rising side, away from the clamped end, at the end of the march."""
    scene = bar(elements=100)
    if conduction:
        scene = replace(scene, flux=gx.MassFlux(conduction))
    _, problem = run(scene, gx.Q1Q1)
    x, y, rho = densities(problem).T
    side = (y < 0) & (x > 0.145) & (x < 0.455)
    return rho[side]


def test_fronts_widen_with_conduction_and_overshoots_vanish():
    """Behind each jump of the attractor the nodal density swings; the flux, over √(R₀ᶠ/rate), does away with that."""
    conductions = (0.0, 1e-5, 1e-4, 1e-3)
    profiles = [profile(conduction) for conduction in conductions]
    # The attractor falls from level to level, so the density should only rise: what it falls is overshoot.
    overshoots = [np.maximum(-np.diff(rho), 0).sum() for rho in profiles]
    # Three jumps on the way: their width in nodes is what they rise altogether over the steepest rise.
    widths = [(rho[-1] - rho[0]) / np.diff(rho).max() for rho in profiles]
    assert all(wide > 1.1 * narrow for narrow, wide in pairwise(widths))
    assert all(less < more for more, less in pairwise(overshoots[:3]))
    assert overshoots[0] > 1e-3 and overshoots[-1] == 0.0


@pytest.mark.parametrize("flux", [None, gx.MassFlux(0.02)], ids=["no flux", "flux"])
def test_flux_brings_a_length(flux):
    """Without it bodies of one shape are alike whatever their size; with it the small ones have the lower peaks."""
    peaks = []
    for length in (0.5, 1.0, 2.0):
        attractor = lambda x, length=length: 0.02 * (1.0 - 0.9 * np.cos(2 * np.pi * x[0] / length) ** 2)  # noqa: E731
        scene = block(
            square(4, 0.03, length=length),
            growth=gx.EnergyDrivenGrowth(attractor, 5.0),
            flux=flux,
            program=gx.Program(step=0.5, until=4.0, ramp=0.5),
        )
        peaks.append(run(scene, gx.Q1Q1, tolerance=1e-12)[0][-1].max_density)
    if flux is None:
        assert peaks == pytest.approx([peaks[0]] * 3, rel=1e-9)
    else:
        assert peaks[0] < peaks[1] - 1e-3 < peaks[2] - 2e-3


@pytest.mark.parametrize("variant", [gx.Q1Q1, gx.P2P1], ids=lambda variant: variant.name)
def test_mass_enters_through_several_boundaries(variant):
    """Each influx has its own boundary: together they bring the sum of what each brings, per length of one."""
    still = block(square(3, shape=variant.cells[0]), growth=STILL)
    influx = (gx.Influx("top", 0.2), gx.Influx("bottom", 0.1))
    steps, _ = run(replace(still, influx=influx), variant)
    assert steps[-1].mass == pytest.approx(1.2 + 0.4 * 0.3, rel=1e-12)


@pytest.mark.parametrize(
    ("change", "what"),
    [
        ({"influx": (gx.Influx("right", 0.2),)}, "influx"),
        ({"prescribed_densities": (gx.PrescribedDensity("right", 1.5),)}, "prescribed density"),
    ],
)
def test_nothing_is_let_into_what_does_not_grow(change, what):
    """A region at rest has no balance of mass: its influx would be counted and lost."""
    with pytest.raises(InputError, match=f"the boundary 'right' has .* nodes in regions that do not grow.* no {what}"):
        gx.discretise(block(square(4), growing=("bone",), **change), gx.Q1Q1)


def test_a_density_beyond_the_bounds_cannot_be_held():
    """Of two contradictory wishes neither may be dropped silently."""
    growth = gx.EnergyDrivenGrowth(0.01, 5.0, bounds=(1.0, 1.4))
    with pytest.raises(InputError, match=r"the density held on 'right' is 1.5: one within the bounds .*, 1 to 1.4, "):
        block(square(2), growth=growth, prescribed_densities=(gx.PrescribedDensity("right", 1.5),))


def test_an_influx_of_another_shape_is_refused():
    """A vector where a number per area is meant."""
    influx = (gx.Influx("right", lambda u, rho, x: u),)
    with pytest.raises(InputError, match=r"^the influx on 'right' has values of shape \(2,\): a scalar is needed"):
        gx.discretise(block(square(2), influx=influx), gx.Q1Q1)
