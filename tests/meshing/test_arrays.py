"""Meshes of arrays as other libraries have them, and what is made of any file's content: names, planes, seams, islands.

All of it is looked at on the mesh that comes out of it, spread over the ranks.
"""

import re

import dolfinx
import numpy as np
import pytest
from blocks import COMM, block, boundary_size, region_size, strip

import growthx as gx
from growthx import meshing
from growthx.common.errors import InputError

SQUARES = [[0, 0], [1, 0], [2, 0], [0, 1], [1, 1], [2, 1]]  # nodes of two unit squares side by side
QUADS = [[0, 1, 4, 3], [1, 2, 5, 4]]
TRIANGLES = [[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4]]
ENDS = {"left": [[0, 3]], "right": [[2, 5]]}
CUBE = [[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)]
HEXAHEDRON = [[0, 1, 3, 2, 4, 5, 7, 6]]


def box(mesh):
    x = mesh.domain.geometry.x
    return COMM.allreduce(x.min(axis=0), lambda a, b: np.minimum(a, b)).tolist(), COMM.allreduce(
        x.max(axis=0), lambda a, b: np.maximum(a, b)
    ).tolist()


def values(mesh, field):
    """Value of a field of one per cell by the middle of the cell, over all ranks."""
    middles = dolfinx.mesh.compute_midpoints(mesh.domain, mesh.dim, mesh.owned_cells)
    pairs = zip(middles.round(6).tolist(), field.x.array[: len(middles)].tolist(), strict=True)
    return {tuple(at[: mesh.dim]): value for part in COMM.allgather(list(pairs)) for at, value in part}


def refusal(*arrays, **named):
    with pytest.raises(InputError) as caught:
        meshing.from_arrays(*arrays, **named)
    (sentence,) = set(COMM.allgather(str(caught.value)))
    assert "\n" not in sentence
    return sentence


@pytest.mark.parametrize("cells", [QUADS, TRIANGLES], ids=["quadrilaterals", "triangles"])
def test_a_plane_mesh(cells):
    """Cells in VTK's order; facets, sets of nodes, numbers of cells and marks of cells name its parts."""
    half = len(cells) // 2
    mesh = meshing.from_arrays(
        np.array(SQUARES),
        cells,
        regions={"soft": list(range(half)), "stiff": np.arange(len(cells)) >= half},
        boundaries={"left": [0, 3], "right": [[5, 2]], "bottom": [2, 1, 0], "middle": [[1, 4]]},
    )
    assert mesh.cell_count == len(cells)
    assert [region_size(mesh, name) for name in (None, "soft", "stiff")] == pytest.approx([2, 1, 1], rel=1e-14)
    lengths = {name: boundary_size(mesh, name) for name in mesh.boundaries}
    assert lengths == pytest.approx({"left": 1, "right": 1, "bottom": 2, "middle": 1}, rel=1e-14)


def test_a_strip_of_arrays_is_as_long_as_it_should_be():
    """1.1049876 and 1.0100500 of each square: the strip of two materials."""
    mesh = meshing.from_arrays(SQUARES, QUADS, regions={"soft": [0], "stiff": [1]}, boundaries=ENDS)
    assert strip(mesh) == pytest.approx((0.1150376, -0.1), abs=1e-7)


def test_a_mesh_in_space():
    """A cube as one hexahedron, and as tetrahedra around its middle, half of them turned over."""
    cube = meshing.from_arrays(CUBE, HEXAHEDRON, boundaries={"bottom": [0, 1, 2, 3]})
    assert (cube.dim, cube.cell_name) == (3, "hexahedron")
    assert (region_size(cube), boundary_size(cube, "bottom")) == pytest.approx((1, 1), rel=1e-14)
    faces = [[0, 1, 2], [3, 2, 1], [4, 5, 6], [7, 6, 5], [0, 1, 4], [5, 4, 1], [2, 3, 6], [7, 6, 3]]
    faces += [[0, 2, 4], [6, 4, 2], [1, 3, 5], [7, 5, 3]]
    middle = np.vstack([CUBE, [[0.5, 0.5, 0.5]]])
    cells = np.column_stack([faces, np.full(12, 8)])
    tetrahedra = meshing.from_arrays(middle, cells, boundaries={"top": [4, 5, 6, 7], "bottom": faces[:2]})
    assert (tetrahedra.cell_name, tetrahedra.cell_count) == ("tetrahedron", 12)
    assert region_size(tetrahedra) == pytest.approx(1, rel=1e-14)
    assert [boundary_size(tetrahedra, name) for name in ("top", "bottom")] == pytest.approx([1, 1], rel=1e-14)


