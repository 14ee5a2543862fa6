"""The femur in space: its shape, its landmarks, its forces and the bone that grows in it, as means of zones."""

from dataclasses import replace
from functools import cache

import dolfinx
import numpy as np
import pytest
from blocks import COMM, cube

import growthx as gx
from growthx import meshing, zones
from growthx.common.errors import InputError
from growthx.meshing.mesh import Mesh
from growthx.scenes.femur3d import BODY_WEIGHT, femur3d, loaded_areas
from growthx.scenes.hip import ACTIVITIES, DAILY, Activity, Muscle
from growthx.scenes.solid_anatomy import corners, measure

# Means and standard deviations of ten measured femora, (lateral, anterior, superior) from the head's centre, mm.
GREATER = np.array([46.8, -21.9, 1.3]), np.array([5, 7, 3])
LESSER = np.array([12.0, -14.5, -64.9]), np.array([6, 4, 5])
CROSSING = np.array([41.9, -5.6, -42.0]), np.array([3, 5, 3])


@cache
def mesh(size, **shape):
    """Our own femur's mesh, once for all tests."""
    return meshing.read(meshing.locate("femur3d.geo"), size=size, **shape)


def coarse():
    """A scene on a coarse mesh."""
    return femur3d(mesh(7.0))


def resultant(scene):
    """Sum of the nodal load (N)."""
    loads = gx.discretise(scene, gx.P1P0).system.loads
    return loads.resultant(loads.nodal_load)


def hexahedral(original):
    """The same body, each of whose tetrahedra is cut into four hexahedra, as a user may have it (one rank)."""
    x = original.domain.geometry.x
    points, number = [*map(tuple, x)], {}

    def middle(*corners):
        key = tuple(sorted(corners))
        if len(key) == 1:
            return key[0]
        if key not in number:
            number[key] = len(points)
            points.append(tuple(x[list(key)].mean(axis=0)))
        return number[key]

    cells = []
    for tetrahedron in original.domain.geometry.dofmap.tolist():
        for corner in tetrahedron:
            p, q, r = (other for other in tetrahedron if other != corner)
            if np.linalg.det(x[[p, q, r]] - x[corner]) < 0:
                p, q = q, p
            below = corner, middle(corner, p), middle(corner, p, q), middle(corner, q)
            above = middle(corner, r), middle(corner, p, r), middle(*tetrahedron), middle(corner, q, r)
            cells.append([*below, *above])
    boundaries = {}
    for name in original.boundaries:
        triangles = dolfinx.mesh.entities_to_geometry(original.domain, 2, original.owned_facets(name)).tolist()
        boundaries[name] = [
            [a, middle(a, b), middle(a, b, c), middle(a, c)]
            for triangle in triangles
            for a, b, c in (triangle, triangle[1:] + triangle[:1], triangle[2:] + triangle[:2])
        ]
    return meshing.from_arrays(np.array(points), cells, boundaries=boundaries)


def moved(original, matrix, shift):
    """The same mesh elsewhere, or mirrored: another user's frame."""
    domain = original.domain
    nodes = np.asarray(dolfinx.mesh.entities_to_geometry(domain, 3, original.owned_cells))
    offset = np.cumsum([0, *COMM.allgather(nodes.size)])
    points = np.concatenate(COMM.allgather(domain.geometry.x[nodes.ravel()]))
    cells = np.concatenate(
        [part + start for part, start in zip(COMM.allgather(np.arange(nodes.size)), offset, strict=False)]
    )
    boundaries = {}
    for name in original.boundaries:
        facets = original.owned_facets(name)
        found = dolfinx.mesh.entities_to_geometry(domain, 2, facets) if len(facets) else np.empty((0, 3), np.int32)
        boundaries[name] = np.concatenate(COMM.allgather(domain.geometry.x[found].reshape(-1, 9))).reshape(-1, 3)
    places, once, again = np.unique(points.round(9), axis=0, return_index=True, return_inverse=True)
    number = {tuple(place): index for index, place in enumerate(places)}
    facets = {
        name: np.array([number[tuple(place)] for place in found.round(9)]).reshape(-1, 3)
        for name, found in boundaries.items()
    }
    tetrahedra = again.ravel()[cells].reshape(-1, 4)
    return meshing.from_arrays(points[once] @ np.array(matrix).T + shift, tetrahedra, boundaries=facets)


