"""Forces at points, at nodes and along curves: each counts once, wholly, in every space and on any number of ranks."""

from dataclasses import replace

import numpy as np
import pytest
from blocks import COMM, ROLLERS, block, cube, densities, displacements, run, square

import growthx as gx
from growthx.common.errors import InputError

STILL = gx.EnergyDrivenGrowth(attractor=0.0, rate=0.0)
KINDS = (gx.Q1P0, gx.Q1, gx.Q1Q1, gx.Q2, gx.Q2Q2, gx.S2Q1, gx.S2fri, gx.P1, gx.P2P1)
kinds = pytest.mark.parametrize("variant", KINDS, ids=lambda variant: variant.name)
PROGRAM = gx.Program(step=1.0, until=1.0)


def pulled(variant, loads, cells=1, shape=None):
    """The unit square, E = 1, ν = 0, on rollers, under loads that do not make it grow: last step and problem."""
    scene = block(
        square(cells, shape=shape or variant.cells[0]),
        material=gx.Material(young=1.0, poisson=0.0),
        growth=STILL,
        supports=ROLLERS,
        loads=loads,
        program=PROGRAM,
    )
    steps, problem = run(scene, variant, tolerance=1e-13)
    return steps[-1], problem


@kinds
def test_two_forces_at_the_corners_are_borne(variant):
    """−0.1 at the other end to round-off; where displacement is linear they are a traction, u = 0.1049876."""
    step, problem = pulled(variant, tuple(gx.PointForce((1.0, y), (0.05, 0.0)) for y in (0.0, 1.0)))
    assert step.reactions["left"] == pytest.approx([-0.1, 0.0], abs=1e-14)
    assert step.force_defect < 1e-13
    if variant.displacement.degree == 1 and variant.cells[0] == "quadrilateral":
        u = problem.sample_displacement(np.array([[1.0, 0.3]]))[0]
        assert u == pytest.approx([(0.1 + np.sqrt(0.1**2 + 1)) - 1, 0.0], abs=1e-12)
        assert u[0] == pytest.approx(0.1049876, abs=5e-8)


@pytest.mark.parametrize("variant", [gx.Q2, gx.Q2Q2, gx.S2Q1, gx.S2fri, gx.P2P1], ids=lambda variant: variant.name)
def test_forces_by_simpsons_rule_are_a_traction_in_quadratic_spaces(variant):
    """Also in serendipity, whose unknown in the middle of a side is no value there: the shape functions tell."""
    parts = zip((0.0, 0.5, 1.0), (1 / 6, 4 / 6, 1 / 6), strict=True)
    step, problem = pulled(variant, tuple(gx.PointForce((1.0, y), (0.1 * part, 0.0)) for y, part in parts))
    assert step.reactions["left"] == pytest.approx([-0.1, 0.0], abs=1e-14)
    assert problem.sample_displacement(np.array([[1.0, 0.3]]))[0] == pytest.approx([0.1049876, 0.0], abs=5e-8)


@kinds
@pytest.mark.parametrize("place", [(0.5, 0.5), (0.61, 0.37), (1.0, 0.25), (1.0, 1.0)], ids=str)
def test_a_force_anywhere_counts_once(variant, place):
    """At a node, perhaps between ranks, on a side and within a cell; the work is force times displacement there."""
    force = np.array([0.02, -0.01])
    scene = block(square(4, 0.05, shape=variant.cells[0]), growth=STILL, loads=(gx.PointForce(place, tuple(force)),))
    problem = gx.discretise(scene, variant)
    load = problem.system.loads.full()
    assert problem.system.loads.resultant(load) == pytest.approx(force, abs=1e-15)
    moved = problem.displacement
    moved.interpolate(lambda x: np.stack([0.1 * x[0] + 0.3 * x[1], 0.2 - 0.4 * x[0]]))
    part = problem.system.unknowns.parts[0]
    problem.system.unknown.x.array[part] = moved.x.array
    work = COMM.allreduce(float(problem.system.unknown.x.array[: problem.system.owned] @ load))
    x, y = place
    assert work == pytest.approx(force @ [0.1 * x + 0.3 * y, 0.2 - 0.4 * x], rel=1e-10)


