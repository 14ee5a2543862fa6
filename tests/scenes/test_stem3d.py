"""Bone around a stem in space: that the geometry is what it says and bears what the femur bears."""

from functools import cache

import numpy as np
import pytest
from blocks import COMM, cube

import growthx as gx
from growthx.meshing.sampling import positions
from growthx.scenes.femur3d import loaded_areas
from growthx.scenes.stem import TITANIUM
from growthx.scenes.stem3d import CUT

SIZE = 9.0
STEPPING = gx.AdaptiveSteps(2e-2, equilibrium=1e-3)


@cache
def mesh(**shape):
    """The femur with a stem, coarse."""
    return gx.scenes.stem3d_mesh(size=SIZE, **shape)


@cache
def intact():
    """A run of the intact femur, walking."""
    return gx.solve(gx.scenes.femur3d(size=SIZE, cut=CUT, weights=(1.0, 0.0, 0.0)), gx.P1P0, stepping=STEPPING)


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


@pytest.mark.parametrize(
    ("shape", "words"),
    [
        pytest.param({"width": 34.0, "flare": 1.0}, "lies outside the bone by", marks=pytest.mark.slow),
        ({"tip": 65.0}, "is beside its shoulder: at least"),
        ({"left": 1.0}, "left, of the femur, is 1.0: True or False"),
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
        gx.scenes.stem3d(femur, femur.mesh, 0.8, young=TITANIUM)
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
