"""Serendipity elements, whose unknown of an edge is a mean along it and no value at its middle: nothing may show it."""

import basix
import numpy as np
import pytest
from blocks import block, cube, gathered, inside, run, square

import growthx as gx
from growthx.meshing.sampling import positions

variants = pytest.mark.parametrize("variant", [gx.S2Q1, gx.S2fri], ids=["S2Q1", "S2fri"])


def along_edges(cell, count=5):
    """Points of the reference cell on all its edges, corners and mid-edges among them, shape (points, dim)."""
    kind = basix.CellType[cell]
    ends = basix.geometry(kind)[np.array(basix.topology(kind)[1])]
    shares = np.linspace(0, 1, count)[:, np.newaxis]
    return np.concatenate([start + shares * (end - start) for start, end in ends])


def field(problem, X):
    """(x, u) at points of the reference cell, in all cells of all ranks, shapes (points, dim)."""
    dim = problem.scene.mesh.dim
    places = positions(problem.scene.mesh, X)[:, :, :dim].reshape(-1, dim)
    return gathered(places), gathered(problem.displacement_at(X).reshape(-1, dim))


@variants
def test_prescribed_displacements_hold_along_the_whole_edge(variant):
    """Between the corners, too: an edge whose mean is left free, or is taken for a value, bulges."""
    moved = (0.12, -0.05)
    scene = block(square(3, 0.08), supports=(gx.Support("left"), gx.Support("right", moved)), loads=())
    steps, problem = run(scene, variant)
    x, u = field(problem, along_edges("quadrilateral"))
    right, left = np.isclose(x[:, 0], 1.0), np.isclose(x[:, 0], 0.0)
    assert np.unique(x[right, 1].round(9)).size == 13, "corners, mid-edges and points between"
    assert u[right] == pytest.approx(np.tile(moved, (right.sum(), 1)), abs=1e-15)
    assert u[left] == pytest.approx(np.zeros((left.sum(), 2)), abs=1e-15)
    assert len(steps) == 4 and not any(step.rejected for step in steps)


@variants
def test_a_support_moves_with_the_load(variant):
    """Half of the ramp, half of the way: also between the corners, at the step itself."""
    rollers = (gx.Support("left", (0.0, None)), gx.Support("bottom", (None, 0.0)))
    scene = block(square(2, 0.08), supports=(*rollers, gx.Support("top", (None, 0.1))), loads=())
    problem = gx.discretise(scene, variant)
    next(gx.march(scene, variant, problem))
    x, u = field(problem, along_edges("quadrilateral"))
    top = np.isclose(x[:, 1], 1.0) & (x[:, 0] > 0.5)
    assert u[top, 1] == pytest.approx(0.05, rel=1e-14)
    assert np.abs(u[top, 0]).max() > 1e-3, "free to move along"


@variants
@pytest.mark.parametrize("shape", ["quadrilateral", "hexahedron"])
def test_a_linear_displacement_is_reproduced(variant, shape):
    """The patch test: on distorted cells of 8 and of 20 nodes a homogeneous state must be one at every point."""
    mesh = square(3, 0.08) if shape == "quadrilateral" else cube(2, 0.1)
    dim = mesh.dim
    planes = ("left", "bottom", "front")[:dim]
    pulled = tuple(0.2 if i == 0 else None for i in range(dim))
    supports = tuple(gx.Support(on, tuple(0.0 if i == k else None for i in range(dim))) for k, on in enumerate(planes))
    scene = block(mesh, supports=(*supports, gx.Support("right", pulled)), loads=())
    steps, problem = run(scene, variant, tolerance=1e-13)
    x, u = field(problem, np.concatenate([inside(shape, 20), along_edges(shape)]))
    gradient = np.linalg.lstsq(x, u, rcond=None)[0]
    assert gradient[0, 0] == pytest.approx(0.2, rel=1e-12)
    assert gradient[1, 1] < -0.02, "it must contract across for the test to mean something"
    assert u == pytest.approx(x @ np.diag(np.diag(gradient)), abs=1e-12)
    assert steps[-1].max_density == pytest.approx(steps[-1].min_density, rel=1e-12)
    assert steps[-1].max_density != pytest.approx(1.2, rel=1e-3)


@variants
@pytest.mark.parametrize("shape", ["quadrilateral", "hexahedron"])
def test_resultants_and_reactions_count_forces_once(variant, shape):
    """What corners and edges bear adds up to the load, with a corner that two supports share counted once."""
    mesh = square(3, 0.08) if shape == "quadrilateral" else cube(2, 0.1)
    value = np.array([0.1, -0.02, 0.03])[: mesh.dim]
    scene = block(
        mesh,
        supports=(gx.Support("left"), gx.Support("bottom", (None, 0.0, None)[: mesh.dim])),
        loads=(gx.Traction("right", tuple(value)),),
    )
    steps, problem = run(scene, variant)
    assert problem.system.loads.resultant(problem.system.loads.nodal_load) == pytest.approx(value, rel=1e-13)
    assert sum(steps[-1].reactions.values()) == pytest.approx(-value, abs=1e-9)
    weighted = gx.DistributedForce("right", tuple(value), weight=lambda x: 1 + x[1])
    problem = gx.discretise(block(mesh, loads=(weighted,)), variant)
    assert problem.system.loads.resultant(problem.system.loads.nodal_load) == pytest.approx(value, rel=1e-13)


@variants
def test_a_body_that_is_pulled_pulls_back(variant):
    """Without a load the two supports' forces are equal and opposite, component by component."""
    scene = block(square(3, 0.08), supports=(gx.Support("left"), gx.Support("right", (0.1, 0.04))), loads=())
    steps, _ = run(scene, variant, tolerance=1e-12)
    assert steps[-1].reactions["right"] == pytest.approx(-steps[-1].reactions["left"], abs=1e-10)
    assert steps[-1].reactions["right"][0] > 0.05 and steps[-1].reactions["right"][1] > 0.005
