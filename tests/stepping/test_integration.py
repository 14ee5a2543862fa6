"""Steps by schemes of time integration: their orders on the coupled problem, and the errors they tell of themselves."""

from itertools import pairwise

import numpy as np
import pytest
from blocks import COMM, block, densities, displacements, run, square

import growthx as gx
from growthx.discretisation.variants import CATALOGUE
from growthx.solvers.newton import Newton
from growthx.solvers.settings import NewtonSettings
from growthx.stepping.integration import Integrator

variants = pytest.mark.parametrize("variant", CATALOGUE.values(), ids=CATALOGUE)
KINDS = (gx.Q1Q1, gx.Q1, gx.Q1sri, gx.S2fri, gx.P2P1)
kinds = pytest.mark.parametrize("variant", KINDS, ids=lambda variant: variant.name)
SCHEMES = (gx.IMPLICIT_EULER, gx.TR_BDF2)
schemes = pytest.mark.parametrize("scheme", SCHEMES, ids=lambda scheme: scheme.name)


def body(variant, step=0.1, **changes):
    program = gx.Program(step=step, until=0.8, ramp=0.4)
    return block(square(3, 0.05, shape=variant.cells[0]), **{"program": program, **changes})


@schemes
@kinds
def test_the_order_is_the_one_of_the_scheme(variant, scheme):
    """Density and displacement, through a ramp and beyond: halving Δt divides their errors by 2^order."""
    found = []
    for step in (0.1, 0.05, 0.025, 0.0125):
        _, problem = run(body(variant, step), variant, tolerance=1e-12, stepping=gx.FixedSteps(scheme=scheme))
        found.append((densities(problem)[:, 2], displacements(problem)[:, 2:].ravel()))
    for values in zip(*found, strict=True):
        differences = [np.linalg.norm(one - other) for one, other in pairwise(values)]
        orders = np.log2(np.array(differences[:-1]) / differences[1:])
        assert orders[-1] > scheme.order - 0.2


@variants
def test_mass_is_balanced_in_every_stage(variant):
    """What is gained is the weighted source of the stages, to round-off."""
    steps, _ = run(body(variant), variant, tolerance=1e-12, stepping=gx.FixedSteps(scheme=gx.TR_BDF2))
    assert max(step.mass_defect for step in steps) < 1e-9


@schemes
@kinds
def test_the_estimate_is_about_the_error(variant, scheme):
    """One step from a known state, against the same in sixteen: an estimate that is off misleads the control."""
    error, estimate = [], []
    for length in (0.1, 0.05):
        whole, parts = gx.discretise(body(variant), variant), gx.discretise(body(variant), variant)
        for problem, count in ((whole, 1), (parts, 16)):
            newton = Newton(problem.system, NewtonSettings(1e-12))
            integrator = Integrator(problem, newton, scheme, estimate=True)
            integrator.step(0.0, 0.4)
            integrator.accept()
            ends = 0.4 + length * np.arange(count + 1) / count
            for start, end in pairwise(ends):
                found = integrator.step(float(start), float(end))
                integrator.accept()
            newton.destroy()
            if count == 1:
                estimate.append(found.error)
        difference = whole.density.x.array - parts.density.x.array
        error.append(
            whole.measures.root_mean_square(difference) / whole.measures.root_mean_square(parts.density.x.array)
        )
    assert np.array(estimate) == pytest.approx(np.array(error), rel=1.0)
    assert np.log2(estimate[0] / estimate[1]) > scheme.estimate_order - 0.5


@pytest.mark.parametrize("variant", [gx.Q1, gx.Q1Q1], ids=lambda variant: variant.name)
def test_a_load_that_is_there_at_once(variant):
    """The slope at the start is then that under the load: without it the first step would be of first order."""
    found = []
    for step in (0.1, 0.05, 0.025):
        scene = body(variant, program=gx.Program(step=step, until=0.4))
        steps, problem = run(scene, variant, tolerance=1e-12, stepping=gx.FixedSteps(scheme=gx.TR_BDF2))
        found.append(densities(problem)[:, 2])
        assert max(step.mass_defect for step in steps) < 1e-9
    assert np.log2(np.linalg.norm(found[0] - found[1]) / np.linalg.norm(found[1] - found[2])) > 1.7


@pytest.mark.parametrize("variant", [gx.Q1, gx.Q1Q1], ids=lambda variant: variant.name)
def test_bounds_hold_at_every_stage(variant):
    """A stage may not pass a bound that the end keeps."""
    growth = gx.EnergyDrivenGrowth(attractor=0.004, rate=5.0, bounds=(1.19, 1.21))
    steps, problem = run(body(variant, growth=growth), variant, stepping=gx.FixedSteps(scheme=gx.TR_BDF2))
    low, high = problem.density_range()
    assert (low, high) == (1.19, 1.21)
    assert all(1.19 <= step.min_density <= step.max_density <= 1.21 for step in steps)


@pytest.mark.parametrize(
    "stepping",
    [gx.AdaptiveSteps(), gx.AdaptiveSteps(scheme=gx.IMPLICIT_EULER), gx.FixedSteps(scheme=gx.TR_BDF2)],
    ids=["adaptive", "adaptive Euler", "TR-BDF2"],
)
def test_inertia_has_its_own_scheme(stepping):
    """Its rate of momentum is by implicit Euler: another scheme for the density alone would be of no order."""
    scene = body(gx.Q1, inertia=gx.Inertia())
    with pytest.raises(
        gx.InputError, match=r"^the scene 'block' has inertia and is to be integrated by .* in FixedSte"
    ):
        next(gx.march(scene, gx.Q1, stepping=stepping))
    assert next(gx.march(scene, gx.Q1)).time == pytest.approx(0.1)


@kinds
def test_a_step_that_is_taken_back_leaves_nothing_behind(variant):
    """The same step after one that was too long: every digit is as if that had never been tried."""
    plain, tried = gx.discretise(body(variant), variant), gx.discretise(body(variant), variant)
    for problem in (plain, tried):
        newton = Newton(problem.system, NewtonSettings(1e-13))
        integrator = Integrator(problem, newton, gx.TR_BDF2, estimate=True)
        integrator.step(0.0, 0.2)
        integrator.accept()
        if problem is tried:
            integrator.step(0.2, 0.4)
            problem.system.reject_step()
        integrator.step(0.2, 0.3)
        integrator.accept()
        newton.destroy()
    assert densities(tried) == pytest.approx(densities(plain), rel=1e-11)
    assert COMM.allreduce(tried.mass()) == pytest.approx(COMM.allreduce(plain.mass()), rel=1e-12)
