"""Newton's method: quadratic, with a tolerance that means the same in all units, and with a reason when it fails."""

import gc
from dataclasses import replace

import numpy as np
import pytest
import ufl
from blocks import COMM, block, densities, displacements, gathered, run, set_iterate, square
from petsc4py import PETSc

import growthx as gx
from growthx.discretisation.variants import CATALOGUE
from growthx.solvers.newton import Newton
from growthx.solvers.settings import NewtonSettings
from growthx.stepping.failure import inadmissible

variants = pytest.mark.parametrize("variant", CATALOGUE.values(), ids=CATALOGUE)
# One for each way to come by a density, and higher orders on either shape: enough where Newton's method is at stake.
KINDS = (gx.Q1Q1, gx.Q1, gx.Q1sri, gx.S2fri, gx.P2P1)
kinds = pytest.mark.parametrize("variant", KINDS, ids=lambda variant: variant.name)


def first_step(scene, variant, **options):
    """The report of the first step's Newton iteration, and its problem."""
    problem = gx.discretise(scene, variant)
    problem.system.begin_step(scene.program.step, scene.program.amplitude(scene.program.step))
    newton = Newton(problem.system, NewtonSettings(**options))
    report = newton.solve()
    newton.destroy()
    return report, problem


@variants
def test_convergence_is_quadratic(variant):
    """Each norm is about the square of the one before: only an exact tangent, with the density's part, does that."""
    report, _ = first_step(block(square(4, 0.05, shape=variant.cells[0])), variant, full=True)
    assert report.converged
    norms = np.log([norm for norm in report.residual_norms if norm > 1e-14][-4:])  # below is round-off
    assert len(norms) == 4
    order = np.polyfit(norms[:-1], norms[1:], 1)[0]
    assert order > 1.8, report.residual_norms


@kinds
def test_the_tolerance_is_met_by_the_forces_themselves(variant):
    """The last norm is that of the out-of-balance forces at the solution, over the load's."""
    report, problem = first_step(block(square(3, shape=variant.cells[0])), variant, tolerance=1e-6)
    forces = gathered(problem.system.out_of_balance())
    assert report.converged
    assert np.linalg.norm(forces) / problem.system.force_scale() == pytest.approx(
        report.residual_norms[-1], rel=1e-3, abs=1e-15
    )
    assert report.residual_norms[-1] <= 1e-6 < report.residual_norms[-2]
    assert len(report.residual_norms) == report.iterations + 1


def test_the_force_scale_is_the_norm_of_the_nodal_load():
    """The plate's digits are known for this tolerance and no other: (2, 1) on an edge of two facets, at nodes ¼ ½ ¼."""
    problem = gx.discretise(block(square(2), loads=(gx.Traction("right", (2.0, 1.0)),)), gx.Q1P0)
    assert problem.system.force_scale() == pytest.approx(np.sqrt(5 * (1 / 16 + 1 / 4 + 1 / 16)), rel=1e-14)


def test_a_load_on_what_is_held_is_no_scale():
    """What round-off leaves of it on free nodes is 1e-16 of it: a tolerance relative to that is never reached."""
    pulled = (gx.Support("left"), gx.Support("right", (0.1, 0.0)))
    scene = block(square(2), supports=pulled)
    problem, unloaded = gx.discretise(scene, gx.Q1P0), gx.discretise(replace(scene, loads=()), gx.Q1P0)
    problem.system.loads.nodal_load += 1e-16 * np.abs(problem.system.loads.nodal_load).max()
    assert problem.system.force_scale() == pytest.approx(unloaded.system.force_scale(), rel=1e-12)


@pytest.mark.parametrize("variant", [gx.P1, gx.P1P0], ids=lambda variant: variant.name)
def test_a_body_without_free_nodes_may_have_no_solution_either(variant):
    """All is held: a density that is none, or a cell that is turned over, shows in no equation that is solved."""
    held = (gx.Support("left"), gx.Support("right"))
    mesh = square(1, shape="triangle")
    growing = gx.EnergyDrivenGrowth(attractor=1.0, rate=5.0)
    scene = block(mesh, supports=held, loads=(), growth=growing, program=gx.Program(step=1.0, until=2.0))
    with pytest.raises(gx.EndedEarly, match="no positive density"):
        list(gx.march(scene, variant))
    turned = (gx.Support("left"), gx.Support("right", (-2.0, 0.0)))
    with pytest.raises(gx.EndedEarly, match="det F ≤ 0"):
        list(gx.march(replace(scene, supports=turned), variant))


