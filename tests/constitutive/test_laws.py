"""Growth laws of the literature: known rates, one text for numbers, arrays and UFL, every variant, and bad input."""

from dataclasses import dataclass, replace

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
from scipy.optimize import root

import growthx as gx
from growthx import baselines, results
from growthx.common.errors import InputError
from growthx.constitutive.functions import between, positive_part
from growthx.constitutive.homogeneous import uniaxial_equilibrium
from growthx.solvers.newton import Newton
from growthx.solvers.settings import NewtonSettings

MATERIAL = gx.Material(2.0, 0.25, 1.2, 2.0)
ZONE = {"formation": 1.5, "resorption": 1.2, "relative_zone": 0.5}
LAWS = {
    "energy": gx.EnergyRemodelling(0.02, 4.0, 1.0, lazy_zone=0.001),
    "specific": gx.SpecificEnergyRemodelling(0.02, 4.0, 1.0, relative_zone=0.1, most_formation=0.5),
    "strain": gx.StrainRemodelling(0.1, 2.0, 1.0, factor=gx.PowerOfDensity(0.5)),
    "daily": gx.DailyStressRemodelling(0.6, 0.02, 0.01, concentration=3.0, factor=gx.MartinSurface(2.5)),
}
each_law = pytest.mark.parametrize("law", LAWS.values(), ids=LAWS.keys())


def test_known_rates_beyond_a_lazy_zone():
    """Formation 1.5 and resorption 1.2 beyond [1 ± 0.5] 0.2: −0.036 at 0.07 and +0.075 at 0.35, to round-off."""
    law = gx.SpecificEnergyRemodelling(0.2, **ZONE)
    # Unit densities: the stimulus is the energy.
    material = gx.Material(1.0, density_exponent=1.0)
    rates = law.mass_source(1.0, np.array([0.07, 0.35, 0.2, 0.11, 0.29]), material)
    assert rates == pytest.approx([-0.036, 0.075, 0.0, 0.0, 0.0], abs=1e-15)


def test_what_the_rounded_edges_are_off_by():
    """At most 4/27 of the rounding times rate and set point, just beyond the edge; nothing in the zone."""
    for rounding in (0.02, 0.1):
        law = gx.SpecificEnergyRemodelling(0.2, **ZONE, rounding=rounding)
        stimuli = np.linspace(0.0, 0.5, 15001)
        sharp = 1.5 * np.maximum(stimuli - 0.3, 0) - 1.2 * np.maximum(0.1 - stimuli, 0)
        error = np.abs(law.response(stimuli) - sharp)
        assert error.max() == pytest.approx(1.5 * rounding * 0.2 * 4 / 27, rel=1e-3)
        assert stimuli[error.argmax()] == pytest.approx(0.3 + rounding * 0.2 / 3, abs=1e-4)
        excess = np.abs(stimuli - 0.2) - 0.1
        assert error[(excess < 0) | (excess > rounding * 0.2)].max() < 1e-15


def test_existing_laws_are_instances():
    """Equal rates without a zone: the paper's law and that of Weinans, to round-off, at the corner, too."""
    energies, density = np.linspace(0.0, 0.1, 101), 0.9
    for one, other in (
        (gx.EnergyRemodelling(0.02, 4.0, 4.0), gx.EnergyDrivenGrowth(0.02, 4.0)),
        (gx.SpecificEnergyRemodelling(0.02, 4.0, 4.0), gx.SpecificEnergyDrivenGrowth(0.02, 4.0)),
        (gx.StrainRemodelling(0.02, 4.0, 4.0), gx.StrainDrivenGrowth(0.02, 4.0)),
    ):
        rates = [law.mass_source(density, energies, MATERIAL) for law in (one, other)]
        assert rates[0] == pytest.approx(rates[1], rel=1e-13, abs=1e-15)


def test_saturation():
    """Linear for small rates, never above the most, which is half reached where the linear law has it."""
    law = gx.SpecificEnergyRemodelling(1.0, 2.0, 3.0, most_formation=0.5, most_resorption=0.1)
    free = replace(law, most_formation=None, most_resorption=None)
    excess = np.array([-0.9, -0.1 / 3, 0.25, 1e9])
    assert law.response(1 + excess) == pytest.approx([-2.7 / 28, -0.05, 0.25, 0.5], rel=1e-8)
    assert free.response(1 + excess)[1:3] == pytest.approx([-0.1, 0.5])


