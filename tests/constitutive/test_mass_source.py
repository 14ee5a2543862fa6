"""A mass source of one's own is one function: every variant, check, output and baseline obeys it."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from blocks import (
    assert_tangent_matches_differences,
    block,
    densities,
    mass_residual,
    run,
    set_iterate,
    square,
    tangent,
)
from scipy.optimize import brentq, root

import growthx as gx
from growthx import baselines, results
from growthx.common.errors import InputError
from growthx.constitutive.functions import sqrt
from growthx.constitutive.homogeneous import uniaxial_equilibrium
from growthx.constitutive.kinematics import principal_changes
from growthx.constitutive.local.balance import solve_density
from growthx.constitutive.local.source import LocalSource
from growthx.solvers.newton import Newton
from growthx.solvers.settings import NewtonSettings

QUADRILATERAL = [gx.Q1Q1, gx.Q2Q2, gx.S2Q1, gx.Q1P0, gx.Q1, gx.Q2, gx.Q1sri, gx.S2fri]
each_variant = pytest.mark.parametrize("variant", QUADRILATERAL, ids=lambda variant: variant.name)


@dataclass(frozen=True)
class TwoRates(gx.MassSource):
    """Bone is gained at one rate, up to a most, and lost at another: by the excess x of the stimulus."""

    set_point: Any = 0.05
    gain: Any = 4.0
    loss: Any = 1.0
    most: float = 0.3

    coefficients = ("set_point", "gain", "loss")

    def mass_source(self, density, elastic_energy, material):
        """Gain x₊/[1 + x₊/most] − loss x₋, rounded at x = 0."""
        x = elastic_energy * material.reference_density / density - self.set_point
        size = sqrt(x**2 + 1e-4 * self.set_point**2)
        up, down = (size + x) / 2, (size - x) / 2
        return self.gain * up / (1 + up / self.most) - self.loss * down


N, YOUNG, POISSON, REFERENCE, TRACTION, STEP = 2.0, 3.0, 0.3, 1.2, 0.9, 0.25
LAM, MU = YOUNG * POISSON / ((1 + POISSON) * (1 - 2 * POISSON)), YOUNG / (2 * (1 + POISSON))
MATERIAL = gx.Material(YOUNG, POISSON, REFERENCE, N)
LAW = TwoRates()


def source(rho, energy, law=LAW):
    """The same by NumPy alone."""
    x = energy * REFERENCE / rho - law.set_point
    size = np.hypot(x, 1e-2 * law.set_point)
    up, down = (size + x) / 2, (size - x) / 2
    return law.gain * up / (1 + up / law.most) - law.loss * down


def energy_and_stresses(a, b):
    """Of the paper's energy in plane strain, without the weight."""
    log_J = np.log(a * b)
    energy = LAM / 2 * log_J**2 + MU / 2 * (a**2 + b**2 - 2 - 2 * log_J)
    return energy, MU * a + (LAM * log_J - MU) / a, MU * b + (LAM * log_J - MU) / b


def bar(law=LAW, cells=2, **changes):
    """Pulled on rollers: a homogeneous state, of few numbers."""
    scene = block(
        square(cells, 0.05),
        material=MATERIAL,
        growth=law,
        supports=(gx.Support("left", (0.0, None)), gx.Support("bottom", (None, 0.0))),
        loads=(gx.Traction("right", (TRACTION, 0.0)),),
        program=gx.Program(step=STEP, until=3 * STEP),
    )
    return replace(scene, **changes)


def recursion(steps=3, law=LAW):
    """Densities of the bar by implicit Euler, by NumPy and a root finder alone."""

    def balances(state, old):
        a, b, rho = state
        energy, along, across = energy_and_stresses(a, b)
        weight = (rho / REFERENCE) ** N
        return [weight * along - TRACTION, weight * across, rho - old - STEP * source(rho, energy, law)]

    state, found = np.array([1.2, 0.9, REFERENCE]), []
    for _ in range(steps):
        solution = root(balances, state, args=(state[2],), tol=1e-14)
        assert np.abs(solution.fun).max() < 1e-12
        state = solution.x
        found.append(float(state[2]))
    return found


# -- variants ----------------------------------------------------------------------------------------------------------


@each_variant
def test_every_variant_obeys_a_source_of_ones_own(variant):
    """Node-based, at points and per cell agree on a homogeneous bar, with a few numbers of NumPy."""
    expected = recursion()
    assert np.ptp(expected) > 0.03
    steps, _ = run(bar(), variant, tolerance=1e-13)
    for step, rho in zip(steps, expected, strict=True):
        assert (step.min_density, step.max_density) == pytest.approx((rho, rho), rel=1e-9)
        assert step.mass_defect < 1e-12