def test_what_has_no_name():
    """Without regions all cells are one; where some have a region, the others are named, and told."""
    assert list(meshing.from_arrays(SQUARES, QUADS).regions) == ["all"]


def test_cells_in_no_region_are_told(caplog):
    """They are not lost, nor silently of a region that is not theirs."""
    mesh = meshing.from_arrays(SQUARES, QUADS, regions={"soft": [0]})
    assert region_size(mesh, "all") == pytest.approx(1)
    if COMM.rank == 0:
        assert "1 of the 2 cells of the arrays are in no group: they are the region 'all'" in caplog.text


@pytest.mark.parametrize(
    ("axes", "height", "kept"),
    [((0, 1), 5.0, "x and y"), ((0, 2), 0.0, "x and z"), ((1, 2), -3.0, "y and z"), ((0, 1), 0.0, None)],
)
def test_a_plane_elsewhere_in_space(caplog, axes, height, kept):
    """Sections are cut at a height, or drawn in the coronal plane: what is left out is told."""
    points = np.full((6, 3), height)
    points[:, axes] = SQUARES
    mesh = meshing.from_arrays(points, QUADS, regions={"soft": [0], "stiff": [1]}, boundaries=ENDS)
    assert box(mesh) == ([0, 0, 0], [2, 1, 0])
    assert strip(mesh) == pytest.approx((0.1150376, -0.1), abs=1e-7)
    if COMM.rank == 0:
        assert (f"the file's {kept}" in caplog.text) == (kept is not None)
        assert bool(caplog.records) == (kept is not None)


def test_a_surface_in_space_is_refused():
    """It is no body: what it encloses may be meant, or another file."""
    points = np.column_stack([SQUARES, [0, 0.1, 0, 0, 0, 0]])
    assert refusal(points, TRIANGLES).startswith("the surfaces of the arrays leave every plane of two coordinates")


def test_elements_of_second_order_keep_their_corners(caplog):
    """One quarter of a disc, of which the chord is left: area 1/2, and a word on it."""
    s = np.sqrt(0.5)
    points = [[0, 0], [1, 0], [0, 1], [0.5, 0], [s, s], [0, 0.5]]
    mesh = meshing.from_arrays(points, [[0, 1, 2, 3, 4, 5]])
    assert region_size(mesh) == pytest.approx(0.5, rel=1e-14)
    assert COMM.rank or "their corners are kept, and their sides are straight" in caplog.text


def test_nodes_that_no_cell_has_do_not_count():
    """Orphans: not for the extent, nor for the plane, nor as degrees of freedom."""
    points = np.vstack([np.column_stack([SQUARES, np.zeros(6)]), [[100, 100, 100]]])
    mesh = meshing.from_arrays(points, QUADS, boundaries={"left": [0, 3, 6]})
    assert box(mesh)[1] == [2, 1, 0]
    assert mesh.domain.geometry.index_map().size_global == 6
    assert boundary_size(mesh, "left") == 1


SEAM = [*SQUARES, [1, 0], [1, 1]]
TORN = [[0, 1, 4, 3], [6, 2, 5, 7]]


def test_nodes_in_one_place_are_told(caplog):
    """Two parts of an assembly that seem to be one: the seam is told, and so are the islands that it makes."""
    mesh = meshing.from_arrays(SEAM, TORN)
    assert mesh.domain.geometry.index_map().size_global == 8
    if COMM.rank == 0:
        assert "2 nodes of the arrays stand where another does, the first at (1, 0)" in caplog.text
        told = (
            "2 islands, which no node connects: 1 quadrilateral of area 1 about (0.5, 0.5); 1 quadrilateral of area 1"
        )
        assert told in caplog.text


def test_nodes_in_one_place_become_one_where_it_is_asked_for(caplog):
    """Then the strip is one body: sets of nodes and facets follow."""
    mesh = meshing.from_arrays(
        SEAM,
        TORN,
        regions={"soft": [0], "stiff": [1]},
        boundaries={"left": [0, 3], "right": [[2, 5]], "middle": [[6, 7]], "bottom": [0, 1, 6, 2]},
        merge=True,
    )
    assert not caplog.records
    assert strip(mesh) == pytest.approx((0.1150376, -0.1), abs=1e-7)
    assert (boundary_size(mesh, "middle"), boundary_size(mesh, "bottom")) == pytest.approx((1, 2))


