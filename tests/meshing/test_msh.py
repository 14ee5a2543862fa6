"""Meshes of gmsh read by ourselves: what gmsh itself writes in all versions, files of other programs, damaged files."""

import random
import re
import struct
import time
import tracemalloc

import gmsh
import numpy as np
import pytest
from blocks import fuzz
from hypothesis import given
from hypothesis import strategies as st
from mpi4py import MPI

from growthx.common.errors import InputError
from growthx.meshing.content import DIMENSIONS
from growthx.meshing.formats import msh

pytestmark = pytest.mark.skipif(MPI.COMM_WORLD.size > 1, reason="a file is read by one rank")

PLANE = """
SetFactory("OpenCASCADE");
Rectangle(1) = {0, 0, 0, 1, 1}; Rectangle(2) = {1, 0, 0, 1, 1}; BooleanFragments{ Surface{1, 2}; Delete; }{}
Transfinite Curve {:} = 3; Transfinite Surface {1}; Recombine Surface {1};
Physical Surface("left", 7) = {1}; Physical Surface("right") = {-2}; Physical Surface("body") = {1, 2};
Physical Curve("rim") = {1, 2}; Physical Curve(99) = {3}; Physical Point("corner") = {1};
"""
SPACE = """
SetFactory("OpenCASCADE"); Box(1) = {0, 0, 0, 1, 1, 1}; Box(2) = {1, 0, 0, 1, 1, 1};
BooleanFragments{ Volume{1, 2}; Delete; }{} Mesh.MeshSizeMin = 0.5; Mesh.MeshSizeMax = 0.5;
Physical Volume("near") = {1}; Physical Volume("body") = {1, 2}; Physical Surface("base") = {1, -2};
Physical Curve("edge") = {3};
"""
FORMS = [(1, 0), (2.2, 0), (2.2, 1), (4.0, 0), (4.1, 0), (4.1, 1)]  # version, binary: what gmsh can write


@pytest.fixture
def session():
    """gmsh, silent."""
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    yield gmsh
    gmsh.finalize()


def made(folder, script, dim, **options):
    """A mesh in the running gmsh."""
    path = folder / "body.geo"
    path.write_text(script)
    for name, value in options.items():
        gmsh.option.setNumber(f"Mesh.{name}", value)
    gmsh.open(str(path))
    gmsh.model.mesh.generate(dim)


def saved(folder, version, binary):
    """The mesh of the running gmsh as a file."""
    path = folder / f"body_{version}_{binary}.msh"
    gmsh.option.setNumber("Mesh.MshFileVersion", version)
    gmsh.option.setNumber("Mesh.Binary", binary)
    gmsh.write(str(path))
    return path


def corners(points, nodes):
    """Corners of each element in one order, whatever the numbers of the nodes."""
    return sorted(tuple(map(tuple, points[row].round(6))) for row in nodes)


def told_by_gmsh(*, everything):
    """Nodes of the elements of each type, and of each physical group by dimension and name, as places."""
    tags, flat, _ = gmsh.model.mesh.getNodes()
    places = dict(zip(tags.tolist(), flat.reshape(-1, 3).round(6).tolist(), strict=True))
    elements, groups = {}, {}
    for dim, entity in gmsh.model.getEntities():
        physical = gmsh.model.getPhysicalGroupsForEntity(dim, entity)
        if not (everything or len(physical)):
            continue
        for kind, _, nodes in zip(*gmsh.model.mesh.getElements(dim, entity), strict=True):
            count = gmsh.model.mesh.getElementProperties(kind)[3]
            rows = [tuple(tuple(places[tag]) for tag in row) for row in nodes.reshape(-1, count).tolist()]
            elements.setdefault(kind, []).extend(rows)
            for tag in map(abs, physical.tolist()):
                name = gmsh.model.getPhysicalName(dim, tag) or str(tag)
                groups.setdefault((dim, name), []).extend(map(frozenset, rows))
    return elements, groups


def told(content):
    """The same of what was read."""
    points = content.points.round(6)
    elements, groups = {}, {}
    for start, kind in zip(content.starts, content.elements, strict=False):
        rows = [tuple(map(tuple, points[row].tolist())) for row in kind.nodes]
        number = next(each for each, size in msh.TYPES[kind.shape].items() if size == kind.nodes.shape[1])
        elements[number] = rows
        for name, members in content.groups.items():
            own = members[(members >= start) & (members < start + len(rows))] - start
            if len(own):
                groups.setdefault((DIMENSIONS[kind.shape], name), []).extend(frozenset(rows[row]) for row in own)
    return elements, groups


