"""The command line as users and their scripts meet it: started as a program, hence not inside MPI ranks."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from growthx import cli

pytestmark = pytest.mark.serial
MESHES = Path(__file__).parent.parent / "meshes"


def growthx(*arguments, folder, ranks=1):
    """Run `growthx` in a folder, as its own process."""
    command = [sys.executable, "-m", "growthx", *map(str, arguments)]
    if ranks > 1:
        command = ["mpirun", "-n", str(ranks), *command]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300)


def answer(*arguments, folder, status=0, ranks=1):
    """The JSON object of a run that ends with `status`."""
    run = growthx(*arguments, "--json", folder=folder, ranks=ranks)
    assert run.returncode == status, run.stderr
    assert run.stdout.count("\n") == 1
    return json.loads(run.stdout)


COMMON = {
    "schema": int,
    "versions": dict,
    "scene": str,
    "variant": str,
    "cells": int,
    "dofs": int,
    "points": int,
    "time": float,
    "steps": int,
    "newton_iterations": int,
    "converged": bool,
    "min_density": float,
    "max_density": float,
    "mass": float,
    "setup_s": float,
    "compile_s": float,
    "solve_s": float,
}


@pytest.mark.parametrize(
    ("arguments", "own"),
    [
        (["bar", "--elements", "10", "--variant", "q1q1"], {"midpoint_density_change", "end_displacement"}),
        (["femur", "--size", "8", "--until", "8", "--variant", "Q1"], {"zones", "bone"}),
        (["plate", "--n", "4"], {"tip_displacement"}),
    ],
)
def test_json_has_one_object_with_scalars(arguments, own, tmp_path):
    """Scripts read these keys: they and their types are a promise."""
    found = answer(*arguments, folder=tmp_path)
    assert set(found) == set(COMMON) | own
    assert {name: type(found[name]) for name in COMMON} == COMMON
    assert found["converged"] is True
    assert os.listdir(tmp_path) == []  # nothing is written that nobody asked for


def test_counts_of_the_paper(tmp_path):
    """The paper's mesh of 658 cells has its unknowns; two splits have its finer meshes' cells."""
    mesh = MESHES / "femur_658.msh"
    for variant, dofs in (("Q1Q1", 2175), ("Q1P0", 1450), ("Q1", 1450)):
        found = answer("femur", "--mesh", mesh, "--variant", variant, "--until", 4, folder=tmp_path)
        assert (found["cells"], found["dofs"], found["points"]) == (658, dofs, 4 * 658)
    assert answer("femur", "--mesh", mesh, "--refine", 2, "--until", 4, folder=tmp_path)["cells"] == 2632


def test_two_ranks_give_the_same_object(tmp_path):
    """Numbers are global: a parallel run prints one object, with the serial numbers."""
    alone = answer("femur", "--size", 6, "--until", 20, folder=tmp_path)
    both = answer("femur", "--size", 6, "--until", 20, folder=tmp_path, ranks=2)
    for name in ("cells", "dofs", "points", "steps", "newton_iterations"):
        assert both[name] == alone[name]
    for name in ("min_density", "max_density", "mass", "bone"):
        assert both[name] == pytest.approx(alone[name], rel=1e-8)
    assert both["zones"] == pytest.approx(alone["zones"], rel=1e-8)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["bar", "--variant", "Q7"], "there is no variant 'Q7': one of Q1Q1, Q1P0, Q1 would be right"),
        (["bar", "--dt", "0"], "the time step Δt is 0: a positive number would be right"),
        (["bar", "--dt", "nan"], "the time step Δt is nan: a positive number would be right"),
        (["bar", "--m", "-1"], "the exponent m is -1: a number of at least 0 would be right"),
        (["bar", "--elements", "x"], "argument --elements: invalid int value: 'x'"),
        (["bar", "--elements", "15"], "the discontinuous bar has 15 elements: a multiple of 10"),
        (["bar", "--problem", "other"], "there is no bar problem 'other': one of discontinuous, continuous"),
        (["femur", "--thickness", "-3"], "the thickness (mm) is -3: a positive number would be right"),
        (["femur", "--loads", "all"], "there is no load combination 'all': one of average, superposed"),
        (["femur", "--mesh", "no.msh"], "there is no file no.msh"),
        (["femur", "--mesh", MESHES / "bar.geo"], "the mesh has no boundary named 'distal'; it has 'left', 'right'"),
        (["femur", "--mesh", "no.msh", "--size", "2"], "--size 2 is for the built-in outline"),
        (["plate", "--n", "0"], "the number of cells over the plate's height is 0: a whole number from 1"),
        (["tibia"], "invalid choice: 'tibia'"),
        ([], "the following arguments are required: SCENE"),
    ],
)
def test_bad_input_is_one_sentence(arguments, sentence, tmp_path):
    """A user's mistake is answered with the value and what would be right, status 2, and no traceback."""
    run = growthx(*arguments, folder=tmp_path)
    assert run.returncode == 2
    assert sentence in run.stderr
    assert run.stderr.startswith("growthx: ") and run.stderr.count("\n") == 1
    assert run.stdout == ""


def test_bad_input_in_parallel_is_said_once(tmp_path):
    """All ranks end, one of them speaks."""
    run = growthx("bar", "--dt", "-1", folder=tmp_path, ranks=2)
    assert run.returncode == 2
    assert run.stderr.count("the time step Δt is -1") == 1


def test_results_go_to_a_new_folder_only(tmp_path):
    """What a user has is never overwritten, and the files say what the tables say."""
    out = tmp_path / "out"
    assert growthx("plate", "--n", 4, "--out", out, folder=tmp_path).returncode == 0
    kept = {path.name: path.read_bytes() for path in out.iterdir()}
    assert {"history.csv", "fields.pvd"} <= set(kept)
    again = growthx("plate", "--n", 4, "--out", out, folder=tmp_path)
    assert again.returncode == 2
    assert f"the folder {out} is not empty" in again.stderr
    assert {path.name: path.read_bytes() for path in out.iterdir()} == kept


def test_a_run_that_ends_early_says_so(tmp_path):
    """Ill-posed growth (m = 0, Remark 6.1) resorbs cells: status 3, a reason, the last good state on disk."""
    found = answer("femur", "--size", 6, "--m", 0, "--dt", 8, folder=tmp_path, status=3)
    assert found["converged"] is False
    assert 100 < found["time"] < 160
    assert re.search(r"ended at t = 1\d\d\.?\d* of 160: .* at \(.*\), and a time step cut from 8 to", found["reason"])
    assert {"history.csv", "fields.pvd"} <= set(os.listdir(tmp_path / "growthx-last-state"))


def test_help_teaches(tmp_path):
    """Every option is explained with its default, and the exit status is told."""
    for command in (cli.BAR, cli.FEMUR, cli.PLATE):
        run = growthx(command.name, "--help", folder=tmp_path)
        assert run.returncode == 0
        assert "Exit status" in run.stdout
        options = re.findall(r"^  (--\w+)(?: \w+)?(.*)", run.stdout, re.MULTILINE)
        assert len(options) >= 4
