"""The road from a gmsh file to a mesh with names: counts, shapes, names, and one sentence for every unusable file."""

import csv
import re
import subprocess
import sys
from pathlib import Path

import dolfinx
import gmsh
import numpy as np
import pytest
import ufl
from mpi4py import MPI

from growthx import meshing
from growthx.errors import InputError

COMM = MPI.COMM_WORLD

SQUARE = """
DefineConstant[ cells = {2, Min 1, Max 9, Name "Mesh/cells"}, shape = {0, Choices {0, 1}, Name "shape"} ];
Point(1) = {0, 0, 0}; Point(2) = {1, 0, 0}; Point(3) = {1, 1, 0}; Point(4) = {0, 1, 0};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 1};
Curve Loop(1) = {1, 2, 3, 4}; Plane Surface(1) = {1};
Transfinite Curve {1:4} = cells + 1; Transfinite Surface {1};
"""
NAMED = SQUARE + 'Recombine Surface {1}; Physical Surface("all") = {1}; Physical Curve("low") = {1};\n'

# One quadrilateral with its corners in a given order; a msh 2 file is short enough to write by hand.
ONE_CELL = """$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
1
2 1 "all"
$EndPhysicalNames
$Nodes
4
1 0 0 0
2 1 0 0
3 1 1 0
4 {corner} 0
$EndNodes
$Elements
1
1 3 2 1 1 1 2 3 4
$EndElements
"""


@pytest.fixture
def folder(tmp_path):
    """Rank 0's temporary folder, on all ranks."""
    return COMM.bcast(tmp_path)


def write(path: Path, text: str | bytes) -> Path:
    """Write a file on rank 0, where it is read; a text ends in a line break."""
    if COMM.rank == 0:
        path.write_bytes(f"{text}\n".encode() if isinstance(text, str) else text)
    return path


def integral(mesh, measure) -> float:
    """Length, area or volume of a measure on all ranks."""
    one = dolfinx.fem.Constant(mesh.domain, 1.0)
    return COMM.allreduce(dolfinx.fem.assemble_scalar(dolfinx.fem.form(one * measure)))


def area(mesh) -> float:
    return integral(mesh, ufl.dx(domain=mesh.domain))


def length(mesh, boundary: str) -> float:
    return integral(mesh, mesh.boundary_measure(boundary, 1))


def node_count(mesh) -> int:
    return mesh.domain.geometry.index_map().size_global


def owned(mesh, indices, dim: int) -> int:
    """Number of entities in a local index array, counted once over all ranks."""
    return COMM.allreduce(int(np.sum(indices < mesh.domain.topology.index_map(dim).size_local)))


def corner_angles(mesh) -> tuple[float, float]:
    """Smallest and largest corner of the quadrilaterals, in degrees, over all ranks."""
    nodes = dolfinx.mesh.entities_to_geometry(mesh.domain, 2, mesh.owned_cells)[:, [0, 1, 3, 2]]
    corners = mesh.domain.geometry.x[nodes][:, :, :2]
    ahead, back = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    cross = ahead[..., 0] * back[..., 1] - ahead[..., 1] * back[..., 0]
    turn = np.sign(cross.sum(axis=1, keepdims=True))
    angles = np.degrees(np.arctan2(turn * cross, (ahead * back).sum(axis=2))) % 360.0
    return COMM.allreduce(angles.min(), MPI.MIN), COMM.allreduce(angles.max(), MPI.MAX)


def refusal(path: Path, **arguments) -> str:
    """The sentence of the InputError with which every rank must refuse a file."""
    with pytest.raises(InputError) as caught:
        meshing.read(path, **arguments)
    sentences = COMM.allgather(str(caught.value))
    assert len(set(sentences)) == 1, "every rank must raise the same sentence"
    assert "\n" not in sentences[0]
    assert not gmsh.isInitialized(), "gmsh must be finalized after an error"
    return sentences[0]


# --- growthx's own meshes ---


