"""Factors made right from the cells, one for each load case: of the tangent's own blocks, with the same solutions."""

import dolfinx
import numpy as np
import pytest
from blocks import COMM, block, cube, densities, displacements, run, square, tangent
from mpi4py import MPI
from petsc4py import PETSc
from scipy.linalg import eigh

import growthx as gx
from growthx.solvers import linear_solvers, single_factor
from growthx.solvers import tangent as tangents
from growthx.solvers.newton import Newton
from growthx.solvers.settings import NewtonSettings
from growthx.solvers.tangent import Softest, negative_pivots

DOUBLE = "CHOLMOD" if COMM.size == 1 else "MUMPS"
RESTING = {"growing": ("bone",), "material": gx.Material({"bone": 1.0, "implant": 20.0}, 0.25, 1.2)}


def cases(dim):
    """Three, of unlike weights: one more than ranks in the tests."""
    pulls = ((0.7, (0.1, 0.0, 0.0)), (0.2, (0.0, 0.05, 0.0)), (0.1, (-0.03, 0.02, 0.01)))
    loads = [(weight, (gx.Traction("right", force[:dim]),)) for weight, force in pulls]
    return {"loads": (), "cases": tuple(gx.LoadCase(f"case {n}", *load) for n, load in enumerate(loads))}


@pytest.fixture(autouse=True)
def of_any_size(monkeypatch):
    """Small systems are enough to try it on."""
    monkeypatch.setattr(single_factor, "SMALLEST", 1)


def mesh_of(dim, variant, cells=2):
    """Distorted, so that no two cells are alike."""
    return (square if dim == 2 else cube)(cells, 0.04, shape=variant.cells[dim - 2])


@pytest.mark.parametrize(
    ("variant", "dim", "changes"),
    [
        (gx.Q1P0, 2, {}),
        (gx.Q1, 2, RESTING),
        (gx.S2fri, 3, {}),
        (gx.P1P0, 3, cases(3)),
        (gx.Q1, 3, cases(3) | RESTING),
        (gx.P2, 2, cases(2)),
    ],
    ids=["mean density", "resting", "serendipity", "cases", "cases, resting", "cases, degree two"],
)
def test_the_blocks_are_those_of_the_tangent(variant, dim, changes, monkeypatch):
    """To round-off, whatever the order of nodes in the cells, on any number of ranks, ones where the body is held."""
    problem = gx.discretise(block(mesh_of(dim, variant), **changes), variant)
    problem.system.begin_step(0.1, 1.0)
    factors = Newton(problem.system)._tangent._cells
    numbers = np.random.default_rng(COMM.rank).normal(size=problem.system.owned)
    problem.system.start_from(0.02 * numbers)
    problem.system.out_of_balance()
    factors.assemble()
    own = blocks_of(factors)
    monkeypatch.setattr(single_factor, "SMALLEST", 10**9)
    whole = tangent(problem)
    for part, places in enumerate(global_places(problem)):
        expected = whole[np.ix_(places, places)]
        assert own[part] == pytest.approx(expected, rel=1e-10, abs=1e-12 * np.abs(expected).max())


def blocks_of(factors):
    """Each block as an array, on all ranks: its products with unit vectors on its owner."""
    size = int(factors._numbers.sum())
    found = {}
    for part, factor in factors._factors.items():
        found[part] = np.array([factor.times(factors._values[part], unit) for unit in np.eye(size)])
    everything = {}
    for others in COMM.allgather(found):
        everything |= others
    return everything


def global_places(problem):
    """Of each displacement, where it is among all unknowns, in the order of its own space."""
    first = COMM.exscan(problem.system.owned) or 0
    size = problem.displacement_space.dofmap.index_map.size_local * problem.scene.mesh.dim
    unknowns = np.arange(len(problem.system.unknown.x.array))
    parts = [first + unknowns[part][:size] for part in problem.system.layout.parts]
    return [np.concatenate(COMM.allgather(part)) for part in parts]


@pytest.mark.parametrize(("variant", "dim"), [(gx.Q1P0, 2), (gx.P1P0, 3)], ids=["plane", "space"])
@pytest.mark.parametrize("changes", [{}, RESTING], ids=["all grows", "resting"])
def test_load_cases_on_their_own_do_not_show_in_the_solution(variant, dim, changes, monkeypatch):
    """What couples them is left out of the steering alone: the same digits by nearly as many iterations."""
    scene = block(mesh_of(dim, variant), **cases(dim), **changes)
    steps, problem = run(scene, variant)
    assert steps[-1].newton.linear_solver == "Cholesky (CHOLMOD, single precision) of each load case"
    monkeypatch.setattr(single_factor, "SMALLEST", 10**9)
    others, other = run(scene, variant)
    assert others[-1].newton.linear_solver == f"Cholesky ({DOUBLE})"
    assert displacements(problem) == pytest.approx(displacements(other), rel=1e-8, abs=1e-10)
    assert sum(step.newton_iterations for step in steps) <= 1.5 * sum(step.newton_iterations for step in others)