@each_variant
def test_tangents_are_consistent(variant):
    """Condensed and monolithic, in a state with gain here and loss there."""
    problem = gx.discretise(block(square(2, 0.05), growth=TwoRates(0.002)), variant)
    problem.system.begin_step(0.1, 1.0)
    set_iterate(
        problem,
        lambda x: np.stack([0.1 * x[0] ** 2 + 0.03 * x[1] ** 2, -0.05 * x[0] * x[1]]),
        lambda x: 1.2 + 0.1 * x[0] - 0.05 * x[1],
    )
    rates = results.cell_fields(problem)["mass_source"]
    assert rates.size == 0 or np.isfinite(rates).all()
    assert_tangent_matches_differences(problem, tangent(problem), count=2)


@each_variant
def test_newton_converges_quadratically(variant):
    """With full tangents: the last steps square the residual, before round-off."""
    scene = block(square(3, 0.05), growth=TwoRates(0.01), program=gx.Program(step=0.5, until=0.5))
    problem, norms = gx.discretise(scene, variant), []
    with Newton(problem.system, NewtonSettings(tolerance=1e-13, full=True)) as newton:
        newton._snes.setMonitor(lambda snes, iteration, norm: norms.append(norm))
        problem.system.begin_step(scene.program.step, 1.0)
        assert newton.solve().converged
    norms = np.array([norm for norm in norms if norm > 1e-13 * norms[0]])
    orders = np.log(norms[2:] / norms[1:-1]) / np.log(norms[1:-1] / norms[:-2])
    assert orders.max() > 1.7 and norms[-1] < 1e-5 * norms[0]


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1sri, gx.Q1], ids=lambda variant: variant.name)
def test_parameters_that_vary(variant):
    """The balance of mass of each density, as a weak form has it, where set points and rates vary."""
    law = TwoRates(lambda x: 0.004 + 0.01 * x[0] * x[1], gain={"bone": 40.0, "implant": 60.0}, loss=10.0)
    steps, problem = run(block(square(2), growth=law), variant, tolerance=1e-12)
    assert steps[-1].mass_defect < 1e-11
    density = densities(problem)[:, 2]
    assert density.min() < 0.995 * density.max()
    assert np.abs(mass_residual(problem)).max(initial=0.0) < 1e-12


class Proportional(gx.MassSource):
    """Of a form that growthx has, too: 4 {[ρ/ρ*]^(−1) Ψ₀ⁿᵉᵒ − 0.02}."""

    linear = True

    def mass_source(self, density, elastic_energy, material):
        """At n = 2, m = 3."""
        return 4.0 * (elastic_energy * material.reference_density / density - 0.02)


@pytest.mark.parametrize("variant", [*QUADRILATERAL, gx.P1P0, gx.P2P1], ids=lambda variant: variant.name)
def test_a_known_law_by_one_function(variant):
    """Bent, in steps of both schemes: closed forms and the way along samples must find the same."""
    mesh = square(2, 0.05, shape=variant.cells[0])
    laws = Proportional(), gx.EnergyDrivenGrowth(0.02, 4.0)
    one, other = (run(block(mesh, growth=law), variant, tolerance=1e-12)[1] for law in laws)
    assert densities(one) == pytest.approx(densities(other), rel=1e-9)
    assert one.system.symmetric == other.system.symmetric
    assert one.measures.resorption() == pytest.approx(other.measures.resorption(), rel=1e-12)
    assert one.system.densities.unloaded_resorption() == pytest.approx(
        other.system.densities.unloaded_resorption(), rel=1e-12
    )


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1Q1], ids=lambda variant: variant.name)
def test_other_steps(variant):
    """Two stages, with the second's base, and steps of their own length."""
    law, known = Proportional(), gx.EnergyDrivenGrowth(0.02, 4.0)
    stepping = gx.AdaptiveSteps(tolerance=1e-3)
    one, other = (
        run(block(square(2, 0.05), growth=each), variant, tolerance=1e-12, stepping=stepping)[1]
        for each in (law, known)
    )
    assert densities(one) == pytest.approx(densities(other), rel=1e-8)


def test_bounds():
    """What reaches a bound stays there, exactly."""
    for variant in (gx.Q1P0, gx.Q1, gx.Q1Q1):
        steps, _ = run(bar(TwoRates(bounds=(0.5, 1.22))), variant)
        assert steps[-1].max_density == 1.22 and steps[-1].min_density == 1.22
        assert steps[-1].mass_defect < 1e-10