@pytest.mark.parametrize("variant", [gx.Q1, gx.Q1Q1, gx.P1P0], ids=lambda variant: variant.name)
def test_nodal_forces_are_the_same_however_the_nodes_are_told(variant):
    """By a boundary's name, a function, and one by one; in space, and in cases of their own weight."""
    mesh = cube(2, shape=variant.cells[1])
    places = [(1.0, y, z) for y in (0.0, 0.5, 1.0) for z in (0.0, 0.5, 1.0)]
    force = (0.002, 0.0, -0.001)
    told = (
        (gx.NodalForces("right", force),),
        (gx.NodalForces(lambda x: np.isclose(x[0], 1.0), force),),
        tuple(gx.PointForce(place, force) for place in places),
    )
    found = []
    for loads in told:
        scene = block(mesh, loads=(), cases=(gx.LoadCase("a", 3.0, loads), gx.LoadCase("b", 1.0, ())))
        loads = gx.discretise(scene, variant).system.loads
        assert loads.resultants(loads.nodal_load)[0] == pytest.approx(9 * np.array(force), abs=1e-15)
        found.append(loads.nodal_load)
    assert found[1] == pytest.approx(found[0], abs=1e-16)
    assert found[2] == pytest.approx(found[0], abs=1e-16)


def test_rows_of_forces_belong_to_numbers_of_nodes():
    """In the order they are given in, whatever the ranks: the file's order is the mesh's own."""
    points = np.array([(x, y) for y in range(3) for x in range(3)], dtype=float)
    cells = [[a, a + 1, a + 4, a + 3] for a in (0, 1, 3, 4)]
    mesh = gx.meshing.from_arrays(points, cells).named(
        {"left": lambda x: np.isclose(x[0], 0.0), "right": lambda x: np.isclose(x[0], 2.0)}
    )
    rows = gx.NodalForces((8, 2, 5), ((0.03, 0.0), (0.01, 0.0), (0.02, 0.005)))
    places, forces = rows.points(mesh)
    assert places.tolist() == [[2.0, 2.0], [2.0, 0.0], [2.0, 1.0]]
    problem = gx.discretise(block(mesh, loads=(rows,)), gx.Q1)
    alone = tuple(gx.PointForce(tuple(place), tuple(force)) for place, force in zip(places, forces, strict=True))
    other = gx.discretise(block(mesh, loads=alone), gx.Q1)
    assert problem.system.loads.nodal_load == pytest.approx(other.system.loads.nodal_load, abs=1e-17)
    assert problem.system.loads.resultant(problem.system.loads.full()) == pytest.approx([0.06, 0.005])
    arrow = rows.arrow(mesh)
    assert arrow.force == pytest.approx((0.06, 0.005)) and arrow.place == pytest.approx((2.0, 1.0))


INP = """*NODE
1, 0., 0.
2, 1., 0.
3, 0., 1.
4, 1., 1.
5, 0., 2.
6, 1., 2.
*ELEMENT, TYPE=CPE4, ELSET=BONE
1, 1, 2, 4, 3
2, 3, 4, 6, 5
*NSET, NSET=pins
2, 6
*NSET, NSET=left
1, 3, 5
*NSET, NSET=right
2, 4, 6
"""
GEO = """SetFactory("OpenCASCADE");
Box(1) = {0, 0, 0, 1, 1, 1};
MeshSize{:} = 0.5;
Physical Volume("bone") = {1};
Physical Surface("left") = {1};
Physical Surface("right") = {2};
Physical Curve("ridge") = {Curve In BoundingBox {0.9, 0.9, -1, 1.1, 1.1, 2}};
Physical Point("tip") = {Point In BoundingBox {0.9, 0.9, 0.9, 1.1, 1.1, 1.1}};
"""