def test_the_surface_of_bone():
    """Martin's polynomial: none of solid bone, nor of a denser one, most of it between; times the tissue's density."""
    surface = gx.MartinSurface(2.0)
    p = np.linspace(0, 1, 11)
    expected = 32.3 * p - 93.9 * p**2 + 134 * p**3 - 101 * p**4 + 28.8 * p**5
    assert surface.factor(2.0 * (1 - p), MATERIAL) / 2.0 == pytest.approx(expected, abs=1e-12)
    assert surface.factor(2.5, MATERIAL) == 0.0
    assert 4.0 < expected.max() < 4.4


def test_daily_stress_of_the_tissue():
    """Of one activity, by the formula: n cycles of the stress of a bar, concentrated in its tissue."""
    law = gx.DailyStressRemodelling(1.0, cycles=10000, exponent=4.0, tissue_density=1.92)
    density, strain = 0.7, 1e-3
    stiffness = 2.0 * (density / 1.2) ** 2
    expected = 10000**0.25 * (1.92 / density) ** 2 * stiffness * strain
    assert law.stimulus(density, 2.0 * strain**2 / 2, MATERIAL) == pytest.approx(expected, rel=1e-9)


def test_daily_stress_against_the_formulas_of_beaupre_and_others():
    """Beaupré, Orr & Carter 1990, written down once more: two activities a day, from their energies to ρ̇.

    σᵢ = √(2 E Uᵢ), ψ = [Σ nᵢ σᵢᵐ]^(1/m), ψ_b = [ρ_c/ρ]² ψ, ṙ = c [ψ_b − ψ_AS ∓ w], ρ̇ = ṙ S_v ρ_c.
    """
    density, tissue, m, set_point, width, c = 0.8, 1.92, 4, 50.0, 12.5, 2e-5  # g/cm³, MPa/day, mm/day
    cycles, stresses = np.array([6000.0, 4000.0]), np.array([1.0, 1.5])
    E = 2014 * density**2.5  # MPa, below 1.2 g/cm³
    energies = stresses**2 / (2 * E)
    psi = np.sum(cycles * np.sqrt(2 * E * energies) ** m) ** (1 / m)
    bone_stress = (tissue / density) ** 2 * psi
    porosity = 1 - density / tissue
    surface = np.polyval([28.8, -101.0, 134.0, -93.9, 32.3, 0.0], porosity)
    expected = c * (bone_stress - set_point - width) * surface * tissue
    assert (bone_stress, expected) == pytest.approx((73.3169, 1.55289e-3), rel=1e-4)

    # One density exponent below 1.2 g/cm³ and another above, as theirs.
    weight = gx.PiecewisePower(2.5, 3.2, between=(1.15, 1.25))
    material = gx.Material(2014.0, 0.3, 1.0, weight)
    law = gx.DailyStressRemodelling(
        set_point,
        formation=c,
        resorption=c,
        relative_zone=width / set_point,
        cycles=cycles.sum(),
        exponent=m,
        tissue_density=tissue,
        factor=gx.MartinSurface(tissue),
    )
    shares, unweighted = cycles / cycles.sum(), energies / material.weight(density)
    mean = np.sum(shares * unweighted**law.mean_exponent) ** (1 / law.mean_exponent)
    assert law.stimulus(density, mean, material) == pytest.approx(bone_stress, rel=1e-9)
    assert law.mass_source(density, mean, material) == pytest.approx(expected, rel=1e-9)


@each_law
def test_one_text_for_numbers_arrays_and_ufl(law):
    """Sources and slopes, by a complex step and by differentiation, in the zone, at its edges and far from it."""
    densities_, energies = np.meshgrid([0.3, 1.2, 2.2], [0.0, 1e-9, 1e-3, 0.0252, 0.03, 0.5])
    arrays = law.mass_source_and_slope(densities_, energies, MATERIAL)
    for index in np.ndindex(densities_.shape):
        rho, energy = ufl.variable(ufl.as_ufl(float(densities_[index]))), float(energies[index])
        slope = ufl.algorithms.expand_derivatives(law.mass_source_slope(rho, ufl.as_ufl(energy), MATERIAL))
        found = float(ufl.as_ufl(law.mass_source(rho, ufl.as_ufl(energy), MATERIAL))(())), float(slope(()))
        alone = law.mass_source_and_slope(float(densities_[index]), energy, MATERIAL)
        for array, in_ufl, number in zip(arrays, found, alone, strict=True):
            assert array[index] == pytest.approx(in_ufl, rel=1e-9, abs=1e-12)
            assert array[index] == pytest.approx(number, rel=1e-12, abs=1e-14)


