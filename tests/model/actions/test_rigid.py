"""Rigid faces that are free to move and to turn, against prescribed rotations, beams and eigenvalues."""

import itertools
from dataclasses import replace

import dolfinx
import numpy as np
import pytest
from blocks import COMM, block, cube, densities, difference_along, displacements, gathered, run, square

import growthx as gx
from growthx.common.errors import InputError
from growthx.solvers import linear_solvers
from growthx.solvers.tangent import negative_pivots

STILL = gx.EnergyDrivenGrowth(attractor=0.0, rate=0.0)
AT_ONCE = gx.Program(step=1.0, until=1.0)
FACE = (gx.Support("left"), gx.RigidFace("right"))
KINDS = (gx.Q1P0, gx.Q1, gx.Q1Q1, gx.S2Q1, gx.P2P1)
kinds = pytest.mark.parametrize("variant", KINDS, ids=lambda variant: variant.name)


def turned_back(mesh, variant, angle, moved, material=None, plane="strain", **turn):
    """A face that is turned and moved, and one that has the moment and the force which that has needed."""
    material = gx.Material(1.0, 0.25, 1.2) if material is None else material
    turn = {"displacement": moved, **turn}
    given = block(mesh, growth=STILL, material=material, program=AT_ONCE, loads=(), plane=plane)
    given = replace(given, supports=(gx.Support("left"), gx.Rotation("right", angle, **turn)))
    steps, there = run(given, variant, tolerance=1e-12)
    middle = tuple(np.array([1.0, 0.5, 0.5][: mesh.dim]) + moved)
    moment, force = there.reaction_moments(middle)["right"], steps[-1].reactions["right"]
    moment = float(moment[0]) if mesh.dim == 2 else tuple(moment)
    loads = (gx.Moment("right", moment), gx.DistributedForce("right", tuple(force)))
    return there, replace(given, supports=FACE, loads=loads)


@kinds
@pytest.mark.parametrize("plane", ["strain", "stress"])
def test_the_moment_of_a_rotation_turns_the_face_by_it(variant, plane):
    """By a third of a right angle: what a prescribed rotation has needed brings it back, and nothing is left over."""
    there, scene = turned_back(square(3, 0.05, shape=variant.cells[0]), variant, 0.5, (-0.1, 0.2), plane=plane)
    steps, back = run(scene, variant, tolerance=1e-12)
    assert displacements(back) == pytest.approx(displacements(there), abs=1e-8)
    assert steps[-1].reactions["right"] == pytest.approx([0.0, 0.0], abs=1e-9)
    assert back.reaction_moments((0.3, 0.4))["right"] == pytest.approx([0.0], abs=1e-9)
    assert max(steps[-1].force_defect, steps[-1].moment_defect) < 1e-9


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1Q1, gx.P2P1], ids=lambda variant: variant.name)
@pytest.mark.parametrize("free", ["any axis", "its axis"])
def test_in_space_too(variant, free):
    """About an axis that leans to all sides, where spins about the axes of space do not commute."""
    axis = (1.0, 2.0, -0.5)
    mesh = cube(1 if variant is gx.P2P1 else 2, 0.05, shape=variant.cells[1])
    there, scene = turned_back(mesh, variant, 0.5, (-0.1, 0.2, 0.1), axis=axis)
    if free == "its axis":
        scene = replace(scene, supports=(FACE[0], gx.RigidFace("right", axis=axis)))
    steps, back = run(scene, variant, tolerance=1e-12)
    assert displacements(back) == pytest.approx(displacements(there), abs=1e-8)
    assert max(steps[-1].force_defect, steps[-1].moment_defect) < 1e-9


def test_of_small_strains_it_turns_in_proportion():
    """Twice the moment, twice the displacement, and that of a spin: the face stays where it is along y."""
    found = []
    for moment in (0.01, 0.02):
        scene = block(square(3), growth=STILL, material=gx.LinearElasticity(1.0, 0.25), program=AT_ONCE)
        scene = replace(scene, supports=FACE, loads=(gx.Moment("right", moment),))
        found.append(displacements(run(scene, gx.Q1, tolerance=1e-13)[1]))
    x, _, u, v = found[0].T
    assert found[1][:, 2:] == pytest.approx(2 * found[0][:, 2:], abs=1e-12)
    right = np.isclose(x, 1.0)
    assert np.ptp(v[right]) < 1e-14 < np.ptp(u[right])
    assert np.diff(u[right], n=2) == pytest.approx(0.0, abs=1e-14)


