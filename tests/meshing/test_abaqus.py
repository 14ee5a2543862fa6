"""Input files of Abaqus: sets, surfaces, parts and instances, and all that a file may say otherwise than we expect."""

import re

import dolfinx
import numpy as np
import pytest
from blocks import COMM, boundary_size, file_refusal, region_size, strip
from hypothesis import given, settings
from hypothesis import strategies as st

from growthx import meshing
from growthx.common.errors import InputError
from growthx.meshing.formats import abaqus

NODES = "*NODE\n1, 0., 0.\n2, 1., 0.\n3, 2., 0.\n4, 0., 1.\n5, 1., 1.\n6, 2., 1.\n"
SQUARES = NODES + "*ELEMENT, TYPE=CPE4, ELSET=soft\n11, 1, 2, 5, 4\n*ELEMENT, TYPE=CPE4, ELSET=stiff\n12, 2, 3, 6, 5\n"
ENDS = "*NSET, NSET=left\n1, 4\n*NSET, NSET=right\n3, 6\n"
CUBE = "*NODE\n" + "".join(
    f"{number}, {x}, {y}, {z}\n"
    for number, (x, y, z) in enumerate(
        [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], start=1
    )
)
BRICK = CUBE + "*ELEMENT, TYPE=C3D8, ELSET=bone\n1, 1, 2, 3, 4, 5, 6, 7, 8\n"


def put(folder, text, name="mesh.inp"):
    if COMM.rank == 0:
        (folder / name).write_bytes(text if isinstance(text, bytes) else text.encode())
    COMM.barrier()
    return folder / name


def centre(mesh, name):
    x = dolfinx.mesh.compute_midpoints(mesh.domain, mesh.dim - 1, mesh.owned_facets(name))
    return (COMM.allreduce(x.sum(axis=0)) / COMM.allreduce(len(x)))[: mesh.dim].tolist()


@pytest.mark.parametrize(
    "change",
    [
        lambda text: text,
        lambda text: "\ufeff" + text,
        lambda text: text.replace("\n", "\r\n"),
        lambda text: "** made by a converter\n\n*HEADING\na strip, of 2 squares\n" + text,
        lambda text: text.lower().replace("soft", "soft"),
        lambda text: text.replace("TYPE=CPE4, ", "type = cps4R ,\n "),
        lambda text: text.replace("1, 4\n", "1,\n4,\n").replace("11, 1, 2, 5, 4", "11, 1, 2,\n 5, 4"),
        lambda text: text + "*MATERIAL, NAME=bone\n*ELASTIC\n17000., 0.3\n*STEP\n*STATIC\n0.1, 1.\n*END STEP\n",
        lambda text: text.replace("0.", "0.D0").replace("*NODE", "*Node, NSET=everything"),
    ],
)
def test_one_strip_written_in_many_ways(tmp_path, change):
    """Keywords know no case, lines may go on, and what is no mesh does not matter."""
    from pathlib import Path

    folder = Path(COMM.bcast(str(tmp_path)))
    mesh = meshing.read(put(folder, change(SQUARES + ENDS)))
    assert mesh.cell_count == 2 and [region_size(mesh, name) for name in ("soft", "stiff")] == pytest.approx([1, 1])
    assert strip(mesh) == pytest.approx((0.1150376, -0.1), abs=1e-7)


def test_names_in_quotes_may_have_commas(shared_folder):
    """As Abaqus/CAE lets people call their parts."""
    text = SQUARES.replace("ELSET=soft", 'ELSET="soft, inside"').replace("ELSET=stiff", 'ELSET = "stiff"')
    assert sorted(meshing.read(put(shared_folder, text)).regions) == ["soft, inside", "stiff"]


SURFACES = (
    "*SURFACE, NAME=right, TYPE=ELEMENT\nstiff, S2\n*SURFACE, NAME=left\n11, S4\n"
    "*SURFACE, NAME=all\nsoft,\nstiff,\n*SURFACE, NAME=bottom, TYPE=NODE\nlow,\n*NSET, NSET=low, GENERATE\n1, 3, 1\n"
)


def test_surfaces_of_elements_are_boundaries(shared_folder):
    """By the number of a side, or all that is outside."""
    mesh = meshing.read(put(shared_folder, SQUARES + SURFACES))
    lengths = {name: boundary_size(mesh, name) for name in mesh.boundaries}
    assert lengths == pytest.approx({"right": 1, "left": 1, "all": 6, "bottom": 2, "low": 2})
    assert strip(mesh) == pytest.approx((0.1150376, -0.1), abs=1e-7)