def test_helpers_in_complex_steps():
    """Bounds and corners take complex numbers by their real parts, as slopes need them."""
    x = np.array([-2.0, -0.05, 0.05, 2.0])
    assert np.imag(positive_part(x + 1e-30j, 0.1)) / 1e-30 == pytest.approx([0, 0, 1.25, 1])
    assert np.imag(between(x + 1e-30j, -0.05, 1.0)) == pytest.approx([0, 1e-30, 1e-30, 0])


# -- in scenes ---------------------------------------------------------------------------------------------------------

TRACTION, STEP = 0.5, 0.25


def bar(law, **changes):
    """Pulled on rollers: a homogeneous state."""
    scene = block(
        square(2, 0.05),
        material=MATERIAL,
        growth=law,
        supports=ROLLERS,
        loads=(gx.Traction("right", (TRACTION, 0.0)),),
        program=gx.Program(step=STEP, until=3 * STEP),
    )
    return replace(scene, **changes)


def strains(density, traction=TRACTION):
    """Principal stretches less one of the bar at a density, and its energy, by a root finder."""

    def forces(at):
        stresses = MATERIAL.principal_stresses((at[0], at[1], 0.0), density)
        return [stresses[0] - traction, stresses[1]]

    a, b = root(forces, [0.1, -0.05], tol=1e-14).x
    return MATERIAL.principal_energy((a, b, 0.0))


def recursion(law, steps=3):
    """Densities of the bar by implicit Euler, as a number."""
    old = MATERIAL.reference_density
    for _ in range(steps):
        start = old
        old = root(
            lambda rho, start=start: rho - start - STEP * law.mass_source(rho[0], strains(rho[0]), MATERIAL), [start]
        ).x[0]
    return old


@each_law
def test_variants_agree_with_a_number(law):
    """At points, per cell and node-based, on a homogeneous bar; the stimulus is a field of each."""
    expected = recursion(law)
    assert abs(expected - MATERIAL.reference_density) > 1e-3
    for variant in (gx.Q1P0, gx.Q1, gx.Q1Q1):
        steps, problem = run(bar(law), variant, tolerance=1e-12)
        assert (steps[-1].min_density, steps[-1].max_density) == pytest.approx((expected, expected), rel=1e-8)
        assert steps[-1].mass_defect < 1e-11
        assert np.ptp(results.cell_fields(problem)["stimulus"]) < 1e-7 if COMM.size == 1 else True


@each_law
def test_baselines_and_equilibrium(law):
    """One explicit step by hand, and where the source vanishes: by a root finder and by a solution of the scene."""
    (step, *_) = baselines.update(bar(law), gx.Q1P0, tolerance=1e-12)
    start = MATERIAL.reference_density
    expected = start + STEP * law.mass_source(start, strains(start), MATERIAL)
    assert step.max_density == pytest.approx(expected, rel=1e-9)


def test_equilibrium_without_a_zone():
    """Different rates have one equilibrium, that of the stimulus at its set point: found directly, and known alone."""
    law = gx.EnergyRemodelling(0.05, 4.0, 1.0)
    at = uniaxial_equilibrium(MATERIAL, law, TRACTION)
    known = uniaxial_equilibrium(MATERIAL, gx.EnergyDrivenGrowth(0.05), TRACTION)
    assert at.density == pytest.approx(known.density, rel=1e-9)
    assert gx.homeostasis(bar(law), gx.Q1P0).mean_density() == pytest.approx(known.density, rel=1e-7)


