"""The road from a gmsh file to a mesh with names: counts, shapes, names, and one sentence for every unusable file."""

import csv
import re
import struct
import subprocess
import sys
from itertools import groupby
from pathlib import Path

import dolfinx
import gmsh
import hypothesis.extra.numpy
import hypothesis.strategies as st
import numpy as np
import pytest
import ufl
from blocks import strip
from hypothesis import given, settings
from mpi4py import MPI

from growthx import meshing
from growthx.common.errors import InputError
from growthx.fem import kernels
from growthx.meshing.formats import gmsh as gmsh_format
from growthx.meshing.formats import msh
from growthx.meshing.parts import each_once

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
    return COMM.allreduce(dolfinx.fem.assemble_scalar(kernels.form(one * measure)))


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
    for name in ("bar.geo", "femur.geo", "femur_stem.geo", "femur_658.msh", "femur_outline.csv", "femur_zones.csv"):
        assert meshing.locate(name).is_file()
    with pytest.raises(InputError, match=r"no mesh file 'tibia.geo'; it has .*femur.geo"):
        meshing.locate("tibia.geo")


# --- files of the user's own ---


def test_parameters_by_the_last_part_of_their_name(folder):
    """A script may sort its parameters into folders of the gmsh window; a second read must not remember the first."""
    path = write(folder / "square.geo", NAMED)
    assert meshing.read(path, cells=3).cell_count == 9
    assert meshing.read(path).cell_count == 4


@pytest.fixture
def opened(monkeypatch):
    """How often gmsh has opened a script."""
    found = []
    once = gmsh_format._open

    def open_and_count(gmsh, path):
        found.append(path)
        once(gmsh, path)

    monkeypatch.setattr(gmsh_format, "_open", open_and_count)
    return found


# What declares the parameter, what gives it its value, and how often it must be read for that.
DECLARED = {
    "at once": ('DefineConstant[ cells = {2, Name "A/cells"} ];', {"cells": 3}, 1),
    "by its whole name": ('DefineConstant[ cells = {2, Name "A/cells"} ];', {"A/cells": 3}, 1),
    "in other words": ('DefineConstant[ cells = {2, Name StrCat("A/", "cells")} ];', {"cells": 3}, 2),
    "where another is set": (
        'DefineConstant[ own = {0, Name "own"} ];\n'
        'cells = 2;\nIf(own)\nDefineConstant[ more = {2, Name "cells"} ];\ncells = more;\nEndIf',
        {"own": 1, "cells": 3},
        1,
    ),
    # Nothing of gmsh's tells that the script has taken a 0 without limits.
    "as 0": ('DefineConstant[ cells = {3, Name "cells"}, shift = {1, Name "shift"} ];', {"shift": 0}, 3),
}


@pytest.mark.parametrize("way", DECLARED)
def test_a_script_is_read_once(folder, opened, way):
    """Large scripts take long; what the text does not tell is found by reading it first, as ever."""
    text, parameters, times = DECLARED[way]
    path = write(folder / "square.geo", NAMED.replace(NAMED.splitlines()[1], text))
    assert meshing.read(path, **parameters).cell_count == 9
    assert len(opened) == (times if COMM.rank == 0 else 0)


def test_a_parameter_that_a_script_does_not_come_to(folder):
    """It is in the text, where no value leads to it: to take it would leave the default mesh without a word."""
    never = 'If(0)\nDefineConstant[ other = {1, Name "other"} ];\nEndIf\n'
    path = write(folder / "square.geo", NAMED + never)
    assert "has no parameter 'other'; it has" in refusal(path, other=3)


def test_surfaces_that_gmsh_meshes_with_cells_of_its_own_are_told(folder, monkeypatch, caplog):
    """It makes the cells smaller until it finds a mesh, five times as many for one, and says nothing aloud."""
    path = write(folder / "square.geo", NAMED)
    if COMM.rank == 0:
        lines = ["Info: Serializing surface 3 and refining all its bounding edges"] * 2
        known = gmsh.logger.get
        monkeypatch.setattr(gmsh.logger, "get", lambda: [*known(), *lines])
    assert meshing.read(path).cell_count == 4
    told = [record.getMessage() for record in caplog.records if "smaller until it did" in record.getMessage()]
    assert len(told) == (1 if COMM.rank == 0 else 0) and all(f"of surface 3 of {path}" in each for each in told)


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