def assert_same(content, wanted, *, names=True, turned=False):
    """The same elements, with their nodes in the same order unless some are turned over, and the same groups."""
    elements, groups = told(content)
    assert elements.keys() == wanted[0].keys()
    for kind, rows in elements.items():
        assert len(rows) == len(set(map(frozenset, rows)))
        assert set(map(frozenset, rows)) == set(map(frozenset, wanted[0][kind]))
        assert turned or sorted(rows) == sorted(wanted[0][kind])
    if names:
        assert groups.keys() == wanted[1].keys()
        for key, rows in groups.items():
            assert set(rows) == set(wanted[1][key]) and len(rows) == len(set(rows))


@pytest.mark.parametrize(("version", "binary"), FORMS)
@pytest.mark.parametrize("order", [1, 2, 3])
@pytest.mark.parametrize(("script", "dim"), [(PLANE, 2), (SPACE, 3)], ids=["plane", "space"])
def test_what_gmsh_writes_is_read_as_it_is(version, binary, order, script, dim, session, tmp_path):
    """Points, elements of each order with all of their nodes, groups with and without names, of each dimension."""
    made(tmp_path, script, dim, ElementOrder=order)
    wanted = told_by_gmsh(everything=False)
    content = msh.read(saved(tmp_path, version, binary), {})
    assert content.kind == f"gmsh mesh {version}, {'binary' if binary else 'text'}"
    assert_same(content, wanted, names=version > 1, turned=version < 4)
    assert content.starts[-1] == sum(len(set(map(frozenset, rows))) for rows in wanted[0].values())


@pytest.mark.parametrize(("version", "binary"), FORMS)
def test_elements_of_no_group_have_none(version, binary, session, tmp_path):
    """Saved all the same."""
    script = PLANE.replace('Physical Surface("right") = {-2};', "").replace(
        "{1, 2};\nPhysical Curve", "{1};\nPhysical Curve"
    )
    made(tmp_path, script, 2, SaveAll=1)
    wanted = told_by_gmsh(everything=True)
    content = msh.read(saved(tmp_path, version, binary), {})
    if version > 2.2:  # before, all that is saved without a group has the group of its elementary tag
        assert_same(content, wanted)
    assert_same(content, wanted, names=False, turned=version < 4)


@pytest.mark.parametrize(("version", "binary"), FORMS[1:])
@pytest.mark.parametrize("topology", [0, 1])
def test_partitioned_meshes_are_read_as_one(version, binary, topology, session, tmp_path):
    """The parts of an entity have its groups."""
    made(tmp_path, SPACE, 3)
    wanted = told_by_gmsh(everything=False)
    gmsh.option.setNumber("Mesh.PartitionCreateTopology", topology)
    gmsh.option.setNumber("Mesh.PartitionCreateGhostCells", topology)
    gmsh.model.mesh.partition(3)
    content = msh.read(saved(tmp_path, version, binary), {})
    elements, groups = told(content)
    for kind in (2, 4):
        assert set(map(frozenset, wanted[0][kind])) <= set(map(frozenset, elements[kind]))
    for key in wanted[1]:
        assert set(groups[key]) == set(wanted[1][key])


@pytest.mark.parametrize(("version", "binary"), FORMS[1:])
def test_parametric_nodes(version, binary, session, tmp_path):
    """They have further numbers in version 4, and a section of their own before."""
    made(tmp_path, PLANE, 2)
    wanted = told_by_gmsh(everything=False)
    gmsh.option.setNumber("Mesh.SaveParametric", 1)
    path = saved(tmp_path, version, binary)
    if version < 4:
        with pytest.raises(InputError, match="SaveParametric = 0 would be right"):
            msh.read(path, {})
    else:
        assert_same(msh.read(path, {}), wanted)


# --- files of other programs ---

HEAD = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n"
NAMES = '$PhysicalNames\n3\n1 3 "left"\n2 1 "soft"\n2 2 "stiff"\n$EndPhysicalNames\n'
NODES = "$Nodes\n6\n1 0 0 0\n2 1 0 0\n3 2 0 0\n4 0 1 0\n5 1 1 0\n6 2 1 0\n$EndNodes\n"
ROWS = ["1 1 2 3 1 1 4", "2 3 2 1 1 1 2 5 4", "3 3 2 2 2 2 3 6 5"]


