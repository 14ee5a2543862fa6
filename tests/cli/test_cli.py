"""The command line as users and their scripts meet it: started as a program, hence not inside MPI ranks."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from growthx.cli.bar import BAR
from growthx.cli.femur import FEMUR
from growthx.cli.plate import PLATE
from growthx.discretisation.variants import CATALOGUE
from growthx.meshing.formats import gmsh as gmsh_files

pytestmark = pytest.mark.serial
MESHES = Path(__file__).parents[2] / "meshes"


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
    "factorisations": int,
    "linear_solver": str,
    "converged": bool,
    "ended": str,
    "min_density": float,
    "max_density": float,
    "mass": float,
    "mass_defect": float,
    "force_defect": float,
    "moment_defect": float,
    "lumped_cells": int,
    "round_off": float,
    "setup_s": float,
    "compile_s": float,
    "solve_s": float,
}


@pytest.mark.parametrize(
    ("arguments", "own"),
    [
        (
            ["bar", "--elements", "10", "--variant", "q1q1"],
            {"midpoint_density_change", "midpoint_axis_density_change", "end_displacement"},
        ),
        (
            ["femur", "--size", "8", "--until", "8", "--variant", "Q1"],
            {"zones", "bone", "head", "insertion", "lean", "loads"},
        ),
        (
            ["femur3d", "--size", "9", "--until", "2", "--weights", "1", "0", "0"],
            {"zones", "bone", "head", "loads", "at_bounds"}
            | {"side", "crossing", "neck_shaft_angle", "version", "body_weight"},
        ),
        (["plate", "--elements", "4", "--shape", "triangle"], {"tip_displacement"}),
    ],
)
def test_json_has_one_object_with_scalars(arguments, own, tmp_path):
    """Scripts read these keys: they and their types are a promise."""
    found = answer(*arguments, folder=tmp_path)
    assert set(found) == set(COMMON) | own
    assert {name: type(found[name]) for name in COMMON} == COMMON
    assert found["converged"] is True
    assert os.listdir(tmp_path) == []  # nothing is written that nobody asked for


@pytest.mark.parametrize("variant", ["Q1P0", "Q1sri", "Q1", "Q1Q1"])
def test_remark_6_1_between_bounds(variant, found):
    """With m = 0 (n = 2) and bounds the femur becomes the field of zeros and ones that Fig. 12 is to show."""
    ended = found("femur", "--m", "0", "--bounds", "0.12", "2.4", "--until", "800", "--variant", variant)
    low, high = ended["at_bounds"]
    assert (ended["min_density"], ended["max_density"]) == pytest.approx((0.12, 2.4), rel=1e-9)
    assert 0.68 < low < 0.8
    assert 0.15 < high < 0.28


@pytest.mark.parametrize(("bounds", "shares"), [(("none", "1.1"), (0, 1)), (("0.9", "none"), (1, 0))])
def test_bounds_of_any_scene(bounds, shares, found):
    """Of one side, too: the loaded end of the bar grows, and stops there; the plate's corners are resorbed to there."""
    name = ("bar", "--elements", "10") if shares[1] else ("plate", "--elements", "4")
    ended = found(*name, "--bounds", *bounds)
    assert [share > 0 for share in ended["at_bounds"]] == [bool(share) for share in shares]


@pytest.fixture
def found(in_process):
    """The JSON object of a run in this process."""

    def run(*arguments):
        status, out, err = in_process(*arguments, "--json")
        assert status == 0, err
        return json.loads(out)

    return run


# Nodes of 10 elements in a row: 22 corners, 63 of quadratic elements, 53 of serendipity; triangles have as many.
@pytest.mark.parametrize(
    ("name", "dofs", "points"),
    [
        ("Q1Q1", 3 * 22, 40),
        ("Q2Q2", 3 * 63, 90),
        ("S2Q1", 2 * 53 + 22, 40),
        ("Q1P0", 2 * 22, 40),
        ("Q1", 2 * 22, 40),
        ("Q2", 2 * 63, 90),
        ("Q1sri", 2 * 22, 40),
        ("S2fri", 2 * 53, 40),
        ("P1P1", 3 * 22, 60),
        ("P2P2", 3 * 63, 120),
        ("P2P1", 2 * 63 + 22, 60),
        ("P1P0", 2 * 22, 20),
        ("P1", 2 * 22, 20),
        ("P2", 2 * 63, 60),
    ],
)
def test_every_variant_runs_by_its_name(name, dofs, points, found):
    """On the bar of the paper's table 1, with its unknowns; points are those at which the stress is evaluated."""
    cells = "quadrilateral" if name[0] in "QS" else "triangle"
    bar = found("bar", "--elements", 10, "--shape", cells, "--variant", name.lower())
    assert (bar["variant"], bar["dofs"], bar["points"]) == (name, dofs, points)
    assert bar["cells"] == (10 if cells == "quadrilateral" else 20)
    assert bar["converged"] is True and bar["end_displacement"] == pytest.approx(2.37, abs=0.005)


