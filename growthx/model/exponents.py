"""Whether a model of growth is well posed, as its exponents or samples of its source say before anything is solved."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import replace
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI

from growthx.common.arrays import is_law, is_uniform
from growthx.common.checks import require_kind
from growthx.common.errors import InputError
from growthx.common.overrides import is_foreign
from growthx.constitutive.energies import Elasticity
from growthx.constitutive.growth import GrowthLaw
from growthx.constitutive.weights import DensityWeight
from growthx.meshing.fields import as_ufl
from growthx.model.scene import Scene

if TYPE_CHECKING:
    from growthx.common.arrays import Indices
    from growthx.constitutive.sources import MassSource
    from growthx.meshing.mesh import Mesh

RELATIVE_DENSITIES = np.geomspace(0.05, 3.0, 13)  # at which the slope of a source of any form is looked at
DENSITIES = np.geomspace(0.05, 3.0, 121)  # … and the exponent of a weight
ENERGIES = np.geomspace(1e-8, 1.0, 25)  # … as shares of the stiffness

_said: set[str] = set()


def is_well_posed(scene: Scene) -> bool:
    """Whether more density means a lower stimulus at the same deformation, m > n, wherever anything grows: then the
    equilibrium is unique and stable (Harrigan & Hamilton 1994; the paper's section 3.2).  Collective where n varies.

    Of a source without a stimulus, whether it falls with the density at sample states, and rises at none.
    """
    require_kind(scene, Scene, "the scene", "a Scene")
    growth = scene.growth
    return highest_power(scene, growth)[0] < 0 if isinstance(growth, GrowthLaw) else _rises(scene) == ""


def _rises(scene: Scene) -> str:
    """Where a source of any form does not fall with the density, in short; empty if it falls everywhere (collective).

    At the lowest and highest values of the parameters.
    """
    if scene.growth.is_still:
        return ""
    message = ""
    for growth, material in _extremes(scene):
        densities = material.reference_density * RELATIVE_DENSITIES[:, np.newaxis]
        energies = material.stiffness * ENERGIES
        with np.errstate(all="ignore"):
            slopes = np.asarray(growth.restoring_slope(densities, energies, material))
        slopes = np.broadcast_to(slopes, (len(densities), len(energies)))
        row, column = np.unravel_index(np.argmax(slopes), slopes.shape)
        if not (slopes[row, column] <= 0 and slopes.min() < 0):
            message = (
                f"∂R₀/∂ρ = {slopes[row, column]:.2g} at {RELATIVE_DENSITIES[row]:g} of the reference density and an "
                f"energy of {energies[column]:.2g}"
            )
    return next((each for each in scene.mesh.comm.allgather(message) if each), "")


def _extremes(scene: Scene) -> list[tuple[MassSource, Elasticity]]:
    """The laws with numbers for their parameters: all combinations of the ends of those that vary, on this rank.

    Where anything grows.
    """
    cells = _growing_cells(scene)
    growth = _ends(scene.growth, scene.mesh, scene.growth.coefficients, cells)
    # Sources know of the material its weight and the stiffness.
    material = _ends(scene.material, scene.mesh, (*Elasticity.coefficients, *scene.material.scales), cells)
    return [
        (replace(scene.growth, **of_growth), replace(scene.material, **of_material))
        for of_growth in growth
        for of_material in material
    ]


def _growing_cells(scene: Scene) -> Indices:
    """The owned cells of this rank that grow."""
    mesh = scene.mesh
    return mesh.owned_cells if scene.growing is None else np.concatenate([mesh.region(name) for name in scene.growing])


def _ends(law: Any, mesh: Mesh, names: tuple[str, ...], cells: Indices) -> list[dict[str, Any]]:
    """Combinations of the lowest and highest values of a law's varying parameters; none on a rank without cells."""
    inner = [name for name in names if is_law(getattr(law, name))]
    if inner:
        name, part = inner[0], getattr(law, inner[0])
        rest = _ends(law, mesh, tuple(other for other in names if other != name), cells)
        of_part = [made for ends in _ends(part, mesh, part.coefficients, cells) if (made := _made(part, ends))]
        return [{**ends, name: each} for ends in rest for each in of_part]
    varying = [name for name in names if not is_uniform(getattr(law, name))]
    fields = [as_ufl(getattr(law, name), mesh) for name in varying]  # collective, each of them
    values = [field.x.array[np.unique(field.function_space.dofmap.list[cells])] for field in fields]
    if any(len(each) == 0 for each in values):
        return []
    ends = [sorted({float(each.min()), float(each.max())}) for each in values]
    return [dict(zip(varying, some, strict=True)) for some in product(*ends)]


def _made(law: Any, ends: dict[str, Any]) -> Any:
    """A law of some ends; None where these are nowhere together, as a lowest density above a highest one."""
    try:
        return replace(law, **ends)
    except InputError:
        return None


def highest_power(scene: Scene, growth: GrowthLaw) -> tuple[float, str]:
    """The highest exponent k of the relative density in the stimulus of what grows, and where, as the end of a phrase.

    Of a number n, everywhere: the phrase is then empty.  Of another weight, that at sample densities within the bounds.
    Collective where n varies.
    """
    mesh, n = scene.mesh, scene.material.density_exponent
    if isinstance(n, DensityWeight):
        return _highest_of_weight(scene, growth)
    if is_uniform(n):
        return float(growth.power(scene.material)), ""
    exponents = as_ufl(n, mesh)
    regions = list(n) if isinstance(n, Mapping) else []
    grows = _growing_cells(scene)
    parts = [(f" in '{name}'", np.intersect1d(grows, mesh.region(name))) for name in regions] or [(" somewhere", grows)]
    found = []
    for place, cells in parts:
        values = exponents.x.array[np.unique(exponents.function_space.dofmap.list[cells])]
        powers = np.asarray(growth.power(replace(scene.material, density_exponent=values)))
        highest = float(powers.max(initial=-np.inf)) if len(values) else -np.inf
        found.append((mesh.comm.allreduce(highest, MPI.MAX), place))
    return max(found, key=lambda each: each[0])


def _highest_of_weight(scene: Scene, growth: GrowthLaw) -> tuple[float, str]:
    """The highest k = ∂ ln S/∂ ln ρ of a weight that is no power, at the ends of its parameters (collective)."""
    found = [(-np.inf, "")]
    for _, material in _extremes(scene):
        densities = np.clip(material.reference_density * DENSITIES, *growth.limits)
        powers = np.broadcast_to(growth.power_at(densities, material), densities.shape)
        highest = int(np.argmax(powers))
        found.append((float(powers[highest]), f" at a density of {densities[highest]:.3g}"))
    everywhere = [each for of_rank in scene.mesh.comm.allgather(found) for each in of_rank]
    return max(everywhere, key=lambda each: each[0])


def _name_of(growth: GrowthLaw) -> str:
    """What users know the power of the relative density by: a law of their own need not have an m."""
    return "its power" if is_foreign(type(growth)) else "n − m"


def warn_if_ill_posed(scene: Scene) -> None:
    """Say once, on rank 0, what to expect of a model that is not well posed."""
    growth = scene.growth
    if isinstance(growth, GrowthLaw):
        power, place = highest_power(scene, growth)
        rises = (
            ""
            if power < 0
            else f"the stimulus does not fall as the density rises ({_name_of(growth)} = {power:g}{place}, not below 0)"
        )
    else:
        rises = _rises(scene)
        rises = rises and f"the mass source does not fall as the density rises ({rises})"
    if not rises or scene.mesh.comm.rank != 0:
        return
    message = (
        f"growthx: {rises}, so the model is not well posed: expect densities that run to zero or without bound, "
        "checkerboards, and results that depend on the mesh and on the time step"
    )
    if message not in _said:
        _said.add(message)
        logging.getLogger("growthx").warning(message)