def elements(*rows):
    return f"$Elements\n{len(rows)}\n" + "".join(f"{row}\n" for row in rows) + "$EndElements\n"


def data(name, rows, parts=1, time=0.0):
    lines = "".join(f"{number} {value}\n" for number, value in rows)
    return f'$ElementData\n1\n"{name}"\n1\n{time}\n3\n0\n{parts}\n{len(rows)}\n{lines}$EndElementData\n'


def read(folder, text):
    path = folder / "strip.msh"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return msh.read(path, {})


STRIP = HEAD + NAMES + NODES + elements(*ROWS)
QUIRKS = {
    "as it should be": STRIP,
    "a mark of UTF-8": "\ufeff" + STRIP,
    "blank lines": "\n \n" + STRIP.replace("$Nodes", "\n\n$Nodes"),
    "comments": "$Comments\nmade by hand: $Nodes 5\n$EndComments\n" + STRIP,
    "Windows": STRIP.replace("\n", "\r\n"),
    "any order": HEAD + elements(*ROWS) + NODES + NAMES,
    "unknown sections": STRIP + "$Periodic\n0\n$EndPeriodic\n$Whatever\nx y z\n$EndWhatever\n",
    "all of it again": STRIP + STRIP,
    "no last line break": STRIP.rstrip(),
    "spaces": STRIP.replace("\n", " \n").replace("$Nodes", " $Nodes"),
    "partitions": HEAD + NAMES + NODES + elements("1 1 4 3 1 1 1 1 4", "2 3 5 1 1 2 1 -2 1 2 5 4", ROWS[2]),
    "one tag": HEAD + NAMES + NODES + elements("1 1 1 3 1 4", "2 3 1 1 1 2 5 4", "3 3 1 2 2 3 6 5"),
    "one entity": HEAD + NAMES + NODES + elements("1 1 2 3 0 1 4", "2 3 2 1 0 1 2 5 4", "3 3 2 2 0 2 3 6 5"),
    "turned groups": HEAD + NAMES + NODES + elements("1 1 2 -3 1 1 4", *ROWS[1:]),
    "twice": HEAD + NAMES + NODES + elements(*ROWS, "4 3 2 1 1 1 2 5 4", "4 3 2 2 2 5 6 3 2"),
    "version 2.0": STRIP.replace("2.2 0 8", "2 0 8")
    .replace('1 3 "', '3 "')
    .replace('2 1 "', '1 "')
    .replace('2 2 "', '2 "'),
}


@pytest.mark.parametrize("case", QUIRKS)
def test_what_other_programs_write_is_read(case, tmp_path):
    """All are the same strip."""
    content = read(tmp_path, QUIRKS[case])
    assert [(kind.shape, kind.nodes.tolist()) for kind in content.elements] == [
        ("interval", [[0, 3]]),
        ("quadrilateral", [[0, 1, 4, 3], [1, 2, 5, 4]]),
    ]
    assert {name: rows.tolist() for name, rows in content.groups.items()} == {"left": [0], "soft": [1], "stiff": [2]}
    assert content.points[5].tolist() == [2, 1, 0] and content.notices == ()


@pytest.mark.parametrize("factor", [7, 10**9, 10**12])
def test_numbers_of_nodes_may_be_any(factor, tmp_path):
    """Sparse, huge and in any order; a node that nothing uses stays."""
    nodes = "".join(f"{i * factor} {i} 0 0\n" for i in (5, 3, 9, 1))
    content = read(
        tmp_path, f"{HEAD}$Nodes\n4\n{nodes}$EndNodes\n" + elements(f"1 2 2 1 1 {factor} {3 * factor} {9 * factor}")
    )
    assert content.elements[0].nodes.tolist() == [[3, 1, 2]] and content.points[:, 0].tolist() == [5, 3, 9, 1]


def test_groups_of_all_kinds(tmp_path):
    """Without a name they are called by their number, elements of none have none, an empty name is no name."""
    names = '$PhysicalNames\n2\n2 1 "knöchern \\"α\\" 1"\n1 3 ""\n$EndPhysicalNames\n'
    rows = ["9 15 2 8 1 1", *ROWS, "7 1 2 0 1 2 5"]
    content = read(tmp_path, HEAD + names + NODES + elements(*rows))
    assert {name: rows.tolist() for name, rows in content.groups.items()} == {
        "8": [0],
        "3": [1],
        'knöchern \\"α\\" 1': [3],
        "2": [4],
    }
    assert content.elements[0].shape == "point" and content.starts.tolist() == [0, 1, 3, 5]
    latin = (HEAD + '$PhysicalNames\n1\n2 1 "Röhre"\n$EndPhysicalNames\n' + NODES + elements(*ROWS)).encode("latin-1")
    assert "Röhre" in read(tmp_path, latin).groups