@pytest.mark.parametrize("plane", ["strain", "stress"])
@pytest.mark.parametrize("variant", [gx.Q2Q2, gx.S2Q1, gx.P2P1], ids=lambda variant: variant.name)
def test_bone_between_rigid_faces_is_a_beam(variant, plane):
    """M = E I κ, of plane strain E/(1 − ν²), far from the faces, which keep their height; E = 17 000 MPa."""
    E, nu, length, moment = 17000.0, 0.3, 8.0, 1.5
    kind = getattr(dolfinx.mesh.CellType, variant.cells[0])
    domain = dolfinx.mesh.create_rectangle(COMM, [[0.0, -0.5], [length, 0.5]], [16, 2], kind)
    mesh = gx.Mesh.with_names(
        domain, {"left": lambda x: np.isclose(x[0], 0.0), "right": lambda x: np.isclose(x[0], length)}
    )
    scene = block(mesh, growth=STILL, material=gx.LinearElasticity(E, nu), program=AT_ONCE, plane=plane)
    scene = replace(scene, supports=FACE, loads=(gx.Moment("right", moment),))
    _, problem = run(scene, variant, tolerance=1e-12)
    ends = np.array([[3.0, -0.5], [3.0, 0.5], [5.0, -0.5], [5.0, 0.5]])
    u = problem.sample_displacement(ends)[:, 0]
    curvature = ((u[2] - u[3]) - (u[0] - u[1])) / 2.0
    stiffness = E / (1 - nu**2) if plane == "strain" else E
    assert curvature == pytest.approx(12 * moment / stiffness, rel=1e-4)


@pytest.mark.parametrize("axis", [1, 2])
def test_bending_in_space(axis):
    """Of a bar without Poisson's effect the faces stay flat: θ = M L / (E I), exactly, with elements of degree 2."""
    mesh, moment = cube(2), 1e-3
    mesh.domain.geometry.x[:, 0] *= 3.0
    mesh.domain.geometry.x[:, 1] *= 0.5
    load = gx.Moment("right", tuple(moment * (axis == i) for i in range(3)))
    scene = block(mesh, growth=STILL, material=gx.LinearElasticity(2.0, 0.0), program=AT_ONCE)
    _, problem = run(replace(scene, supports=FACE, loads=(load,)), gx.S2Q1, tolerance=1e-12)
    ends = np.array([[3.0, 0.0, 0.0], [3.0, 0.5, 0.0], [3.0, 0.0, 1.0]])
    u = problem.sample_displacement(ends)[:, 0]
    angle = {1: u[2] - u[0], 2: -(u[1] - u[0]) / 0.5}[axis]
    assert angle == pytest.approx(moment * 3.0 / (2.0 * {1: 0.5, 2: 0.5**3}[axis] / 12), rel=1e-9)


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1Q1], ids=lambda variant: variant.name)
def test_a_growing_body_is_turned_by_a_history_of_its_moment(variant):
    """To and fro by a table of angles, and by that of the moments it has needed: the same densities at the end."""
    angles = gx.Table(((0.0, 0.0), (0.2, 0.4), (0.4, -0.1)))
    scene = block(square(3, 0.05), growth=gx.EnergyDrivenGrowth(attractor=0.002, rate=5.0), loads=())
    scene = replace(scene, supports=(FACE[0], gx.Rotation("right", 1.0, history=angles)))
    moments, forces = [(0.0, 0.0)], [[(0.0, 0.0)], [(0.0, 0.0)]]
    for step in gx.march(scene, variant, there := gx.discretise(scene, variant), tolerance=1e-12):
        moments.append((step.time, float(there.reaction_moments((1.0, 0.5))["right"][0])))
        for rows, force in zip(forces, step.reactions["right"], strict=True):
            rows.append((step.time, float(force)))
    loads = (
        gx.Moment("right", 1.0, history=gx.Table(tuple(moments))),
        gx.DistributedForce("right", (1.0, 0.0), history=gx.Table(tuple(forces[0]))),
        gx.DistributedForce("right", (0.0, 1.0), history=gx.Table(tuple(forces[1]))),
    )
    _, back = run(replace(scene, supports=FACE, loads=loads), variant, tolerance=1e-12)
    assert densities(back) == pytest.approx(densities(there), abs=1e-8)
    assert np.ptp(densities(back)[:, -1]) > 0.01


