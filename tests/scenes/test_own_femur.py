"""Other femurs than the built-in one: forces at their own head and trochanter, or a sentence that says what to give."""

import re

import dolfinx
import numpy as np
import pytest
from blocks import COMM, cube, run

import growthx as gx
from growthx import meshing, zones
from growthx.common.errors import InputError
from growthx.scenes import femur
from growthx.scenes.femur import LOAD_CASES, loaded_arcs
from growthx.scenes.femur import zones as own_zones

HEAD, RADIUS = np.array([43.0, 132.0]), 24.0  # spec: the circle of the built-in head
TIP, OUTERMOST = (-10.8, 134.7), (-29.2, 100.8)  # … its control points 45 and 52
SHIFT = np.array([10.0, -20.0])
ARC = np.radians(70.0) * RADIUS


def moved(move, boundaries=None, **parameters):
    """The built-in femur, coarse, with its nodes moved: x and y to x and y."""
    mesh = meshing.read(meshing.locate("femur.geo"), **{"size": 7.0, **parameters})
    x = mesh.domain.geometry.x
    if boundaries is not None:
        names = {name: _facets(mesh, inside) for name, inside in boundaries.items()}
        mesh = gx.Mesh(mesh.domain, {"distal": mesh.boundary("distal"), **names}, mesh.regions)
    x[:, 0], x[:, 1] = move(x[:, 0].copy(), x[:, 1].copy())
    return mesh


def _facets(mesh, inside):
    """Facets of "surface" whose middles are at places for which a function is true."""
    facets = mesh.boundary("surface")
    return facets[inside(*dolfinx.mesh.compute_midpoints(mesh.domain, 1, facets)[:, :2].T)]


def scaled(factor):
    return lambda x, y: (factor * x, factor * y)


def mirrored(x, y):
    return -x, y


def turned(degrees):
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return lambda x, y: (c * x - s * y, s * x + c * y)


def on_head(x, y):
    return np.abs(np.hypot(x - HEAD[0], y - HEAD[1]) - RADIUS) < 0.6


def on_trochanter(x, y):
    return (x < -12) & (y > 100)


def refusal(*arguments, **parameters):
    """The sentence by which a femur is refused."""
    with pytest.raises(InputError) as caught:
        femur(*arguments, **parameters)
    return str(caught.value)


def lengths(scene, force):
    return [arc.length for arc in loaded_arcs(scene) if arc.force == force]


def resultants(scene):
    """The nodal sums of each force of a scene (N)."""
    found = []
    for load in scene.loads:
        problem = gx.discretise(gx.scenes.Femur(**{**vars(scene), "loads": (load,)}), gx.Q1P0)
        found.append(scene.thickness * problem.system.loads.resultant(problem.system.loads.nodal_load))
    return np.array(found)


def table(medial):
    """The forces (N) of the three cases by turns, joint and abductor, under the weights of the daily cycles."""
    rows = []
    for case, weight in zip(LOAD_CASES, (0.6, 0.2, 0.2), strict=True):
        for x, y in (case.joint_force, case.abductor_force):
            rows.append((weight * medial * x, weight * y))
    return np.array(rows)


# -- the head ----------------------------------------------------------------------------------------------------------


def test_the_built_in_femur_says_where_its_forces_act():
    """±35° of the head's arc for each joint force, the insertion for each abductor force, in mm of facets."""
    scene = femur()
    assert lengths(scene, "joint") == pytest.approx([ARC] * 3, rel=0.01)
    assert lengths(scene, "abductor") == pytest.approx([43.0] * 3, rel=0.01)
    assert [arc.newtons for arc in loaded_arcs(scene)[:2]] == pytest.approx([0.6 * 2317, 0.6 * 703])
    assert (scene.anatomy.head.x, scene.anatomy.head.y, scene.anatomy.head.radius) == (*HEAD, RADIUS)


def test_the_same_outline_as_a_mesh_is_the_built_in_femur():
    """Its control points and zones hold for it, so every digit is the same."""
    one = femur()
    other = femur(one.mesh)
    assert other.anatomy.ours and set(other.zones) == set(own_zones())
    forces = [gx.discretise(scene, gx.Q1P0).system.loads.nodal_load for scene in (one, other)]
    assert np.array_equal(*forces)


