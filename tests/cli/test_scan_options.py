"""A scan on the command line: every scene begins with it, and tells how far it has gone from it."""

import json

import numpy as np
import pytest
from blocks import COMM

from growthx.cli import main

nibabel = pytest.importorskip("nibabel", reason="nibabel, which is optional, is not installed")

SHORT = {"bar": ["--elements", "10"], "plate": ["--elements", "4"], "femur": ["--size", "9", "--until", "8"]}


@pytest.fixture
def scan(shared_folder):
    """HU of 800 to 1000 over the plane x, z at y = −3, wide enough for every scene."""
    x = np.linspace(-300.0, 300.0, 25)
    values = np.broadcast_to((900 + x / 3)[:, np.newaxis, np.newaxis], (25, 3, 25)).astype(np.int16)
    affine = np.diag([25.0, 25.0, 25.0, 1.0])
    affine[:3, 3] = -300.0, -25.0, -300.0
    if COMM.rank == 0:
        nibabel.save(nibabel.Nifti1Image(values, affine), shared_folder / "scan.nii.gz")
    COMM.barrier()
    return shared_folder / "scan.nii.gz"


@pytest.mark.parametrize("scene", SHORT)
def test_every_scene_begins_with_a_scan(scene, scan, capfd):
    """The numbers of the comparison are with those of the run."""
    place = ["--ct", str(scan), "--hu=-0.1,0.001", "--ct-slice", "coronal", "-3", "--ct-by", "mean"]
    assert main([scene, *SHORT[scene], *place, "--json"]) == 0
    out = capfd.readouterr().out
    if COMM.rank == 0:
        found = json.loads(out)["ct"]
        assert len(found["zones"]) == (10 if scene == "femur" else 0)
        assert found["other"] == pytest.approx(0.8, abs=0.02) and found["bias"] == found["mean"] - found["other"]


def test_the_table_for_people(scan, capfd):
    """One line says how the two differ."""
    assert main(["plate", "--elements", "4", "--ct", str(scan), "--hu", "0.1,0.001", "--ct-slice", "axial", "0"]) == 0
    out = capfd.readouterr().out
    if COMM.rank == 0:
        assert "compared with the scan: Pearson's r" in out and "RMSE" in out


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--hu", "0.1,0.001"], "--hu is of a scan, and there is none"),
        (["--ct-slice", "axial", "0"], "--ct-slice is of a scan"),
        (["--ct", "SCAN"], "--hu A,B"),
        (["--ct", "SCAN", "--hu", "0.1"], "'0.1' is no calibration"),
        (["--ct", "SCAN", "--hu", "0.1,0.001"], "the place of its slice"),
        (["--ct", "SCAN", "--hu", "0.1,0.001", "--ct-slice", "axial", "x"], "--ct-slice axial x is at no number"),
        (["--ct", "SCAN", "--hu", "0.1,0.001", "--ct-slice", "oblique", "0"], "'oblique'"),
        (["--ct", "SCAN", "--hu", "0.1,0.001", "--ct-slice", "axial", "900"], "lie outside the voxel centres"),
        (["--ct", "SCAN", "--hu", "0,1", "--ct-slice", "axial", "0"], "above 5"),
        (["--ct", "SCAN", "--hu", "0.1,0.001", "--ct-frame", "up"], "'up'"),
        (["--ct", "none.nii", "--hu", "0.1,0.001"], "none.nii"),
    ],
)
def test_bad_options_are_one_sentence(options, words, scan, capfd):
    """Before anything is solved, with status 2."""
    assert main(["plate", "--elements", "4", *[str(scan) if word == "SCAN" else word for word in options]]) == 2
    err = capfd.readouterr().err
    if COMM.rank == 0:
        assert words in err and err.count("\n") == 1
