"""The growth laws: one text for floats, arrays and UFL, equal to the formulas of the literature; their tangents."""

from dataclasses import replace

import numpy as np
import pytest
import ufl
from blocks import (
    ROLLERS,
    assert_tangent_matches_differences,
    block,
    densities,
    displacements,
    run,
    set_iterate,
    square,
    tangent,
)
from scipy.integrate import quad
from scipy.optimize import root

import growthx as gx
from growthx.common.errors import InputError
from growthx.constitutive.growth import ROUNDING
from growthx.constitutive.kinematics import principal_changes
from growthx.constitutive.stimulus import REST, equivalent_strain

EXPONENTS = [(n, m) for n in (1, 2, 3.5) for m in (0, 1, 2, 3, 4.5)]
YOUNG, POISSON, REFERENCE = 2.0, 0.3, 1.3
ATTRACTOR, RATE, DEAD_ZONE = 0.7, 1.4, 0.3


def equivalent(energy, young):
    """ε = √(2Ψ/E), rounded at rest as growthx says it does."""
    square = 2 * energy / young
    return square / np.sqrt(square + REST**2)


# The stimuli of the literature, of r = ρ/ρ*, the energy Ψ₀ⁿᵉᵒ, n, m, E and ρ*, with the weight rⁿ where it comes from.
STIMULI = {
    gx.EnergyDrivenGrowth: lambda r, psi, n, m, E, reference: r ** (-m) * (r**n * psi),
    gx.SpecificEnergyDrivenGrowth: lambda r, psi, n, m, E, reference: (r**n * psi) / (r * reference),
    gx.StrainDrivenGrowth: lambda r, psi, n, m, E, reference: r ** (-m) * equivalent(psi, E),
    gx.StressDrivenGrowth: lambda r, psi, n, m, E, reference: r ** (-m) * (r**n * E * equivalent(psi, E)),
}
kinds = pytest.mark.parametrize("kind", STIMULI, ids=lambda kind: kind.__name__)
exponents = pytest.mark.parametrize(("n", "m"), EXPONENTS)
zones = pytest.mark.parametrize("zone", [0.0, DEAD_ZONE], ids=["no zone", "dead zone"])


def growth_law(kind, m, attractor=ATTRACTOR, rate=RATE, zone=0.0):
    """A law of a kind; the energy per mass has no exponent."""
    exponent = {} if kind is gx.SpecificEnergyDrivenGrowth else {"exponent": m}
    return kind(attractor, rate, dead_zone=zone, **exponent)


def laws(kind, n, m, zone=0.0):
    """A growth law and a material with no parameter equal to one."""
    return growth_law(kind, m, zone=zone), gx.Material(YOUNG, POISSON, REFERENCE, n)


def number(expression):
    """The value of a UFL expression of numbers."""
    return ufl.algorithms.expand_derivatives(expression)(())


# -- the formulas ------------------------------------------------------------------------------------------------------


@kinds
@exponents
def test_source_is_that_of_the_literature(kind, n, m):
    """R₀ = c { S − S* } with each law's stimulus, (6) for the first; the weighted energy, not Ψ₀ⁿᵉᵒ, enters."""
    growth, material = laws(kind, n, m)
    rho, elastic = 1.9, 0.8
    stimulus = STIMULI[kind](rho / REFERENCE, elastic, n, m, YOUNG, REFERENCE)
    assert growth.stimulus(rho, elastic, material) == pytest.approx(stimulus, rel=1e-14)
    assert growth.mass_source(rho, elastic, material) == pytest.approx(RATE * (stimulus - ATTRACTOR), rel=1e-13)


@kinds
@exponents
@zones
def test_slope_is_the_derivative_of_the_source(kind, n, m, zone):
    """The local Newton is only quadratic with the exact slope; UFL's own derivative and differences must agree."""
    growth, material = laws(kind, n, m, zone)
    step = 1e-6
    for rho, elastic in ((1.9, 0.8), (1.1, 0.2), (1.35, 0.4)):
        slope = growth.mass_source_slope(rho, elastic, material)
        ahead, back = (growth.mass_source(rho + shift, elastic, material) for shift in (step, -step))
        variable = ufl.variable(ufl.as_ufl(rho))
        derivative = ufl.diff(growth.mass_source(variable, elastic, material), variable)
        assert slope == pytest.approx((ahead - back) / (2 * step), abs=1e-7)
        assert slope == pytest.approx(number(derivative), abs=1e-13)


