"""Weights of the stored energy that are no power of the density: every law, variant, baseline and judgement follows."""

import logging
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
import ufl
from blocks import (
    COMM,
    ROLLERS,
    assert_tangent_matches_differences,
    block,
    densities,
    run,
    set_iterate,
    square,
    tangent,
)
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq

import growthx as gx
from growthx import baselines, results, wellposedness
from growthx.common.errors import InputError
from growthx.constitutive.homogeneous import uniaxial_equilibrium
from growthx.constitutive.local.balance import solve_density
from growthx.constitutive.local.source import LocalSource
from growthx.model import exponents

VARIANTS = (gx.Q1Q1, gx.Q2Q2, gx.S2Q1, gx.Q1P0, gx.Q1, gx.Q2, gx.Q1sri, gx.S2fri)
TRIANGLES = (gx.P1P1, gx.P2P1, gx.P1P0, gx.P1, gx.P2)
each_variant = pytest.mark.parametrize("variant", VARIANTS + TRIANGLES, ids=lambda variant: variant.name)
some = pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1, gx.Q1Q1], ids=lambda variant: variant.name)

PIECES = gx.PiecewisePower(2.0, 3.0, between=(1.0, 1.25))


@dataclass(frozen=True)
class Mixed(gx.DensityWeight):
    """A share of a square and the rest of a cube: the ten lines of the page."""

    share: Any = 0.5

    coefficients = ("share",)

    def weight(self, density, reference_density):
        """One at the reference density."""
        relative = density / reference_density
        return self.share * relative**2 + (1 - self.share) * relative**3


def by_quadrature(density, reference=1.1, below=2.0, above=3.0, ends=(1.0, 1.25)):
    """Exp ∫ n d ln ρ, with n written down once more."""

    def n(logarithm):
        share = np.clip(np.log(np.exp(logarithm) / ends[0]) / np.log(ends[1] / ends[0]), 0, 1)
        return below + (above - below) * (3 * share**2 - 2 * share**3)

    logs = np.log([reference, density])
    return np.exp(quad(n, *logs, points=[p for p in np.log(ends) if logs.min() < p < logs.max()] or None)[0])


def mixed(density, reference=1.1, share=0.5):
    """The weight of `Mixed`, by NumPy."""
    return share * (density / reference) ** 2 + (1 - share) * (density / reference) ** 3


KINDS = {"pieces": (PIECES, by_quadrature), "own": (Mixed(), mixed)}
each_weight = pytest.mark.parametrize(("weight", "known"), KINDS.values(), ids=KINDS.keys())
SAMPLES = np.array([0.02, 0.5, 0.999, 1.0, 1.0001, 1.1, 1.2, 1.2499, 1.25, 1.3, 2.0, 30.0])


@each_weight
def test_weights_are_as_written(weight, known):
    """By quadrature of the exponent, or by hand; the exponent is the slope in logarithms."""
    material = gx.Material(17e3, 0.3, 1.1, weight)
    assert material.weight(SAMPLES) == pytest.approx([known(rho) for rho in SAMPLES], rel=1e-9)
    assert material.weight(1.1) == pytest.approx(1.0, rel=1e-14)
    step = 1e-6
    slopes = [(np.log(known(rho * (1 + step))) - np.log(known(rho * (1 - step)))) / (2 * step) for rho in SAMPLES]
    assert material.exponent_at(SAMPLES) == pytest.approx(slopes, abs=2e-5)


def test_powers_outside_the_range():
    """Below and above it the ratio of two weights is that of powers, to round-off, whatever ρ* is."""
    for reference in (0.3, 1.1, 2.0):
        below, above = (PIECES.weight(np.array(pair), reference) for pair in ([0.02, 0.9], [1.3, 4.0]))
        assert below[1] / below[0] == pytest.approx((0.9 / 0.02) ** 2, rel=1e-12)
        assert above[1] / above[0] == pytest.approx((4.0 / 1.3) ** 3, rel=1e-12)