def test_sets_of_nodes_of_a_file_have_their_names(shared_folder):
    """Those of Abaqus that are no boundary, and gmsh's groups of points and of curves in space."""
    if COMM.rank == 0:
        (shared_folder / "two.inp").write_text(INP)
        (shared_folder / "box.geo").write_text(GEO)
    COMM.barrier()
    mesh = gx.meshing.read(shared_folder / "two.inp")
    pins = gx.NodalForces("pins", (0.05, 0.0))
    assert pins.points(mesh)[0].tolist() == [[1.0, 0.0], [1.0, 2.0]]
    problem = gx.discretise(block(mesh, loads=(pins,)), gx.Q1P0)
    assert problem.system.loads.resultant(problem.system.loads.full()) == pytest.approx([0.1, 0.0], abs=1e-16)
    box = gx.meshing.read(shared_folder / "box.geo")
    assert gx.NodalForces("tip", (0.1, 0.0, 0.0)).points(box)[0].tolist() == [[1.0, 1.0, 1.0]]
    ridge = gx.NodalForces("ridge", (0.1, 0.0, 0.0)).points(box)[0]
    assert len(ridge) >= 3 and np.all(ridge[:, :2] == 1.0)
    with pytest.raises(InputError, match=r"its sets of nodes are 'ridge', 'tip', its boundaries 'left', 'right'"):
        block(box, loads=(gx.NodalForces("top", (0.1, 0.0, 0.0)),))


@pytest.mark.parametrize("variant", [gx.Q1, gx.S2Q1, gx.P2P1], ids=lambda variant: variant.name)
def test_a_muscle_along_a_curve_pulls_with_all_of_its_force(variant):
    """Exactly, on any mesh; along a whole side it is the traction to the error of its rule of points."""
    pull = gx.LineForce(((1.0, 0.0), (1.0, 1.0)), (0.1, 0.02), parts=200)
    mesh = square(3, shape=variant.cells[0])
    loads = [
        gx.discretise(block(mesh, loads=(load,)), variant).system.loads
        for load in (pull, gx.Traction("right", (0.1, 0.02)))
    ]
    assert loads[0].resultant(loads[0].full()) == pytest.approx([0.1, 0.02], abs=1e-15)
    assert loads[0].full() == pytest.approx(loads[1].full(), abs=1e-5)
    bent = gx.LineForce(((0.2, 0.2), (0.8, 0.2), (0.8, 0.5)), (0.1, 0.02))
    assert bent.arrow(mesh).place == pytest.approx(((0.6 * 0.5 + 0.3 * 0.8) / 0.9, (0.6 * 0.2 + 0.3 * 0.35) / 0.9))


def test_a_curve_beside_the_body_is_taken_to_it_within_a_distance():
    """As a line drawn on a smooth surface is, whose mesh has flat facets."""
    curve = ((1.05, 0.2), (1.05, 0.8))
    with pytest.raises(InputError, match=r"is 0\.05 away from the body"):
        block(square(3), loads=(gx.LineForce(curve, (0.1, 0.0)),))
    scenes = (
        block(square(3), loads=(load,))
        for load in (gx.LineForce(curve, (0.1, 0.0), within=0.06), gx.LineForce(((1.0, 0.2), (1.0, 0.8)), (0.1, 0.0)))
    )
    first, second = (gx.discretise(scene, gx.Q1).system.loads.nodal_load for scene in scenes)
    assert first == pytest.approx(second, abs=1e-15)


