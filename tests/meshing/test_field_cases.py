"""Files as people bring them, each different in one way from those of our own scripts, with the right values.

The strip: two unit squares, E = 1 ("soft") and 10 ("stiff"), pulled with 0.1, see `blocks.strip`.
"""

from pathlib import Path

import dolfinx
import numpy as np
import pytest
from blocks import COMM, block, boundary_size, region_size, strip

import growthx as gx
from growthx import meshing
from growthx.common.errors import InputError

FILES = Path(__file__).parent / "files"
STRIP = pytest.approx((0.1150376, -0.1), abs=1e-7)


def read(name, **options):
    return meshing.read(FILES / name, **options)


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("two_good.msh", ""),
        ("two_one_entity.msh", ""),
        ("WITH_BOM.MSH", ""),
        ("plane_at_z5.msh", "z = 5 everywhere: z is left out, and the mesh's two coordinates are the file's x and y"),
        ("plane_xz.msh", "y = 0 everywhere: y is left out, and the mesh's two coordinates are the file's x and z"),
        ("two.inp", ""),
    ],
)
def test_the_strip_in_every_dress(caplog, name, told):
    """Elementary tags that separate nothing, a mark of byte order, other planes, Abaqus: one strip."""
    mesh = read(name)
    if name.endswith(".inp"):
        mesh = gx.Mesh(
            mesh.domain,
            {key.lower(): facets for key, facets in mesh.boundaries.items()},
            {key.lower(): cells for key, cells in mesh.regions.items()},
        )
    assert (mesh.cell_count, sorted(mesh.boundaries)) == (2, ["left", "right"])
    assert [region_size(mesh, name) for name in ("soft", "stiff")] == pytest.approx([1, 1], rel=1e-12)
    assert [boundary_size(mesh, name) for name in ("left", "right")] == pytest.approx([1, 1], rel=1e-12)
    assert strip(mesh) == STRIP
    if COMM.rank == 0:
        assert told in caplog.text and bool(caplog.records) == bool(told)


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1, gx.Q2])
def test_groups_without_names_have_their_numbers(variant):
    """As Salome and converters write them."""
    mesh = read("no_names.msh")
    assert (sorted(mesh.regions), sorted(mesh.boundaries)) == (["1", "2"], ["3", "4"])
    ends = {"left": mesh.boundary("3"), "right": mesh.boundary("4")}
    assert strip(gx.Mesh(mesh.domain, ends, mesh.regions), "1", "2", variant) == STRIP


def test_groups_that_overlap_in_version_2():
    """gmsh writes a shared cell once for each group: it is one cell in several."""
    mesh = read("overlap_msh22.msh")
    assert mesh.cell_count == 2
    assert [region_size(mesh, name) for name in (None, "bone", "head")] == pytest.approx([2, 2, 1], rel=1e-12)


def test_a_traction_inside_the_body_has_its_effect():
    """On both sides of the interface the strip is as long as under a force at its end; reaction −0.1."""
    mesh = read("interface.geo")
    scene = gx.Scene(
        name="strip",
        mesh=mesh,
        material=gx.Material(young=1.0, poisson=0.0),
        growth=gx.EnergyDrivenGrowth(attractor=0.0, rate=0.0),
        supports=(gx.Support("left", (0.0, None)), gx.PointSupport((0.0, 0.0), (None, 0.0))),
        loads=(gx.Traction("interface", (0.1, 0.0)),),
        program=gx.Program(step=1.0, until=1.0),
    )
    result = gx.solve(scene, gx.Q1)
    u = result.problem.sample_displacement(np.array([[1.0, 0.5], [2.0, 0.5]]))[:, 0]
    assert u == pytest.approx([0.1049876, 0.1049876], abs=1e-7)
    assert result.steps[-1].reactions["left"][0] == pytest.approx(-0.1, abs=1e-9)
    with pytest.raises(InputError, match="interface"):
        pressed = block(mesh, loads=(gx.Pressure("interface", 0.1),))
        gx.solve(pressed, gx.Q1)


def test_a_triangle_turned_over_is_a_triangle():
    """Simplices are numbered in mixed sense by many programs."""
    mesh = read("one_turned_triangle.msh")
    assert region_size(mesh) == pytest.approx(1.0, rel=1e-12)


def test_elements_of_second_order(caplog):
    """A disc of eight chords, and a word on it."""
    mesh = read("disc_order2.geo")
    assert region_size(mesh) == pytest.approx(2.8284, abs=1e-4)
    assert COMM.rank or "sides are straight" in caplog.text


@pytest.mark.parametrize("way", ["by name", "array"])
def test_values_of_elements_are_in_the_order_of_the_file(way):
    """Not in space: each cell has its own, on any number of ranks."""
    mesh = read("order_of_cells.msh")
    field = mesh.cell_values("density" if way == "by name" else [0.4, 0.1, 0.3, 0.2])
    middles = dolfinx.mesh.compute_midpoints(mesh.domain, 2, mesh.owned_cells)[:, :2]
    rows = zip(middles.round(9).tolist(), field.x.array[: len(middles)].tolist(), strict=True)
    found = {tuple(at): value for part in COMM.allgather(list(rows)) for at, value in part}
    assert found == {(0.5, 0.5): 0.1, (1.5, 0.5): 0.2, (0.5, 1.5): 0.4, (1.5, 1.5): 0.3}
