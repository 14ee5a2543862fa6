"""A plate and a block bent by a transverse traction: scenes of any size, their digits known from three other codes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import dolfinx
import numpy as np
from mpi4py import MPI

from growthx.common.checks import is_whole
from growthx.common.communicators import steady
from growthx.common.errors import InputError, shown
from growthx.common.renamed import renamed
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

MOST_CELLS = {2: 5000, 3: 292}  # over the height: fifty million in all
TRACTION = 0.02


@renamed(cells="elements")
def plate(
    elements: int = 64,
    *,
    shape: str = "quadrilateral",
    n: float = 2.0,
    m: float = 3.0,
    step: float = 0.1,
    until: float = 2.5,
    comm: MPI.Comm = MPI.COMM_WORLD,
) -> Scene:
    """[0, 2] × [0, 1] in 2N × N quadrilaterals, clamped on the left, dead traction (0, −0.02) on the right.

    elements: N.  shape: "triangle" halves each quadrilateral.
    n, m: exponents of density.  step: Δt.  until: end time; the load ramps over 0.5.

    Example:
        >>> gx.scenes.plate(2, shape="triangle").mesh
        Mesh(16 triangles; boundaries 'left', 'right'; regions none)
    """
    _require_count(elements, 2, "plate")
    corners = ((0.0, 0.0), (2.0, 1.0))
    domain = dolfinx.mesh.create_rectangle(steady(comm), corners, (2 * elements, elements), _cell_type(shape))
    return _bent("plate", domain, n, m, step, until)


@renamed(cells="elements")
def block(
    elements: int = 8,
    *,
    shape: str = "hexahedron",
    n: float = 2.0,
    m: float = 3.0,
    step: float = 0.1,
    until: float = 2.5,
    comm: MPI.Comm = MPI.COMM_WORLD,
) -> Scene:
    """[0, 2] × [0, 1]² in 2N × N × N hexahedra, clamped on the left, dead traction (0, −0.02, 0) on the right.

    elements: N.  shape: "tetrahedron" cuts each hexahedron in six, along the diagonal from its lowest corner to its
    highest.  n, m: exponents of density.  step: Δt.  until: end time; the load ramps over 0.5.

    Example:
        >>> gx.scenes.block(2).mesh
        Mesh(16 hexahedra; boundaries 'left', 'right'; regions none)
    """
    _require_count(elements, 3, "block")
    if shape not in ("hexahedron", "tetrahedron"):
        raise InputError(f"there are no cells {shown(shape)} in space: hexahedron or tetrahedron would be right")
    counts, kind = [2 * elements, elements, elements], getattr(dolfinx.mesh.CellType, shape)
    domain = dolfinx.mesh.create_box(steady(comm), [np.zeros(3), np.array([2.0, 1.0, 1.0])], counts, kind)
    return _bent("block", domain, n, m, step, until)


def _bent(name: str, domain: dolfinx.mesh.Mesh, n: float, m: float, step: float, until: float) -> Scene:
    traction = (0.0, -TRACTION, 0.0)[: domain.topology.dim]
    return Scene(
        name=name,
        mesh=Mesh.with_names(
            domain, {"left": lambda x: np.isclose(x[0], 0.0), "right": lambda x: np.isclose(x[0], 2.0)}
        ),
        material=Material(young=1.0, poisson=0.2, reference_density=1.0, density_exponent=n),
        growth=EnergyDrivenGrowth(attractor=0.02, rate=10.0, exponent=m),
        supports=(Support("left"),),
        loads=(Traction("right", traction),),
        program=Program(step=step, until=until, ramp=0.5),
    )


def _require_count(cells: int, dim: int, name: str) -> None:
    if not is_whole(cells, 1, MOST_CELLS[dim]):
        raise InputError(
            f"the number of cells over the {name}'s height is {shown(cells)}: a whole number from 1 to "
            f"{MOST_CELLS[dim]} is needed"
        )


def _cell_type(shape: str) -> dolfinx.mesh.CellType:
    triangles = files.triangles(shape)
    return dolfinx.mesh.CellType.triangle if triangles else dolfinx.mesh.CellType.quadrilateral


def tip_displacement(discretisation: Discretisation) -> float:
    """u_y (length) at the middle of the loaded end, (2, 0.5) or (2, 0.5, 0.5)."""
    tip = np.array([[2.0, 0.5, 0.5][: discretisation.scene.mesh.dim]])
    return float(discretisation.sample_displacement(tip)[0, 1])