def test_the_bar_is_read_at_the_edge_and_on_the_axis(found, in_process):
    """Both readings of the paper's Q2Q2, in the object and in the table: they differ in the third digit."""
    arguments = ("bar", "--kind", "continuous", "--elements", 10, "--variant", "Q2Q2")
    bar = found(*arguments)
    assert bar["midpoint_density_change"] == pytest.approx(0.528429, abs=1e-6)
    assert bar["midpoint_axis_density_change"] == pytest.approx(0.527441, abs=1e-6)
    _, out, _ = in_process(*arguments)
    assert re.search(r"midpoint density change +│ 0\.528429", out)
    assert re.search(r"midpoint axis density change +│ 0\.527441", out)


def test_the_default_variant_follows_the_cells(found):
    """Q1P0 or P1P0, on each scene: nobody who asks for triangles should have to know a second word for it."""
    for arguments in (["bar", "--elements", 10], ["plate", "--elements", 2], ["femur", "--size", 9, "--until", 4]):
        assert found(*arguments)["variant"] == "Q1P0"
        halved = found(*arguments, "--shape", "triangle")
        assert halved["variant"] == "P1P0" and halved["points"] == halved["cells"]


def test_counts_of_the_paper(found):
    """The femur's own mesh, and the same given as a file, has its 658 cells; a split has its finer mesh's."""
    assert found("femur", "--until", 4)["cells"] == 658
    femur = found("femur", "--mesh", MESHES / "femur_658.msh", "--variant", "Q1Q1", "--until", 4)
    assert (femur["cells"], femur["dofs"], femur["points"]) == (658, 2175, 4 * 658)
    assert found("femur", "--refine", 2, "--until", 4)["cells"] == 2632


def test_the_picture_of_a_femur_is_of_what_is_asked_for(in_process, tmp_path, monkeypatch):
    """Density in its unit, or the relative change as in the paper: the values are drawn, and the colour bar says so."""
    from growthx.post import plots

    seen, draw = [], plots._draw

    def watched(panels, title, reference, *rest):
        (body, _), *_ = panels.values()
        seen.append(((title, reference), body.values))
        draw(panels, title, reference, *rest)

    monkeypatch.setattr(plots, "_draw", watched)
    arguments = ("femur", "--size", 9, "--until", 8)
    for options in ((), ("--relative",)):
        status, out, err = in_process(*arguments, "--picture", "femur.png", *options)
        assert status == 0, err
        assert out.count("the picture is femur.png") == 1
        assert (tmp_path / "femur.png").stat().st_size > 10_000
        (tmp_path / "femur.png").unlink()
    (density, rho), (change, relative) = seen
    assert density == ("density (g/cm³)", None)
    assert change == ("[ρ − ρ*]/ρ*", ("density (g/cm³)", 1.2))
    assert relative == pytest.approx(rho / 1.2 - 1, abs=1e-12) and relative.max() - relative.min() > 0.01
    status, out, _ = in_process("plate", "--elements", 2, "--picture", "plate.png", "--json")
    assert json.loads(out)["converged"] and (tmp_path / "plate.png").is_file()


