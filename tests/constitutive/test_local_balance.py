"""The balance of mass at one point: the physical root where there is one, NaN where there is none, never another."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from growthx.constitutive.growth import (
    EnergyDrivenGrowth,
    SpecificEnergyDrivenGrowth,
    StrainDrivenGrowth,
    StressDrivenGrowth,
)
from growthx.constitutive.local import balance
from growthx.constitutive.local.balance import ROUND_OFF, solve_density
from growthx.constitutive.local.power import PowerBalance
from growthx.constitutive.local.source import LocalSource
from growthx.constitutive.material import Material

TIME_STEPS = (1e-3, 0.1, 1.0, 10.0, 1e3, 1e6)


def laws(n, m):
    """A growth law and a material with no parameter equal to one."""
    return EnergyDrivenGrowth(0.7, 1.4, m), Material(2.0, 0.3, 1.3, n)


def states(count, seed=0):
    """Old densities and energies over some decades, shape (count,) each."""
    random = np.random.default_rng(seed)
    return 10 ** random.uniform(-1, 1, count), 10 ** random.uniform(-4, 2, count)


def solve(n, m, old, energy, time_step, guess=None):
    """The densities that the module finds, from the old densities if no guess is given."""
    growth, material = laws(n, m)
    return solve_density(LocalSource(growth, material, energy), old, time_step, old if guess is None else guess)


def residual(n, m, rho, old, energy, time_step):
    """r(ρ) and the size of its largest term, to which round-off is relative."""
    growth, material = laws(n, m)
    stimulus = growth.stimulus(rho, energy, material)
    terms = (rho, old, time_step * 1.4 * stimulus, time_step * 1.4 * 0.7 + 0 * rho)
    return terms[0] - terms[1] - terms[2] + terms[3], np.max(terms, axis=0)


def continued(rate, old, time_step):
    """Where the roots are that grow out of ρₙ as Δt grows from 0, found without any Newton iteration.

    On its way from ρₙ the root passes each density ρ at the step Δt(ρ) = (ρ − ρₙ)/R₀(ρ), for as long as that rises, and
    passes none after it has become infinite, in equilibrium.  Here that is looked at on a fine grid, for all at once.
    rate: R₀ of an array of shape (densities, grid).
    Returns the densities of the grid before and after the root, or NaN where there is none, and where that is sure: not
    for roots so near the end of the way that the grid cannot tell, or beyond the grid.
    """
    direction = np.sign(rate(old[:, np.newaxis]))
    away = np.concatenate([[0], np.geomspace(1e-9, 80, 4000)])
    change = old[:, np.newaxis] * np.expm1(direction * np.where(direction > 0, away, np.minimum(away, 33.9)))
    path = old[:, np.newaxis] + change
    with np.errstate(all="ignore"):
        source = rate(path)
        lengths = np.where(source * direction > 0, change / source, np.inf)
    lengths[:, 0] = 0
    falls = lengths[:, 1:] < lengths[:, :-1]
    on_the_way = np.arange(path.shape[1]) <= np.where(falls.any(axis=1), falls.argmax(axis=1), path.shape[1])[:, None]
    early, there, late = (((lengths >= share * time_step) & on_the_way).any(axis=1) for share in (0.99, 1.0, 1.01))
    sure = (early == late) & (there | falls.any(axis=1) | (direction[:, 0] < 0))
    after = ((lengths >= time_step) & on_the_way).argmax(axis=1)
    ends = [np.take_along_axis(path, each[:, np.newaxis], 1)[:, 0] for each in (np.maximum(after - 1, 0), after)]
    return np.where(there, np.minimum(*ends), np.nan), np.where(there, np.maximum(*ends), np.nan), sure


def assert_continued(rho, rate, old, time_step):
    """Densities must be those of `continued`, and NaN where there is none."""
    low, high, sure = continued(rate, old, time_step)
    assert sure.mean() > 0.9
    assert np.array_equal(np.isnan(rho[sure]), np.isnan(low[sure]))
    found = sure & np.isfinite(rho)
    assert (rho[found] >= low[found] * (1 - 1e-12)).all() and (rho[found] <= high[found] * (1 + 1e-12)).all()


@pytest.mark.parametrize("time_step", TIME_STEPS)
@pytest.mark.parametrize(("n", "m"), [(1, 2), (2, 3), (3.5, 4.5)])
def test_closed_form(n, m, time_step):
    """For n − m = −1, ρ² − [ρₙ − Δt c Ψ₀*] ρ − Δt c Ψ₀ⁿᵉᵒ ρ* = 0: the paper's case needs no iteration to be checked."""
    old, energy = states(500)
    half = (old - time_step * 1.4 * 0.7) / 2
    product = time_step * 1.4 * energy * 1.3
    root = np.sqrt(half**2 + product)
    expected = np.where(half > 0, half + root, product / (root - half))  # without cancellation
    assert np.allclose(solve(n, m, old, energy, time_step), expected, rtol=1e-12, atol=0)