@kinds
@exponents
@zones
def test_floats_arrays_and_ufl_give_the_same(kind, n, m, zone):
    """Node-based variants use UFL and point-based ones arrays: both must grow the same bone."""
    growth, material = laws(kind, n, m, zone)
    rho, elastic = np.array([0.2, 1.0, 3.1]), np.array([0.0, 0.4, 5.0])
    for law in (growth.stimulus, growth.mass_source, growth.mass_source_slope):
        floats = [law(float(a), float(b), material) for a, b in zip(rho, elastic, strict=True)]
        symbolic = [number(law(ufl.as_ufl(a), ufl.as_ufl(b), material)) for a, b in zip(rho, elastic, strict=True)]
        assert np.allclose(law(rho, elastic, material), floats, rtol=1e-14, atol=1e-15)
        assert np.allclose(symbolic, floats, rtol=1e-13, atol=1e-15)


@kinds
def test_source_changes_its_sign_at_the_attractor(kind):
    """Biological equilibrium is what the models are about: R₀ = 0 exactly where the stimulus meets the attractor."""
    growth, material = laws(kind, 2, 3)
    rho = 1.9
    growth = replace(growth, attractor=growth.stimulus(rho, 0.9, material))
    assert growth.mass_source(rho, 0.9, material) == 0
    assert growth.mass_source(rho, 0.91, material) > 0 > growth.mass_source(rho, 0.89, material)


@pytest.mark.parametrize("strain", [0.0, 1e-3, 0.05, 2.0])
def test_equivalent_strain_is_that_of_a_bar_of_the_same_energy(strain):
    """A bar stores ½Eε²: ε must come back but for the rounding at rest, where it is zero exactly."""
    material = gx.Material(YOUNG, POISSON)
    assert equivalent_strain(YOUNG * strain**2 / 2, material) == pytest.approx(strain, abs=REST)
    assert equivalent_strain(0.0, material) == 0.0


def test_equivalent_strain_and_stress_of_a_stretched_bar():
    """The material's own bar, in small tension with free sides: its strain, and its stress [ρ/ρ*]ⁿ E ε."""
    n, m, strain, rho = 2.0, 0.0, 1e-4, 1.9
    material = gx.Material(YOUNG, POISSON, REFERENCE, n)
    energy = material.elastic_energy(*principal_changes((strain, -POISSON * strain, -POISSON * strain)))
    # What is left is of second order in the strain.
    assert gx.StrainDrivenGrowth(0.0, exponent=m).stimulus(rho, energy, material) == pytest.approx(
        strain, rel=5 * strain
    )
    stress = (rho / REFERENCE) ** n * YOUNG * strain
    assert gx.StressDrivenGrowth(0.0, exponent=m).stimulus(rho, energy, material) == pytest.approx(
        stress, rel=5 * strain
    )


@pytest.mark.parametrize("kind", [gx.StrainDrivenGrowth, gx.StressDrivenGrowth], ids=lambda kind: kind.__name__)
def test_an_equivalent_strain_is_smooth_at_rest(kind):
    """√Ψ has no slope there, and every march starts there: it must be finite, or the first tangent is NaN."""
    growth, material = laws(kind, 2, 3)
    energy = ufl.variable(ufl.as_ufl(0.0))
    slope = number(ufl.diff(growth.mass_source(1.9, energy, material), energy))
    assert np.isfinite(slope) and slope > 0


@pytest.mark.parametrize("variant", [gx.Q1, gx.Q1Q1], ids=lambda variant: variant.name)
def test_energy_per_mass_is_the_case_of_exponent_one(variant):
    """c { Ψ₀/ρ − k } = c/ρ* { [ρ/ρ*]⁻¹ Ψ₀ − kρ* }: whole runs of both must be the same."""
    mesh, reference = square(2, 0.06), 1.2
    specific = gx.SpecificEnergyDrivenGrowth(0.02, 5.0)
    relative = gx.EnergyDrivenGrowth(0.02 * reference, 5.0 / reference, exponent=1)
    first, second = (densities(run(block(mesh, growth=law), variant)[1]) for law in (specific, relative))
    assert np.abs(first[:, 2] - reference).max() > 0.01
    assert first == pytest.approx(second, rel=1e-11)


# -- the dead zone -----------------------------------------------------------------------------------------------------


def response(excess, width=DEAD_ZONE):
    """What a law with a dead zone makes of an excess S − S*: an exponent of zero leaves the energy as the stimulus."""
    material = gx.Material(1.0, density_exponent=0.0)
    growth = gx.EnergyDrivenGrowth(0.0, 1.0, exponent=0.0, dead_zone=width)
    return growth.mass_source(1.0, excess, material)