def test_factors_that_leave_coupling_out_are_not_renewed_for_it(monkeypatch):
    """However new it is, such a factor is as slow as what it leaves out: there another one is cost without gain."""
    scene = block(mesh_of(3, gx.P1P0), **cases(3), growth=gx.EnergyDrivenGrowth(0.01, 500.0))
    found = []
    for pace in (linear_solvers.PACE_OF_CASES, np.inf):
        monkeypatch.setattr(linear_solvers, "PACE_OF_CASES", pace)
        steps, problem = run(scene, gx.P1P0)
        found.append((sum(step.newton.factorisations for step in steps), densities(problem)))
    assert found[0][0] < 0.7 * found[1][0]
    assert found[0][1] == pytest.approx(found[1][1], rel=1e-8)


@pytest.mark.parametrize("changes", [{}, cases(2)], ids=["one load", "cases"])
def test_they_give_way_where_single_precision_is_not_enough(changes, monkeypatch):
    """On all ranks at once, though one alone has looked at the solution: from then on the whole tangent, in double."""
    look = single_factor.Factor._looked_at

    def find_it_poor(factor, *arguments):
        found = look(factor, *arguments)
        factor.is_poor = True
        return found

    monkeypatch.setattr(single_factor.Factor, "_looked_at", find_it_poor)
    steps, problem = run(block(**changes), gx.Q1P0)
    assert steps[-1].newton.linear_solver == f"Cholesky ({DOUBLE})"
    monkeypatch.undo()
    _, other = run(block(**changes), gx.Q1P0)
    assert displacements(problem) == pytest.approx(displacements(other), rel=1e-8, abs=1e-10)


def test_a_block_without_a_factor_is_told_on_all_ranks(monkeypatch):
    """Only its owner knows at first; the others would wait for it in the next solution for ever."""
    problem = gx.discretise(block(**cases(2)), gx.Q1P0)
    problem.system.begin_step(0.1, 0.5)
    problem.system.out_of_balance()
    newton = Newton(problem.system)
    cells = newton._tangent._cells
    assert cells.assemble()
    if 0 in cells._factors:
        monkeypatch.setattr(cells._factors[0], "factorise", lambda values: False)
    assert not cells.assemble()
    newton._tangent.renew(newton._assemble_tangent)
    assert newton.linear_solver.description == f"Cholesky ({DOUBLE})"