@pytest.mark.parametrize("time_step", TIME_STEPS)
@pytest.mark.parametrize("of_each", [None, 4])
@pytest.mark.parametrize(
    "growth",
    [EnergyDrivenGrowth(0.7, 1.4, 3.0), EnergyDrivenGrowth(0.7, 1.4, 3.0, bounds=(0.5, 2.0)), StrainDrivenGrowth(0.7)],
    ids=["energy", "energy, bounds", "strain"],
)
def test_the_closed_form_finds_what_the_iteration_finds(monkeypatch, growth, of_each, time_step):
    """Two ways to one root, for any law in ρ⁻¹: also for means of a law that is not linear, and at bounds."""
    material = Material(2.0, 0.3, 1.3, 2.0)
    old, energy = states(200)
    weights = None
    if of_each is not None:
        energy, weights = energy[:, np.newaxis] * [0.1, 0.5, 1.0, 2.0], np.tile([0.4, 0.3, 0.2, 0.1], (200, 1))
    source = LocalSource(growth, material, energy, weights)
    assert source.power == -1
    found = solve_density(source, old, time_step, old)
    monkeypatch.setattr(PowerBalance, "root", PowerBalance.iterated_root)
    assert np.allclose(found, solve_density(source, old, time_step, old), rtol=1e-11, atol=0, equal_nan=True)


@pytest.mark.parametrize("energy", [np.nan, np.inf, -1.0])
@pytest.mark.parametrize("time_step", [0.1, 10.0])
def test_no_density_follows_from_an_energy_that_is_none(energy, time_step):
    """An inverted cell has no energy: its density must not look like one, and no other may suffer."""
    old, energies = np.array([0.5, 0.5]), np.array([energy, 0.8])
    found = solve(2, 3, old, energies, time_step)
    assert np.isnan(found).tolist() == [True, False]


@pytest.mark.parametrize("time_step", TIME_STEPS)
@pytest.mark.parametrize("m", [0, 1, 2, 3, 4])
@pytest.mark.parametrize("n", [1, 2, 3.5])
def test_what_is_found_balances(n, m, time_step):
    """Whatever is returned must solve the balance to round-off: the consistent tangent assumes nothing less."""
    old, energy = states(500)
    rho = solve(n, m, old, energy, time_step)
    found = np.isfinite(rho)
    assert (found.any() or m < n) and (rho[found] > 0).all()
    r, size = residual(n, m, rho[found], old[found], energy[found], time_step)
    growth, material = laws(n, m)
    slope = 1 - time_step * growth.mass_source_slope(rho[found], energy[found], material)
    # Near a double root (m < n) the residual says little: the error of ρ is r/slope.
    assert np.all((np.abs(r) <= 1e-13 * size) | (np.abs(r / slope) <= 1e-13 * rho[found]))


@pytest.mark.parametrize("n", [1, 2, 3.5])
@pytest.mark.parametrize("excess", [0.05, 1.0])
def test_a_root_is_always_found_for_m_above_n(n, excess):
    """r rises from −∞ to ∞ there: a NaN would cut a step that has a solution, at the worst for ever."""
    old, energy = states(500)
    for time_step in TIME_STEPS:
        rho = solve(n, n + excess, old, energy, time_step)
        r_low = residual(n, n + excess, 1e-14 * old, old, energy, time_step)[0]
        assert np.isfinite(rho[r_low < 0]).all()  # roots that round-off of ρₙ does not hide


@pytest.mark.parametrize("time_step", TIME_STEPS)
@pytest.mark.parametrize(("n", "m"), [(1, 0), (1, 0.5), (2, 0), (2, 1), (2, 1.5), (3.5, 0), (3.5, 2), (3.5, 3)])
def test_only_the_root_continuous_with_the_old_density_counts_for_m_below_n(n, m, time_step):
    """For m < n there are two roots or none, and the one where r rises may lie beyond equilibrium, out of reach."""
    old, energy = states(200, seed=1)
    growth, material = laws(n, m)
    rho = solve(n, m, old, energy, time_step)
    assert_continued(rho, lambda path: growth.mass_source(path, energy[:, np.newaxis], material), old, time_step)