# -- shape -------------------------------------------------------------------------------------------------------------


def test_the_landmarks_are_those_of_measured_femora():
    """Within one standard deviation of each coordinate, by default; else forces would act where no femur has them."""
    body = mesh(7.0)
    bone = measure(body)
    greater, lesser = corners(body, "trochanter"), corners(body, "lesser trochanter")
    away = lesser - bone.crossing
    off = np.linalg.norm(away - np.outer(away @ bone.shaft, bone.shaft), axis=1)
    for found, (mean, deviation) in (
        (greater[greater[:, 2].argmax()], GREATER),
        (lesser[off.argmax()], LESSER),
        (bone.crossing, CROSSING),
    ):
        assert (np.abs(found - bone.centre - mean) <= deviation).all(), found


def test_the_default_has_the_sizes_of_bones():
    """Of the literature's ranges: head, angles, neck and shaft."""
    body = mesh(7.0)
    bone = measure(body)
    assert bone.radius == pytest.approx(24, rel=1e-6) and bone.lateral == 1
    assert 122 <= bone.neck_shaft_angle <= 133 and 8 <= bone.version <= 14
    surface = corners(body, "surface") - bone.crossing
    depth = surface @ bone.shaft
    section = surface[(depth > 40) & (depth < 60)]
    assert np.ptp(section[:, 1]) == pytest.approx(30, abs=1.5)
    assert body.facet_counts("surface")[0] == 0


@pytest.mark.parametrize(
    "shape",
    [
        {"head_radius": 22.0, "neck_shaft_angle": 133.0, "offset": 42.0, "version": 14.0},
        {"head_radius": 26.0, "neck_shaft_angle": 122.0, "offset": 47.0, "version": 8.0, "left": 1},
    ],
    ids=["valga", "vara, left"],
)
def test_parameters_are_what_is_measured(shape):
    """The measure knows the mesh alone, hence both are right where they agree."""
    bone = measure(mesh(9.0, **shape))
    assert bone.radius == pytest.approx(shape["head_radius"], rel=1e-6)
    assert bone.neck_shaft_angle == pytest.approx(shape["neck_shaft_angle"], abs=3)
    assert bone.version == pytest.approx(shape["version"], abs=3)
    assert bone.lateral == (-1 if shape.get("left") else 1)
    away = bone.crossing - bone.centre
    frontal = bone.shaft[[0, 2]] / np.linalg.norm(bone.shaft[[0, 2]])
    assert abs(away[0] * frontal[1] - away[2] * frontal[0]) == pytest.approx(shape["offset"], abs=2)


def test_another_frame_moves_all_with_it():
    """A user's femur is elsewhere, and of the other side: zones and forces follow the landmarks."""
    mirror, shift = np.diag([-1.0, 1.0, 1.0]), np.array([100.0, -20.0, 7.0])
    ours, other = coarse(), femur3d(moved(mesh(7.0), mirror, shift))
    assert (ours.anatomy.lateral, other.anatomy.lateral) == (1, -1)
    assert other.anatomy.centre == pytest.approx(mirror @ ours.anatomy.centre + shift, abs=1e-6)
    assert other.anatomy.crossing == pytest.approx(mirror @ ours.anatomy.crossing + shift, abs=1e-6)
    for name, zone in ours.zones.items():
        there = np.sort(other.zones[name], axis=0)
        assert there == pytest.approx(np.sort(zone @ mirror + shift, axis=0), abs=1e-5), name
    assert resultant(other) == pytest.approx(mirror @ resultant(ours), rel=1e-9)
    for one, two in zip(loaded_areas(ours), loaded_areas(other), strict=True):
        assert two.area == pytest.approx(one.area, rel=1e-6)


# -- forces ------------------------------------------------------------------------------------------------------------


def test_walking_of_75_kg():
    """The published force, by hand: (498, −174, −1735) N on the head."""
    joint = coarse().cases[0].loads[0]
    assert joint.on == "head" and joint.force == pytest.approx((498, -174, -1735), abs=0.6)


