"""The baselines: each is what its literature says, on bodies on which that can be said in a line."""

from dataclasses import replace

import numpy as np
import pytest
from blocks import COMM, ROLLERS, block, densities, gathered, run, square

import growthx as gx
from growthx.baselines.averaging import NonLocal, Smoothed
from growthx.baselines.staggered import frozen, update
from growthx.post.checkerboards import checkerboard_index, high_frequency_index

WHERE = (gx.Q1, gx.Q1P0, gx.Q1Q1)  # at points, in cells, at nodes
variants = pytest.mark.parametrize("variant", WHERE, ids=lambda variant: variant.name)

E, NU, REFERENCE, RATE, ATTRACTOR, STRETCH = 1.0, 0.25, 1.2, 5.0, 0.05, 0.4
HELD = (  # all of it moves with the load: the deformation does not ask the density
    gx.Support("left", (0.0, None)),
    gx.Support("right", (STRETCH, None)),
    gx.Support("bottom", (None, 0.0)),
    gx.Support("top", (None, 0.0)),
)


def advanced(scene, variant, **options):
    """The steps of a baseline and its problem."""
    problem = frozen(scene, variant)
    return list(update(scene, variant, problem, **options)), problem


def held_block(step=0.1, until=1.0, **changes):
    """A block of one cell and more whose strain is prescribed and the same everywhere."""
    growth = gx.EnergyDrivenGrowth(ATTRACTOR, RATE)
    program = gx.Program(step=step, until=until)
    return block(square(2), growth=growth, supports=HELD, loads=(), program=program, **changes)


def held_energy():
    """Its Ψ₀ⁿᵉᵒ, written out."""
    lam, mu, log = E * NU / ((1 + NU) * (1 - 2 * NU)), E / (2 * (1 + NU)), np.log(1 + STRETCH)
    return lam / 2 * log**2 + mu / 2 * ((1 + STRETCH) ** 2 - 1 - 2 * log)


@variants
def test_a_homogeneous_block_is_explicit_euler(variant):
    """ρ + Δt c {[ρ/ρ*]^(n−m) Ψ₀ⁿᵉᵒ − Ψ₀*} by hand: no mean, projection or order of things may change it."""
    steps, problem = advanced(held_block(), variant)
    rho = REFERENCE
    for step in steps:
        rho += 0.1 * RATE * (REFERENCE / rho * held_energy() - ATTRACTOR)
        assert (step.min_density, step.max_density, step.mass) == pytest.approx((rho,) * 3, rel=1e-10)
        assert step.mass_defect < 1e-12
    assert abs(rho - REFERENCE) > 0.05, "the density must move for the comparison to mean something"
    assert [step.time for step in steps] == list(problem.scene.program.times())


@variants
def test_it_tends_to_the_implicit_solution_to_first_order(variant):
    """Half the step, half the distance at a given time, also where stress and strain are not uniform."""
    distances = []
    for step in (0.1, 0.05, 0.025):
        scene = block(square(2), program=gx.Program(step=step, until=0.4))
        after, together = (made(scene, variant)[1] for made in (advanced, run))
        distances.append(after.mass() - together.mass())
    coarse, fine = np.diff(distances)  # at nodes, where the source is lumped, the distance itself does not vanish
    assert np.log2(coarse / fine) == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("variant", [gx.Q1, gx.Q1P0], ids=lambda variant: variant.name)
def test_it_comes_to_the_same_equilibrium(variant):
    """Where R₀ = 0 everywhere, it does not matter how one came there, if m > n and the steps are small."""
    growth = gx.EnergyDrivenGrowth(0.01, 100.0)
    scene = block(square(2), growth=growth, program=gx.Program(step=0.2, until=24.0, ramp=1.0))
    (_, after), (_, together) = advanced(scene, variant), run(scene, variant)
    assert densities(after) == pytest.approx(densities(together), rel=1e-7)


@pytest.mark.parametrize(
    ("supports", "loads", "share"),
    [(HELD, (), 1.0), (ROLLERS, (gx.Traction("right", (1e-3, 0.0)),), 5.0)],
    ids=["constant strain: k = m − n", "constant stress: k = m + n"],
)
def test_the_limit_of_the_time_step_is_the_linearised_one(supports, loads, share):
    """A deviation from equilibrium is multiplied by 1 − Δt k c Ψ₀*/ρ in each step: it grows where that is below −1."""
    base = held_block(initial_density=REFERENCE)
    base = replace(base, supports=supports, loads=loads)
    stimulus = (1e-3**2 * (1 - NU**2) / 2 / E) if loads else held_energy()
    limit = 2 * REFERENCE / (share * RATE * stimulus)

    def factors(step):
        growth = gx.EnergyDrivenGrowth(stimulus, RATE)
        program = gx.Program(step=step, until=5 * step)
        scene = replace(base, growth=growth, program=program, initial_density=1.002 * REFERENCE)
        steps, _ = advanced(scene, gx.Q1P0, tolerance=1e-12)
        # Of increments, since strains that are not quite small move the equilibrium itself.
        increments = np.diff([1.002 * REFERENCE, *(step.max_density for step in steps)])
        return increments[1:] / increments[:-1]

    assert np.abs(factors(0.8 * limit)).max() < 1 < np.abs(factors(1.2 * limit)).min()
    assert factors(limit).mean() == pytest.approx(-1.0, abs=0.02)