def test_groups_without_names_have_their_numbers(folder):
    """As converters leave them; without any group, all cells are a region."""
    mesh = meshing.read(write(folder / "square.geo", SQUARE + "Physical Surface(7) = {1}; Physical Curve(8) = {2};"))
    assert set(mesh.regions) == {"7"} and set(mesh.boundaries) == {"8"} and length(mesh, "8") == pytest.approx(1.0)
    assert set(meshing.read(write(folder / "square.geo", SQUARE)).regions) == {"all"}


def test_of_elements_of_second_order_the_corners_are_kept(folder):
    """gmsh makes them where a script says so."""
    mesh = meshing.read(write(folder / "square.geo", NAMED + "Mesh.ElementOrder = 2;"))
    assert (mesh.cell_count, node_count(mesh)) == (4, 9) and length(mesh, "low") == pytest.approx(1.0)


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


# --- groups of .msh files in which each element names its own ---

STRIP = """$Nodes
6
1 0 0 0
2 1 0 0
3 2 0 0
4 0 1 0
5 1 1 0
6 2 1 0
$EndNodes
"""
NAMES = {(1, 3): "left", (1, 4): "right", (2, 1): "bone", (2, 2): "head"}
LINE, QUAD, TRIANGLE, TET = 1, 3, 2, 4
LEFT, RIGHT, FIRST, SECOND = (LINE, 1, 4), (LINE, 3, 6), (QUAD, 1, 2, 5, 4), (QUAD, 2, 3, 6, 5)
# What stands in the file, element by element: group, elementary tag, type and nodes; and cells of "bone" and of "head".
SHARED = {
    "one entity": ([(3, 0, LEFT), (4, 0, RIGHT), (1, 0, FIRST), (2, 0, SECOND)], 1, 1),
    "each its own": ([(3, 1, LEFT), (4, 2, RIGHT), (1, 1, FIRST), (2, 2, SECOND)], 1, 1),
    "overlap": ([(3, 1, LEFT), (4, 2, RIGHT), (1, 1, FIRST), (2, 1, FIRST), (1, 2, SECOND)], 2, 1),
    "overlap in one entity": ([(3, 0, LEFT), (4, 0, RIGHT), (1, 0, FIRST), (2, 0, FIRST), (1, 0, SECOND)], 2, 1),
    "turned over": ([(3, 1, LEFT), (4, 1, RIGHT), (1, 1, FIRST), (2, 1, (QUAD, 4, 5, 2, 1)), (1, 1, SECOND)], 2, 1),
    "negative": ([(3, 1, LEFT), (4, 1, RIGHT), (1, 1, FIRST), (-2, 1, (QUAD, 1, 4, 5, 2)), (1, 1, SECOND)], 2, 1),
    "twice in a group": (
        [(3, 1, LEFT), (4, 1, RIGHT), (4, 1, RIGHT), (1, 1, FIRST), (1, 1, FIRST), (2, 1, SECOND)],
        1,
        1,
    ),
    "the same twice": ([(3, 0, LEFT), (4, 0, RIGHT), *[(i, 0, c) for c in (FIRST, SECOND) for i in (1, 2)]], 2, 2),
    "sides overlap": ([(3, 0, LEFT), (4, 0, RIGHT), (4, 0, LEFT), (1, 0, FIRST), (2, 0, SECOND)], 1, 1),
    "one side in none": ([(3, 0, LEFT), (4, 0, RIGHT), (0, 0, (LINE, 2, 5)), (1, 0, FIRST), (2, 0, SECOND)], 1, 1),
}


def names_section(names=NAMES):
    rows = "".join(f'{dim} {tag} "{name}"\n' for (dim, tag), name in names.items())
    return f"$PhysicalNames\n{len(names)}\n{rows}$EndPhysicalNames\n"