@each_weight
def test_one_text_for_numbers_arrays_and_ufl(weight, known):
    """Weights and exponents, stated and by differentiation."""
    material = gx.Material(1.0, 0.3, 1.1, weight)
    weights, exponents_ = material.weight(SAMPLES), material.exponent_at(SAMPLES)
    for number, (density, array) in enumerate(zip(SAMPLES.tolist(), weights, strict=True)):
        rho = ufl.variable(ufl.as_ufl(density))
        slope = ufl.algorithms.expand_derivatives(ufl.diff(material.weight(rho), rho))(())
        stated = ufl.algorithms.expand_derivatives(ufl.as_ufl(material.exponent_at(rho)))(())
        assert float(material.weight(rho)(())) == pytest.approx(array, rel=1e-13)
        assert material.weight(density) == pytest.approx(array, rel=1e-13)
        assert stated == pytest.approx(exponents_[number], rel=1e-12)
        assert density * slope / array == pytest.approx(exponents_[number], rel=1e-9, abs=1e-9)


LAWS = {
    "energy": (gx.EnergyDrivenGrowth(0.02, 4.0, 3.5, dead_zone=0.001), lambda w, r, psi: w * r**-3.5 * psi),
    "specific": (gx.SpecificEnergyDrivenGrowth(0.02, 4.0), lambda w, r, psi: w / r * psi / 1.1),
    "strain": (gx.StrainDrivenGrowth(0.1, 4.0, 1.5), lambda w, r, psi: r**-1.5 * np.sqrt(psi)),
    "stress": (gx.StressDrivenGrowth(0.1, 4.0, 3.5), lambda w, r, psi: w * r**-3.5 * 2 * np.sqrt(psi)),
    "energy remodelling": (gx.EnergyRemodelling(0.02, 4.0, exponent=4.0), lambda w, r, psi: w * r**-4.0 * psi),
    "specific remodelling": (gx.SpecificEnergyRemodelling(0.02, 4.0), lambda w, r, psi: w / r * psi / 1.1),
    "strain remodelling": (gx.StrainRemodelling(0.1, 4.0), lambda w, r, psi: np.sqrt(psi) / r),
    "daily": (
        gx.DailyStressRemodelling(0.6, 0.02, 0.01, cycles=16.0, concentration=4.0),
        lambda w, r, psi: 2 * (1.92 / 1.1) ** 4 * w * r**-4.0 * 2 * np.sqrt(psi),
    ),
}
each_law = pytest.mark.parametrize(("law", "formula"), LAWS.values(), ids=LAWS.keys())


@each_law
@each_weight
def test_laws_take_the_weight_where_they_had_a_power(weight, known, law, formula):
    """Stimuli by hand, E = 2, and slopes of sources by differences."""
    material, psi = gx.Material(2.0, 0.3, 1.1, weight), 0.013
    stimuli = law.stimulus(SAMPLES, psi, material)
    expected = [formula(known(rho), rho / 1.1, psi) for rho in SAMPLES]
    assert stimuli == pytest.approx(expected, rel=1e-8)
    step = 1e-6 * SAMPLES
    differences = (law.mass_source(SAMPLES + step, psi, material) - law.mass_source(SAMPLES - step, psi, material)) / (
        2 * step
    )
    _, slopes = law.mass_source_and_slope(SAMPLES, psi, material)
    assert slopes == pytest.approx(differences, rel=1e-4, abs=1e-5 * np.abs(differences).min() + 1e-7)
    rho = ufl.variable(ufl.as_ufl(1.13))
    symbolic = ufl.algorithms.expand_derivatives(ufl.as_ufl(law.mass_source_slope(rho, ufl.as_ufl(psi), material)))(())
    assert symbolic == pytest.approx(law.mass_source_slope(np.array([1.13]), psi, material)[0], rel=1e-9)