@pytest.mark.parametrize(
    ("number", "place"),
    [
        (1, [0.5, 0.5, 0]),
        (2, [0.5, 0.5, 1]),
        (3, [0.5, 0, 0.5]),
        (4, [1, 0.5, 0.5]),
        (5, [0.5, 1, 0.5]),
        (6, [0, 0.5, 0.5]),
    ],
)
def test_sides_of_a_brick(shared_folder, number, place):
    """As Abaqus numbers them."""
    mesh = meshing.read(put(shared_folder, BRICK + f"*SURFACE, NAME=s\nbone, S{number}\n"))
    assert region_size(mesh, "bone") == pytest.approx(1) and boundary_size(mesh, "s") == pytest.approx(1)
    assert centre(mesh, "s") == pytest.approx(place)


@pytest.mark.parametrize(("number", "nodes"), [(1, (1, 2, 3)), (2, (1, 2, 4)), (3, (2, 3, 4)), (4, (1, 3, 4))])
@pytest.mark.parametrize("kind", ["C3D4", "C3D10"])
def test_sides_of_a_tetrahedron(shared_folder, number, nodes, kind):
    """Of second order too, of which the corners are kept."""
    corners = {1: (0, 0, 0), 2: (1, 0, 0), 3: (0, 1, 0), 4: (0, 0, 1)}
    places = dict(corners)
    for tag, (a, b) in enumerate([(1, 2), (2, 3), (3, 1), (1, 4), (2, 4), (3, 4)], start=5):
        places[tag] = tuple(np.add(corners[a], corners[b]) / 2)
    count = 4 if kind == "C3D4" else 10
    text = "*NODE\n" + "".join(f"{tag}, {x}, {y}, {z}\n" for tag, (x, y, z) in places.items())
    text += f"*ELEMENT, TYPE={kind}, ELSET=bone\n1, {', '.join(map(str, range(1, count + 1)))}\n"
    mesh = meshing.read(put(shared_folder, text + f"*SURFACE, NAME=s\nbone, S{number}\n"))
    assert region_size(mesh) == pytest.approx(1 / 6)
    assert centre(mesh, "s") == pytest.approx(np.mean([corners[node] for node in nodes], axis=0))


def test_elements_on_the_surface_are_boundaries_too(shared_folder):
    """As gmsh writes its physical surfaces: shells beside solids, each with a set."""
    text = BRICK + "*ELEMENT, TYPE=S4R, ELSET=top\n2, 5, 6, 7, 8\n*ELEMENT, TYPE=T3D2, ELSET=edge\n3, 1, 2\n"
    mesh = meshing.read(put(shared_folder, text))
    assert (sorted(mesh.regions), sorted(mesh.boundaries)) == (["bone"], ["top"])
    assert centre(mesh, "top") == pytest.approx([0.5, 0.5, 1])


ASSEMBLY = (
    f"*PART, NAME=square\n{SQUARES.split('*ELEMENT')[0]}*ELEMENT, TYPE=CPE4\n1, 1, 2, 5, 4\n*ELSET, ELSET=one\n1,\n"
    "*NSET, NSET=low, GENERATE\n1, 2\n*END PART\n*ASSEMBLY, NAME=a\n"
    "*INSTANCE, NAME=here, PART=square\n*END INSTANCE\n*INSTANCE, NAME=there, PART=square\n3., 0., 0.\n"
    "3., 0., 0., 3., 0., 1., 90.\n*END INSTANCE\n*NSET, NSET=far, INSTANCE=there\n2, 5\n*END ASSEMBLY\n"
)


def test_instances_of_a_part_stand_where_they_are_put(shared_folder):
    """Moved, then turned; sets that several have are named after each, those of the assembly by themselves."""
    mesh = meshing.read(put(shared_folder, ASSEMBLY))
    assert sorted(mesh.regions) == ["here.one", "there.one"]
    assert sorted(mesh.boundaries) == ["far", "here.low", "there.low"]
    assert centre(mesh, "far") == pytest.approx([2.5, 1])
    assert centre(mesh, "there.low") == pytest.approx([3, 0.5])