def text_mesh(elements, version="2.2", names=NAMES, nodes=STRIP, further=""):
    """further: tags of each element after the first two."""
    count = 2 + len(further.split())
    rows = [
        f"{i} {kind} {count} {group} {entity} {further} {' '.join(map(str, corners))}\n"
        for i, (group, entity, (kind, *corners)) in enumerate(elements, start=1)
    ]
    head = f"$MeshFormat\n{version} 0 8\n$EndMeshFormat\n{names_section(names)}{nodes}"
    return f"{head}$Elements\n{len(rows)}\n{''.join(rows)}$EndElements\n".encode()


def binary_mesh(elements, order="<", names=NAMES, nodes=STRIP, together=True):
    """order: of bytes.  together: whether neighbours of one type share a block, as some programs write them."""
    points = [line.split() for line in nodes.splitlines()[2:-1]]
    of_points = b"".join(struct.pack(f"{order}i3d", int(i), *map(float, x)) for i, *x in points)
    blocks = [
        list(rows)
        for _, rows in groupby(enumerate(elements, start=1), lambda each: (each[1][2][0], together or each[0]))
    ]
    of_blocks = b"".join(
        struct.pack(f"{order}3i", rows[0][1][2][0], len(rows), 2)
        + b"".join(
            struct.pack(f"{order}{2 + len(corners)}i", i, group, entity, *corners[1:])
            for i, (group, entity, corners) in rows
        )
        for rows in blocks
    )
    return (
        b"$MeshFormat\n2.2 1 8\n" + struct.pack(f"{order}i", 1) + b"\n$EndMeshFormat\n" + names_section(names).encode()
        + b"$Nodes\n%d\n" % len(points) + of_points + b"\n$EndNodes\n"
        + b"$Elements\n%d\n" % len(elements) + of_blocks + b"\n$EndElements\n"
    )  # fmt: skip


FORMS = {
    "text": text_mesh,
    "2.1": lambda elements, **more: text_mesh(elements, version="2.1", **more),
    "partitioned": lambda elements, **more: text_mesh(elements, further="2 1 -2", **more),
    "Windows": lambda elements, **more: text_mesh(elements, **more).replace(b"\n", b"\r\n"),
    "binary": binary_mesh,
    "binary, one by one": lambda elements, **more: binary_mesh(elements, together=False, **more),
    "binary, bytes swapped": lambda elements, **more: binary_mesh(elements, order=">", **more),
}


PAIRS = [(case, form) for case in SHARED for form in ("text", "binary")]
PAIRS += [("overlap in one entity", form) for form in FORMS if form not in ("text", "binary")]


@pytest.mark.parametrize(("case", "form"), PAIRS)
def test_each_element_has_its_own_groups_and_is_there_once(folder, case, form):
    """gmsh keeps groups of whole entities: cells that share one had each other's, and those of two groups were two."""
    elements, bone, head = SHARED[case]
    mesh = meshing.read(write(folder / "strip.msh", FORMS[form](elements)))
    assert (mesh.cell_count, node_count(mesh)) == (2, 6) and area(mesh) == pytest.approx(2.0)
    assert owned(mesh, mesh.region("bone"), 2) == bone and owned(mesh, mesh.region("head"), 2) == head
    assert owned(mesh, mesh.boundary("left"), 1) == 1
    assert length(mesh, "right") == pytest.approx(sum(group == 4 for group, _, _ in set(elements)))


@pytest.mark.parametrize("case", ["one entity", "each its own"])
def test_a_strip_of_two_materials_is_as_long_as_it_should_be(folder, case):
    """Whether its squares are of one entity or each of its own."""
    mesh = meshing.read(write(folder / "strip.msh", text_mesh(SHARED[case][0])))
    assert strip(mesh, "bone", "head") == pytest.approx((0.1150376, -0.1), abs=1e-7)


def test_cells_of_no_group_are_a_region_of_their_own(folder):
    """Also where they share the entity of others, whose groups they had."""
    elements = [(3, 0, LEFT), (1, 0, FIRST), (0, 0, SECOND)]
    names = {key: NAMES[key] for key in [(1, 3), (2, 1)]}
    mesh = meshing.read(write(folder / "half.msh", text_mesh(elements, names=names)))
    assert mesh.cell_count == 2 and area(mesh) == pytest.approx(2.0)
    assert owned(mesh, mesh.region("bone"), 2) == owned(mesh, mesh.region("all"), 2) == 1


