"""Pictures and fields on the command line: what was asked for is drawn and written, or refused before the run."""

import argparse

import numpy as np
import pytest
from blocks import COMM, block, cube, square

import growthx as gx
from growthx.cli.command import SceneCommand
from growthx.cli.scene_run import of_scene
from growthx.post import plots


def run(arguments, mesh=cube, in_space=True):
    """The exit status of a toy scene's command with these arguments."""
    scene = block(mesh(2), loads=(gx.DistributedForce("right", (0.1, -0.02, 0.01)[: mesh(2).dim]),))
    toy = SceneCommand(
        "toy",
        "a toy",
        lambda parser: None,
        lambda options: scene,
        lambda result: {},
        lambda result, readings: None,
        "g/cm³",
        by_gmsh=False,
        in_space=in_space,
    )
    parser = argparse.ArgumentParser()
    command = of_scene(toy)
    command.arguments(parser)
    return command.run(parser.parse_args(arguments))


@pytest.fixture
def calls(monkeypatch):
    """The pictures that were asked for: name, further arguments, options."""
    found = []
    for name in ("density", "slices", "threshold", "cutaway"):

        def seen(problem, path, *rest, name=name, **options):
            found.append((name, rest, options))

        monkeypatch.setattr(plots, name, seen)
    return found


TITLE = {"title": "density (g/cm³)"}


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        ([], ("density", (), TITLE)),
        (["--relative"], ("density", (), {"relative": True, "scale": "density (g/cm³)"})),
        (
            ["--slice", "axial", "--slice", "0.5,0.5,0.5,1,0,1", "--grey"],
            ("slices", (["axial", ((0.5, 0.5, 0.5), (1.0, 0.0, 1.0))],), {"grey": True, **TITLE}),
        ),
        (["--slice", "coronal", "--relative"], ("slices", (["coronal"],), {"grey": False, "relative": True})),
        (["--above", "0.5"], ("threshold", (0.5,), TITLE)),
        (["--cutaway"], ("cutaway", (), TITLE)),
    ],
    ids=lambda value: " ".join(value) or "none" if isinstance(value, list) else "",
)
def test_the_picture_is_the_one_that_was_asked_for(arguments, expected, calls, shared_folder):
    """Each option means one call of `gx.plots`, which a script may make as well."""
    assert run(["--picture", str(shared_folder / "a.png"), *arguments]) == 0
    assert calls == [expected]


@pytest.mark.parametrize(
    "arguments", [[], ["--slice=0.5,0.5,0.4,0,0.2,1", "--grey"], ["--above", "0.6"], ["--cutaway"]]
)
def test_the_picture_is_there(arguments, shared_folder, capfd):
    """All the way from the words to the file, and a sentence that says where it is."""
    path = shared_folder / "a.png"
    assert run(["--picture", str(path), *arguments]) == 0
    COMM.barrier()
    assert path.stat().st_size > 5000
    assert COMM.rank > 0 or f"the picture is {path}" in capfd.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--slice", "axial"], "--slice is of a picture, and none is asked for: with --picture FILE would be right"),
        (["--grey"], "--grey is of a picture"),
        (["--cutaway"], "--cutaway is of a picture"),
        (["--picture", "a.png", "--grey"], "--grey is of slices, and none is asked for: with --slice PLANE"),
        (["--picture", "a.png", "--cutaway", "--above", "1"], "--above and --cutaway are two pictures"),
        (["--picture", "a.png", "--slice", "top"], "there is no plane 'top': one of coronal, axial, sagittal"),
        (["--picture", "a.png", "--slice", "1,2,3"], "--slice 1,2,3 is no plane: six numbers with commas"),
        (["--picture", "a.png", "--slice", "1,2,3,a,b,c"], "is no plane: six numbers with commas"),
        (["--picture", "a.png", "--slice", "5,5,5,1,0,0"], "misses the body, which reaches from"),
        (["--picture", "a.png", "--above", "1", "--relative"], "--relative is no density to be above"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_what_could_not_be_drawn_is_refused_before_the_run(arguments, sentence, monkeypatch, shared_folder):
    """A picture at the end of a long run is not to be lost by a word."""
    from growthx import run as runs

    monkeypatch.chdir(shared_folder)
    monkeypatch.setattr(runs, "solve", lambda *arguments, **options: pytest.fail("this takes time"))
    with pytest.raises(gx.InputError, match=sentence):
        run(arguments)


def test_views_of_space_are_no_options_of_plane_scenes(calls, shared_folder):
    """Their help would promise what a plane body has not; and a scene that is told in space and is not, is refused."""
    with pytest.raises(SystemExit):
        run(["--picture", "a.png", "--cutaway"], mesh=square, in_space=False)
    with pytest.raises(gx.InputError, match="--cutaway is of a body in space, and this one is plane"):
        run(["--picture", str(shared_folder / "a.png"), "--cutaway"], mesh=square)
    assert run(["--picture", str(shared_folder / "a.png")], mesh=square, in_space=False) == 0
    assert calls == [("density", (), TITLE)]


@pytest.mark.parametrize(("more", "label"), [([], "density"), (["--relative"], "[ρ − ρ*]/ρ*")])
def test_the_bar_has_a_graph(more, label, shared_folder, monkeypatch):
    """A hundredth as wide as long, it would be a line: its density is plotted along it, with the levels it reaches."""
    from growthx.cli import program

    drawn = []
    monkeypatch.setattr(plots, "_plot", lambda curves, x, exact, title, path: drawn.append((curves, x, title)))
    arguments = ["bar", "--elements", "10", "--dt", "0.5", "--picture", str(shared_folder / "a.svg"), *more]
    assert program.main(arguments) == 0
    if COMM.rank == 0:
        ((curves, x, title),) = drawn
        assert list(curves) == ["Q1P0"] and label in title
        middle = curves["Q1P0"][np.abs(x - 0.5) < 0.1]
        assert np.ptp(middle) < 1e-3 and middle.mean() > curves["Q1P0"].mean() + 0.03


def test_the_bar_has_no_picture_of_a_body(shared_folder):
    """What no graph can be written as is refused before the run."""
    from growthx.cli import program

    assert program.main(["bar", "--picture", str(shared_folder / "a.bmp")]) != 0


def test_fields_by_their_names(shared_folder):
    """With commas, and blanks as people type them; each with its place."""
    out = shared_folder / "out"
    assert run(["--out", str(out), "--fields", "von_mises:cells, strain_energy:points"]) == 0
    COMM.barrier()
    parts = {stem: (out / f"{stem}000000.pvtu").read_text() for stem in ("fields", "points")}
    assert 'Name="von_mises_in_cells"' in parts["fields"] and "strain_energy" not in parts["fields"]
    assert 'Name="strain_energy_at_points"' in parts["points"] and "von_mises" not in parts["points"]
    assert not (out / "raw.pvd").exists()


@pytest.mark.parametrize("names", ["mises", "", "von_mises,", "von_mises:corner"])
def test_fields_that_are_none(names, shared_folder):
    """In one sentence, with those there are, and before a folder is made."""
    with pytest.raises(gx.InputError, match=r"would be right$"):
        run(["--out", str(shared_folder / "out"), "--fields", names])
    assert not (shared_folder / "out").exists()