EXCESS = np.linspace(-5, 5, 2001) * DEAD_ZONE


def test_the_dead_zone_is_odd_and_rises():
    """Gain and loss are treated alike, and more stimulus never means less growth."""
    assert response(-EXCESS) == pytest.approx(-response(EXCESS), abs=1e-15)
    assert response(0.0) == 0.0
    assert np.all(np.diff(response(EXCESS)) > 0)


def test_the_dead_zone_hardly_responds_inside_and_is_shifted_outside():
    """Against the sharp zone: zero for |x| < w and x ∓ w beyond, from which the rounded edges differ most, by ε/2."""
    sharp = np.sign(EXCESS) * np.maximum(np.abs(EXCESS) - DEAD_ZONE, 0)
    soft = ROUNDING * DEAD_ZONE
    away = np.abs(response(EXCESS) - sharp)
    assert away.max() <= soft / 2 and away.max() == pytest.approx(soft / 2, rel=0.05)
    # A rounded edge is ε²/4d away from the sharp one at a distance d from it.
    far = np.abs(np.abs(EXCESS) - DEAD_ZONE) >= DEAD_ZONE / 2
    assert away[far].max() <= soft**2 / 4 / (DEAD_ZONE / 2)


def test_the_dead_zone_is_smooth():
    """Newton's method needs a slope without jumps: over an edge it runs from 0 to 1 no faster than 1/(2ε)."""
    material = gx.Material(1.0, density_exponent=1.0)
    growth = gx.EnergyDrivenGrowth(0.0, 1.0, exponent=0.0, dead_zone=DEAD_ZONE)
    rho = np.linspace(1e-3, 5, 5001) * DEAD_ZONE
    slope = growth.mass_source_slope(rho, 1.0, material)  # of the response, since the stimulus is ρ
    assert slope.min() > 0 and slope.max() < 1
    steepest = (np.abs(np.diff(slope)) / np.diff(rho)).max()
    assert steepest == pytest.approx(1 / (2 * ROUNDING * DEAD_ZONE), rel=0.02)


def test_the_dead_zone_vanishes_with_its_width():
    """A width of zero is the law without it, and narrow zones come as near to it as they are narrow."""
    assert np.array_equal(response(EXCESS, 0.0), EXCESS)
    for width in (1e-2, 1e-5):
        assert np.abs(response(EXCESS, width) - EXCESS).max() == pytest.approx(width, rel=1e-3)


@kinds
def test_the_dead_zone_leaves_density_alone_about_the_attractor(kind):
    """Each law has it: at an excess within the zone the source is a small share of what it is without."""
    (lazy, material), (keen, _) = laws(kind, 2, 3, DEAD_ZONE), laws(kind, 2, 3)
    rho, elastic = 1.9, 0.8
    attractor = keen.stimulus(rho, elastic, material) - 0.3 * DEAD_ZONE
    lazy, keen = (replace(law, attractor=attractor) for law in (lazy, keen))
    assert 0 < lazy.mass_source(rho, elastic, material) < 0.01 * keen.mass_source(rho, elastic, material)


# -- what is refused ---------------------------------------------------------------------------------------------------


@kinds
@pytest.mark.parametrize(
    ("parameters", "sentence"),
    [
        ({"attractor": -0.1}, "the attractor stimulus Ψ₀* is -0.1: a number of at least 0 would be right"),
        ({"attractor": float("inf")}, "the attractor stimulus Ψ₀* is inf: a number of at least 0 would be right"),
        (
            {"attractor": {"bone": 1, "stem": float("nan")}},
            "the attractor stimulus Ψ₀* of 'stem' is nan: a number of at least 0 would be right",
        ),
        ({"rate": -1}, "the growth rate c is -1: a number of at least 0 would be right"),
        ({"dead_zone": -0.1}, "the dead zone's half-width is -0.1: a number of at least 0 would be right"),
        (
            {"dead_zone": float("nan")},
            "the dead zone's half-width is nan: a number of at least 0 would be right",
        ),
        ({"bounds": (0.0, 2.0)}, "a bound of density is 0: a positive number or None would be right"),
        ({"bounds": (None, "2")}, "a bound of density is '2': a positive number or None would be right"),
        (
            {"bounds": (2.0, 1.0)},
            "the bounds of density are (2.0, 1.0): the lowest before the highest would be right",
        ),
        (
            {"bounds": (1.0, 1.0)},
            "the bounds of density are (1.0, 1.0): the lowest before the highest would be right",
        ),
        ({"bounds": (1.0,)}, "the bounds of density are (1.0,): the lowest and the highest would be right"),
    ],
)
def test_impossible_parameters_are_refused(kind, parameters, sentence):
    """The sentence must name symbol, value and remedy."""
    with pytest.raises(InputError) as caught:
        kind(**{"attractor": 1.0, **parameters})
    assert str(caught.value) == sentence


