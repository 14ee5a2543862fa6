"""Pictures show what was computed: which values, on which shape."""

import matplotlib.image
import numpy as np
import pytest
from mpi4py import MPI

import growthx as gx
from growthx import plots
from growthx.scenes.bar import DISCONTINUOUS

COMM = MPI.COMM_WORLD


@pytest.fixture(scope="module", params=["Q1Q1", "Q1P0", "Q1"])
def problem(request):
    """A small bent plate."""
    scene = gx.scenes.plate(4)
    return gx.solve(scene, gx.variants.named(request.param)).problem


def test_picture_has_body_colours_and_background(problem, shared_folder):
    """A picture that is all white, or missing, would go unnoticed in a long run."""
    path = shared_folder / "density.png"
    plots.density(problem, path, title="density (-)")
    COMM.barrier()
    image = matplotlib.image.imread(path)[:, :, :3]
    coloured = np.abs(image - image.mean(axis=2, keepdims=True)).max(axis=2) > 0.1
    assert 0.05 < coloured.mean() < 0.9
    assert np.all(image[-1, -1] == 1.0)
    assert len(np.unique((image[coloured] * 16).astype(int), axis=0)) > 8  # a range of densities, not one


def test_values_drawn_are_those_of_the_variant(problem):
    """Raw values are drawn: each integration point's on its own part of the cell, and no averages."""
    ticks = plots._ticks(problem)
    X, _, middles = plots._pieces("quadrilateral", ticks)
    at = X if problem.variant.name == "Q1Q1" else middles
    values = problem.density_at(at)
    drawn = COMM.allreduce(float(values.min()), MPI.MIN), COMM.allreduce(float(values.max()), MPI.MAX)
    assert drawn == pytest.approx(problem.density_range(), rel=1e-14)
    pieces = {"Q1Q1": 1, "Q1P0": 1, "Q1": 4}[problem.variant.name]
    assert len(middles) == pieces


def test_deformed_shape_reaches_the_tip(problem):
    """The shape drawn is the deformed one: its loaded end lies where the displacement says."""
    from growthx.sampling import positions
    from growthx.scenes.plate import tip_displacement

    X = np.array([[1.0, 1.0]])
    mesh = problem.scene.mesh
    ends = positions(mesh, X)[:, 0]
    moved = ends[:, 1] + problem.displacement_at(X)[:, 0, 1]
    corner = np.isclose(ends[:, 0], 2.0) & np.isclose(ends[:, 1], 0.5)
    here = float(moved[corner][0]) if corner.any() else -np.inf
    assert COMM.allreduce(here, MPI.MAX) == pytest.approx(0.5 + tip_displacement(problem), rel=1e-12)


def test_profile_of_the_bar_is_ordered_and_complete(shared_folder):
    """The curve over the length runs from one end to the other, once, on any number of ranks."""
    bar = gx.scenes.bar(DISCONTINUOUS, 10, until=0.2)
    problem = gx.solve(bar, gx.Q1).problem
    x, rho = plots._profile(problem)
    if COMM.rank == 0:
        assert len(x) == len(rho) == 410
        assert np.all(np.diff(x) >= 0) and x[0] < 1e-6 and x[-1] > 1 - 1e-6
    path = shared_folder / "profile.png"
    plots.along_length({"Q1": problem}, path, exact={"one": lambda x: 1.0})
    COMM.barrier()
    assert path.stat().st_size > 10_000


def test_three_dimensions_are_refused():
    """Pictures are of plane bodies: a sentence says what to use instead."""
    import dolfinx

    domain = dolfinx.mesh.create_unit_cube(COMM, 2, 2, 2, dolfinx.mesh.CellType.hexahedron)
    mesh = gx.Mesh.with_names(domain, {"bottom": lambda x: np.isclose(x[2], 0), "top": lambda x: np.isclose(x[2], 1)})
    scene = gx.Scene(
        "cube",
        mesh,
        gx.Material(young=1.0),
        gx.EnergyDrivenGrowth(attractor=0.01),
        (gx.Support("bottom"),),
        (gx.Traction("top", (0.0, 0.0, 0.1)),),
        gx.Program(step=1.0, until=1.0),
    )
    with pytest.raises(gx.InputError, match="the body has 3 dimensions"):
        plots.density(gx.discretise(scene, gx.Q1P0), "never.png")
