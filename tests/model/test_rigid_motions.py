"""Motions of a rigid body that supports leave free: found for each part of the body, named, and refused in time."""

from dataclasses import replace

import dolfinx
import numpy as np
import pytest
from blocks import COMM, block, cube, run, square
from mpi4py import MPI

import growthx as gx
from growthx.common.errors import InputError
from growthx.meshing.distribution import distribute
from growthx.meshing.mesh import Mesh
from growthx.meshing.parts import Parts
from growthx.model.rigid_motions import check_held

ROLLER = gx.Support("left", (0.0, None))
HELD_POINT = gx.PointSupport((0.0, 0.0))
ENOUGH = "supports that hold it against every motion of a rigid body would be right"


def refusal(scene):
    """The sentence with which a scene is refused, the same on all ranks."""
    with pytest.raises(InputError) as caught:
        check_held(scene)
    (sentence,) = set(COMM.allgather(str(caught.value)))
    return sentence


@pytest.mark.parametrize(
    ("supports", "free"),
    [
        ((ROLLER,), "move along y"),
        ((gx.Support("bottom", (None, 0.0)),), "move along x"),
        ((HELD_POINT,), "rotate about z"),
        ((gx.PointSupport((0.0, 0.0), (0.0, None)),), "move along y and to rotate about z"),
        ((gx.PointSupport((0.0, 0.0), (0.0, None)), gx.PointSupport((0.0, 1.0), (0.0, None))), "move along y"),
        ((gx.PointSupport((0.0, 0.0), (0.0, None)), gx.PointSupport((1.0, 0.0), (None, 0.0))), "rotate about z"),
        ((HELD_POINT, gx.PointSupport((1.0, 0.0), (0.0, None))), "rotate about z"),
    ],
)
def test_free_motions_of_the_plane_are_named(supports, free):
    """A singular tangent would end the run with a sentence about factorisations; this one tells which support lacks."""
    sentence = refusal(block(square(3, 0.05), supports=supports))
    assert sentence == f"the body of the scene 'block' is free to {free}: {ENOUGH}"


@pytest.mark.parametrize("shape", ["hexahedron", "tetrahedron"])
@pytest.mark.parametrize(
    ("supports", "free"),
    [
        ((gx.Support("left", (0.0, None, None)),), "move along y and z and to rotate about x"),
        ((gx.PointSupport((0.0, 0.0, 0.0)),), "rotate about x, y and z"),
        ((gx.PointSupport((0.0, 0.0, 0.0)), gx.PointSupport((0.0, 1.0, 0.0))), "rotate about y"),
        (
            (gx.PointSupport((0.0, 0.0, 0.0)), gx.PointSupport((1.0, 1.0, 0.0))),
            "rotate about the direction (0.7071, 0.7071, 0)",
        ),
    ],
)
def test_free_motions_in_space_are_named(supports, free, shape):
    """An axis through two held points need not be one of the coordinates'."""
    found = refusal(block(cube(2, shape=shape), supports=supports))
    # Either sense of a direction is right.
    found = found.replace("(-0.7071, -0.7071, 0)", "(0.7071, 0.7071, 0)")
    assert found == f"the body of the scene 'block' is free to {free}: {ENOUGH}"


@pytest.mark.parametrize(
    "supports",
    [
        (gx.Support("left"),),
        (ROLLER, gx.Support("bottom", (None, 0.0))),
        (ROLLER, HELD_POINT),
        (HELD_POINT, gx.PointSupport((1.0, 0.0), (None, 0.0))),
        (gx.Support("left", (0.0, None)), gx.PointSupport((1.0, 1.0), (None, 0.3))),
    ],
)
def test_what_is_held_passes(supports):
    """Three equations are enough, however they come about."""
    check_held(block(square(3, 0.05), supports=supports))


@pytest.mark.parametrize("length", [1e-6, 1e6])
def test_the_unit_of_length_does_not_matter(length):
    """Metres or micrometres: a rank is a pure number."""
    check_held(block(square(3, length=length)))
    supports = (gx.PointSupport((0.0, 0.0)),)
    assert "rotate about z" in refusal(block(square(3, length=length), supports=supports))


def test_a_slender_bar_is_held_by_its_end():
    """The paper's bar is a hundred times as long as its clamped end is wide: a small arm is an arm."""
    check_held(gx.scenes.bar(elements=10))


def test_what_else_resists_is_let_pass():
    """Inertia, and loads that depend on the displacement, such as an elastic bed, may hold what no support holds."""
    free = block(supports=(ROLLER,))
    spring = gx.OpenTraction("right", lambda u, rho, x: -0.5 * u)
    for changes in (
        {"inertia": gx.Inertia()},
        {"loads": (spring,)},
        {"loads": (gx.OpenBodyForce(lambda u, rho, x: -u),)},
        {"cases": (gx.LoadCase("one", 1.0, (spring,)),)},
    ):
        check_held(replace(free, **changes))
    assert "move along y" in refusal(replace(free, loads=(gx.Pressure("right", 0.1),)))
    cases = (gx.LoadCase("with", 1.0, (spring,)), gx.LoadCase("without", 1.0, free.loads))
    assert "move along y" in refusal(replace(free, cases=cases))


