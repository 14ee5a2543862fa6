"""The commands of bone around a stem: what the scripts find, as options, tables and JSON."""

import json

import numpy as np
import pytest

import growthx as gx
from growthx.scenes.stem import scaled

pytestmark = pytest.mark.serial
COARSE = ("--size", "7", "--intact", "40", "--until", "40", "--step", "8")


def test_the_command_finds_what_the_script_finds(in_process, tmp_path):
    """Both are the same runs: sizes, exponents, loads and the stem's material reach either of them."""
    options = (
        "--material",
        "150000",
        "--width",
        "11",
        "--tip",
        "45",
        "--head-radius",
        "12",
        "--m",
        "3.5",
        "--thickness",
        "25",
    )
    status, out, err = in_process(
        "stem",
        *COARSE,
        *options,
        "--thickness",
        "25",
        "--combination",
        "stimulus",
        "--difference",
        "d.png",
        "--picture",
        "p.png",
        "--json",
    )
    found = json.loads(out)
    assert (status, err) == (0, "") and {path.name for path in tmp_path.iterdir()} == {"d.png", "p.png"}
    own = {"thickness": 25.0, "separate": True, "m": 3.5, "step": 8.0, "until": 40.0}
    steps = gx.FixedSteps(equilibrium=1e-3)
    intact = gx.solve(gx.scenes.femur(size=7.0, **own), gx.Q1P0, stepping=steps)
    mesh = gx.scenes.stem_mesh(tip=45.0, width=11.0, head=12.0, size=7.0)
    carried = gx.transfer(intact, mesh, gx.Q1P0, outside=1.2)
    scene = gx.scenes.stem(mesh, carried, young=scaled(150_000.0), head=12.0, **own)
    result = gx.solve(scene, gx.Q1P0)
    zones = gx.shielding(intact, gx.loaded(scene, gx.Q1P0), result)
    assert found["mass"] == pytest.approx(result.problem.mass(), rel=1e-9)
    assert found["intact"]["mass"] == pytest.approx(intact.problem.mass(), rel=1e-9)
    assert found["stem"] == {"young": 150_000.0}
    for name, zone in zones.items():
        assert found["zones"][name] == pytest.approx(zone.density_after, rel=1e-9)
        told = found["shielding"][name]
        assert told["change"] == pytest.approx(zone.change, rel=1e-6)
        for energy in ("energy_intact", "energy_before", "energy_after"):
            assert told[energy] == pytest.approx(getattr(zone, energy), rel=1e-6)


def test_bounds_and_energies_are_those_of_both_runs(in_process):
    """A bound that the intact femur did not have would change its zones at once when the stem is there."""
    options = ("--bounds", "0.9", "1.4", "--energy", "hencky", "--json")
    _, out, _ = in_process("stem", *COARSE, *options)
    before = [zone["density_before"] for zone in json.loads(out)["shielding"].values()]
    assert min(before) > 0.9 - 1e-9 and max(before) < 1.4 + 1e-9


def test_the_check_is_a_command(in_process):
    """A stem as stiff as the bone it replaces, of one piece with head and neck: nearly nothing changes."""
    options = ("--natural", "--material", "bone", "--adaptive", "1e-2", "--size", "5", "--intact", "2000")
    status, out, _ = in_process("stem", *options, "--until", "200")
    assert status == 0 and out.count("Gruen 7") == 1 and "intact femur: grown at" in out
    _, out, _ = in_process("stem", *options, "--until", "200", "--json")
    assert max(abs(zone["change"]) for zone in json.loads(out)["shielding"].values()) < 0.01


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (["--width", "40"], "lies outside the bone at"),
        (["--tip", "90"], "one from 5 to 70 mm would be right"),
        (["--material", "wood"], "--material wood is none: titanium, cobalt-chromium, bone or Young's modulus in MPa"),
        (["--material", "-5"], "Young's modulus of the stem (MPa) is -5: a positive number"),
        (
            ["--natural", "--head-radius", "12"],
            "--head-radius 12 is of a stem, and with --natural the femur keeps its own",
        ),
        (["--ct", "a.nii", "--hu", "0,1"], "bone around a stem begins with that of the intact femur"),
        (["--exponents", "2", "2.5", "1", "1.25"], "--exponents is of bone alone"),
        (["--difference", "d.txt"], "d.txt has the suffix '.txt'"),
        (["--combination", "none"], "there is no load combination 'none'"),
        (["--variant", "P1"], "P1 is a discretisation for triangles"),
        (["--intact", "0"], "the end time is 0"),
        (["--until", "0"], "the end time is 0"),
    ],
)
def test_bad_input_of_a_stem(options, sentence, in_process):
    """One sentence with the value and what would be right, before anything is solved."""
    status, out, err = in_process("stem", *options)
    assert (status, out) == (2, "")
    assert sentence in err
    assert err.startswith("growthx: ") and err.count("\n") == 1


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (["--picture", "p.txt"], "p.txt has the suffix '.txt'"),
        (["--frames", "5"], "but nowhere: a folder to write to is needed"),
        (["--out", "new", "--fields", "moon"], "moon"),
        (["--out", "new", "--every", "0"], "0"),
        (["--checkpoint", "2"], "but nowhere: a folder to write to is needed"),
    ],
)
def test_what_cannot_be_kept_is_refused_before_the_intact_femur_grows(options, sentence, in_process, monkeypatch):
    """Minutes earlier: what is kept and drawn is the second run's, and was looked at when that began."""
    monkeypatch.setattr("growthx.run.solve", lambda *_, **__: pytest.fail("something was solved"))
    status, out, err = in_process("stem", *options)
    assert (status, out) == (2, "")
    assert sentence in err
    assert err.startswith("growthx: ") and err.count("\n") == 1


