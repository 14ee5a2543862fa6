"""Load cases at their own times: a displacement for each, and one density driven by the mean of their energies."""

import csv
from dataclasses import replace

import dolfinx
import numpy as np
import pytest
from blocks import (
    COMM,
    ROLLERS,
    assert_tangent_matches_differences,
    block,
    densities,
    differences,
    displacements,
    run,
    square,
    tangent,
)
from scipy.optimize import root

import growthx as gx
from growthx.common.errors import InputError
from growthx.scenes.femur import LOAD_CASES, combination, femur

KINDS = (gx.Q1, gx.Q1P0, gx.Q1sri, gx.Q1Q1, gx.S2fri, gx.P2)
kinds = pytest.mark.parametrize("variant", KINDS, ids=lambda variant: variant.name)
PULL, LIFT = gx.Traction("right", (0.1, -0.02)), gx.Traction("top", (0.03, 0.05))
OPEN = {"": (), "open load": (gx.Pressure("right", 0.05),)}


def day(first=3.0, second=1.0, further=(), **changes):
    """The block under two load cases that pull at different sides; `further` loads act in the second."""
    cases = (gx.LoadCase("pull", first, (PULL,)), gx.LoadCase("lift", second, (LIFT, *further)))
    return block(**{"loads": (), "cases": cases, **changes})


def test_a_scene_of_cases_needs_no_other_loads():
    """A newcomer's: what each case has is all there is, and a forgotten program is told, not found by Python."""
    scene = day()
    parts = {name: getattr(scene, name) for name in ("name", "mesh", "material", "growth", "supports", "cases")}
    assert gx.Scene(**parts, program=scene.program).loads == ()
    with pytest.raises(InputError, match=r"^the program of the scene '.*' is None: a Program would be right$"):
        gx.Scene(**parts)


def far_from_balance(scene, variant):
    """The discretised scene at an iterate that differs between the cases."""
    problem = gx.discretise(scene, variant)
    problem.system.begin_step(0.1, 0.7, 0.1)
    shape = dolfinx.fem.Function(problem.displacement_space)
    for part, sign in zip(problem.system.unknowns.parts, (1, -1), strict=True):
        shape.interpolate(
            lambda x, sign=sign: np.stack(
                [0.3 * np.sin(2 * x[0]) + sign * 0.1 * x[1], 0.2 * x[0] * x[1] - 0.15 * sign * x[1]]
            )
        )
        problem.system.unknown.x.array[part] = shape.x.array
    for held in problem.system.supports.held:
        problem.system.unknown.x.array[held.dofs] = 0.0
    problem.system.unknown.x.scatter_forward()
    return problem


def of_cases(problem):
    """(x, y, u_x, u_y) at all corners for each load case, shape (cases, corners, 4)."""
    found, mean = [], problem.displacement.x.array.copy()
    for u in problem.displacements:
        problem.displacement.x.array[:] = u.x.array
        found.append(displacements(problem))
    problem.displacement.x.array[:] = mean
    return np.array(found)


# -- the tangent -------------------------------------------------------------------------------------------------------


@kinds
@pytest.mark.parametrize("further", OPEN.values(), ids=OPEN)
@pytest.mark.parametrize("growing", [None, ("bone",)], ids=["", "resting region"])
def test_tangent_is_the_derivative_of_the_forces(variant, growing, further):
    """The cases meet in the one density: a block of the tangent that is forgotten costs Newton its speed."""
    problem = far_from_balance(
        day(mesh=square(2, 0.06, shape=variant.cells[0]), growing=growing, further=further), variant
    )
    assert_tangent_matches_differences(problem, tangent(problem))


@kinds
def test_the_cases_are_coupled_by_the_density(variant):
    """Entry by entry, and the displacement of one case must feel that of the other, or no density is shared."""
    problem = far_from_balance(day(mesh=square(2, 0.06, shape=variant.cells[0])), variant)
    exact = tangent(problem)
    assert exact == pytest.approx(differences(problem), rel=1e-6, abs=1e-8 * np.abs(exact).max())
    if COMM.size == 1 and variant.density.local:
        coupling = exact[np.ix_(problem.system.unknowns.parts[0], problem.system.unknowns.parts[1])]
        assert np.abs(coupling).max() > 1e-5 * np.abs(exact).max()


@kinds
@pytest.mark.parametrize("further", OPEN.values(), ids=OPEN)
def test_the_condensed_tangent_is_symmetric_under_dead_loads(variant, further):
    """The weights make it so, and Newton's solver factorises it as symmetric on the word of `symmetric`."""
    problem = far_from_balance(day(mesh=square(2, 0.06, shape=variant.cells[0]), further=further), variant)
    exact = tangent(problem)
    asymmetry = np.abs(exact - exact.T).max() / np.abs(exact).max()
    assert problem.system.symmetric == (variant not in (gx.Q1sri, gx.Q1Q1) and not further)
    assert asymmetry < 1e-14 if problem.system.symmetric else asymmetry > 1e-4


