"""Files that are not what they should be: damaged meshes, endless scripts, folders, paths that are none."""

import os
import random
import signal
import subprocess
import sys
import time

import gmsh
import pytest
from blocks import COMM, block, fuzz
from hypothesis import given
from hypothesis import strategies as st

import growthx as gx
from growthx import meshing
from growthx.common.errors import InputError
from growthx.meshing import files
from growthx.scenes.femur import outline, zones

SQUARE = """
Point(1) = {0, 0, 0}; Point(2) = {1, 0, 0}; Point(3) = {1, 1, 0}; Point(4) = {0, 1, 0};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 1};
Curve Loop(1) = {1, 2, 3, 4}; Plane Surface(1) = {1};
Transfinite Curve {1:4} = 3; Transfinite Surface {1};
Recombine Surface {1}; Physical Surface("all") = {1}; Physical Curve("left") = {4}; Physical Curve("right") = {2};
"""
FORMATS = [(2.2, 0), (4.1, 0), (2.2, 1), (4.1, 1)]  # version, binary


def refusal(path, **arguments):
    """The sentence with which every rank refuses a file."""
    with pytest.raises(InputError) as caught:
        meshing.read(path, **arguments)
    (sentence,) = set(COMM.allgather(str(caught.value)))
    assert "\n" not in sentence and not gmsh.isInitialized()
    return sentence


def put(path, content):
    """Write a file on rank 0, where it is read."""
    if COMM.rank == 0:
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


@pytest.fixture(scope="module")
def meshes(tmp_path_factory):
    """The contents of good mesh files of the square in 4 cells, by version and whether they are binary."""
    contents = {}
    if COMM.rank == 0:
        folder = tmp_path_factory.mktemp("meshes")
        (folder / "square.geo").write_text(SQUARE)
        gmsh.initialize(readConfigFiles=False, interruptible=False)
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(folder / "square.geo"))
        gmsh.model.mesh.generate(2)
        for version, binary in FORMATS:
            gmsh.option.setNumber("Mesh.MshFileVersion", version)
            gmsh.option.setNumber("Mesh.Binary", binary)
            gmsh.write(str(folder / "square.msh"))
            contents[version, binary] = (folder / "square.msh").read_bytes()
        gmsh.finalize()
    return COMM.bcast(contents)


@pytest.mark.parametrize("kind", FORMATS)
def test_all_versions_of_meshes_are_read(kind, meshes, shared_folder):
    """gmsh writes 4.1, others 2.2, and large meshes are binary."""
    mesh = meshing.read(put(shared_folder / "square.msh", meshes[kind]))
    assert (mesh.cell_count, set(mesh.regions), set(mesh.boundaries)) == (4, {"all"}, {"left", "right"})


# A lost or a foreign word is what transfers and editors do to text; binary files lose their ends.
# (Bytes changed within a binary file can make gmsh itself crash or read for ever.)
WORDS = [b"nan", b"1e400", b"-1", b"99999999999", b"0", b"7", b"x", b"1e300", b"", b"\xff\x00", b"$End"]


def damaged(content, seed):
    """A text with one word changed, a line lost or its end cut off."""
    chance = random.Random(seed)
    lines = content.split(b"\n")
    line = chance.randrange(len(lines))
    if chance.random() < 0.3:
        return b"\n".join(lines[:line] + lines[line + 1 :])
    if chance.random() < 0.3:
        return content[: chance.randrange(len(content))]
    words = lines[line].split(b" ")
    words[chance.randrange(len(words))] = chance.choice(WORDS)
    return b"\n".join([*lines[:line], b" ".join(words), *lines[line + 1 :]])


@fuzz(150)
@given(st.sampled_from(FORMATS[:2]), st.integers(0, 10**6))
def test_damaged_meshes_are_read_or_refused(meshes, shared_folder, kind, seed):
    """Whatever is left of a file: a mesh whose cells are sound, or one sentence on all ranks."""
    path = put(shared_folder / "damaged.msh", damaged(meshes[kind], seed))
    sentence = ""
    try:
        mesh = meshing.read(path)
    except InputError as error:
        sentence = str(error)
    else:
        if {"left", "right"} <= set(mesh.boundaries):
            gx.discretise(block(mesh), gx.Q1P0)
    assert len(set(COMM.allgather(sentence))) == 1 and "\n" not in sentence


@pytest.mark.parametrize("kind", FORMATS[2:])
@pytest.mark.parametrize("share", [0.1, 0.5, 0.9, 0.97])
def test_binary_meshes_cut_off_are_refused(kind, share, meshes, shared_folder):
    """An interrupted copy."""
    content = meshes[kind]
    assert "cut.msh" in refusal(put(shared_folder / "cut.msh", content[: int(share * len(content))]))


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (SQUARE.replace("{1, 1, 0}", "{1e400, 1, 0}"), "finite coordinates would be right"),
        (SQUARE.replace("{1, 1, 0}", "{1e200, 1e200, 0}"), "finite coordinates would be right"),
        (SQUARE + "Exit;\n", "has an Exit, with which gmsh would end the whole program"),
        (SQUARE.replace("{1, 1, 0}", "{1, 0, 0}").replace("{0, 1, 0}", "{0, 0, 0}"), "inverted"),
        ('Include "bad.geo";\n', "cannot make a mesh"),
        ('Merge "missing.step";\n' + SQUARE, "Unable to open file"),
        ('Physical Surface("line\nbreak") = {1};\n', "no physical groups"),
    ],
    ids=["nowhere", "far", "exit", "no thickness", "itself", "missing part", "line break"],
)
def test_scripts_that_would_end_badly(text, sentence, shared_folder):
    """Some would end the program without a word, with status 0, and some never."""
    found = refusal(put(shared_folder / "bad.geo", text))
    assert sentence in found and "bad.geo" in found