@pytest.mark.parametrize("elements", [10, 40, 100])
def test_bar_has_one_row_of_cells(elements):
    """The published tables count nel x 1 cells; a second row or a missing name would change every number."""
    bar = meshing.read(meshing.locate("bar.geo"), elements=elements)
    assert (bar.cell_name, bar.cell_count, node_count(bar)) == ("quadrilateral", elements, 2 * (elements + 1))
    assert set(bar.boundaries) == {"left", "right"} and set(bar.regions) == {"bar"}
    assert area(bar) == pytest.approx(0.01, rel=1e-12)
    assert length(bar, "left") == pytest.approx(0.01) and length(bar, "right") == pytest.approx(0.01)


def test_tapered_bar_is_half_as_wide_at_mid_length():
    """The taper is linear, its narrowest section a mesh line: else the stress at mid-length is not twice the end's."""
    bar = meshing.read(meshing.locate("bar.geo"), elements=10, taper=0.5)
    x = bar.domain.geometry.x
    widths = 0.01 * (0.5 + np.abs(x[:, 0] - 0.5))
    np.testing.assert_allclose(2.0 * np.abs(x[:, 1]), widths, rtol=1e-12)
    np.testing.assert_allclose(10.0 * x[:, 0], np.round(10.0 * x[:, 0]), atol=1e-12)
    assert COMM.allreduce(int(np.any(np.isclose(x[:, 0], 0.5)))) > 0
    assert area(bar) == pytest.approx(0.0075, rel=1e-12)


def test_bar_of_triangles():
    """The simplex variants run on the same bar, also with an odd number of elements when it is straight."""
    bar = meshing.read(meshing.locate("bar.geo"), elements=7, triangles=1)
    assert (bar.cell_name, bar.cell_count, node_count(bar)) == ("triangle", 14, 16)


@pytest.mark.parametrize("refine, cells, nodes", [(1, 658, 725), (2, 2632, 2765), (3, 5922, 6121)])
def test_femur_658_and_its_splits(refine, cells, nodes):
    """The published femur has exactly these counts; a straight split changes neither area nor boundary."""
    femur = meshing.read(meshing.locate("femur_658.msh"), refine=refine)
    assert (femur.cell_count, node_count(femur)) == (cells, nodes)
    assert set(femur.boundaries) == {"surface", "distal"} and set(femur.regions) == {"bone"}
    assert owned(femur, femur.boundary("surface"), 1) == 124 * refine
    assert owned(femur, femur.boundary("distal"), 1) == 8 * refine
    assert owned(femur, femur.region("bone"), 2) == cells
    assert area(femur) == pytest.approx(7211.305904977, rel=1e-12)
    assert length(femur, "surface") == pytest.approx(411.177757638, rel=1e-12)
    assert length(femur, "distal") == pytest.approx(30.4, rel=1e-12)


@pytest.mark.parametrize("size", [1.5, 3.5, 6.5, 8.0])
def test_femur_script_makes_decent_quadrilaterals(size):
    """Other recombination algorithms leave triangles or corners of 175 degrees, which spoil the stress there."""
    femur = meshing.read(meshing.locate("femur.geo"), size=size)
    smallest, largest = corner_angles(femur)
    assert femur.cell_name == "quadrilateral"
    assert smallest > 30.0 and largest < 168.0
    assert area(femur) == pytest.approx(7212.0, rel=5e-3)


def test_femur_script_has_the_boundary_of_the_published_mesh():
    """124 + 8 boundary segments at the default size, and names; the number of cells depends on gmsh's version."""
    femur = meshing.read(meshing.locate("femur.geo"))
    assert owned(femur, femur.boundary("surface"), 1) == 124
    assert owned(femur, femur.boundary("distal"), 1) == 8
    assert owned(femur, femur.region("bone"), 2) == femur.cell_count
    assert 640 <= femur.cell_count <= 720


def test_femur_of_triangles():
    """The simplex variants run on the femur too."""
    femur = meshing.read(meshing.locate("femur.geo"), size=6.0, triangles=1)
    assert femur.cell_name == "triangle"
    assert length(femur, "distal") == pytest.approx(30.4)


def test_control_points_of_script_and_table_agree():
    """gmsh reads no CSV, so the outline stands in two files: loads (from the table) must meet the mesh (the script)."""
    with meshing.locate("femur_outline.csv").open(newline="") as table:
        wanted = [(int(row["index"]) + 1, float(row["x_mm"]), float(row["y_mm"])) for row in csv.DictReader(table)]
    script = meshing.locate("femur.geo").read_text()
    found = re.findall(r"^Point\((\d+)\) = \{(.+?), (.+?), 0\};$", script, flags=re.MULTILINE)
    assert [(int(tag), float(x), float(y)) for tag, x, y in found] == wanted


