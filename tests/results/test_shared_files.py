"""Raw fields share files with the others, and pieces of cells their points: half of the room and time, and no digit
less."""

import errno
import os
import pathlib

import numpy as np
import pytest
from blocks import COMM, block, cube, square

import growthx as gx
from growthx import results
from growthx.discretisation.variants import CATALOGUE
from growthx.meshing.sampling import positions
from growthx.post.subcells import subcells
from growthx.results.fields import tells_raw
from growthx.results.states.pieces import Pieces, joined

SHARING = ("Q1P0", "P1P0", "Q1Q1", "P1P1", "S2Q1", "P2P1")


def shown(folder, name):
    """The arrays that VTK finds in the only state of a series, at points and in cells."""
    pyvista = pytest.importorskip("pyvista")
    grid = pyvista.read(folder / f"{name}000000.pvtu")
    return [{key: np.asarray(data[key]) for key in data} for data in (grid.point_data, grid.cell_data)]


@pytest.mark.serial
@pytest.mark.parametrize("name", CATALOGUE)
def test_one_file_has_both_where_it_can(name, tmp_path):
    """One on disk under two names; each series shows its own arrays, and raw ones are the variant's to the last bit."""
    variant = CATALOGUE[name]
    problem = gx.solve(block(square(3, 0.05, shape=variant.cells[0])), variant, out=tmp_path / "out").problem
    files = [tmp_path / "out" / f"{series}_p0_000000.vtu" for series in ("fields", "raw")]
    assert tells_raw(problem) == (name in SHARING) == files[0].samefile(files[1])
    at_points, in_cells = shown(tmp_path / "out", "raw")
    others = shown(tmp_path / "out", "fields")
    assert set(others[0]) == {"displacement", "smoothed_density"} and "major_stress" in others[1]
    if variant.density.local:
        assert set(at_points) == {"displacement"} and set(in_cells) == {"density", "relative_change", "stimulus"}
    else:
        assert set(at_points) == {"displacement", "density"} and not in_cells
    if name in SHARING and variant.density.local:
        assert np.array_equal(in_cells["density"], problem.densities_of_cells()[:, 0])
        assert np.array_equal(in_cells["relative_change"], problem.densities_of_cells()[:, 0] / 1.2 - 1)
        assert np.array_equal(in_cells["density"], others[1]["density"])
    elif name in SHARING:
        assert np.array_equal(np.sort(at_points["density"]), np.sort(problem.density.x.array))


@pytest.mark.parametrize("variant", [gx.Q1P0, gx.Q1Q1], ids=str)
def test_what_rests_or_varies_has_files_of_its_own(variant, shared_folder):
    """Where a nodal density jumps, cells need nodes of their own; means of one of each cell are what they are."""
    scene = block(square(4, shape="quadrilateral"), growing=("bone",))
    problem = gx.solve(scene, variant, out=shared_folder / "out").problem
    COMM.barrier()
    assert tells_raw(problem) == (variant is gx.Q1P0)
    assert "grows" in shown(shared_folder / "out", "raw")[1]


def test_a_disk_without_second_names_gets_copies(shared_folder, monkeypatch):
    """As file systems of sticks and of some clusters."""

    def refuse(self, target):
        raise OSError(errno.EPERM, os.strerror(errno.EPERM))

    monkeypatch.setattr(pathlib.Path, "hardlink_to", refuse)
    gx.solve(block(square(2)), gx.Q1P0, out=shared_folder / "out")
    COMM.barrier()
    files = [shared_folder / "out" / f"{series}_p{COMM.rank}_000000.vtu" for series in ("fields", "raw")]
    assert not files[0].samefile(files[1]) and files[0].read_bytes() == files[1].read_bytes()


@pytest.mark.parametrize("name", ["Q1", "Q2", "P2", "S2fri", "P1"])
@pytest.mark.parametrize("dim", [2, 3])
def test_pieces_share_the_points_that_are_the_same(name, dim):
    """As many as there are different places, all of which move as the cells say."""
    variant = CATALOGUE[name]
    shape = variant.cells[dim - 2]
    mesh = square(3, 0.05, shape=shape) if dim == 2 else cube(2, 0.05, shape)
    problem = gx.discretise(block(mesh), variant)
    problem.displacement.interpolate(lambda x: np.sin(3 * x[:dim]) * x[1])
    parts = subcells(shape, variant.integration_points(shape))
    pieces = Pieces(problem, parts)
    places = positions(mesh, parts.X).reshape(-1, 3)
    assert len(pieces.grid.points) == len(np.unique(places.round(9), axis=0)) < len(places) or not len(places)
    _, numbers = joined(mesh, parts.X)
    assert pieces.grid.points[numbers.ravel()] == pytest.approx(places, abs=1e-13)
    moved = problem.displacement_at(parts.X).reshape(-1, dim)
    assert pieces.displacement()["displacement"][numbers.ravel()][:, :dim] == pytest.approx(moved, abs=1e-13)
    cells = pieces.grid.cells
    assert len(cells) == len(mesh.owned_cells) * len(parts.pieces)


@pytest.mark.serial
def test_a_slit_keeps_the_points_of_both_sides():
    """On its sides displacements differ: places alone do not tell whether two points are one."""
    points = [[i, j] for j in range(3) for i in range(3)] + [[1, 0]]
    cells = [[0, 1, 4, 3], [9, 2, 5, 4], [3, 4, 7, 6], [4, 5, 8, 7]]
    mesh = gx.meshing.from_arrays(np.array(points, dtype=float), cells)
    X = subcells("quadrilateral", gx.Q1.integration_points("quadrilateral")).X
    first, _ = joined(mesh, X)
    assert len(first) == 27  # 25, two of which are there twice


def test_the_density_of_a_cell_is_no_mean():
    """Sums of weights would round what a variant knows exactly; files of fields and raw ones must agree to the bit."""
    problem = gx.solve(block(square(3, 0.05)), gx.Q1P0).problem
    assert results.cell_fields(problem)["density"] == pytest.approx(problem.densities_of_cells()[:, 0], rel=1e-14)
