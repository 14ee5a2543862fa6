"""All states in one file, as VTK's own reader has them; whole whenever it is read."""

import errno
import itertools
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from blocks import COMM, block, cube, square

import growthx as gx
from growthx.common.errors import InputError, OutputError
from growthx.discretisation.variants import CATALOGUE
from growthx.results.series import Keeping, open_series
from growthx.results.states import vtkhdf
from growthx.results.states.grid import Grid, State

h5py = pytest.importorskip("h5py")
VARIANTS = pytest.mark.parametrize("variant", CATALOGUE.values(), ids=CATALOGUE)


def read(file):
    """The times of a file, and a function that reads the state of one of them, both by VTK."""
    pyvista = pytest.importorskip("pyvista")
    from vtkmodules.vtkIOHDF import vtkHDFReader

    reader = vtkHDFReader()
    assert reader.CanReadFile(str(file))
    reader.SetFileName(str(file))
    reader.UpdateInformation()
    information = reader.GetOutputInformation(0)
    key = type(reader).GetExecutive(reader).TIME_STEPS()
    times = [information.Get(key, i) for i in range(information.Length(key))]

    def at(time):
        reader.UpdateTimeStep(time)
        return pyvista.wrap(reader.GetOutput()).copy()

    return times, at


@pytest.mark.serial
@VARIANTS
def test_vtk_reads_what_the_many_files_have(variant, tmp_path):
    """Every time, point, cell and number of them, in the plane and in space, where a part of the body rests, too."""
    pyvista = pytest.importorskip("pyvista")
    short = gx.Program(step=0.1, until=0.2)
    for name, scene in (
        ("plane", block(square(3, 0.05, shape=variant.cells[0]), growing=("bone",))),
        ("space", block(cube(1, 0.05, shape=variant.cells[1]), program=short)),
    ):
        for kind in (False, True):
            gx.solve(scene, variant, out=tmp_path / f"{name} {kind}", every=2, vtkhdf=kind)
        for series in ("fields", "raw"):
            reader = pyvista.get_reader(tmp_path / f"{name} False" / f"{series}.pvd")
            times, at = read(tmp_path / f"{name} True" / f"{series}.vtkhdf")
            assert times == reader.time_values
            for moment in times:
                reader.set_active_time_value(moment)
                (many,), one = reader.read(), at(moment)
                assert np.array_equal(one.points, many.points) and np.array_equal(one.cells, many.cells)
                assert np.array_equal(one.celltypes, many.celltypes)
                for found, expected in ((one.point_data, many.point_data), (one.cell_data, many.cell_data)):
                    assert set(found) == set(expected)
                    assert all(np.array_equal(found[array], expected[array]) for array in expected)
        left = {file.name for file in (tmp_path / f"{name} True").iterdir()}
        assert left == {"fields.vtkhdf", "raw.vtkhdf", "history.csv", "density.zip"}


def test_a_file_has_its_cells_once(shared_folder):
    """A hundred states must not have a hundred meshes; the parts of all ranks are in it."""
    gx.solve(block(), gx.Q1P0, out=shared_folder / "out", every=1, vtkhdf=True)
    COMM.barrier()
    with h5py.File(shared_folder / "out" / "fields.vtkhdf") as file:
        root = file["VTKHDF"]
        assert root["NumberOfCells"][:].sum() == 9 and len(root["NumberOfCells"]) == COMM.size
        assert len(root["Points"]) == root["NumberOfPoints"][:].sum()
        assert root["Steps"].attrs["NSteps"] == 5 and root["CellData/density"].shape == (45,)
    COMM.barrier()


@pytest.fixture
def grid():
    """Of four cells."""
    import dolfinx

    return Grid.of_space(dolfinx.fem.functionspace(square(2).domain, ("Lagrange", 1)))


def state(grid, value):
    return State({"p": np.full(len(grid.points), value)}, {"c": np.full((len(grid.cells), 3), value)})


def values(folder):
    """Times, and what all cells say at each."""
    with h5py.File(folder / "s.vtkhdf") as file:
        steps, cells = file["VTKHDF/Steps"], file["VTKHDF/CellData/c"][:, 0]
        offsets = [*steps["CellDataOffsets/c"], len(cells)]
        found = [set(cells[a:b].tolist()) for a, b in itertools.pairwise(offsets)]
        return steps["Values"][:].tolist(), found


def test_it_goes_on(grid, shared_folder):
    """After the states up to a time; and each state is in it as soon as it is written."""
    open_one = lambda until=None: open_series(shared_folder / "s.pvd", grid, COMM, Keeping(until, True))  # noqa: E731
    series = open_one()
    assert series.last is None
    for moment in (0.0, 1.0, 2.0, 3.0):
        series.write(state(grid, moment), moment)
        COMM.barrier()
        assert values(shared_folder)[0][-1] == moment
        COMM.barrier()
    del series  # not closed: killed
    series = open_one(1.5)
    assert series.last == 1.0
    for moment in (2.5, 4.0):
        series.write(state(grid, moment), moment)
    series.close()
    COMM.barrier()
    assert values(shared_folder) == ([0.0, 1.0, 2.5, 4.0], [{0.0}, {1.0}, {2.5}, {4.0}])
    assert [file.name for file in shared_folder.iterdir()] == ["s.vtkhdf"]
    COMM.barrier()
    with pytest.raises(OutputError, match=r"s\.vtkhdf is there already"):
        open_one()


