"""Fields that were chosen are kept as the usual ones are: at every state, in one file, by a run that goes on."""

import re
from dataclasses import replace

import numpy as np
import pytest
from blocks import COMM, block, square

import growthx as gx
from growthx.post.subcells import around_points

FIELDS = ("strain_energy", "cauchy_stress:points")


def series(file):
    """Times and files of a .pvd."""
    return re.findall(r'timestep="([^"]*)" part="0" file="([^"]*)"', file.read_text())


def test_every_state_has_the_chosen_fields(shared_folder):
    """Bone is watched as it grows by what drives it, too: each state in both series, and nothing else."""
    out = shared_folder / "out"
    gx.solve(block(square(2)), gx.Q1, out=out, every=1, fields=FIELDS)
    COMM.barrier()
    for stem, name in (("fields", "strain_energy_in_cells"), ("points", "cauchy_stress_at_points")):
        found = series(out / f"{stem}.pvd")
        assert [float(time) for time, _ in found] == pytest.approx([0.0, 0.1, 0.2, 0.3, 0.4])
        assert all(f'Name="{name}"' in (out / file).read_text() for _, file in found)
    assert not (out / "raw.pvd").exists()


def test_a_run_that_goes_on_goes_on_with_them(shared_folder):
    """In the same folder, from a checkpoint: each state is there once."""
    out, scene = shared_folder / "out", block(square(2))
    short = replace(scene, program=replace(scene.program, until=0.2))
    gx.solve(short, gx.Q1, out=out, every=1, checkpoint=1, fields=FIELDS)
    other = shared_folder / "other"
    gx.solve(scene, gx.Q1, out=other, every=1, resume=out, fields=FIELDS)
    COMM.barrier()
    assert [float(time) for time, _ in series(other / "points.pvd")][-2:] == pytest.approx([0.3, 0.4])


@pytest.mark.parametrize("other", [None, ("strain_energy:cells",)], ids=str)
def test_a_run_that_goes_on_with_other_fields_is_refused(other, shared_folder):
    """Half of the series would have the ones, half the others; and it goes on with those that it has."""
    out, scene = shared_folder / "out", block(square(2))
    short = replace(scene, program=replace(scene.program, until=0.2))
    gx.solve(short, gx.Q1, out=out, every=1, checkpoint=1, fields=FIELDS)
    for name in ("density.zip", "history.csv"):
        if COMM.rank == 0:
            (out / name).unlink(missing_ok=True)
    COMM.barrier()
    with pytest.raises(gx.InputError, match=r"keeps the states of its fields in fields, points of .* would be right"):
        gx.solve(scene, gx.Q1, out=out, every=1, checkpoint=1, resume=out, fields=other)
    gx.solve(scene, gx.Q1, out=out, every=1, checkpoint=1, resume=out, fields=FIELDS)
    COMM.barrier()
    assert [float(time) for time, _ in series(out / "points.pvd")] == pytest.approx([0.0, 0.1, 0.2, 0.3, 0.4])


@pytest.mark.serial
def test_one_file_has_tensors_too(tmp_path):
    """In HDF5 as in XML: nine entries of each tensor, the numbers that scripts get."""
    h5py = pytest.importorskip("h5py")
    problem = gx.solve(block(square(2)), gx.Q1, out=tmp_path / "out", every=2, vtkhdf=True, fields=FIELDS).problem
    owners = around_points("quadrilateral", problem.variant.integration_points("quadrilateral")).points
    stress = gx.results.point_fields(problem, ("cauchy_stress",))["cauchy_stress"][:, owners].reshape(-1, 9)
    with h5py.File(tmp_path / "out" / "points.vtkhdf") as file:
        values = np.asarray(file["VTKHDF/CellData/cauchy_stress_at_points"])
        assert np.abs(values).max() > 0
        assert values.reshape(-1, 9)[-len(stress) :] == pytest.approx(stress, rel=1e-12)