def test_locate_finds_our_files_and_names_them():
    """Demos and scenes find the meshes wherever growthx is installed; a wrong name shows the right ones."""
    for name in ("bar.geo", "femur.geo", "femur_658.msh", "femur_outline.csv", "femur_zones.csv"):
        assert meshing.locate(name).is_file()
    with pytest.raises(InputError, match=r"no mesh file 'tibia.geo'; it has .*femur.geo"):
        meshing.locate("tibia.geo")


# --- files of the user's own ---


def test_parameters_by_the_last_part_of_their_name(folder):
    """A script may sort its parameters into folders of the gmsh window; a second read must not remember the first."""
    path = write(folder / "square.geo", NAMED)
    assert meshing.read(path, cells=3).cell_count == 9
    assert meshing.read(path).cell_count == 4


@pytest.mark.parametrize("refine", [2, 3, 4])
def test_split_triangles(folder, refine):
    """Every triangle gives K x K and no node is made twice."""
    path = write(folder / "square.geo", SQUARE + 'Physical Surface("all") = {1}; Physical Curve("low") = {1};')
    mesh = meshing.read(path, refine=refine, cells=3)
    assert (mesh.cell_count, node_count(mesh)) == (18 * refine**2, (3 * refine + 1) ** 2)
    assert area(mesh) == pytest.approx(1.0, rel=1e-12)
    assert owned(mesh, mesh.boundary("low"), 1) == 3 * refine
    assert length(mesh, "low") == pytest.approx(1.0, rel=1e-12)


def test_regions_and_boundaries_may_overlap(folder):
    """A cell or a facet may have several names, which one integer tag per cell could not hold."""
    path = write(
        folder / "overlap.geo",
        NAMED + 'Physical Surface("also") = {1}; Physical Curve("rim") = {1, 2, 3, 4};',
    )
    mesh = meshing.read(path, cells=2, refine=2)
    assert owned(mesh, mesh.region("all"), 2) == owned(mesh, mesh.region("also"), 2) == mesh.cell_count == 16
    assert length(mesh, "rim") == pytest.approx(4.0) and length(mesh, "low") == pytest.approx(1.0)


def test_index_arrays_are_local_sorted_and_int32(folder):
    """DOLFINx takes the arrays as they are: other types or orders fail late, inside PETSc."""
    mesh = meshing.read(write(folder / "square.geo", NAMED), cells=4)
    for indices in (mesh.boundary("low"), mesh.region("all")):
        assert indices.dtype == np.int32 and np.all(np.diff(indices) > 0)


@pytest.mark.parametrize("shape, cells", [("hexahedron", 24), ("tetrahedron", None)])
def test_volumes(folder, shape, cells):
    """Three-dimensional meshes take the same road, and surfaces are their boundaries."""
    layers = "Layers{3}; Recombine;" if shape == "hexahedron" else ""
    surface = "Recombine Surface {1};" if shape == "hexahedron" else ""
    script = (
        'SetFactory("OpenCASCADE"); Rectangle(1) = {0, 0, 0, 4, 2};'
        "Transfinite Curve {1, 3} = 5; Transfinite Curve {2, 4} = 3; Transfinite Surface {1};"
        f"{surface} out[] = Extrude {{0, 0, 3}} {{ Surface{{1}}; {layers} }};"
        'Physical Volume("block") = {out[1]}; Physical Surface("base") = {1}; Physical Surface("top") = {out[0]};'
    )
    path = write(folder / "block.geo", script)
    block = meshing.read(path)
    assert block.dim == 3 and block.cell_name == shape and cells in (None, block.cell_count)
    assert area(block) == pytest.approx(24.0) and set(block.regions) == {"block"}
    assert length(block, "base") == pytest.approx(8.0) and length(block, "top") == pytest.approx(8.0)
    assert "two-dimensional" in refusal(path, refine=2)


def test_clockwise_surface_is_accepted(folder):
    """Whether a user draws a surface clockwise is no concern of the integrals."""
    path = write(folder / "clockwise.geo", NAMED.replace("{1, 2, 3, 4}; Plane", "{-4, -3, -2, -1}; Plane"))
    assert area(meshing.read(path)) == pytest.approx(1.0)