@pytest.mark.parametrize("given", [True, False], ids=["given", "fitted"])
@pytest.mark.parametrize(
    ("move", "factor", "centre"),
    [(scaled(1.05), 1.05, 1.05 * HEAD), (lambda x, y: (x + 10, y - 20), 1.0, HEAD + SHIFT)],
    ids=["scaled", "shifted"],
)
def test_the_forces_follow_the_users_own_head(move, factor, centre, given):
    """The built-in circle would have them beside it: the lengths scale, the forces stay those of the table."""
    mesh = moved(move, size=5.0)
    scene = femur(mesh, head=(*centre, factor * RADIUS) if given else None)
    head = scene.anatomy.head
    assert (head.x, head.y) == pytest.approx(centre, abs=0.1) and head.radius == pytest.approx(
        factor * RADIUS, rel=2e-3
    )
    assert lengths(scene, "joint") == pytest.approx([factor * ARC] * 3, rel=0.02)
    assert lengths(scene, "abductor") == pytest.approx([factor * 43.0] * 3, rel=0.05)
    assert resultants(scene) == pytest.approx(table(1), rel=1e-11)
    assert not scene.zones and not scene.anatomy.ours
    assert ("fitted to" in head.how) is not given


def test_lengths_of_a_scaled_femur_are_scaled():
    """To round-off, with the head given: nothing in mm of our own decides anything."""
    one = femur(moved(scaled(1.05)), head=(*(1.05 * HEAD), 1.05 * RADIUS))
    two = femur(moved(scaled(1.5)), head=(*(1.5 * HEAD), 1.5 * RADIUS))
    for force in ("joint", "abductor"):
        assert lengths(two, force) == pytest.approx([1.5 / 1.05 * length for length in lengths(one, force)], rel=1e-9)


def test_a_wrong_head_is_refused():
    """The built-in circle on a larger femur: the joint's force would act beside the head, or on nothing."""
    sentence = refusal(moved(scaled(1.05)), head=(*HEAD, RADIUS))
    assert re.match(r"the joint force of midstance of gait would act on \d facets and \S+ of 29.3 mm of arc", sentence)


def test_a_head_that_is_not_round_is_refused():
    """A circle that does not fit to 2 % is nobody's head."""
    sentence = refusal(moved(lambda x, y: (x + 3 * np.sin(y / 5), y)))
    assert sentence.startswith(
        "no part of 'surface' is round like a head, 150° of a circle to 2%: its centre and radius"
    )
    sentence = refusal(moved(lambda x, y: (1.2 * x, y)))
    assert "round" in sentence or "would act on" in sentence


def test_named_boundaries_place_the_forces():
    """A mesh with head, trochanter and the rest, with or without a surface that covers all of them."""
    parts = {"head": on_head, "trochanter": on_trochanter}
    for more in ({}, {"surface": lambda x, y: x < 1e9}, {"rest": lambda x, y: ~on_head(x, y) & ~on_trochanter(x, y)}):
        scene = femur(moved(scaled(1.1), {**parts, **more}, size=4.0))
        head = scene.anatomy.head
        assert {load.on for load in scene.loads} == {"head", "trochanter"}
        assert (head.x, head.y, head.radius) == pytest.approx((*(1.1 * HEAD), 1.1 * RADIUS), rel=1e-3)
        assert lengths(scene, "joint") == pytest.approx([1.1 * ARC] * 3, rel=0.02)
        assert resultants(scene) == pytest.approx(table(1), rel=1e-11)
        assert not scene.zones


def test_parts_of_our_outline_are_our_outline():
    """Named in parts, it still has its zones; the forces act where the names say."""
    rest = {"surface": lambda x, y: ~on_head(x, y) & ~on_trochanter(x, y)}
    scene = femur(moved(scaled(1.0), {"head": on_head, "trochanter": on_trochanter, **rest}, size=4.0))
    assert scene.anatomy.ours and set(scene.zones) == set(own_zones())
    assert scene.anatomy.head.on == "head" and scene.anatomy.insertion.on == "trochanter"


def test_a_boundary_that_is_no_head_is_refused():
    """Named by mistake: shaft and neck lie on no circle, and half a head does not bear all forces."""
    names = {"trochanter": on_trochanter, "surface": lambda x, y: x < 1e9}
    assert refusal(moved(scaled(1.1), {"head": lambda x, y: y > 60, **names})).startswith(
        "the boundary 'head' is not round (its nodes lie up to"
    )
    half = refusal(moved(scaled(1.1), {"head": lambda x, y: on_head(x, y) & (x > 43), **names}))
    assert re.match(r"the joint force of .* would act on \d+ facets and \S+ of 32.2 mm of arc on 'head'", half)