def test_split_of_cells_in_several_groups(folder):
    """Each piece has the groups of the cell it is of."""
    mesh = meshing.read(write(folder / "strip.msh", text_mesh(SHARED["overlap in one entity"][0])), refine=3)
    assert (mesh.cell_count, owned(mesh, mesh.region("bone"), 2), owned(mesh, mesh.region("head"), 2)) == (18, 18, 9)


def test_twisted_repetitions_are_refused(folder):
    """Of two cells on the same corners one may be twisted: which of them is meant is not for us to say."""
    elements = [(1, 0, FIRST), (2, 0, (QUAD, 1, 5, 2, 4)), (1, 0, SECOND)]
    names = {key: NAMES[key] for key in [(2, 1), (2, 2)]}
    assert "1 of the 1 cells" in refusal(write(folder / "twisted.msh", text_mesh(elements, names=names)))


TETRAHEDRA = "$Nodes\n5\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n5 1 1 1\n$EndNodes\n"


@pytest.mark.parametrize("form", [text_mesh, binary_mesh])
def test_groups_of_elements_in_space(folder, form):
    """Volumes and surfaces as cells and lines in the plane."""
    inner, outer = (TET, 1, 2, 3, 4), (TET, 2, 3, 4, 5)
    elements = [(5, 0, (TRIANGLE, 1, 2, 3)), (6, 0, (TRIANGLE, 2, 3, 4)), (6, 0, (TRIANGLE, 3, 2, 1))]
    elements += [(1, 0, inner), (2, 0, outer), (2, 0, (TET, 2, 1, 3, 4))]
    names = {(2, 5): "base", (2, 6): "both", (3, 1): "bone", (3, 2): "all"}
    mesh = meshing.read(write(folder / "two.msh", form(elements, names=names, nodes=TETRAHEDRA)))
    assert mesh.cell_count == 2 and area(mesh) == pytest.approx(0.5)
    assert owned(mesh, mesh.region("bone"), 3) == 1 and owned(mesh, mesh.region("all"), 3) == 2
    assert length(mesh, "base") == pytest.approx(0.5)
    assert length(mesh, "both") == pytest.approx(0.5 + np.sqrt(3) / 2)


OVERLAP = SQUARE + (
    'Physical Surface("all") = {1}; Physical Surface("also") = {-1}; Physical Curve("low") = {1};'
    'Physical Curve("rim") = {1, -2, 3, 4};\n'
)


@pytest.mark.parametrize("version", [2.2, 4.1])
@pytest.mark.parametrize("binary", [0, 1])
@pytest.mark.parametrize("parts", [1, 2])
def test_overlapping_groups_as_gmsh_saves_them(folder, version, binary, parts):
    """In its older format a cell stands there once for each group, turned over where a group has it so."""
    path = folder / "saved.msh"
    script = write(folder / "overlap.geo", OVERLAP)
    if COMM.rank == 0:
        gmsh.initialize(readConfigFiles=False, interruptible=False)
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(script))
        gmsh.model.mesh.generate(2)
        if parts > 1:
            gmsh.model.mesh.partition(parts)
        gmsh.option.setNumber("Mesh.MshFileVersion", version)
        gmsh.option.setNumber("Mesh.Binary", binary)
        gmsh.write(str(path))
        gmsh.finalize()
    mesh = meshing.read(path)
    assert (mesh.cell_count, mesh.cell_name) == (8, "triangle") and area(mesh) == pytest.approx(1.0)
    assert owned(mesh, mesh.region("all"), 2) == owned(mesh, mesh.region("also"), 2) == 8
    assert length(mesh, "low") == pytest.approx(1.0) and length(mesh, "rim") == pytest.approx(4.0)


