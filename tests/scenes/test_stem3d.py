"""Bone around a stem in space: that the geometry is what it says and bears what the femur bears."""

from functools import cache

import numpy as np
import pytest
from blocks import COMM, cube

import growthx as gx
from growthx.meshing.sampling import positions
from growthx.scenes.femur3d import loaded_areas
from growthx.scenes.stem import COBALT_CHROMIUM, TITANIUM

SIZE = 9.0
STEPPING = gx.AdaptiveSteps(2e-2, equilibrium=1e-3)
PROXIMAL, DISTAL = [0, 1, 5, 6], [2, 3, 4]  # of Gruen's zones


@cache
def mesh(**shape):
    """The femur with a stem, coarse."""
    return gx.scenes.stem3d_mesh(size=SIZE, **shape)


@cache
def intact():
    """A run of the intact femur, walking, in the cells that it has with the stem."""
    femur = gx.scenes.femur3d(mesh(natural=True), weights=(1.0, 0.0, 0.0), until=200.0)
    return gx.solve(femur, gx.P2, stepping=STEPPING)


@cache
def table(young):
    """What a stem does to Gruen's zones; None: one of bone, with the femur's own head."""
    return tabled(intact(), mesh(natural=True) if young is None else mesh(), young, gx.P2, STEPPING)


def tabled(before, body, young, variant, stepping):
    """The zones, by what is told of each."""
    carried = gx.transfer(before, body, variant, outside=0.8)
    scene = gx.scenes.stem3d(before.scene, body, carried, young=young)
    result = gx.solve(scene, variant, stepping=stepping)
    assert before.ended == result.ended == "equilibrium"
    return list(gx.shielding(before, gx.loaded(scene, variant), result).values())


def changes(zones):
    """Of density, relative."""
    return np.array([zone.change for zone in zones])


def assert_as_observed(soft, stiff):
    """What densitometry finds around metals, of which one is stiffer."""
    for found in (soft, stiff):
        assert np.argmin(found) == 6  # the calcar
        assert found[PROXIMAL].max() < found[DISTAL].min() and found[3] > 0
    assert (stiff[[0, 1, 5, 6]] < soft[[0, 1, 5, 6]]).all() and stiff[6] < soft[6] - 0.1


def volume(body, name):
    """Of a region (mm³)."""
    problem = gx.discretise(gx.scenes.stem3d(intact().scene, body, 0.8, young=TITANIUM), gx.P1P0)
    return problem.mass(name) / 0.8


def test_the_stem_is_in_the_bone_and_bears_the_femurs_loads():
    """One conforming mesh: the same forces in N, on the head of the stem and on the trochanter of the bone."""
    femur, body = intact().scene, mesh()
    scene = gx.scenes.stem3d(femur, body, 0.8, young=TITANIUM)
    sizes = [[(area.force, area.on, area.newtons) for area in loaded_areas(each)] for each in (femur, scene)]
    assert sizes[0] == sizes[1]
    loads = gx.discretise(scene, gx.P1P0).system.loads
    whole = gx.discretise(femur, gx.P1P0).system.loads
    assert loads.resultant(loads.nodal_load) == pytest.approx(whole.resultant(whole.nodal_load), rel=1e-9)
    assert scene.growing == ("bone",) and scene.program.ramp == 0.0
    inner, count = body.facet_counts("interface")
    assert inner == count > 50
    assert 15_000 < volume(body, "stem") < 40_000 and 100_000 < volume(body, "bone") < 130_000


def test_gruens_zones_are_where_radiologists_have_them():
    """Lateral ones beside the medial ones of their height, the fourth below them, and none of the metal counts."""
    scene = gx.scenes.stem3d(intact().scene, mesh(), 0.8, young=TITANIUM)
    assert list(scene.zones) == [f"Gruen {number}" for number in range(1, 8)]
    problem = gx.discretise(scene, gx.P1P0)
    middle = positions(scene.mesh, np.full((1, 3), 0.25))[:, 0]
    x, z = (gx.zones.area_means(problem, scene.zones, values=middle[:, axis]) for axis in (0, 2))
    for lateral, medial in ((1, 7), (2, 6), (3, 5)):
        assert x[f"Gruen {lateral}"] > x[f"Gruen {medial}"] + 5.0
        assert abs(z[f"Gruen {lateral}"] - z[f"Gruen {medial}"]) < 30.0
    assert z["Gruen 7"] > z["Gruen 6"] > z["Gruen 5"] > z["Gruen 4"]


