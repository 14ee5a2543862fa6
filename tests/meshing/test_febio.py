"""Models of FEBio: parts, sets and surfaces of all versions, and files that are no models."""

import numpy as np
import pytest
from blocks import COMM, boundary_size, file_refusal, region_size, strip
from hypothesis import given, settings
from hypothesis import strategies as st

from growthx import meshing
from growthx.common.errors import InputError
from growthx.meshing.formats import febio

CUBE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
NODES = "".join(f'<node id="{number}">{x},{y},{z}</node>' for number, (x, y, z) in enumerate(CUBE, start=11))
HEX = '<elem id="7">11,12,13,14,15,16,17,18</elem>'
TETS = "".join(
    f'<elem id="{number}">{",".join(map(str, nodes))}</elem>'
    for number, nodes in enumerate(
        [(11, 12, 14, 15), (12, 13, 14, 17), (15, 17, 16, 12), (15, 18, 17, 14), (12, 14, 15, 17)]
    )
)
VERSIONS = {
    "4.0": (
        '<febio_spec version="4.0"><Mesh><Nodes name="all">{nodes}</Nodes><Elements type="{kind}" name="bone">'
        '{elements}</Elements><Surface name="top"><quad4 id="1">15,16,17,18</quad4></Surface>'
        '<NodeSet name="low">11,12,13,14</NodeSet><ElementSet name="set">{ids}</ElementSet></Mesh><MeshData>'
        '<ElementData name="rho" elem_set="set">'
        '<e lid="1">0.7</e></ElementData></MeshData></febio_spec>'
    ),
    "2.5": (
        '<?xml version="1.0" encoding="ISO-8859-1"?><febio_spec version="2.5"><Geometry><Nodes>{nodes}</Nodes>'
        '<Elements type="{kind}" mat="1" name="bone">{elements}</Elements><NodeSet name="low"><node id="11"/>'
        '<node id="12"/><node id="13"/><node id="14"/></NodeSet><Surface name="top"><quad4 id="1"> 15, 16, 17, 18 '
        "</quad4></Surface></Geometry></febio_spec>"
    ),
    "2.0": (
        '<febio_spec version="2.0"><Geometry><Nodes>{nodes}</Nodes><Elements type="{kind}" mat="bone">{elements}'
        '</Elements><NodeSet name="low"><n id="11"/><n id="12"/><n id="13"/><n id="14"/></NodeSet><Surface name="top">'
        '<quad4 id="1">15,16,17,18</quad4></Surface></Geometry></febio_spec>'
    ),
}


def model(version="4.0", kind="hex8", elements=HEX, ids="7", nodes=NODES):
    text = VERSIONS[version].format(nodes=nodes, kind=kind, elements=elements, ids=ids)
    if kind != "hex8":
        two = '<tri3 id="1">15,16,17</tri3><tri3 id="2">15,17,18</tri3>'
        text = text.replace('<quad4 id="1">15,16,17,18</quad4>', two).replace(
            '<quad4 id="1"> 15, 16, 17, 18 </quad4>', two
        )
    return text


def put(folder, text):
    if COMM.rank == 0:
        (folder / "model.feb").write_text(text)
    COMM.barrier()
    return folder / "model.feb"


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize(("kind", "elements", "ids"), [("hex8", HEX, "7"), ("tet4", TETS, "0,1,2,3,4")])
def test_all_versions_are_one_cube(shared_folder, version, kind, elements, ids):
    """Parts are regions, surfaces and sets of nodes boundaries."""
    mesh = meshing.read(put(shared_folder, model(version, kind, elements, ids)))
    assert region_size(mesh, "bone") == pytest.approx(1, rel=1e-12)
    assert [boundary_size(mesh, name) for name in ("top", "low")] == pytest.approx([1, 1], rel=1e-12)


def test_values_of_elements(shared_folder):
    """By the places in their set."""
    mesh = meshing.read(put(shared_folder, model()))
    assert np.all(mesh.cell_values("rho").x.array == 0.7)
    with pytest.raises(InputError, match="are no numbers in 4 of 5 cells"):
        meshing.read(put(shared_folder, model("4.0", "tet4", TETS, "0,1,2,3,4"))).cell_values("rho")


def test_a_plane_model_is_the_strip(shared_folder):
    """Two squares as shells, in parts with names."""
    places = [(0, 0), (1, 0), (2, 0), (0, 1), (1, 1), (2, 1)]
    nodes = "".join(f'<node id="{number}">{x},{y},0</node>' for number, (x, y) in enumerate(places, start=1))
    text = (
        f'<febio_spec version="3.0"><Mesh><Nodes>{nodes}</Nodes><Elements type="quad4" name="soft"><elem id="1">1,2,5,4'
        '</elem></Elements><Elements type="quad4" name="stiff"><elem id="2">2,3,6,5</elem></Elements>'
        '<NodeSet name="left">1,4</NodeSet><NodeSet name="right">3,6</NodeSet></Mesh></febio_spec>'
    )
    assert strip(meshing.read(put(shared_folder, text))) == pytest.approx((0.1150376, -0.1), abs=1e-7)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "is not whole, as XML"),
        ("<febio_spec>", "is not whole, as XML"),
        ("<other/>", "is no FEBio model with a mesh"),
        ("<febio_spec/>", "is no FEBio model with a mesh"),
        ('<!DOCTYPE a [<!ENTITY b "c">]><febio_spec>&b;</febio_spec>', "has entities of XML"),
        (model().replace("hex8", "cube"), "are of the type 'cube'"),
        (model().replace("hex8", "tet4"), "have 8 nodes: 4 would be right"),
        (model().replace(",18</elem>", ",99</elem>"), "speaks of the node 99"),
        (model().replace(",18</elem>", ",x</elem>"), "are not all whole numbers"),
        (model().replace('id="18"', 'id=""'), "are not all whole numbers"),
        (model().replace("0,0,0", "0,0"), "has 2 to 3 numbers in a row"),
        (model().replace("0,0,0", "0,0,nan"), "has nodes that are nowhere"),
        (model().replace('name="top"', ""), "has no name"),
        (
            model().replace('lid="1"', 'lid="3"'),
            "element with lid 3, which its set does not have: 1 would be right",
        ),
        (model().replace(">7<", ">8<"), "speaks of the element 8"),
        (
            model().replace("15,16,17,18</quad4>", '15,16,17,18</quad4><tri3 id="2">15,16,17</tri3>'),
            "facets of one kind",
        ),
    ],
)
def test_refused_models(shared_folder, text, sentence):
    """Each in one sentence."""
    assert sentence in file_refusal(put(shared_folder, text))


@pytest.mark.skipif(COMM.size > 1, reason="a file is read by one rank")
@settings(max_examples=300, deadline=None)
@given(st.integers(0, len(model())), st.integers(0, 12), st.sampled_from(["", "<", ">", "/", "9", "x", ","]))
def test_damaged_models_are_read_or_refused(tmp_path_factory, start, length, instead):
    """A content or a sentence, nothing else."""
    path = tmp_path_factory.getbasetemp() / "damaged.feb"
    text = model()
    path.write_text(text[:start] + instead + text[start + length :])
    try:
        assert febio.read(path, {}).points.shape[1] == 3
    except InputError as error:
        assert "\n" not in str(error)