def test_a_twisted_repetition_is_an_element_of_its_own(tmp_path):
    """Which of the two is meant is not for the reader to say."""
    content = read(tmp_path, HEAD + NODES + elements(*ROWS, "4 3 2 2 1 1 5 2 4"))
    assert len(content.elements[1].nodes) == 3


def test_values_of_elements(tmp_path):
    """By the numbers of the elements, in any order; the last step; one component; also of elements in two groups."""
    rows = [*ROWS, "40 3 2 2 2 1 2 5 4"]
    values = data("a", [(3, 0.5), (2, 0.25)]) + data("b", [(40, 7.0)]) + data("a", [(3, 1.5), (99, 4.0)], time=2.0)
    values += data("c", [(2, "1 2 3")], parts=3) + data("none", []) + "$NodeData\n1\n$EndNodeData\n"
    content = read(tmp_path, HEAD + NAMES + NODES + elements(*rows) + values)
    assert str({name: found.tolist() for name, found in content.values.items()}) == (
        "{'a': [nan, nan, 1.5], 'b': [nan, 7.0, nan], 'none': [nan, nan, nan]}"
    )
    assert [notice.split(" in ")[0] for notice in content.notices] == [
        "the 3 components of 'c'",
        "'a'",
        "the values at nodes",
    ]
    assert "has 2 steps, of which the last was read (t = 2)" in content.notices[1]


@pytest.mark.parametrize(("version", "binary"), FORMS)
def test_values_that_gmsh_writes(version, binary, session, tmp_path):
    """Appended to the mesh."""
    made(tmp_path, PLANE, 2)
    gmsh.model.mesh.renumberElements()
    path = saved(tmp_path, version, binary)
    tags = gmsh.model.mesh.getElements(2, 1)[1][0]
    view = gmsh.view.add("density")
    gmsh.view.addModelData(view, 0, "", "ElementData", tags, (0.5 * tags).reshape(-1, 1).tolist())
    gmsh.option.setNumber("PostProcessing.SaveMesh", 0)
    gmsh.view.write(view, str(path), append=True)
    content = msh.read(path, {})
    if version < 2:  # which has no values
        return
    ((name, found),) = content.values.items()
    assert name == "density" and np.isfinite(found).sum() >= len(tags)


def binary_4_0(order):
    """A square of two triangles in version 4.0, binary, as gmsh 4.0 wrote it."""

    def pack(form, *numbers):
        return struct.pack(order + form, *numbers)

    box = (0.0,) * 6
    entities = pack("4Q", 0, 0, 1, 0) + pack("i6dQ2iQ", 3, *box, 2, 1, -2, 0)
    nodes = pack("2Q", 1, 4) + pack("3iQ", 3, 2, 0, 4)
    nodes += b"".join(pack("i3d", 10 * i, *map(float, x), 0.0) for i, x in enumerate([(0, 0), (1, 0), (1, 1), (0, 1)]))
    cells = pack("2Q", 1, 2) + pack("3iQ", 3, 2, 2, 2) + pack("8i", 1, 0, 10, 20, 2, 0, 20, 30)
    sections = b"".join(
        b"$%s\n%s\n$End%s\n" % (name, content, name)
        for name, content in [(b"Entities", entities), (b"Nodes", nodes), (b"Elements", cells)]
    )
    return b"$MeshFormat\n4 1 8\n" + pack("i", 1) + b"\n$EndMeshFormat\n" + sections


@pytest.mark.parametrize("order", "<>")
def test_the_first_binary_version_4(order, tmp_path):
    """In either order of bytes."""
    content = read(tmp_path, binary_4_0(order))
    assert content.kind == "gmsh mesh 4.0, binary"
    assert content.elements[0].nodes.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert {name: rows.tolist() for name, rows in content.groups.items()} == {"1": [0, 1], "2": [0, 1]}


# --- what is refused ---