@pytest.mark.parametrize("links", [True, False])
def test_what_finds_no_room_leaves_the_file_as_it_was(grid, shared_folder, monkeypatch, links):
    """And it goes on when there is room; also on a disk that knows no second names."""
    if not links:

        def refuse(*arguments):
            raise OSError(errno.EPERM, os.strerror(errno.EPERM))

        monkeypatch.setattr("pathlib.Path.hardlink_to", refuse)
    series = open_series(shared_folder / "s.pvd", grid, COMM, Keeping(vtkhdf=True))
    series.write(state(grid, 1.0), 1.0)
    append = vtkhdf.append

    def full(path, *arguments):
        append(path, *arguments)
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    COMM.barrier()
    with monkeypatch.context() as patch:
        patch.setattr(vtkhdf, "append", full)
        with pytest.raises(OutputError, match=r"\(No space left on device\)"):
            series.write(state(grid, 2.0), 2.0)
    assert series.last == 1.0 and values(shared_folder)[0] == [1.0]
    COMM.barrier()
    for moment in (3.0, 4.0, 5.0):
        series.write(state(grid, moment), moment)
    series.close()
    COMM.barrier()
    assert values(shared_folder) == ([1.0, 3.0, 4.0, 5.0], [{1.0}, {3.0}, {4.0}, {5.0}])


def test_a_reader_is_not_disturbed(grid, shared_folder):
    """Who looks on has the file open for as long as they like, and sees it as it was when they opened it."""
    series = open_series(shared_folder / "s.pvd", grid, COMM, Keeping(vtkhdf=True))
    series.write(state(grid, 1.0), 1.0)
    COMM.barrier()
    with h5py.File(shared_folder / "s.vtkhdf", "r") as file:
        for moment in (2.0, 3.0, 4.0):
            COMM.barrier()
            series.write(state(grid, moment), moment)
            assert file["VTKHDF/Steps/Values"][:].tolist() == [1.0]
    COMM.barrier()
    assert values(shared_folder) == ([1.0, 2.0, 3.0, 4.0], [{1.0}, {2.0}, {3.0}, {4.0}])
    COMM.barrier()
    series.close()


PLATE = """
import sys
import growthx as gx
resume = sys.argv[1] if len(sys.argv) > 1 else None
gx.solve(gx.scenes.plate(8), gx.Q1P0, out="out", checkpoint=5, every=2, vtkhdf=True, resume=resume)
"""


@pytest.mark.serial
@pytest.mark.parametrize("moment", range(3))
def test_a_killed_run_leaves_a_file_that_vtk_reads_and_that_goes_on(moment, tmp_path):
    """Whenever it is killed, also while it writes."""
    command, out = [sys.executable, "-c", PLATE], tmp_path / "out"
    with subprocess.Popen(command, cwd=tmp_path) as started:
        give_up = time.monotonic() + 120
        while not (out / "checkpoint-000010.npz").exists() and time.monotonic() < give_up:
            time.sleep(0.001)
        time.sleep(0.01 * moment)
        assert started.poll() is None
        started.send_signal(signal.SIGKILL)
    times, at = read(out / "fields.vtkhdf")
    assert len(times) >= 6 and times[:6] == pytest.approx(0.2 * np.arange(6))
    assert at(times[-1]).cell_data["density"].min() > 0
    subprocess.run([*command, "out"], cwd=tmp_path, check=True, timeout=120)
    for name in ("fields", "raw"):
        times, at = read(out / f"{name}.vtkhdf")
        assert times == pytest.approx([*(0.2 * np.arange(13)), 2.5])
        means = [at(time).cell_data["density"].mean() for time in times]
        assert len(set(means)) == len(times) and means == sorted(means, reverse=True)
    assert not list(out.glob(".*"))


def test_one_kind_of_files_is_not_gone_on_with_by_the_other(shared_folder):
    """Each would have a part of the states."""
    scene = block(program=gx.Program(step=0.1, until=0.9, ramp=0.3))

    def fail(result):
        if len(result.steps) == 4:
            raise RuntimeError("as if killed")

    for kind, ending in ((True, "vtkhdf"), (False, "pvd")):
        out = shared_folder / ending
        with pytest.raises(RuntimeError):
            gx.solve(scene, gx.Q1P0, out=out, checkpoint=2, every=2, vtkhdf=kind, watch=fail)
        COMM.barrier()
        with pytest.raises(
            InputError, match=rf"keeps its states in \S*\.{ending}, and .*vtkhdf is asked for: the same"
        ):
            gx.solve(scene, gx.Q1P0, out=out, checkpoint=2, every=2, vtkhdf=not kind, resume=out)


def test_without_h5py_it_is_refused_before_the_run(monkeypatch, shared_folder):
    """One sentence; nothing else of growthx needs it."""
    monkeypatch.setattr(vtkhdf, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"need h5py, which is not installed: it, or files without vtkhdf, would be "):
        gx.solve(block(), gx.Q1P0, out=shared_folder / "out", vtkhdf=True)
    with pytest.raises(InputError, match="but nowhere"):
        monkeypatch.undo()
        gx.solve(block(), gx.Q1P0, vtkhdf=True)