# -- against the single displacement -----------------------------------------------------------------------------------


@kinds
@pytest.mark.parametrize("weights", [(7.0,), (1.0, 1.0), (3.0, 1.0)], ids=str)
def test_equal_cases_are_one_displacement(variant, weights):
    """However often the same loads are counted, each displacement and the density are those of the plain run."""
    mesh = square(3, 0.05, shape=variant.cells[0])
    cases = tuple(gx.LoadCase(f"case {i}", weight, (PULL,)) for i, weight in enumerate(weights))
    plain, several = (run(s, variant)[1] for s in (block(mesh), block(mesh, loads=(), cases=cases)))
    assert densities(several) == pytest.approx(densities(plain), rel=1e-12, abs=1e-13)
    expected = displacements(plain)
    assert np.abs(expected[:, 2:]).max() > 0.01
    for found in (*of_cases(several), displacements(several)):
        assert found == pytest.approx(expected, rel=1e-11, abs=1e-13)


@kinds
def test_loads_of_the_scene_act_in_every_case(variant):
    """What always acts, such as weight, is given once: it must be added to each case in full."""
    mesh = square(3, 0.05, shape=variant.cells[0])
    cases = (gx.LoadCase("pull", 3.0, (PULL,)), gx.LoadCase("rest", 1.0, ()))
    shared = block(mesh, loads=(LIFT,), cases=cases)
    spelled = replace(shared, loads=(), cases=(replace(cases[0], loads=(LIFT, PULL)), replace(cases[1], loads=(LIFT,))))
    first, second = (run(scene, variant)[1] for scene in (shared, spelled))
    assert densities(first) == pytest.approx(densities(second), rel=1e-12)
    assert of_cases(first) == pytest.approx(of_cases(second), rel=1e-11, abs=1e-13)


# -- the mean of the energies ------------------------------------------------------------------------------------------

STEP, WEIGHTS, TRACTIONS = 0.2, (0.3, 0.7), (0.5, -0.2)


def two_stretches(material, growth, steps):
    """Rows (λ₁, λ₂ of the first case, of the second, ρ), implicit Euler with the mean energy, written from (6), (7)."""
    lam, mu = 3.0 * 0.3 / (1.3 * 0.4), 3.0 / 2.6

    def balances(state, old):
        rho = state[4]
        weight, energy, rows = (rho / 1.2) ** 2, 0.0, []
        for part, traction, (a, b) in zip(WEIGHTS, TRACTIONS, state[:4].reshape(2, 2), strict=True):
            log = np.log(a * b)
            energy += part * (lam / 2 * log**2 + mu / 2 * (a**2 + b**2 - 2 - 2 * log))
            rows += [weight * (mu * a + (lam * log - mu) / a) - traction, weight * (mu * b + (lam * log - mu) / b)]
        return [*rows, rho - old - STEP * 4.0 * ((rho / 1.2) ** -3 * weight * energy - 0.02)]

    state, found = np.array([1.0, 1.0, 1.0, 1.0, 1.2]), []
    for _ in range(steps):
        solution = root(balances, state, args=(state[4],), tol=1e-14)
        assert np.abs(solution.fun).max() < 1e-13
        state = solution.x
        found.append(state)
    return np.array(found)


@kinds
def test_the_density_is_driven_by_the_weighted_mean_of_the_energies(variant):
    """A homogeneous block pulled in one case and pushed in the other is five scalar equations."""
    material, growth = gx.Material(3.0, 0.3, 1.2), gx.EnergyDrivenGrowth(0.02, 4.0)
    cases = tuple(
        gx.LoadCase(name, weight, (gx.Traction("right", (traction, 0.0)),))
        for name, weight, traction in zip(("pulled", "pushed"), WEIGHTS, TRACTIONS, strict=True)
    )
    scene = block(
        square(2, 0.08, shape=variant.cells[0]),
        material=material,
        growth=growth,
        supports=ROLLERS,
        loads=(),
        cases=cases,
        program=gx.Program(step=STEP, until=5 * STEP),
    )
    problem, expected = gx.discretise(scene, variant), two_stretches(material, growth, 5)
    assert np.ptp(expected[:, 4]) > 0.005, "the density must move for the comparison to mean something"
    steps = gx.march(scene, variant, problem, tolerance=1e-13)
    for step, (*stretches, rho) in zip(steps, expected, strict=True):
        assert (step.min_density, step.max_density) == pytest.approx((rho, rho), rel=1e-10)
        for corners, along, across in zip(of_cases(problem), stretches[::2], stretches[1::2], strict=True):
            x, y, u, v = corners.T
            assert u == pytest.approx((along - 1) * x, abs=1e-10)
            assert v == pytest.approx((across - 1) * y, abs=1e-10)