@pytest.mark.parametrize(
    "kind", [kind for kind in STIMULI if kind is not gx.SpecificEnergyDrivenGrowth], ids=lambda kind: kind.__name__
)
@pytest.mark.parametrize(("exponent", "text"), [(-3, "-3"), ("3", "'3'")])
def test_impossible_exponents_are_refused(kind, exponent, text):
    """A law that checks its own parameter must say so like the base does, and not forget the base's checks."""
    with pytest.raises(InputError) as caught:
        kind(1.0, exponent=exponent)
    assert str(caught.value) == f"the exponent m is {text}: a number of at least 0 would be right"


@kinds
def test_no_attractor_and_no_growth_are_allowed(kind):
    """Ψ₀* = 0 and c = 0 are the limits a user tries first to see pure apposition, or none."""
    assert kind(attractor=0.0, rate=0.0).mass_source(1.0, 1.0, gx.Material(1.0)) == 0.0


def test_the_base_alone_is_no_law():
    """A law without a stimulus must fail where it is made, not in the middle of a form."""
    with pytest.raises(TypeError, match="abstract"):
        gx.GrowthLaw(1.0)


# -- laws in a body ----------------------------------------------------------------------------------------------------

VARIANTS = (gx.Q1, gx.Q1P0, gx.Q1sri, gx.Q1Q1)
variants = pytest.mark.parametrize("variant", VARIANTS, ids=lambda variant: variant.name)
# With attractors in the middle of what the iterate below has, and dead zones that hold some of its points.
BODY_LAWS = {
    "energy": gx.EnergyDrivenGrowth(0.02, 5.0),
    "energy, dead zone": gx.EnergyDrivenGrowth(0.02, 5.0, dead_zone=0.012),
    "energy per mass": gx.SpecificEnergyDrivenGrowth(0.02, 5.0),
    "strain": gx.StrainDrivenGrowth(0.2, 1.0),
    "stress": gx.StressDrivenGrowth(0.2, 1.0),
    "stress, dead zone": gx.StressDrivenGrowth(0.2, 1.0, dead_zone=0.06),
}
body_laws = pytest.mark.parametrize("law", BODY_LAWS.values(), ids=BODY_LAWS)


@variants
@body_laws
def test_tangent_is_the_derivative_of_the_forces(law, variant):
    """Each law's tangent, symmetric where R₀ is that of a point or linear in the energy, and said to be so only there.

    The solver factorises what is said to be symmetric as such, silently.
    """
    problem = gx.discretise(block(square(2, 0.06), growth=law), variant)
    problem.system.begin_step(0.1, 0.7)
    set_iterate(
        problem,
        lambda x: np.stack([0.3 * np.sin(2 * x[0]) + 0.1 * x[1], 0.2 * x[0] * x[1] - 0.15 * x[1]]),
        lambda x: 1.0 + 0.3 * np.cos(3 * x[0] + x[1]),
    )
    exact = tangent(problem)
    assert_tangent_matches_differences(problem, exact)
    linear = isinstance(law, gx.EnergyDrivenGrowth | gx.SpecificEnergyDrivenGrowth) and law.dead_zone == 0
    assert problem.system.symmetric == (variant is gx.Q1 or (variant is gx.Q1P0 and linear))
    asymmetry = np.abs(exact - exact.T).max() / np.abs(exact).max()
    assert asymmetry < 1e-14 if problem.system.symmetric else asymmetry > 1e-5


BLOCK_E, BLOCK_NU, BLOCK_REFERENCE, TRACTION, STEP, RAMP, UNTIL = 3.0, 0.3, 1.2, 0.9, 0.25, 0.5, 1.5
BLOCK_LAWS = {  # each with a source of the size that moves the density within the few steps
    "energy, dead zone": gx.EnergyDrivenGrowth(0.05, 4.0, dead_zone=0.012),
    "energy per mass": gx.SpecificEnergyDrivenGrowth(0.04, 4.0),
    "strain": gx.StrainDrivenGrowth(0.1, 1.0),
    "stress": gx.StressDrivenGrowth(0.3, 0.5),
    "stress, dead zone": gx.StressDrivenGrowth(0.3, 0.5, dead_zone=0.06),
}