def test_mesh_made_by_the_script_itself_is_kept(folder):
    """A script that meshes and then refines has said which mesh it wants."""
    path = write(folder / "refined.geo", NAMED + "Mesh 2; RefineMesh;")
    assert meshing.read(path).cell_count == 16


def test_session_of_the_user_survives(folder):
    """Someone who drives gmsh in Python keeps the model and the session after reading another file."""
    path = write(folder / "square.geo", NAMED)
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.add("mine")
        assert meshing.read(path, cells=3).cell_count == 9
        assert meshing.read(path).cell_count == 4
        assert gmsh.isInitialized() and gmsh.model.getCurrent() == "mine"
        assert gmsh.option.getNumber("General.AbortOnError") == 2
    finally:
        gmsh.finalize()


@pytest.mark.skipif(COMM.size > 1, reason="a program started inside an MPI rank hangs")
def test_gmsh_is_loaded_only_when_used_and_is_silent():
    """`import growthx` stays light, and gmsh's pages of progress stay out of the user's terminal."""
    program = (
        "import sys; from growthx import meshing; assert 'gmsh' not in sys.modules\n"
        "meshing.read(meshing.locate('femur.geo')); assert 'gmsh' in sys.modules"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    said = done.stdout + done.stderr  # MPI may have something to say too
    assert done.returncode == 0 and "Info" not in said and "Meshing" not in said, said


# --- what is refused ---

REFUSED_SCRIPTS = {
    "syntax": ("Point(1) = {0, 0, 0}\nLine(1) = {1, 2};", r"cannot make a mesh of .*line \d+: syntax error"),
    "garbage": (b"\x00\xff\x80garbage\x00", "bad.geo"),
    "empty": ("", "no physical groups"),
    "no groups": (SQUARE, "no physical groups"),
    "only curves": (SQUARE + 'Physical Curve("low") = {1};', "no cells"),
    "no elements": ('Physical Surface("all") = {1};', "bad.geo"),
    "unnamed region": (SQUARE + "Physical Surface(7) = {1};", "physical group 7 of dimension 2"),
    "unnamed boundary": (NAMED + "Physical Curve(8) = {2};", "physical group 8 of dimension 1"),
    "mixed": (
        SQUARE + "Point(5) = {2, .5, 0}; Line(5) = {2, 5}; Line(6) = {5, 3}; Curve Loop(2) = {5, 6, -2};"
        'Plane Surface(2) = {2}; Recombine Surface {1}; Physical Surface("all") = {1, 2};',
        r"4 Quadrilateral 4 and \d+ Triangle 3.*one shape",
    ),
    "second order": (NAMED + "Mesh.ElementOrder = 2;", "Quadrilateral 9.*first-order"),
    "loose curve": (
        NAMED + 'Point(8) = {5, 5, 0}; Point(9) = {6, 5, 0}; Line(9) = {8, 9}; Physical Curve("far") = {9};',
        "'far' .* is not made of sides of cells",
    ),
    "out of plane": (NAMED.replace("{1, 1, 0}", "{1, 1, 1}").replace("{0, 1, 0}", "{0, 1, 1}"), "plane z = 0"),
    "unclosed": (NAMED.replace("{1, 2, 3, 4}; Plane", "{1, 2, 3}; Plane"), "cannot make a mesh"),
    "the script's own error": (NAMED + 'Error("no such bone");', "no such bone"),
}


@pytest.mark.parametrize("case", REFUSED_SCRIPTS)
def test_refused_scripts(folder, case):
    """Whatever is wrong with a script is one sentence with its name, on all ranks, and no rank waits for ever."""
    text, sentence = REFUSED_SCRIPTS[case]
    found = refusal(write(folder / "bad.geo", text))
    assert re.search(sentence, found) and "bad.geo" in found


REFUSED_MESHES = {
    "empty": (b"", "begin with"),
    "garbage": (b"\x00\xff\x80garbage", "begin with"),
    "script": (NAMED, "begin with"),
    "cut off": (ONE_CELL[:150], "bad.msh"),
    "only the header": (b"$MeshFormat\n4.1 0 8\n$EndMeshFormat\n", "no physical groups"),
    "re-entrant": (ONE_CELL.format(corner="0.6 0.4"), "1 of the 1 cells .* inverted"),
    "flat corner": (ONE_CELL.format(corner="0.5 0.5"), "180 degrees"),
    "twisted": (ONE_CELL.format(corner="1.5 0.5"), "inverted"),
}


@pytest.mark.parametrize("case", REFUSED_MESHES)
def test_refused_meshes(folder, case):
    """The same for meshes; a twisted cell would give a negative volume and a Newton solver without a reason."""
    text, sentence = REFUSED_MESHES[case]
    found = refusal(write(folder / "bad.msh", text))
    assert re.search(sentence, found) and "bad.msh" in found


def test_boundary_without_elements_is_refused(folder):
    """A support on such a boundary would hold nothing."""
    path = folder / "bare.msh"
    if COMM.rank == 0:
        gmsh.initialize(readConfigFiles=False, interruptible=False)
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(write(folder / "square.geo", NAMED)))
        gmsh.model.mesh.generate(2)
        gmsh.model.mesh.removeElements(1, 1)
        gmsh.write(str(path))
        gmsh.finalize()
    assert "'low' of" in (found := refusal(path)) and "has no elements" in found


