"""Soft tissue: the wall of a tube grows denser under the pressure inside, most where it is stretched most.

    python demos/tube.py

Density growth is not about bone alone: Kuhl & Steinmann 2003 (Int. J. Numer. Meth. Engng 58, 1593) let a cylindrical
tube grow so.  A quarter of a soft vessel in plane strain marches to biological equilibrium.  There the radial balance
of momentum with R₀ = 0 is a boundary value problem of ordinary differential equations, solved by SciPy to compare with.
Leaves a table on the terminal and the density on the deformed wall in results/tube.png.
"""

from pathlib import Path

import dolfinx
import numpy as np
from mpi4py import MPI
from scipy.integrate import solve_bvp

import growthx as gx

INSIDE, OUTSIDE = 1.0, 1.5
PRESSURE = 0.04
MATERIAL = gx.Material(young=1.0, poisson=0.3, density_exponent=2.0)
LAW = gx.EnergyDrivenGrowth(attractor=0.005, rate=100.0, exponent=3.0)


def quarter(cells=8):
    """A quarter of the wall in N × 3N quadrilaterals."""
    shape = dolfinx.mesh.CellType.quadrilateral
    domain = dolfinx.mesh.create_unit_square(MPI.COMM_WORLD, cells, 3 * cells, shape)
    mesh = gx.Mesh.with_names(
        domain,
        {
            "inside": lambda x: np.isclose(x[0], 0.0),
            "along x": lambda x: np.isclose(x[1], 0.0),
            "along y": lambda x: np.isclose(x[1], 1.0),
        },
    )
    x = domain.geometry.x
    radius, angle = INSIDE + (OUTSIDE - INSIDE) * x[:, 0], np.pi / 2 * x[:, 1]
    x[:, 0], x[:, 1] = radius * np.cos(angle), radius * np.sin(angle)
    return mesh


def tube(cells=8, law=LAW):
    """The tube: symmetric, with a pressure inside that follows the wall."""
    return gx.Scene(
        name="tube",
        mesh=quarter(cells),
        material=MATERIAL,
        growth=law,
        supports=(gx.Support("along x", (None, 0.0)), gx.Support("along y", (0.0, None))),
        loads=(gx.Pressure("inside", PRESSURE),),
        program=gx.Program(step=0.5, until=40.0, ramp=1.0),
    )


def stresses(radial, hoop):
    """P̄ along and around, and the density, of stretches in equilibrium with R₀ = 0, each an array."""
    lam, mu = MATERIAL.lame
    log_J = np.log(radial * hoop)
    energy = lam / 2 * log_J**2 + mu / 2 * (radial**2 + hoop**2 - 2 - 2 * log_J)
    density = energy / LAW.attractor  # n − m = −1
    weight = density**2
    return (
        weight * (mu * radial + (lam * log_J - mu) / radial),
        weight * (mu * hoop + (lam * log_J - mu) / hoop),
        density,
    )


def radial_solution():
    """R ↦ (r, ∂r/∂R, ρ) at biological equilibrium, by SciPy."""
    step = 1e-30

    def slopes(R, state):
        r, radial = state
        hoop = r / R
        along, around, _ = stresses(radial, hoop)
        by_radial = np.imag(stresses(radial + 1j * step, hoop)[0]) / step
        by_hoop = np.imag(stresses(radial, hoop + 1j * step)[0]) / step
        return np.stack([radial, -((along - around) + by_hoop * (radial - hoop)) / R / by_radial])

    def ends(at_inside, at_outside):
        hoop = at_inside[0] / INSIDE
        return np.array(
            [
                stresses(at_inside[1], hoop)[0] + PRESSURE * hoop,
                stresses(at_outside[1], at_outside[0] / OUTSIDE)[0],
            ]
        )

    R = np.linspace(INSIDE, OUTSIDE, 41)
    guess = np.stack([R + 0.1 / R, 1 - 0.1 / R**2])
    with np.errstate(all="ignore"):  # of iterates on the way
        found = solve_bvp(slopes, ends, R, guess, tol=1e-9, max_nodes=20000)
    assert found.success, found.message

    def at(R):
        r, radial = found.sol(R)
        return r, radial, stresses(radial, r / R)[2]

    return at


def compared(problem):
    """Displacements and densities on a ray, beside those of the radial solution, shape (places, 4)."""
    R = INSIDE + (OUTSIDE - INSIDE) * (np.arange(5) + 0.5) / 5
    places = np.stack([R, R], axis=1) * np.array([np.cos(np.pi / 4 + 0.01), np.sin(np.pi / 4 + 0.01)])
    moved = np.linalg.norm(places + problem.sample_displacement(places), axis=1) - R
    r, _, density = radial_solution()(R)
    return np.column_stack([moved, r - R, problem.sample_density(places), density])


def main():
    """March, compare, and draw."""
    result = gx.solve(tube(), gx.Q1Q1)
    rows = compared(result.problem)
    if MPI.COMM_WORLD.rank == 0:
        print("displacement, by SciPy, density, by SciPy")
        for row in rows:
            print("  ".join(f"{value:.5f}" for value in row))
        Path("results").mkdir(exist_ok=True)
    MPI.COMM_WORLD.barrier()
    gx.plots.density(result.problem, "results/tube.png", title="density")


if __name__ == "__main__":
    gx.guarded(main)
