"""Densities of one cell against the balance of mass written out with NumPy: where each variant takes its energy."""

import basix
import numpy as np
import pytest
from blocks import COMM, ROLLERS, block, cube, densities, displacements, elastic_energy, gathered, run, square

import growthx as gx
from growthx.meshing.sampling import positions

GAUSS = 0.5 + np.array([-1.0, 1.0]) / np.sqrt(12)
TWO_BY_TWO = np.array([(x, y) for x in GAUSS for y in GAUSS])
MIDPOINT = np.array([[0.5, 0.5]])


def shape_derivatives(X):
    """∂N/∂X of the four corners of the unit square, (0, 0), (1, 0), (0, 1), (1, 1), shape (points, 4, 2)."""
    x, y = X.T
    return np.stack(
        [
            np.stack([y - 1, x - 1], axis=1),
            np.stack([1 - y, -x], axis=1),
            np.stack([-y, 1 - x], axis=1),
            np.stack([y, x], axis=1),
        ],
        axis=1,
    )


def energies(problem, X):
    """Ψ₀ⁿᵉᵒ of bilinear displacements at points X of the owned cells, and area per reference area, (cells, points)."""
    corners = basix.geometry(basix.CellType.quadrilateral)
    places, moved = positions(problem.scene.mesh, corners)[:, :, :2], problem.displacement_at(corners)
    derivatives = shape_derivatives(X)
    jacobian = np.einsum("cni,pnj->cpij", places, derivatives)
    H = np.einsum("cni,pnj->cpij", moved, derivatives) @ np.linalg.inv(jacobian)
    return elastic_energy(problem.scene.material, H), np.abs(np.linalg.det(jacobian))


def one_step(variant):
    """A distorted block bent and sheared in one large step, in which each density changes by its own amount."""
    program = gx.Program(step=0.4, until=0.4)
    return run(block(square(3, 0.08), program=program), variant, tolerance=1e-13)[1]


def imbalance(problem, energy):
    """ρ − ρₙ − Δt R₀ (6), (17) of each owned cell at a given energy, over ρₙ."""
    rho, old, dt = problem.density.x.array[: len(energy)], 1.2, 0.4
    source = 5.0 * ((rho / 1.2) ** (2 - 3) * energy - 0.01)
    return gathered((rho - old - dt * source) / old)


def test_q1sri_is_driven_by_its_midpoint():
    """Remark 5.2: R₀ is the cell midpoint's; the cell's mean would give another density in the fourth digit."""
    problem = one_step(gx.Q1sri)
    middle = energies(problem, MIDPOINT)[0][:, 0]
    assert imbalance(problem, middle) == pytest.approx(0.0, abs=1e-14)
    assert np.abs(imbalance(problem, energies(problem, TWO_BY_TWO)[0].mean(axis=1))).max() > 1e-4


def test_q1p0_is_driven_by_its_mean():
    """Remark 4.4: R₀ is the mean over the cell's volume, not over its four points, nor its midpoint's."""
    problem = one_step(gx.Q1P0)
    energy, area = energies(problem, TWO_BY_TWO)
    mean = np.sum(energy * area, axis=1) / np.sum(area, axis=1)
    assert imbalance(problem, mean) == pytest.approx(0.0, abs=1e-14)
    assert np.abs(imbalance(problem, energy.mean(axis=1))).max() > 1e-5
    assert np.abs(imbalance(problem, energies(problem, MIDPOINT)[0][:, 0])).max() > 1e-4


def test_one_cell_value_from_midpoint_or_mean_agree_where_nothing_varies():
    """Q1P0 and Q1sri differ by where they take the energy only: in a homogeneous block nowhere."""
    scene = block(
        square(3, 0.08),
        supports=ROLLERS,
        loads=(gx.Traction("right", (0.3, 0.0)),),
    )
    mean, midpoint = (run(scene, variant, tolerance=1e-13)[1] for variant in (gx.Q1P0, gx.Q1sri))
    assert densities(midpoint) == pytest.approx(densities(mean), rel=1e-12)
    assert np.abs(densities(mean)[:, 2] - 1.2).max() > 1e-2
    bent = [densities(run(block(square(3, 0.08)), variant)[1])[:, 2] for variant in (gx.Q1P0, gx.Q1sri)]
    assert np.abs(bent[0] - bent[1]).max() > 1e-5


@pytest.mark.parametrize(
    "make",
    [lambda: square(4, 0.06, shape="triangle"), lambda: cube(2, 0.1, shape="tetrahedron")],
    ids=["triangles", "tetrahedra"],
)
def test_on_simplices_p1_and_p1p0_are_one_thing(make):
    """One point per cell is one density per cell: both roads to it must lead to one place."""
    scene = block(make())
    (steps, per_cell), (others, at_points) = (run(scene, variant) for variant in (gx.P1P0, gx.P1))
    assert per_cell.dofs == at_points.dofs
    assert [step.newton_iterations for step in steps] == [step.newton_iterations for step in others]
    assert densities(at_points) == pytest.approx(densities(per_cell), rel=1e-12, abs=1e-12)
    assert displacements(at_points) == pytest.approx(displacements(per_cell), rel=1e-12, abs=1e-12)
    assert np.ptp(densities(per_cell)[:, -1]) > 1e-2
    assert COMM.allreduce(len(per_cell.growing_dofs)) == scene.mesh.cell_count
