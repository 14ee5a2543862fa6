"""Boundaries made after reading: pieces of the surface, sets of nodes, functions of position; what is near if empty."""

import numpy as np
import pytest
from blocks import COMM, boundary_size, cube, square

import growthx as gx
from growthx import meshing
from growthx.common.errors import InputError

L_SHAPE = ([[0, 0], [1, 0], [2, 0], [0, 1], [1, 1], [2, 1], [0, 2], [1, 2]], [[0, 1, 4, 3], [1, 2, 5, 4], [3, 4, 7, 6]])


def refusal(mesh, **named):
    with pytest.raises(InputError) as caught:
        mesh.named(**named)
    (sentence,) = set(COMM.allgather(str(caught.value)))
    return sentence


@pytest.mark.parametrize("shape", ["tetrahedron", "hexahedron"])
def test_a_cube_has_six_patches(shape):
    """Each of area 1, facing outwards, in an order that does not depend on ranks."""
    patches = meshing.patches(cube(cells=3, shape=shape))
    assert [patch.size for patch in patches] == pytest.approx([1.0] * 6)
    assert [patch.count for patch in patches] == [9 * (2 if shape == "tetrahedron" else 1)] * 6
    for patch in patches:
        assert np.array(patch.normal) == pytest.approx(2 * np.array(patch.centre) - 1, abs=1e-9)
        assert COMM.allreduce(len(patch.facets)) == patch.count
    assert len(set(COMM.allgather(tuple(map(str, patches))))) == 1
    assert "facing (-1, 0, 0)" in str(meshing.nearest(patches, (0, 0.5, 0.5)))


def test_an_outline_has_its_straight_pieces():
    """An L has six, the longer ones first."""
    patches = meshing.patches(meshing.from_arrays(*L_SHAPE))
    assert [patch.size for patch in patches] == pytest.approx([2, 2, 1, 1, 1, 1])
    assert {patch.centre for patch in patches[:2]} == {(0, 1), (1, 0)}
    assert patches[0].low == (0, 0) and patches[0].high == (0, 2)


@pytest.mark.parametrize(("angle", "count"), [(10, 24), (20, 1)])
def test_the_angle_decides_what_is_sharp(angle, count):
    """A polygon of 24 sides turns by 15 degrees at each corner."""
    angles = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    points = np.vstack([[[0, 0]], np.column_stack([np.cos(angles), np.sin(angles)])])
    cells = [[0, i + 1, (i + 1) % 24 + 1] for i in range(24)]
    patches = meshing.patches(meshing.from_arrays(points, cells), angle)
    assert len(patches) == count
    if count == 1:
        assert patches[0].normal == (0, 0) and patches[0].size == pytest.approx(48 * np.sin(np.pi / 24))


def test_a_warped_surface_is_one_patch():
    """What is smooth is not cut at the edges of cells."""
    assert len(meshing.patches(cube(cells=4, distortion=0.05))) == 6


def test_patches_sets_and_functions_become_boundaries():
    """And all of them together; what was there stays."""
    mesh = square(cells=4)
    patches = meshing.patches(mesh)
    left = np.flatnonzero(np.isclose(mesh.domain.geometry.x[:, 0], 0))
    numbers = np.unique(np.concatenate(COMM.allgather(mesh.origin.nodes[left])))
    named = mesh.named(
        boundaries={
            "upper": meshing.nearest(patches, (0.5, 1.0)),
            "outlet": numbers,
            "ends": (numbers, meshing.nearest(patches, (1.0, 0.5)), lambda x: np.isclose(x[0], 0)),
            "low": lambda x: np.isclose(x[1], 0),
        },
        regions={"one": [0], "half": lambda x: x[0] <= 0.5 + 1e-9},
    )
    lengths = {name: boundary_size(named, name) for name in ("upper", "outlet", "ends", "low", "left")}
    assert lengths == pytest.approx({"upper": 1, "outlet": 1, "ends": 2, "low": 1, "left": 1})
    assert COMM.allreduce(int(np.sum(named.region("one") < len(named.owned_cells)))) == 1
    assert COMM.allreduce(int(np.sum(named.region("half") < len(named.owned_cells)))) == 8
    assert named.cell_values(np.arange(16.0)).x.array.tolist() == mesh.cell_values(np.arange(16.0)).x.array.tolist()


