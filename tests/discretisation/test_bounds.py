"""Bounds of density in a body: reached exactly, kept for as long as the source points beyond, and left again."""

from dataclasses import replace

import numpy as np
import pytest
from blocks import (
    COMM,
    ROLLERS,
    assert_tangent_matches_differences,
    block,
    densities,
    displacements,
    gathered,
    run,
    set_iterate,
    square,
    tangent,
)

import growthx as gx

LOCAL = (gx.Q1, gx.Q1P0, gx.Q1sri, gx.P2)
NODAL = (gx.Q1Q1, gx.Q2Q2, gx.S2Q1, gx.P2P1)
local_variants = pytest.mark.parametrize("variant", LOCAL, ids=lambda variant: variant.name)
nodal_variants = pytest.mark.parametrize("variant", NODAL, ids=lambda variant: variant.name)
variants = pytest.mark.parametrize("variant", LOCAL + NODAL, ids=lambda variant: variant.name)

# The bent block with an attractor in the middle of its stimuli: density rises at the clamped side, falls elsewhere.
FREE = gx.EnergyDrivenGrowth(0.01, 5.0)
LOW, HIGH = 1.187, 1.191


def body(variant, growth, **changes):
    return block(square(4, 0.04, shape=variant.cells[0]), growth=growth, **changes)


@variants
def test_densities_stop_at_the_bounds_exactly(variant):
    """Some at each bound, some between: the bounds are met to the last digit, and mass is balanced to round-off."""
    steps, problem = run(body(variant, replace(FREE, bounds=(LOW, HIGH))), variant)
    _, without = run(body(variant, FREE), variant)
    low, high = without.density_range()
    assert low < LOW and high > HIGH, "without the bounds densities must pass both"
    assert problem.density_range() == (LOW, HIGH)
    rho = densities(problem)[:, 2]
    assert np.any((rho > LOW + 1e-6) & (rho < HIGH - 1e-6))
    assert max(step.mass_defect for step in steps) < 1e-10
    assert steps[-1].reactions["left"] == pytest.approx([-0.1, 0.02], abs=1e-10)


@variants
def test_a_start_beyond_the_bounds_is_told(variant, caplog):
    """The first step moves it to them: mass is made, which nobody should have to find out from the numbers."""
    lifted = body(variant, replace(FREE, bounds=(LOW, HIGH)), initial_density=lambda x: np.where(x[0] < 0.5, 1.0, LOW))
    gx.discretise(lifted, variant)
    said = [record.getMessage() for record in caplog.records if "beyond its bounds" in record.getMessage()]
    assert len(said) == (COMM.rank == 0)
    assert all(f"1 to {LOW:g}" in each and f"{LOW:g} to {HIGH:g}" in each for each in said)
    caplog.clear()
    within = replace(lifted, initial_density=LOW)
    gx.discretise(within, variant)
    gx.discretise(replace(within, growth=FREE, initial_density=1.0), variant)
    assert "beyond its bounds" not in caplog.text


@variants
def test_shares_of_the_volume_at_the_bounds(variant):
    """By NumPy: the weights of the densities that are equal to a bound, over those of all."""
    _, problem = run(body(variant, replace(FREE, bounds=(LOW, HIGH))), variant)
    owned = slice(len(problem.volumes))
    density, weights = (gathered(each) for each in (problem.density.x.array[owned], np.abs(problem.volumes)))
    expected = [weights[np.isclose(density, bound, rtol=1e-12)].sum() / weights.sum() for bound in (LOW, HIGH)]
    assert problem.measures.shares_at_bounds() == pytest.approx(expected, rel=1e-12)
    assert min(expected) > 0


@variants
@pytest.mark.parametrize("bound", ["low", "high"])
def test_one_bound_alone(variant, bound):
    """The other side must stay open, as if there were no bound."""
    bounds = (LOW, None) if bound == "low" else (None, HIGH)
    _, problem = run(body(variant, replace(FREE, bounds=bounds)), variant)
    low, high = problem.density_range()
    if bound == "low":
        assert low == LOW and high > HIGH
    else:
        assert low < LOW and high == HIGH


