"""The plate of Weinans, Huiskes & Grootenboer 1992 (J. Biomech. 25, 1425): columns and checkerboards of bone."""

from __future__ import annotations

from typing import TYPE_CHECKING

import dolfinx
import numpy as np
from mpi4py import MPI

from growthx.common.checks import is_whole
from growthx.common.communicators import steady
from growthx.common.errors import InputError, shown
from growthx.common.renamed import renamed
from growthx.constitutive.elastic.small_strain import LinearElasticity
from growthx.constitutive.growth import SpecificEnergyDrivenGrowth
from growthx.meshing.mesh import Mesh
from growthx.model.loads import Traction
from growthx.model.program import Program
from growthx.model.scene import Scene
from growthx.model.supports import Support

if TYPE_CHECKING:
    from growthx.common.arrays import Floats
    from growthx.discretisation.discretisation import Discretisation

MOST_CELLS = 5000
YOUNG, POISSON, PRESSURE, SET_POINT = 100.0, 0.3, 10.0, 0.25
BOUNDS = (0.01, 1.74)
START = 0.8
AT_BOUND = 1e-6  # of a bound: nearer, a density is at it


@renamed(cells="elements")
def weinans_plate(
    elements: int = 40,
    *,
    step: float = 1.0,
    until: float = 100.0,
    comm: MPI.Comm = MPI.COMM_WORLD,
) -> Scene:
    """[0, 1]² in N × N quadrilaterals, fixed below, pressed from above by 10 [1 − x], in plane strain.

    E = 100 ρ², ν = 0.3, R₀ = Ψ₀/ρ − 0.25 between the densities 0.01 and 1.74, ρ(0) = 0.8: m = 1 < n = 2, so the
    model is not well posed.  Linear elasticity, as theirs: no deformation changes what is loaded.

    elements: N.  step: Δt; at 1 it is the paper's, an explicit one for `gx.baselines.update`.

    Example:
        >>> gx.scenes.weinans_plate(4).mesh
        Mesh(16 quadrilaterals; boundaries 'bottom', 'top'; regions none)
    """
    if not is_whole(elements, 1, MOST_CELLS):
        raise InputError(
            f"the number of cells along the plate's sides is {shown(elements)}: a whole number from 1 to {MOST_CELLS} "
            "would be right"
        )
    domain = dolfinx.mesh.create_unit_square(steady(comm), elements, elements, dolfinx.mesh.CellType.quadrilateral)
    names = {"bottom": lambda x: np.isclose(x[1], 0.0), "top": lambda x: np.isclose(x[1], 1.0)}
    return Scene(
        name="the plate of Weinans",
        mesh=Mesh.with_names(domain, names),
        material=LinearElasticity(YOUNG, POISSON, reference_density=1.0, density_exponent=2.0),
        growth=SpecificEnergyDrivenGrowth(SET_POINT, rate=1.0, bounds=BOUNDS),
        supports=(Support("bottom"),),
        loads=(Traction("top", _pressure),),
        program=Program(step=step, until=until),
        initial_density=START,
    )


def _pressure(x: Floats) -> Floats:
    return np.stack([0 * x[0], -PRESSURE * (1 - x[0])])


def column_density(x: Floats) -> Floats:
    """ρ(x) at which columns that each bear the pressure above them are in equilibrium, [1.82 (1 − x)²]^(1/3).

    [1 − ν²] p²/(2 E ρ³) = 0.25.  Its mean is 0.7326.  It is smooth, and not stable.
    """
    bare = (1 - POISSON**2) * (PRESSURE * (1 - x)) ** 2 / (2 * YOUNG * SET_POINT)
    return np.asarray(np.cbrt(bare))


def shares_at_bounds(problem: Discretisation) -> tuple[float, float]:
    """Shares of the volume whose densities are at the lowest and at the highest bound (collective)."""
    dofs = problem.growing_dofs
    density, volumes = problem.density.x.array[dofs], problem.volumes[dofs]
    low, high = problem.scene.growth.limits
    sums = [volumes[density <= low * (1 + AT_BOUND)].sum(), volumes[density >= high * (1 - AT_BOUND)].sum()]
    at_low, at_high, whole = problem.comm.allreduce(np.array([*sums, volumes.sum()]))
    return float(at_low / whole), float(at_high / whole)