# -- what is computed beside -------------------------------------------------------------------------------------------


def test_homogeneous_equilibrium():
    """Against a root finder on NumPy's formulas, and the end of a direct solution by two kinds of variants."""
    at = uniaxial_equilibrium(MATERIAL, LAW, TRACTION)

    def balances(state):
        a, b, rho = state
        energy, along, across = energy_and_stresses(a, b)
        return [(rho / REFERENCE) ** N * along - TRACTION, across, source(rho, energy)]

    solution = root(balances, [1.2, 0.9, 1.2], tol=1e-14)
    assert np.abs(solution.fun).max() < 1e-12
    assert [at.stretch, at.transverse_stretch, at.density] == pytest.approx(solution.x, rel=1e-9)
    for variant in (gx.Q1P0, gx.Q1Q1):
        problem = gx.homeostasis(bar(), variant)
        assert problem.mean_density() == pytest.approx(at.density, rel=1e-8)


def test_no_homogeneous_equilibrium_is_said():
    """Of a source that rises, and of one that is never zero."""

    class Rising(Proportional):
        def mass_source(self, density, elastic_energy, material):
            return density - 1.0

    class Endless(Proportional):
        def mass_source(self, density, elastic_energy, material):
            return 1.0 + 0 * density

    with pytest.raises(InputError, match="Rising rises with the density"):
        uniaxial_equilibrium(MATERIAL, Rising(), TRACTION)
    with pytest.raises(InputError, match="Endless is zero at no density of a bar"):
        uniaxial_equilibrium(MATERIAL, Endless(), TRACTION)


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1Q1, gx.Q1], ids=lambda variant: variant.name)
def test_wellposedness(variant):
    """The margin 1 − Δt ∂R₀/∂ρ by the law's own slope, and what samples say beforehand."""
    problem = gx.discretise(bar(), variant)
    problem = gx.homeostasis(bar(), variant)
    problem.state.time_step.value = STEP
    at = uniaxial_equilibrium(MATERIAL, LAW, TRACTION)
    energy = MATERIAL.elastic_energy(*principal_changes((at.extension, at.transverse_extension, 0.0)))
    step = 1e-6
    slope = (source(at.density + step, energy) - source(at.density - step, energy)) / (2 * step)
    found = gx.wellposedness.check(problem)
    assert found.margin == pytest.approx(1 - STEP * slope, rel=1e-6)
    assert found.exponents and found.holds and str(found).startswith("well posed")


def test_a_source_that_rises_is_said_to_be_ill_posed(caplog):
    """Once, with the state that tells."""

    class Rising(gx.MassSource):
        def mass_source(self, density, elastic_energy, material):
            return 0.1 * (density / material.reference_density * elastic_energy - 0.02)

    scene = bar(Rising())
    problem = gx.discretise(scene, gx.Q1P0)
    assert not problem.system.must_be_stable
    if scene.mesh.comm.rank == 0:
        assert "the mass source does not fall as the density rises (∂R₀/∂ρ = " in caplog.text
    assert str(gx.wellposedness.check(problem)).startswith("not well posed (the mass source does not fall")


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1, gx.Q1Q1], ids=lambda variant: variant.name)
def test_baselines(variant):
    """Explicit Euler after equilibrium, in NumPy."""
    steps = list(baselines.update(bar(), variant, tolerance=1e-13))
    rho = REFERENCE
    for step in steps:
        a, b = root(lambda s, rho=rho: forces(s, rho), [1.2, 0.9], tol=1e-14).x
        rho += STEP * source(rho, energy_and_stresses(a, b)[0])
        assert (step.min_density, step.max_density) == pytest.approx((rho, rho), rel=1e-9)
        assert step.mass_defect < 1e-12


def forces(stretches, rho):
    """The stresses of the bar less the load."""
    _, along, across = energy_and_stresses(*stretches)
    weight = (rho / REFERENCE) ** N
    return [weight * along - TRACTION, weight * across]


def test_a_problem_that_grows_is_none_for_baselines():
    """Of a law of one's own, too."""
    with pytest.raises(InputError, match="the problem to be updated grows by itself"):
        list(baselines.update(bar(), gx.Q1P0, gx.discretise(bar(), gx.Q1P0)))