def test_islands_are_told_and_left_out_where_it_is_asked_for(caplog):
    """Voxels of a scan: each crumb with its cells and volume; the numbers of cells in arrays stay the file's."""
    points = np.vstack([SQUARES, np.array(SQUARES[:2] + SQUARES[3:5]) / 4 + 5])
    cells = [[6, 7, 9, 8], *QUADS]
    data = {"grey": [7.0, 1.0, 2.0]}
    named = {"boundaries": {"left": [[1, 4], [6, 8]], "crumb": [[6, 8]]}, "cell_data": data}
    mesh = meshing.from_arrays(points, cells, **named)
    assert mesh.cell_count == 3
    assert COMM.rank or "1 quadrilateral of area 0.0625 about (5.125, 5.125)" in caplog.text
    mesh = meshing.from_arrays(points, cells, keep="largest", **named)
    assert (mesh.cell_count, region_size(mesh), list(mesh.boundaries)) == (2, pytest.approx(2), ["left"])
    assert boundary_size(mesh, "left") == pytest.approx(1)
    assert values(mesh, mesh.cell_values("grey")) == {(0.5, 0.5): 1.0, (1.5, 0.5): 2.0}
    assert values(mesh, mesh.cell_values([5.0, 6.0, 7.0])) == {(0.5, 0.5): 6.0, (1.5, 0.5): 7.0}
    if COMM.rank == 0:
        assert "left out of the arrays, since they are not connected to most of it: 1 quadrilateral" in caplog.text
        assert "1 of the 2 elements of the group 'left'" in caplog.text


def test_islands_of_voxels_are_told_and_left_out_where_it_is_asked_for(caplog):
    """Crumbs of a scan in space: each with its cells, volume and place, the largest first."""
    full = np.zeros((6, 6, 6), dtype=bool)
    full[5, 5, 5] = full[0, 4:, 0] = full[:2, :2, 3:5] = True
    z, y, x = np.nonzero(full)
    cells = np.add.outer(x + 7 * (y + 7 * z), [0, 1, 8, 7, 49, 50, 57, 56])
    points = np.stack(np.meshgrid(*[np.arange(7) / 2] * 3, indexing="ij")[::-1], axis=-1).reshape(-1, 3)
    assert meshing.from_arrays(points, cells).cell_count == 11
    told = (
        "3 islands, which no node connects: 8 hexahedra of volume 1 about (2, 0.5, 0.5); 2 hexahedra of volume 0.25 "
        "about (0.25, 2.5, 0.25); 1 hexahedron of volume 0.125 about (2.75, 2.75, 2.75); each must be held"
    )
    assert COMM.rank or told in caplog.text
    mesh = meshing.from_arrays(points, cells, keep="largest")
    assert (mesh.cell_count, region_size(mesh)) == (8, pytest.approx(1))
    assert COMM.rank or "since they are not connected to most of it: 2 hexahedra of volume 0.25" in caplog.text


@pytest.mark.parametrize("refine", [1, 3])
def test_values_of_cells_are_in_the_order_of_the_arrays(refine):
    """Whatever order the ranks have them in; the pieces of a split cell have its value."""
    mesh = meshing.from_arrays(SQUARES, QUADS[::-1], cell_data={"density": [0.2, 0.1]}, refine=refine)
    found = values(mesh, mesh.cell_values("density"))
    assert len(found) == 2 * refine**2
    assert all(value == (0.1 if at[0] < 1 else 0.2) for at, value in found.items())
    assert values(mesh, mesh.cell_values(np.array([0.2, 0.1]))) == found