def test_a_spurious_root_beyond_equilibrium_is_refused():
    """ρ − 1 − 100 [½ √ρ − 1] = 0 has the roots 4.3 and 2297, though bone of density 1 < 4 can only be resorbed."""
    growth, material = EnergyDrivenGrowth(1.0, 1.0, 1.5), Material(1.0)
    for guess in (0.1, 1.0, 4.3, 2300.0):
        root = solve_density(LocalSource(growth, material, np.array([0.5])), np.array([1.0]), 100.0, np.array([guess]))
        assert np.isnan(root).all()


def test_a_guess_on_the_wrong_root_is_left():
    """ρ − 1 − Δt [ρ² − ½] = 0 has two roots for small Δt: an iterate on the upper one, where r falls, must not stay."""
    growth, material, time_step = EnergyDrivenGrowth(0.5, 1.0, 1.0), Material(1.0, density_exponent=3.0), 0.2
    lower, upper = np.sort(np.roots([-time_step, 1.0, time_step * 0.5 - 1.0]))
    for guess in (upper, upper * (1 - 1e-12), upper * 1.5):
        root = solve_density(
            LocalSource(growth, material, np.array([1.0])), np.array([1.0]), time_step, np.array([guess])
        )
        assert root[0] == pytest.approx(lower, rel=1e-13)


@pytest.mark.parametrize("m", [0, 1, 3, 4])
def test_unloaded_bone_vanishes_in_finite_time(m):
    """With Ψ₀ⁿᵉᵒ = 0 and c Ψ₀* Δt ≥ ρₙ no positive density exists, whatever m: that answer rejects the step."""
    old = np.array([0.5, 0.979, 0.98, 0.981, 2.0])  # c Ψ₀* Δt = 0.98
    rho = solve(2, m, old, np.zeros(5), 1.0)
    assert np.isnan(rho).tolist() == [True, True, True, False, False]
    assert np.allclose(rho[3:], old[3:] - 0.98, rtol=0, atol=1e-15)


@pytest.mark.parametrize("guess", [np.nan, np.inf, -1.0, 0.0, 1e-12, 1e12])
@pytest.mark.parametrize(("n", "m"), [(2, 3), (2, 1), (3.5, 0)])
def test_the_guess_does_not_matter(n, m, guess):
    """The guess is the global Newton's last iterate, which may be wild or NaN; the answer must not depend on it."""
    old, energy = states(200)
    expected = solve(n, m, old, energy, 0.05)
    assert np.isfinite(expected).any()
    rho = solve(n, m, old, energy, 0.05, np.full(200, guess))
    assert np.allclose(rho, expected, rtol=1e-11, atol=0, equal_nan=True)


def test_parameters_may_differ_from_point_to_point():
    """Points converge one by one: the parameters, of growth and of the material, must stay with their points."""
    old, energy = states(50)
    random = np.random.default_rng(3)
    attractor, rate, reference = random.uniform(0.1, 2, 50), random.uniform(0.5, 2, 50), random.uniform(0.5, 2, 50)
    growth = EnergyDrivenGrowth(attractor, rate, 3.5)
    together = solve_density(LocalSource(growth, Material(1.0, reference_density=reference), energy), old, 0.3, old)
    for i in range(50):
        growth, material = EnergyDrivenGrowth(attractor[i], rate[i], 3.5), Material(1.0, reference_density=reference[i])
        alone = solve_density(LocalSource(growth, material, energy[[i]]), old[[i]], 0.3, old[[i]])
        assert alone[0] == pytest.approx(together[i], rel=1e-14)


def test_nothing_to_solve():
    """A rank may own no growing cell."""
    assert solve(2, 3, np.empty(0), np.empty(0), 0.1).shape == (0,)


# -- other laws, and several energies for one density ------------------------------------------------------------------

LAWS = {
    "energy": EnergyDrivenGrowth(0.7, 1.4, 3.0),
    "energy, dead zone": EnergyDrivenGrowth(0.7, 1.4, 3.0, dead_zone=0.3),
    "energy per mass": SpecificEnergyDrivenGrowth(0.7, 1.4),
    "strain": StrainDrivenGrowth(0.7, 1.4, 1.5),
    "stress": StressDrivenGrowth(0.7, 1.4, 3.0),
    "stress, dead zone": StressDrivenGrowth(0.7, 1.4, 3.0, dead_zone=0.3),
}
laws_of_all_kinds = pytest.mark.parametrize("growth", LAWS.values(), ids=LAWS)
MATERIAL = Material(2.0, 0.3, 1.3, 2.0)


