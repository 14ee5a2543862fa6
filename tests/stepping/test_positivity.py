"""Nodal densities stay positive by themselves where m > n, and nothing changes where they are positive anyhow."""

from dataclasses import replace

import numpy as np
import pytest
from blocks import COMM, set_iterate

import growthx as gx
from growthx.stepping.failure import inadmissible
from growthx.stepping.positivity import Positivity
from growthx.stepping.time_schemes import SDIRK2


def scene(n=1.0, m=2.0, cells=6, **program):
    """The plate for twice as long as unloaded material lasts: its free corners lose their last density at t = 5."""
    plate = gx.scenes.plate(cells)
    return replace(
        plate,
        material=replace(plate.material, density_exponent=n),
        growth=replace(plate.growth, exponent=m),
        program=gx.Program(step=0.25, until=program.pop("until", 6.0), ramp=0.5),
    )


def assert_same(steps, others):
    numbers, other = ([[s.time, s.lumped_cells, s.mass, s.min_density] for s in each] for each in (steps, others))
    if COMM.size == 1:
        assert numbers == other
    else:  # sums over ranks come in any order
        assert np.array(numbers) == pytest.approx(np.array(other), rel=1e-9)


@pytest.fixture(scope="module")
def lumped():
    return gx.solve(scene(), gx.S2Q1)


def test_a_density_that_would_vanish_is_kept(lumped):
    """Before, this run ended at t = 5.03 with a nodal density of zero, although m = 2 is above n = 1."""
    assert lumped.converged
    assert min(step.min_density for step in lumped.steps) > 0
    first = next(number for number, step in enumerate(lumped.steps) if step.lumped_cells)
    assert lumped.steps[first - 1].min_density < 1e-4 * lumped.scene.material.reference_density
    assert 0 < max(step.lumped_cells for step in lumped.steps) <= 4  # of 72: at the corners of the loaded end


def test_it_makes_no_mass_and_no_force(lumped):
    """Lumping moves mass within a cell: both balances hold in the steps with it as in those without."""
    for step in lumped.steps:
        assert step.mass_defect < 1e-9
        assert step.force_defect < 1e-8


def test_the_record_tells(lumped):
    """In the step's words, and in the summary."""
    step = next(step for step in lumped.steps if step.lumped_cells)
    assert f"balance of mass lumped in {step.lumped_cells} cells" in str(step)
    assert gx.results.summary(lumped)["lumped_cells"] == max(step.lumped_cells for step in lumped.steps)


def test_a_lumped_step_solves_the_balance_of_its_point(lumped):
    """At a node all of whose cells are lumped, (ρ − ρₙ)/Δt = R₀(ρ, Ψ₀) with the energy there: by NumPy alone."""
    result = gx.solve(scene(until=5.5), gx.S2Q1)
    problem = result.problem
    nodes = problem.system.densities.lumped.memory() > 0
    owned = np.flatnonzero(nodes[: len(problem.volumes)])
    places, material, growth = problem.density_positions(), result.scene.material, result.scene.growth
    old, now = problem.state.old_density.x.array, problem.density.x.array
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])
    energies = problem.evaluate(problem.mean_energy(), corners)
    cells = problem.density_space.dofmap.list[: len(energies)]
    for node in owned:
        here = cells == node
        if here.sum() != 1 or not np.allclose(places[node][0], 2.0):  # corners of the body have one cell
            continue
        rate = growth.mass_source(now[node], float(energies[here][0]), material)
        assert (now[node] - old[node]) / result.steps[-1].time_step == pytest.approx(rate, rel=1e-6)
        break
    assert COMM.allreduce(len(owned)) > 0


@pytest.mark.parametrize("variant", [gx.Q1Q1, gx.Q2Q2, gx.S2Q1], ids=lambda variant: variant.name)
def test_nothing_changes_where_densities_are_positive(variant, monkeypatch):
    """To the bit on one rank, where runs repeat: a run that never loses a density does not know of it."""
    run = scene(n=2.0, m=3.0, cells=3, until=2.0)
    with_it = gx.solve(run, variant)
    monkeypatch.setattr(Positivity, "is_lost", lambda self: False)
    without = gx.solve(run, variant)
    assert_same(with_it.steps, without.steps)
    assert not any(step.lumped_cells for step in with_it.steps)