def test_the_command_in_space(in_process, tmp_path):
    """The table of the script, of two runs to equilibrium, and the picture."""
    options = ("--size", "9", "--adaptive", "2e-2", "--equilibrium", "1e-3", "--weights", "1", "0", "0", "--variant")
    status, out, err = in_process("stem3d", *options, "P1P0", "--tip", "95", "--difference", "d.png", "--json")
    found = json.loads(out)
    assert (status, err) == (0, "") and (tmp_path / "d.png").exists()
    assert found["stem"] == {"young": 110_000.0} and found["intact"]["ended"] == "equilibrium"
    steps = gx.AdaptiveSteps(2e-2, equilibrium=1e-3)
    whole, body = (gx.scenes.stem3d_mesh(size=9.0, tip=95.0, natural=natural) for natural in (True, False))
    femur = gx.scenes.femur3d(whole, weights=(1.0, 0.0, 0.0), until=200.0)
    intact = gx.solve(femur, gx.P1P0, stepping=steps)
    scene = gx.scenes.stem3d(femur, body, gx.transfer(intact, body, gx.P1P0), young=110_000.0)
    zones = gx.shielding(intact, gx.loaded(scene, gx.P1P0), gx.solve(scene, gx.P1P0, stepping=steps))
    for name, zone in zones.items():
        assert found["shielding"][name]["change"] == pytest.approx(zone.change, rel=1e-6)


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (["--material", "wood"], "--material wood is none"),
        (["--exponents", "2", "2.5", "1", "1.25"], "--exponents is of bone alone"),
        (["--ct", "a.nii", "--hu", "0,1"], "bone around a stem begins with that of the intact femur"),
        (["--natural", "--stem-head", "12"], "--stem-head 12 is of a stem, and with --natural the femur keeps its own"),
        (["--weights", "0", "0", "0"], "no activity has a weight"),
        (["--weights", "1", "-1", "0"], "the weight of an activity is -1"),
        (["--body-weight", "0"], "the body weight (N) is 0"),
        (["--combination", "none"], "there is no load combination 'none' in space"),
        (["--material", "-5"], "Young's modulus of the stem (MPa) is -5"),
        (["--difference", "d.txt"], "d.txt has the suffix '.txt'"),
        (["--variant", "P9"], "P9"),
        (["--n", "-1"], "is -1"),
        (["--step", "0"], "is 0"),
        (["--intact", "0"], "the end time is 0"),
        (["--until", "-2"], "the end time is -2"),
        (["--adaptive", "0"], "is 0"),
    ],
)
def test_bad_input_of_a_stem_in_space(options, sentence, in_process, monkeypatch):
    """One sentence before gmsh is asked."""
    monkeypatch.setattr("growthx.meshing.files.read", lambda *_, **__: pytest.fail("a mesh was made"))
    status, out, err = in_process("stem3d", *options)
    assert (status, out) == (2, "")
    assert sentence in err and err.startswith("growthx: ") and err.count("\n") == 1


def test_a_force_off_the_bone_with_the_stem_is_refused_at_once(in_process, monkeypatch):
    """A place that the operation takes away: nobody waits for the intact femur to grow before they hear of it."""
    intact, left = (
        mesh.domain.geometry.x[:, :2] for mesh in (gx.scenes.femur(size=7.0).mesh, gx.scenes.stem_mesh(size=7.0))
    )
    away = np.linalg.norm(intact[:, np.newaxis] - left, axis=2).min(axis=1)
    x, y = intact[np.argmax(away)]
    assert away.max() > 10.0
    monkeypatch.setattr("growthx.run.solve", lambda *_, **__: pytest.fail("something was solved"))
    status, out, err = in_process("stem", *COARSE, "--point-force", x, y, 0.0, -1.0)
    assert status != 0 and out == "" and "away from the body" in err
