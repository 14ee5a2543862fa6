"""A factor that is kept saves factorisations and changes nothing else."""

import numpy as np
import pytest
from blocks import block, densities, displacements, run, square

import growthx as gx
from growthx.discretisation.variants import CATALOGUE
from growthx.solvers import kept_factor, linear_solvers
from growthx.solvers.newton import Newton
from growthx.solvers.settings import NewtonSettings

variants = pytest.mark.parametrize("variant", CATALOGUE.values(), ids=CATALOGUE)
KINDS = (gx.Q1Q1, gx.Q1, gx.Q1sri, gx.S2fri, gx.P2P1)
kinds = pytest.mark.parametrize("variant", KINDS, ids=lambda variant: variant.name)
PROGRAM = gx.Program(step=0.05, until=1.0, ramp=0.2)


@variants
def test_the_solution_is_that_of_the_full_method(variant):
    """The residual is exact and the tolerance the same: no digit that the tolerance promises may differ."""
    scene = block(square(4, 0.05, shape=variant.cells[0]), program=PROGRAM)
    kept, problem = run(scene, variant)
    full, same = run(scene, variant, full_newton=True, stepping=gx.FixedSteps(predicted=False))
    assert densities(problem) == pytest.approx(densities(same), rel=1e-9)
    assert displacements(problem) == pytest.approx(displacements(same), rel=1e-9, abs=1e-9)
    assert all(step.newton.residual_norms[-1] <= 1e-10 for step in kept)
    assert all(step.newton.factorisations == step.newton.iterations for step in full)


@kinds
def test_factors_are_kept_across_steps(variant):
    """Where little changes from one step to the next, most steps need no factor of their own."""
    steps, _ = run(block(square(4, 0.05, shape=variant.cells[0]), program=PROGRAM), variant)
    held = [step for step in steps if step.time > 0.3]
    assert sum(step.newton.factorisations for step in held) < len(held) / 2
    for step in steps:
        report = step.newton
        assert report.residuals >= report.iterations + 1
        assert len(report.residual_norms) == report.iterations + 1
        assert np.all(np.diff(report.residual_norms) < 0)  # no step is taken that does not help


@kinds
def test_a_step_that_goes_too_far_is_shortened(variant):
    """From rest under a large load the full step overshoots: its parts are tried, and the same state is found."""
    scene = block(
        square(4, shape=variant.cells[0]),
        loads=(gx.Traction("right", (0.02, -0.1)),),
        program=gx.Program(step=0.1, until=0.1),
    )
    (kept,), problem = run(scene, variant)
    (full,), same = run(scene, variant, full_newton=True)
    assert kept.newton.residuals > kept.newton.iterations + 1, "no step was shortened: the load is too small"
    assert kept.rejected == full.rejected == 0
    assert densities(problem) == pytest.approx(densities(same), rel=1e-9)


@kinds
def test_mixing_saves_iterations(variant, monkeypatch):
    """Without the former steps the same kept factor, where it must do for long, converges more slowly."""
    monkeypatch.setattr(linear_solvers, "RENEWAL", {2: 20.0})
    monkeypatch.setattr(linear_solvers, "RENEWAL_OF_MULTIGRID", 20.0)
    scene = block(square(4, 0.05, shape=variant.cells[0]), program=PROGRAM)
    mixed, _ = run(scene, variant)
    monkeypatch.setattr(kept_factor._Mixing, "improve", lambda self, position, step, residual, comm: step)
    plain, _ = run(scene, variant)
    work = [sum(step.newton.iterations + 5 * step.newton.factorisations for step in steps) for steps in (mixed, plain)]
    assert work[0] < work[1]


@kinds
def test_factors_pay_for_themselves(variant, monkeypatch):
    """What a factor costs decides how long it is kept: dear ones longer, at the price of more iterations."""
    scene, found = block(square(4, 0.05, shape=variant.cells[0]), program=PROGRAM), []
    for cost in (1.0, 1000.0):
        monkeypatch.setattr(linear_solvers, "RENEWAL", {2: cost, 3: cost})
        monkeypatch.setattr(linear_solvers, "RENEWAL_OF_MULTIGRID", cost)
        steps, _ = run(scene, variant)
        found.append([sum(getattr(step.newton, name) for step in steps) for name in ("factorisations", "iterations")])
    (cheap, few), (dear, many) = found
    assert dear < cheap
    assert many > few


def test_a_factor_is_worn_out_by_a_solution_that_takes_more_than_the_mean():
    """As any machine: the mean cost of its solutions falls at first, and once it rises another one is cheaper."""
    wear = kept_factor._Wear(12.0)
    assert not wear.is_worn_out  # it has done nothing yet
    for iterations, mean in ((4, 16.0), (8, 12.0), (10, 34 / 3)):
        wear.add(iterations)
        assert wear.is_worn_out == (iterations > mean)
    wear.add(12)
    assert wear.is_worn_out  # 46 / 4 < 12


def test_petsc_options_choose_another_method():
    """The method is SNES's to choose: its own Newton takes the place of ours."""
    from petsc4py import PETSc

    options = PETSc.Options("growthx_")
    options["snes_type"] = "newtonls"
    try:
        steps, _ = run(block(program=PROGRAM), gx.Q1)
    finally:
        options.delValue("snes_type")
    assert all(step.newton.factorisations == step.newton.iterations for step in steps)


def test_a_failed_solution_leaves_no_factor_behind():
    """The factor of an iterate that led nowhere would be the first one that the next attempt tries."""
    problem = gx.discretise(block(), gx.Q1)
    newton = Newton(problem.system, NewtonSettings(maximum_iterations=2))
    problem.system.begin_step(0.1, 1.0, 0.1)
    assert not newton.solve().converged
    problem.system.reject_step()
    problem.system.begin_step(0.1, 0.01, 0.1)
    assert newton.solve().factorisations >= 1
    newton.destroy()