def test_many_cells_have_their_own_values():
    """Thousands of triangles in random order: each has the value of its own middle, on any number of ranks."""
    n = 40
    y, x = (grid.ravel() for grid in np.mgrid[: n + 1, : n + 1])
    first = np.flatnonzero((x < n) & (y < n))
    cells = np.concatenate([np.add.outer(first, [0, 1, n + 2]), np.add.outer(first, [0, n + 2, n + 1])])
    cells = np.random.default_rng(0).permutation(cells)
    points = np.column_stack([x, y]) / n
    data = points[cells].mean(axis=1) @ [1.0, 10.0]
    mesh = meshing.from_arrays(points, cells, cell_data={"data": data})
    field = mesh.cell_values("data")
    middles = dolfinx.mesh.compute_midpoints(mesh.domain, 2, mesh.local_cells)
    assert field.x.array == pytest.approx(middles @ [1.0, 10.0, 0.0], rel=1e-12)


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1, gx.Q1Q1, gx.Q2])
def test_values_of_cells_are_fields(variant):
    """As a Function by name, as an array, by region: initial density, modulus and attractor have their full effect."""
    mesh = meshing.from_arrays(
        SQUARES,
        QUADS,
        regions={"soft": [0], "stiff": [1]},
        boundaries={**ENDS, "top": [3, 4, 5]},
        cell_data={"rho": [0.8, 1.1], "E": [400, 600], "a": [0.01, 0.03]},
    )

    def solved(density, modulus, attractor):
        scene = block(
            mesh,
            material=gx.Material(modulus, 0.3, 1.2, 2.0),
            growth=gx.EnergyDrivenGrowth(attractor=attractor, exponent=3.0, rate=1.0),
            initial_density=density,
        )
        return gx.solve(scene, variant).problem.mass()

    by_region = [{"soft": a, "stiff": b} for a, b in ((0.8, 1.1), (400.0, 600.0), (0.01, 0.03))]
    expected = solved(*by_region)
    assert solved(*map(mesh.cell_values, ("rho", "E", "a"))) == pytest.approx(expected, rel=1e-13)
    arrays = [np.array([one["soft"], one["stiff"]]) for one in by_region]
    assert solved(*arrays) == pytest.approx(expected, rel=1e-13)
    mixed = {"soft": arrays[0], "stiff": 1.1}
    assert solved(mixed, arrays[1], by_region[2]) == pytest.approx(expected, rel=1e-13)
    assert solved(1.2, 500.0, 0.02) != pytest.approx(expected, rel=1e-3)


def test_values_that_some_cells_have_not():
    """They are refused, unless there is one for all others."""
    mesh = meshing.from_arrays(SQUARES, QUADS, cell_data={"rho": [0.8, np.nan]})
    with pytest.raises(InputError, match=r"'rho' are no numbers in 1 of 2 cells: .* elsewhere="):
        mesh.cell_values("rho")
    assert values(mesh, mesh.cell_values("rho", elsewhere=1.2)) == {(0.5, 0.5): 0.8, (1.5, 0.5): 1.2}
    with pytest.raises(InputError, match=r"^the value elsewhere is 'no': a number would be right$"):
        mesh.cell_values("rho", elsewhere="no")


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ("grey", "the mesh came without values 'grey' of its cells; it has 'rho'"),
        ([1.0], r"the values of cells are \[1.0\], of shape \(1,\): one number for each of the 2 cells of the file"),
        (["a", "b"], "the values of cells are .*: one number for each of the 2 cells"),
        ([[1.0], [1.0, 2.0]], "the values of cells are .*: one number for each of the 2 cells"),
        ([1.0, np.inf], "the values 'cell values' are no numbers in 1 of 2 cells"),
        (None, "the values of cells are None"),
    ],
)
def test_refused_values(given, sentence):
    """On all ranks alike."""
    mesh = meshing.from_arrays(SQUARES, QUADS, cell_data={"rho": [0.8, 1.2]})
    with pytest.raises(InputError, match=f"^{sentence}"):
        mesh.cell_values(given)


@pytest.mark.skipif(COMM.size == 1, reason="one rank has no other")
def test_values_must_be_the_same_on_all_ranks():
    """Which of them would count?"""
    mesh = meshing.from_arrays(SQUARES, QUADS)
    with pytest.raises(InputError, match=r"differ from rank to rank"):
        mesh.cell_values([1.0, float(COMM.rank)])


def test_values_on_a_mesh_of_dolfinx():
    """In the order in which DOLFINx was given its cells, which the mesh knows."""
    mesh = gx.Mesh.with_names(dolfinx.mesh.create_unit_square(COMM, 3, 3), {})
    count = mesh.cell_count
    found = COMM.allgather(mesh.cell_values(np.arange(count)).x.array[: len(mesh.owned_cells)].tolist())
    assert sorted(value for part in found for value in part) == list(range(count))


