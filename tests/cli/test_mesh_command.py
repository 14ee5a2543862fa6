"""What a file holds, as people need it before they write a script: on the terminal, as JSON and as a picture."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from blocks import COMM

from growthx.cli import main
from growthx.common.errors import OutputError
from growthx.meshing import Parts, formats
from growthx.meshing.corners import qualities
from growthx.meshing.inspection import _unit

FILES = Path(__file__).parents[1] / "meshing" / "files"


def told(capsys, *arguments, status=0):
    """What the command prints on stdout, on rank 0, and its complaint."""
    assert main(["mesh", *map(str, arguments)]) == status
    answer = capsys.readouterr()
    assert COMM.rank == 0 or answer.out == ""
    return COMM.bcast(answer.out), COMM.bcast(answer.err)


def test_a_file_is_told_in_tables(capsys):
    """Format, extent, parts with their sizes, quality, and the line for a script."""
    out, err = told(capsys, FILES / "two_good.msh")
    for text in (
        "gmsh mesh 2.2, text",
        "2 lines, 2 quadrilaterals",
        "(0, 0) to (2, 1)",
        "is it in mm?",
        "soft",
        "right",
    ):
        assert text in out
    assert "worst 1 at (0.5, 0.5)" in out and re.search(r'in a script: mesh = gx.meshing.read\(".*two_good.msh"\)', out)
    assert err == ""


@pytest.mark.parametrize(
    ("name", "sizes"),
    [
        ("two.inp", {"SOFT": 1, "STIFF": 1, "LEFT": 1, "RIGHT": 1}),
        ("no_names.msh", {"1": 1, "2": 1, "3": 1, "4": 1}),
        ("interface.geo", {"soft": 1, "stiff": 1, "left": 1, "right": 1, "interface": 1, "both": 2}),
    ],
)
def test_a_file_is_told_as_json(capsys, name, sizes):
    """One object for programs, with the same numbers."""
    seen = json.loads(told(capsys, FILES / name, "--json")[0])
    found = {part["name"]: part["size"] for part in (*seen["regions"], *seen["boundaries"])}
    assert found == pytest.approx(sizes)
    assert (seen["low"], seen["high"], seen["refused"]) == ([0, 0], [2, 1], "")


def test_values_and_notices_are_told(capsys):
    """Ranges of data; what is left out."""
    assert re.search(r"density +│ +0.1 │ +0.4", told(capsys, FILES / "order_of_cells.msh")[0])
    assert "notice: " in told(capsys, FILES / "plane_xz.msh")[0]


MIXED = (
    "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n6\n1 0 0 0\n2 1 0 0\n3 2 0 0\n4 0 1 0\n5 1 1 0\n6 2 1 0\n$EndNodes\n"
    "$Elements\n3\n1 3 2 1 1 1 2 5 4\n2 2 2 1 1 2 3 6\n3 2 2 1 1 2 6 5\n$EndElements\n"
)


def test_a_file_that_would_be_refused_is_told_as_far_as_it_goes(capsys, shared_folder):
    """With the sentence at the end, and the status of bad input."""
    if COMM.rank == 0:
        (shared_folder / "mixed.msh").write_text(MIXED)
    COMM.barrier()
    out, err = told(capsys, shared_folder / "mixed.msh", status=2)
    assert "1 quadrilateral, 2 triangles" in out and "in a script" not in out
    assert "(0, 0, 0) to (2, 1, 0)" in out and re.search(r"1 +│ elements +│ +3", out)
    assert err.startswith("growthx: the mesh of ") and "RecombinationAlgorithm" in err
    assert main(["mesh", str(shared_folder / "nothing.msh")]) == 2


def test_islands_and_options_are_told(capsys, shared_folder):
    """With what would drop them, and the call that does."""
    if COMM.rank == 0:
        crumb = "7 5 5 0\n8 6 5 0\n9 5 6 0\n$EndNodes"
        text = MIXED.replace("6\n1 0 0 0", "9\n1 0 0 0").replace("$EndNodes", crumb)
        text = text.replace("1 3 2 1 1 1 2 5 4\n", "1 2 2 1 1 7 8 9\n")
        (shared_folder / "crumb.msh").write_text(text)
    COMM.barrier()
    out, _ = told(capsys, shared_folder / "crumb.msh")
    assert "islands: 2 triangles of area 1" in out and "1 triangle of area 0.5" in out
    out, _ = told(capsys, shared_folder / "crumb.msh", "--keep", "largest", "--merge")
    assert "islands:" not in out and 'crumb.msh", keep="largest", merge=True)' in out


def test_parameters_of_a_file_are_given(capsys):
    """As numbers by their names; what is none is refused."""
    geo = Path(__file__).parents[2] / "meshes" / "bar.geo"
    seen = json.loads(told(capsys, geo, "--set", "elements=7", "--json")[0])
    assert seen["cells"] == 7
    assert main(["mesh", str(geo), "--set", "elements=many"]) == 2


def test_a_script_is_not_trusted_unless_it_is_said(capsys, shared_folder):
    """Nothing is run by looking at it."""
    if COMM.rank == 0:
        text = f'SystemCall "touch {shared_folder}/done";\nPoint(1) = {{0, 0, 0}};\n'
        (shared_folder / "mine.geo").write_text(text)
    COMM.barrier()
    assert main(["mesh", str(shared_folder / "mine.geo")]) == 2
    assert COMM.rank or "line 1: SystemCall" in capsys.readouterr().err
    assert main(["femur", "--mesh", str(shared_folder / "mine.geo")]) == 2
    assert not (shared_folder / "done").exists()


def msh(shared_folder, nodes, elements, names=""):
    """A file of gmsh, written on rank 0."""
    path = shared_folder / "mine.msh"
    COMM.barrier()
    if COMM.rank == 0:
        rows = [f"{number} {x} {y} 0" for number, (x, y) in enumerate(nodes, 1)]
        elements = [f"{number} {element}" for number, element in enumerate(elements, 1)]
        parts = (["$Nodes", len(rows), *rows, "$EndNodes"], ["$Elements", len(elements), *elements, "$EndElements"])
        lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", *([names] if names else []), *parts[0], *parts[1]]
        path.write_text("".join(f"{line}\n" for line in lines))
    COMM.barrier()
    return path


CORNERS = [(0, 0), (1, 0), (0, 1)]


@pytest.mark.parametrize(
    ("nodes", "elements", "options", "orphans"),
    [
        ([*CORNERS, (0.5, 0), (0.5, 0.5), (0, 0.5)], ["9 2 1 1 1 2 3 4 5 6"], (), 0),
        ([*CORNERS, (9, 9)], ["2 2 1 1 1 2 3"], (), 1),
        ([*CORNERS, (1, 0), (0, 1), (1, 1)], ["2 2 1 1 1 2 3", "2 2 1 1 4 6 5"], ("--merge",), 0),
        ([*CORNERS, (5, 5), (6, 5), (5, 6)], ["2 2 1 1 1 2 3", "2 2 1 1 4 5 6"], ("--keep", "largest"), 0),
        ([*CORNERS, (0.5, 0), (0.5, 0.5), (0, 0.5), (1, 1)], ["9 2 1 1 1 2 3 4 5 6", "2 2 1 1 2 7 3"], (), 0),
    ],
)
def test_nodes_of_no_cell_are_those_of_the_file(capsys, shared_folder, nodes, elements, options, orphans):
    """Not those in the middle of edges, nor those that an option leaves out: nothing is wrong with these."""
    seen = json.loads(told(capsys, msh(shared_folder, nodes, elements), "--json", *options)[0])
    assert (seen["nodes"], seen["orphans"]) == (len(nodes), orphans)


def test_mixed_senses_are_told(capsys, shared_folder):
    """They may be mixed, but who wrote the file may not know it."""
    path = msh(shared_folder, [*CORNERS, (1, 1)], ["2 2 1 1 1 2 3", "2 2 1 1 2 3 4"])
    assert "senses: 1 of 2 cells numbered the other way round" in told(capsys, path)[0]


def test_names_are_shown_as_they_are(capsys, shared_folder):
    """Also with brackets in them, which are markup in a table."""
    names = '$PhysicalNames\n2\n2 1 "bone[left]"\n1 2 "x[/b]"\n$EndPhysicalNames'
    out, err = told(capsys, msh(shared_folder, CORNERS, ["2 2 1 1 1 2 3", "1 2 2 1 1 2"], names))
    assert "│ bone[left] │" in out and "│ x[/b] │" in out and err == ""
    assert "# regions 'bone[left]'; boundaries 'x[/b]'" in out


def test_numbers_in_the_call_are_whole_as_they_were_given(capsys):
    """What is told is what a script reads."""
    out, _ = told(capsys, FILES.parents[2] / "meshes" / "bar.geo", "--set", "elements=1234", "--set", "triangles=0")
    assert 'bar.geo", elements=1234, triangles=0)  # regions' in out


class _Own:
    """A format of a user's own, whose files have a triangle of a node that is not there."""

    SUFFIXES = {".own": "a mesh of our own"}  # noqa: RUF012

    @staticmethod
    def read(path, values):
        """A whole mesh."""
        last = 7 if "bad" in path.name else 2
        return Parts("triangle", np.array(CORNERS, dtype=float), np.array([[0, 1, last]]), {}, {"all": np.array([0])})