def test_a_changed_source_is_another_run(shared_folder):
    """Of the same name and parameters."""

    def mine(factor):
        def mass_source(self, density, elastic_energy, material):
            return factor * TwoRates.mass_source(self, density, elastic_energy, material)

        return type("Mine", (TwoRates,), {"mass_source": mass_source})()

    scene = bar(mine(1.0))
    gx.solve(scene, gx.Q1P0, out=shared_folder / "first", checkpoint=1)
    assert gx.solve(replace(scene, growth=mine(1.0)), gx.Q1P0, resume=shared_folder / "first").converged
    with pytest.raises(InputError, match=r"the mass source of Mine at sample states is .* somewhere, here"):
        gx.solve(replace(scene, growth=mine(1.1)), gx.Q1P0, resume=shared_folder / "first")


def test_outputs_without_a_stimulus(shared_folder):
    """A source of any form has none: the other fields are there."""
    for variant in (gx.Q1, gx.Q1P0):
        result = gx.solve(bar(), variant, out=shared_folder / variant.name)
        means = results.cell_fields(result.problem)
        assert "stimulus" not in means and {"density", "mass_source", "major_stress"} <= means.keys()
        with pytest.raises(InputError, match=r"^TwoRates is stated without a stimulus"):
            result.problem.expressions.stimulus()


# -- the density at one point ------------------------------------------------------------------------------------------


def local(law, old, energy, time_step, guess=None):
    """Densities a step later."""
    old, energy = np.asarray(old, dtype=float), np.asarray(energy, dtype=float)
    return solve_density(LocalSource(law, MATERIAL, energy), old, time_step, old if guess is None else guess)


@pytest.mark.parametrize("time_step", [1e-3, 0.1, 1.0, 10.0, 1e3, 1e9])
@pytest.mark.parametrize("guess", [None, 1e-6, 1e6])
def test_the_only_root_is_found(time_step, guess):
    """Of a source that falls there is one, found at any step and from anywhere."""
    random = np.random.default_rng(3)
    old, energy = 10 ** random.uniform(-1, 1, 300), 10 ** random.uniform(-4, 1, 300)
    rho = local(LAW, old, energy, time_step, None if guess is None else np.full(300, guess))
    for found, start, psi in zip(rho, old, energy, strict=True):

        def residual(logarithm, start=start, psi=psi):
            return np.exp(logarithm) - start - time_step * source(np.exp(logarithm), psi)

        ends = np.log(1e-9 * start), np.log(1e9)
        if residual(ends[0]) < 0:
            assert found == pytest.approx(np.exp(brentq(residual, *ends, xtol=1e-15)), rel=1e-9)
        else:
            assert np.isnan(found) or found < 1e-8 * start


@dataclass(frozen=True)
class Cubic(gx.MassSource):
    """R₀ = −s (ρ − 1)(ρ − 2)(ρ − 3): roots that appear and vanish as the step grows."""

    scale: float = 1.0

    def mass_source(self, density, elastic_energy, material):
        """Whatever the energy."""
        return -self.scale * (density - 1) * (density - 2) * (density - 3) + 0 * elastic_energy


@pytest.mark.parametrize("time_step", [0.05, 0.3, 0.9, 2.0, 50.0])
def test_the_root_continues_the_old_density(time_step):
    """It grows out of ρₙ with the step, whatever the guess: NaN where the way ends."""
    old = np.array([0.3, 0.9, 1.5, 1.9, 2.0, 2.1, 2.6, 3.0, 3.5, 8.0])
    expected = [continued(float(start), time_step) for start in old]
    for guess in (0.5, 1.0, 2.0, 3.0, 5.0):
        rho = local(Cubic(), old, np.ones(len(old)), time_step, np.full(len(old), guess))
        assert rho == pytest.approx(expected, rel=1e-9, nan_ok=True)


def continued(start, time_step):
    """The same by tiny steps of the way and a root finder between, without slopes."""
    rate = -(start - 1) * (start - 2) * (start - 3)
    if rate == 0:
        slope = -((start - 2) * (start - 3) + (start - 1) * (start - 3) + (start - 1) * (start - 2))
        return start if time_step * slope < 1 else np.nan
    grid = start + np.sign(rate) * np.linspace(0, 8, 800001)[1:]
    grid = grid[grid > 0]
    rates = -(grid - 1) * (grid - 2) * (grid - 3)
    with np.errstate(divide="ignore"):
        passed = np.where(np.sign(rates) == np.sign(rate), (grid - start) / rates, np.inf)
    reached = int(np.argmax(passed >= time_step))
    if passed[reached] < time_step or np.any(np.diff(passed[: reached + 1]) <= 0):
        return np.nan

    def residual(x):
        return x - start + time_step * (x - 1) * (x - 2) * (x - 3)

    before = start if reached == 0 else grid[reached - 1]
    return brentq(residual, *sorted((before, grid[reached])), xtol=1e-15)