CAE = (
    ASSEMBLY.split("*NSET, NSET=far")[0] + "*Elset, elset=_Surf-1_S4, internal, instance=here\n 1,\n"
    "*Elset, elset=_Surf-1_S4, internal, instance=there\n 1,\n"
    "*Surface, type=ELEMENT, name=Surf-1\n_Surf-1_S4, S4\n*Surface, type=ELEMENT, name=Surf-2\nhere.one, S2\n"
    "*Nset, nset=both, instance=here\n1, 4\n*Nset, nset=both, instance=there\n1, 4\n"
    "*Nset, nset=mixed\nhere.1, here.2, there.low\n*END ASSEMBLY\n"
)


def test_surfaces_of_an_assembly_are_boundaries(shared_folder):
    """As Abaqus/CAE writes them: by internal sets of instances, which are no regions; a name is one set of all."""
    mesh = meshing.read(put(shared_folder, CAE))
    assert sorted(mesh.regions) == ["here.one", "there.one"]
    lengths = {name: boundary_size(mesh, name) for name in ("Surf-1", "Surf-2", "both", "mixed")}
    assert lengths == pytest.approx({"Surf-1": 2, "Surf-2": 1, "both": 2, "mixed": 2})
    assert "there is no set 'lost'" in file_refusal(put(shared_folder, CAE.replace("\n_Surf-1_S4, S4", "\nlost, S4")))


@pytest.mark.parametrize(("nodes", "told"), [("3, 6", ""), ("1, 4", "the set of nodes 'end' of")])
def test_a_set_of_nodes_beside_a_surface_of_its_name_is_told(shared_folder, caplog, nodes, told):
    """The surface counts; that the nodes mean other sides is not for us to hide."""
    text = SQUARES + f"*SURFACE, NAME=end\nstiff, S2\n*NSET, NSET=end\n{nodes}\n"
    assert centre(meshing.read(put(shared_folder, text)), "end") == pytest.approx([2, 0.5])
    assert COMM.rank or (told in caplog.text and bool(caplog.records) == bool(told))


def test_other_files_are_followed_within_the_folder(shared_folder):
    """*INCLUDE, and data in files of their own; not into other folders, nor round in circles."""
    put(shared_folder, NODES.split("\n", 1)[1], "nodes.txt")
    put(shared_folder, SQUARES[len(NODES) :] + ENDS, "elements.inp")
    path = put(shared_folder, "*NODE, INPUT=nodes.txt\n*INCLUDE, INPUT=elements.inp\n")
    assert strip(meshing.read(path)) == pytest.approx((0.1150376, -0.1), abs=1e-7)
    for other, sentence in (("../nodes.txt", "there is no file"), ("mesh.inp", "include each other"), ("", "no INPUT")):
        assert sentence in file_refusal(put(shared_folder, f"*INCLUDE, INPUT={other}\n"))


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "has no elements at all"),
        ("1, 2, 3\n", "comes before any keyword"),
        (NODES + "*ELEMENT\n1, 1, 2, 5, 4\n", "line 8: *ELEMENT has no TYPE"),
        (NODES + "*ELEMENT, TYPE=CPE4\n1, 1, 2, 5\n", "have 4 numbers in all: 5 for each"),
        (NODES + "*ELEMENT, TYPE=CPE4\n1, 1, 2, 5, x\n", "has what is no whole number"),
        (NODES + "*ELEMENT, TYPE=CPE4\n1, 1, 2, 5, 99\n", "speaks of the node 99, which it does not have"),
        (NODES + f"*ELEMENT, TYPE=CPE4\n1, 1, 2, 5, {10**30}\n", "has what is no whole number"),
        (NODES + "*ELEMENT, TYPE=SPRINGA\n1, 1, 2\n", "has no elements at all"),
        (NODES.replace("0.", "zero"), "has what is no number"),
        (NODES.replace("0.", "nan"), "no finite coordinates"),
        (SQUARES.replace("*NODE", "*NODE, SYSTEM=C"), "curved system"),
        (SQUARES + "*NGEN\n1, 10, 1\n", "*NGEN makes or moves nodes"),
        (SQUARES + "*SYSTEM\n1., 0., 0.\n", "*SYSTEM makes or moves nodes"),
        (SQUARES + "*ELSET, ELSET=a\nb\n", "names the set 'b'"),
        (SQUARES + "*ELSET, ELSET=a\nb\n*ELSET, ELSET=b\na\n", "names the set"),
        (SQUARES + "*NSET, NSET=a, GENERATE\n1, 6, 0\n", "generates no set"),
        (SQUARES + "*NSET, NSET=a, GENERATE\n6, 1\n", "generates no set"),
        (SQUARES + "*NSET, NSET=a, GENERATE\n1, 300000000\n", "generates no set"),
        (SQUARES + "*SURFACE, NAME=s\nsoft, S5\n", "a quadrilateral has no side 'S5': S1 to S4"),
        (SQUARES + "*SURFACE, NAME=s\nhard, S1\n", "there is no set 'hard'"),
        ("*INSTANCE, NAME=i, PART=p\n*END INSTANCE\n", "there is no part 'p'"),
        (SQUARES + "*NSET, NSET=far, INSTANCE=there\n2, 5\n", "there is no instance 'there'"),
        (b"*NODE\n1, 0, 0\0\n", "bytes that are no text"),
    ],
)
def test_refused_files(shared_folder, text, sentence):
    """Each in one sentence that says where."""
    assert sentence in file_refusal(put(shared_folder, text))