def test_a_run_on_a_boundary_made_of_a_patch():
    """Supports and loads do not know where it comes from."""
    mesh = square(cells=2)
    patches = meshing.patches(mesh)
    mesh = mesh.named(boundaries={"a": meshing.nearest(patches, (0, 0.5)), "b": meshing.nearest(patches, (1, 0.5))})

    def reaction(held, pulled):
        scene = gx.Scene(
            name="pulled",
            mesh=mesh,
            material=gx.Material(young=1.0, poisson=0.3),
            growth=gx.EnergyDrivenGrowth(attractor=0.01, rate=1.0),
            supports=(gx.Support(held),),
            loads=(gx.Traction(pulled, (0.1, 0.0)),),
            program=gx.Program(step=0.1, until=0.1),
        )
        return gx.solve(scene, gx.Q1).steps[-1].reactions[held]

    assert reaction("a", "b") == pytest.approx(reaction("left", "right"), rel=1e-12)


@pytest.mark.parametrize(
    ("named", "sentence"),
    [
        ({"boundaries": {"left": lambda x: x[0] < 1}}, "the mesh has 'left' among its boundaries: a name of its own"),
        ({"regions": {"bone": [0]}}, "the mesh has 'bone' among its regions"),
        ({"boundaries": {"far": lambda x: x[0] > 5}}, "and the mesh extends from (0, 0) to (1, 1)"),
        (
            {"boundaries": {"tip": lambda x: (x[0] > 0.9) & (x[1] > 0.9)}},
            "of a cell on the surface lies with all of its corners there, a corner of cells lies there, at (1, 1),",
        ),
        (
            {"regions": {"tip": lambda x: (x[0] > 0.9) & (x[1] > 0.9)}},
            "a corner of cells lies there, at (1, 1), and the",
        ),
        (
            {"boundaries": {"middle": lambda x: np.isclose(x[0], 0.5)}},
            "5 corners of cells lie there, the first at (0.5, 0), and so do 4 sides inside the body, and the",
        ),
        ({"boundaries": {"far": [0]}}, "of which 1 are on the surface; the side about ("),
        (
            {"boundaries": {"far": [25]}},
            "the nodes of the boundary 'far' have 25 among them: whole numbers from 0, below",
        ),
        ({"boundaries": {"far": []}}, "the nodes of the boundary 'far' are []"),
        ({"boundaries": {"far": 3.0}}, "the nodes of the boundary 'far' are 3.0"),
        ({"boundaries": {"far": "left"}}, "the nodes of the boundary 'far' are 'left'"),
        ({"regions": {"far": [16]}}, "the cells of the region 'far' have 16 among them"),
        ({"boundaries": ["far"]}, "what names the boundaries of a mesh is ['far']"),
        ({"boundaries": {3: [0]}}, "a name in the boundaries of a mesh is 3"),
        ({"boundaries": {"far": lambda x: x[0]}}, "the function that places 'far' gave an array of float64"),
    ],
)
def test_refused_names(named, sentence):
    """Each in a sentence that says what is near, on all ranks."""
    mesh = meshing.from_arrays(
        [[x / 4, y / 4] for y in range(5) for x in range(5)],
        [[i + 5 * j, i + 5 * j + 1, i + 5 * j + 6, i + 5 * j + 5] for j in range(4) for i in range(4)],
        regions={"bone": [0]},
        boundaries={"left": [0, 5, 10, 15, 20]},
    )
    assert sentence in refusal(mesh, **named)


@pytest.mark.parametrize("angle", [0, 180, -1, "30", None])
def test_refused_angles(angle):
    """In a sentence."""
    with pytest.raises(
        InputError, match=r"^the angle between patches is .*: degrees between 0 and 180 would be right$"
    ):
        meshing.patches(square(cells=2), angle)


@pytest.mark.parametrize(("some", "at"), [((), (0, 0)), (None, (0, 0, 0)), (None, "here"), ([1], (0, 0))])
def test_refused_places(some, at):
    """Of patches that there are not."""
    with pytest.raises(InputError):
        meshing.nearest(meshing.patches(square(cells=2)) if some is None else some, at)


def test_patches_are_chosen_by_a_list_of_ones_own():
    """As a comprehension gives them, or together with sets of nodes."""
    mesh = square(cells=3)
    patches = meshing.patches(mesh)
    level = [patch for patch in patches if patch.normal[0] == 0]
    named = mesh.named(
        boundaries={"level": level, "all": [*level, lambda x: np.isclose(x[0], 0) | np.isclose(x[0], 1)]}
    )
    assert (boundary_size(named, "level"), boundary_size(named, "all")) == pytest.approx((2, 4))


