"""Whether the numbers of a scene can belong together: orders of magnitude, before any equation is solved.

A slip of units is a factor of a thousand or a million: it shows in the strain that the loads make of the stiffness, and
in the energy of that strain against the attractor stimulus, which remodelling meets within a few orders of magnitude.
Both are known from sizes and sums alone, within a range that the shape of the body sets: the stress is at least that of
a section as large as the box around the body, and at most that of bending its own section.
"""

from __future__ import annotations

import logging
import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import dolfinx
import numpy as np
from mpi4py import MPI

from growthx.constitutive.functions import is_symbolic
from growthx.constitutive.growth import GrowthLaw
from growthx.constitutive.material import Material
from growthx.model.open_loads import Pressure

if TYPE_CHECKING:
    from growthx.common.arrays import Floats
    from growthx.discretisation.discretisation import Discretisation

LARGEST_STRAIN, SMALLEST_STRAIN = 10.0, 1e-9
HIGHEST_SHARE, LOWEST_SHARE = 1e4, 1e-4  # of the energy that is in equilibrium with the attractor

_said: set[str] = set()


@dataclass(frozen=True)
class Magnitudes:
    """What the full loads do to a body, each between a least and a most.

    size: the longest side of the box around the body (length).  force: sum of the dead loads (force; per thickness in
    two dimensions).  moved: largest prescribed displacement (length).  young: the stiffness E of what grows (stress).
    strain: nominal (no unit).  share: energy over that at which the stimulus is the attractor (no unit), NaN where
    there is no such thing.
    told: whether all of the loads are known; those that depend on the state are not.
    """

    size: float
    force: float
    moved: float
    young: tuple[float, float]
    strain: tuple[float, float]
    share: tuple[float, float]
    told: bool

    @property
    def too_large(self) -> bool:
        """Whether strain or energy are beyond what any scene can mean."""
        return self.strain[0] > LARGEST_STRAIN or self.share[0] > HIGHEST_SHARE

    @property
    def too_small(self) -> bool:
        """Whether strain or energy are so small that the loads can have no part in what happens."""
        return self.told and (self.strain[1] < SMALLEST_STRAIN or self.share[1] < LOWEST_SHARE)


def warn_if_out_of_scale(problem: Discretisation) -> None:
    """Say once, on rank 0, that the numbers of a scene do not belong together, and what slip is likely (collective)."""
    message = doubt(problem)
    if message and problem.comm.rank == 0 and message not in _said:
        _said.add(message)
        logging.getLogger("growthx").warning("growthx: %s", message)


def doubt(problem: Discretisation) -> str:
    """What is strange about the orders of magnitude of a problem, as a sentence; empty if nothing is (collective)."""
    scene = problem.scene
    with np.errstate(all="ignore"):  # of numbers that overflow, too, something is to be said
        found = magnitudes(problem)
    if found.told and found.strain[1] == 0.0 and not scene.moves_mass:
        return (
            f"the scene '{scene.name}' has no load, and none of its supports moves: nothing strains the body, and its "
            "density will fall everywhere, if it changes at all"
        )
    if found.strain[1] == 0.0:
        return ""
    if found.too_large:
        return _sentence(problem, found, "much", found.strain[0], found.share[0])
    if found.too_small:
        return _sentence(problem, found, "little", found.strain[1], found.share[1])
    return ""


def _sentence(problem: Discretisation, found: Magnitudes, how: str, strain: float, share: float) -> str:
    plane = problem.scene.mesh.dim == 2
    causes = [f"forces of {found.force:.1g}{' per thickness' if plane else ''} in all"] if found.force else []
    causes += [f"supports that move by {found.moved:.1g}"] if found.moved else []
    low, high = found.young
    young = f"{high:.1g}" if low == high else f"{low:.1g} to {high:.1g}"
    energy = "" if math.isnan(share) else f", its energy {share:.0e} of that at the attractor stimulus"
    return (
        f"the scene '{problem.scene.name}' strains its body by orders of magnitude too {how}: "
        f"{' and '.join(causes) or 'its pressure'} on a body of length {found.size:.1g} with Young's modulus {young} "
        f"would make a strain of about {strain:.0e}{energy}; {_slip(found, how, plane)}"
    )


def _slip(found: Magnitudes, how: str, plane: bool) -> str:
    """The likely slip, as a question."""
    if found.moved and not found.force:
        return "are displacements and lengths of the mesh in the same unit, and is the attractor in that of the moduli?"
    if how == "little":
        return "are moduli in Pa where forces are in N and lengths in mm, or forces in kN?"
    total = " or forces in total where those per thickness are meant," if plane else ""
    return f"are lengths in m where moduli are in MPa (N/mm²),{total} or loads in Pa where moduli are in MPa?"