def test_cells_turned_over_are_refused(folder):
    """A fold: each triangle is fine alone, but two of one surface overlap."""
    nodes = "$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0.2 0.2 0\n$EndNodes\n"
    elements = "$Elements\n3\n1 2 2 1 1 1 2 3\n2 2 2 1 1 1 2 4\n3 2 2 1 1 1 3 4\n$EndElements\n"
    head = ONE_CELL.split("$Nodes")[0]
    assert "1 of the 3 cells" in refusal(write(folder / "folded.msh", head + nodes + elements))


def test_corrected_script_is_read(folder):
    """gmsh's parser can keep the rest of a refused script and prepend it to the next: a corrected file must work."""
    rest = SQUARE.replace("cells", "rows")
    assert "syntax error" in refusal(write(folder / "typo.geo", "Point(1) = {0, 0, 0}\n" + rest))
    assert meshing.read(write(folder / "square.geo", NAMED)).cell_count == 4


def test_script_without_last_line_break_is_refused(folder):
    """gmsh skips such a line without a word, and with it a boundary or the whole model."""
    path = write(folder / "cut.geo", NAMED.strip().encode())
    assert "skip the last line" in refusal(path)


def test_refused_paths(folder):
    """gmsh would make a new, empty model of a missing file."""
    assert "there is no file" in refusal(folder / "missing.geo")
    assert "neither a gmsh script" in refusal(write(folder / "mesh.vtu", "<VTKFile/>"))
    if COMM.rank == 0:
        (folder / "folder.msh").mkdir()
    assert "there is no file" in refusal(folder / "folder.msh")


@pytest.mark.parametrize(
    "arguments, sentence",
    [
        ({"sizes": 2.0}, r"no parameter 'sizes'; it has 'cells', 'shape'"),
        ({"cells": 10}, r"'cells' .* is 10: 1 to 9 would be right"),
        ({"cells": float("nan")}, r"'cells' .* is nan"),
        ({"cells": "many"}, r"'cells' .* is 'many': a number"),
        ({"shape": 2}, r"'shape' .* is 2: one of 0, 1"),
        ({"refine": 0}, r"refine is 0: a whole number"),
        ({"refine": 1.5}, r"refine is 1.5: a whole number"),
    ],
)
def test_refused_parameters(folder, arguments, sentence):
    """A misspelt or impossible parameter must not silently leave the default mesh."""
    assert re.search(sentence, refusal(write(folder / "square.geo", NAMED), **arguments))


def test_parameters_of_a_mesh_are_refused():
    """A .msh is made already: a size given with it would have no effect."""
    assert "takes no parameters ('size')" in refusal(meshing.locate("femur_658.msh"), size=2.0)


@pytest.mark.parametrize("arguments", [{"elements": 7, "taper": 0.5}, {"elements": 7.5}])
def test_bars_that_cannot_be(arguments):
    """The bar's script refuses a taper whose kink is on no mesh line, and half an element."""
    assert "would be right" in refusal(meshing.locate("bar.geo"), **arguments)