@pytest.mark.parametrize("options", [(), ("--vtkhdf",)], ids=["pvd", "vtkhdf"])
def test_a_run_leaves_its_states_and_a_movie_of_them(options, in_process, tmp_path):
    """As many as were asked for, by the run itself or by a word of its own afterwards; the folder stays as it is."""
    run = ("plate", "--elements", 2, "--out", "out", "--frames", 5, "--times", "0.1,0.2", "--movie", "m.gif")
    status, out, err = in_process(*run, *options)
    assert status == 0, err
    assert out.count("the movie is m.gif") == 1
    before = sorted(os.listdir(tmp_path / "out"))
    assert len([name for name in before if name.endswith((".pvtu", ".vtkhdf"))]) == (2 if options else 16)
    status, out, err = in_process("movie", "out", "--field", "stimulus", "--per-second", 20, "--title", "Ψ")
    assert (status, out) == (0, "the movie is out.gif\n"), err
    assert sorted(os.listdir(tmp_path / "out")) == before
    image = pytest.importorskip("PIL.Image")
    for name in ("m.gif", "out.gif"):
        with image.open(tmp_path / name) as found:
            assert found.n_frames == 8


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("femur", "--relative"), "--relative is of a picture, and none is asked for: with --picture FILE would be"),
        (("femur", "--picture", "a.vtu"), "the picture a.vtu has the suffix '.vtu': one of .png"),
        (("femur", "--picture", "none/a.png"), "the picture none/a.png is to be in the folder none, which is not th"),
        (("bar", "--relative"), "--relative is of a picture, and none is asked for: with --picture FILE would be"),
    ],
)
def test_pictures_that_cannot_be_drawn_are_refused_before_the_run(arguments, sentence, in_process, monkeypatch):
    """A word too much, or a name that no picture can have, is said at once, not after the run."""
    monkeypatch.setattr("growthx.run.solve", lambda *arguments, **options: pytest.fail("the run has begun"))
    status, out, err = in_process(*arguments)
    assert (status, out, err.count("\n")) == (2, "", 1) and sentence in err


@pytest.fixture
def own_femur(tmp_path):
    """Writes the built-in mesh with x and y multiplied by factors; the file's path."""

    def write(x, y, name="own.msh"):
        with gmsh_files._gmsh_session(tmp_path) as gmsh:
            gmsh.open(str(MESHES / "femur_658.msh"))
            gmsh.model.mesh.affineTransform([x, 0, 0, 0, 0, y, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1])
            gmsh.write(str(tmp_path / name))
        return tmp_path / name

    return write


def test_a_femur_of_ones_own(own_femur, found, in_process):
    """Forces at its own head, no table of zones that are not its own, and the sentences that say so."""
    mesh = own_femur(1.05, 1.05)
    for head in ((), ("--head", 1.05 * 43, 1.05 * 132, 1.05 * 24)):
        told = found("femur", "--mesh", mesh, *head, "--until", 4)
        assert told["zones"] == {} and "--zones" in told["no_zones"]
        assert [told["head"][name] for name in ("x", "y", "radius")] == pytest.approx([45.15, 138.6, 25.2], rel=1e-3)
        assert [load["length"] for load in told["loads"][::2]] == pytest.approx([30.8] * 3, rel=0.01)
    status, out, _ = in_process("femur", "--mesh", mesh, "--until", 4)
    assert status == 0 and "calcar" not in out
    assert re.search(
        r"head: a circle of radius 25.2\d* mm about \(45.1\d*, 138.\d\), fitted to 2\d\d° of 'surface'", out
    )
    assert "zones: none are told, since the outline is not growthx's own" in out
    assert len(re.findall(r"joint │ +\d+\.\d │ surface │ +30\.[78] │", out)) == 3


def test_zones_of_ones_own(own_femur, found, tmp_path):
    """Polygons in mm of the user's own femur."""
    (tmp_path / "zones.csv").write_text("zone,x_mm,y_mm\nshaft,-9,20\nshaft,9,20\nshaft,0,60\n")
    told = found("femur", "--mesh", own_femur(1.05, 1.05), "--zones", "zones.csv", "--until", 4)
    assert set(told["zones"]) == {"shaft"} and 1.1 < told["zones"]["shaft"] < 1.2 and "no_zones" not in told


def test_left_and_right_femora(own_femur, found):
    """The mirror image of the built-in mesh has its densities, and its zones."""
    left, right = (found("femur", "--mesh", own_femur(x, 1, f"{x}.msh"), "--until", 4) for x in (1, -1))
    assert [told["head"]["medial"] for told in (left, right)] == [1, -1]
    assert right["mass"] == pytest.approx(left["mass"], rel=1e-12)
    assert right["zones"] == pytest.approx(left["zones"], rel=1e-12) and len(right["zones"]) == 10