def test_exit_in_text_or_comments_is_none(shared_folder):
    """The word alone does no harm."""
    text = SQUARE + '// Exit;\n/* Exit; */\nname = "Exit;";\n'
    assert meshing.read(put(shared_folder / "square.geo", text)).cell_count == 4


@pytest.mark.parametrize(
    "path", [None, 5, b"square.msh", "", "null\0byte.msh", "x" * 300 + ".msh", ["square.msh"], "\udcff.msh"], ids=repr
)
def test_what_is_no_file_is_refused(path):
    """A path of a wrong type would be a TypeError on the first rank, and the others would wait."""
    refusal(path)


def test_folders_and_closed_files_are_refused(shared_folder):
    """In place of a file: what the system says would not name it."""
    if COMM.rank == 0:
        (shared_folder / "folder.geo").mkdir()
        os.mkfifo(shared_folder / "pipe.msh")  # from which nothing would ever come
    COMM.barrier()
    assert "there is no file" in refusal(shared_folder / "folder.geo")
    assert "there is no file" in refusal(shared_folder / "pipe.msh")


@pytest.mark.parametrize("refine", [True, -1, None, "2", 10**6, 10**30], ids=repr)
def test_splits_that_cannot_be(refine):
    """A million times a million pieces of each cell would end in the system killing the program."""
    assert "refine" in refusal(meshing.locate("femur_658.msh"), refine=refine)


@pytest.mark.parametrize("value", [None, "x", float("nan"), float("inf"), 1e300, 10**400, [1], 1j], ids=repr)
def test_parameters_that_are_no_numbers(value):
    """They go to a script, which would take them for something."""
    assert "elements" in refusal(meshing.locate("bar.geo"), elements=value)


def test_groups_that_a_scene_needs(shared_folder):
    """A mesh may be fine and yet lack what is loaded or held; groups that overlap are no mistake."""
    text = SQUARE + 'Physical Curve("rim") = {1:4}; Physical Surface("also") = {1};\n'
    mesh = meshing.read(put(shared_folder / "square.geo", text))
    assert block(mesh, supports=(gx.Support("rim"),), growing=("also", "all")).mesh is mesh
    with pytest.raises(InputError, match=r"no boundary named 'distal'; it has 'left', 'right', 'rim'"):
        block(mesh, supports=(gx.Support("distal"),))


def test_nodes_that_are_there_twice_part_a_body(shared_folder):
    """Two surfaces that touch but were not fused look like one body and are two."""
    halves = (
        "Point(1) = {0, 0, 0}; Point(2) = {1, 0, 0}; Point(3) = {1, 1, 0}; Point(4) = {0, 1, 0};\n"
        "Point(5) = {1, 0, 0}; Point(6) = {2, 0, 0}; Point(7) = {2, 1, 0}; Point(8) = {1, 1, 0};\n"
        "Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 1};\n"
        "Line(5) = {5, 6}; Line(6) = {6, 7}; Line(7) = {7, 8}; Line(8) = {8, 5};\n"
        "Curve Loop(1) = {1, 2, 3, 4}; Plane Surface(1) = {1}; Curve Loop(2) = {5, 6, 7, 8}; Plane Surface(2) = {2};\n"
        "Transfinite Curve {1:8} = 3; Transfinite Surface {1, 2}; Recombine Surface {1, 2};\n"
        'Physical Surface("all") = {1, 2}; Physical Curve("left") = {4}; Physical Curve("right") = {6};\n'
    )
    mesh = meshing.read(put(shared_folder / "halves.geo", halves))
    with pytest.raises(
        InputError, match=r"falls into 2 parts that share no node, and that of 4 cells about \(1.5, 0.5\)"
    ):
        gx.discretise(block(mesh), gx.Q1)


@pytest.mark.parametrize("table", [outline, zones], ids=["outline", "zones"])
@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"index,zone,x_mm,y_mm\n",
        b"index,zone,x_mm\n0,head,1\n",
        b"index,zone,x_mm,y_mm\n0,head,1,one\n",
        b"index,zone,x_mm,y_mm\n0,head,1\n",
        b"index,zone,x_mm,y_mm\n0,head,nan,1\n",
        b"\xff\xfe\x00\x01",
        b"index,zone,x_mm,y_mm\n0,\x00,1,1\n0,head,\n",
    ],
    ids=["empty", "no rows", "a column less", "a word", "a cell less", "no number", "binary", "nul"],
)
def test_damaged_tables_of_an_installation_are_named(table, content, shared_folder, monkeypatch):
    """Half a copy of growthx would else load the femur at another place."""
    path = put(shared_folder / "table.csv", content)
    COMM.barrier()
    monkeypatch.setattr(files, "locate", lambda name: path)
    with pytest.raises(
        InputError, match=r"^growthx's own file \S*table.csv is damaged \(.*\): a new copy would be right$"
    ):
        table.__wrapped__()


@pytest.mark.serial
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_endless_script_can_be_ended(number, tmp_path):
    """gmsh does not come back from a macro that calls itself: Ctrl-C must still end the program."""
    (tmp_path / "endless.geo").write_text("Macro Again\nCall Again;\nReturn\nCall Again;\n")
    program = "import sys; from growthx.cli import main; print('on', flush=True); sys.exit(main(sys.argv[1:]))"
    command = [sys.executable, "-c", program, "femur", "--mesh", "endless.geo"]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        process.stdout.readline()
        time.sleep(3)  # imports, and then it reads
        assert process.poll() is None
        process.send_signal(number)
        assert process.wait(timeout=10) != 0