@variants
@pytest.mark.parametrize(
    ("length", "stress", "density", "time"),
    [(1e-3, 1e-3, 1.0, 1.0), (1e3, 1e6, 1e-3, 86400.0), (1e-3, 1e6, 1e3, 1 / 86400)],
    ids=["N-mm to kN-m", "large", "small"],
)
@pytest.mark.parametrize("driven", ["load", "displacement"])
def test_units_change_nothing(variant, length, stress, density, time, driven):
    """Both balances are weighed on their own scales: otherwise a change of units would loosen one of them."""
    scenes = [
        _in_units(*units, driven, variant.cells[0]) for units in ((1.0, 1.0, 1.0, 1.0), (length, stress, density, time))
    ]
    (plain, scaled), (here, there) = zip(*(run(scene, variant) for scene in scenes), strict=True)
    assert [step.newton_iterations for step in scaled] == [step.newton_iterations for step in plain]
    assert densities(there)[:, 2] / density == pytest.approx(densities(here)[:, 2], rel=1e-9)
    assert displacements(there)[:, 2:] / length == pytest.approx(displacements(here)[:, 2:], rel=1e-9, abs=1e-12)
    for one, other in zip(plain, scaled, strict=True):
        assert other.newton.residual_norms[:-1] == pytest.approx(one.newton.residual_norms[:-1], rel=1e-6, abs=1e-11)


def _in_units(length, stress, density, time, driven, shape):
    loads = (gx.Traction("right", (0.1 * stress, -0.02 * stress)),)
    pulled = gx.Support("right", (0.15 * length, 0.02 * length))
    return block(
        square(3, 0.05, length, shape),
        material=gx.Material(young=stress, poisson=0.25, reference_density=1.2 * density),
        growth=gx.EnergyDrivenGrowth(attractor=0.01 * stress, rate=5 * density / time / stress),
        supports=(gx.Support("left"),) if driven == "load" else (gx.Support("left"), pulled),
        loads=loads if driven == "load" else (),
        program=gx.Program(step=0.1 * time, until=0.4 * time, ramp=0.2 * time),
    )


@variants
def test_a_body_that_is_pulled_without_a_load(variant):
    """The forces are then measured against the stiffness; the supports' forces are equal and opposite."""
    scene = block(
        square(3, shape=variant.cells[0]), supports=(gx.Support("left"), gx.Support("right", (0.1, None))), loads=()
    )
    steps, problem = run(scene, variant)
    assert steps[-1].reactions["right"][0] > 0.05
    assert steps[-1].reactions["left"][0] == pytest.approx(-steps[-1].reactions["right"][0], abs=1e-9)
    x, _, u, _ = displacements(problem).T
    assert u[np.isclose(x, 1.0)] == pytest.approx(0.1, rel=1e-15)


@kinds
def test_too_few_iterations_are_reported(variant):
    """A step that needs more than it may take must not pass."""
    report, _ = first_step(block(square(3, shape=variant.cells[0])), variant, maximum_iterations=2)
    assert (report.converged, report.iterations) == (False, 2)
    assert report.reason == "Newton's method did not converge within its number of iterations"
    assert len(report.residual_norms) == 3


@kinds
def test_a_residual_that_is_not_a_number_is_reported(variant):
    """An inverted cell at the start: NaN compares false with every tolerance, and must still fail the step."""
    problem = gx.discretise(block(square(3, shape=variant.cells[0])), variant)
    problem.system.begin_step(0.1, 1.0)
    set_iterate(problem, lambda x: np.stack([-1.5 * x[0], 0 * x[0]]), lambda x: np.ones_like(x[0]))
    newton = Newton(problem.system)
    report = newton.solve()
    newton.destroy()
    assert not report.converged
    assert report.reason == "the residual is not a number"
    assert inadmissible(problem).startswith("det F ≤ 0 in the cell at (")