# -- in scenes ---------------------------------------------------------------------------------------------------------

# Bone in MPa and g/cm³, at strains of 1e-4 and less.
YOUNG, POISSON, REFERENCE, START, TRACTION = 17e3, 0.3, 1.1, 0.8, 1.0
BONE = gx.LinearElasticity(YOUNG, POISSON, REFERENCE, PIECES)
UNWEIGHTED = TRACTION**2 * (1 - POISSON**2) / (2 * YOUNG)  # weight times energy of a bar in plane strain
ATTRACTOR = 0.4 * UNWEIGHTED
LAW = gx.EnergyDrivenGrowth(ATTRACTOR, 0.5 / ATTRACTOR, exponent=3.5)


def rate(density, known=by_quadrature):
    """R₀ of the bar, whose stress is given: [ρ/ρ*]^−m Ψ₀ with Ψ₀ = σ² [1 − ν²]/(2 E w)."""
    return 0.5 / ATTRACTOR * ((density / REFERENCE) ** -3.5 * UNWEIGHTED / known(density) - ATTRACTOR)


def bar(material=BONE, shape="quadrilateral", step=0.25, count=3, **changes):
    """Pulled on rollers: a homogeneous state, which grows from below the range of densities to above it."""
    scene = block(
        square(2, 0.05, shape=shape),
        material=material,
        growth=LAW,
        supports=ROLLERS,
        loads=(gx.Traction("right", (TRACTION, 0.0)),),
        program=gx.Program(step=step, until=count * step),
        initial_density=START,
    )
    return replace(scene, **changes)


def recursion(known, step=0.25, count=3):
    """Densities of the bar by implicit Euler, as numbers."""
    rho = START
    for _ in range(count):
        start = rho
        rho = brentq(lambda x, start=start: x - start - step * rate(x, known), 0.1, 5.0, xtol=1e-15)
    return rho


@pytest.mark.parametrize(
    ("variant", "weight", "known"),
    [(variant, PIECES, by_quadrature) for variant in VARIANTS + TRIANGLES]
    + [(variant, Mixed(), mixed) for variant in (gx.Q1P0, gx.Q1, gx.Q1Q1)],
    ids=lambda value: getattr(value, "name", type(value).__name__),
)
def test_variants_agree_with_a_number(variant, weight, known):
    """Across the range, at 17 000 MPa and strains of 1e-4: every discretisation, by its balance of mass."""
    expected = recursion(known)
    assert START < 1.0 < expected
    scene = bar(replace(BONE, density_exponent=weight), variant.cells[0])
    steps, problem = run(scene, variant, tolerance=1e-12)
    assert (steps[-1].min_density, steps[-1].max_density) == pytest.approx((expected, expected), rel=1e-8)
    assert steps[-1].mass_defect < 1e-11
    assert problem.mean_density() == pytest.approx(expected, rel=1e-8)


@some
def test_growth_is_that_of_the_equation_in_time(variant):
    """Adaptive steps, against an integrator of ordinary differential equations."""
    known = solve_ivp(lambda t, rho: [rate(rho[0])], (0.0, 3.0), [START], rtol=1e-10, atol=1e-12).y[0, -1]
    assert known > 1.25
    scene = bar(program=gx.Program(step=0.1, until=3.0))
    steps, _ = run(scene, variant, stepping=gx.AdaptiveSteps(1e-5))
    assert steps[-1].max_density == pytest.approx(known, rel=1e-4)


@some
def test_the_modulus_that_is_written_is_the_weighted_one(variant):
    """Young's modulus as it is now, in files and in `problem`, and the strain that goes with it."""
    _, problem = run(bar(), variant, tolerance=1e-12)
    expected = recursion(by_quadrature)
    young = results.cell_fields(problem, ("young",))["young"]
    assert young == pytest.approx(YOUNG * by_quadrature(expected), rel=1e-7)
    strain = TRACTION * (1 - POISSON**2) / (YOUNG * by_quadrature(expected))
    assert strain < 1e-4
    points = np.array([[1.0, 0.5]])
    assert problem.sample_displacement(points)[0, 0] == pytest.approx(strain, rel=1e-7)