@variants
def test_bounds_that_are_not_met_change_nothing(variant):
    """Wide bounds take the path of bounds, for nodal densities another Newton method, to the same states."""
    (plain, free), (wide, bounded) = (
        run(body(variant, growth), variant, tolerance=1e-12, full_newton=True)
        for growth in (FREE, replace(FREE, bounds=(0.5, 2.0)))
    )
    assert densities(bounded) == pytest.approx(densities(free), rel=1e-10)
    assert displacements(bounded) == pytest.approx(displacements(free), rel=1e-9, abs=1e-12)
    assert [step.newton_iterations for step in wide] == [step.newton_iterations for step in plain]
    assert [step.mass for step in wide] == pytest.approx([step.mass for step in plain], rel=1e-11)


def loaded_and_unloaded(variant, growth):
    """A block in homogeneous tension that is loaded, grows to its bound, and is unloaded."""
    return block(
        square(2, shape=variant.cells[0]),
        material=gx.Material(3.0, 0.3, 1.2),
        growth=growth,
        supports=ROLLERS,
        loads=(gx.Traction("right", (0.9, 0.0), history=lambda time: 1.0 if time < 0.55 else 0.0),),
        program=gx.Program(step=0.1, until=1.0),
    )


@variants
def test_densities_leave_a_bound_when_the_source_turns(variant):
    """Without a load R₀ = −c Ψ₀*: from the first step on the density must fall by that from the bound, not later."""
    attractor, rate, high = 0.02, 4.0, 1.25
    growth = gx.EnergyDrivenGrowth(attractor, rate, bounds=(None, high))
    scene = loaded_and_unloaded(variant, growth)
    problem, ranges = gx.discretise(scene, variant), []
    for step in gx.march(scene, variant, problem, tolerance=1e-12):
        ranges.append((step.min_density, step.max_density))
        assert step.mass_defect < 1e-10
    ranges = np.array(ranges)
    at_bound = ranges[:5, 1] == high
    assert at_bound[-1] and not at_bound[0], "the bound must be reached under load, and not at once"
    for k in range(5):
        assert ranges[5 + k] == pytest.approx(high - (k + 1) * 0.1 * rate * attractor, rel=1e-9)


@pytest.mark.parametrize("variant", [gx.Q1, gx.Q1Q1, gx.Q2Q2, gx.P2P1], ids=lambda variant: variant.name)
def test_all_variants_agree_on_a_homogeneous_block(variant):
    """Local clipping and PETSc's Newton for variational inequalities are two roads: to one history, of each step."""
    growth = gx.EnergyDrivenGrowth(0.02, 4.0, bounds=(1.22, 1.25))
    histories = []
    for each in (gx.Q1P0, variant):
        steps, _ = run(loaded_and_unloaded(each, growth), each, tolerance=1e-12)
        histories.append([(step.min_density, step.max_density, step.mass) for step in steps])
    assert {1.22, 1.25} <= {low for low, _, _ in histories[0]}, "both bounds must be reached"
    assert np.array(histories[1]) == pytest.approx(np.array(histories[0]), rel=1e-9)


@local_variants
def test_tangent_where_some_densities_are_at_a_bound(variant):
    """What is stopped does not follow the deformation: its share of the condensation must drop out, and no other."""
    material = gx.Material(young=1.0, poisson=0.25, reference_density=1.2)

    def at(bounds):
        growth = gx.EnergyDrivenGrowth(0.02, 5.0, bounds=bounds)
        problem = gx.discretise(
            block(square(3, 0.06, shape=variant.cells[0]), growth=growth, material=material), variant
        )
        problem.system.begin_step(0.1, 0.7)
        set_iterate(
            problem, lambda x: np.stack([0.3 * np.sin(2 * x[0]) + 0.1 * x[1], 0.2 * x[0] * x[1] - 0.15 * x[1]]), None
        )
        return problem, tangent(problem)

    problem, exact = at((1.195, 1.22))
    rho = gathered(problem.density.x.array[problem.growing_dofs])
    shares = [np.mean(rho == 1.195), np.mean(rho == 1.22)]
    assert min(shares) > 0.05 and sum(shares) < 0.95, "there must be some at each bound and some between"
    assert_tangent_matches_differences(problem, exact)
    _, free = at((None, None))
    assert np.abs(exact - free).max() > 1e-4 * np.abs(exact).max()
    if problem.system.symmetric:
        assert exact == pytest.approx(exact.T, rel=0, abs=1e-14 * np.abs(exact).max())