def test_each_load_case_turns_the_face_its_own_way():
    """The heavier case bends it one way, the other one the other way; each as it would alone, where nothing grows."""
    cases = (
        gx.LoadCase("up", 3.0, (gx.Moment("right", 0.02),)),
        gx.LoadCase("down", 1.0, (gx.Moment("right", -0.01),)),
    )
    scene = block(square(3), growth=STILL, supports=FACE, loads=(), program=AT_ONCE)
    together = run(replace(scene, cases=cases), gx.Q1P0, tolerance=1e-12)[1]
    for number, case in enumerate(cases):
        alone = run(replace(scene, loads=case.loads), gx.Q1P0, tolerance=1e-12)[1]
        count = len(alone.displacement.x.array)
        assert together.displacements[number].x.array[:count] == pytest.approx(alone.displacement.x.array, abs=1e-9)
    moments = together.reaction_moments((0.0, 0.0))
    assert moments["up: left"] == pytest.approx([-0.02], abs=1e-10)
    assert moments["down: left"] == pytest.approx([0.01], abs=1e-10)


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1Q1, gx.S2Q1], ids=lambda variant: variant.name)
@pytest.mark.parametrize("dim", [2, 3])
def test_newtons_method_is_quadratic(variant, dim):
    """With the turning of the moment's arms in the tangent: without it the last residuals fall by a factor alone."""
    moment = 0.08 if dim == 2 else (0.02, 0.05, 0.08)
    mesh = square(3, 0.05) if dim == 2 else cube(1, 0.05)
    scene = block(mesh, growth=STILL, supports=FACE, loads=(gx.Moment("right", moment),), program=AT_ONCE)
    steps, problem = run(scene, variant, tolerance=1e-12, full_newton=True)
    norms = [norm for norm in steps[-1].newton.residual_norms if norm < 1e-3]
    assert np.abs(displacements(problem)[:, dim:]).max() > 0.1
    assert len(norms) > 1
    for before, after in itertools.pairwise(norms):
        assert after < max(100.0 * before**2, 1e-12)


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1Q1, gx.P1], ids=lambda variant: variant.name)
@pytest.mark.parametrize("solver", ["multigrid", "single precision", "bounds"])
def test_each_linear_solver_finds_the_same(variant, solver, monkeypatch):
    """What borders a system is solved by whatever solves it: multigrid, single precision, rows at no bound."""
    mesh = square(8, 0.05, shape=variant.cells[0])
    growth = gx.EnergyDrivenGrowth(attractor=0.002, rate=5.0)
    scene = block(mesh, growth=growth, supports=FACE, loads=(gx.Moment("right", 0.02),))
    _, there = run(scene, variant, tolerance=1e-11)
    if solver == "multigrid":
        for name in ("LARGEST_CONDENSED", "LARGEST_SINGLE", "LARGEST_MONOLITHIC"):
            monkeypatch.setattr(linear_solvers, name, dict.fromkeys(getattr(linear_solvers, name), 0))
    elif solver == "single precision":
        monkeypatch.setattr(linear_solvers.single_factor, "SMALLEST", 1)
    else:
        scene = replace(scene, growth=replace(growth, bounds=(0.5, 5.0)))
    _, problem = run(scene, variant, tolerance=1e-11)
    assert displacements(problem) == pytest.approx(displacements(there), abs=1e-8)
    assert densities(problem) == pytest.approx(densities(there), abs=1e-8)


def test_densities_stop_at_bounds_beside_a_rigid_face():
    """Nodal ones, whose rows PETSc takes out of the system: the witness of forces and moments has nothing to say."""
    growth = gx.EnergyDrivenGrowth(attractor=0.002, rate=5.0, bounds=(1.198, 1.21))
    scene = block(square(4), growth=growth, supports=FACE, loads=(gx.Moment("right", 0.06),))
    found = []
    for step in gx.march(scene, gx.Q1Q1, problem := gx.discretise(scene, gx.Q1Q1), tolerance=1e-11):
        found.append(densities(problem)[:, -1])
        assert max(step.force_defect, step.moment_defect) < 1e-8
    assert (np.min(found), np.max(found)) == (1.198, 1.21)