def test_the_outline_is_the_meshs_whatever_is_named():
    """With the distal cut in "surface" or without, and where only a part of the outline has that name."""
    for inside in (lambda x, y: x < 1e9, lambda x, y: y > 90):
        scene = femur(moved(scaled(1.0), {"surface": inside}))
        assert scene.anatomy.ours and scene.anatomy.lean == pytest.approx(0.0, abs=1.5)
    mesh = moved(scaled(1.1))
    mesh.domain.topology.create_connectivity(1, 2)
    around = dolfinx.mesh.exterior_facet_indices(mesh.domain.topology)
    closed = gx.Mesh(mesh.domain, {**mesh.boundaries, "surface": np.sort(around)}, mesh.regions)
    one, other = femur(mesh).anatomy, femur(closed).anatomy
    assert other.head.radius == pytest.approx(one.head.radius, rel=1e-3)
    assert other.insertion.length == pytest.approx(one.insertion.length, rel=1e-3)


def test_what_is_missing_is_named():
    """Boundaries that would do, where there is none on which head or trochanter could be looked for."""
    assert refusal(moved(scaled(1.1), {"head": on_head})).startswith(
        "the femur's mesh has no boundary 'surface' on which the abductors' insertion can be looked for, nor"
    )
    assert refusal(moved(scaled(1.1), {"trochanter": on_trochanter})).startswith(
        "the femur's mesh has no boundary 'surface' on which the head can be looked for, nor 'head'"
    )


# -- the trochanter ----------------------------------------------------------------------------------------------------


def test_the_insertion_is_found_where_ours_is():
    """On a shifted outline, which is not ours: from its own shape within a few mm of what our control points say."""
    arc = femur(moved(lambda x, y: (x + 10, y - 20), size=3.5)).anatomy.insertion.arc - (10, -20)
    assert np.hypot(*(arc[0] - TIP)) < 3 and np.hypot(*(arc[-1] - OUTERMOST)) < 3


def test_the_insertion_between_given_ends():
    """For a femur on which it cannot be told, or is elsewhere."""
    scene = femur(moved(scaled(1.1), size=3.5), trochanter=(1.1 * np.array([TIP, OUTERMOST])).tolist())
    assert lengths(scene, "abductor") == pytest.approx([1.1 * 43.0] * 3, rel=0.1)
    sentence = refusal(moved(scaled(1.1)), trochanter=((0.0, 50.0), (0.0, 60.0)))
    assert sentence.startswith("the ends (0, 50) and (0, 60) of the abductors' insertion are not on one stretch of")


def test_a_femur_without_a_trochanter_is_refused():
    """Cut off at the neck: where the abductors pull is for the user to say."""
    flat = moved(lambda x, y: (np.where(x < 10, np.maximum(x, -17 + 0.1 * y), x), np.where(x < 10, 0.8 * y, y)))
    assert refusal(flat).startswith("the greater trochanter cannot be told on 'surface'")


# -- sides and directions ----------------------------------------------------------------------------------------------


def test_a_mirrored_femur_grows_the_mirror_image():
    """Left or right: mass and the means of the zones, which are mirrored with it, to round-off."""
    answers = []
    for mesh in (moved(scaled(1.0)), moved(mirrored)):
        scene = femur(mesh, until=12.0)
        _, problem = run(scene, gx.Q1P0)
        answers.append((problem.mass(), *zones.area_means(problem, scene.zones).values()))
        assert len(answers[-1]) == 11
    assert answers[1] == pytest.approx(answers[0], rel=1e-11)
    assert scene.anatomy.head.medial == -1 and scene.anatomy.head.x == -HEAD[0]
    assert resultants(scene) == pytest.approx(table(-1), rel=1e-11)


@pytest.mark.parametrize("options", [{}, {"head": True}], ids=["fitted", "given"])
def test_a_foreign_femur_of_the_other_side(options):
    """Which side is medial is seen from the head."""
    given = {"head": (-1.1 * HEAD[0], 1.1 * HEAD[1], 1.1 * RADIUS)} if options else {}
    scene = femur(moved(lambda x, y: (-1.1 * x, 1.1 * y)), **given)
    assert scene.anatomy.head.medial == -1
    assert resultants(scene) == pytest.approx(table(-1), rel=1e-11)
    assert scene.anatomy.insertion.arc[:, 0].min() > 10