def points(count, of_each, seed=5):
    """Energies of several points of each density, and shares of the points that are not equal."""
    random = np.random.default_rng(seed)
    energy = 10 ** random.uniform(-2, 0.5, (count, of_each))
    weights = random.uniform(0.5, 2.0, (count, of_each))
    return energy, weights / weights.sum(axis=1, keepdims=True)


@laws_of_all_kinds
@pytest.mark.parametrize("of_each", [1, 4])
def test_each_law_is_solved_for_the_mean_of_its_sources(growth, of_each):
    """r(ρ) = ρ − ρₙ − Δt Σ wᵢ R₀(ρ, Ψᵢ), bracketed and bisected here one by one; a mean of Ψ would not do."""
    energy, weights = points(40, of_each)
    old, time_step = np.random.default_rng(6).uniform(0.8, 2.0, 40), 0.15

    def balance(rho, i):
        return rho - old[i] - time_step * weights[i] @ growth.mass_source(rho, energy[i], MATERIAL)

    # With these parameters r rises over the bracket, so that there is one root.
    expected = [brentq(balance, 0.4, 40.0, args=(i,), xtol=1e-14) for i in range(40)]
    rho = solve_density(LocalSource(growth, MATERIAL, energy, weights), old, time_step, old)
    assert rho == pytest.approx(np.array(expected), rel=1e-12)


@laws_of_all_kinds
def test_one_point_with_all_the_weight_is_the_point(growth):
    """The two ways to give energies must be one law: rate, slope and density agree."""
    energy, old = points(30, 1)[0], np.linspace(0.8, 2.0, 30)
    alone = LocalSource(growth, MATERIAL, energy[:, 0])
    weighed = LocalSource(growth, MATERIAL, energy, np.ones((30, 1)))
    for one, other in zip(alone.rate_and_slope(old), weighed.rate_and_slope(old), strict=True):
        assert one.shape == other.shape == (30,)
        assert one == pytest.approx(other, rel=1e-14)
    assert solve_density(alone, old, 0.1, old) == pytest.approx(solve_density(weighed, old, 0.1, old), rel=1e-14)


@laws_of_all_kinds
def test_only_a_linear_law_may_be_given_a_mean_energy(growth):
    """`is_linear` decides whether a cell's mean energy is enough: where it says so it must be, and only there."""
    energy, weights = points(30, 4)
    rho = np.linspace(0.8, 2.0, 30)
    mean = (weights * energy).sum(axis=1)
    apart = np.abs(
        LocalSource(growth, MATERIAL, energy, weights).rate(rho) - LocalSource(growth, MATERIAL, mean).rate(rho)
    )
    assert apart.max() < 1e-14 if growth.is_linear else apart.max() > 1e-2
    assert growth.is_linear == (growth in (LAWS["energy"], LAWS["energy per mass"]))


@laws_of_all_kinds
@pytest.mark.parametrize("of_each", [None, 4])
def test_the_slope_is_the_derivative_of_the_rate(growth, of_each):
    """The local Newton relies on it, for one energy and for several."""
    energy, weights = points(30, of_each or 1)
    source = LocalSource(growth, MATERIAL, energy, weights) if of_each else LocalSource(growth, MATERIAL, energy[:, 0])
    rho, step = np.linspace(0.8, 2.0, 30), 1e-6
    difference = (source.rate(rho + step) - source.rate(rho - step)) / (2 * step)
    rate, slope = source.rate_and_slope(rho)
    assert np.array_equal(rate, source.rate(rho))
    assert slope == pytest.approx(difference, rel=1e-6, abs=1e-8)