def test_a_femur_in_space(in_process):
    """Zones that the landmarks of the mesh lay, and where each force acts."""
    status, out, _ = in_process("femur3d", "--size", "9", "--left", "--until", "2", "--weights", "1", "0", "0")
    assert status == 0 and "a left femur if y points anteriorly; head of radius 24 mm about (0, 0, 0)" in out
    for name in ("medial cortex", "lateral cortex", "canal", "strut, head to calcar", "Ward's triangle", "whole bone"):
        assert name in out
    assert re.search(r"walking +│ +joint │ +1813 │ +head │ +\d+ │", out)
    assert re.search(r"walking +│ +gluteus minimus │ +239 │ +trochanter │", out)


def test_femora_that_cannot_be_meant(own_femur, in_process):
    """One sentence each, before anything is solved."""
    for arguments, sentence in (
        (("--mesh", own_femur(1e-3, 1e-3, "m.msh")), "extends over 0.156, as if in metres: coordinates in mm would be"),
        (
            ("--mesh", own_femur(1, -1, "down.msh")),
            "leans by 180° from the y axis: a mesh whose y axis points",
        ),
        (
            ("--mesh", own_femur(1, 1), "--head", 0, 132, 24),
            "the joint force of midstance of gait would act on 0",
        ),
        (("--head", 0, 132, 24), "the head is (0.0, 132.0, 24.0), for a mesh that is not given"),
        (("--zones", "none.csv"), "the zones none.csv cannot be read (No such file or directory): a CSV file would be"),
    ):
        status, out, err = in_process("femur", *arguments)
        assert (status, out, err.count("\n")) == (2, "", 1) and sentence in err


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
        (["bar", "--variant", "Q7"], f"there is no variant 'Q7': one of {', '.join(CATALOGUE)} would be right"),
        (
            ["bar", "--shape", "triangle", "--variant", "Q1"],
            "Q1 is a discretisation for quadrilaterals and hexahedra, and the mesh has triangles: P1P1, P2P2, P2P1, P",
        ),
        (
            ["plate", "--elements", "2", "--variant", "P1"],
            "P1 is a discretisation for triangles and tetrahedra, and the mesh ",
        ),
        (
            ["bar", "--shape", "squares"],
            "there are no cells 'squares' in the plane: quadrilateral or triangle would be",
        ),
        (
            ["femur", "--shape", "tetrahedron"],
            "there are no cells 'tetrahedron' in the plane: quadrilateral or triangle",
        ),
        (["plate", "--shape", "hexahedron"], "there are no cells 'hexahedron' in the plane: quadrilateral or triangle"),
        (["bar", "--step", "0"], "the time step Δt is 0: a positive number would be right"),
        (["bar", "--step", "nan"], "the time step Δt is nan: a positive number would be right"),
        (["femur", "--bounds", "0.1", "high"], "'high' is no density: a number or 'none' would be right"),
        (["plate", "--bounds", "2", "1"], "the bounds of density are (2.0, 1.0): the lowest before the highest"),
        (["bar", "--m", "-1"], "the exponent m is -1: a number of at least 0 would be right"),
        (["bar", "--elements", "x"], "argument --elements: invalid int value: 'x'"),
        (["bar", "--elements", "15"], "the discontinuous bar has 15 elements: a multiple of 10"),
        (["bar", "--kind", "other"], "there is no bar problem 'other': one of discontinuous, continuous"),
        (["femur", "--thickness", "-3"], "the thickness (mm) is -3: a positive number would be right"),
        (["femur", "--combination", "all"], "there is no load combination 'all': one of average, superposed"),
        (["femur", "--mesh", "no.msh"], "there is no file no.msh"),
        (["femur", "--mesh", MESHES / "bar.geo"], "the mesh has no boundary named 'distal'; it has 'left', 'right'"),
        (["femur", "--mesh", "no.msh", "--size", "2"], "--size 2.0 is for the built-in outline: with --mesh, "),
        (
            ["femur", "--mesh", "no.msh", "--shape", "triangle"],
            "--shape triangle is for the built-in outline: with --mesh",
        ),
        (["plate", "--every", "2"], "states are to be kept by every = 2, but nowhere: a folder to write to is needed"),
        (
            ["plate", "--out", "o", "--every", "0"],
            "every, the number of steps from one kept state to the next, is 0: a",
        ),
        (
            ["plate", "--out", "o", "--every", "2", "--frames", "3"],
            "after every 2 steps and as 3 frames evenly spread:",
        ),
        (
            ["plate", "--out", "o", "--times", "1,3"],
            "a time at which a state is to be kept is 3: one from 0 to the end",
        ),
        (["plate", "--out", "o", "--times", "1;2"], "'1;2' are no times: numbers with commas between them would be"),
        (
            ["plate", "--out", "o", "--frames", "99"],
            "99 frames are to be kept of a run of 25 steps of fixed length: at",
        ),
        (
            ["plate", "--movie", "m.gif"],
            "the movie m.gif is of states in a folder: with --out FOLDER it would be right",
        ),
        (["plate", "--movie", "m.gif", "--out", "o"], "the movie m.gif is of several states: --frames N, such as 50,"),
        (["plate", "--movie", "m.avi", "--out", "o", "--every", "1"], "m.avi has the suffix '.avi': one of .gif, .mp4"),
        (["movie", "nowhere"], "there are no states of a run in nowhere: the folder of one with --out and --frames N"),
        (["femur3d", "--body-weight", "0"], "the body weight (N) is 0: one from 150 to 5000, 9.81 N for a kilogram"),
        (
            ["femur3d", "--combination", "superposed"],
            "there is no load combination 'superposed' in space: one of stimulus",
        ),
        (
            ["femur3d", "--mesh", MESHES / "femur_658.msh"],
            "cells of the shape quadrilateral, and its scene is in",
        ),
        (["plate", "--elements", "0"], "the number of cells over the plate's height is 0: a whole number from 1"),
        (["tibia"], "invalid choice: 'tibia'"),
        ([], "the following arguments are required: COMMAND"),
    ],
)
def test_bad_input_is_one_sentence(arguments, sentence, in_process):
    """A user's mistake is answered with the value and what would be right, status 2, and no traceback."""
    status, out, err = in_process(*arguments)
    assert (status, out) == (2, "")
    assert sentence in err
    assert err.startswith("growthx: ") and err.count("\n") == 1