def test_energies_of_inverted_cells():
    """Not a number, nor the lowest bound."""
    rho = local(TwoRates(bounds=(0.5, 2.0)), [1.0, 1.0, 1.0], [np.nan, 0.1, -1e-18], 0.1)
    assert np.isnan(rho).tolist() == [True, False, False]


# -- what is refused ---------------------------------------------------------------------------------------------------


def toy(mass_source, **parts):
    """A class by its source."""
    return type("Mine", (gx.MassSource,), {"mass_source": mass_source, **parts})()


def undecided(self, density, energy, material):
    """Another one for arrays than in UFL."""
    return (energy - 0.02) * (2 if isinstance(density, np.ndarray) else 1) / density


def fine(self, density, energy, material):
    """As it should be."""
    return 4.0 * (energy / density - 0.02)


NONSENSE = [
    (
        lambda self, density, energy, material: np.maximum(energy, 0.1) / density,
        {},
        "the mass source of Mine fails in UFL",
    ),
    (lambda self, density, energy: energy, {}, "the mass source of Mine fails for arrays, TypeError"),
    (
        lambda self, density, energy, material: None,
        {},
        r"the mass source of Mine gives array\(None, dtype=object\) for 20",
    ),
    (
        lambda self, density, energy, material: sqrt(energy) - density,
        {},
        "the mass source of Mine has no finite slope at",
    ),
    (lambda self, density, energy, material: np.nan * density, {}, "the mass source of Mine is nan at a density of"),
    (lambda self, density, energy, material: energy.sum() - density, {}, "the mass source of Mine "),
    (lambda self, density, energy, material: abs(density - 1.0), {}, "the slope of the mass source of Mine is"),
    (undecided, {}, "the mass source of Mine is .* in an array and .* in UFL: the same"),
    (
        fine,
        {"mass_source_slope": lambda self, density, energy, material: -energy / density},
        "the slope of the mass source",
    ),
    (fine, {"resting_rate": lambda self, material: -1.0}, "the resting rate of Mine is -1.0: a number of at least 0"),
    (fine, {"linear": 1}, "linear, of Mine, is 1: True or False would be right"),
    (
        lambda self, density, energy, material: energy**2 - density,
        {"linear": True},
        "the mass source of Mine is said to be",
    ),
]


@pytest.mark.parametrize(("mass_source", "parts", "sentence"), NONSENSE)
def test_a_source_that_cannot_be_used_is_refused(mass_source, parts, sentence):
    """On all ranks, before time is spent, and by the names of class and method."""
    with pytest.raises(InputError, match=f"^{sentence}"):
        bar(toy(mass_source, **parts))


def test_a_slope_and_a_resting_rate_of_ones_own_are_obeyed():
    """Where they are the law's."""
    calls = []

    def slope(self, density, energy, material):
        calls.append(type(density))
        return -4.0 * energy / density**2

    law = toy(fine, mass_source_slope=slope, resting_rate=lambda self, material: 0.5)
    scene = bar(law)
    calls.clear()
    steps, problem = run(scene, gx.Q1)
    assert np.ndarray in calls and steps[-1].newton.converged
    for variant in (gx.Q1, gx.Q1Q1):
        problem = gx.discretise(scene, variant)
        assert (
            problem.measures.resorption()
            == pytest.approx(0.5)
            == pytest.approx(problem.system.densities.unloaded_resorption())
        )


def test_what_is_linear_was_another_source():
    """A source that replaces a linear one is not taken for linear."""

    class Squared(Proportional):
        def mass_source(self, density, elastic_energy, material):
            return elastic_energy**2 - 0.01 * density

    assert Proportional.linear and not Squared.linear and not TwoRates.linear


def test_a_law_of_a_stimulus_keeps_its_form():
    """Its source has closed forms: another function would be used here and not there."""
    with pytest.raises(
        InputError, match=r"^the class Mine replaces mass_source of .*: to replace any of coefficients, drive"
    ):
        type("Mine", (gx.EnergyDrivenGrowth,), {"mass_source": fine})
    with pytest.raises(InputError, match=r"^the class Mine replaces mass_source_and_slope of MassSource"):
        toy(fine, mass_source_and_slope=fine)
    with pytest.raises(InputError, match=r"a GrowthLaw or a MassSource of one's own would be right"):
        block(square(1), growth=1.0)
