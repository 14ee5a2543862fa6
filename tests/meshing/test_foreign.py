"""Meshes of other programs: what meshio and VTK write in all their ways is the same mesh as the one in memory."""

import locale

import meshio
import numpy as np
import pytest
from blocks import COMM, boundary_size, file_refusal, region_size, strip

import growthx as gx
from growthx import meshing
from growthx.common.errors import InputError
from growthx.meshing.formats.apart import process

POINTS = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0], [1, 1, 0], [2, 1, 0.0]])
QUADS, LINES = np.array([[0, 1, 4, 3], [1, 2, 5, 4]]), np.array([[0, 3], [2, 5]])
CUBE = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], dtype=float)
TETRAHEDRA = np.array([[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]])
FACES = np.array([[0, 1, 3], [0, 3, 2], [4, 5, 7], [4, 7, 6]])
PLANE = meshio.Mesh(
    POINTS,
    [("quad", QUADS), ("line", LINES)],
    cell_data={"MaterialIds": [np.array([1, 2]), np.array([3, 4])], "rho": [np.array([0.1, 0.2]), np.zeros(2)]},
)
SPACE = meshio.Mesh(
    CUBE,
    [("tetra", TETRAHEDRA), ("triangle", FACES)],
    cell_data={"region": [np.array([1, 1, 1, 2, 2, 2]), np.array([5, 5, 6, 6])], "E": [np.arange(6.0), np.zeros(4)]},
)
WAYS = [
    ("mesh.vtu", {}),
    ("mesh.vtu", {"binary": False}),
    ("mesh.vtu", {"compression": "lzma"}),
    ("mesh.vtu", {"compression": None}),
    ("mesh.vtk", {}),
    ("mesh.vtk", {"binary": False}),
    ("mesh.xdmf", {}),
    ("mesh.xdmf", {"data_format": "XML"}),
    ("mesh.med", {}),
]


def put(folder, name, mesh, **options):
    if COMM.rank == 0:
        mesh.write(folder / name, **options)
    COMM.barrier()
    return folder / name