@pytest.mark.parametrize("activity", ACTIVITIES, ids=lambda activity: activity.name)
def test_each_force_is_met_exactly(activity):
    """Tractions on facets are never quite the force wanted: its nodal forces must add up to it all the same."""
    body = mesh(7.0)
    scene = femur3d(body, activities=(activity,), weights=(1.0,), separate=False, body_weight=1000.0)
    joint, *muscles = scene.loads
    assert joint.force == pytest.approx(10 * np.array(activity.joint))
    assert sum(np.linalg.norm(load.force) for load in muscles) == pytest.approx(
        10 * sum(muscle.force for muscle in activity.muscles)
    )
    for load in scene.loads:
        error = resultant(replace(scene, loads=(load,))) - load.force
        assert np.linalg.norm(error) <= 1e-12 * np.linalg.norm(load.force)


def test_forces_act_where_they_are_said_to():
    """The joint's within 45° of the direction it comes from, a muscle's within its radius of the nearest place."""
    scene = coarse()
    joint, *muscles = scene.cases[0].loads
    nodes = corners(scene.mesh, "head")
    cosine = -(nodes - scene.anatomy.centre) @ joint.force / (24.0 * np.linalg.norm(joint.force))
    weight = joint.weight(nodes.T)
    assert np.array_equal(weight > 1e-9, cosine > np.cos(np.radians(45)) + 1e-9) and weight.max() > 0.9
    nodes = corners(scene.mesh, "trochanter")
    for load, muscle in zip(muscles, ACTIVITIES[0].muscles, strict=True):
        nearest = nodes[np.linalg.norm(nodes - muscle.place - scene.anatomy.centre, axis=1).argmin()]
        weight = load.weight(nodes.T)
        assert np.array_equal(weight > 0, np.linalg.norm(nodes - nearest, axis=1) < muscle.radius)
    assert all(area.area > 150 for area in loaded_areas(scene))


def test_cases_share_a_day_or_have_one_each():
    """By stimulus each activity has its whole force; as an average one displacement has the weighted sum."""
    apart, together = coarse(), femur3d(mesh(7.0), separate=False)
    assert [case.weight for case in apart.cases] == list(DAILY) and not apart.loads
    assert not together.cases and len(together.loads) == 12
    expected = sum(
        weight * BODY_WEIGHT / 100 * (np.array(one.joint) + sum(np.array(muscle.pull) for muscle in one.muscles))
        for one, weight in zip(ACTIVITIES, DAILY, strict=True)
    )
    assert resultant(together) == pytest.approx(expected, rel=1e-10)
    alone = femur3d(mesh(7.0), weights=(1.0, 0.0, 0.0))
    assert [case.name for case in alone.cases] == ["walking"]


# -- growth ------------------------------------------------------------------------------------------------------------


@cache
def grown():
    """The zone means of bone in equilibrium with a day, on the mesh with twice fewer cells than the default's."""
    scene = femur3d(mesh(4.5))
    return zones.area_means(gx.solve(scene, gx.P1P0, stepping=gx.AdaptiveSteps(1e-2)).problem, scene.zones)


def test_cortices_and_a_canal_grow():
    """From a uniform density: dense walls on both sides of the shaft, and nearly nothing between them."""
    means = grown()
    assert means["medial cortex"] >= 1.5 and means["lateral cortex"] >= 1.5
    assert means["canal"] <= 0.3


def test_a_strut_bears_the_head():
    """From where the joint presses to the calcar, half as dense again as the bone beside it, and more."""
    means = grown()
    for beside in ("head lateral to the strut", "head medial to the strut", "Ward's triangle"):
        assert means["strut, head to calcar"] >= 1.5 * means[beside], beside
    assert means["calcar"] >= 1.5


def test_wards_triangle_is_the_least_of_the_neck():
    """As in every radiograph, between the strut and the superior side."""
    means = grown()
    assert means["Ward's triangle"] == min(
        means[name] for name in ("Ward's triangle", "middle neck", "superior neck", "calcar", "strut, head to calcar")
    )


@pytest.mark.serial
def test_hexahedra_have_the_same_landmarks_and_forces():
    """A user's mesh of hexahedra: each force is met exactly on sides that are quadrilaterals."""
    tetrahedra = mesh(8.0)
    scene, other = femur3d(hexahedral(tetrahedra), separate=False), femur3d(tetrahedra, separate=False)
    assert scene.mesh.cell_name == "hexahedron" and scene.mesh.cell_count == 4 * tetrahedra.cell_count
    assert scene.anatomy.centre == pytest.approx(other.anatomy.centre, abs=0.1)
    assert scene.anatomy.neck_shaft_angle == pytest.approx(128, abs=3)  # as parameters are measured elsewhere
    loads = gx.discretise(scene, gx.Q1P0).system.loads
    assert loads.resultant(loads.nodal_load) == pytest.approx(sum(np.array(load.force) for load in scene.loads))