@kinds
def test_ranks_agree_that_an_iterate_is_not_admissible(variant):
    """No positive density at one end of the body only: no rank may go on to assemble while another has given up."""
    law = gx.EnergyDrivenGrowth(attractor=lambda x: np.where(x[0] > 0.75, 100.0, 0.01), rate=5.0)
    report, problem = first_step(block(square(4, shape=variant.cells[0]), growth=law, loads=()), variant)
    assert not report.converged
    assert inadmissible(problem).startswith("no positive density balances the mass at (")
    assert len(set(COMM.allgather(report.reason))) == 1


def test_a_body_free_to_move_is_a_singular_system():
    """Held in one direction only, by a spring, too: the factorisation must not pass a step of arbitrary solution."""
    spring = gx.OpenTraction("left", lambda u, rho, x: ufl.as_vector([-u[0], 0.0]))
    scene = replace(block(), supports=(gx.Support("left", (0.0, None)),), loads=(*block().loads, spring))
    report, _ = first_step(scene, gx.Q1)
    assert not report.converged


@kinds
def test_petsc_options_change_the_way_and_not_the_result(variant):
    """A line search that looks beyond the iterate it takes must not leave its last look in the state."""
    from petsc4py import PETSc

    scene = block(square(3, 0.05, shape=variant.cells[0]))
    _, plain = run(scene, variant)
    options = PETSc.Options("growthx_")
    options["snes_linesearch_type"] = "l2"
    try:
        _, searched = run(scene, variant)
    finally:
        options.delValue("snes_linesearch_type")
    assert displacements(searched)[:, 2:] == pytest.approx(displacements(plain)[:, 2:], rel=1e-8, abs=1e-10)
    assert densities(searched)[:, 2] == pytest.approx(densities(plain)[:, 2], rel=1e-8)


@pytest.mark.parametrize("full", [True, False], ids=["full", "kept factor"])
@pytest.mark.parametrize(
    "error", [KeyboardInterrupt, gx.InputError("the history of a load is nan")], ids=["Ctrl-C", "input"]
)
@pytest.mark.parametrize("called", ["out_of_balance", "tangents"])
def test_what_is_raised_while_petsc_calls_us_comes_out_as_it_is(full, error, called, monkeypatch):
    """As an error of PETSc's it would be a traceback, where a sentence or the end of the program is meant."""
    problem = gx.discretise(block(), gx.Q1)
    newton = Newton(problem.system, NewtonSettings(full=full))
    problem.system.begin_step(0.1, 1.0)

    def raise_it(*_):
        raise error

    if called == "tangents":
        monkeypatch.setattr("growthx.solvers.tangent.assemble_tangent", raise_it)
    else:
        monkeypatch.setattr(problem.system, "out_of_balance", raise_it)
    with pytest.raises(error if isinstance(error, type) else type(error)):
        newton.solve()


def test_garbage_of_petsc_waits_while_an_exception_passes_through_it():
    """Freed just then, it took the exception away, and the program ended by a segmentation fault."""
    armed, waited = [], []

    def failing(t):
        if armed and t > 0.25:
            waited.append(not gc.isenabled())
            for _ in range(1000):  # more than garbage is collected after
                vector = PETSc.Vec().createSeq(1, comm=PETSc.COMM_SELF)
                vector.setAttr("itself", vector)
            raise RuntimeError("the table of loads ends here")
        return min(5 * t, 1.0)

    scene = block(square(2), loads=(gx.Traction("right", (0.1, -0.02), history=failing),))
    march = gx.march(scene, gx.Q1Q1, gx.discretise(scene, gx.Q1Q1))
    collects, thresholds = gc.isenabled(), gc.get_threshold()
    next(march)
    armed.append(True)
    gc.enable()
    gc.set_threshold(1)
    try:
        with pytest.raises(RuntimeError, match="table of loads"):
            list(march)
        assert gc.isenabled() and all(waited) and waited
    finally:
        gc.set_threshold(*thresholds)
        if not collects:
            gc.disable()