REFUSED = {
    "no mesh": ("solid x\n", "should begin with \\$MeshFormat"),
    "only comments": ("$Comments\nx\n$EndComments\n", "should begin with"),
    "version": (STRIP.replace("2.2 0 8", "5.0 0 8"), "is of version 5.0 .* gmsh -save -format msh41 makes it"),
    "no version": (STRIP.replace("2.2 0 8", "two"), "the format of .* is 'two': one such as 4.1 0 8"),
    "size": (STRIP.replace("2.2 0 8", "2.2 1 4"), "numbers of 4 bytes: 8"),
    "order": (STRIP.replace("2.2 0 8", "2.2 1 8"), "does not tell the order of its bytes"),
    "no end": (STRIP.replace("$EndNodes", ""), "section \\$Nodes of .* has no end"),
    "two sections": (STRIP + NODES.replace("6 2 1 0", "6 3 1 0"), "has 2 sections \\$Nodes: one"),
    "no nodes": (HEAD + elements(*ROWS), "have nodes that it does not tell"),
    "few nodes": (STRIP.replace("$Nodes\n6", "$Nodes\n7"), "\\$Nodes of .* has less than it says"),
    "many nodes": (STRIP.replace("$Nodes\n6", f"$Nodes\n{10**12}"), "has less than it says"),
    "more nodes": (STRIP.replace("$Nodes\n6", "$Nodes\n5"), "has more than the 5 nodes that it says"),
    "negative": (STRIP.replace("$Nodes\n6", "$Nodes\n-6"), "has less than it says"),
    "nowhere": (STRIP.replace("6 2 1 0", "6 nan 1 0"), "nowhere, or too far"),
    "far": (STRIP.replace("6 2 1 0", "6 2 1e400 0"), "nowhere, or too far"),
    "half a node": (STRIP.replace("6 2 1 0", "6.5 2 1 0"), "other numbers where whole ones would be right"),
    "word": (STRIP.replace("6 2 1 0", "6 two 1 0"), "not all made of numbers"),
    "unknown node": (STRIP.replace("2 3 6 5", "2 3 7 5"), "have nodes that it does not tell"),
    "no node": (STRIP.replace("2 3 6 5", "2 3 0 5"), "have nodes that it does not tell"),
    "few elements": (STRIP.replace("$Elements\n3", "$Elements\n4"), "has not the 4 elements"),
    "many elements": (STRIP.replace("$Elements\n3", f"$Elements\n{10**12}"), "has not the 10*"),
    "more elements": (STRIP.replace("$Elements\n3", "$Elements\n2"), "has more than the 2 elements"),
    "polygon": (STRIP.replace("3 3 2 2 2", "3 34 2 2 2"), "has not the 3 elements"),
    "names": (STRIP.replace('2 2 "stiff"', "2 2 stiff"), "a line of \\$PhysicalNames of .* is '2 2 stiff'"),
    "long number": (STRIP.replace('2 2 "stiff"', f'{"9" * 5000} 2 "stiff"'), "a line of \\$PhysicalNames"),
    "long count": (f"{STRIP}$ElementData\n{'9' * 5000}\n$EndElementData\n", "\\$ElementData of .* does not tell"),
    "values": (STRIP + data("a", [(2, 1.0)]).replace('1\n"a"', '7\n"a"'), "\\$ElementData of .* does not tell"),
    "fewer values": (STRIP + data("a", [(2, 1.0)]).replace("1\n2 1.0", "2\n2 1.0"), "has less than it says"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_files_of_no_use(case, tmp_path):
    """One sentence, with the file and what would be right."""
    text, sentence = REFUSED[case]
    with pytest.raises(InputError, match=sentence) as caught:
        read(tmp_path, text)
    assert "strip.msh" in str(caught.value)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Good files in all forms: plane and in space, in parts, with values."""
    folder = tmp_path_factory.mktemp("whole")
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    found = {"strip": STRIP.encode() + data("a", [(2, 1.0), (3, 2.0)]).encode()}
    found |= {f"4.0 {order}": binary_4_0(order) for order in "<>"}
    for script, dim in ((PLANE, 2), (SPACE, 3)):
        made(folder, script, dim)
        if dim == 3:
            gmsh.model.mesh.partition(2)
        found |= {f"{form} {dim}": saved(folder, *form).read_bytes() for form in FORMS}
        gmsh.clear()
    gmsh.finalize()
    return found


def read_or_refused(path, content):
    """Read what may be damaged: in no long time, and in no more memory than its size lets expect."""
    path.write_bytes(content)
    start = time.perf_counter()
    tracemalloc.start()
    try:
        msh.read(path, {})
    except InputError as error:
        assert str(path) in str(error) and "\n" not in str(error)
    finally:
        _, most = tracemalloc.get_traced_memory()
        tracemalloc.stop()
    assert time.perf_counter() - start < 10.0 and most < 200 * len(content) + 10**6


def test_files_cut_off_anywhere_are_read_or_refused(whole, tmp_path):
    """An interrupted copy: at the ends of sections, and within them."""
    for content in whole.values():
        for share in range(40):
            read_or_refused(tmp_path / "cut.msh", content[: len(content) * share // 40])
        for back in range(1, 40):
            read_or_refused(tmp_path / "cut.msh", content[:-back])


@fuzz(300)
@given(st.integers(0, 10**6), st.integers(1, 8), st.booleans())
def test_files_with_other_bytes_are_read_or_refused(whole, tmp_path, seed, count, early):
    """Any bytes: of the numbers in binary files, and of the sizes that they begin with."""
    chance = random.Random(seed)
    content = bytearray(whole[chance.choice(sorted(whole))])
    for _ in range(count):
        at = chance.randrange(min(len(content), 400) if early else len(content))
        content[at] = chance.choice([0, 255, 127, 128, ord("-"), ord("9"), ord(" "), ord("\n"), chance.randrange(256)])
    read_or_refused(tmp_path / "other.msh", bytes(content))


@fuzz(150)
@given(
    st.integers(0, 10**6),
    st.sampled_from(["-1", "0", "1e400", "nan", "9" * 12, "9" * 19, "9" * 400, "x", "", "34", "$"]),
)
def test_texts_with_other_words_are_read_or_refused(whole, tmp_path, seed, word):
    """What a header says, or a node, an element or a name."""
    chance = random.Random(seed)
    name = chance.choice([name for name in sorted(whole) if ", 0)" in name or name == "strip"])
    lines = whole[name].split(b"\n")
    at = chance.randrange(min(len(lines), 30)) if chance.random() < 0.5 else chance.randrange(len(lines))
    words = lines[at].split(b" ")
    words[chance.randrange(len(words))] = word.encode()
    read_or_refused(tmp_path / "other.msh", b"\n".join([*lines[:at], b" ".join(words), *lines[at + 1 :]]))


def test_entities_in_more_groups_than_can_be_meant(tmp_path):
    """A short file could otherwise fill the memory."""
    groups = " ".join(map(str, range(1, 3001)))
    rows = "".join(f"{i} 1 2 3\n" for i in range(1, 3001))
    text = (
        "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n" + f"$Entities\n0 0 1 0\n1 0 0 0 1 1 0 3000 {groups} 0\n$EndEntities\n"
    )
    text += "$Nodes\n1 3 1 3\n2 1 0 3\n1\n2\n3\n0 0 0\n1 0 0\n0 1 0\n$EndNodes\n"
    text += f"$Elements\n1 3000 1 3000\n2 1 2 3000\n{rows}$EndElements\n"
    with pytest.raises(InputError, match="in more groups than can be meant"):
        read(tmp_path, text)


def test_a_large_text_is_read_in_seconds(tmp_path):
    """Of whole arrays, not line by line: a fifth of a second for this one."""
    count = 200_000
    nodes = "".join(f"{i} {i} 0.125 {i}.5\n" for i in range(1, count + 4))
    rows = "".join(f"{i} 4 2 1 1 {i} {i + 1} {i + 2} {i + 3}\n" for i in range(1, count + 1))
    path = tmp_path / "large.msh"
    path.write_text(f"{HEAD}$Nodes\n{count + 3}\n{nodes}$EndNodes\n$Elements\n{count}\n{rows}$EndElements\n")
    start = time.perf_counter()
    assert msh.read(path, {}).elements[0].nodes[-1].tolist() == [count - 1, count, count + 1, count + 2]
    assert time.perf_counter() - start < 10.0


@pytest.mark.parametrize("binary", [False, True])
def test_version_3_is_converted_by_gmsh(binary, session, tmp_path):
    """An experiment of gmsh's that some have on their disks; damaged, it is refused all the same."""
    made(tmp_path, PLANE, 2)
    wanted = told_by_gmsh(everything=False)
    path = saved(tmp_path, 3, binary)
    content = msh.read(path, {})
    assert content.kind == "gmsh mesh 3, by gmsh"
    assert_same(content, wanted, names=True, turned=False)
    path.write_bytes(path.read_bytes()[:400])
    with pytest.raises(InputError, match=re.escape(path.name)):
        msh.read(path, {})
