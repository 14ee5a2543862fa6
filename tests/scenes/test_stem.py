"""Bone around a stem: what is observed of patients, in direction, and the check that a stem of bone is none."""

import importlib.util
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from blocks import COMM, block, gathered, square

import growthx as gx
from growthx.meshing.sampling import positions
from growthx.scenes.anatomy import HEAD_CENTRE, HEAD_RADIUS, along_outline
from growthx.scenes.stem import COBALT_CHROMIUM, TITANIUM, corners, gruen, scaled

STEPPING = gx.AdaptiveSteps(1e-2, equilibrium=1e-3)


@cache
def intact_femur():
    """The run of the femur without a stem."""
    return gx.solve(gx.scenes.femur(until=1000.0), gx.Q1P0, stepping=STEPPING)


@cache
def stem():
    """The mesh with the stem, and the density of the intact femur in it."""
    mesh = gx.scenes.stem_mesh()
    return mesh, gx.transfer(intact_femur(), mesh, gx.Q1P0, outside=1.2)


def changes(scene):
    """Relative change of the mean density of each zone, and the run."""
    start = gx.discretise(scene, gx.Q1P0)
    result = gx.solve(scene, gx.Q1P0, stepping=STEPPING)
    before, after = (gx.zones.area_means(problem, scene.zones) for problem in (start, result.problem))
    return np.array([after[name] / before[name] - 1 for name in before]), result


@cache
def lost(young):
    """The changes around a metal."""
    mesh, carried = stem()
    return changes(gx.scenes.stem(mesh, carried, young=scaled(young), until=600.0))


def test_the_calcar_loses_most_and_distal_zones_little():
    """Gruen zone 7 is what densitometry finds: −23 % after two years, and about nothing at the diaphysis."""
    found, result = lost(TITANIUM)
    assert result.converged and np.argmin(found) == 6 and -0.35 < found[6] < -0.15
    assert found[2:5].min() > -0.05  # beside and below the tip
    assert found[[0, 1, 5]].max() < -0.1


def test_a_stiffer_stem_loses_more():
    """Stress shielding grows with stiffness: in each proximal zone, and most in the seventh."""
    soft, stiff = lost(TITANIUM)[0], lost(COBALT_CHROMIUM)[0]
    proximal = [0, 1, 5, 6]
    assert (stiff[proximal] < soft[proximal]).all() and np.argmin(stiff) == 6 and stiff[6] < soft[6] - 0.1


def test_a_stem_of_bone_is_none():
    """On one mesh, with its own head: bone in equilibrium stays where a stem is as stiff as what it replaced.

    The bound is what equilibrium leaves to do; metal in the same mesh does far more.
    """
    mesh = gx.scenes.stem_mesh(natural=True)
    ends = along_outline(45, 52, 3)
    scene = gx.scenes.femur(
        mesh, head=(*HEAD_CENTRE, HEAD_RADIUS), trochanter=(tuple(ends[0]), tuple(ends[-1])), until=2000.0
    )
    intact = gx.solve(scene, gx.Q1P0, stepping=STEPPING)
    density = gx.transfer(intact, mesh, gx.Q1P0)
    own, _ = changes(gx.scenes.stem(mesh, density, head_radius=HEAD_RADIUS, until=600.0))
    metal, _ = changes(gx.scenes.stem(mesh, density, head_radius=HEAD_RADIUS, young=scaled(TITANIUM), until=600.0))
    assert np.abs(own).max() < 0.01 and np.abs(metal).max() > 10 * np.abs(own).max()


def strain_energy(problem):
    """Of each owned cell."""
    return gx.results.cell_fields(problem, ("strain_energy",))["strain_energy"]


def test_energy_of_the_zones():
    """Ψ₀ of cells is that of the stimulus, whatever rests beside them; a calcar that is shielded has less."""
    _, result = lost(TITANIUM)
    problem = result.problem
    energies = strain_energy(problem)
    bone = problem.growing_cells
    rho = problem.densities_of_cells()[bone, 0]
    stimulus = gx.results.cell_fields(problem)["stimulus"][bone]
    assert energies[bone] == pytest.approx(stimulus * (rho / 1.2) ** 3, rel=3e-3)
    zones = gx.zones.area_means(problem, result.scene.zones, values=energies)
    stiff = lost(COBALT_CHROMIUM)[1].problem
    assert gx.zones.area_means(stiff, result.scene.zones, values=strain_energy(stiff))["Gruen 7"] < zones["Gruen 7"]


def test_energies_before_and_after_the_operation():
    """Beside the density that they drive: of the same bone while intact, at once with a stem, and at the end.

    A stem of bone leaves them as they were; metal takes energy from the calcar at once, and bone about it follows.
    """
    intact, mesh, carried = intact_femur(), *stem()
    scene = gx.scenes.stem(mesh, carried, young=scaled(TITANIUM), until=600.0)
    start = gx.loaded(scene, gx.Q1P0)
    assert start.densities_of_cells() == pytest.approx(gx.discretise(scene, gx.Q1P0).densities_of_cells(), rel=1e-9)
    found = gx.shielding(intact, start, lost(TITANIUM)[1])
    changed = {name: zone.change for name, zone in found.items()}
    assert list(changed.values()) == pytest.approx(lost(TITANIUM)[0], rel=1e-6)
    calcar, tip = found["Gruen 7"], found["Gruen 4"]
    assert calcar.energy_before < 0.5 * calcar.energy_intact and calcar.energy_after < 0.5 * calcar.energy_intact
    assert tip.energy_before == pytest.approx(tip.energy_intact, rel=0.1)
    own = intact.problem  # its energies in the same polygon, which holds bone that is taken out, too
    whole = gx.zones.area_means(own, {"tip": scene.zones["Gruen 4"]}, values=strain_energy(own))["tip"]
    assert tip.energy_intact == pytest.approx(whole, rel=0.03)
    assert [len(zone.row(name)) for name, zone in found.items()] == 7 * [len(calcar.HEADER)]


