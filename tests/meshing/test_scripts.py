"""Scripts of gmsh that would do more than make a mesh are refused before gmsh sees them; harmless ones are not."""

import time

import pytest
from mpi4py import MPI

from growthx import meshing
from growthx.common.errors import InputError
from growthx.meshing.formats import gmsh, scripts

pytestmark = pytest.mark.skipif(MPI.COMM_WORLD.size > 1, reason="a file is read by one rank")

SQUARE = """Point(1) = {0, 0, 0}; Point(2) = {1, 0, 0}; Point(3) = {1, 1, 0}; Point(4) = {0, 1, 0};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 1};
Curve Loop(1) = {1, 2, 3, 4}; Plane Surface(1) = {1}; Physical Surface("all") = {1}; Physical Curve("left") = {4};
"""
TOUCH = 'SystemCall "touch done";'


def write(folder, text, name="body.geo"):
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def refusal(path):
    """The sentence with which a script is refused that is not trusted."""
    with pytest.raises(InputError) as caught:
        scripts.check(path, False)
    assert str(path.parent) in str(caught.value) and "\n" not in str(caught.value)
    return str(caught.value)


COMMANDS = {
    'SystemCall "touch done";': "SystemCall runs a program",
    "SystemCall 'touch done';": "SystemCall runs a program",
    'SystemCall StrCat("touch ", "done");': "SystemCall runs a program",
    'NonBlockingSystemCall "touch done";': "NonBlockingSystemCall runs a program",
    'System "touch done";': "System runs a program",
    'OnelabRun("x", "touch done");': "OnelabRun runs a program",
    'OnelabRun "x";': "OnelabRun runs a program",
    'StringToName["SystemCall"] "touch done";': "makes a command of a text",
    'S2N("System") "touch done";': "makes a command of a text",
    'Field[1] = ExternalProcess; Field[1].CommandLine = "touch done";': "ExternalProcess runs a program",
    'Save "done";': "Save writes a file",
    'Save StrCat("do", "ne");': "Save writes a file",
    'Save View[0] "done";': "Save writes a file",
    'SendToServer View[0] "done";': "SendToServer sends",
    'Print "done.msh";': "Print writes a file",
    'CreateDir "done";': "CreateDir makes a folder",
    "Plugin(NewView).Run;": "Plugin may write files",
    'Printf("x") > "done";': "Printf writes a file",
    'Printf("%g", 1) >> "done";': "Printf writes a file",
    'Printf(Str("a"]) > "done";': "Printf writes a file",
    'Printf(Str["a"]) >> Str("done");': "Printf writes a file",
    'General.ErrorFileName = "done";': "General.ErrorFileName names a file",
    'General . TmpFileName = "done";': "General.TmpFileName names a file",
    "General.SaveOptions = 1;": "General.SaveOptions names",
    'Solver.Executable0 = "touch";': "Solver.Executable0 names",
    'Solver.Extension0 = ".geo";': "Solver.Extension0 names",
    'Geometry.DoubleClickedPointCommand = "touch done";': "DoubleClickedPointCommand names",
    'View[0].DoubleClickedCommand = "touch done";': "DoubleClickedCommand names",
    'a[] = {0}; View[a[0]].DoubleClickedCommand = "touch done";': "DoubleClickedCommand names",
    'Delete File "done";': "File is a command that is not known",
    'Frobnicate "done";': "Frobnicate is a command that is not known",
    'name = "part.geo"; Merge Str(name);': "Merge opens a file whose name the script makes up",
    'Include StrCat("part", ".geo");': "Include opens a file whose name the script makes up",
    'Merge "run.py";': "may run a program",
    'Merge "mesh.msh.gz";': "may run a program",
    'If(0)\nFor i In {1:2}\nSystemCall "touch done";\nEndFor\nEndIf': "SystemCall runs a program",
    'Macro Go\nSystemCall "touch done";\nReturn\nCall Go;': "SystemCall runs a program",
    '{ ; Frobnicate "done";': "Frobnicate is a command",
    'a = "\nSystemCall";\nSystem "touch done";': "System runs a program",
}