def recursion(law):
    """Implicit Euler for the density with the stretches in balance: rows (λ₁, λ₂, ρ), written from the formulas."""
    n, m = 2.0, getattr(law, "exponent", None)
    lam, mu = BLOCK_E * BLOCK_NU / ((1 + BLOCK_NU) * (1 - 2 * BLOCK_NU)), BLOCK_E / (2 * (1 + BLOCK_NU))

    def edge(y):
        return (y + np.hypot(y, ROUNDING * law.dead_zone)) / 2

    def balances(state, old, traction):
        a, b, rho = state
        J, r = a * b, rho / BLOCK_REFERENCE
        energy = lam / 2 * np.log(J) ** 2 + mu / 2 * (a**2 + b**2 + 1 - 3 - 2 * np.log(J))
        excess = STIMULI[type(law)](r, energy, n, m, BLOCK_E, BLOCK_REFERENCE) - law.attractor
        source = law.rate * (edge(excess - law.dead_zone) - edge(-excess - law.dead_zone))
        return [
            r**n * (mu * a + (lam * np.log(J) - mu) / a) - traction,
            r**n * (mu * b + (lam * np.log(J) - mu) / b),
            rho - old - STEP * source,
        ]

    state, rows = np.array([1.0, 1.0, BLOCK_REFERENCE]), []
    for k in range(1, round(UNTIL / STEP) + 1):
        found = root(balances, state, args=(state[2], min(1.0, k * STEP / RAMP) * TRACTION), tol=1e-14)
        assert np.abs(found.fun).max() < 1e-12
        state = found.x
        rows.append(state)
    return np.array(rows)


@variants
@pytest.mark.parametrize("law", BLOCK_LAWS.values(), ids=BLOCK_LAWS)
def test_a_homogeneous_block_is_the_scalar_equation(law, variant):
    """Every law by every way to solve for the density must reduce to the same few numbers; (6) is tested elsewhere."""
    scene = block(
        square(2, 0.08),
        material=gx.Material(BLOCK_E, BLOCK_NU, BLOCK_REFERENCE),
        growth=law,
        supports=ROLLERS,
        loads=(gx.Traction("right", (TRACTION, 0.0)),),
        program=gx.Program(step=STEP, until=UNTIL, ramp=RAMP),
    )
    expected = recursion(law)
    assert np.ptp(expected[:, 2]) > 0.03, "the density must move for the comparison to mean something"
    problem = gx.discretise(scene, variant)
    for step, (along, across, rho) in zip(gx.march(scene, variant, problem, tolerance=1e-13), expected, strict=True):
        assert (step.min_density, step.max_density) == pytest.approx((rho, rho), rel=1e-9)
        assert step.mass_defect < 1e-12
        x, y, u, v = displacements(problem).T
        assert u == pytest.approx((along - 1) * x, abs=1e-9)
        assert v == pytest.approx((across - 1) * y, abs=1e-9)


@variants
def test_a_lazy_bone_keeps_its_density(variant):
    """The dead zone in a body: what grows without it stays within the little that the rounded edges let through."""
    # Stimuli from nearly 0 to over 0.01 about an attractor of 0.02: all within a zone of 0.1 by a wide margin.
    keen = gx.EnergyDrivenGrowth(0.02, 5.0)
    changes = []
    for law in (keen, replace(keen, dead_zone=0.1)):
        rho = densities(run(block(square(2, 0.06), growth=law), variant)[1])[:, 2]
        changes.append(np.abs(rho - 1.2).max())
    assert changes[0] > 0.01 and changes[1] < 0.02 * changes[0]


def test_the_response_is_the_integral_of_its_slope():
    """The two are written separately: over any stretch of stimulus they must tell of the same law."""
    material = gx.Material(1.0, density_exponent=1.0)
    growth = gx.EnergyDrivenGrowth(0.9, 1.4, exponent=0.0, dead_zone=DEAD_ZONE)
    gained = growth.mass_source(2.0, 1.0, material) - growth.mass_source(0.3, 1.0, material)
    summed = quad(lambda rho: growth.mass_source_slope(rho, 1.0, material), 0.3, 2.0, points=(0.6, 1.2), epsabs=1e-12)
    assert gained == pytest.approx(summed[0], abs=1e-10)