def test_the_calcar_loses_most_and_more_beside_a_stiffer_stem():
    """What is observed, on a coarse mesh: zone 7 most, distal zones least, cobalt-chromium more than titanium."""
    assert_as_observed(changes(table(TITANIUM)), changes(table(COBALT_CHROMIUM)))
    calcar = table(TITANIUM)[6]
    assert calcar.energy_before < 0.5 * calcar.energy_intact and calcar.energy_after < 0.5 * calcar.energy_intact


def test_a_stem_of_bone_is_none_in_space():
    """The check: as stiff as the bone that it replaces, with the femur's own head, it changes next to nothing."""
    own = table(None)
    assert np.abs(changes(own)).max() < 3e-3 < 0.2 < np.abs(changes(table(TITANIUM))).max()
    for zone in own:
        assert zone.energy_before == pytest.approx(zone.energy_intact, rel=0.02)
        assert zone.energy_after == pytest.approx(zone.energy_intact, rel=0.02)


def test_the_intact_femur_has_the_cells_of_that_with_the_stem():
    """Else the table would have what a mesh does to a density: bone begins with its own, to round-off."""
    whole, part = (
        gx.discretise(gx.scenes.stem3d(intact().scene, each, gx.transfer(intact(), each, gx.P2)), gx.P2)
        for each in (mesh(natural=True), mesh())
    )
    assert whole.mass("bone") == pytest.approx(part.mass("bone"), rel=1e-12)
    one, two = (gx.zones.area_means(problem, part.scene.zones) for problem in (whole, part))
    assert one == pytest.approx(two, rel=1e-9)
    assert whole.scene.zones["Gruen 7"] == pytest.approx(part.scene.zones["Gruen 7"], abs=1e-9)


@pytest.mark.slow
def test_the_table_of_the_page():
    """docs/stem.md, in space: P2 on 6 mm."""
    steps = gx.AdaptiveSteps(1e-2, equilibrium=1e-3)
    whole, body = (gx.scenes.stem3d_mesh(size=6, natural=natural) for natural in (True, False))
    femur = gx.scenes.femur3d(whole, weights=(1.0, 0.0, 0.0), until=200.0)
    before = gx.solve(femur, gx.P2, stepping=steps)
    soft, stiff = (changes(tabled(before, body, young, gx.P2, steps)) for young in (TITANIUM, COBALT_CHROMIUM))
    assert_as_observed(soft, stiff)
    assert soft == pytest.approx([-0.263, -0.225, -0.047, 0.052, -0.069, -0.165, -0.301], abs=0.003)
    assert stiff == pytest.approx([-0.278, -0.303, -0.064, 0.066, -0.083, -0.270, -0.448], abs=0.003)
    assert np.abs(changes(tabled(before, whole, None, gx.P2, steps))).max() < 3e-3


@pytest.mark.parametrize(
    ("shape", "words"),
    [
        pytest.param({"width": 34.0, "flare": 1.0}, "lies outside the bone by", marks=pytest.mark.slow),
        ({"tip": 65.0}, "is beside its shoulder: at least"),
        ({"left": 1.0}, "left, of the femur, is 1.0: True or False"),
        ({"natural": 2}, "natural, of the stem, is 2: True or False"),
        ({"stem_head": 18.0, "head_radius": 19.0}, "is not in that of the femur, of 19 mm: at most 17 mm"),
    ],
)
def test_a_stem_that_cannot_be_in_space(shape, words):
    """One sentence with the value, on all ranks, before a run begins."""
    with pytest.raises(gx.InputError) as caught:
        mesh(**shape)
    (sentence,) = set(COMM.allgather(str(caught.value)))
    assert words in sentence


def test_meshes_without_the_names_and_what_is_no_femur():
    """What a stem needs is said by name."""
    femur = intact().scene
    with pytest.raises(gx.InputError, match="stem"):
        gx.scenes.stem3d(femur, cube(2), 0.8, young=TITANIUM)
    with pytest.raises(gx.InputError, match="the intact femur is"):
        gx.scenes.stem3d(gx.scenes.plate(2), mesh(), 0.8, young=TITANIUM)
    with pytest.raises(gx.InputError, match="its scene is in space"):
        gx.scenes.stem3d(femur, gx.scenes.plate(2).mesh, 0.8, young=TITANIUM)
    with pytest.raises(gx.InputError, match=r"Young's modulus of the stem \(MPa\) is 0"):
        gx.scenes.stem3d(femur, mesh(), 0.8, young=0.0)
    with pytest.raises(gx.InputError, match="of a density that no run has"):
        gx.scenes.stem3d(femur, mesh(), 0.8)
