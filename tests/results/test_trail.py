"""What a run leaves on its way: states in a series and a history, whole whenever it is killed, continued when it goes
on."""

import csv
import errno
import os
import signal
import subprocess
import sys
import time
import xml.etree.ElementTree as ElementTree
from dataclasses import replace

import numpy as np
import pytest
from blocks import COMM, block, cube, square

import growthx as gx
from growthx.discretisation.variants import CATALOGUE
from growthx.results import history
from growthx.results.states import vtu

PROGRAM = gx.Program(step=0.1, until=0.9, ramp=0.3)
VARIANTS = pytest.mark.parametrize("variant", CATALOGUE.values(), ids=CATALOGUE)


def times(folder, name="fields"):
    """The times of a series, all of whose files are there and whole."""
    found = list(ElementTree.parse(folder / f"{name}.pvd").getroot().iter("DataSet"))
    for entry in found:
        joint = ElementTree.parse(folder / entry.get("file")).getroot()
        pieces = [piece.get("Source") for piece in joint.iter("Piece")]
        assert pieces
        for piece in pieces:
            assert (folder / piece).read_bytes().endswith(b"</AppendedData>\n</VTKFile>\n")
    return [float(entry.get("timestep")) for entry in found]


def rows(folder):
    """The rows of the history."""
    with (folder / "history.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def frame(folder, number, name, series="fields"):
    """An array of a state, of all ranks' cells, in the order of the files."""
    pyvista = pytest.importorskip("pyvista")
    grid = pyvista.read(folder / f"{series}{number:06d}.pvtu")
    return np.asarray(grid.cell_data[name] if name in grid.cell_data else grid.point_data[name])


@VARIANTS
def test_every_variant_leaves_a_series(variant, shared_folder):
    """The start, what was asked for and the end; in the plane and in space, where a part of the body rests, too."""
    scene = block(square(3, 0.05, shape=variant.cells[0]), growing=("bone",), program=PROGRAM)
    result = gx.solve(scene, variant, out=shared_folder / "plane", every=4)
    ends = [step.time for step in result.steps]
    COMM.barrier()
    for name in ("fields", "raw"):
        assert times(shared_folder / "plane", name) == [0.0, ends[3], ends[7], 0.9]
    space = block(cube(2, 0.05, shape=variant.cells[1]), program=gx.Program(step=0.1, until=0.2))
    gx.solve(space, variant, out=shared_folder / "space", frames=2)
    COMM.barrier()
    for name in ("fields", "raw"):
        assert times(shared_folder / "space", name) == [0.0, 0.1, 0.2]


@pytest.mark.serial
def test_each_state_is_that_of_its_time(tmp_path):
    """Not the last one over and over, nor the one before."""
    seen = []

    def watch(result):
        seen.append(result.problem.mass())

    gx.solve(block(), gx.Q1P0, out=tmp_path / "out", every=1, watch=watch)
    for number, mass in enumerate([1.2, *seen]):
        density = frame(tmp_path / "out", number, "density")
        assert density.mean() == pytest.approx(mass, rel=1e-12)
        assert frame(tmp_path / "out", number, "density", "raw") == pytest.approx(density, rel=1e-14)
    assert seen[0] != pytest.approx(seen[-1], rel=1e-3)


def test_a_series_ends_with_the_last_good_state(shared_folder):
    """Of a run that ends early, too, whether that one was due or not."""
    scene = block(supports=(gx.Support("left"), gx.Support("right", (-1.5, 0.0))), loads=())
    scene = replace(scene, program=gx.Program(step=0.1, until=1.0, ramp=1.0))
    with pytest.raises(gx.RunEndedEarly) as ended:
        gx.solve(scene, gx.Q1P0, out=shared_folder / "out", every=1000)
    COMM.barrier()
    assert times(shared_folder / "out") == [0.0, ended.value.result.time]
    assert (shared_folder / "out" / "density.zip").exists()


def test_a_state_that_finds_no_room_is_missed_with_a_warning(shared_folder, monkeypatch, caplog):
    """The run may still come to its end, when there is room again."""
    write = vtu.write_whole

    def write_whole(file, content, **options):
        if file.name == "raw_p0_000001.vtu" and not full:
            full.append(file)
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        write(file, content, **options)

    full = []
    monkeypatch.setattr(vtu, "write_whole", write_whole)
    result = gx.solve(block(program=PROGRAM), gx.Q1, out=shared_folder / "out", every=3)
    COMM.barrier()
    ends = [step.time for step in result.steps]
    assert times(shared_folder / "out") == [0.0, ends[2], ends[5], 0.9]
    assert times(shared_folder / "out", "raw") == [0.0, ends[5], 0.9]
    assert sum("No space left on device" in text for text in caplog.messages) == (COMM.rank == 0)


# -- history.csv -------------------------------------------------------------------------------------------------------


def test_a_step_is_in_the_history_when_it_is_done(shared_folder):
    """Whoever kills the run, or looks on while it goes, finds it there, with what it cost."""

    def watch(result):
        COMM.barrier()
        found = rows(shared_folder / "out")
        assert len(found) == len(result.steps) and float(found[-1]["time"]) == result.time
        COMM.barrier()

    result = gx.solve(block(), gx.Q1P0, out=shared_folder / "out", watch=watch)
    found = rows(shared_folder / "out")
    assert [float(row["mass"]) for row in found] == [step.mass for step in result.steps]
    walls = [float(row["wall_s"]) for row in found]
    assert walls[0] > 0 and walls == sorted(walls)
    assert walls[-1] >= 0.99 * result.solve_s
    assert all(20 * COMM.size < float(row["peak_memory_mb"]) < 100_000 for row in found)
    assert [cost.wall_s for cost in result.costs] == pytest.approx(walls, abs=6e-4)


def test_a_history_without_room_ends_no_run(shared_folder, monkeypatch, caplog):
    """It is said once, and what was missed is there as soon as there is room."""
    write, refused = history.write_whole, []

    def write_whole(file, content, **options):
        if len(refused) < 2:
            refused.append(file)
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        write(file, content, **options)

    monkeypatch.setattr(history, "write_whole", write_whole)
    result = gx.solve(block(), gx.Q1P0, out=shared_folder / "out")
    COMM.barrier()
    assert len(rows(shared_folder / "out")) == len(result.steps) == 4
    assert sum("history.csv cannot be written (No space" in text for text in caplog.messages) == (COMM.rank == 0)


def test_a_folder_that_was_moved_is_made_anew_with_the_whole_history(shared_folder):
    """Somebody tidies up while the run goes on: none of its steps is missing."""

    def watch(result):
        if len(result.steps) == 2 and COMM.rank == 0:
            (shared_folder / "out").rename(shared_folder / "away")
        COMM.barrier()

    result = gx.solve(block(), gx.Q1P0, out=shared_folder / "out", watch=watch)
    COMM.barrier()
    assert len(rows(shared_folder / "away")) == 2
    assert len(rows(shared_folder / "out")) == len(result.steps)


# -- killed and resumed ------------------------------------------------------------------------------------------------


PLATE = """
import sys
from dataclasses import replace
import growthx as gx
scene = gx.scenes.plate(8)
scene = replace(scene, program=replace(scene.program, until=float(sys.argv[2])))
variant, resume = getattr(gx, sys.argv[1]), sys.argv[3] if len(sys.argv) > 3 else None
gx.solve(scene, variant, out="out", checkpoint=5, every=2, resume=resume)
"""


def program(ranks, *arguments):
    """The command that solves the plate; ranks die with mpirun."""
    launcher = ["mpirun", "-n", str(ranks), "setpriv", "--pdeathsig", "KILL"] if ranks > 1 else []
    return [*launcher, sys.executable, "-c", PLATE, *map(str, arguments)]


def killed(command, folder, when):
    """Start a program and kill it, by SIGKILL and with all its ranks, as soon as a condition holds."""
    with (folder / "stderr").open("w") as errors:
        started = subprocess.Popen(command, cwd=folder, stderr=errors, start_new_session=True)
        give_up = time.monotonic() + 120
        while not when() and started.poll() is None and time.monotonic() < give_up:
            time.sleep(0.001)
        assert started.poll() is None, (folder / "stderr").read_text()
        os.killpg(started.pid, signal.SIGKILL)
        started.wait(timeout=60)


@pytest.mark.serial
@pytest.mark.parametrize(("variant", "first", "second"), [("Q1P0", 1, 1), ("Q1", 2, 1), ("Q1Q1", 1, 2)])
def test_a_killed_run_is_readable_and_goes_on(variant, first, second, tmp_path):
    """At any moment; no state is lost or there twice, whatever the number of ranks that go on."""
    out = tmp_path / "out"
    killed(program(first, variant, 2.5), tmp_path, (out / f"fields_p{first - 1}_000004.vtu").exists)
    assert not (out / "density.zip").exists()
    left = times(out)
    assert left[:4] == pytest.approx([0.0, 0.2, 0.4, 0.6])
    assert set(times(out, "raw")) >= set(left[:-1])
    steps = [float(row["time"]) for row in rows(out)]
    assert steps[0] == pytest.approx(0.1) and steps[-1] >= left[-1]
    subprocess.run(program(second, variant, 2.5, "out"), cwd=tmp_path, check=True, timeout=120)
    expected = [0.0, *(0.2 * np.arange(1, 13)), 2.5]
    for name in ("fields", "raw"):
        assert times(out, name) == pytest.approx(expected)
        assert len(list(out.glob(f"{name}*.pvtu"))) == len(expected)
    assert [float(row["time"]) for row in rows(out)] == pytest.approx(0.1 * np.arange(1, 26))
    walls = [float(row["wall_s"]) for row in rows(out)]
    assert walls == sorted(walls)
    assert not list(out.glob(".*"))


@pytest.mark.serial
def test_a_resumed_series_is_that_of_an_undisturbed_run(tmp_path):
    """To the bit, state by state."""
    for name in ("whole", "cut"):
        (tmp_path / name).mkdir()
    subprocess.run(program(1, "Q1P0", 2.5), cwd=tmp_path / "whole", check=True, timeout=120)
    out = tmp_path / "cut" / "out"
    killed(program(1, "Q1P0", 2.5), tmp_path / "cut", (out / "fields_p0_000008.vtu").exists)
    subprocess.run(program(1, "Q1P0", 2.5, "out"), cwd=tmp_path / "cut", check=True, timeout=120)
    for file in sorted((tmp_path / "whole" / "out").iterdir()):
        if file.suffix in (".pvd", ".pvtu", ".vtu"):
            assert (out / file.name).read_bytes() == file.read_bytes(), file.name


def test_a_run_resumed_elsewhere_begins_a_series_there(shared_folder):
    """The states before are in the folder of the run before."""
    scene = block(program=PROGRAM)
    gx.solve(scene, gx.Q1P0, out=shared_folder / "first", checkpoint=4)
    COMM.barrier()
    kept = shared_folder / "first" / "checkpoint-000004.npz"
    result = gx.solve(scene, gx.Q1P0, out=shared_folder / "second", every=3, resume=kept)
    COMM.barrier()
    ends = [step.time for step in result.steps]
    assert times(shared_folder / "second") == [ends[3], ends[5], 0.9]
    found, before = rows(shared_folder / "second"), rows(shared_folder / "first")
    assert len(found) == 9 and found[:4] == before[:4]


def test_a_finished_run_is_not_gone_on_with_in_its_folder(shared_folder):
    """Its results stay: another folder would be right."""
    scene = block(program=PROGRAM)
    gx.solve(scene, gx.Q1P0, out=shared_folder / "out", checkpoint=4, every=3)
    COMM.barrier()
    before = {file.name: file.read_bytes() for file in (shared_folder / "out").iterdir()}
    COMM.barrier()
    with pytest.raises(gx.InputError, match=r"has ended, .*: to go on to a later end, a new folder, with this one to"):
        gx.solve(scene, gx.Q1P0, out=shared_folder / "out", resume=shared_folder / "out", every=3)
    assert {file.name: file.read_bytes() for file in (shared_folder / "out").iterdir()} == before