def test_parameters_stay_with_their_densities_beside_several_points():
    """Parameters are one for each density and energies a row: a wrong axis shows where their numbers are the same."""
    energy, weights = points(4, 4)
    old, random = np.linspace(0.8, 2.0, 4), np.random.default_rng(3)
    attractor, rate, reference = random.uniform(0.1, 0.5, 4), random.uniform(0.5, 2, 4), random.uniform(0.8, 2, 4)
    growth = StrainDrivenGrowth(attractor, rate, dead_zone=0.1)
    together = solve_density(
        LocalSource(growth, Material(2.0, reference_density=reference), energy, weights), old, 0.3, old
    )
    for i in range(4):
        alone = StrainDrivenGrowth(float(attractor[i]), float(rate[i]), dead_zone=0.1)
        material = Material(2.0, reference_density=float(reference[i]))
        source = LocalSource(alone, material, energy[[i]], weights[[i]])
        assert solve_density(source, old[[i]], 0.3, old[[i]])[0] == pytest.approx(together[i], rel=1e-13)


# -- any state whatever ------------------------------------------------------------------------------------------------

EXPONENTS = (-10, -3.3, -2, -1.5, -1.01, -1, -0.5, -0.1, 0, 0.1, 0.5, 0.9, 1, 1.1, 2, 5)  # k = n − m


def with_power(power, *, attractor=0.7, rate=1.4, reference=1.3, dead_zone=0.0):
    """A growth law and a material with that exponent k of the density in the stimulus."""
    n, m = max(power, 0.0), max(-power, 0.0)
    return EnergyDrivenGrowth(attractor, rate, m, dead_zone=dead_zone), Material(2.0, 0.3, reference, n)


def response(excess, half_width):
    """What the source sees of an excess of the stimulus, with edges rounded over a tenth of the half-width."""
    roots = [np.sqrt((excess + sign * half_width) ** 2 + (0.1 * half_width) ** 2) for sign in (-1, 1)]
    return excess * (1 - 2 * half_width / sum(roots))


@pytest.fixture
def evaluations(monkeypatch):
    """A list that grows with each evaluation of residuals, of either kind of balance."""
    seen = []
    for kind in (PowerBalance, balance.LocalBalance):

        def counted(balance, density, original=kind.linearised):
            seen.append(len(density))
            return original(balance, density)

        monkeypatch.setattr(kind, "linearised", counted)
    return seen


def wild(random, count, decades, tame):
    """Half of the numbers over so many decades to both sides of one, half over few."""
    return 10 ** (random.uniform(-1, 1, count) * np.where(np.arange(count) % 2, decades, tame))


@pytest.mark.parametrize("power", EXPONENTS)
def test_a_million_states(power, evaluations):
    """Round-off, a bounded count, no warning and no spurious root, over 16 decades, from guesses far off."""
    count, random = 65536, np.random.default_rng(round(10 * power) + 100)
    old, reference = wild(random, count, 8, 0.5), wild(random, count, 2, 0.2)
    attractor, rate, energy = (wild(random, count, 8, 1) for _ in range(3))
    attractor[::89], energy[::97] = 0.0, 0.0
    guess = np.where(random.random(count) < 0.5, old * wild(random, count, 0.1, 0.01), wild(random, count, 12, 12))
    guess[::13] = np.nan
    growth, material = with_power(power, attractor=attractor, rate=rate, reference=reference)
    rho = solve_density(LocalSource(growth, material, energy), old, 1.0, guess)
    assert len(evaluations) <= 50

    def terms(density, some=slice(None)):
        """What is gained and lost in the step, in more digits."""
        relative = np.longdouble(density) / reference[some]
        return rate[some] * energy[some] * relative ** np.longdouble(power), np.longdouble(rate[some]) * attractor[some]

    found = np.isfinite(rho)
    assert found.mean() > 0.15 and (rho[found] > 0).all()
    gain, loss = terms(rho[found], found)
    r = rho[found] - (old[found] + gain - loss)
    size = np.max([rho[found], old[found], gain, loss], axis=0)
    assert (np.abs(r) <= 5e-15 * size).all()
    assert (power * gain / rho[found] < 1).all(), "r must rise at the root"
    old_gain, old_loss = terms(old)
    onward = np.sign(old_gain - old_loss)
    assert (onward[found] * (rho[found] - old[found]) >= -1e-14 * old[found]).all()
    # r rises for k <= 0, and for k < 1 any excess of the gain leads to a root: there NaN can be judged for all states.
    if power <= 0:
        lowest = 2 * ROUND_OFF * old
        assert (lowest[~found] - old[~found] - terms(lowest[~found], ~found)[0] + old_loss[~found] >= 0).all()
    if 0 < power < 1:
        assert found[(onward > 0)].all()
    some = slice(0, 400)

    def mass_source(path):
        return rate[some, None] * (energy[some, None] * (path / reference[some, None]) ** power - attractor[some, None])

    assert_continued(rho[some], mass_source, old[some], 1.0)