@pytest.mark.parametrize("ends", ["\n", "\r\n"], ids=["Unix", "Windows"])
@pytest.mark.parametrize("command", COMMANDS, ids=range(len(COMMANDS)))
def test_what_nobody_needs_for_a_mesh_is_refused(command, ends, tmp_path):
    """By its name, its file and its line; nothing of it was done."""
    write(tmp_path, "", "run.py")
    write(tmp_path, "", "mesh.msh.gz")
    text = f"{SQUARE}// a comment\n{command}\n"
    path = write(tmp_path, text.replace("\n", ends))
    found = refusal(path)
    assert COMMANDS[command] in found
    (line,) = (int(word.rstrip(":")) for word in found.split(" line ")[1].split()[:1])
    lines = [number for number, each in enumerate(text.splitlines(), 1) if number > 4 and each.strip('a ="')]
    assert line in lines
    with pytest.raises(InputError, match=r"trusted=True \(--trusted\) would let it"):
        meshing.read(path)
    assert not list(tmp_path.glob("done*"))


def test_the_sentence(tmp_path):
    """With its cure."""
    path = write(tmp_path, f"{SQUARE}\n  {TOUCH}\n")
    assert refusal(path) == (
        f"{path}, line 5: SystemCall runs a program: trusted=True (--trusted) would let it, if you know who wrote the "
        "script"
    )


def test_a_trusted_script_does_what_it_likes(tmp_path):
    """And a mesh is made of it."""
    path = write(tmp_path, f'{SQUARE}SystemCall "touch {tmp_path}/done";\n')
    assert meshing.read(path, trusted=True).cell_count > 0
    assert (tmp_path / "done").is_file()


HARMLESS = [
    '// SystemCall "touch done";',
    '/* SystemCall "touch done";\n Save "x"; */',
    "name = \"SystemCall 'touch done'; // \"; other = '/* Save \"x\";';",
    'Printf("Save > %g", 3); Printf("%g", 1 > 0); Error(Str("Print"));\n'.replace("Error", "Warning"),
    'DefineConstant[ Save = {1, Name "Save", Help "System"}, text = {"a", Name "text", Choices {"a", "b"}} ];',
    "System = 1; Print = 2; Save = System + Print; Save += 1;",
    "General.Verbosity = 0; Mesh.MshFileVersion = 2.2; Mesh.SaveAll = 1; View.ShowScale = 0; Print.Background = 1;",
    'View "x" { SP(0, 0, 0){1}; T2(1, 1, 0){"Save"}; };',
    'Macro Go\n a = 1;\nReturn\nCall Go; Call "Go";'.replace(' Call "Go";', ""),
    'SetName "square"; Hide "*"; Show "*";',
    'Physical Curve(StrCat("ri", "ght")) = {2};',
    "For i In {1:2}\n b = i; /* over\n lines */\nEndFor",
    'Field[1] = MathEval; Field[1].F = "0.5"; Background Field = 1;',
    'Include "part.geo";',
    'Merge "part.pos";',
]


@pytest.mark.parametrize("text", HARMLESS, ids=range(len(HARMLESS)))
def test_what_does_no_harm_is_not_refused(text, tmp_path):
    """Words in texts and comments, variables of those names, what scripts have every day."""
    write(tmp_path, "c = 1;\n", "part.geo")
    write(tmp_path, 'View "x" { SP(0, 0, 0){1}; };\n', "part.pos")
    path = write(tmp_path, f"{SQUARE}{text}\n")
    scripts.check(path, False)
    assert meshing.read(path).cell_count > 0
    assert not list(tmp_path.glob("done*"))


@pytest.mark.parametrize("name", ["bar.geo", "femur.geo"])
def test_our_own_scripts_need_no_trust(name):
    """They make meshes, and nothing else."""
    assert scripts.check(meshing.locate(name), False) == ()


@pytest.mark.parametrize("command", ["Include", "Merge"])
@pytest.mark.parametrize("name", ["part.geo", "part.pos", "part.opt", "part", "part.txt", "part.Stl", "part.msh"])
def test_what_a_script_opens_is_a_script_too(command, name, tmp_path):
    """Whatever its suffix, unless gmsh takes it for data; through others, too, and round in circles."""
    (tmp_path / "sub").mkdir()
    write(tmp_path / "sub", f"\n{TOUCH}\n", name)
    write(tmp_path, f'Include "sub/../sub/{name}";\nInclude "body.geo";\nInclude "middle.geo";\n', "middle.geo")
    path = write(tmp_path, f'{SQUARE}{command} "middle.geo";\n')
    assert f"{name}, line 2: SystemCall" in refusal(path)
    assert f"{name}, line 2: SystemCall" in refusal(write(tmp_path, f'{command} "sub/{name}";\n'))