def test_a_format_of_ones_own_is_told(capsys, shared_folder, monkeypatch):
    """What is wrong with it in a sentence, whatever it has."""
    monkeypatch.setattr(formats, "_registered", [_Own])
    if COMM.rank == 0:
        for name in ("good.own", "bad.own"):
            (shared_folder / name).touch()
    COMM.barrier()
    seen = json.loads(told(capsys, shared_folder / "good.own", "--json")[0])
    assert (seen["kind"], seen["nodes"], seen["cells"], seen["values"]) == ("of a format of its own", 3, 1, [])
    picture = shared_folder / "own.png"
    assert (
        "the numbers of the nodes of cells of"
        in told(capsys, shared_folder / "bad.own", "--picture", picture, status=2)[1]
    )
    assert not picture.exists()
    assert "knows no keep and no merge" in told(capsys, shared_folder / "good.own", "--merge", status=2)[1]


def test_what_cannot_be_told_ends_all_ranks(capsys, monkeypatch):
    """A picture without a display is no bad input: the other ranks must hear of it, too."""

    def fail(options):
        raise OutputError("no picture")

    monkeypatch.setattr("growthx.cli.mesh._look", fail)
    said = "growthx: no picture (growthx help cli.mesh tells more)\n"
    assert COMM.allgather(told(capsys, FILES / "two_good.msh", status=1)[1]) == [said] * COMM.size