def test_set_points_of_regions_are_obeyed():
    """Two halves under one stress, in a bar without Poisson's effect, each to its own equilibrium."""
    material = gx.Material(2.0, 0.0, 1.2, 0.5)
    law = gx.SpecificEnergyRemodelling({"bone": 0.02, "implant": 0.03}, 20.0, 10.0)
    scene = bar(law, material=material, program=gx.Program(step=10.0, until=200.0), mesh=square(2))
    _, problem = run(scene, gx.Q1P0)
    halves = densities(problem)
    for half, set_point in ((halves[halves[:, 0] < 0.5], 0.02), (halves[halves[:, 0] > 0.5], 0.03)):
        other = gx.SpecificEnergyRemodelling(set_point, 20.0, 10.0)
        expected = uniaxial_equilibrium(material, other, TRACTION).density
        assert half[:, 2] == pytest.approx(expected, rel=1e-6)


# -- well posed or not -------------------------------------------------------------------------------------------------


def test_a_source_that_does_not_fall_is_warned_about(caplog):
    """Energy per mass with n = 2, once, with the state that tells; a factor of the rate changes no judgement."""
    scene = bar(gx.SpecificEnergyRemodelling(0.0213, relative_zone=0.1))
    problem = gx.discretise(scene, gx.Q1P0)
    if COMM.rank == 0:
        assert "the mass source does not fall as the density rises (∂R₀/∂ρ = " in caplog.text
    assert not problem.system.must_be_stable
    for factor in (None, gx.MartinSurface(), gx.PowerOfDensity(3.0)):
        good = gx.EnergyRemodelling(0.02, 4.0, 1.0, factor=factor)
        bad = gx.EnergyRemodelling(0.02, 4.0, 1.0, exponent=1.0, factor=factor)
        assert gx.discretise(bar(good), gx.Q1P0).system.must_be_stable
        assert not gx.discretise(bar(bad), gx.Q1P0).system.must_be_stable


# -- load cases --------------------------------------------------------------------------------------------------------


def two_cases(law):
    """Two activities of unlike strength, on a bent block."""
    cases = (
        gx.LoadCase("walking", 3.0, (gx.Traction("right", (0.1, -0.02)),)),
        gx.LoadCase("stairs", 1.0, (gx.Traction("right", (0.25, 0.03)),)),
    )
    return block(square(2, 0.05), growth=law, loads=(), cases=cases, program=gx.Program(step=0.1, until=0.2))


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1Q1], ids=lambda variant: variant.name)
def test_daily_stress_of_several_activities(variant):
    """Σ nᵢ σᵢ⁴ by the energies of the cases, in each cell; its tangent is that of differences."""
    law = gx.DailyStressRemodelling(0.6, 0.05, 0.05, cycles=8.0, concentration=3.0)
    problem = gx.discretise(two_cases(law), variant)
    assert not problem.system.symmetric
    problem.system.begin_step(0.1, 1.0)
    parts = problem.system.unknowns.parts
    for part in parts:
        problem.system.unknown.x.array[part] = 0.05 * np.sin(np.arange(len(part)) + len(part) * problem.comm.rank)
    for condition in problem.system.conditions:
        problem.system.unknown.x.array[condition.dof_indices()[0]] = 0.0
    if COMM.size == 1:
        assert_tangent_matches_differences(problem, tangent(problem), count=2)


def test_the_mean_of_activities_is_that_of_stresses_to_the_fourth():
    """Two bars' worth of strain: the stimulus of both together, in a homogeneous state."""
    law = gx.DailyStressRemodelling(0.6, 0.05, 0.05, cycles=8.0, concentration=3.0)
    cases = tuple(
        gx.LoadCase(name, weight, (gx.Traction("right", (pull, 0.0)),))
        for name, weight, pull in (("walking", 3.0, 0.2), ("stairs", 1.0, 0.5))
    )
    scene = bar(law, loads=(), cases=cases, program=gx.Program(step=1e-9, until=1e-9))
    _, problem = run(scene, gx.Q1, tolerance=1e-12)
    stresses = [np.sqrt(2 * 2.0 * strains(1.2, pull)) * (1.92 / 1.2) ** 3 for pull in (0.2, 0.5)]
    expected = (6.0 * stresses[0] ** 4 + 2.0 * stresses[1] ** 4) ** 0.25
    points = problem.evaluate(problem.expressions.stimulus(), problem.variant.integration_points("quadrilateral"))
    assert points == pytest.approx(expected, rel=1e-7)


