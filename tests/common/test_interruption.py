"""Runs that are killed, interrupted or terminated, as programs: their status, what they leave, how they go on."""

import csv
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

pytestmark = pytest.mark.serial

BAR = ("bar", "--elements", "40", "--variant", "Q1", "--checkpoint", "4")


def program(*arguments, ranks=1):
    """The command that starts growthx."""
    return [*(["mpirun", "-n", str(ranks)] if ranks > 1 else []), sys.executable, "-m", "growthx", *map(str, arguments)]


def run(*arguments, folder, ranks=1, status=0):
    """Run growthx to its end in a folder."""
    ended = subprocess.run(program(*arguments, ranks=ranks), cwd=folder, capture_output=True, text=True, timeout=300)
    assert ended.returncode == status, ended.stderr
    return ended


def history(folder, costs=False):
    """Rows of the history, with what the steps cost, which is never the same twice, or without."""
    with (folder / "history.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    return (
        rows
        if costs
        else [{name: row[name] for name in row if name not in ("wall_s", "peak_memory_mb")} for row in rows]
    )


def last_state(folder):
    """The arrays of the state in the last planned checkpoint."""
    with np.load(max(folder.glob("checkpoint-*.npz"))) as members:
        return {name: members[name] for name in members.files if name.startswith("state/")}


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    """The folder of a run that nobody disturbed."""
    folder = tmp_path_factory.mktemp("undisturbed")
    run(*BAR, "--out", "out", folder=folder)
    return folder / "out"


def signalled(arguments, folder, number, when, ranks=1):
    """Start growthx, and send it a signal as soon as a condition holds; its status and what it said."""
    return ended_by(program(*arguments, ranks=ranks), folder, number, when)


def ended_by(command, folder, number, when):
    """The same for any command."""
    with (folder / "stderr").open("w") as errors:
        started = subprocess.Popen(command, cwd=folder, stdout=subprocess.DEVNULL, stderr=errors)
        give_up = time.monotonic() + 120
        while not when() and started.poll() is None and time.monotonic() < give_up:
            time.sleep(0.002)
        started.send_signal(number)
        status = started.wait(timeout=120)
    return status, (folder / "stderr").read_text()


def test_a_run_that_is_killed_again_and_again_ends_to_the_bit_as_one_that_was_not(undisturbed, tmp_path):
    """At any moment: each time it is let go on a little further than the time before."""
    out, resumed = tmp_path / "out", []
    while not (out / "density.zip").exists():
        wanted = f"checkpoint-{12 * (len(resumed) + 1):06d}.npz"
        last = ["--resume"] if out.exists() and any(out.glob("checkpoint-*")) else []
        signalled((*BAR, "--out", "out", *last), tmp_path, signal.SIGKILL, (out / wanted).exists)
        resumed.append(wanted)
        assert len(resumed) < 12
    assert len(resumed) > 2
    assert history(out) == history(undisturbed)
    ours, theirs = last_state(out), last_state(undisturbed)
    assert ours.keys() == theirs.keys() and all(np.array_equal(ours[name], theirs[name]) for name in theirs)


@pytest.mark.parametrize("moment", ["np.savez", "os.fsync", "Path.replace"])
def test_a_run_that_is_killed_while_it_writes_leaves_the_checkpoint_before(moment, undisturbed, tmp_path):
    """Half a file under the name of a whole one would be taken for it."""
    owner, name = moment.split(".")
    script = f"""
import os, signal, sys
import numpy as np
from pathlib import Path
from growthx import cli
real, count = {moment}, 0
def killed(*arguments, **members):
    global count
    count += 1
    if count == {5 if moment == "Path.replace" else 4}:  # history.csv, too, is put in its place, once
        if "{moment}" == "np.savez":
            arguments[0].write(b"PK" + bytes(5000))
            arguments[0].flush()
        os.kill(os.getpid(), signal.SIGKILL)
    return real(*arguments, **members)
{owner}.{name} = killed
cli.main(sys.argv[1:])
"""
    command = [sys.executable, "-c", script, *BAR, "--out", "out"]
    assert subprocess.run(command, cwd=tmp_path, capture_output=True, timeout=120).returncode == -signal.SIGKILL
    left = sorted(os.listdir(tmp_path / "out"))
    assert left == [".checkpoint-000012.npz.part", "checkpoint-000004.npz", "checkpoint-000008.npz", "history.csv"]
    assert len(history(tmp_path / "out")) == 12
    run(*BAR, "--out", "out", "--resume", folder=tmp_path)
    assert history(tmp_path / "out") == history(undisturbed)
    assert not [name for name in os.listdir(tmp_path / "out") if name.startswith(".")]