def test_a_force_at_a_point_goes_with_a_run(shared_folder):
    """Its history, its picture's arrow, and a checkpoint that another force is not resumed from."""
    load = gx.PointForce((1.0, 0.5), (0.1, 0.0), history=lambda t: min(t / 0.2, 1.0), case="pin")
    scene = block(square(2), loads=(load,))
    result = gx.solve(scene, gx.Q1Q1, out=shared_folder / "run", checkpoint=1)
    assert result.steps[-1].reactions["left"] == pytest.approx([-0.1, 0.0], abs=1e-10)
    assert load.arrow(scene.mesh) == gx.Arrow((0.1, 0.0), (1.0, 0.5), "pin")
    again = replace(scene, loads=(replace(load, force=(0.11, 0.0)),))
    longer = replace(again, program=replace(scene.program, until=0.5))
    with pytest.raises(InputError, match=r"force"):
        gx.solve(longer, gx.Q1Q1, resume=shared_folder / "run")
    longer = replace(scene, program=replace(scene.program, until=0.5))
    resumed = gx.solve(longer, gx.Q1Q1, resume=shared_folder / "run")
    whole = gx.solve(longer, gx.Q1Q1)
    assert densities(resumed.problem) == pytest.approx(densities(whole.problem), rel=1e-9)
    assert displacements(resumed.problem) == pytest.approx(displacements(whole.problem), rel=1e-9, abs=1e-12)


REFUSED = {
    "outside": (
        lambda: gx.PointForce((1.3, 0.9), (0.1, 0.0)),
        "the load at (1.3, 0.9) is 0.3 away from the body: a place on it would be right, such as the "
        "nearest node, (1, 1)",
    ),
    "dimension": (lambda: gx.PointForce((1.0, 0.5, 0.0), (0.1, 0.0)), "the places of the load at (1, 0.5, 0) have 3"),
    "force": (lambda: gx.PointForce((1.0, 0.5), (0.1,)), "the forces of the load at (1, 0.5) have 1 entries"),
    "nan": (lambda: gx.PointForce((1.0, 0.5), (np.nan, 0.0)), "the force at (1, 0.5) is nan: a finite number would"),
    "name": (
        lambda: gx.NodalForces("tip", (0.1, 0.0)),
        "the mesh has no nodes named 'tip' of the load at the nodes 'tip'; its sets of nodes are none, its boundaries "
        "'bottom', 'left', 'right', 'top'",
    ),
    "none marked": (lambda: gx.NodalForces(lambda x: x[0] > 2, (0.1, 0.0)), "marks none: one that marks a node"),
    "no marks": (lambda: gx.NodalForces(lambda x: x[0], (0.1, 0.0)), "gives an array of float64 of shape (9,)"),
    "numbers": (lambda: gx.NodalForces((3, 99), (0.1, 0.0)), "have 99 among them: whole numbers from 0, below 9"),
    "rows": (lambda: gx.NodalForces((3, 4), ((0.1, 0.0),)), "has 1 rows for 2 nodes: one row for each number of a"),
    "rows of a name": (lambda: gx.NodalForces("right", ((0.1, 0.0),)), "has 1 rows for nodes given by 'right'"),
    "curve": (lambda: gx.LineForce(((0.0, 0.0),), (0.1, 0.0)), "two different corners at least would be right"),
    "still curve": (lambda: gx.LineForce(((0.0, 0.0), (0.0, 0.0)), (0.1, 0.0)), "two different corners at least"),
    "parts": (lambda: gx.LineForce(((0.0, 0.0), (1.0, 0.0)), (0.1, 0.0), parts=0), "a whole number from 1 would be"),
    "history": (lambda: gx.PointForce((1.0, 0.5), (0.1, 0.0), history=3), "a function of time or a Table would be"),
}


@pytest.mark.parametrize(("load", "sentence"), REFUSED.values(), ids=REFUSED)
def test_what_cannot_act_is_refused(load, sentence):
    """In one sentence, on all ranks alike, before anything is discretised."""
    with pytest.raises(InputError) as caught:
        block(square(2), loads=(load(),))
    assert sentence in str(caught.value) and len(set(COMM.allgather(str(caught.value)))) == 1


def test_a_node_twice_in_a_list_is_refused():
    """It bore the force twice, where each node has it once; two rows for a node are two forces on it."""
    with pytest.raises(InputError, match="have 3 among them 2 times, and it is of each node: each once"):
        gx.NodalForces((3, 1, 3), (1.0, 0.0))
    mesh = square(2)
    assert gx.NodalForces((3, 3), ((1.0, 0.0), (0.0, 2.0))).total(mesh) == pytest.approx([1.0, 2.0])