@pytest.mark.slow
@pytest.mark.serial
def test_bone_grows_in_hexahedra_as_in_quadratic_tetrahedra():
    """They are not too stiff in bending as linear tetrahedra are: a coarse mesh has cortices, canal and strut."""
    scene = femur3d(hexahedral(mesh(8.0)), weights=(1.0, 0.0, 0.0))
    means = zones.area_means(gx.solve(scene, gx.Q1P0, stepping=gx.AdaptiveSteps(1e-2)).problem, scene.zones)
    assert means["medial cortex"] == pytest.approx(1.89, rel=0.02) and means["canal"] <= 0.3
    assert means["strut, head to calcar"] == pytest.approx(0.95, rel=0.02)


# -- bad input ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"body_weight": 0.0}, r"^the body weight \(N\) is 0: one from 150 to 5000, 9.81 N for a kilogram, would be"),
        ({"body_weight": 75.0}, r"^the body weight \(N\) is 75: one from 150 to 5000"),
        ({"weights": (1.0, 1.0)}, r"^the weights of the activities are \(1.0, 1.0\): 3 numbers"),
        ({"weights": (0.0, 0.0, 0.0)}, "^no activity has a weight"),
        ({"weights": (-1.0, 0.0, 0.0)}, "^the weight of an activity is -1: "),
        ({"activities": ()}, r"^the weights of the activities are \(0.75, 0.2, 0.05\): 0 numbers"),
        ({"separate": 1}, "^separate, of the activities, is 1: "),
        ({"zones": {"a": [[0, 0], [1, 0], [0, 1]]}}, r"^the zone 'a' of the zones is .* a body of four corners"),
        ({"zones": {"a": 20 * np.eye(4, 3)}}, None),
        ({"zones": {"a": np.eye(4, 3) + 900}}, "^the zone 'a' lies outside the mesh: a body that overlaps it "),
        ({"size": 3.0}, "^size is 3.0, for a mesh that is given: the built-in femur has a size"),
        ({"neck_width": 20.0}, "^neck_width is 20.0, for a mesh that is given"),
        ({"left": True}, "^left is True, for a mesh that is given"),
    ],
    ids=str,
)
def test_what_cannot_be_meant_is_one_sentence(changes, sentence):
    """The value, where it came from, what would be right; a zone in the head is fine."""
    if sentence is None:
        assert list(femur3d(mesh(7.0), **changes).zones) == ["a"]
        return
    with pytest.raises(InputError, match=sentence):
        femur3d(mesh(7.0), **changes)


@pytest.mark.parametrize(
    ("shape", "sentence"),
    [
        ({"neck_width": 50.0}, "the neck, 50 by 33 mm, is thicker than the head, of radius 24 mm, can bear"),
        ({"head_radius": 36.0}, "the parameter 'head_radius' of .* is 36: 15 to 35 would be right"),
        ({"cut": 90.0}, "the parameter 'cut' of .* is 90: 110 to 250 would be right"),
        ({"necks": 2.0}, "has no parameter 'necks'; it has 'bow', 'cut', "),
        ({"trusted": True}, "^trusted is True, for a mesh that is not given"),
    ],
    ids=str,
)
def test_impossible_femora_are_one_sentence(shape, sentence):
    """gmsh would make something of them, or nothing for minutes."""
    with pytest.raises(InputError, match=sentence):
        femur3d(**shape)