def test_energies_of_two_meshes_or_another_body_are_refused():
    """A table of what became of the bone is of one mesh with the stem, in the body that was intact."""
    _, result = lost(TITANIUM)
    with pytest.raises(gx.InputError, match="are on two meshes"):
        gx.shielding(result, intact_femur(), result)
    small = gx.loaded(gx.scenes.plate(2), gx.Q1P0)
    with pytest.raises(gx.InputError, match="lie outside the body of the run"):
        gx.shielding(small, result, result)


def test_zones_are_those_of_bone_alone():
    """Seven zones, each of bone, none with the stem, and lateral ones lateral of it."""
    mesh, carried = stem()
    scene = gx.scenes.stem(mesh, carried, young=1000.0)
    assert list(scene.zones) == [f"Gruen {number}" for number in range(1, 8)] and len(gruen()) == 7
    problem = gx.discretise(scene, gx.Q1P0)
    middle = positions(mesh, np.array([[0.5, 0.5]]))[:, 0]
    x, y = (gx.zones.area_means(problem, scene.zones, values=middle[:, axis]) for axis in (0, 1))
    for lateral, medial in ((1, 7), (2, 6), (3, 5)):
        assert x[f"Gruen {lateral}"] < x["Gruen 4"] < x[f"Gruen {medial}"]
        assert abs(y[f"Gruen {lateral}"] - y[f"Gruen {medial}"]) < 20.0 and y["Gruen 4"] < y["Gruen 3"]


def test_the_script_has_the_corners_that_are_looked_at():
    """What is checked before meshing is what is meshed; and its outline is that of the femur."""
    mesh = gx.scenes.stem_mesh(tip=45.0, width=11.0)
    ends = gathered(mesh.domain.geometry.x[:, :2])
    for corner in corners(45.0, 11.0):
        assert np.linalg.norm(ends - corner, axis=1).min() < 1e-9
    points = [
        {line for line in gx.meshing.locate(name).read_text().splitlines() if line.startswith("Point(") and "{" in line}
        for name in ("femur.geo", "femur_stem.geo")
    ]
    assert len(points[0]) == 63 and points[0] <= points[1]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"width": 40.0}, "lies outside the bone at"),
        ({"width": 33.0}, "mm from the bone's surface"),
        ({"tip": 0.5}, "lies 0.5 mm from"),
        ({"tip": 90.0}, "one from 5 to 70 mm"),
        ({"tip": -3.0}, "the height of the stem's tip"),
        ({"head": 30.0}, "a number from 10 to 18"),
        ({"size": 0.0}, "the cell size"),
    ],
)
def test_a_stem_that_cannot_be(options, words):
    """One sentence, with the place, before anything is meshed, on all ranks."""
    with pytest.raises(gx.InputError) as caught:
        gx.scenes.stem_mesh(**options)
    (sentence,) = set(COMM.allgather(str(caught.value)))
    assert words in sentence


def test_bone_for_a_stem_needs_a_run():
    """A stiffness of what was there is of a density that was there; and a mesh without a stem has none."""
    mesh, _ = stem()
    with pytest.raises(gx.InputError, match="of a density that no run has"):
        gx.scenes.stem(mesh, 1.2)
    with pytest.raises(gx.InputError, match=r"the mesh with the stem is 'stem\.msh': a growthx\.Mesh would be right"):
        gx.scenes.stem("stem.msh", 1.2, young=1.0)
    with pytest.raises(gx.InputError, match="no load case of the femur has a weight"):
        gx.scenes.stem(mesh, 1.2, young=1.0, weights=(0.0, 0.0, 0.0))
    with pytest.raises(gx.InputError, match=r"is 800 somewhere, where the reference density is 1\.2: one in the same"):
        gx.discretise(gx.scenes.stem(mesh, 800.0, young=1.0), gx.Q1P0)  # HU
    with pytest.raises(gx.InputError, match="stem"):
        gx.scenes.stem(
            gx.meshing.read(gx.meshing.locate("femur.geo"), size=9.0), 1.2, young=1.0, head_radius=HEAD_RADIUS
        )


def test_values_of_cells_for_zones():
    """Means of any field, over a region if asked for; what is no field of cells is refused on all ranks."""
    problem = gx.discretise(block(square(4)), gx.Q1P0)
    whole = {"all": np.array([[-1, -1], [2, -1], [2, 2], [-1, 2]])}
    x = positions(problem.scene.mesh, np.array([[0.5, 0.5]]))[:, 0, 0]
    assert gx.zones.area_means(problem, whole, values=x)["all"] == pytest.approx(0.5)
    assert gx.zones.area_means(problem, whole, "bone", values=x)["all"] == pytest.approx(0.25)
    for wrong in (x[:-1], "density", np.zeros((3, 3, 3))):
        with pytest.raises(gx.InputError, match="one number for each of the"):
            gx.zones.area_means(problem, whole, values=wrong)


@pytest.mark.serial
def test_the_demo(tmp_path, monkeypatch, capsys):
    """Its table and its pictures are there."""
    monkeypatch.chdir(tmp_path)
    path = Path(__file__).parents[2] / "demos" / "stem.py"
    spec = importlib.util.spec_from_file_location("demo_stem", path)
    demo = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(demo)
    demo.main()
    assert capsys.readouterr().out.count("Gruen 7") == 2
    assert {file.name for file in (tmp_path / "results" / "stem").iterdir()} == {"titanium.png", "cobalt-chromium.png"}