# -- one's own ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Own(gx.GrowthLaw):
    """The ten lines of docs/models.md: a stimulus that more energy than Ψₘ raises no further."""

    most: float = 1.0

    def power(self, material):
        return material.density_exponent - 3

    def drive(self, elastic_energy, material):
        return elastic_energy / (1 + elastic_energy / self.most)


@dataclass(frozen=True)
class OwnRemodelling(gx.Remodelling):
    """The same with two rates and a lazy zone."""

    power, drive = Own.power, Own.drive
    most: float = 1.0


@pytest.mark.parametrize("law", [Own(0.01, 10.0), OwnRemodelling(0.01, 10.0, 4.0)], ids=["growth", "remodelling"])
@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1, gx.Q1Q1], ids=lambda variant: variant.name)
def test_a_law_of_ones_own_converges_quadratically(variant, law):
    """With full tangents the residual is squared, before round-off: nothing of the law is missing in the tangent."""
    scene = block(square(3, 0.05), growth=law, program=gx.Program(step=0.5, until=0.5))
    problem, norms = gx.discretise(scene, variant), []
    with Newton(problem.system, NewtonSettings(tolerance=1e-13, full=True)) as newton:
        newton._snes.setMonitor(lambda snes, iteration, norm: norms.append(norm))
        problem.system.begin_step(scene.program.step, 1.0)
        assert newton.solve().converged
    norms = np.array([norm for norm in norms if norm > 1e-13 * norms[0]])
    orders = np.log(norms[2:] / norms[1:-1]) / np.log(norms[1:-1] / norms[:-2])
    assert orders.max() > 1.7 and norms[-1] < 1e-5 * norms[0]


def test_tangents_near_the_edges_of_the_zone():
    """Stimuli on both sides of both edges in one body."""
    law = gx.EnergyRemodelling(0.004, 40.0, 10.0, relative_zone=0.5, most_formation=3.0, factor=gx.MartinSurface(2.0))
    for variant in (gx.Q1P0, gx.Q1Q1):
        problem = gx.discretise(block(square(3, 0.05), growth=law), variant)
        problem.system.begin_step(0.1, 1.0)
        set_iterate(
            problem,
            lambda x: np.stack([0.1 * x[0] ** 2 + 0.03 * x[1] ** 2, -0.05 * x[0] * x[1]]),
            lambda x: 1.2 + 0.1 * x[0] - 0.05 * x[1],
        )
        assert_tangent_matches_differences(problem, tangent(problem), count=2)


# -- bad input ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: gx.EnergyRemodelling(0.0), r"the set point S\* is 0: a positive number would be right"),
        (lambda: gx.EnergyRemodelling("high"), r"the set point S\* is 'high': a positive number would be right"),
        (lambda: gx.EnergyRemodelling({"bone": -1.0}), r"the set point S\* of 'bone' is -1: a positive number"),
        (lambda: gx.EnergyRemodelling(1.0, -1.0), "the rate of formation is -1: a number of at least 0"),
        (lambda: gx.EnergyRemodelling(1.0, 1.0, None), "the rate of resorption is None: a number of at least 0"),
        (lambda: gx.EnergyRemodelling(1.0, lazy_zone=-0.1), "the lazy zone's half-width is -0.1: a number of at least"),
        (lambda: gx.EnergyRemodelling(1.0, relative_zone=1.5), "as a share of the set point is 1.5: a number of at le"),
        (lambda: gx.EnergyRemodelling(1.0, rounding=0.0), r"the rounding of the lazy zone is 0: a share in \(0, 1\)"),
        (lambda: gx.EnergyRemodelling(1.0, most_formation=0.0), "the most formation is 0: a positive number or None"),
        (lambda: gx.EnergyRemodelling(1.0, factor=2.0), "from the density is 2.0: a MartinSurface, a PowerOfDensity"),
        (lambda: gx.EnergyRemodelling(1.0, exponent="3"), "the exponent m is '3': a number of at least 0"),
        (lambda: gx.DailyStressRemodelling(1.0, cycles=0), "the number of cycles per day is 0: a positive number"),
        (
            lambda: gx.DailyStressRemodelling(1.0, exponent=0.5),
            "the exponent m of the daily stress is 0.5: a number of",
        ),
        (lambda: gx.DailyStressRemodelling(1.0, concentration=-1.0), "the tissue's stress is -1: a number of at least"),
        (lambda: gx.MartinSurface(-1.0), "the density of tissue ρₜ is -1: a positive number would be right"),
        (lambda: gx.PowerOfDensity("two"), "the exponent q of the rate is 'two': a finite number would be right"),
    ],
)
def test_bad_input_is_one_sentence(make, sentence):
    """With the value and what would be right."""
    with pytest.raises(InputError, match=sentence) as caught:
        make()
    assert "\n" not in str(caught.value)