def test_meshes_that_are_no_femur_are_refused():
    """Without the names, in the plane, upside down, in metres, or with a square head."""
    with pytest.raises(InputError, match=r"^the femur's mesh has no boundary 'head' and 'trochanter' and 'distal'"):
        femur3d(cube(cells=2, shape="tetrahedron"))
    with pytest.raises(InputError, match=r"^the femur's mesh has cells of the shape quadrilateral, and "):
        femur3d(meshing.locate("femur_658.msh"))
    with pytest.raises(InputError, match=r"above its head: a mesh whose z axis points superiorly would be right"):
        femur3d(moved(mesh(9.0), np.diag([1.0, -1.0, -1.0]), 0.0))
    with pytest.raises(InputError, match=r"^the head of the femur's mesh has a radius of 0.024: coordinates in mm"):
        femur3d(moved(mesh(9.0), np.eye(3) / 1000, 0.0))
    with pytest.raises(InputError, match=r"^the boundary 'trochanter' of the femur's mesh is .* mm beside the head"):
        femur3d(moved(mesh(9.0), [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]], 0.0))
    domain = dolfinx.mesh.create_box(COMM, ((0.0, 0.0, 0.0), (40.0, 40.0, 99.0)), (4, 4, 9))
    sides = {"head": lambda x: x[2] > 70, "trochanter": lambda x: x[0] > 39.0, "distal": lambda x: x[2] < 1.0}
    with pytest.raises(InputError, match=r"^the boundary 'head' is not round"):
        femur3d(Mesh.with_names(domain, sides))


def test_muscles_that_pull_at_nothing_are_refused():
    """Far from the boundary, or on a mesh too coarse for an attachment so small."""
    far = Muscle("psoas", 50.0, (0.0, 0.5, 1.0), (12.0, -14.0, -120.0))
    small = Muscle("piriformis", 20.0, (0.0, -0.5, 1.0), (46.0, -18.0, 0.0), radius=0.5)
    for muscle, sentence in (
        (far, r"^the place of psoas is .* mm from the boundary 'trochanter' .*: one within 25 mm would be right"),
        (
            small,
            r"^the force of piriformis in a day would act on . facets of 'trochanter': 3 at least, of a finer mesh",
        ),
    ):
        activity = Activity("a day", ACTIVITIES[0].joint, (muscle,))
        with pytest.raises(InputError, match=sentence):
            femur3d(mesh(7.0), activities=(activity,), weights=(1.0,))


def test_muscles_elsewhere_pull_there():
    """Any boundary will do: the psoas at the lesser trochanter."""
    psoas = Muscle("psoas", 50.0, (-0.1, 0.4, 0.9), (12.0, -14.0, -60.0), on="lesser trochanter")
    activity = Activity("a day", ACTIVITIES[0].joint, (psoas,))
    scene = femur3d(mesh(7.0), activities=(activity,), weights=(1.0,))
    assert [area.on for area in loaded_areas(scene)] == ["head", "lesser trochanter"]


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: Muscle(3, 1.0, (0, 0, 1), (0, 0, 0)), "^the name of a muscle is "),
        (lambda: Muscle("m", 0.0, (0, 0, 1), (0, 0, 0)), r"^the force of m \(% of body weight\) is 0: "),
        (lambda: Muscle("m", 1.0, (0, 0, 0), (0, 0, 0)), "^the direction of m is "),
        (lambda: Muscle("m", 1.0, (0, 1), (0, 0, 0)), r"^the direction of m is .*three numbers \(lateral, anterior"),
        (lambda: Activity("a", (0, 0, 0)), "^the joint force of a is "),
        (lambda: Activity("a", (0, 0, 1), ("m",)), "^an entry of the muscles of a is 'm': a Muscle would be right"),
    ],
    ids=range(6),
)
def test_activities_that_cannot_be_meant(make, sentence):
    """They are the user's own to write."""
    with pytest.raises(InputError, match=sentence):
        make()


def test_zones_of_ones_own_in_space(shared_folder):
    """From a file, corners of convex bodies; a zone's mean is that of the bone in it."""
    path = shared_folder / "zones.csv"
    if COMM.rank == 0:
        rows = [(x, y, z) for x in (-5, 5) for y in (-5, 5) for z in (-5, 5)]
        path.write_text("zone,x_mm,y_mm,z_mm\n" + "".join(f"head,{x},{y},{z}\n" for x, y, z in rows))
    COMM.barrier()
    scene = femur3d(mesh(7.0), zones=path)
    assert {name: corners_.shape for name, corners_ in scene.zones.items()} == {"head": (8, 3)}
    assert zones.area_means(gx.discretise(scene, gx.P1P0), scene.zones) == {"head": pytest.approx(0.8)}
    with pytest.raises(InputError, match=r"a CSV file with the columns zone, x_mm, y_mm and z_mm, a row for each corn"):
        femur3d(mesh(7.0), zones=meshing.locate("femur_zones.csv"))