GOOD = {"points": SQUARES, "cells": QUADS}


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"points": 3}, "the points are 3: two or three numbers for each node"),
        ({"points": [[0, 0], [1]]}, "the points are "),
        ({"points": [["a", "b"]]}, "the points are "),
        ({"points": [[0, 0, 0, 0]]}, "the points are "),
        ({"points": [*SQUARES[:5], [np.nan, 1]]}, "the arrays has nodes that are nowhere"),
        ({"points": [*SQUARES[:5], [1e300, 1]]}, "the arrays has nodes that are nowhere"),
        ({"cells": [[0, 1, 4, 6]]}, "the numbers of the cells have 6 among them: whole numbers from 0, below 6"),
        ({"cells": [[0, 1, 4, -1]]}, "the numbers of the cells have -1 among them"),
        ({"cells": [[0.0, 1.0, 4.0, 3.0]]}, "the numbers of the cells are "),
        ({"cells": [0, 1, 4, 3]}, r"the numbers of the cells are of shape \(4,\)"),
        ({"cells": [[0, 1], [1, 2, 3]]}, "the cells: .* are no such numbers"),
        ({"cells": np.empty((0, 4), dtype=int)}, "the cells are none at all"),
        ({"cells": [[0, 1, 2, 3, 4]]}, "the cells have 5 nodes each: 3, 4 or 8"),
        ({"cells": [[0, 4, 1, 3]]}, "1 of the 1 cells of the arrays are inverted or have a corner"),
        ({"shape": "cube"}, "the shape of the cells is 'cube': one of triangle"),
        ({"shape": "hexahedron"}, "the cells have 4 nodes each: 8 would be right for a hexahedron"),
        ({"regions": ["bone"]}, "regions, of arrays, is"),
        ({"regions": {3: [0]}}, "a name in the regions of arrays is 3: a name in quotes would be right"),
        ({"regions": {"bone": [2]}}, "the numbers of the region 'bone' have 2 among them"),
        ({"regions": {"bone": [True]}}, r"the region 'bone' has \(1,\) marks: one for each of the 2 cells"),
        ({"regions": {"bone": []}}, "the region 'bone' has no cells"),
        ({"boundaries": {"left": []}}, "the boundary 'left' has no facets or nodes"),
        ({"boundaries": {"left": [[0, 5]]}}, "the group 'left' of the arrays is not made of sides of cells"),
        ({"boundaries": {"left": [7]}}, "the numbers of the boundary 'left' have 7 among them"),
        ({"cell_data": {"rho": [1.0]}}, "the cell data 'rho' are .*: one number for each of the 2 cells"),
        ({"keep": "smallest"}, "keep is 'smallest': None, for all cells, or \"largest\" would be right"),
        ({"merge": 1e-6}, "merge is 1e-06: True or False would be right"),
        ({"refine": 0}, "refine is 0: a whole number"),
    ],
)
def test_refused_arrays(change, sentence):
    """One sentence, on all ranks."""
    arrays = {**GOOD, **change}
    assert re.match(sentence, refusal(arrays.pop("points"), arrays.pop("cells"), **arrays))


def test_triangles_among_quadrilaterals_are_refused_with_the_cure(shared_folder):
    """What gmsh leaves where it recombines: the sentence says how not to."""
    path = shared_folder / "mixed.msh"
    if COMM.rank == 0:
        nodes = "\n".join(f"{number} {x} {y} 0" for number, (x, y) in enumerate(SQUARES, start=1))
        path.write_text(
            f"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n6\n{nodes}\n$EndNodes\n$Elements\n3\n"
            "1 3 2 1 1 1 2 5 4\n2 2 2 1 1 2 3 6\n3 2 2 1 1 2 6 5\n$EndElements\n"
        )
    COMM.barrier()
    with pytest.raises(InputError, match=r"1 quadrilateral and 2 triangles: .*RecombinationAlgorithm = 2"):
        meshing.read(path)


@pytest.mark.parametrize(
    ("points", "cells", "right"),
    [
        (SQUARES, [[0, 1, 4], [4, 3, 0], [2, 1, 5], [4, 5, 1]], True),
        (SQUARES, [QUADS[0][::-1], QUADS[1]], True),
        ([*SQUARES[:5], [0.5, 0.2]], [[0, 1, 4], [1, 0, 5]], False),
        ([*SQUARES[:5], [0.4, 0.5], [0.6, 0.5]], [QUADS[0], [1, 0, 5, 6]], False),
        ([*CUBE, [0.2, 0.2, 0.5]], [[0, 1, 2, 4], [0, 2, 1, 8]], False),
        ([*CUBE, [0.2, 0.2, -0.5]], [[0, 1, 2, 4], [0, 1, 2, 8]], True),
        (SQUARES, [[0, 1, 4], [0, 3, 4], [4, 0, 2]], False),
    ],
)
def test_cells_may_be_numbered_in_either_sense_but_not_overlap(points, cells, right):
    """What a sign tells of one cell, it does not of two: they must lie on both sides of the side that they share."""
    if right:
        assert meshing.from_arrays(points, cells).cell_count == len(cells)
    else:
        assert re.search(r"overlap a neighbour|share one side", refusal(points, cells))
