"""What is printed of scenes and results: a few lines that say what matters, on any rank alone."""

import dolfinx
import numpy as np
import pytest
from blocks import COMM, block, cube, square

import growthx as gx
from growthx.common.errors import shown
from growthx.stepping.record import Ending


def everything():
    """A scene that has everything, all of it long."""
    mesh = square(12)
    young = dolfinx.fem.Function(dolfinx.fem.functionspace(mesh.domain, ("DG", 0)), name="stiffness " * 50)
    young.x.array[:] = 1.0
    many = {f"side {number} {'x' * 100}": np.arange(500, dtype=np.int32) for number in range(100)}
    named = gx.Mesh(mesh.domain, {**mesh.boundaries, **many}, {**mesh.regions, **many})
    loads = tuple(gx.Traction("right", lambda x, i=i: [0.001 * i, 0.0]) for i in range(200))
    return gx.Scene(
        name="a scene\nof many words " * 100,
        mesh=named,
        material=gx.Material(young, reference_density={"bone": 1.0, "implant": 2.0}),
        growth=gx.EnergyDrivenGrowth(lambda x: 1 + x[0], {"bone": 1.0, "implant": 2.0}, bounds=(0.1, None)),
        supports=tuple(gx.Support("left") for _ in range(100)),
        loads=loads,
        program=gx.Program(0.1, 1.0, requested=tuple(np.linspace(0.1, 1.0, 500))),
        initial_density=young,
        growing=("bone",),
        prescribed_densities=(gx.PrescribedDensity("left", 1.0),),
        cases=tuple(gx.LoadCase(f"case {number}", 1.0, loads) for number in range(30)),
    )


@pytest.mark.parametrize("make", [everything, gx.scenes.femur, gx.scenes.plate, lambda: block(cube())])
def test_scenes_are_a_few_lines(make):
    """A mesh with its indices is 30 kB, on the screen and in every sentence that shows it."""
    scene = make()
    for text in (str(scene), repr(scene), str(scene.mesh), repr(scene.mesh)):
        assert text.count("\n") < 15 and len(text) < 2000
    assert "\n" not in repr(scene) and len(shown(scene)) <= 81
    assert " ".join(scene.name.split())[:20] in str(scene) and str(scene.mesh.cell_count) in str(scene)


@pytest.mark.parametrize("variant", [gx.Q1, gx.Q1Q1], ids=["Q1", "Q1Q1"])
def test_results_say_what_was_computed_and_how_it_ended(variant):
    """The first thing one does with a result is to print it."""
    scene = block(square(2))
    watched = []
    result = gx.solve(scene, variant, watch=lambda running: watched.append(str(running)))
    text, step, problem = str(result), str(result.steps[-1]), str(result.problem)
    assert "ended: not yet, at t = 0.1 of 0.4" in watched[0]
    for part in (
        "block",
        f"with {variant.name} ",
        "4 quadrilaterals",
        "Material(young=1, poisson=0.25",
        "Support 'left'",
    ):
        assert part in text and part in problem
    assert f"unknowns: {result.problem.dofs};" in text and "Traction on 'right'" in text
    assert f"mass {result.problem.mass():.6g}" in text and "ended: end of time, t = 0.4 of 0.4" in text
    assert "t = 0.4 (Δt = 0.1, load 1)" in step and f"mass {result.steps[-1].mass:.6g}" in step
    for shorter in (text, step, problem, repr(result), repr(result.problem), repr(result.steps[-1])):
        assert shorter.count("\n") < 15 and len(shorter) < 2000
    assert repr(result) == f"Result('block' with {variant.name}: 4 steps to t = 0.4, end of time)"


def test_one_rank_alone_may_print():
    """As scripts do, on rank 0: a question to the others would wait for ever."""
    scene = block(square(2))
    result = gx.solve(scene, gx.Q1Q1)
    if COMM.rank == 0:
        for thing in (scene, scene.mesh, result, result.problem, result.steps[0]):
            assert str(thing) and repr(thing)


def test_the_end_of_a_run_is_told_apart():
    """Whether it came to rest or to the end of time is what the reader wants to know."""
    scene = block(square(2), program=gx.Program(step=1.0, until=1000.0, ramp=1.0))
    rest = gx.solve(scene, gx.Q1, stepping=gx.FixedSteps(equilibrium=1e-2))
    assert rest.converged is True and rest.ended is Ending.EQUILIBRIUM and rest.ended == "equilibrium"
    assert 1.0 < rest.time < 1000.0 and "ended: equilibrium, t = " in str(rest)
    timed = gx.solve(block(square(2)), gx.Q1, stepping=gx.FixedSteps(equilibrium=1e-9))
    assert timed.converged is True and timed.ended == "end of time"


def test_a_run_that_ended_early_says_why():
    """In the result as in the error."""
    scene = block(square(2), loads=(gx.Traction("right", (-9.0, 0.0)),), program=gx.Program(step=1e-3, until=1.0))
    with pytest.raises(gx.RunEndedEarly) as caught:
        gx.solve(scene, gx.Q1)
    result = caught.value.result
    assert result.converged is False and result.ended is Ending.EARLY
    assert f"ended: ended early, {result.reason}"[:100] in str(result)