@pytest.mark.parametrize("name", ["two_good.msh", "space.msh"])
def test_a_picture_shows_regions_and_boundaries(capsys, shared_folder, name):
    """In the colours of its legend."""
    path = FILES / name
    if name == "space.msh":
        path = shared_folder / name
        if COMM.rank == 0:
            path.write_text(
                "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$EndNodes\n"
                "$Elements\n2\n1 4 2 1 1 1 2 3 4\n2 2 2 2 2 2 3 4\n$EndElements\n"
            )
        COMM.barrier()
    told(capsys, path, "--picture", shared_folder / "mesh.png")
    if COMM.rank == 0:
        import matplotlib.image

        image = (matplotlib.image.imread(shared_folder / "mesh.png")[:, :, :3] * 255).round().astype(int)
        red, green, blue = np.moveaxis(image, 2, 0)
        orange = (red > 1.5 * green) & (green > blue + 20)
        assert orange.sum() > 500 and (image == 255).all(axis=2).mean() < 0.95
    assert main(["mesh", str(path), "--picture", str(shared_folder / "mesh.gif")]) == 2


def test_no_side_of_a_body_is_hidden_in_its_picture(capsys, shared_folder):
    """It is seen from two opposite corners, in colours that the shade leaves as they are in the legend."""
    cube = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
    sides = ["1 1 1 3 7 5", "2 2 2 4 8 6"]  # x = 0 and x = 1
    path = shared_folder / "cube.msh"
    if COMM.rank == 0:
        nodes = "".join(f"{number} {x} {y} {z}\n" for number, (x, y, z) in enumerate(cube, 1))
        elements = "".join(f"{number} 3 2 {side}\n" for number, side in enumerate(sides, 1))
        path.write_text(
            f"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n8\n{nodes}$EndNodes\n"
            f"$Elements\n3\n{elements}3 5 2 3 3 1 2 4 3 5 6 8 7\n$EndElements\n"
        )
    COMM.barrier()
    told(capsys, path, "--picture", shared_folder / "cube.png")
    if COMM.rank == 0:
        import matplotlib.image

        image = (matplotlib.image.imread(shared_folder / "cube.png")[:, :, :3] * 255).round().astype(int)
        for colour in ([213, 94, 0], [0, 114, 178]):
            assert (np.abs(image - colour).max(axis=2) < 80).sum() > 10000