@pytest.mark.parametrize("of_each", [1, 3])
@pytest.mark.parametrize("half_width", [0.03, 0.3, 2.0])
@pytest.mark.parametrize("power", [-10, -1, -0.5, 0, 0.3, 0.5, 0.9, 1, 1.5, 2, 5])
def test_dead_zones_of_random_states(power, half_width, of_each, evaluations):
    """A source with a dead zone is neither convex nor concave, and may have many roots: the first is not enough."""
    count, random = 300, np.random.default_rng(round(100 * half_width) + of_each)
    old, reference = wild(random, count, 1, 0.3), wild(random, count, 0.2, 0)
    attractor, rate = wild(random, count, 0.5, 0.2), wild(random, count, 2, 1)
    energy, weights = points(count, of_each)
    energy *= np.where(np.arange(count) % 3, (old / reference) ** -float(power), 1)[:, np.newaxis]
    growth, material = with_power(power, attractor=attractor, rate=rate, reference=reference, dead_zone=half_width)
    rho = solve_density(LocalSource(growth, material, energy, weights), old, 1.0, old * wild(random, count, 0.1, 0.01))
    assert len(evaluations) <= 50

    def mass_source(path):
        stimulus = (path / reference[:, None])[..., None] ** float(power) * energy[:, None]
        return rate[:, None] * (weights[:, None] * response(stimulus - attractor[:, None, None], half_width)).sum(2)

    assert_continued(rho, mass_source, old, 1.0)
    found = np.isfinite(rho)
    assert found.mean() > 0.2
    change = mass_source(rho[:, None])[:, 0]
    stimulus = ((rho / reference)[:, None] ** float(power) * energy).max(axis=1)
    size = np.max([rho, old, np.abs(change), rate * stimulus, rate * (attractor + half_width)], axis=0)
    assert (np.abs(rho - old - change) <= 2e-14 * size)[found].all()


NUMBERS = st.one_of(
    st.floats(1e-8, 1e8),
    st.floats(0.1, 10.0),
    st.sampled_from([1e-8, 1e-3, 0.5, 1 - 2**-53, 1.0, 1 + 2**-52, 2.0, 1e8]),
)
NONE_OR_NUMBERS = st.one_of(st.just(0.0), NUMBERS)


@settings(derandomize=True, deadline=None, database=None, max_examples=800)
@given(
    power=st.one_of(st.sampled_from(EXPONENTS), st.floats(-10, 5)),
    old=NUMBERS,
    energy=NONE_OR_NUMBERS,
    attractor=NONE_OR_NUMBERS,
    rate=NUMBERS,
    half_width=st.sampled_from([0.0, 0.0, 1e-6, 0.3, 1e3]),
    guess=st.one_of(NUMBERS, st.sampled_from([np.nan, np.inf, -1.0, 0.0, 1e-300, 1e300])),
)
def test_corners(power, old, energy, attractor, rate, half_width, guess):
    """States on the edge of all that can happen: in equilibrium, without energy or attractor, about to vanish."""
    growth, material = with_power(power, attractor=attractor, rate=rate, reference=1.0, dead_zone=half_width)
    start = np.array([old])
    rho = solve_density(LocalSource(growth, material, np.array([energy])), start, 1.0, np.array([guess]))

    def mass_source(path):
        excess = path ** float(power) * energy - attractor
        return rate * (excess if half_width == 0 else response(excess, half_width))

    round_off = 1e-14 * (old + rate * (old ** float(power) * energy + attractor))
    if np.isfinite(rho[0]):
        slope = LocalSource(growth, material, np.array([energy])).rate_and_slope(rho)[1][0]
        assert slope <= 1 + 1e-6, "r must rise at the root"
    if abs(mass_source(start)[0]) <= round_off:  # and where that is not stable, another root is as near as this one
        assert rho[0] == pytest.approx(old, rel=1e-13, abs=10 * round_off) or power > 0
        return
    low, high, sure = continued(mass_source, start, 1.0)
    if sure[0]:
        assert np.isnan(rho[0]) == np.isnan(low[0])
    if sure[0] and np.isfinite(rho[0]):
        assert low[0] * (1 - 1e-12) - round_off <= rho[0] <= high[0] * (1 + 1e-12) + round_off