@variants
def test_a_uniform_stimulus_stays_under_a_nonlocal_average(variant):
    """Near the edge there are fewer neighbours: shares that did not sum to one would darken it."""
    problem = frozen(block(square(4, 0.05)), variant)
    values = np.full(len(problem.growing_dofs), 0.7)
    assert NonLocal(0.2).on(problem)(values) == pytest.approx(0.7, rel=1e-13)


@variants
def test_a_nonlocal_average_is_symmetric(variant):
    """What one density gives another it gets from it, and what is odd about the middle stays odd."""
    problem = frozen(block(square(4)), variant)
    here = problem.density_positions()[problem.growing_dofs]
    odd = NonLocal(0.2).on(problem)(here[:, 0] - 0.5)
    rows = np.array(sorted(map(tuple, np.round(gathered(np.column_stack([here[:, :2], odd])), 9))))
    mirrored = np.array(sorted(map(tuple, np.round(rows * (-1, 1, -1) + (1, 0, 0), 9))))
    assert rows == pytest.approx(mirrored, abs=1e-8)
    assert 0.05 < np.abs(odd).max(initial=0.0) < 0.5 or not len(odd)
    if COMM.size == 1:
        # Without the volume that gives, and times the influences that the row was divided by.
        weights = NonLocal(0.2).weights(problem).toarray() / problem.volumes[problem.growing_dofs]
        own = np.diag(weights)  # the influence on itself is one
        assert weights / own[:, np.newaxis] == pytest.approx((weights / own[:, np.newaxis]).T, rel=1e-12)


@pytest.mark.parametrize("variant", [gx.Q1, gx.Q1P0, gx.Q1sri], ids=lambda variant: variant.name)
def test_smoothing_leaves_a_constant(variant):
    """Smoothing may flatten, and not raise or lower."""
    problem = frozen(block(square(3, 0.05)), variant)
    values = np.full(len(problem.growing_dofs), 1.7)
    assert Smoothed().on(problem)(values) == pytest.approx(1.7, rel=1e-13)


def test_both_averages_flatten_a_checkerboard():
    """That is what they are for: what is left of it is less than a quarter, and what they leave is a uniform mean."""
    problem = frozen(block(square(8)), gx.Q1P0)
    place = np.floor(8 * problem.density_positions()[problem.growing_dofs])
    board = 1 + 0.5 * (-1.0) ** (place[:, 0] + place[:, 1])
    left = []
    for values in (board, NonLocal(0.15).on(problem)(board), Smoothed().on(problem)(board)):
        problem.density.x.array[problem.growing_dofs] = values
        left.append(checkerboard_index(problem))
    assert left[0] == pytest.approx(1.0, rel=1e-12)  # from 0.5 to 1.5 across each facet, over a mean of one
    assert max(left[1:]) < 0.25


def board(places):
    """A checkerboard of amplitude one half about one, at whole numbers."""
    return 1 + 0.5 * (-1.0) ** (places[:, 0] + places[:, 1])


def index_of(mesh, variant, values):
    """Both indices of densities that are a function of position, (densities, 3) to (densities,)."""
    problem = frozen(block(mesh), variant)
    dofs = problem.growing_dofs
    problem.density.x.array[dofs] = values(problem.density_positions()[dofs])
    return checkerboard_index(problem), high_frequency_index(problem)


def test_the_index_of_a_checkerboard_at_the_nodes():
    """Nodal densities have no jumps: there, neighbours are nodes next to one another, mid-side ones included."""
    every, _ = index_of(square(4), gx.Q1Q1, lambda x: board(np.round(4 * x)))
    assert every == pytest.approx(1.0, rel=1e-12)
    every, _ = index_of(square(4), gx.Q2Q2, lambda x: board(np.round(8 * x)))
    assert every == pytest.approx(1.0, rel=1e-12)


def test_a_jump_counts_against_the_densities_beside_it():
    """Noise in what is nearly resorbed is as bad as noise in dense bone: the mean of the body is no measure of it."""
    across = lambda x: np.where(x[:, 1] < 0.5, 0.01, 1.0) * board(np.floor(4 * x))  # noqa: E731
    within, between = 1.0, [2 * abs(1.5 - 0.005) / 1.505, 2 * abs(0.5 - 0.015) / 0.515]
    every, _ = index_of(square(4), gx.Q1P0, across)
    assert every == pytest.approx((20 * within + 2 * sum(between)) / 24, rel=1e-12)