@pytest.mark.parametrize("push", [0.008, 0.06])
def test_negative_directions_are_those_of_all_that_is_free(push):
    """A column under a rigid plate gives way beyond Euler's load: eigenvalues of the whole tangent, by differences."""
    mesh = square(2)
    mesh.domain.geometry.x[:, 0] *= 4.0
    scene = block(mesh, growth=STILL, material=gx.Material(1.0, 0.0), program=gx.Program(0.25, 1.0, ramp=1.0))
    loads = (gx.DistributedForce("right", (-push, 0.0)),)
    problem = gx.discretise(replace(scene, supports=FACE, loads=loads), gx.Q2)
    system = problem.system
    system.begin_step(1.0, 1.0)
    system.unknown.interpolate(lambda x: np.stack([-push * x[0], 0.0 * x[1]]))
    system.out_of_balance()
    motions, size = system.following.motions(), COMM.allreduce(system.owned)
    first = COMM.exscan(system.owned) or 0
    held = gathered(system.layout.held + first)
    free = np.delete(np.eye(size), held, axis=0)
    rows = np.zeros((motions.basis.shape[1], system.owned))
    rows[:, motions.rows] = motions.basis.T
    together = np.concatenate(COMM.allgather(rows), axis=1)
    basis = np.concatenate([free, together])
    K = np.array([basis @ difference_along(problem, direction) for direction in basis])
    count = int(np.count_nonzero(np.linalg.eigvalsh((K + K.T) / 2) < 0))
    assert count == (push > np.pi**2 / 12 / (4 * 4.0**2))
    assert negative_pivots(system) == count


def test_what_a_face_leaves_free_is_found():
    """Two platens alone hold nothing; one hinge lets the body turn; a hinge and a guide hold it."""
    with pytest.raises(InputError, match="has no support"):
        block(square(2), supports=(gx.RigidFace("right"),))
    with pytest.raises(InputError, match="is free to rotate about z"):
        gx.discretise(block(square(2), supports=(gx.RigidFace("right", held=(0, 1)),)), gx.Q1)
    with pytest.raises(InputError, match="is free to move along y"):
        gx.discretise(block(square(2), supports=(gx.RigidFace("right", held=(0,), turns=False),)), gx.Q1)
    gx.discretise(block(square(2), supports=(gx.RigidFace("right", held=(0, 1), turns=False),)), gx.Q1)
    with pytest.raises(InputError, match="is free to rotate about x"):
        face = gx.RigidFace("right", held=(0, 1, 2), axis=(2.0, 0.0, 0.0))
        gx.discretise(block(cube(1), supports=(face,)), gx.Q1)


def test_a_guided_platen_goes_with_a_plane_of_symmetry():
    """It keeps its direction and a side of the body has the same one held: nothing contradicts, half of a whole."""
    scene = block(square(2), growth=STILL, program=AT_ONCE, loads=(gx.Traction("right", (-0.1, 0.0)),))
    platen = gx.RigidFace("right", held=(1,), turns=False)
    half = replace(scene, supports=(gx.Support("left", (0.0, None)), gx.Support("bottom", (None, 0.0)), platen))
    _, problem = run(half, gx.Q1P0, tolerance=1e-12)
    x, _, u, v = displacements(problem).T
    assert np.ptp(u[np.isclose(x, 1.0)]) < 1e-14
    assert v[np.isclose(x, 1.0)] == pytest.approx(0.0, abs=1e-14)
    assert u.min() < -0.05


REFUSED = {
    "boundary": (lambda: block(supports=(gx.RigidFace("tip"),)), "the mesh has no boundary named 'tip'"),
    "shared": (
        lambda: gx.discretise(block(supports=(gx.Support("bottom"), gx.RigidFace("right"))), gx.Q1),
        "the rigid face 'right' shares nodes with the support 'bottom', which holds them along y",
    ),
    "two": (
        lambda: gx.discretise(
            block(supports=(gx.RigidFace("top", held=(0, 1), turns=False), gx.RigidFace("right"))), gx.Q1
        ),
        "shares nodes with another one",
    ),
    "about": (
        lambda: block(supports=(gx.RigidFace("left", about=(0.0,)),)),
        "about, of the rigid face 'left', has 1 entries: it needs 2",
    ),
    "axis": (lambda: block(supports=(gx.RigidFace("left", axis=(0, 0, 1)),)), "has an axis, which in the plane is z"),
    "no axis": (lambda: gx.RigidFace("left", axis=(0, 0, 0)), "the axis of the rigid face 'left' is"),
    "held": (lambda: gx.RigidFace("left", held=(3,)), "a held direction of the rigid face 'left' is 3: 0, 1 or 2"),
    "z": (lambda: block(supports=(gx.RigidFace("left", held=(2,)),)), "is held along 2: less than 2 is right"),
    "turns": (lambda: gx.RigidFace("left", turns="no"), "turns, of the rigid face 'left', is 'no': True or False"),
}


@pytest.mark.parametrize(("make", "sentence"), REFUSED.values(), ids=REFUSED)
def test_what_no_face_can_be_is_refused(make, sentence):
    """In one sentence, with the boundary and what would be right."""
    with pytest.raises(InputError) as caught:
        make()
    assert sentence in str(caught.value)