@pytest.mark.parametrize("dead_zone", [0.0, 0.3])
@pytest.mark.parametrize("power", [0.5, 1, 2])
def test_equilibrium_that_is_not_stable_is_no_root(power, dead_zone):
    """Where R₀(ρₙ) = 0 the root is ρₙ itself, for as long as r rises there: the other one does not continue it."""
    growth, material = with_power(power, attractor=1.0, rate=1.0, reference=1.0, dead_zone=dead_zone)
    one = np.array([1.0])
    source = LocalSource(growth, material, one)
    limit = 1 / source.rate_and_slope(one)[1][0]
    for guess in (0.01, 1.0, 100.0):
        assert solve_density(source, one, 0.9 * limit, np.array([guess])) == pytest.approx([1.0], rel=1e-14)
        assert np.isnan(solve_density(source, one, 1.1 * limit, np.array([guess])))


@pytest.mark.parametrize("dead_zone", [0.0, 0.3])
def test_stages_may_start_below_zero(dead_zone):
    """Base densities of later stages may be negative: for m >= n the one root is taken, for m < n there is none."""
    old, energy, time_step = np.linspace(-2.0, 0.0, 20), np.full(20, 5.0), 0.5
    for power in (-2, -1, -0.5, 0):
        growth, material = with_power(power, dead_zone=dead_zone)
        source = LocalSource(growth, material, energy)
        rho = solve_density(source, old, time_step, np.ones(20))
        found = np.isfinite(rho)
        assert found.any() if power == 0 else found.all()
        change = time_step * source.rate(rho[found])
        assert rho[found] == pytest.approx(old[found] + change, rel=0, abs=1e-13)
        assert (old[~found] + time_step * source.rate(np.ones(20))[~found] <= 0).all()
    for power in (0.5, 1.5, 2):
        growth, material = with_power(power, dead_zone=dead_zone)
        assert np.isnan(solve_density(LocalSource(growth, material, energy), old, time_step, np.ones(20))).all()


@pytest.mark.parametrize("dead_zone", [0.0, 0.3])
@pytest.mark.parametrize("power", [-1.5, -1, 0.5, 1, 2])
def test_energies_at_rest(power, dead_zone):
    """Round-off may leave an energy at rest below zero: that is rest, but energies further below are none."""
    growth, material = with_power(power, dead_zone=dead_zone)
    energy, old = np.array([0.0, -1e-17, -1e-3, np.nan]), np.full(4, 2.0)
    for some in (energy, energy[:3]):
        rho = solve_density(LocalSource(growth, material, some), old[: len(some)], 0.1, old[: len(some)])
        assert rho[0] == rho[1] < 2.0 and np.isnan(rho[2:]).all()


def test_no_bound_is_met_where_the_energy_is_none():
    """With bounds, too, the density of an inverted cell must not look like one."""
    for power in (-2, -1, 0.5, 2):
        growth, material = with_power(power)
        growth = replace(growth, bounds=(0.5, 2.0))
        rho = solve_density(LocalSource(growth, material, np.array([np.nan, 0.8])), np.ones(2), 0.1, np.ones(2))
        assert np.isnan(rho).tolist() == [True, False]


# -- bounds of density -------------------------------------------------------------------------------------------------


def bounded(n, m, bounds):
    """The laws of this file with bounds."""
    return EnergyDrivenGrowth(0.7, 1.4, m, bounds=bounds), Material(2.0, 0.3, 1.3, n)


@pytest.mark.parametrize("time_step", TIME_STEPS)
@pytest.mark.parametrize("bounds", [(0.5, None), (None, 1.5), (0.5, 1.5)])
@pytest.mark.parametrize(("n", "m"), [(2, 3), (3.5, 4), (1, 4)])
def test_bounds_cut_the_density_off(n, m, bounds, time_step):
    """For m > n, r rises: the root is where it was or beyond a bound, and then the density is that bound exactly."""
    energy = 10 ** np.random.default_rng(8).uniform(-4, 2, 300)
    old = np.random.default_rng(9).uniform(0.5, 1.5, 300)
    free = solve(n, m, old, energy, time_step)
    low, high = (bounds[0] or 0.0), (bounds[1] or np.inf)
    # Where there is no root at all, density is on its way to zero.
    expected = np.clip(np.where(np.isnan(free) & (low > 0), 0.0, free), low, high)
    growth, material = bounded(n, m, bounds)
    rho = solve_density(LocalSource(growth, material, energy), old, time_step, old)
    inside = (expected > low) & (expected < high)
    assert np.array_equal(rho[~inside], expected[~inside], equal_nan=True)
    assert np.allclose(rho[inside], expected[inside], rtol=1e-12, atol=0)
    if time_step == 1.0:
        assert inside.any() and (~inside).any(), "both must occur for the test to mean something"