def test_a_body_on_springs_alone_finds_its_equilibrium():
    """Without any support, the springs bear the load: k times their mean displacement."""
    spring = gx.OpenTraction("left", lambda u, rho, x: -2.0 * u)
    scene = block(supports=(), loads=(gx.Traction("right", (0.1, 0.0)), spring))
    steps, problem = run(scene, gx.Q1P0)
    on_left = problem.compile.form(problem.displacement[0] * scene.mesh.boundary_measure("left", 3))
    assert steps[-1].load == 1.0
    assert COMM.allreduce(dolfinx.fem.assemble_scalar(on_left)) == pytest.approx(0.1 / 2.0, rel=1e-8)


def test_a_body_in_flight_needs_no_support():
    """With inertia alone, a constant force F moves the body of mass m by F/m t² (n + 1)/(2 n) in n implicit steps."""
    still = gx.EnergyDrivenGrowth(0.0, rate=0.0)
    scene = block(
        supports=(),
        loads=(gx.BodyForce((0.0, 0.3)),),
        inertia=gx.Inertia(),
        growth=still,
        program=gx.Program(step=0.1, until=0.4),
    )
    _, problem = run(scene, gx.Q1)
    v = problem.displacement.x.array[1::2]
    assert v == pytest.approx(np.full_like(v, 0.3 / 1.2 * 0.4**2 * 5 / 8), rel=1e-8)


def loose(*corners, side=1.0):
    """Squares of two triangles each, at the given lower left corners; those that touch share nodes."""
    squares = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]) * side
    points = np.concatenate([np.array(corner) + squares for corner in corners])
    points, numbers = np.unique(points, axis=0, return_inverse=True)
    cells = numbers.reshape(-1, 4)[:, [0, 1, 3, 0, 3, 2]].reshape(-1, 3)
    whole = Parts("triangle", points, cells, {}, {})
    mesh = distribute(whole if COMM.rank == 0 else None, COMM)
    return Mesh.with_names(
        mesh.domain,
        {"left": lambda x: np.isclose(x[0], 0.0), "right": lambda x: np.isclose(x[0], points[:, 0].max())},
    )


def test_a_part_that_hangs_on_nothing_is_named():
    """Two bodies in one file, of which one is held: the usual mistake when a geometry is not fused."""
    sentence = refusal(block(loose((0.0, 0.0), (3.0, 0.0)), loads=()))
    assert sentence == (
        "the body of the scene 'block' falls into 2 parts that share no node, and that of 2 cells about (3.5, 0.5) is "
        f"free to move along x and y and to rotate about z: {ENOUGH}"
    )
    three = refusal(block(loose((0.0, 0.0), (3.0, 0.0), (6.0, 0.0)), loads=()))
    assert "falls into 3 parts" in three and " (and 1 more): " in three


def test_parts_that_are_all_held_pass():
    """Two specimens side by side in one run are nobody's mistake."""
    mesh = loose((0.0, 0.0), (3.0, 0.0))
    check_held(block(mesh, supports=(gx.Support("left"), gx.Support("right")), loads=()))


def test_a_hinge_is_found():
    """Squares that touch at a corner share its node, and the tangent is as singular as with none."""
    scene = block(loose((0.0, 0.0), (1.0, 1.0)), loads=())
    assert refusal(scene) == (
        "the body of the scene 'block' has parts that are joined at single nodes, as at (1, 1), and free to turn "
        "there: parts joined along sides of cells, or held by supports, would be right"
    )
    check_held(replace(scene, supports=(*scene.supports, gx.PointSupport((2.0, 2.0), (None, 0.0)))))


def test_three_hinges_are_no_mechanism():
    """Around a ring of three bodies, hinged to one another, nothing turns: that too is a question of rank."""
    corners = ((0.0, 0.0), (1.0, 1.0), (2.0, 0.0), (1.0, -1.0))
    assert "joined at single nodes, as at " in refusal(block(loose(*corners), loads=()))
    strut = gx.Support("right")
    check_held(block(loose(*corners[:3]), supports=(gx.Support("left"), strut), loads=()))


def test_a_run_is_refused_before_it_is_discretised(shared_folder):
    """No step, no file; and the same by the way of equilibrium."""
    scene = block(supports=(ROLLER,))
    for call in (gx.discretise, gx.solve, gx.homeostasis, lambda *run: next(gx.march(*run))):
        with pytest.raises(InputError, match="is free to move along y"):
            call(scene, gx.Q1P0)


def test_a_large_mesh_costs_little():
    """Seconds for 10⁵ cells would be felt at each start."""
    mesh = gx.scenes.plate(200).mesh  # 80 000 cells
    scene = block(mesh, loads=())
    mesh.domain.topology.create_connectivity(2, 1)
    check_held(scene)
    start = MPI.Wtime()
    check_held(scene)
    assert MPI.Wtime() - start < 1.0


def test_a_mesh_of_one_cell_on_many_ranks():
    """Ranks without a cell take part."""
    mesh = square(1)
    check_held(block(mesh, loads=()))
    assert "rotate about z" in refusal(block(mesh, supports=(HELD_POINT,), loads=()))