def magnitudes(problem: Discretisation) -> Magnitudes:
    """The orders of magnitude of a problem (collective)."""
    scene = problem.scene
    box = _box(problem)
    force, moved = _largest_force(problem), problem.system.supports.farthest()
    pressure = max((abs(load.value) for load in scene.open_loads if isinstance(load, Pressure)), default=0.0)
    young, relative = _range(problem, problem.material.stiffness), _relative_density(problem)
    weights = _weights(problem, relative)
    stresses = [stress + pressure for stress in _stresses(force, box, problem.spaces.growing_size())]
    # The least of everything first, then the most.
    strains = (
        (stresses[0] / (young[1] * weights[1]), moved / box.max()),
        (stresses[1] / (young[0] * weights[0]), moved / box.min()),
    )
    energies = (
        max(young[1] * strains[0][0] ** 2, young[0] * strains[0][1] ** 2) / 2,
        max(young[0] * strains[1][0] ** 2, young[1] * strains[1][1] ** 2) / 2,
    )
    return Magnitudes(
        size=float(box.max()),
        force=force,
        moved=moved,
        young=young,
        strain=(float(max(strains[0])), float(max(strains[1]))),
        share=(_share(problem, energies[0], young[1], relative), _share(problem, energies[1], young[0], relative)),
        told=all(isinstance(load, Pressure) for load in scene.open_loads),
    )


def _stresses(force: float, box: Floats, size: float) -> tuple[float, float]:
    """The least and the most stress that forces can make in a body of that volume (in two dimensions, area)."""
    longest = box.max()
    widest, own = np.prod(box) / longest, size / longest
    slenderness = max(1.0, longest / own ** (1 / (len(box) - 1)))
    return force / widest, force / own * slenderness


def _largest_force(problem: Discretisation) -> float:
    """The sum of the sizes of all nodal dead loads of the load case that has the largest."""
    load = np.abs(problem.system.peak_load())
    sums = []
    for part, case in zip(problem.system.unknowns.parts, problem.spaces.cases, strict=True):
        here = np.zeros(len(problem.system.unknown.x.array), dtype=bool)
        here[part] = True
        sums.append(float(load[here[: len(load)]].sum()) / case.weight)
    return float(problem.comm.allreduce(np.array(sums)).max())


def _box(problem: Discretisation) -> Floats:
    """Sides of the box around the body, shape (dim,)."""
    domain, dim = problem.scene.mesh.domain, problem.scene.mesh.dim
    ends = np.concatenate([domain.geometry.x[:, :dim], -domain.geometry.x[:, :dim]], axis=1).max(
        axis=0, initial=-np.inf
    )
    problem.comm.Allreduce(MPI.IN_PLACE, ends, MPI.MAX)
    return ends[:dim] + ends[dim:]


def _range(problem: Discretisation, coefficient: Any) -> tuple[float, float]:
    """The lowest and the highest value of a coefficient where the body grows."""
    if not hasattr(coefficient, "function_space"):
        if not is_symbolic(coefficient) or hasattr(coefficient, "value"):
            value = float(getattr(coefficient, "value", coefficient))
            return value, value
        points = problem.variant.integration_points(problem.scene.mesh.cell_name)
        values = problem.evaluate(coefficient, points)[problem.growing_cells]
    else:
        values = coefficient.x.array[coefficient.function_space.dofmap.list[problem.growing_cells]]
    ends = np.array([-values.min(initial=np.inf), values.max(initial=-np.inf)])
    problem.comm.Allreduce(MPI.IN_PLACE, ends, MPI.MAX)
    return -float(ends[0]), float(ends[1])


def _relative_density(problem: Discretisation) -> float:
    """The mean density over the reference density."""
    return problem.mean_density() / float(np.mean(_range(problem, problem.material.reference_density)))


def _weights(problem: Discretisation, relative: float) -> list[float]:
    """The least and the most weight of the stiffness at a relative density."""
    material = problem.material
    if material.is_of_a_power:
        return sorted(relative**n for n in _range(problem, material.density_exponent))
    at = dolfinx.fem.Constant(problem.scene.mesh.domain, dolfinx.default_scalar_type(problem.mean_density()))
    return list(_range(problem, material.weight(at)))


def _share(problem: Discretisation, energy: float, young: float, relative: float) -> float:
    """An energy over the one at which the stimulus is the largest attractor; NaN where the law does not say.

    The stimulus may go with the energy or, like strain and stress, with its root: that shows at four times the energy.
    """
    scene, law, in_ufl = problem.scene, problem.scene.growth, problem.growth
    if not (isinstance(law, GrowthLaw) and isinstance(in_ufl, GrowthLaw)):
        return math.nan
    attractor = _range(problem, in_ufl.attractor)[1]
    try:
        n = float(np.mean(_range(problem, problem.material.exponent_at(problem.material.reference_density))))
        alike = scene.material if isinstance(scene.material, Material) else Material(young)
        material = replace(alike, young=young, poisson=0.0, reference_density=1.0, density_exponent=n)
        one, four = (float(law.stimulus(relative, factor * energy, material)) / attractor for factor in (1.0, 4.0))
        return one ** (math.log(4.0) / math.log(four / one))
    except Exception:  # laws of the user's own may not take numbers, and an estimate is no reason to end a run
        return math.nan