@pytest.mark.parametrize("variant", [gx.Q1, gx.Q1P0, gx.Q1Q1, gx.Q2Q2], ids=lambda variant: variant.name)
@pytest.mark.parametrize("distorted", [True, False], ids=["distorted", "row"])
def test_a_linear_density_has_no_high_frequencies(variant, distorted):
    """A gradient that the mesh resolves is no noise, at the edge of the body and on distorted cells either."""
    mesh = square(5, 0.05) if distorted else gx.meshing.read(gx.meshing.locate("bar.geo"), elements=8)
    every, rest = index_of(mesh, variant, lambda x: 1 + 0.3 * x[:, 0] + 0.2 * x[:, 1])
    assert every > 0.005
    assert rest < 1e-12


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1Q1], ids=lambda variant: variant.name)
def test_a_checkerboard_on_a_slope_keeps_its_high_frequencies(variant):
    """What the linear fit takes away is the slope and none of the board, but for a little at the edge of the body."""
    cells = 12
    count = np.floor if variant is gx.Q1P0 else np.round
    every, rest = index_of(square(cells), variant, lambda x: 1 + x[:, 0] + 0.1 * board(count(cells * x)))
    assert rest == pytest.approx(0.1 * np.log(2.1 / 1.1), rel=0.05)  # jumps of 0.1 over 1.1 … 2.1
    assert every > rest


@variants
@pytest.mark.parametrize("average", [None, NonLocal(0.2)], ids=["local", "non-local"])
def test_no_density_passes_the_floor_or_the_bounds(variant, average):
    """Without load all is resorbed, one step's worth at a time, down to the floor; under load, up to the bound."""
    growth = gx.EnergyDrivenGrowth(0.5, 5.0, bounds=(None, 1.3))
    scene = block(growth=growth, loads=(), program=gx.Program(step=0.25, until=1.0))
    steps, _ = advanced(scene, variant, floor=0.02, source_average=average)
    assert (steps[-1].min_density, steps[-1].max_density) == pytest.approx((0.02, 0.02), rel=1e-14)
    scene = replace(held_block(), growth=replace(growth, attractor=0.0))
    steps, _ = advanced(scene, variant, source_average=average)
    assert steps[-1].max_density == 1.3
    assert steps[-1].mass_defect > 0  # what the bound took


def test_resting_regions_keep_their_density():
    """The update, too, is of what grows."""
    scene = block(square(4), growing=("bone",), initial_density=1.1)
    _, problem = advanced(scene, gx.Q1P0, source_average=NonLocal(0.1), density_average=Smoothed())
    x, _, rho = densities(problem).T
    assert np.all(rho[x > 0.5] == 1.1)
    assert np.all(rho[x < 0.5] != 1.1)


def test_no_equilibrium_ends_the_run():
    """A baseline does not cut its steps: it says when it ended, and leaves the last good state."""
    scene = block(supports=(gx.Support("left"), gx.Support("right", (-0.45, 0.1))), loads=())
    scene = replace(scene, program=gx.Program(step=0.1, until=0.4, ramp=0.1))
    problem = frozen(scene, gx.Q1P0)
    with pytest.raises(gx.EndedEarly, match=r"^the run ended at t = 0 of 0\.4: det F ≤ 0 in the cell at"):
        list(update(scene, gx.Q1P0, problem))
    assert np.all(problem.displacement.x.array == 0.0)


@pytest.mark.parametrize(
    ("refused", "sentence"),
    [
        (lambda: NonLocal(0.0), "the radius of the average is 0: a positive number would be right"),
        (lambda: advanced(block(), gx.Q1, floor=0.0), "the lowest density is 0: a positive number would be right"),
        (
            lambda: advanced(block(), gx.Q1Q1, density_average=Smoothed()),
            "Q1Q1 has densities at nodes, which smoothing leaves as they are: "
            "Q1P0, Q1, Q2, Q1sri, S2fri would be right",
        ),
        (
            lambda: list(update(block(), gx.Q1, gx.discretise(block(), gx.Q1))),
            "the problem to be updated grows by itself: one from `baselines.frozen` would be right",
        ),
        (
            lambda: advanced(block(flux=gx.MassFlux(0.1)), gx.Q1Q1),
            "the scene 'block' moves mass, which an update after equilibrium does not know: "
            "one without flux, influx and prescribed densities would be right",
        ),
        (
            lambda: advanced(block(square(2, shape="triangle")), gx.P2P2),
            "P2P2 has nodes to which no volume belongs, over which the source has no mean: "
            "densities of degree 1, or of cells or points, would be right",
        ),
    ],
    ids=["radius", "floor", "smoothed nodes", "not frozen", "flux", "P2 triangles"],
)
def test_what_makes_no_sense_is_refused(refused, sentence):
    """One sentence with what is wrong and what would be right, on all ranks."""
    with pytest.raises(gx.InputError) as error:
        refused()
    assert str(error.value) == sentence