@pytest.mark.parametrize("guess", [np.nan, -1.0, 0.5, 1.5, 1e-12, 1e12])
def test_bounds_do_not_depend_on_the_guess(guess):
    """The last iterate may have been at a bound or beyond it: neither may hold a density there."""
    growth, material = bounded(2, 3, (0.5, 1.5))
    energy, old = 10 ** np.linspace(-4, 2, 200), np.linspace(0.5, 1.5, 200)
    source = LocalSource(growth, material, energy)
    expected = solve_density(source, old, 0.3, old)
    assert {0.5, 1.5} < set(expected.tolist()) and np.ptp(expected[(expected > 0.5) & (expected < 1.5)]) > 0.5
    assert solve_density(source, old, 0.3, np.full(200, guess)) == pytest.approx(expected, rel=1e-12)


def test_bounds_that_are_not_met_change_nothing():
    """Wide bounds must leave every bit of the answer as it is."""
    growth, material = bounded(2, 3, (1e-6, 1e6))
    old, energy = states(200)
    rho = solve(2, 3, old, energy, 0.1)
    found = np.isfinite(rho)
    assert found.sum() > 150
    wide = solve_density(LocalSource(growth, material, energy), old, 0.1, old)
    assert np.array_equal(wide[found], rho[found])
    assert (wide[~found] == 1e-6).all()  # what has no positive density is on its way to the lowest


def test_a_high_bound_stops_what_would_grow_without_end():
    """ρ − 1 − Δt [2ρ² − ½] = 0 has no root for Δt = 1: growth runs away until it meets the bound."""
    material = Material(1.0, density_exponent=3.0)
    one = np.array([1.0])
    for bound in (1.5, 10.0):
        growth = EnergyDrivenGrowth(0.5, 1.0, 1.0, bounds=(None, bound))
        assert solve_density(LocalSource(growth, material, 2 * one), one, 1.0, one)[0] == bound
    free = EnergyDrivenGrowth(0.5, 1.0, 1.0)
    assert np.isnan(solve_density(LocalSource(free, material, 2 * one), one, 1.0, one)[0])


def test_bounds_hold_with_several_energies_for_a_density():
    """What decides is the mean source at the bound, not that of any of the points."""
    energy = np.array([[1e-3, 4.0], [1e-3, 0.2]])
    growth, material = bounded(2, 3, (0.9, 1.4))
    source = LocalSource(growth, material, energy, np.full((2, 2), 0.5))
    assert solve_density(source, np.array([1.2, 1.2]), 1.0, np.array([1.2, 1.2])).tolist() == [1.4, 0.9]


@pytest.mark.parametrize(
    ("n", "m", "attractor", "energy", "time_step", "bounds", "root"),
    [
        (3.0, 1.0, 0.5, 1.0, 0.2, (None, 5.0), (5 - np.sqrt(25 - 4 * 4.5)) / 2),  # ρ² − 5ρ + 4.5 = 0
        (2.0, 1.5, 1.0, 0.9, 1.05, (0.001, None), ((0.945 + np.sqrt(0.945**2 - 0.2)) / 2) ** 2),  # ρ − 0.945 √ρ + 0.05
    ],
)
def test_a_bound_beyond_the_physical_root_is_not_met(n, m, attractor, energy, time_step, bounds, root):
    """For m < n the residual changes sign again beyond the root: its sign at the bound says nothing of the way."""
    growth = EnergyDrivenGrowth(attractor, 1.0, m, bounds=bounds)
    source = LocalSource(growth, Material(1.0, density_exponent=n), np.array([energy]))
    assert solve_density(source, np.array([1.0]), time_step, np.array([1.0])) == pytest.approx([root], rel=1e-9)


def test_without_a_root_the_way_leads_to_a_bound():
    """Where nothing balances the mass, density runs to zero or without end: with bounds, to the one it runs into."""
    for attractor, energy, bound in ((3.0, 0.0, 0.2), (0.0, 50.0, 4.0)):
        growth = EnergyDrivenGrowth(attractor, 1.0, 0.0, bounds=(0.2, 4.0))
        source = LocalSource(growth, Material(1.0), np.array([energy]))
        assert solve_density(source, np.array([1.0]), 1.0, np.array([1.0])).tolist() == [bound]
