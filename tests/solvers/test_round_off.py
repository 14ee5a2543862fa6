"""Newton's method ends where its residual has nothing more to lose, says so, and gives up soon where it stagnates."""

from dataclasses import replace

import dolfinx
import numpy as np
import pytest
import ufl
from blocks import COMM, block, cube, densities, run, square

import growthx as gx
from growthx.discretisation.variants import CATALOGUE
from growthx.solvers import round_off
from growthx.solvers.round_off import RoundOff, stagnates

variants = pytest.mark.parametrize("variant", CATALOGUE.values(), ids=CATALOGUE)
PROGRAM = gx.Program(step=0.1, until=0.4, ramp=0.2)


@variants
def test_a_tolerance_below_round_off_is_met_by_round_off(variant):
    """Asked for what doubles cannot give, a run ends as one with the usual tolerance does, and the record says why."""
    scene = block(square(4, 0.05, shape=variant.cells[0]), program=PROGRAM)
    steps, problem = run(scene, variant, tolerance=1e-18)
    usual, same = run(scene, variant)
    assert all(0 < step.newton.residual_norms[-1] <= step.newton.round_off < 1e-10 for step in steps)
    assert all("round-off" in step.newton.reason for step in steps)
    assert all(step.newton.round_off == 0 for step in usual)
    assert all(step.rejected == 0 for step in steps)
    assert sum(step.newton_iterations for step in steps) <= 2.5 * sum(step.newton_iterations for step in usual)
    assert densities(problem) == pytest.approx(densities(same), rel=1e-8)


@pytest.mark.parametrize("bounds", [(None, None), (0.5, 3.0)], ids=["full Newton", "bounds"])
def test_petscs_own_methods_end_at_round_off(bounds):
    """Full Newton steps, and those that keep to bounds of nodal densities, have the same test."""
    scene = block(square(4, 0.05), program=PROGRAM)
    scene = replace(scene, growth=replace(scene.growth, bounds=bounds))
    steps, _ = run(scene, gx.Q1Q1, tolerance=1e-18, full_newton=True)
    assert all(0 < step.newton.residual_norms[-1] <= step.newton.round_off < 1e-10 for step in steps)
    assert max(step.newton_iterations for step in steps) <= 12


def slivers(quality):
    """A cube of tetrahedra with a layer of cells that are so thin, under a field case's parameters."""
    mesh = cube(4, shape="tetrahedron")
    x = mesh.domain.geometry.x
    x[np.isclose(x[:, 1], 0.25), 1] = quality * 0.25
    x[:] *= 30.0
    return gx.Scene(
        name="slivers",
        mesh=mesh,
        material=gx.Material(young=17000.0, poisson=0.3, reference_density=1.8),
        growth=gx.EnergyDrivenGrowth(0.02, rate=20.0),
        supports=(gx.Support("left"),),
        loads=(gx.DistributedForce("right", (0.0, 0.0, -2317.0)),),
        program=PROGRAM,
        initial_density=1.2,
    )


@pytest.mark.parametrize("variant", [gx.P1P0, gx.P1, gx.P1P1, gx.P2], ids=lambda variant: variant.name)
def test_slivers_need_no_looser_tolerance(variant):
    """Cells of quality 1e-6 make the round-off of their forces larger than 1e-10 of the load; it costs nothing more."""
    steps, _ = run(slivers(1e-6), variant)
    good, _ = run(slivers(1.0), variant)
    assert max(step.newton.round_off for step in steps) > 1e-10
    for step, same in zip(steps, good, strict=True):
        assert step.newton_iterations <= same.newton_iterations + 1
        assert step.newton.factorisations <= same.newton.factorisations
        assert step.rejected == 0


def test_the_round_off_is_that_of_the_sums():
    """Of A x with large entries that cancel, it is the spread over all roundings of x."""
    random = np.random.default_rng(0)
    x = random.uniform(1.0, 2.0, 200)
    A = 1e6 * random.standard_normal((200, 200))
    A -= np.outer(A @ x, x) / (x @ x)  # A x = 0 but for round-off
    found = RoundOff(lambda y: A @ y, 1.0, COMM).norm(x, A @ x)
    errors = [np.linalg.norm(A @ (x * (1 + 1.1e-16 * random.uniform(-1, 1, 200))) - A @ x) for _ in range(20)]
    assert np.mean(errors) < found < 10 * np.mean(errors)


def rough(u, rho, x):
    """A traction whose jitter no tangent sees."""
    return ufl.as_vector([0.1 + 1e-7 * ufl.sign(ufl.sin(1e13 * u[0])), 0.0])


@pytest.mark.parametrize("variant", [gx.Q1, gx.Q1Q1], ids=lambda variant: variant.name)
def test_stagnation_ends_a_run_soon(variant):
    """Hundreds of iterations, parts and cuts help nothing where the last digits are noise of the model's own."""
    scene = block(square(3), loads=(gx.OpenTraction("right", rough),), program=PROGRAM)
    problem = gx.discretise(scene, variant)
    march = gx.march(scene, variant, problem)
    count, solve = [], march._newton.solve

    def counting(**options):
        report = solve(**options)
        count.append(report.iterations)
        return report

    march._newton.solve = counting
    with pytest.raises(gx.EndedEarly, match=r"the residual stagnates at .* of the loads"):
        list(march)
    assert max(count) <= 13 and sum(count) <= 150


def test_halving_in_eight_steps_is_no_stagnation():
    """Slow is not stuck."""
    norms = [1.0]
    while len(norms) < 30:
        norms.append(norms[-1] * 0.9)
    assert not stagnates(norms)
    assert stagnates([1.0] + [0.95**k for k in range(round_off.PATIENCE)])
    assert not stagnates([1.0] * round_off.PATIENCE)


def test_finer_meshes_keep_the_count_of_iterations():
    """h → h/8: the tolerance's scale, a norm of nodal loads, falls with h while round-off rises."""
    counts = []
    for cells in (4, 32):
        mesh = dolfinx.mesh.create_rectangle(
            COMM, ((0, 0), (20, 1)), (8 * cells, cells // 4), dolfinx.mesh.CellType.quadrilateral
        )
        ends = {"left": lambda x: np.isclose(x[0], 0), "right": lambda x: np.isclose(x[0], 20)}
        scene = replace(
            block(square(2)),
            mesh=gx.Mesh.with_names(mesh, ends),
            material=gx.Material(17000.0, 0.3),
            growth=gx.EnergyDrivenGrowth(2e-3, rate=100.0),
            loads=(gx.Traction("right", (0.0, -0.02)),),
        )
        steps, _ = run(scene, gx.Q1, tolerance=1e-11)
        counts.append(sum(step.newton_iterations for step in steps))
        assert all(step.rejected == 0 for step in steps)
    assert counts[1] <= 1.5 * counts[0]