def test_a_model_that_is_not_well_posed_ends_as_before():
    """With m = 0 densities vanish by the model, and the run says where."""
    with pytest.raises(gx.RunEndedEarly, match="no positive density balances the mass") as ended:
        gx.solve(scene(n=2.0, m=0.0, cells=3, until=10.0), gx.Q1Q1)
    assert not any(step.lumped_cells for step in ended.value.result.steps)


def test_zero_is_no_bound():
    """With a highest density alone, nodes rested at zero, and mass was made there that no law knows of."""
    bounded = scene()
    bounded = replace(bounded, growth=replace(bounded.growth, bounds=(None, 1.2)))
    result = gx.solve(bounded, gx.S2Q1)
    assert result.converged
    assert result.problem.density_range()[1] == 1.2
    assert any(step.lumped_cells for step in result.steps)
    assert min(step.min_density for step in result.steps) > 0
    assert max(step.mass_defect for step in result.steps) < 1e-8


@pytest.mark.parametrize("variant", [gx.Q1Q1, gx.Q2Q2, gx.P1P1, gx.P2P2], ids=lambda variant: variant.name)
def test_other_elements_are_kept_positive_too(variant):
    """Stretched, with waves of density over four orders; quadratic simplices by masses in proportion to ∫ N²."""
    plate = gx.scenes.plate(6, shape=variant.cells[0])
    steep = replace(
        plate,
        loads=(),
        supports=(gx.Support("left"), gx.Support("right", (0.2, 0.0))),
        growth=replace(plate.growth, attractor=lambda x: 0.02 * (0.75 + x[0] / 4)),
        initial_density=lambda x: 100 ** (np.sin(np.pi * x[0]) * np.cos(2 * np.pi * x[1])),
        program=gx.Program(step=0.1, until=2.0, ramp=0),
    )
    result = gx.solve(steep, variant)
    assert result.converged
    assert any(step.lumped_cells for step in result.steps)
    assert min(step.min_density for step in result.steps) > 0
    assert max(step.mass_defect for step in result.steps) < 1e-8


@pytest.mark.parametrize("scheme", [gx.TR_BDF2, SDIRK2], ids=lambda scheme: scheme.name)
@pytest.mark.parametrize("adaptive", [False, True], ids=["fixed", "adaptive"])
def test_other_schemes_and_adaptive_steps(scheme, adaptive, caplog):
    """Every stage is a step of implicit Euler, and is lumped as one; the witness has nothing to say against it."""
    stepping = gx.AdaptiveSteps(1e-2, scheme=scheme) if adaptive else gx.FixedSteps(scheme=scheme)
    result = gx.solve(scene(), gx.S2Q1, stepping=stepping)
    assert result.converged
    assert any(step.lumped_cells for step in result.steps)
    assert min(step.min_density for step in result.steps) > 0
    said = [record.message for record in caplog.records]
    assert ["a nodal density vanishes" in each for each in said] == [True] * (COMM.rank == 0)


def test_another_march_goes_on_with_the_same_nodes():
    """What is lumped, and for how long it has been, is a part of a march's memory: the same bits on one rank."""

    def ends(anew):
        steps, seen = gx.march(scene(), gx.S2Q1), []
        for step in steps:
            seen.append(step)
            if anew and step.lumped_cells and step.time < 5.6:
                steps.begin_anew()
            elif step.lumped_cells and step.time < 5.6:
                steps.begin_anew(steps.memory())
        return seen

    one, other = ends(True), ends(False)
    assert_same(one, other)
    assert any(step.lumped_cells for step in one)


def test_an_energy_that_is_missed_at_a_node_is_named():
    """Where lumping asks for the energy at a node, det F there may be below zero with all Gauss points above it.

    Said before: "the residual is not a number".
    """
    problem = gx.discretise(scene(cells=2), gx.Q1Q1)
    problem.system.begin_step(0.1, 0.0)

    def dented(x):  # the middle node beyond the line between its neighbours, 0.3 along the diagonal
        return 0.3 * np.isclose(x[:2], 0.5).all(axis=0) * np.ones((2, 1))

    set_iterate(problem, dented, lambda x: np.ones(x.shape[1]))
    assert not inadmissible(problem)
    problem.system.densities.lumped.spread(np.ones_like(problem.density.x.array, dtype=bool))
    assert inadmissible(problem) == "det F ≤ 0 in the cell at (0.75, 0.75)"