def test_options_that_gmsh_reads_beside_a_file(tmp_path):
    """gmsh opens body.geo.opt after body.geo, and so for what is merged."""
    path = write(tmp_path, SQUARE)
    write(tmp_path, f"{TOUCH}\n", "body.geo.opt")
    assert "body.geo.opt, line 1: SystemCall" in refusal(path)
    (tmp_path / "body.geo.opt").unlink()
    write(tmp_path, f"{TOUCH}\n", "part.stl.opt")
    write(tmp_path, "solid\n", "part.stl")
    assert "part.stl.opt, line 1" in refusal(write(tmp_path, f'{SQUARE}Merge "part.stl";\n'))


def test_data_that_a_script_opens_are_returned(tmp_path):
    """Meshes and geometry; a file that is missing is gmsh's to miss."""
    mesh, shape = write(tmp_path, "$MeshFormat\n", "mesh.msh"), write(tmp_path, b"\0System", "shape.STL")
    text = 'Merge "mesh.msh"; Merge "shape.STL"; Merge "missing.step"; ShapeFromFile("shape.STL");\n'
    assert scripts.check(write(tmp_path, text), False) == (mesh, shape, shape)


HIDDEN = {
    # gmsh comes back to the line after the loop's, which is inside the comment
    "loop": f"For i In {{1:2}} /*\n{TOUCH} // */ EndFor\n",
    "loop over lines": f"For i In {{1:\n2}} /*\n{TOUCH} // */ EndFor\n",
    "text": f'For i In {{1:2}} a = "\n{TOUCH}\n"; EndFor\n',
    "macro": f"Macro Go /*\n{TOUCH} // */ Return\nCall Go;\n",
    "call": f"Macro Go\nReturn\nCall Go; /*\n{TOUCH} // */\n",
    "include": f'Include "part.geo"; /*\n{TOUCH} // */\n',
    "merge": f'Merge "part.geo"; /*\n{TOUCH} // */\n',
    "old line break": f"For i In {{1:2}} // \r{TOUCH}\nEndFor\n",
    "end of text": f'a = "\0; {TOUCH}";\n',
    "long text": f'a = "{"x" * 1100}{TOUCH.replace(chr(34), chr(39))}";\n',
    "long line": f"For i In {{1:2}} {' ' * 20000}/* {TOUCH} */ \nEndFor\n",
}


@pytest.mark.parametrize("case", HIDDEN)
def test_commands_hidden_from_a_reader_are_refused(case, tmp_path, monkeypatch):
    """gmsh does some of them: what looks like a comment or a text is none for it."""
    write(tmp_path, "c = 1;\n", "part.geo")
    path = write(tmp_path, SQUARE + HIDDEN[case])
    assert "may hide a command" in refusal(path)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError):
        gmsh.read(path, {}, False)
    assert not (tmp_path / "done").exists()


def test_a_mesh_that_is_merged_must_be_whole(tmp_path):
    """gmsh may crash on one that is not."""
    write(tmp_path, "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 1000000000000 1 1\n", "cut.msh")
    with pytest.raises(InputError, match=r"cut\.msh has no end: a file that is whole would be right"):
        meshing.read(write(tmp_path, f'{SQUARE}Merge "cut.msh";\n'))


def test_of_any_script(tmp_path):
    """Trusted or not."""
    for text in ("Exit;\n", "If(1)\n Exit 3;\nEndIf\n"):
        path = write(tmp_path, SQUARE + text)
        with pytest.raises(InputError, match="has an Exit"):
            scripts.check(path, True)
    with pytest.raises(InputError, match=r"the suffix \.msh would be right"):
        scripts.check(write(tmp_path, "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n"), True)


def test_large_scripts_are_looked_through_at_once(tmp_path):
    """With many points, options and messages."""
    start = time.perf_counter()
    for word in ("View[ ", "Printf( ", "/* ", "( ", "Solver. "):
        scripts.check(write(tmp_path, word * 20_000 + "\n"), False)
    lines = "".join(f'Point({i}) = {{{i}, 0, 0}}; General.Verbosity = 0; Printf("%g", {i});\n' for i in range(20_000))
    path = write(tmp_path, lines)
    scripts.check(path, False)
    assert time.perf_counter() - start < 20.0