def test_bad_input_ends_the_program(tmp_path):
    """Its status and its sentence must reach the shell."""
    run = growthx("bar", "--shape", "triangle", "--variant", "Q1sri", folder=tmp_path)
    assert (run.returncode, run.stdout) == (2, "")
    assert (
        run.stderr.startswith("growthx: Q1sri is a discretisation for quadrilaterals") and run.stderr.count("\n") == 1
    )


def test_bad_input_in_parallel_is_said_once(tmp_path):
    """All ranks end, one of them speaks."""
    run = growthx("bar", "--step", "-1", folder=tmp_path, ranks=2)
    assert run.returncode == 2
    assert run.stderr.count("the time step Δt is -1") == 1


def test_results_go_to_a_new_folder_only(tmp_path):
    """What a user has is never overwritten, and the files say what the tables say."""
    out = tmp_path / "out"
    assert growthx("plate", "--elements", 4, "--out", out, folder=tmp_path).returncode == 0
    kept = {path.name: path.read_bytes() for path in out.iterdir()}
    assert {"history.csv", "fields.pvd"} <= set(kept)
    again = growthx("plate", "--elements", 4, "--out", out, folder=tmp_path)
    assert again.returncode == 2
    assert f"the folder {out} is not empty" in again.stderr
    assert {path.name: path.read_bytes() for path in out.iterdir()} == kept


def test_a_run_that_ends_early_says_so(tmp_path):
    """Ill-posed growth (m = 0, Remark 6.1) resorbs cells: status 3, a reason, the last good state on disk."""
    found = answer("femur", "--size", 6, "--m", 0, "--step", 8, folder=tmp_path, status=3)
    assert found["converged"] is False
    assert 100 < found["time"] < 160
    assert re.search(r"ended at t = 1\d\d\.?\d* of 160: .* at \(.*\), and a time step cut from 8 to", found["reason"])
    assert {"history.csv", "fields.pvd"} <= set(os.listdir(tmp_path / "growthx-last-state"))


def test_help_teaches(tmp_path):
    """Every option is explained with its default, and the exit status is told."""
    for command in (BAR, FEMUR, PLATE):
        run = growthx(command.name, "--help", folder=tmp_path)
        assert run.returncode == 0
        assert "Exit status" in run.stdout
        options = re.findall(r"^  (--\w+)(?: \w+)?(.*)", run.stdout, re.MULTILINE)
        assert len(options) >= 4