@kinds
def test_only_the_ratio_and_not_the_order_counts(variant):
    """Weights are hours or shares of the day, as the user has them, in any order."""
    mesh = square(3, 0.05, shape=variant.cells[0])
    scene = day(mesh=mesh)
    backwards = replace(scene, cases=scene.cases[::-1])
    first, scaled, turned, other = (
        run(s, variant)[1] for s in (scene, day(0.75, 0.25, mesh=mesh), backwards, day(1.0, 3.0, mesh=mesh))
    )
    for same, order in ((scaled, [0, 1]), (turned, [1, 0])):
        assert densities(same) == pytest.approx(densities(first), rel=1e-12)
        assert of_cases(same)[order] == pytest.approx(of_cases(first), rel=1e-10, abs=1e-13)
    assert np.abs(densities(other) - densities(first)).max() > 1e-4


@pytest.mark.parametrize("law", [gx.StrainDrivenGrowth(0.05), gx.EnergyDrivenGrowth(0.01, 5.0, dead_zone=0.004)])
@pytest.mark.parametrize("variant", [gx.Q1, gx.Q1P0, gx.Q1Q1], ids=lambda variant: variant.name)
def test_laws_that_are_not_linear_take_the_mean_energy(variant, law):
    """The mean of the energies enters a root or a dead zone: its derivative is one of a function of all cases."""
    problem = far_from_balance(day(mesh=square(2, 0.06), growth=law), variant)
    assert_tangent_matches_differences(problem, tangent(problem))


# -- supports, reactions, pictures of the mean -------------------------------------------------------------------------


@kinds
def test_each_case_is_in_balance_by_itself(variant):
    """Reactions are forces of the case, not times its weight: minus its loads, on sides of length one."""
    steps, _ = run(day(mesh=square(3, shape=variant.cells[0])), variant)
    for step in steps:
        assert set(step.reactions) == {"pull: left", "lift: left"}
        for case, load in (("pull", PULL), ("lift", LIFT)):
            assert step.reactions[f"{case}: left"] == pytest.approx(-step.load * np.array(load.value), abs=1e-9)
        assert step.mass_defect < 1e-11


@kinds
def test_supports_hold_in_each_case(variant):
    """A case whose support is forgotten is free to move; prescribed displacements are those of every case."""
    _, problem = run(day(mesh=square(3, shape=variant.cells[0]), supports=(gx.Support("left"),)), variant)
    for x, _, u, v in of_cases(problem).transpose(0, 2, 1):
        assert np.abs([u[x < 1e-9], v[x < 1e-9]]).max() < 1e-14
        assert np.abs(u).max() > 1e-3
    _, problem = run(
        day(
            mesh=square(3, shape=variant.cells[0]),
            supports=(gx.Support("left", (0.0, None)), gx.Support("right", (0.1, 0.0))),
        ),
        variant,
    )
    for x, _, u, v in of_cases(problem).transpose(0, 2, 1):
        right = x > 1 - 1e-9
        assert u[right] == pytest.approx(0.1, rel=1e-13)
        assert np.abs(v[right]).max() < 1e-14


@kinds
def test_the_displacement_shown_is_the_mean(variant):
    """Pictures and files have one displacement: the weighted mean over the cases, which are kept beside it."""
    _, problem = run(day(3.0, 1.0, mesh=square(3, shape=variant.cells[0])), variant)
    pull, lift = of_cases(problem)
    assert np.abs(pull - lift).max() > 0.01
    assert displacements(problem) == pytest.approx(0.75 * pull + 0.25 * lift, abs=1e-14)


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1Q1], ids=lambda variant: variant.name)
def test_a_rejected_step_gives_back_every_displacement(variant):
    """A failed step must leave no case behind: the next attempt starts from the last state of all of them."""
    scene = day()
    _, problem = run(scene, variant)
    before, accepted = of_cases(problem), problem.system.unknown.x.array.copy()
    problem.system.begin_step(0.1, 1.0)
    problem.system.unknown.x.array[:] += 0.1
    problem.system.reject_step()
    assert problem.system.unknown.x.array == pytest.approx(accepted, abs=0)
    assert of_cases(problem) == pytest.approx(before, abs=0)


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1Q1, gx.S2fri], ids=lambda variant: variant.name)
def test_files_are_written(variant, shared_folder):
    """History and fields of several cases: the reactions have the case in their name, the fields are finite."""
    result = gx.solve(day(), variant, out=shared_folder / "out")
    COMM.barrier()  # rank 0 writes the history
    with (shared_folder / "out" / "history.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [float(rows[-1][f"reaction_{case}: left_x"]) for case in ("pull", "lift")] == pytest.approx(
        [-0.1, -0.03], abs=1e-9
    )
    assert len(rows) == len(result.steps)
    assert (shared_folder / "out" / "fields.pvd").is_file()
    for values in gx.results.cell_fields(result.problem).values():
        assert np.isfinite(values).all()