# -- memory ------------------------------------------------------------------------------------------------------------

ACCOMMODATING = gx.EnergyRemodelling(0.02, 4.0, 1.0, relative_zone=0.05, memory=0.5)


def with_memory(law, steps):
    """Density and set point of the bar, as numbers: a step of each, one after the other."""
    rho, used_to = MATERIAL.reference_density, law.set_point
    for _ in range(steps):
        frozen = replace(law, set_point=used_to)
        start = rho
        rho = root(
            lambda x, start=start, frozen=frozen: x - start - STEP * frozen.mass_source(x[0], strains(x[0]), MATERIAL),
            [start],
            tol=1e-13,
        ).x[0]
        stimulus = law.stimulus(rho, strains(rho), MATERIAL)
        used_to = (law.memory * used_to + STEP * stimulus) / (law.memory + STEP)
    return rho, used_to


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1, gx.Q1sri, gx.Q1Q1], ids=lambda variant: variant.name)
def test_cells_become_used_to_what_they_bear(variant):
    """Less is formed than without a memory, by a recursion of numbers; each variant remembers."""
    rho, used_to = with_memory(ACCOMMODATING, 3)
    assert rho < recursion(replace(ACCOMMODATING, memory=None)) - 1e-3
    steps, problem = run(bar(ACCOMMODATING), variant, tolerance=1e-12)
    assert (steps[-1].min_density, steps[-1].max_density) == pytest.approx((rho, rho), rel=1e-7)
    assert problem.state.past.x.array[problem.growing_dofs] == pytest.approx(used_to, rel=1e-6)
    assert steps[-1].mass_defect < 1e-10
    gx.wellposedness.check(problem)


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1Q1], ids=lambda variant: variant.name)
def test_a_memory_is_in_checkpoints(variant, shared_folder):
    """A run that goes on from one is that without a break, to the bit; another memory is another run."""
    law = replace(ACCOMMODATING, set_point=lambda x: 0.02 + 0.005 * x[0])
    scene = block(square(2, 0.05), growth=law)
    folder = shared_folder / variant.name
    whole = gx.solve(scene, variant, out=folder, checkpoint=2)
    saved = sorted(folder.glob("checkpoint-*.npz"))[0]
    again = gx.solve(scene, variant, resume=saved)
    assert densities(again.problem) == pytest.approx(densities(whole.problem), rel=1e-14)
    assert again.problem.state.past.x.array == pytest.approx(whole.problem.state.past.x.array, rel=1e-14)
    with pytest.raises(InputError, match="of another run"):
        gx.solve(replace(scene, growth=replace(law, memory=1.0)), variant, resume=saved)


def test_what_knows_no_memory_refuses_it():
    """One sentence each, with what would be right."""
    with pytest.raises(InputError, match="has a memory, which an update after equilibrium does not know"):
        list(baselines.update(bar(ACCOMMODATING), gx.Q1P0))
    with pytest.raises(InputError, match="has a memory, and its equilibrium depends on the way there"):
        gx.homeostasis(bar(ACCOMMODATING), gx.Q1P0)
    with pytest.raises(InputError, match="has a memory, and its equilibrium depends on the way there"):
        uniaxial_equilibrium(MATERIAL, ACCOMMODATING, TRACTION)
    with pytest.raises(InputError, match="over which a remembered stimulus has no mean"):
        gx.discretise(block(square(2, shape="triangle"), growth=ACCOMMODATING), gx.P2P2)
    with pytest.raises(InputError, match="the time of the memory is 0: a positive number or None would be right"):
        replace(ACCOMMODATING, memory=0.0)