def test_equal_exponents_are_a_power():
    """To round-off: the same scene by a number n and by two pieces that are alike, at finite strains."""
    for variant in (gx.Q1P0, gx.Q1, gx.Q1Q1):
        ends = []
        for n in (2.0, gx.PiecewisePower(2.0, 2.0)):
            scene = block(square(2, 0.05), material=gx.Material(1.0, 0.25, 1.2, n))
            ends.append(densities(run(scene, variant, tolerance=1e-12)[1]))
        assert ends[1] == pytest.approx(ends[0], rel=1e-9)


@each_variant
def test_tangents_match_differences(variant):
    """Of a body with densities below, in and above the range, in which nothing is homogeneous."""
    material = gx.Material(1.0, 0.25, 1.1, PIECES)
    law = gx.EnergyDrivenGrowth(0.004, 5.0, exponent=3.5)
    scene = block(
        square(3, 0.05, shape=variant.cells[0]),
        material=material,
        growth=law,
        initial_density=lambda x: 0.85 + 0.6 * x[0],
    )
    problem = gx.discretise(scene, variant)
    problem.system.begin_step(0.1, 1.0)
    set_iterate(
        problem,
        lambda x: np.stack([0.1 * x[0] ** 2 + 0.03 * x[1] ** 2, -0.05 * x[0] * x[1]]),
        lambda x: 0.85 + 0.6 * x[0],
    )
    matrix = tangent(problem)
    assert_tangent_matches_differences(problem, matrix, count=2)
    if problem.system.symmetric:  # as those who factorise it by Cholesky's method take it to be
        assert np.abs(matrix - matrix.T).max() < 1e-10 * np.abs(matrix).max()


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1], ids=lambda variant: variant.name)
def test_exponents_of_regions(variant):
    """Two halves under one stress, without Poisson's effect, each with its own exponents."""
    below, above = {"bone": 2.0, "implant": 1.5}, {"bone": 3.0, "implant": 2.5}
    material = gx.LinearElasticity(YOUNG, 0.0, REFERENCE, gx.PiecewisePower(below, above))
    law = gx.EnergyDrivenGrowth(ATTRACTOR, 0.5 / ATTRACTOR, exponent=3.5)
    # An even number of cells, straight between the halves.
    _, problem = run(bar(material, mesh=square(2), growth=law), variant, tolerance=1e-12)
    rows = densities(problem)
    for name, half in (("bone", rows[rows[:, 0] < 0.5]), ("implant", rows[rows[:, 0] > 0.5])):
        alone = replace(material, density_exponent=gx.PiecewisePower(below[name], above[name]))
        _, other = run(bar(alone, mesh=square(2), growth=law), variant, tolerance=1e-12)
        assert half[:, 2] == pytest.approx(np.full(len(half), densities(other)[0, 2]), rel=1e-8)