@pytest.mark.parametrize("variant", [gx.Q1, gx.Q1Q1], ids=lambda variant: variant.name)
def test_newton_stays_quick_at_bounds(variant):
    """A wrong tangent would still converge, slowly: once it is known what is at a bound, the end must be quadratic."""
    steps, problem = run(body(variant, replace(FREE, bounds=(LOW, HIGH))), variant, full_newton=True)
    assert problem.density_range() == (LOW, HIGH)
    for step in steps:
        before, last = step.newton.residual_norms[-2:]
        assert last < 1e-4 * before
        assert step.rejected == 0


@pytest.mark.parametrize("variant", [gx.Q1, gx.Q1P0, gx.Q1Q1], ids=lambda variant: variant.name)
def test_a_lowest_density_keeps_unloaded_bone(variant):
    """Without a load every density would vanish at ρ*/(cΨ₀*) and the run end there: at a bound it goes on."""
    growth = gx.EnergyDrivenGrowth(2.0, 5.0)
    still = {"loads": (), "program": gx.Program(step=0.1, until=0.5)}
    with pytest.raises(gx.EndedEarly, match="no positive density"):
        run(body(variant, growth, **still), variant)
    steps, problem = run(body(variant, replace(growth, bounds=(0.3, None)), **still), variant)
    assert problem.density_range() == (0.3, 0.3)
    assert steps[-1].mass == pytest.approx(0.3, rel=1e-13)
    assert max(step.mass_defect for step in steps) < 1e-12


@variants
def test_bounds_hold_in_what_grows_alone(variant):
    """A region at rest keeps its density, which may be beyond the bounds: it is of another matter."""
    growth = replace(FREE, bounds=(LOW, HIGH))
    start = {"bone": 1.2, "implant": 4.0} if variant.density.local else 1.2
    scene = block(square(4, shape=variant.cells[0]), growth=growth, growing=("bone",), initial_density=start)
    steps, problem = run(scene, variant)
    x, _, rho = densities(problem).T
    rests = x > 0.5 + 1e-9
    assert np.all(rho[rests] == (4.0 if variant.density.local else 1.2))
    assert rho[~rests].min() >= LOW and rho[~rests].max() <= HIGH
    assert max(step.mass_defect for step in steps) < 1e-10


@pytest.mark.parametrize("variant", [gx.Q1, gx.Q1Q1], ids=lambda variant: variant.name)
def test_bounds_beside_a_field_of_attractors(variant):
    """Each density has its own attractor and stops in its own time: with c Ψ₀* = x and no load, at ρ* − x t."""
    growth = gx.EnergyDrivenGrowth(lambda x: x[0], 1.0, bounds=(1.0, None))
    program = gx.Program(step=0.1, until=0.3)
    steps, problem = run(block(square(4), growth=growth, loads=(), program=program), variant)
    x, _, rho = densities(problem).T
    if variant.density.local:
        middle = (np.floor(x * 4) + 0.5) / 4  # a field has one value in a cell
        assert rho == pytest.approx(np.maximum(1.2 - 0.3 * middle, 1.0), rel=1e-12)
    assert rho.min() == 1.0 and np.count_nonzero(rho > 1.01) > 0
    assert max(step.mass_defect for step in steps) < 1e-10
    assert COMM.allreduce(problem.mass()) / COMM.size == steps[-1].mass


@variants
def test_bounds_cost_no_extra_iterations(variant):
    """PETSc's own line search for bounded unknowns stalls where full steps converge at once: no step may need many."""
    steps, _ = run(body(variant, replace(FREE, bounds=(LOW, HIGH))), variant, full_newton=True)
    assert max(step.newton_iterations for step in steps) <= 6
    assert not any(step.rejected for step in steps)


@pytest.mark.parametrize("wrong", [None, (1.0,), (2.0, 1.0), (0.0, 1.0), "ab"])
def test_bounds_that_are_none_are_refused(wrong):
    """None for both bounds is a natural slip: a sentence says what would be right."""
    with pytest.raises(gx.InputError, match=r"bounds? of density"):
        gx.EnergyDrivenGrowth(0.01, bounds=wrong)


def test_bounds_may_be_a_list():
    """A list means the same as a tuple, also where there is no bound."""
    assert gx.EnergyDrivenGrowth(0.01, bounds=[None, None]) == gx.EnergyDrivenGrowth(0.01)
    assert not gx.EnergyDrivenGrowth(0.01, bounds=[None, None]).is_bounded