def test_a_cell_in_two_entities_is_there_once(folder):
    """Newer files have groups of entities: programs that know sets of cells write one for each, and cells twice."""
    head = '$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n2 1 "bone"\n2 2 "head"\n$EndPhysicalNames\n'
    entities = "$Entities\n0 0 2 0\n1 0 0 0 2 1 0 1 1 0\n2 0 0 0 1 1 0 1 2 0\n$EndEntities\n"
    points = [line.split(maxsplit=1) for line in STRIP.splitlines()[2:-1]]
    tags, places = ("\n".join(each) for each in zip(*points, strict=True))
    nodes = f"$Nodes\n1 6 1 6\n2 1 0 6\n{tags}\n{places}\n$EndNodes\n"
    elements = "$Elements\n2 3 1 3\n2 1 3 2\n1 1 2 5 4\n2 2 3 6 5\n2 2 3 1\n3 1 2 5 4\n$EndElements\n"
    mesh = meshing.read(write(folder / "sets.msh", head + entities + nodes + elements))
    assert mesh.cell_count == 2 and area(mesh) == pytest.approx(2.0)
    assert owned(mesh, mesh.region("bone"), 2) == 2 and owned(mesh, mesh.region("head"), 2) == 1


@pytest.mark.parametrize("case", ["one entity", "overlap in one entity"])
def test_a_script_that_merges_a_mesh_whose_groups_gmsh_mixes_up_is_refused(folder, case):
    """There gmsh alone reads the elements."""
    write(folder / "strip.msh", text_mesh(SHARED[case][0]))
    assert "strip.msh, in which elements of one" in refusal(write(folder / "merge.geo", 'Merge "strip.msh";\n'))


def test_a_script_may_merge_a_mesh_whose_entities_have_the_groups(folder):
    """Nor does a comment, or the text of a message, merge anything."""
    write(folder / "mixed.msh", text_mesh(SHARED["one entity"][0]))
    other = '// Merge "mixed.msh";\nPrintf("Merge mixed.msh");\n'
    whole = [*SHARED["each its own"][0], (1, 2, SECOND)]
    write(folder / "whole.msh", text_mesh(whole))
    mesh = meshing.read(write(folder / "merge.geo", f'{other}Merge "whole.msh";\n'))
    assert owned(mesh, mesh.region("bone"), 2) == 2 and owned(mesh, mesh.region("head"), 2) == 1


@pytest.mark.skipif(COMM.size > 1, reason="the reading is of one rank")
def test_first_version_of_the_format_is_read(tmp_path):
    """It has no names; its elements state the number of their nodes."""
    nodes = STRIP.replace("Nodes", "NOD").replace("End", "END")
    rows = "1 1 3 7 2 1 4\n2 3 1 7 4 1 2 5 4\n3 3 2 8 4 2 3 6 5\n"
    path = write(tmp_path / "first.msh", f"{nodes}$ELM\n3\n{rows}$ENDELM\n")
    content = msh.read(path, {})
    lines, cells = content.elements
    assert (lines.shape, lines.nodes.tolist(), content.groups["3"].tolist()) == ("interval", [[0, 3]], [0])
    assert cells.nodes.tolist() == [[0, 1, 4, 3], [1, 2, 5, 4]]
    assert (content.groups["1"].tolist(), content.groups["2"].tolist()) == ([1], [2])
    assert meshing.read(path).cell_count == 2


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ((b"$Elements\n4", b"$Elements\n5"), "has not the 5 elements"),
        ((b"3 2 1 0", b"3 2 1.5 0"), "not all made of whole numbers"),
        ((b"4 3 2", b"4 199 2"), "has not the 4 elements"),
        ((b"4 3 2", b"4 3 -2"), "has not the 4 elements"),
    ],
)
def test_elements_that_are_not_whole_are_refused(folder, change, sentence):
    """Each is one sentence, whoever sees it first."""
    content = text_mesh(SHARED["one entity"][0])
    assert change[0] in content
    assert re.search(sentence, refusal(write(folder / "cut.msh", content.replace(*change))))


@pytest.mark.skipif(COMM.size > 1, reason="the reading is of one rank")
def test_many_elements_of_alternating_kinds(tmp_path):
    """Records of two lengths by turns: where each begins is known only from those before it."""
    rows = np.arange(20_000)
    nodes = "".join(f"{i} {i} 0 0\n" for i in range(20_003))
    pairs = "".join(
        f"{2 * i + 1} 2 2 1 0 {i} {i + 1} {i + 2}\n{2 * i + 2} 3 3 2 0 9 {i} {i + 1} {i + 2} {i + 3}\n" for i in rows
    )
    head = f"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n20003\n{nodes}$EndNodes\n"
    path = write(tmp_path / "long.msh", f"{head}$Elements\n40000\n{pairs}$EndElements")
    content = msh.read(path, {})
    first, second = content.elements
    assert np.array_equal(first.nodes, rows[:, None] + [0, 1, 2])
    assert np.array_equal(second.nodes, rows[:, None] + [0, 1, 2, 3])
    assert np.array_equal(content.groups["2"], 20_000 + rows) and set(content.groups) == {"1", "2"}


