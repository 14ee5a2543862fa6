"""A plate of bone in one layer of hexahedra under nodal forces, in the manner of FEBio's verification of remodelling.

Its law has m = 1, the energy per mass of Weinans, Huiskes & Grootenboer (J. Biomech. 25 (1992) 1425–1441) as the
stimulus, its stiffness is a power of density (Carter & Hayes).  Forces stand in a list, a row for each node, as in a
.feb file; here they are those of a uniform traction, so that all is known from the scalar solution of one point.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from mpi4py import MPI

from growthx.common.checks import require_number, require_whole
from growthx.common.renamed import renamed
from growthx.constitutive.growth import EnergyDrivenGrowth
from growthx.constitutive.material import Material
from growthx.meshing.files import from_arrays
from growthx.model.actions.concentrated import NodalForces
from growthx.model.program import Program
from growthx.model.scene import Scene
from growthx.model.supports import Support

if TYPE_CHECKING:
    from collections.abc import Callable

    from growthx.common.arrays import Floats, Marks

SIZE = (4.0, 2.0, 0.2)


@renamed(cells="elements")
def bone_plate(
    elements: int = 21, *, force: float = 0.04, n: float = 2.0, step: float = 0.1, comm: MPI.Comm = MPI.COMM_WORLD
) -> Scene:
    """[0, 4] × [0, 2] × [0, 0.2] in 2N × N × 1 hexahedra, on three planes of symmetry, pulled at x = 4 node by node.

    elements: N; 21 makes 882 cells.  force: of all nodes together, ramped over 0.5 (E = 1, ρ* = 1).
    n: exponent of stiffness.  With n > m = 1 the model is not well posed, as is well known of it: densities that are
    uniform stay so for a while only.

    Example:
        >>> gx.scenes.bone_plate(2).mesh.cell_count
        8
    """
    require_whole(elements, "the number of cells over the height of the plate")
    require_number(force, "the force on the plate", "a positive number", lambda f: f > 0)
    nodes = np.array([2 * elements + 1, elements + 1, 2])
    number = np.arange(nodes.prod()).reshape(nodes)
    grid = np.stack(np.meshgrid(*(np.linspace(0.0, 1.0, k) for k in nodes), indexing="ij"), axis=-1)
    sides = 2 * elements, elements, 1
    corners = [number[i : i + sides[0], j : j + sides[1], k : k + sides[2]] for i, j, k in _AROUND]
    mesh = from_arrays(
        grid.reshape(-1, 3) * SIZE, np.stack(corners, axis=-1).reshape(-1, 8), shape="hexahedron", comm=comm
    ).named(dict(zip(("left", "bottom", "front"), map(_plane, range(3)), strict=True)))
    # Of a node the quarters of the sides about it.
    shares = np.ones(nodes[1:]) / (elements * 4)
    shares[1:-1] *= 2.0
    end = number[-1].ravel()
    rows = np.column_stack([force * shares.ravel(), np.zeros(len(end)), np.zeros(len(end))])
    return Scene(
        name="bone plate",
        mesh=mesh,
        material=Material(young=1.0, poisson=0.3, reference_density=1.0, density_exponent=n),
        growth=EnergyDrivenGrowth(attractor=0.002, rate=20.0, exponent=1.0),
        supports=tuple(
            Support(name, tuple(0.0 if i == k else None for i in range(3)))
            for k, name in enumerate(("left", "bottom", "front"))
        ),
        loads=(NodalForces(end, rows, case="pull"),),
        program=Program(step=step, until=2.0, ramp=0.5),
    )


_AROUND = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))


def _plane(axis: int) -> Callable[[Floats], Marks]:
    return lambda x: np.isclose(x[axis], 0.0)