def test_ranks_share_the_load_cases():
    """Each factor is made once, where one of all would be made on each."""
    problem = gx.discretise(block(**cases(2)), gx.Q1P0)
    problem.system.begin_step(0.1, 0.5)
    problem.system.out_of_balance()
    cells = Newton(problem.system)._tangent._cells
    cells.assemble()
    assert COMM.allreduce(len(cells._factors), MPI.SUM) == 3
    assert len(cells._factors) <= -(-3 // COMM.size)


def test_they_are_for_kept_symmetric_tangents_alone():
    """A full Newton method has the whole tangent; PETSc's options are for a matrix; bounds and nodes have their own."""
    system = gx.discretise(block(**cases(2)), gx.Q1P0).system
    assert Newton(system)._tangent._cells is not None
    assert Newton(system, NewtonSettings(full=True))._tangent._cells is None
    options = PETSc.Options("growthx_")
    options["pc_factor_mat_solver_type"] = "mumps"
    try:
        assert Newton(system)._tangent._cells is None
    finally:
        options.delValue("pc_factor_mat_solver_type")
    for variant in (gx.Q1Q1, gx.Q1sri):
        assert Newton(gx.discretise(block(), variant).system)._tangent._cells is None


def test_large_load_cases_go_to_multigrid(monkeypatch):
    """Where no memory is for factors, one for each case, the whole tangent is iterated on."""
    monkeypatch.setattr(linear_solvers, "LARGEST_SINGLE", dict.fromkeys(linear_solvers.LARGEST_SINGLE, 0))
    assert linear_solvers.cell_factors(gx.discretise(block(**cases(2)), gx.Q1P0).system) is None


def pressed(load, rate, until, second=1.0):
    """A column under two pressing loads at their own times, which it bears alone, growing stiff, but not together.

    Denser where the mean of their energies is high, it does not yield to one bending both ways at once: what becomes
    stiffer in one case becomes as much softer in the other.
    """
    domain = dolfinx.mesh.create_rectangle(COMM, ((0.0, 0.0), (4.0, 1.0)), (24, 6), dolfinx.mesh.CellType.quadrilateral)
    ends = {name: lambda x, at=at: np.isclose(x[0], at) for name, at in (("left", 0.0), ("right", 4.0))}
    presses = [gx.Traction("right", (-load * share, 0.0)) for share in (1.0, second)]
    return gx.Scene(
        name="column",
        mesh=gx.Mesh.with_names(domain, ends),
        material=gx.Material(young=1.0, poisson=0.2, reference_density=1.0),
        growth=gx.EnergyDrivenGrowth(attractor=2e-4, rate=rate),
        supports=(gx.Support("left"),),
        loads=(),
        cases=tuple(gx.LoadCase(f"press {n}", 0.5, (press,)) for n, press in enumerate(presses)),
        program=gx.Program(step=0.1, until=until),
    )


@pytest.mark.parametrize(
    ("load", "rate", "second", "later"),
    [(0.005, 1e5, 1.0, False), (0.016, 1e5, 1.0, False), (0.008, 3e3, 0.9, True)],
    ids=["soft", "heavy", "in a later step"],
)
def test_a_saddle_is_noticed_whose_blocks_are_all_definite(load, rate, second, later):
    """The run ends where full Newton's method ends it, with the same sentence, and no state it took is a saddle."""
    ends, taken = [], []
    for full in (False, True):
        scene = pressed(load, rate, 1.0 if later else 0.4, second)
        problem, times = gx.discretise(scene, gx.Q1), [0.0]
        with pytest.raises(gx.EndedEarly, match="the balance that was found is not stable") as caught:
            for step in gx.march(scene, gx.Q1, problem, full_newton=full):
                times.append(step.time)
                assert later or negative_pivots(problem.system) == 0
        ends.append(times[-1])
        taken.append(str(caught.value).partition(": the body")[0])
    assert ends[0] == pytest.approx(ends[1], abs=0.1 + 1e-9 if later else 1e-12)
    assert later or taken[0] == taken[1]


def test_a_stable_run_is_looked_at_without_a_trace(monkeypatch):
    """To the bit: what is looked for along the way moves nothing, and finds nothing."""
    scene, looks, look = block(mesh_of(2, gx.Q1P0), **cases(2)), [], Softest.is_indefinite

    def noted(self, *arguments, **options):
        looks.append(look(self, *arguments, **options))
        return looks[-1]

    monkeypatch.setattr(Softest, "is_indefinite", noted)
    _, problem = run(scene, gx.Q1P0)
    assert looks and not any(looks)
    monkeypatch.setattr(Newton, "_coupled_directions", lambda newton: 0)
    _, other = run(scene, gx.Q1P0)
    assert np.array_equal(problem.system.unknown.x.array, other.system.unknown.x.array)
    assert np.array_equal(problem.density.x.array, other.density.x.array)


def test_a_direction_is_looked_at_again_after_a_difference_that_is_no_number(monkeypatch):
    """Beyond what is admissible residuals are not finite; what had been found holds, and no look is the last one."""
    found, follow, lowest = [], Softest._follow, Softest._lowest

    def once_broken(self, basis):
        return lowest(self, basis) if len(basis) == 1 or found else (np.zeros(len(basis)), np.nan)

    def noted(self, *arguments):
        found.append(follow(self, *arguments))
        return found[-1]

    monkeypatch.setattr(Softest, "_lowest", once_broken)
    monkeypatch.setattr(Softest, "_follow", noted)
    monkeypatch.setattr(tangents, "WAIT", 1)
    run(block(mesh_of(2, gx.Q1P0), **cases(2)), gx.Q1P0)
    assert len(found) > 1 and np.all(np.isfinite(found))


def test_the_quotient_is_the_lowest_of_the_whole_tangent_beside_its_blocks(monkeypatch):
    """Followed long enough it is the lowest eigenvalue, on any number of ranks."""
    monkeypatch.setattr(tangents, "CLOSE_TO_ZERO", np.inf)
    monkeypatch.setattr(tangents, "SETTLED", 1e-8)
    monkeypatch.setattr(tangents, "MOST_STEPS", 60)
    found, follow = [], Softest._follow

    def noted(self, *arguments):
        found.append(follow(self, *arguments))
        return found[-1]

    monkeypatch.setattr(Softest, "_follow", noted)
    scene = block(mesh_of(2, gx.Q1P0), **cases(2), program=gx.Program(step=0.1, until=0.1))
    _, problem = run(scene, gx.Q1P0)
    monkeypatch.setattr(single_factor, "SMALLEST", 10**9)
    whole = tangent(problem)
    blocks = np.zeros_like(whole)
    for places in global_places(problem):
        blocks[np.ix_(places, places)] = whole[np.ix_(places, places)]
    assert found[-1] == pytest.approx(eigh(whole, blocks, eigvals_only=True)[0], rel=0.02)
