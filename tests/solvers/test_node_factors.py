"""The block step for nodal densities, made right from the cells: the tangent's own blocks, with the same solutions."""

import numpy as np
import pytest
from blocks import COMM, block, cube, densities, displacements, run, square, tangent

import growthx as gx
from growthx.fem import compat
from growthx.fem.sums import sweeps
from growthx.solvers import linear_solvers, node_factors, single_factor
from growthx.solvers.newton import Newton
from growthx.solvers.node_factors import WHOLE, NodeFactors

pytestmark = pytest.mark.skipif(
    COMM.size > 1 or not compat.CELLS_OF_INTEGRALS, reason="several ranks, or other cells, go by PETSc's matrix"
)
CASES = {
    "loads": (),
    "cases": tuple(
        gx.LoadCase(f"case {x}", 0.5, (gx.Traction("right", force),))
        for x, force in enumerate([(0.1, 0.0), (0.0, 0.04)])
    ),
}
HELD = {"prescribed_densities": (gx.PrescribedDensity("left", 1.1),), "flux": gx.MassFlux(0.3)}
RESTING = {"growing": ("bone",), "material": gx.Material({"bone": 1.0, "implant": 20.0}, 0.25, 1.2)}
NAME = "block step (Cholesky (CHOLMOD, single precision))"


@pytest.fixture(autouse=True)
def of_any_size(monkeypatch):
    """Small systems are enough to try it on, whatever the CPU."""
    monkeypatch.setattr(single_factor, "SMALLEST", 1)
    monkeypatch.setattr(sweeps, "FEWEST", 0)
    monkeypatch.setattr(sweeps, "WIDTH", 1)
    monkeypatch.setattr(linear_solvers, "LARGEST_MONOLITHIC", dict.fromkeys(linear_solvers.LARGEST_MONOLITHIC, 0))


def scene_of(dim, variant, **changes):
    """Distorted, so that no two cells are alike."""
    return block((square if dim == 2 else cube)(2, 0.04, shape=variant.cells[dim - 2]), **changes)


@pytest.mark.parametrize(
    ("variant", "dim", "changes"),
    [
        (gx.Q1Q1, 2, {}),
        (gx.Q1Q1, 2, CASES),
        (gx.Q1Q1, 2, HELD),
        (gx.Q1Q1, 2, RESTING),
        (gx.Q1Q1, 3, {}),
        (gx.P1P1, 2, {}),
        (gx.P1P1, 3, {}),
        (gx.Q2Q2, 2, {}),
        (gx.Q1Q1.lumped(), 2, {}),
    ],
    ids=["plane", "cases", "held", "resting", "space", "triangles", "tetrahedra", "degree two", "lumped"],
)
def test_blocks_and_solutions_are_those_of_the_matrix(variant, dim, changes, monkeypatch):
    """The sum of the cells to round-off, and a run's fields to the tolerance of the balances."""
    scene = scene_of(dim, variant, **changes)
    problem = gx.discretise(scene, variant)
    problem.system.begin_step(0.1, 1.0)
    numbers = np.random.default_rng(5).normal(size=problem.system.owned)
    problem.system.start_from(problem.system.unknown.x.array[: problem.system.owned] + 0.01 * numbers)
    problem.system.out_of_balance()
    with Newton(problem.system) as newton:
        factors = newton._tangent._cells
        assert isinstance(factors, NodeFactors)
        assert factors._sums.add_up(problem.system.tangents)
        free = ~factors._held
        x = np.where(free, numbers[factors._sums.places], 0.0)
        found = factors._sums.times(WHOLE, WHOLE, x)
    steps, solved = run(scene, variant)
    assert steps[-1].newton.linear_solver == NAME
    without(monkeypatch)
    side = np.zeros(problem.system.owned)
    side[factors._sums.places] = x
    expected = (tangent(problem) @ side)[factors._sums.places]
    assert found[free] == pytest.approx(expected[free], rel=1e-10, abs=1e-11 * np.abs(expected).max())
    _, other = run(scene, variant)
    assert displacements(solved) == pytest.approx(displacements(other), rel=1e-8, abs=1e-10)
    assert densities(solved) == pytest.approx(densities(other), rel=1e-8)


def without(monkeypatch):
    monkeypatch.setattr(linear_solvers, "node_factors", lambda problem: None)


def test_poor_steps_are_made_better_ones(monkeypatch):
    """Watched, each is a solution to a tenth: no more iterations than where none is, and the same fields."""
    scene = scene_of(2, gx.Q1Q1, **CASES)
    steps, problem = run(scene, gx.Q1Q1)
    monkeypatch.setattr(node_factors, "POOR", 0.0)
    watched, other = run(scene, gx.Q1Q1)
    assert watched[-1].newton.linear_solver == NAME
    assert sum(step.newton_iterations for step in watched) <= sum(step.newton_iterations for step in steps)
    assert densities(problem) == pytest.approx(densities(other), rel=1e-8)


def test_the_steps_with_factors_that_are_watched_solve():
    """What is left of the residual is told by the matrix of the factors, whatever Newton's method makes of it."""
    problem = gx.discretise(scene_of(2, gx.Q1Q1, **CASES), gx.Q1Q1)
    problem.system.begin_step(0.1, 1.0)
    problem.system.out_of_balance()
    with Newton(problem.system) as newton:
        factors = newton._tangent._cells
        assert factors.assemble()
        factors._fresh, factors._watched = False, True
        side = np.where(factors._held, 0.0, np.random.default_rng(3).normal(size=factors._held.shape))
        found = factors._looked_at(side, np.zeros_like(side))
        rest = np.linalg.norm(side - factors._product(found))
        assert rest <= node_factors.ENOUGH * np.linalg.norm(side)
        assert not factors.is_poor


def test_where_no_steps_lead_to_a_solution_it_gives_way(monkeypatch):
    """From the next factor on there is PETSc's matrix, with the same fields."""
    scene = scene_of(2, gx.Q1Q1)
    for name, value in {"POOR": 0.0, "ENOUGH": 0.0, "MOST_ITERATIONS": 0}.items():
        monkeypatch.setattr(node_factors, name, value)
    steps, problem = run(scene, gx.Q1Q1)
    assert steps[-1].newton.linear_solver != NAME
    without(monkeypatch)
    _, other = run(scene, gx.Q1Q1)
    assert densities(problem) == pytest.approx(densities(other), rel=1e-8)


def test_nodes_that_come_to_be_lumped_have_petsc_s_matrix():
    """What is added then is not known by nodes: it would be left out."""
    problem = gx.discretise(scene_of(2, gx.Q1Q1), gx.Q1Q1)
    problem.system.begin_step(0.1, 1.0)
    with Newton(problem.system) as newton:
        assert newton.linear_solver.description == NAME
        problem.system.densities.lumped._set(np.ones(len(problem.state.density.x.array), dtype=bool))
        assert newton.solve().converged
        assert newton.linear_solver.description != NAME


@pytest.mark.parametrize("variant", [gx.S2Q1, gx.P2P1], ids=lambda v: v.name)
def test_densities_of_other_nodes_than_displacements_go_by_petsc_s_matrix(variant):
    """A block of all unknowns of a node there is none."""
    with Newton(gx.discretise(scene_of(2, variant), variant).system) as newton:
        assert newton._tangent._cells is None
