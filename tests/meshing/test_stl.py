"""Closed surfaces filled with tetrahedra: volumes, holes, several bodies, and what is no body."""

import numpy as np
import pytest
from blocks import COMM, boundary_size, file_refusal, region_size

from growthx import meshing


def ball(radius=10.0, centre=(0.0, 0.0, 0.0), n=12):
    import pyvista

    sphere = pyvista.Sphere(radius=radius, center=centre, theta_resolution=n, phi_resolution=n)
    return sphere.triangulate()


def put(folder, surface, name="body.stl", **options):
    """The file, and volume and area of what it is."""
    if COMM.rank == 0:
        surface.save(folder / name.lower(), **options)
        (folder / name.lower()).rename(folder / name)
    COMM.barrier()
    return folder / name


@pytest.mark.parametrize(("name", "binary"), [("body.stl", True), ("BODY.STL", False), ("body.ply", True)])
def test_a_surface_is_filled_as_it_is(shared_folder, name, binary):
    """To the volume that the divergence theorem tells, with the triangles that it has."""
    surface = ball()
    mesh = meshing.read(put(shared_folder, surface, name, binary=binary), size=4.0)
    assert (mesh.dim, list(mesh.regions), list(mesh.boundaries)) == (3, ["all"], ["surface"])
    assert region_size(mesh) == pytest.approx(surface.volume, rel=1e-6)  # in single precision
    assert boundary_size(mesh, "surface") == pytest.approx(surface.area, rel=1e-6)
    facets = COMM.allreduce(len(mesh.owned_facets("surface")))
    assert facets == surface.n_cells


def test_a_surface_is_remeshed_where_it_is_asked_for(shared_folder):
    """With triangles of the size that is given, on the same shape up to a few per cent."""
    surface = ball(n=24)
    path = put(shared_folder, surface)
    mesh = meshing.read(path, size=4.0, remesh=True)
    assert region_size(mesh) == pytest.approx(surface.volume, rel=0.06)
    assert COMM.allreduce(len(mesh.owned_facets("surface"))) < surface.n_cells / 2
    assert meshing.read(path, size=4.0).cell_count > mesh.cell_count


def test_edges_of_a_remeshed_surface_stay_sharp(shared_folder):
    """A cube is one."""
    import pyvista

    mesh = meshing.read(put(shared_folder, pyvista.Cube().triangulate()), size=0.4, remesh=True)
    assert (region_size(mesh), boundary_size(mesh, "surface")) == pytest.approx((1, 6), rel=1e-9)
    assert mesh.cell_count > 50


@pytest.mark.parametrize("remesh", [False, True])
def test_a_shell_in_another_is_a_hole(shared_folder, remesh):
    """A medullary canal is left empty."""
    outer, inner = ball(), ball(4.0, n=9)
    mesh = meshing.read(put(shared_folder, outer.merge(inner).extract_surface()), size=4.0, remesh=remesh)
    rel = 0.15 if remesh else 1e-6
    assert region_size(mesh) == pytest.approx(outer.volume - inner.volume, rel=rel)
    assert boundary_size(mesh, "surface") == pytest.approx(outer.area + inner.area, rel=rel)


def test_shells_beside_each_other_are_bodies(shared_folder, caplog):
    """Told as islands, of which the largest can be kept."""
    one, other = ball(), ball(4.0, (30.0, 0.0, 0.0))
    path = put(shared_folder, one.merge(other).extract_surface())
    assert region_size(meshing.read(path, size=4.0)) == pytest.approx(one.volume + other.volume, rel=1e-6)
    assert COMM.rank or "2 islands, which no node connects" in caplog.text
    assert region_size(meshing.read(path, size=4.0, keep="largest")) == pytest.approx(one.volume, rel=1e-6)


def test_an_open_surface_is_refused(shared_folder):
    """With the place of the hole."""
    surface = ball()
    hole = surface.extract_cells(np.arange(1, surface.n_cells)).extract_surface()
    assert "is open: 3 edges have one triangle, the first at (" in file_refusal(put(shared_folder, hole), size=4.0)


def test_a_surface_without_a_size_is_told_one(shared_folder):
    """In the file's own unit."""
    sentence = file_refusal(put(shared_folder, ball()))
    assert "such as size=0.8 (it extends by " in sentence


@pytest.mark.parametrize(
    ("parameters", "sentence"),
    [
        ({"size": -1.0}, "is -1.0: a positive number would be right"),
        ({"size": "3"}, "is '3': a positive number would be right"),
        ({"size": 1e-6}, "fewer than 30 million are right"),
        ({"size": 4.0, "remesh": 2}, "remesh, of"),
        ({"sizes": 4.0}, "has no parameter 'sizes': size and remesh would be right"),
    ],
)
def test_refused_parameters(shared_folder, parameters, sentence):
    """Each in a sentence."""
    assert sentence in file_refusal(put(shared_folder, ball()), **parameters)


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"solid nothing\nendsolid\n",
        b"solid x\nfacet normal 0 0 0\nouter loop\nvertex 0 0 nan\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n",
        bytes(80) + b"\xff\xff\xff\x7f" + bytes(50),
        bytes(83),
    ],
)
def test_what_is_no_surface_is_refused(shared_folder, content):
    """Headers that claim billions of triangles among them."""
    if COMM.rank == 0:
        (shared_folder / "body.stl").write_bytes(content)
    COMM.barrier()
    file_refusal(shared_folder / "body.stl", size=1.0)
