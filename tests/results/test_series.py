"""Files for ParaView, one state after another: named, whole, read by VTK, and missed on all ranks when one cannot
write."""

import errno
import os
import xml.etree.ElementTree as ElementTree

import dolfinx
import numpy as np
import pytest
from blocks import COMM, cube, square

from growthx.common.errors import OutputError
from growthx.results.series import HIDDEN, Series, aside
from growthx.results.states import vtu
from growthx.results.states.grid import Grid, State


@pytest.fixture
def space():
    """What the values to write belong to."""
    return dolfinx.fem.functionspace(square(2).domain, ("Lagrange", 1))


def state(grid, value):
    """The same value everywhere."""
    return State({"at_points": np.full(len(grid.points), value)}, {"in_cells": np.full(len(grid.cells), value)})


def listed(file):
    """Times and files of a .pvd."""
    found = ElementTree.parse(file).getroot().iter("DataSet")
    return {float(entry.get("timestep")): file.parent / entry.get("file") for entry in found}


def test_a_series_names_its_times(space, shared_folder):
    """ParaView opens the .pvd and finds a file for each time, of each rank; it does so after each of them."""
    grid = Grid.of_space(space)
    series = Series(shared_folder / "series.pvd", grid, COMM)
    assert series.last is None
    for number, time in enumerate((0.5, 1.5), start=1):
        series.write(state(grid, time), time)
        COMM.barrier()
        found = listed(shared_folder / "series.pvd")
        assert list(found) == [0.5, 1.5][:number] and all(file.is_file() for file in found.values())
        COMM.barrier()
    series.close()
    assert series.last == 1.5
    assert len(list(shared_folder.glob("series_p*.vtu"))) == 2 * COMM.size
    assert not list(shared_folder.glob(".*"))


@pytest.mark.serial
@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("shape", ["triangle", "quadrilateral", "tetrahedron", "hexahedron"])
def test_vtk_reads_the_cells_and_what_is_said_of_them(shape, degree, tmp_path):
    """Points in VTK's order, or cells would be inside out; all digits; the time."""
    pyvista = pytest.importorskip("pyvista")
    mesh = square(3, 0.05, shape=shape) if shape in ("triangle", "quadrilateral") else cube(2, 0.05, shape)
    function = dolfinx.fem.Function(dolfinx.fem.functionspace(mesh.domain, ("Lagrange", degree, (mesh.dim,))))
    function.interpolate(lambda x: x[: mesh.dim] / 3)
    grid = Grid.of_space(function.function_space)
    numbers = np.arange(len(grid.cells)) / 7
    Series(tmp_path / "series.pvd", grid, COMM).write(State({"third": grid.values_of(function)}, {"own": numbers}), 0.1)
    reader = pyvista.get_reader(tmp_path / "series.pvd")
    (found,) = reader.read()
    assert reader.time_values == [0.1]
    assert np.array_equal(found.cell_data["own"], numbers)
    third = np.asarray(found.point_data["third"])
    assert third == pytest.approx(np.asarray(found.points) / 3, rel=1e-15)
    volumes = np.asarray(found.compute_cell_sizes()["Area" if mesh.dim == 2 else "Volume"])
    assert len(volumes) == mesh.cell_count and volumes.min() > 0
    # VTK cuts cells of the second degree into straight pieces, of which those on curved sides miss a bit
    assert volumes.sum() == pytest.approx(1.0, rel=1e-12 if degree == 1 else 1e-3)