# -- the femur ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("number", [0, 2])
def test_a_femur_under_one_case_needs_no_cases(number):
    """The way to combine cannot matter where there is one case: stimulus and average are then the same run."""
    weights = tuple(float(i == number) for i in range(3))
    problems = [
        gx.solve(femur(size=10.0, weights=weights, separate=separate, until=40.0), gx.Q1P0).problem
        for separate in (False, True)
    ]
    assert densities(problems[1]) == pytest.approx(densities(problems[0]), rel=1e-10)
    assert displacements(problems[1]) == pytest.approx(displacements(problems[0]), rel=1e-9, abs=1e-11)


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1Q1], ids=lambda variant: variant.name)
@pytest.mark.parametrize("size", [10.0, 7.0])
def test_each_case_of_the_femur_has_the_forces_of_the_table(variant, size):
    """Full forces and not their part of the day, on every mesh: per thickness of 30 mm, directions as tabulated."""
    table = {  # joint (N), angle; abductor (N), angle, from the vertical: spec section 4
        "midstance of gait": (2317.0, 24.0, 703.0, 28.0),
        "extreme abduction": (1158.0, -15.0, 351.0, -8.0),
        "extreme adduction": (1548.0, 56.0, 468.0, 35.0),
    }
    loads = combination("stimulus")
    problem = gx.discretise(femur(size=size, weights=loads.weights, separate=loads.separate), variant)
    assert [case.weight for case in problem.spaces.cases] == pytest.approx([0.6, 0.2, 0.2], rel=1e-14)
    for number, case in enumerate(problem.spaces.cases):
        joint, a, abductor, b = table[case.name]
        a, b = np.radians([a, b])
        force = abductor * np.array([np.sin(b), np.cos(b)]) - joint * np.array([np.sin(a), np.cos(a)])
        # In the balance of momentum each case has its weight.
        assert problem.system.loads.resultant(problem.system.loads.nodal_load, number) / case.weight == pytest.approx(
            force / 30, rel=1e-12
        )


def test_the_femur_feels_how_its_cases_combine():
    """The energy of a mean force is not the mean of the energies: separate cases, which cannot cancel, keep more."""
    masses = {}
    for name in ("average", "stimulus"):
        loads = combination(name)
        scene = femur(size=10.0, weights=loads.weights, separate=loads.separate, until=40.0)
        masses[name] = gx.solve(scene, gx.Q1P0).problem.mass()
    assert masses["stimulus"] > 1.05 * masses["average"]
    assert len(LOAD_CASES) == 3


# -- refusals ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("weight", [0.0, -1.0, float("nan")])
def test_a_case_without_weight_is_refused(weight):
    """It would have a displacement that nothing depends on, and a singular system."""
    with pytest.raises(InputError, match=r"the weight of the load case 'night' .*a positive number would be right"):
        gx.LoadCase("night", weight, (PULL,))


def test_cases_of_one_name_are_refused():
    """Reactions are told apart by the names."""
    cases = (gx.LoadCase("walk", 1.0, (PULL,)), gx.LoadCase("walk", 2.0, (LIFT,)))
    with pytest.raises(InputError, match="named 'walk', 'walk': a name of its own for each would be right"):
        day(cases=cases)


def test_inertia_with_several_cases_is_refused():
    """Cases take turns over the day: they share no motion; a single one has its own."""
    with pytest.raises(InputError, match="2 load cases of one day have no common motion"):
        day(inertia=gx.Inertia())
    block(loads=(), cases=(gx.LoadCase("walk", 1.0, (PULL,)),), inertia=gx.Inertia())


@pytest.mark.parametrize("load", [gx.Traction("nowhere", (1.0, 0.0)), gx.Traction("right", (1.0, 0.0, 0.0))])
def test_loads_of_cases_are_checked_like_others(load):
    """A load hidden in a case must not escape the sentence that names its boundary or entries."""
    with pytest.raises(InputError, match=r"'nowhere'|'right' has 3 entries"):
        day(cases=(gx.LoadCase("walk", 1.0, (load,)),))
