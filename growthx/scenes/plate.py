"""A plate bent by a transverse traction: a scene of any size, its digits known from three other codes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import dolfinx
import numpy as np
from mpi4py import MPI

from growthx.common.communicators import steady
from growthx.common.errors import InputError, shown
from growthx.constitutive.growth import EnergyDrivenGrowth
from growthx.constitutive.material import Material
from growthx.meshing import files
from growthx.meshing.mesh import Mesh
from growthx.model.loads import Traction
from growthx.model.program import Program
from growthx.model.scene import Scene
from growthx.model.supports import Support

if TYPE_CHECKING:
    from growthx.discretisation.discretisation import Discretisation

MOST_CELLS = 5000  # over the height: fifty million in all


def plate(
    cells: int = 64,
    *,
    shape: str = "quadrilateral",
    n: float = 2.0,
    m: float = 3.0,
    step: float = 0.1,
    comm: MPI.Comm = MPI.COMM_WORLD,
) -> Scene:
    """[0, 2] × [0, 1] in 2N × N quadrilaterals, clamped on the left, dead traction (0, −0.02) on the right.

    cells: N.  shape: "triangle" halves each quadrilateral.
    n, m: exponents of density.  step: Δt; the load ramps over 0.5, the end is at 2.5.
    """
    if not isinstance(cells, int) or isinstance(cells, bool) or not 1 <= cells <= MOST_CELLS:
        raise InputError(
            f"the number of cells over the plate's height is {shown(cells)}: a whole number from 1 to {MOST_CELLS} is "
            "needed"
        )
    comm = steady(comm)
    domain = dolfinx.mesh.create_rectangle(comm, ((0.0, 0.0), (2.0, 1.0)), (2 * cells, cells), _cell_type(shape))
    mesh = Mesh.with_names(domain, {"left": lambda x: np.isclose(x[0], 0.0), "right": lambda x: np.isclose(x[0], 2.0)})
    return Scene(
        name="plate",
        mesh=mesh,
        material=Material(young=1.0, poisson=0.2, reference_density=1.0, density_exponent=n),
        growth=EnergyDrivenGrowth(attractor=0.02, rate=10.0, exponent=m),
        supports=(Support("left"),),
        loads=(Traction("right", (0.0, -0.02)),),
        program=Program(step=step, until=2.5, ramp=0.5),
    )


def _cell_type(shape: str) -> dolfinx.mesh.CellType:
    triangles = files.triangles(shape)
    return dolfinx.mesh.CellType.triangle if triangles else dolfinx.mesh.CellType.quadrilateral


def tip_displacement(discretisation: Discretisation) -> float:
    """u_y (length) at the middle of the loaded end, (2, 0.5)."""
    return float(discretisation.sample_displacement(np.array([[2.0, 0.5]]))[0, 1])