def test_what_one_rank_cannot_write_is_missed_by_all(space, shared_folder, monkeypatch):
    """The others would else go on with files of which one is not there; what was there before stays, and may go on."""
    grid = Grid.of_space(space)
    series = Series(shared_folder / "series.pvd", grid, COMM)
    series.write(state(grid, 0.5), 0.5)

    def refuse(file, content, **options):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    before = sorted(file.name for file in shared_folder.iterdir())
    COMM.barrier()
    with monkeypatch.context() as patch:
        if COMM.rank == COMM.size - 1:
            patch.setattr(vtu, "write_whole", refuse)
        with pytest.raises(OutputError, match=r"\(No space left on device\)"):
            series.write(state(grid, 1.0), 1.0)
    COMM.barrier()
    assert sorted(file.name for file in shared_folder.iterdir()) == before
    assert list(listed(shared_folder / "series.pvd")) == [0.5]
    COMM.barrier()
    series.write(state(grid, 1.5), 1.5)
    COMM.barrier()
    assert list(listed(shared_folder / "series.pvd")) == [0.5, 1.5]


def test_a_series_goes_on(space, shared_folder):
    """After the states up to a time; later ones, which are to come once more, also of more ranks, are gone."""
    grid = Grid.of_space(space)
    series = Series(shared_folder / "series.pvd", grid, COMM)
    for time in (0.0, 1.0, 2.0):
        series.write(state(grid, time), time)
    if COMM.rank == 0:
        (shared_folder / "series_p7_000002.vtu").write_text("of a rank that is no more")
        (shared_folder / "series_p0_000003.vtu").write_text("of a state that was being written")
        (shared_folder / ".series_p9_000003.vtu.part").write_text("half")
        (shared_folder / "serious_000003.vtu").write_text("of somebody else")
    COMM.barrier()
    series = Series(shared_folder / "series.pvd", grid, COMM, until=1.0)
    assert series.last == 1.0
    found = listed(shared_folder / "series.pvd")
    assert list(found) == [0.0, 1.0]
    COMM.barrier()
    series.write(state(grid, 1.5), 1.5)
    COMM.barrier()
    assert list(listed(shared_folder / "series.pvd")) == [0.0, 1.0, 1.5]
    assert len(list(shared_folder.glob("series*.vtu"))) == 3 * COMM.size
    assert (shared_folder / "serious_000003.vtu").exists() and not list(shared_folder.glob(".*"))


def test_a_series_that_is_none_is_not_gone_on_with(space, shared_folder):
    """One sentence, on all ranks, and it stays as it is."""
    if COMM.rank == 0:
        (shared_folder / "series.pvd").write_text("<VTKFile><Collection>")
    COMM.barrier()
    with pytest.raises(OutputError, match=r"\(series\.pvd is damaged: "):
        Series(shared_folder / "series.pvd", Grid.of_space(space), COMM, until=1.0)
    assert (shared_folder / "series.pvd").read_text() == "<VTKFile><Collection>"


def test_files_are_whole_or_as_they_were(shared_folder):
    """Also where the content itself fails on the way."""
    if COMM.rank:
        return
    file = shared_folder / "file"
    vtu.write_whole(file, [b"one"])

    def half():
        yield b"half"
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    with pytest.raises(OSError, match="Input/output error"):
        vtu.write_whole(file, half(), over=True)
    with pytest.raises(FileExistsError, match="file is there already"):
        vtu.write_whole(file, [b"two"])
    assert [(each.name, each.read_text()) for each in shared_folder.iterdir()] == [("file", "one")]


def test_files_move_into_place_together(shared_folder):
    """Before, nothing is to be seen; after a failure neither."""
    with aside(shared_folder, COMM) as hidden:
        if COMM.rank == 0:
            (hidden / "history.csv").write_text("time\n")
            assert [file.name for file in shared_folder.iterdir()] == [HIDDEN]
    assert [file.name for file in shared_folder.iterdir()] == ["history.csv"]
    with pytest.raises(OutputError, match=r"history\.csv is there already"), aside(shared_folder, COMM) as hidden:
        if COMM.rank == 0:
            (hidden / "history.csv").write_text("another\n")
    assert [file.name for file in shared_folder.iterdir()] == ["history.csv"]
    assert (shared_folder / "history.csv").read_text() == "time\n"