@pytest.mark.parametrize(
    ("number", "ranks"), [(signal.SIGINT, 1), (signal.SIGTERM, 1), (signal.SIGUSR1, 1), (signal.SIGUSR1, 2)]
)
def test_a_signal_ends_a_run_after_its_step_and_saves_the_state(number, ranks, tmp_path, undisturbed):
    """Ctrl-C, and the end of the time that a scheduler has given, of which it tells mpirun by SIGUSR1."""
    out = tmp_path / "out"
    arguments = (*BAR, "--out", "out")
    found, errors = signalled(arguments, tmp_path, number, lambda: any(out.glob("checkpoint-*8.npz")), ranks)
    assert found == 128 + number, errors
    (kept,) = out.glob("interrupted-*.npz")
    assert errors.count("growthx: ") == 1
    assert f"the run was ended by {number.name} at t = " in errors
    assert f"to resume out/{kept.name} goes on from there" in errors
    assert len(history(out)) == int(kept.stem.split("-")[1])
    assert not (out / "fields.pvd").exists()
    resumed = tmp_path / "resumed"
    run("bar", "--elements", 40, "--variant", "Q1", "--out", resumed, "--resume", kept, folder=tmp_path)
    for ours, theirs in zip(history(resumed), history(undisturbed), strict=True):
        for column in ("time", "mass", "min_density", "max_density", "reaction_left_x"):
            assert float(ours[column]) == pytest.approx(float(theirs[column]), rel=1e-9)
    if ranks == 1:
        run(*BAR, "--out", "out", "--resume", folder=tmp_path)
        assert history(out) == history(undisturbed)
        walls = [float(row["wall_s"]) for row in history(out, costs=True)]
        assert walls == sorted(walls) and all(float(row["peak_memory_mb"]) > 10 for row in history(out, costs=True))


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["SIGINT", "SIGTERM"])
def test_mpirun_leaves_no_rank_behind_and_no_part_of_a_file(number, tmp_path, undisturbed):
    """It kills its ranks within a second, wherever they are; whatever they have saved must be whole."""
    out = tmp_path / "out"
    arguments = (*BAR, "--out", "out")
    status, _ = signalled(arguments, tmp_path, number, lambda: any(out.glob("checkpoint-*8.npz")), ranks=2)
    assert status != 0
    run("bar", "--elements", 40, "--variant", "Q1", "--resume", "out", "--out", "resumed", folder=tmp_path)
    for ours, theirs in zip(history(tmp_path / "resumed"), history(undisturbed), strict=True):
        assert float(ours["mass"]) == pytest.approx(float(theirs["mass"]), rel=1e-9)


LONG = """
from dataclasses import replace
from pathlib import Path
import growthx as gx
def main():
    scene = replace(gx.scenes.plate(8), program=gx.Program(step=0.01, until=1000.0, ramp=0.5))
    gx.solve(scene, gx.Q1, refuge="last", watch=lambda result: Path("begun").touch())
raise SystemExit(gx.guarded(main))
"""


@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_run_without_a_folder_saves_its_state_too(number, status, tmp_path):
    """Nothing is lost by Ctrl-C, whoever has not thought of a folder; and nothing is overwritten by the next one."""
    (tmp_path / "last").mkdir()
    (tmp_path / "last" / "mine").touch()
    command = [sys.executable, "-c", LONG]
    found, errors = ended_by(command, tmp_path, number, (tmp_path / "begun").exists)
    assert found == status, errors
    (kept,) = tmp_path.glob("last-2/interrupted-*.npz")
    assert f"to resume last-2/{kept.name} goes on from there" in errors
    assert os.listdir(tmp_path / "last") == ["mine"]


PLATE = """
import sys
import growthx as gx
scene = gx.scenes.plate(8)
options = {"out": sys.argv[3], "checkpoint": 5, "resume": sys.argv[4] if len(sys.argv) > 4 else None}
gx.solve(scene, getattr(gx, sys.argv[1]), tolerance=float(sys.argv[2]), **options)
"""


@pytest.mark.parametrize(("variant", "tolerance"), [("Q1", 1e-13), ("Q1P0", 1e-13), ("S2Q1", 1e-12)])
@pytest.mark.parametrize(("first", "second"), [(1, 2), (2, 1)])
def test_a_run_goes_on_with_another_number_of_ranks(first, second, variant, tolerance, tmp_path):
    """A cluster gives today's job other nodes than yesterday's: each density must find its cell and its point."""

    def solve(ranks, *arguments):
        command = [
            "mpirun",
            "-n",
            str(ranks),
            sys.executable,
            "-c",
            PLATE,
            variant,
            str(tolerance),
            *map(str, arguments),
        ]
        subprocess.run(command, check=True, timeout=120, cwd=tmp_path)

    solve(first, "whole")
    solve(second, "resumed", tmp_path / "whole" / "checkpoint-000020.npz")
    ours, theirs = last_state(tmp_path / "resumed"), last_state(tmp_path / "whole")
    assert ours.keys() == theirs.keys()
    for name, values in theirs.items():
        if "known" not in name and "slope" not in name:
            assert np.abs(ours[name] - values).max() <= 1e-12 * np.abs(values).max(), name


def test_help_names_both_ways(tmp_path):
    """`--resume` alone takes the folder of the run, which must then be named."""
    ended = run("bar", "--resume", folder=tmp_path, status=2)
    assert "--resume names no checkpoint and there is no --out" in ended.stderr
    Path(tmp_path / "out").mkdir()
    ended = run("bar", "--resume", "--out", "out", folder=tmp_path, status=2)
    assert "there is no checkpoint in out" in ended.stderr