@each_variant
def test_densities_between_exponents_of_regions(variant):
    """Two halves, each with its own range, given by region, by function and as numbers: as each would grow alone."""
    first, last = {"bone": 0.9, "implant": 1.1}, {"bone": 1.1, "implant": 1.5}
    by_place = tuple(lambda x, f=field: np.where(x[0] < 0.5, f["bone"], f["implant"]) for field in (first, last))
    law = gx.EnergyDrivenGrowth(ATTRACTOR, 0.5 / ATTRACTOR, exponent=3.5)
    found = []
    for between in ((first, last), by_place):
        material = gx.LinearElasticity(YOUNG, 0.0, REFERENCE, gx.PiecewisePower(2.0, 3.0, between))
        mesh = square(2, shape=variant.cells[0])
        found.append(densities(run(bar(material, mesh=mesh, growth=law), variant, tolerance=1e-12)[1]))
    assert found[1] == pytest.approx(found[0], rel=1e-12)
    if not variant.density.local:
        return  # at the seam a node has two of them
    for name, half in (("bone", found[0][found[0][:, 0] < 0.5]), ("implant", found[0][found[0][:, 0] > 0.5])):
        weight = gx.PiecewisePower(2.0, 3.0, (first[name], last[name]))
        alone = bar(replace(material, density_exponent=weight), mesh=square(2, shape=variant.cells[0]), growth=law)
        _, other = run(alone, variant, tolerance=1e-12)
        assert half[:, 2] == pytest.approx(np.full(len(half), densities(other)[0, 2]), rel=1e-8)
    assert np.ptp(found[0][:, 2]) > 1e-3


def test_powers_of_a_stimulus_are_those_of_its_material(monkeypatch):
    """Looked for once as long as that stays the same one, of which evaluations ask again and again."""
    asked, power = [], gx.EnergyDrivenGrowth.power
    monkeypatch.setattr(gx.EnergyDrivenGrowth, "power", lambda law, material: asked.append(1) or power(law, material))
    law = gx.EnergyDrivenGrowth(ATTRACTOR, 1.0, exponent=3.5)
    found = [law.stimulus(0.9, 1.0, BONE) for _ in range(5)]
    assert len(asked) == 3 and len(set(found)) == 1
    steeper = replace(BONE, density_exponent=gx.PiecewisePower(1.0, 1.5))
    assert law.stimulus(0.9, 1.0, steeper) != found[0]
    assert law.stimulus(0.9, 1.0, BONE) == found[0]


def test_fields_and_numbers_give_the_same():
    """Parameters as functions of position, DOLFINx functions' worth of a number, in one own weight."""
    ends = [
        densities(run(bar(replace(BONE, density_exponent=Mixed(share))), variant, tolerance=1e-12)[1])
        for variant in (gx.Q1P0, gx.Q1Q1)
        for share in (0.3, lambda x: 0.3 + 0.0 * x[0])
    ]
    assert ends[1] == pytest.approx(ends[0], rel=1e-9) and ends[3] == pytest.approx(ends[2], rel=1e-9)


@each_weight
def test_baselines_and_equilibria(weight, known):
    """An explicit step by hand; where the source vanishes, by a root finder alone, by two ways in growthx."""
    material = replace(BONE, density_exponent=weight)
    (step, *_) = baselines.update(bar(material), gx.Q1P0, tolerance=1e-12)
    assert step.max_density == pytest.approx(START + 0.25 * rate(START, known), rel=1e-8)
    rest = brentq(lambda rho: rate(rho, known), 0.5, 3.0, xtol=1e-14)
    assert rest > 1.25
    assert uniaxial_equilibrium(material, LAW, TRACTION).density == pytest.approx(rest, rel=1e-8)
    assert gx.homeostasis(bar(material), gx.Q1).mean_density() == pytest.approx(rest, rel=1e-6)


def test_local_roots_continue_the_old_density():
    """Where the stimulus falls below the range and rises above it (m = 2.5), each root is reached from ρₙ."""
    material = gx.Material(1.0, 0.3, 1.1, PIECES)
    for zone in (0.0, 0.002):
        law = gx.EnergyDrivenGrowth(0.02, 5.0, exponent=2.5, dead_zone=zone)
        old = np.geomspace(0.3, 1.5, 12)
        energy = np.geomspace(0.005, 0.03, 12)
        source, step = LocalSource(law, material, energy), 0.2
        found = solve_density(source, old, step, old)
        assert np.all(np.isfinite(found))
        assert found - old - step * source.rate(found) == pytest.approx(0.0, abs=1e-12)
        for start, psi, end in zip(old, energy, found, strict=True):  # the path in Δt, by small parts of it
            rho = start
            for part in np.linspace(0.0, step, 40)[1:]:
                for _ in range(6):
                    rate_, slope = (float(x) for x in law.mass_source_and_slope(rho, psi, material))
                    rho -= (rho - start - part * rate_) / (1 - part * slope)
            assert end == pytest.approx(rho, rel=1e-9)


