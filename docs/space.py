"""The pictures of docs/fields.md: a block of bone under the forces of a hip and of its abductors.

python docs/space.py
"""

from pathlib import Path

import dolfinx
import numpy as np
from mpi4py import MPI

import growthx as gx

HERE = Path(__file__).parent
UNIT = "density (g/cm³)"


def block():
    """60 × 30 × 100 mm, held below; a force on a part of the top, another at the side."""
    low, high = np.array([[-30.0, -15.0, -50.0], [30.0, 15.0, 50.0]])
    domain = dolfinx.mesh.create_box(MPI.COMM_WORLD, [low, high], [14, 7, 22], dolfinx.mesh.CellType.hexahedron)
    sides = {"bottom": (2, low), "top": (2, high), "side": (0, high)}
    mesh = gx.Mesh.with_names(
        domain, {name: lambda x, i=i, at=at: np.isclose(x[i], at[i]) for name, (i, at) in sides.items()}
    )
    return gx.Scene(
        name="block",
        mesh=mesh,
        material=gx.Material(young=17000.0, poisson=0.3, reference_density=1.8),
        growth=gx.EnergyDrivenGrowth(attractor=0.02, rate=20.0, bounds=(0.02, 2.1)),
        supports=(gx.Support("bottom"),),
        loads=(
            gx.DistributedForce(
                "top",
                (2500.0, -850.0, -8700.0),
                weight=lambda x: np.exp(-(((x[0] + 15) / 8) ** 2) - (x[1] / 8) ** 2),
                case="hip",
            ),
            gx.DistributedForce(
                "side", (-1000.0, 0.0, 3500.0), weight=lambda x: np.exp(-(((x[2] - 25) / 8) ** 2)), case="abductors"
            ),
        ),
        program=gx.Program(step=0.5, until=4.0, ramp=1.0),
        initial_density=0.8,
    )


def main():
    """Solve, and draw."""
    problem = gx.solve(block(), gx.Q1P0, stepping=gx.AdaptiveSteps(1e-2)).problem
    gx.plots.density(problem, HERE / "space.png", title=UNIT)
    gx.plots.slices(problem, HERE / "slices.png", ["coronal", ((0, 0, 20), (1, 0, 1))], title=UNIT, grey=True)


if __name__ == "__main__":
    raise SystemExit(gx.guarded(main))