@pytest.mark.parametrize(
    ("shape", "corners", "quality"),
    [
        ("triangle", [[0, 0], [1, 0], [0.5, np.sqrt(0.75)]], 1.0),
        ("triangle", [[0, 0], [1, 0], [0, 1]], 2 * (np.sqrt(2) - 1)),
        ("triangle", [[0, 0], [1, 0], [0.5, 1e-6]], 8e-12),
        ("tetrahedron", [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], 1.0),
        ("tetrahedron", [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], 3 * (3 - np.sqrt(3)) / 6 / (np.sqrt(3) / 2)),
        ("quadrilateral", [[0, 0], [1, 0], [1, 1], [2, 1]], np.sqrt(0.5)),
        ("quadrilateral", [[0, 0], [1, 0], [0, 1], [0.2, 0.2]], -15 / 17),
        ("hexahedron", [[x, y, z] for z in (0, 3) for y in (0, 2) for x in (0, 1)], 1.0),
    ],
)
def test_quality_of_cells(shape, corners, quality):
    """1 for the best, by the measures of the handbooks; below 0 for what is folded."""
    (found,) = qualities(shape, np.array([corners], dtype=float))
    assert found == pytest.approx(quality, rel=1e-2 if quality < 1e-3 else 1e-9)


def test_units_are_asked_for():
    """By what the extent would mean."""
    texts = [_unit(extent) for extent in (1e-4, 0.45, 450.0, 4.5e5)]
    assert [re.search(r"is it in ([^?]+)\?|in which unit", text)[0] for text in texts] == [
        "in which unit",
        "is it in metres?",
        "is it in mm?",
        "is it in µm?",
    ]


INP = """*NODE
1, 0., 0.
2, 1., 0.
3, 0., 1.
4, 1., 1.
*ELEMENT, TYPE=CPE4, ELSET=B
1, 1, 2, 4, 3
*NSET, NSET=pins
2, 3
"""


def test_sets_of_nodes_and_the_nearest_one_are_told(capsys, shared_folder):
    """Under the names, numbers and places that forces at nodes and points take."""
    path = shared_folder / "one.inp"
    if COMM.rank == 0:
        path.write_text(INP)
    COMM.barrier()
    out, _ = told(capsys, path, "--near", 0.9, 0.8)
    assert "sets of nodes" in out and "pins" in out
    assert "nearest: node 3 (from 0) at (1, 1), 0.223607 from (0.9, 0.8)" in out
    seen = json.loads(told(capsys, path, "--json")[0])
    assert seen["node_sets"] == [{"name": "pins", "of": "nodes", "count": 2}] and seen["nearest"] == ""
    _, err = told(capsys, path, "--near", 0.9, status=2)
    assert "has 1 coordinates: 2 finite ones would be right" in err