def test_steps_from_error_are_for_the_command_line_too(tmp_path):
    """Fewer steps, the same bone; an end at equilibrium; a scheme by name."""
    small = ("plate", "--elements", "4", "--variant", "Q1")
    fixed, adaptive, second, ended = (
        answer(*small, *options, folder=tmp_path)
        for options in ((), ("--adaptive", "1e-3"), ("--scheme", "tr-bdf2"), ("--equilibrium", "0.9"))
    )
    assert adaptive["steps"] < fixed["steps"] / 2
    assert adaptive["mass"] == pytest.approx(second["mass"], rel=1e-3)
    assert second["steps"] == fixed["steps"]
    assert ended["time"] < fixed["time"] == 2.5
    full = answer(*small, "--full-newton", folder=tmp_path)
    assert full["factorisations"] == full["newton_iterations"] > 2 * fixed["factorisations"]
    assert full["mass"] == pytest.approx(fixed["mass"], rel=1e-10)


@pytest.mark.parametrize(
    ("options", "what"),
    [
        (("--adaptive", "0"), "the tolerance of density is 0: a number between 0 and 1 would be right"),
        (("--scheme", "euler"), "there is no scheme of time integration 'euler': one of implicit-euler, "),
        (("--equilibrium", "-1"), "the share of equilibrium is -1: a positive number would be right"),
    ],
)
def test_steps_that_cannot_be_meant_are_refused(options, what, tmp_path):
    """Bad input like any other: one sentence and status 2."""
    run = growthx("plate", "--elements", "2", *options, folder=tmp_path)
    assert run.returncode == 2
    assert run.stderr.startswith(f"growthx: {what}")
    assert run.stderr.count("\n") == 1


@pytest.mark.parametrize("arguments", [("--json",), ()], ids=["json", "tables"])
def test_a_reader_who_leaves_is_not_told(arguments, tmp_path):
    """As in `growthx … | head -1`: PETSc would abort with a page about signal 13."""
    command = [sys.executable, "-m", "growthx", "plate", "--elements", "2", *arguments]
    pipe = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen(command, cwd=tmp_path, text=True, **pipe) as run:
        run.stdout.close()
        assert (run.stderr.read(), run.wait(timeout=120)) == ("", 1)


def test_tables_that_cannot_be_written_are_one_sentence(tmp_path):
    """Redirected to a disk that is full, they would be lost with a traceback that does not say so."""
    command = [sys.executable, "-m", "growthx", "plate", "--elements", "2"]
    with open("/dev/full", "w") as full:
        run = subprocess.run(command, cwd=tmp_path, stdout=full, stderr=subprocess.PIPE, text=True, timeout=120)
    assert (run.stderr, run.returncode) == ("growthx: the output cannot be written (No space left on device)\n", 1)


def test_a_run_whose_results_cannot_be_written_still_says_what_it_found(tmp_path):
    """Hours of work end in a folder that has vanished: the tables are all there is of it."""
    script = """
import sys
from growthx import cli, results
from growthx.common.errors import OutputError
from growthx.results.states import trail
def full(folder, result, **options):
    raise OutputError("the results cannot be written to out (No space left on device)")
trail.write = full
raise SystemExit(cli.main(sys.argv[1:]))
"""
    command = [sys.executable, "-c", script, "plate", "--elements", "2", "--out", "out", "--json"]
    run = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert run.returncode == 1
    assert run.stderr.startswith("growthx: the results cannot be written to out") and run.stderr.count("\n") == 1
    assert json.loads(run.stdout)["converged"] is True


def test_another_energy_by_its_name(tmp_path):
    """`--energy` changes the answer a little; a name that there is not is told with those there are."""
    arguments = ("plate", "--elements", 4)
    paper, hencky = (answer(*arguments, *more, folder=tmp_path)["mass"] for more in ((), ("--energy", "hencky")))
    assert paper != hencky == pytest.approx(paper, rel=0.05)
    wrong = growthx(*arguments, "--energy", "hookean", folder=tmp_path)
    assert wrong.returncode == 2 and "hookean" in wrong.stderr and "hencky" in wrong.stderr