def text(folder, name, content):
    if COMM.rank == 0:
        (folder / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    COMM.barrier()
    return folder / name


def sizes(mesh):
    return (
        {name: region_size(mesh, name) for name in mesh.regions},
        {name: boundary_size(mesh, name) for name in mesh.boundaries},
    )


@pytest.mark.parametrize(("name", "options"), WAYS, ids=lambda value: str(value))
def test_a_strip_in_all_formats(shared_folder, name, options):
    """Groups by whole numbers, values in the order of the file, and the length under load."""
    mesh = meshing.read(put(shared_folder, name, PLANE, **options))
    regions, boundaries = sizes(mesh)
    assert regions == pytest.approx({"1": 1, "2": 1}, rel=1e-12)
    assert boundaries == pytest.approx({"3": 1, "4": 1}, rel=1e-12)
    field = mesh.cell_values("rho")
    low = mesh.region("1")
    assert np.all(field.x.array[low] == 0.1) and sorted(set(COMM.allreduce(field.x.array.tolist()))) == [0.1, 0.2]
    ends = {"left": mesh.boundary("3"), "right": mesh.boundary("4")}
    assert strip(gx.Mesh(mesh.domain, ends, mesh.regions), "1", "2") == pytest.approx((0.1150376, -0.1), abs=1e-7)


@pytest.mark.parametrize(("name", "options"), WAYS[:1] + WAYS[4:5] + WAYS[6:], ids=lambda value: str(value))
def test_a_cube_in_all_formats(shared_folder, name, options):
    """Tetrahedra with triangles as boundaries, in space."""
    mesh = meshing.read(put(shared_folder, name, SPACE, **options))
    regions, boundaries = sizes(mesh)
    assert regions == pytest.approx({"1": 0.5, "2": 0.5}, rel=1e-12)
    assert boundaries == pytest.approx({"5": 1, "6": 1}, rel=1e-12)
    assert list(mesh.origin.values) and mesh.cell_count == 6


@pytest.mark.parametrize("name", ["mesh.mesh", "mesh.bdf"])
def test_formats_that_keep_less(shared_folder, name):
    """Medit has one number for each element, and Nastran the shapes: what is there is read."""
    mesh = meshing.read(put(shared_folder, name, SPACE))
    assert mesh.cell_count == 6 and sum(sizes(mesh)[0].values()) == pytest.approx(1, rel=1e-12)
    if name == "mesh.mesh":
        assert sizes(mesh)[1] == pytest.approx({"5": 1, "6": 1}, rel=1e-12)


BULK = (
    "GRID,1,,0.,0.,0.\nGRID,2,,1.,0.,0.\nGRID,3,,2.,0.,0.\nGRID,4,,0.,1.,0.\nGRID,5,,1.,1.,0.\nGRID,6,,2.,1.,0.\n"
    "CQUAD4,1,1,1,2,5,4\nCQUAD4,2,2,2,3,6,5\nCBAR,3,3,1,4\nCBAR,4,4,3,6\nENDDATA\n"
)


@pytest.mark.parametrize("head", ["$ a comment\nCEND\nBEGIN BULK\n", "$ made without an executive part\n", ""])
@pytest.mark.parametrize("name", ["strip.bdf", "STRIP.NAS"])
def test_properties_of_nastran_are_groups(shared_folder, head, name):
    """By their numbers, whether the file says where its bulk begins or not, as gmsh's do."""
    mesh = meshing.read(text(shared_folder, name, head + BULK))
    ends = {"left": mesh.boundary("3"), "right": mesh.boundary("4")}
    assert strip(gx.Mesh(mesh.domain, ends, mesh.regions), "1", "2") == pytest.approx((0.1150376, -0.1), abs=1e-7)


@pytest.mark.parametrize("ending", [".vtu", ".vtk"])
@pytest.mark.parametrize("binary", [True, False])
def test_what_pyvista_saves(shared_folder, ending, binary):
    """VTK's own writers: appended, compressed, with offsets."""
    if COMM.rank == 0:
        import pyvista

        grid = pyvista.UnstructuredGrid({pyvista.CellType.TETRA: TETRAHEDRA}, CUBE)
        grid.cell_data["E"] = np.arange(6.0)
        grid.cell_data["RegionId"] = [1, 1, 1, 2, 2, 2]
        before = locale.setlocale(locale.LC_ALL)
        grid.save(shared_folder / f"mesh{ending}", binary=binary)
        locale.setlocale(locale.LC_ALL, before)  # VTK's writers in text leave another one
    COMM.barrier()
    mesh = meshing.read(shared_folder / f"mesh{ending}")
    assert sizes(mesh)[0] == pytest.approx({"1": 0.5, "2": 0.5}, rel=1e-12)
    found = COMM.allreduce(sorted(mesh.cell_values("E").x.array[mesh.owned_cells].tolist()))
    assert sorted(found) == list(range(6))


def test_voxels_are_hexahedra(shared_folder):
    """VTK numbers them row by row."""
    if COMM.rank == 0:
        import pyvista

        pyvista.ImageData(dimensions=(3, 3, 2)).cast_to_unstructured_grid().save(shared_folder / "mesh.vtu")
    COMM.barrier()
    mesh = meshing.read(shared_folder / "mesh.vtu")
    assert (mesh.cell_name, mesh.cell_count) == ("hexahedron", 4)
    assert sizes(mesh)[0] == pytest.approx({"all": 4}, rel=1e-12)


def test_groups_of_salome_have_their_names(shared_folder):
    """Families of cells with several groups each, and groups of nodes."""
    mesh = meshio.Mesh(POINTS, [("quad", QUADS)], cell_data={"cell_tags": [np.array([-6, -7])]})
    mesh.point_data["point_tags"] = np.array([2, 0, 0, 2, 0, 0])
    mesh.cell_tags, mesh.point_tags = {-6: ["soft", "bone"], -7: ["bone", "stiff"]}, {2: ["left"]}
    mesh = meshing.read(put(shared_folder, "mesh.med", mesh))
    regions, boundaries = sizes(mesh)
    assert regions == pytest.approx({"soft": 1, "stiff": 1, "bone": 2}) and boundaries == pytest.approx({"left": 1})


def test_elements_of_second_order_and_other_cells(shared_folder, caplog):
    """Corners are kept; prisms, pyramids and polygons are refused by their names."""
    six = np.vstack([POINTS[[0, 1, 3]], [[0.5, 0, 0], [0.5, 0.5, 0], [0, 0.5, 0]]])
    mesh = meshing.read(put(shared_folder, "curved.vtu", meshio.Mesh(six, [("triangle6", [[0, 1, 2, 3, 4, 5]])])))
    assert sizes(mesh)[0] == pytest.approx({"all": 0.5})
    assert COMM.rank or "sides are straight" in caplog.text
    prism = meshio.Mesh(CUBE[:6], [("wedge", [[0, 1, 2, 4, 5, 3]])])
    assert "has 1 prism: cells all tetrahedra" in file_refusal(put(shared_folder, "prism.vtu", prism))


LEGACY = "# vtk DataFile Version 2.0\nx\nASCII\nDATASET UNSTRUCTURED_GRID\n"
LAUGHS = (
    '<?xml version="1.0"?><!DOCTYPE l [<!ENTITY a "ha"><!ENTITY b "&a;&a;">]>'
    '<VTKFile type="UnstructuredGrid">&b;</VTKFile>'
)


@pytest.mark.parametrize(
    ("name", "content", "sentence"),
    [
        ("a.vtu", "", "is no unstructured grid of VTK"),
        ("a.vtu", LAUGHS, "has entities of XML"),
        ("a.xdmf", LAUGHS.replace("VTKFile", "Xdmf"), "has entities of XML"),
        ("a.vtk", f"{LEGACY}POINTS 1000000000000 float\n0 0", ""),
        ("a.vtk", f"{LEGACY}POINTS 1 float\n0 0 0\nCELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\n", ""),
        ("a.med", b"\x89HDF\r\n\x1a\n" + bytes(200), "cannot be read by meshio"),
        ("a.bdf", "GRID,1,,nan,0.,0.\n", ""),
        ("a.mesh", "MeshVersionFormatted 2\nDimension 3\nVertices\n99999999999\n0 0 0 1\n", ""),
    ],
)
def test_damaged_and_hostile_files_are_refused(shared_folder, name, content, sentence):
    """In a sentence: nothing is filled, opened or left hanging."""
    assert sentence in file_refusal(text(shared_folder, name, content))


@pytest.mark.parametrize(("name", "options"), [WAYS[0], WAYS[5], WAYS[8]], ids=lambda value: str(value))
@pytest.mark.parametrize("share", [0.2, 0.6, 0.97])
def test_files_that_broke_off_are_refused_or_read(shared_folder, name, options, share):
    """A download that ended: never a traceback."""
    path = put(shared_folder, name, SPACE, **options)
    content = path.read_bytes()
    COMM.barrier()
    path = text(shared_folder, name, content[: int(share * len(content))])
    try:
        assert meshing.read(path).cell_count <= 6
    except InputError as error:
        assert "\n" not in str(error)


def test_parameters_are_refused(shared_folder):
    """A mesh has none."""
    assert "takes no parameters ('size')" in file_refusal(put(shared_folder, "a.vtu", SPACE), size=1)


READERS = {
    "crash": "import os\ndef arrays(path, values, refuse): os.abort()",
    "raise": "def arrays(path, values, refuse): raise KeyError('what')",
    "fill": "import numpy\ndef arrays(path, values, refuse): return {'x': numpy.ones(1 << 40)}",
    "hang": "import time\ndef arrays(path, values, refuse): time.sleep(100)",
    "miss": "def arrays(path, values, refuse): import nothing_of_this_name",
    "exit": "import sys\ndef arrays(path, values, refuse): sys.exit(0)",
    "refuse": "def arrays(path, values, refuse): refuse('is\\nnot right')",
    "print": "import numpy\ndef arrays(path, values, refuse): print('!'); return {'x': numpy.array(values['a'])}",
}


@pytest.mark.skipif(COMM.size > 1, reason="a file is read by one rank")
@pytest.mark.parametrize(
    ("reader", "sentence"),
    [
        ("crash", "its library ended by signal 6"),
        ("raise", "KeyError: 'what'"),
        ("fill", "would take more than 4 GiB"),
        ("hang", "could not be read in 1 s"),
        ("miss", "library that is not installed (No module named 'nothing_of_this_name')"),
        ("exit", "its library ended by status 0"),
        ("refuse", "is not right"),
        ("print", ""),
    ],
)
def test_whatever_a_library_does_is_a_sentence(tmp_path, capfd, reader, sentence):
    """It has a process of its own, which may not take the program with it, nor talk to the user."""
    (tmp_path / "reader.py").write_text(READERS[reader])
    (tmp_path / "file").write_text("")
    if not sentence:
        assert process.arrays(tmp_path / "reader.py", tmp_path / "file", {"a": 2.0})["x"] == 2.0
    else:
        with pytest.raises(InputError) as caught:
            process.arrays(tmp_path / "reader.py", tmp_path / "file", {}, (1.0 if reader == "hang" else 60.0, 0.0))
        assert sentence in str(caught.value) and "\n" not in str(caught.value)
    assert capfd.readouterr() == ("", "")
