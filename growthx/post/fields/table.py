"""The table of growthx's own fields: what each is in UFL, by the scene's own constitutive functions.

Of several load cases energies, strains and stresses are their weighted means.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

from growthx.constitutive import quantities
from growthx.constitutive.kinematics import Plane
from growthx.constitutive.stimulus import StimulusDriven
from growthx.post.fields import principal, tensors
from growthx.post.fields.row import DerivedField

if TYPE_CHECKING:
    from collections.abc import Callable

    from growthx.discretisation.discretisation import Discretisation


def _relative_change(problem: Discretisation) -> Any:
    return problem.expressions.density() / problem.material.reference_density - 1


def _has_stimulus(problem: Discretisation) -> bool:
    return isinstance(problem.growth, StimulusDriven)


def _is_nodal(problem: Discretisation) -> bool:
    return not problem.variant.density.local


def _displacement(problem: Discretisation) -> list[Any]:
    return [problem.displacement[i] for i in range(problem.scene.mesh.dim)]


def _strain_energy(problem: Discretisation) -> Any:
    return problem.expressions.mean_of(quantities.strain_energy)


def _strain_energy_per_mass(problem: Discretisation) -> Any:
    return _strain_energy(problem) / problem.expressions.density()


def _upper(tensor: Any) -> list[Any]:
    """The entries on and above the diagonal, row by row."""
    dim = tensor.ufl_shape[0]
    return [tensor[i, j] for i in range(dim) for j in range(i, dim)]


def _stress_in_mesh(problem: Discretisation) -> list[Any]:
    """The Cauchy stress in the dimensions of the mesh."""
    return _upper(problem.expressions.stress())


def _stress(problem: Discretisation) -> list[Any]:
    return _upper(problem.expressions.mean_of(quantities.cauchy_stress, in_space=True))


def _piola(problem: Discretisation) -> list[Any]:
    stress = problem.expressions.mean_of(quantities.first_piola_stress, in_space=True)
    return [stress[i, j] for i in range(3) for j in range(3)]


def _strain(problem: Discretisation) -> list[Any]:
    return _upper(problem.expressions.mean_of(quantities.green_lagrange_strain, in_space=True))


def _thickness(problem: Discretisation) -> Any:
    return problem.expressions.mean_of(quantities.thickness_stretch, in_space=True)


def _directions(name: str, of: str, value: Callable[[Discretisation], Any]) -> list[DerivedField]:
    """The directions of the three principal values."""
    ranks = ("largest", "middle", "smallest")
    return [
        DerivedField(
            f"{name}_direction_{number + 1}",
            value,
            partial(tensors.component, number),
            title=f"direction of the {rank} {of}",
            unit="no unit",
            rank=1,
            told=False,
            common=tensors.directions,
        )
        for number, rank in enumerate(ranks)
    ]


# The first six are told where none was asked for.
TABLE = (
    DerivedField(
        "density",
        lambda problem: problem.expressions.density(),
        exact=lambda problem, X: problem.density_at(X),
        continuous=_is_nodal,
        title="density ρ",
        unit="mass per volume",
    ),
    DerivedField(
        "relative_change",
        _relative_change,
        exact=lambda problem, X: problem.density_at(X) / problem.reference_density_at(X) - 1,
        title="relative change of density [ρ − ρ*]/ρ*",
        unit="no unit",
    ),
    DerivedField(
        "stimulus",
        lambda problem: problem.expressions.stimulus(),
        known=_has_stimulus,
        title="stimulus of the law, as [ρ/ρ*]^(−m) Ψ₀",
        unit="that of its attractor",
    ),
    DerivedField(
        "mass_source",
        lambda problem: problem.expressions.mass_source(),
        raw=False,
        title="mass source R₀, zero where nothing grows",
        unit="density per time",
    ),
    DerivedField(
        "major_stress",
        _stress_in_mesh,
        partial(tensors.component, 1),
        raw=False,
        common=principal.outer_values,
        title="largest principal Cauchy stress, in the plane of a plane body",
        unit="force per area",
    ),
    DerivedField(
        "minor_stress",
        _stress_in_mesh,
        partial(tensors.component, 0),
        raw=False,
        common=principal.outer_values,
        title="smallest principal Cauchy stress, in the plane of a plane body",
        unit="force per area",
    ),
    DerivedField(
        "displacement",
        _displacement,
        tensors.in_space,
        exact=lambda problem, X: tensors.in_space(problem.displacement_at(X)),
        continuous=lambda problem: True,
        title="displacement u",
        unit="length",
        rank=1,
        told=False,
    ),
    DerivedField(
        "strain_energy",
        _strain_energy,
        title="strain energy per volume Ψ₀ = [ρ/ρ*]ⁿ Ψ₀ⁿᵉᵒ",
        unit="energy per volume at rest",
        told=False,
    ),
    DerivedField(
        "strain_energy_per_mass",
        _strain_energy_per_mass,
        title="strain energy per mass Ψ₀/ρ",
        unit="energy per mass",
        told=False,
    ),
    DerivedField(
        "young",
        lambda problem: problem.expressions.stiffness(),
        title="Young's modulus as it is now [ρ/ρ*]ⁿ E",
        unit="force per area",
        told=False,
    ),
    DerivedField(
        "green_lagrange_strain",
        _strain,
        tensors.symmetric,
        title="Green–Lagrange strain ½ [Fᵀ F − I]",
        unit="no unit",
        rank=2,
        told=False,
    ),
    DerivedField(
        "thickness_stretch",
        _thickness,
        known=lambda problem: problem.scene.plane is Plane.STRESS,
        title="thickness stretch λ₃, in plane stress",
        unit="no unit",
        told=False,
    ),
    DerivedField(
        "hencky_strain",
        _strain,
        tensors.logarithmic,
        title="Hencky strain ½ ln Fᵀ F",
        unit="no unit",
        rank=2,
        told=False,
    ),
    DerivedField(
        "principal_strains",
        _strain,
        tensors.principal_logarithmic,
        title="principal Hencky strains, from the largest",
        unit="no unit",
        rank=1,
        told=False,
    ),
    *_directions("strain", "principal strain, in the body at rest", _strain),
    DerivedField(
        "cauchy_stress",
        _stress,
        tensors.symmetric,
        title="Cauchy stress σ, with σ_zz of a plane body",
        unit="force per deformed area",
        rank=2,
        told=False,
    ),
    DerivedField(
        "first_piola_stress",
        _piola,
        tensors.square,
        title="first Piola–Kirchhoff stress P̄, with P̄_zz of a plane body",
        unit="force per area at rest",
        rank=2,
        told=False,
    ),
    DerivedField(
        "von_mises",
        _stress,
        tensors.von_mises,
        title="von Mises stress of σ",
        unit="force per deformed area",
        told=False,
    ),
    DerivedField(
        "principal_stresses",
        _stress,
        tensors.principal_values,
        title="principal Cauchy stresses, from the largest, with σ_zz of a plane body",
        unit="force per deformed area",
        rank=1,
        told=False,
    ),
    *_directions("stress", "principal Cauchy stress", _stress),
)