def test_elements_without_a_shape_are_told(shared_folder, caplog):
    """Springs and masses of a model carry no bone, but they are not lost without a word."""
    meshing.read(put(shared_folder, SQUARES + "*ELEMENT, TYPE=SPRINGA, ELSET=ties\n20, 1, 2\n21, 2, 3\n"))
    assert COMM.rank or "2 elements of type SPRINGA" in caplog.text


WHOLE = SQUARES + ENDS + SURFACES + ASSEMBLY


@pytest.mark.skipif(COMM.size > 1, reason="a file is read by one rank")
@settings(max_examples=300, deadline=None)
@given(st.integers(0, len(WHOLE)), st.integers(0, len(WHOLE)), st.sampled_from(["", ",", "*", "-1", "1e9", "\n", "x"]))
def test_damaged_files_are_read_or_refused(tmp_path_factory, start, end, instead):
    """Cut short, with pieces left out or changed: a content or a sentence, nothing else."""
    path = tmp_path_factory.getbasetemp() / "damaged.inp"
    start, end = sorted((start, end))
    path.write_text(WHOLE[:start] + instead + WHOLE[max(end, len(WHOLE) - 40) if end - start > 60 else end :])
    try:
        content = abaqus.read(path, {})
    except InputError as error:
        assert "\n" not in str(error)
    else:
        assert content.points.shape[1] == 3


@pytest.mark.skipif(COMM.size > 1, reason="a file is read by one rank")
def test_every_length_of_a_file_is_read_or_refused(tmp_path):
    """As a download that broke off."""
    path = tmp_path / "short.inp"
    for length in range(0, len(WHOLE), 7):
        path.write_text(WHOLE[:length])
        try:
            meshing.read(path, comm=COMM)
        except InputError as error:
            assert re.search(r"\w", str(error))


def test_types_of_elements():
    """Shape and number of nodes of what Abaqus and CalculiX know, in all their spellings."""
    shapes = {
        "tetrahedron": [("C3D4", 4), ("C3D10M", 10), ("C3D10HS", 10), ("DC3D4", 4)],
        "hexahedron": [("C3D8R", 8), ("C3D8I", 8), ("C3D20RH", 20), ("SC8R", 8)],
        "prism": [("C3D6", 6), ("C3D15", 15)],
        "quadrilateral": [("CPS4R", 4), ("CPE8R", 8), ("S4RS", 4), ("S8R5", 8), ("R3D4", 4), ("M3D9R", 9)],
        "triangle": [("CPE3", 3), ("CPS6M", 6), ("S3R", 3), ("STRI3", 3), ("STRI65", 6), ("SFM3D6", 6)],
        "interval": [("T3D2", 2), ("B31", 2), ("B32H", 3), ("B23", 2)],
    }
    for shape, kinds in shapes.items():
        for kind, count in kinds:
            assert abaqus.shape_of(kind)[:2] == (shape, count)
    assert all(abaqus.shape_of(kind) is None for kind in ("SPRINGA", "MASS", "DCOUP3D", "C3D7", ""))
    assert "axisymmetric" in abaqus.shape_of("CAX4R")[2]
