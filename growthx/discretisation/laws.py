"""The laws of what grows with their parameters in UFL, or as arrays for densities that are found one by one."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import dolfinx
import numpy as np
import ufl

from growthx.common.arrays import is_law, is_uniform
from growthx.common.errors import raise_on_all
from growthx.discretisation.variants import AtPoints
from growthx.fem.assembly import average_cells, cell_means
from growthx.meshing.fields import as_ufl, law_as_ufl

if TYPE_CHECKING:
    from growthx.common.arrays import Law
    from growthx.constitutive.energies import Elasticity
    from growthx.constitutive.sources import MassSource
    from growthx.discretisation.spaces import Spaces
    from growthx.meshing.mesh import Mesh


def laws(spaces: Spaces) -> tuple[Elasticity, MassSource]:
    """Material and growth in UFL; what a mean source of several points depends on otherwise than linearly, by means.

    Of one density per cell, driven by the mean source of several points, these means are over cells.
    """
    scene, variant = spaces.scene, spaces.variant
    material, growth = law_as_ufl(scene.material, scene.mesh), law_as_ufl(scene.growth, scene.mesh)
    if scene.mesh.dim == 2 and material.across:
        _refuse_across(material, scene.mesh)
        material = replace(material, **{name: as_ufl(0.0, scene.mesh) for name in material.across})
    if not variant.density.local or isinstance(variant.density, AtPoints) or not variant.one_rule:
        return material, growth
    names = ("reference_density", "density_exponent") + (() if growth.is_linear else material.scales)
    return _by_cells(spaces, material, names), _by_cells(spaces, growth, growth.at_points_alike)


def _refuse_across(material: Elasticity, mesh: Mesh) -> None:
    """Raise InputError where a material in UFL points out of a plane body (collective)."""
    for name in material.across:
        field = getattr(material, name)
        values = field.x.array if isinstance(field, dolfinx.fem.Function) else np.atleast_1d(field.value)
        worst = float(values[np.abs(values).argmax()]) if len(values) else 0.0
        raise_on_all(
            mesh.comm,
            f"{name} of {type(material).__name__} is {worst:g}, which points out of a plane body: 0 would be right"
            if worst
            else "",
        )


def _by_cells(spaces: Spaces, law: Law, names: tuple[str, ...]) -> Law:
    """A law with some parameters as means over cells, where they are functions that vary inside them."""
    domain = spaces.scene.mesh.domain
    inner = {name: part for name in names if is_law(part := getattr(law, name))}
    if inner:
        law = replace(law, **{name: _by_cells(spaces, part, part.coefficients) for name, part in inner.items()})
    vary = [
        name
        for name in names
        if isinstance(field := getattr(law, name), dolfinx.fem.Function) and not _is_constant_on_cells(field)
    ]
    if not vary:
        return law
    volume = ufl.Measure("dx", domain=domain, metadata={"quadrature_degree": spaces.variant.mass_degree})
    found = cell_means(domain, [getattr(law, name) for name in vary], volume, spaces.compile)
    means = {name: dolfinx.fem.Function(dolfinx.fem.functionspace(domain, ("DG", 0))) for name in vary}
    for mean, values in zip(means.values(), found.T, strict=True):
        mean.x.array[: len(values)] = values
        mean.x.scatter_forward()
    return replace(law, **means)


def _is_constant_on_cells(field: dolfinx.fem.Function) -> bool:
    return field.function_space.dofmap.dof_layout.num_dofs == 1


def with_exponents(spaces: Spaces, as_arrays: Elasticity, in_ufl: Elasticity) -> Elasticity:
    """A material as arrays with exponents as they are, not as means, whose round-off would hide which are alike."""
    if is_uniform(as_arrays.density_exponent) or not as_arrays.is_of_a_power:
        return as_arrays
    at_places = spaces.evaluate(in_ufl.density_exponent, spaces.density_points)
    exponents = average_cells(spaces.density_space, at_places).x.array[spaces.growing]  # each is of one cell alone
    one = len(exponents) > 0 and np.all(exponents == exponents[0])
    return replace(as_arrays, density_exponent=float(exponents[0]) if one else exponents)