def test_a_patch_of_another_mesh_is_refused():
    """Its numbers are those of other sides."""
    for cells in (40, 2):  # also where there are sides of the same numbers
        (*_, strange) = meshing.patches(square(cells=cells))
        assert refusal(square(cells=2), boundaries={"far": strange}) == (
            "a patch of the boundary 'far' is of another mesh: one of this mesh would be right"
        )


def test_what_is_near_an_empty_name_is_still_said_of_a_mesh_with_more_names():
    """The places of the old names are not looked for again."""
    empty = meshing.mesh.Mesh.with_names(square(cells=2).domain, {"tip": lambda x: (x[0] > 0.9) & (x[1] > 0.9)})
    for mesh in (empty, empty.named(regions={"bone": lambda x: x[0] < 2})):
        with pytest.raises(InputError, match=r"a corner of cells lies there, at \(1, 1\), and the mesh extends"):
            mesh.boundary("tip")


def test_numbers_that_differ_from_rank_to_rank_are_refused():
    """Each rank's own nodes are not the set: the boundary would have gaps where ranks meet."""
    mesh, numbers = square(cells=4), [0, 1, 2] if COMM.rank else [0, 1, 2, 3, 4]
    if COMM.size > 1:
        assert "the nodes of the boundary 'a' differ from rank to rank" in refusal(mesh, boundaries={"a": numbers})
        assert "the cells of the region 'a' differ from rank to rank" in refusal(mesh, regions={"a": numbers})


def test_thousands_of_patches_have_their_own_sizes():
    """The surface of voxels: every piece is flat, and together they are the surface."""
    full = np.random.default_rng(0).random((8, 8, 8)) < 0.6
    z, y, x = np.nonzero(full)
    first = x + 9 * (y + 9 * z)
    cells = np.add.outer(first, [0, 1, 10, 9, 81, 82, 91, 90])
    points = np.stack(np.meshgrid(*[np.arange(9.0)] * 3, indexing="ij")[::-1], axis=-1).reshape(-1, 3)
    patches = meshing.patches(meshing.from_arrays(points, cells))
    padded = np.pad(full, 1).astype(int)
    assert sum(patch.size for patch in patches) == pytest.approx(
        sum(np.abs(np.diff(padded, axis=a)).sum() for a in range(3))
    )
    for patch in patches:
        assert sorted(np.abs(patch.normal)) == [0, 0, 1] and patch.size == pytest.approx(patch.count)
        flat = np.abs(patch.normal) == 1
        assert np.array(patch.low)[flat] == np.array(patch.high)[flat] == np.array(patch.centre)[flat]
    assert len(set(COMM.allgather(tuple(map(str, patches))))) == 1


@pytest.mark.parametrize(("angle", "counts"), [(20, [24 * 2] * 4), (10, [24 * 2] * 2 + [2] * 48)])
def test_a_tube_has_its_walls_and_ends(angle, counts):
    """Walls of 24 flat pieces, which turn by 15 degrees, are one each or 24; the ends are flat."""
    turn, (inner, outer) = np.linspace(0, 2 * np.pi, 24, endpoint=False), (1.0, 3.0)
    circle = np.column_stack([np.cos(turn), np.sin(turn)])
    points = np.vstack([np.column_stack([r * circle, np.full(24, z)]) for z in (0, 1, 2) for r in (inner, 2.0, outer)])
    i, j, k = (part.ravel() for part in np.meshgrid(np.arange(24), [0, 1], [0, 1], indexing="ij"))
    ring = [
        24 * (j + dj + 3 * (k + dk)) + (i + di) % 24 for dk in (0, 1) for di, dj in ((0, 0), (0, 1), (1, 1), (1, 0))
    ]
    patches = meshing.patches(meshing.from_arrays(points, np.column_stack(ring)), angle)
    assert sorted(patch.count for patch in patches) == sorted(counts)
    edge, area = 2 * np.sin(np.pi / 24), (outer**2 - inner**2) * 12 * np.sin(np.pi / 12)
    walls = [2 * edge * 24 * outer, 2 * edge * 24 * inner]
    assert sum(patch.size for patch in patches) == pytest.approx(sum(walls) + 2 * area)
    if angle == 20:
        assert sorted(patch.size for patch in patches) == pytest.approx(sorted([*walls, area, area]))
        assert sorted(patch.normal for patch in patches) == [(0, 0, -1), (0, 0, 0), (0, 0, 0), (0, 0, 1)]
