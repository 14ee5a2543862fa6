"""Files for ParaView, one state after another: named, whole, and missed on all ranks when one cannot write."""

import xml.etree.ElementTree as ElementTree

import dolfinx
import pytest
from blocks import COMM, square

from growthx.common.errors import OutputError
from growthx.results.series import HIDDEN, Series, aside


@pytest.fixture
def function():
    """A function to write."""
    return dolfinx.fem.Function(dolfinx.fem.functionspace(square(2).domain, ("Lagrange", 1)), name="density")


def test_a_series_names_its_times(function, shared_folder):
    """ParaView opens the .pvd and finds a file for each time, of each rank."""
    series = Series(shared_folder / "series.pvd", COMM)
    for time in (0.5, 1.5):
        series.write([function], time)
    series.close()
    entries = list(ElementTree.parse(shared_folder / "series.pvd").getroot().iter("DataSet"))
    assert {float(entry.get("timestep")) for entry in entries} == {0.5, 1.5}
    assert all((shared_folder / entry.get("file")).is_file() for entry in entries)
    assert len(list(shared_folder.glob("series_p*.vtu"))) == 2 * COMM.size


def test_what_one_rank_cannot_write_is_missed_by_all(function, shared_folder, monkeypatch):
    """The others would else go on with files of which one is not there."""
    series = Series(shared_folder / "series.pvd", COMM)
    if COMM.rank == COMM.size - 1:
        monkeypatch.setattr(series, "_own", set)
    with pytest.raises(OutputError, match=r"\(files are missing\)"):
        series.write([function], 0.5)


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