# -- well posed or not -------------------------------------------------------------------------------------------------


def test_the_steepest_part_of_the_weight_decides(caplog):
    """m = 2.5 is above n = 2 and below n = 3: not well posed, unless no density may come to where n is 3."""
    scene = bar(growth=replace(LAW, exponent=2.5))
    exponents._said.clear()
    with caplog.at_level(logging.WARNING, logger="growthx"):
        problem = gx.discretise(scene, gx.Q1P0)
    assert not problem.system.must_be_stable and not exponents.is_well_posed(scene)
    if COMM.rank == 0:
        assert "does not fall as the density rises (n − m = 0.5 at a density of" in caplog.text
    assert not wellposedness.check(problem).exponents
    assert exponents.is_well_posed(bar())
    assert wellposedness.check(gx.discretise(bar(), gx.Q1P0)).exponents
    assert exponents.is_well_posed(replace(scene, growth=replace(scene.growth, bounds=(0.01, 1.0))))
    steep = replace(BONE, density_exponent=gx.PiecewisePower({"bone": 2.0, "implant": 5.0}))
    assert not exponents.is_well_posed(replace(scene, material=steep, growth=LAW))
    assert exponents.is_well_posed(replace(scene, material=steep, growth=LAW, growing=("bone",)))
    remodelling = gx.EnergyRemodelling(ATTRACTOR, 1.0, exponent=2.5)
    assert not exponents.is_well_posed(bar(growth=remodelling))
    assert exponents.is_well_posed(bar(growth=replace(remodelling, exponent=3.5)))


def test_the_margin_is_that_of_the_slope():
    """1 − Δt ∂R₀/∂ρ of a homogeneous state, by differences."""
    steps, problem = run(bar(), gx.Q1, tolerance=1e-12)
    at, step = steps[-1].max_density, 1e-6
    energy = UNWEIGHTED / by_quadrature(at) ** 2
    source = [
        0.5 / ATTRACTOR * (rho / REFERENCE) ** -3.5 * by_quadrature(rho) * energy for rho in (at + step, at - step)
    ]
    margin = 1 - 0.25 * (source[0] - source[1]) / (2 * step)
    assert wellposedness.check(problem).margin == pytest.approx(margin, rel=1e-6)


# -- kept, known again, where nothing grows ----------------------------------------------------------------------------


def test_resumed_runs_know_their_weight(shared_folder):
    """To the end with the same one; refused with another, by parameters or by what a class says."""

    def scene(weight):
        return bar(replace(BONE, density_exponent=weight), count=6)

    whole = gx.solve(scene(PIECES), gx.Q1P0, out=shared_folder / "whole", checkpoint=2)
    kept = shared_folder / "whole" / "checkpoint-000004.npz"
    again = gx.solve(scene(PIECES), gx.Q1P0, out=shared_folder / "again", resume=kept)
    assert densities(again.problem) == pytest.approx(densities(whole.problem), rel=1e-12)

    @dataclass(frozen=True)
    class Other(gx.DensityWeight):
        def weight(self, density, reference_density):
            return (density / reference_density) ** 2

    for weight in (gx.PiecewisePower(2.0, 3.1), 2.0, Other(), gx.PiecewisePower(2.0, lambda x: 3.0 + x[0])):
        with pytest.raises(InputError):
            gx.solve(scene(weight), gx.Q1P0, resume=kept)