@settings(max_examples=50, deadline=None)
@given(
    hypothesis.extra.numpy.arrays(
        np.int64, st.tuples(st.integers(1, 30), st.integers(2, 4)), elements=st.integers(0, 3)
    )
)
def test_each_once(nodes):
    """Against Python's own sets, for rows that agree in any order."""
    kept, place = each_once(nodes)
    keys = [tuple(sorted(row)) for row in nodes.tolist()]
    first = list(dict.fromkeys(keys))
    assert [keys[row] for row in kept] == first and np.all(np.diff(kept) > 0)
    assert [keys[kept[at]] for at in place] == keys


# --- what is refused ---

REFUSED_SCRIPTS = {
    "syntax": ("Point(1) = {0, 0, 0}\nLine(1) = {1, 2};", r"cannot make a mesh of .*line \d+: syntax error"),
    "garbage": (b"\x00\xff\x80garbage\x00", "bad.geo"),
    "empty": ("", "no physical groups"),
    "only curves": (SQUARE + 'Physical Curve("low") = {1};', "no cells"),
    "no elements": ('Physical Surface("all") = {1};', "bad.geo"),
    "mixed": (
        SQUARE + "Point(5) = {2, .5, 0}; Line(5) = {2, 5}; Line(6) = {5, 3}; Curve Loop(2) = {5, 6, -2};"
        'Plane Surface(2) = {2}; Recombine Surface {1}; Physical Surface("all") = {1, 2};',
        r"4 quadrilaterals and \d+ triangles: cells of one shape",
    ),
    "loose curve": (
        NAMED + 'Point(8) = {5, 5, 0}; Point(9) = {6, 5, 0}; Line(9) = {8, 9}; Physical Curve("far") = {9};',
        "'far' .* is not made of sides of cells",
    ),
    "out of plane": (NAMED.replace("{1, 1, 0}", "{1, 1, 1}").replace("{0, 1, 0}", "{0, 1, 1}"), "every plane of two"),
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
    "only the header": (b"$MeshFormat\n4.1 0 8\n$EndMeshFormat\n", "no elements at all"),
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
    assert "3 of the 3 cells" in refusal(write(folder / "folded.msh", head + nodes + elements))


@pytest.mark.parametrize("second", ["1 3 4", "1 4 3"])
def test_triangles_numbered_in_either_sense_are_read(folder, second):
    """Programs that know no sense of a simplex write them as they come."""
    nodes = "$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 1 1 0\n4 0 1 0\n$EndNodes\n"
    elements = f"$Elements\n2\n1 2 2 1 1 1 2 3\n2 2 2 1 1 {second}\n$EndElements\n"
    head = ONE_CELL.split("$Nodes")[0]
    assert area(meshing.read(write(folder / "turned.msh", head + nodes + elements))) == pytest.approx(1.0)


@pytest.mark.parametrize("numbering", ["1 2 3 5", "2 1 3 5"])
def test_tetrahedra_on_one_side_of_a_facet_are_refused(folder, numbering):
    """Turned over they overlap, on the other side they are only numbered otherwise."""
    fourth = "0.2 0.2 0.2" if numbering.startswith("2") else "0 0 -1"
    nodes = f"$Nodes\n5\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n5 {fourth}\n$EndNodes\n"
    elements = f"$Elements\n2\n1 4 2 1 1 1 2 3 4\n2 4 2 1 1 {numbering}\n$EndElements\n"
    path = write(folder / "pair.msh", f"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n{nodes}{elements}")
    if numbering.startswith("2"):
        assert "of the 2 cells" in refusal(path)
    else:
        assert area(meshing.read(path)) == pytest.approx(1 / 3)


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
    assert "neither a gmsh script" in refusal(write(folder / "mesh.txt", "<VTKFile/>"))
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


LIMITS = """Include "more.geo";
few = 2;
DefineConstant[
  free = {20, Name "free"}, least = {20, Min 10, Name "least"}, most = {20, Max 30, Name "most"},
  like = {20, Min 4, Max 100, Name "like"},
  range = {5, Range {2 * few, 5 * few}, Name "range"}, zero = {0, Name "zero"},
  below = {-3, Name "below"}, part = {0.5, Name "part"}, pick = {1, Choices {0, 1, 9}, Name "pick"},
  steps = {4, Step 2, Name "steps"}, both = {2, Max 2 * zero + 3, Name "both"}, fixed = {7, ReadOnly 1, Name "fixed"},
  one = {1, Name "A/same"}, two = {1, Name "B/same"}
];
"""
ALLOWED = [
    {"free": 3, "least": 1e6, "most": -1e6, "like": 4, "range": 4, "zero": -7, "below": 5, "part": 0.001, "pick": 9},
    {"free": 101, "range": 10, "zero": 7, "both": 17, "below": -100, "part": -1, "steps": 1, "more": 3, "A/same": 70},
    {"free": -1, "zero": 3, "both": 9, "below": 0, "part": 1000, "steps": 99, "more": 1000},
    {"free": 1 / 3},
]
FORBIDDEN = [
    ({"least": 9}, "'least' .* is 9: at least 10 would be right"),
    ({"most": 31}, "'most' .* is 31: at most 30 would be right"),
    ({"like": 3}, "'like' .* is 3: 4 to 100 would be right"),
    ({"like": 101}, "'like' .* is 101: 4 to 100 would be right"),
    ({"range": 3}, "'range' .* is 3: 4 to 10 would be right"),
    ({"range": 11}, "'range' .* is 11: 4 to 10 would be right"),
    ({"pick": 2}, "'pick' .* is 2: one of 0, 1, 9 would be right"),
    ({"both": 4}, "'both' .* is 4: at most 3 would be right"),
    ({"both": 3, "zero": -1}, "'both' .* is 3: at most 1 would be right"),
    ({"limited": 6}, "'limited' .* is 6: 1 to 5 would be right"),
    ({"fixed": 8}, "'fixed' .* cannot be 8: the script has it read only"),
    ({"same": 3}, "has 2 parameters 'same': 'A/same', 'B/same', whole, would be right"),
    ({"free": float("inf")}, "'free' .* is inf: a number"),
]


def limited(folder):
    """A script with parameters of all kinds, in two files."""
    more = 'DefineConstant[ more = {20, Name "more"}, limited = {2, Min 1, Max 5, Name "limited"} ];'
    write(folder / "more.geo", more)
    return write(folder / "limits.geo", LIMITS + NAMED)


@pytest.mark.parametrize("parameters", ALLOWED, ids=range(len(ALLOWED)))
def test_only_limits_that_a_script_states_count(folder, parameters):
    """gmsh makes up a range, a fifth to five times the value, for its window: nobody has said that it is one."""
    assert meshing.read(limited(folder), **parameters).cell_count == 4


@pytest.mark.parametrize(("parameters", "sentence"), FORBIDDEN)
def test_limits_that_a_script_states_are_kept(folder, parameters, sentence):
    """Also those of expressions, from a file that it includes, or equal to what gmsh would have made up."""
    assert re.search(sentence, refusal(limited(folder), **parameters))


def test_a_value_without_limits_has_its_effect(folder):
    """The second reading of the script is with the value, not with what it was first."""
    script = NAMED.replace("cells = {2, Min 1, Max 9,", "cells = {20,")
    assert meshing.read(write(folder / "square.geo", script), cells=3).cell_count == 9


def test_parameters_of_a_mesh_are_refused():
    """A .msh is made already: a size given with it would have no effect."""
    assert "takes no parameters ('size')" in refusal(meshing.locate("femur_658.msh"), size=2.0)


@pytest.mark.parametrize("arguments", [{"elements": 7, "taper": 0.5}, {"elements": 7.5}])
def test_bars_that_cannot_be(arguments):
    """The bar's script refuses a taper whose kink is on no mesh line, and half an element."""
    assert "would be right" in refusal(meshing.locate("bar.geo"), **arguments)
