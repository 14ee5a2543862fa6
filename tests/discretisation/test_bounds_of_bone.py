"""Bounds that bone reaches on the way, with factors that are kept: the same states, and no more work than without."""

from dataclasses import replace

import numpy as np
import pytest
from blocks import block, cube, densities, displacements, gathered, run, square

import growthx as gx
from growthx.discretisation.variants import CATALOGUE
from growthx.solvers import linear_solvers, single_factor

LOCAL = [variant for variant in CATALOGUE.values() if variant.density.local]
every_local_variant = pytest.mark.parametrize("variant", LOCAL, ids=lambda variant: variant.name)
LOW, HIGH = 1.4, 1.7  # g/cm³
TRACTION = (40.0, -8.0, 3.0)  # MPa: strains of some 1e-3
WEIGHTS = (0.6, 0.3, 0.1)
TURNS = ((1.0, 1.0, 1.0), (0.6, -1.5, 1.0), (-0.5, 0.5, 2.0))  # of the traction, in three load cases


def bone(mesh, bounds=(LOW, HIGH), *, separate=False):
    """A bent block of bone in MPa, whose densities begin between the bounds.  separate: under three load cases."""
    tractions = [
        gx.Traction("right", tuple(turn * force for turn, force in zip(turns, TRACTION, strict=True))[: mesh.dim])
        for turns in TURNS
    ]
    names = ("stance", "swing", "stairs")
    cases = [
        gx.LoadCase(name, weight, (traction,)) for name, weight, traction in zip(names, WEIGHTS, tractions, strict=True)
    ]
    return block(
        mesh,
        material=gx.Material(young=17_000.0, poisson=0.3, reference_density=1.8),
        growth=gx.EnergyDrivenGrowth(0.07, 20.0, bounds=bounds),
        initial_density=1.6,
        program=gx.Program(step=0.1, until=1.0, ramp=0.2),
        loads=() if separate else tractions[:1],
        cases=tuple(cases) if separate else (),
    )


def mesh_of(variant, dim):
    return (square(4, 0.04, shape=variant.cells[0])) if dim == 2 else cube(2, 0.04, shape=variant.cells[1])


def at_bounds(problem):
    density = gathered(problem.density.x.array[problem.growing_dofs])
    return np.array([np.count_nonzero(density == bound) for bound in (LOW, HIGH)])


@every_local_variant
@pytest.mark.parametrize("separate", [False, True], ids=["one load", "load cases"])
@pytest.mark.parametrize("dim", [2, 3])
def test_kept_factors_find_the_states_of_the_full_method(variant, dim, separate, monkeypatch):
    """Which cells are at a bound changes from step to step, beside a factor that was made for others."""
    monkeypatch.setattr(single_factor, "SMALLEST", 1)
    scene = bone(mesh_of(variant, dim), separate=separate)
    full, same = run(scene, variant, full_newton=True)
    problem, counts, kept = gx.discretise(scene, variant), [], []
    for step in gx.march(scene, variant, problem):
        assert step.newton.residual_norms[-1] <= 1e-10
        assert step.mass_defect < 1e-10
        counts.append(at_bounds(problem))
        kept.append(step.newton_iterations)
    low, high = counts[-1] - counts[0]
    assert high > 0 and (separate or low > 0), "bounds must be reached on the way"
    assert len({tuple(count) for count in counts}) >= 3, "what is at the bounds must change from step to step"
    assert densities(problem) == pytest.approx(densities(same), rel=1e-9)
    assert displacements(problem) == pytest.approx(displacements(same), rel=1e-9, abs=1e-12)
    # The tangent is right beside the kink, too: Newton's method itself needs few.
    assert max(step.newton_iterations for step in full) <= 6
    free, _ = run(bone(scene.mesh, (None, None), separate=separate), variant)
    assert sum(kept) <= 1.2 * sum(step.newton_iterations for step in free), "bounds must cost no iterations"


@pytest.mark.parametrize("separate", [False, True], ids=["one load", "load cases"])
@pytest.mark.parametrize("variant", [gx.Q1Q1, gx.P2P1], ids=lambda variant: variant.name)
def test_large_systems_of_nodal_densities_are_solved_by_multigrid(variant, separate, monkeypatch):
    """Rows of densities at a bound are taken out, others in each iteration: the same states as by a factor of the rest.

    Beside a region that rests, whose rows are held and must stay as they are.
    """
    scene = replace(bone(cube(2, 0.04, shape=variant.cells[1]), separate=separate), growing=("bone",))
    few, same = run(scene, variant)
    assert few[-1].newton.linear_solver == "LU (MUMPS)"
    monkeypatch.setattr(linear_solvers, "LARGEST_MONOLITHIC", dict.fromkeys(linear_solvers.LARGEST_MONOLITHIC, 0))
    steps, problem = run(scene, variant)
    assert steps[-1].newton.linear_solver == "flexible GMRES with field split of what is at no bound (GAMG)"
    assert min(at_bounds(problem)) > 0 or separate
    assert at_bounds(problem).tolist() == at_bounds(same).tolist()
    assert densities(problem) == pytest.approx(densities(same), rel=1e-9)
    assert displacements(problem) == pytest.approx(displacements(same), rel=1e-9, abs=1e-12)
    assert sum(step.newton_iterations for step in steps) <= 1.3 * sum(step.newton_iterations for step in few)