def test_what_does_not_grow_has_no_weight():
    """Young's modulus there is what it is given, whatever the density."""
    scene = bar(growing=("bone",), mesh=square(2))
    _, problem = run(scene, gx.Q1P0)
    young = np.unique(np.round(results.cell_fields(problem, ("young",))["young"], 6))
    found = np.unique(np.concatenate(COMM.allgather(young)))
    assert YOUNG in found and len(found) > 1


def test_other_energies_have_the_weight_too():
    """Each grows in the same way at small strains, where all are Hooke's law."""
    expected = recursion(by_quadrature)
    for kind in (gx.Material, gx.SaintVenantKirchhoff, gx.MooneyRivlin):
        steps, _ = run(bar(kind(YOUNG, POISSON, REFERENCE, PIECES)), gx.Q1P0, tolerance=1e-12)
        assert steps[-1].max_density == pytest.approx(expected, rel=1e-3)


# -- bad input ---------------------------------------------------------------------------------------------------------


class _Fails(gx.DensityWeight):
    def weight(self, density, reference_density):
        return np.exp(density)


class _Vanishes(gx.DensityWeight):
    def weight(self, density, reference_density):
        return density - 1.0


class _WithoutSlope(gx.DensityWeight):
    def weight(self, density, reference_density):
        return abs(density) ** 2


class _Square(gx.GrowthLaw):
    def power(self, material):
        return material.density_exponent**2 - 8

    def drive(self, elastic_energy, material):
        return elastic_energy


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: gx.PiecewisePower(-1.0), "the density exponent n below is -1: a number of at least 0 would be right"),
        (lambda: gx.PiecewisePower(2.0, "3"), "the density exponent n above is '3': a number of at least 0"),
        (lambda: gx.PiecewisePower(between=(1.2, 1.0)), r"the densities between two exponents are \(1.2, 1.0\): two "),
        (lambda: gx.PiecewisePower(between=(1.0, 1.0)), r"the densities between two exponents are \(1.0, 1.0\): two "),
        (lambda: gx.PiecewisePower(between=1.0), "the densities between two exponents is 1.0: "),
        (lambda: gx.PiecewisePower(between=(1.0,)), r"the densities between two exponents are \(1.0,\): two above 0"),
        (
            lambda: gx.PiecewisePower(between=(-1.0, 1.0)),
            "the lower one of the densities between two exponents is -1: ",
        ),
        (
            lambda: gx.PiecewisePower(between=({"bone": 1.0, "implant": 1.3}, {"bone": 1.2, "implant": 1.2})),
            r"the densities between two exponents are \(1.3, 1.2\): two ",
        ),
        (
            lambda: gx.discretise(
                bar(replace(BONE, density_exponent=gx.PiecewisePower(between=(lambda x: 1.0 + x[0], 1.5)))), gx.Q1P0
            ),
            "the densities between two exponents are ",
        ),
        (
            lambda: gx.Material(1.0, density_exponent={"bone": PIECES}),
            "the density exponent n is {'bone': Piece.*one D",
        ),
        (lambda: bar(replace(BONE, density_exponent=_Fails())), "the weight of _Fails fails in UFL, "),
        (lambda: bar(replace(BONE, density_exponent=_Vanishes())), "the weight of _Vanishes is -0.*a positive one"),
        (
            lambda: bar(replace(BONE, density_exponent=_WithoutSlope())),
            "the exponent of the weight of _WithoutSlope is 0",
        ),
        (lambda: bar(growth=_Square(0.02)), "the power of _Square is -8, -7 and -4 for n = 0, 1 and 2, and the"),
        (
            lambda: gx.discretise(bar(replace(BONE, density_exponent=gx.PiecewisePower({"bone": 2.0}))), gx.Q1P0),
            "a field given for the regions 'bone' has no value in",
        ),
    ],
)
def test_bad_weights_are_named(make, sentence):
    """One sentence with the value and what would be right."""
    with pytest.raises(InputError, match=f"^{sentence}") as caught:
        make()
    assert "\n" not in str(caught.value)