def test_a_leaning_femur():
    """A little is how femurs stand, and is told; a lot is a mesh whose y axis is not proximal."""
    for degrees in (8.0, -8.0):
        anatomy = femur(moved(turned(degrees))).anatomy
        assert anatomy.lean == pytest.approx(-degrees, abs=1.0)
        length = anatomy.insertion.length
        assert length == pytest.approx(42.0, rel=0.05)
    for degrees in (30, 90, 180, 270):
        lean = min(degrees, 360 - degrees)
        assert re.match(rf"the shaft of the femur's mesh leans by {lean}° from", refusal(moved(turned(degrees))))


# -- units, cells, zones -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("factor", [1e-3, 1e-2, 0.1, 1e3])
def test_other_units_than_mm_are_named(factor):
    """The loads are in N and the material in MPa."""
    for head in (None, (*(factor * HEAD), factor * RADIUS)):
        sentence = refusal(moved(scaled(factor)), head=head)
        assert sentence.startswith(f"the femur's mesh extends over {155.97 * factor:.3g}") or factor == 1e3
        assert "coordinates in mm would be right" in sentence
        assert ("metres" in sentence) is (factor == 1e-3 or factor == 1e-2)


def test_a_mesh_in_space_is_refused():
    """The scene is plane; 3D has none yet."""
    for shape in ("tetrahedron", "hexahedron"):
        assert refusal(cube(shape=shape)).startswith(
            f"the femur's mesh has cells of the shape {shape}, and its scene is"
        )


def test_zones_of_ones_own(shared_folder):
    """As a file or as polygons, on any femur; the mean of the uniform density is that density."""
    path = shared_folder / "zones.csv"
    if COMM.rank == 0:
        path.write_text(
            "zone,x_mm,y_mm\nshaft,-20,10\nshaft,20,10\nshaft,20,50\nhead,50,140\nhead,60,140\nhead,55,150\n"
        )
    COMM.barrier()
    mesh = moved(scaled(1.1))
    polygons = {"shaft": [(-20, 10), (20, 10), (20, 50)], "head": [(50, 140), (60, 140), (55, 150)]}
    for given in (path, str(path), polygons):
        scene = femur(mesh, zones=given)
        assert {name: polygon.tolist() for name, polygon in scene.zones.items()} == {
            name: [[float(x) for x in corner] for corner in corners] for name, corners in polygons.items()
        }
        means = zones.area_means(gx.discretise(scene, gx.Q1P0), scene.zones)
        assert means == pytest.approx({"shaft": 1.2, "head": 1.2})


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        (
            "missing.csv",
            r"the zones missing.csv cannot be read \(No such file or directory\): a CSV file would be right",
        ),
        ({}, r"the zones are {}: a file, or a mapping"),
        (
            {"a": [(0, 0), (1, 1)]},
            r"the zone 'a' of the zones is .*: a polygon of three corners \(x, y\) in mm or more",
        ),
        ({"a": [(0, 0), (1, 1), (2, 2)]}, r"the zone 'a' of the zones has no area"),
        ({"a": [(900, 0), (901, 0), (900, 1)]}, r"the zone 'a' lies outside the mesh"),
    ],
)
def test_zones_that_cannot_be_meant_are_refused(given, sentence):
    """Before the run, not after it."""
    assert re.match(sentence, refusal(moved(scaled(1.1)), zones=given))


def test_a_damaged_file_of_zones_is_refused(shared_folder):
    """The columns are told."""
    path = shared_folder / "zones.csv"
    if COMM.rank == 0:
        path.write_text("name,x,y\na,0,0\n")
    COMM.barrier()
    assert "a CSV file with the columns zone, x_mm and y_mm, a row for each corner" in refusal(zones=path, size=9.0)


def test_what_belongs_to_a_mesh_needs_one():
    """The built-in outline has a head and a trochanter of its own."""
    assert refusal(head=(1.0, 2.0, 3.0)).startswith("the head is (1.0, 2.0, 3.0), for a mesh that is not given")


@pytest.mark.parametrize(
    ("parameters", "sentence"),
    [
        ({"head": (1.0, 2.0)}, "the head is (1.0, 2.0): its centre x, y and radius in mm would be right"),
        ({"head": (1.0, 2.0, -3.0)}, "the radius of the head (mm) is -3: a positive number would be right"),
        ({"trochanter": (1.0, 2.0, 3.0)}, "the trochanter is (1.0, 2.0, 3.0): two places (x, y) in mm"),
    ],
)
def test_impossible_places_are_refused(parameters, sentence):
    """Each by its own sentence."""
    assert refusal(moved(scaled(1.1)), **parameters).startswith(sentence)
