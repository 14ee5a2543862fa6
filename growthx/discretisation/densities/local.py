"""The balance of mass of each density that no two cells share, solved at the running displacement."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import basix.ufl
import dolfinx
import numpy as np
import ufl

from growthx.constitutive.local.balance import solve_density
from growthx.constitutive.local.source import LocalSource
from growthx.discretisation.laws import with_exponents
from growthx.discretisation.variants import AtPoints
from growthx.fem.assembly import assemble
from growthx.meshing.fields import law_as_arrays

if TYPE_CHECKING:
    from growthx.common.arrays import Floats
    from growthx.constitutive.energies import Elasticity
    from growthx.discretisation.spaces import Spaces
    from growthx.discretisation.state import State


class LocalDensities:
    """Finds the densities of what grows one by one, from those at the start of the step.

    free: one where a density follows the deformation, zero where it has stopped at a bound; None without bounds.
    """

    def __init__(self, spaces: Spaces, state: State, energy: Any, material: Elasticity) -> None:
        """energy: Ψ₀ⁿᵉᵒ of the running displacement, in UFL as the material is."""
        self._spaces, self._state = spaces, state
        scene, variant = spaces.scene, spaces.variant
        self.free = dolfinx.fem.Function(spaces.density_space) if scene.growth.is_bounded else None
        self._shares = spaces.volumes if variant.one_rule else self._share(1.0)
        self._prepare_energies(energy)
        self._material = with_exponents(spaces, law_as_arrays(scene.material, scene.mesh, self._average), material)
        self._growth = law_as_arrays(scene.growth, scene.mesh, self._average)
        self._source: LocalSource | None = None

    def _prepare_energies(self, energy: Any) -> None:
        """Compile the elastic energies that drive the densities: their means, or each if the source is not linear."""
        spaces, self._weights = self._spaces, None
        if isinstance(spaces.variant.density, AtPoints) or spaces.scene.growth.is_linear:
            self._energy = spaces.compile.residual(self._share_form(energy, spaces.density_space))
            self._energy_dofs, self._energy_shares = spaces.growing, self._shares[spaces.growing]
            return
        mesh, degree = spaces.scene.mesh, spaces.variant.mass_degree
        points = dolfinx.fem.functionspace(mesh.domain, basix.ufl.quadrature_element(mesh.cell_name, degree=degree))
        self._energy = spaces.compile.residual(self._share_form(energy, points))
        cells = spaces.growing_cells[np.argsort(spaces.density_space.dofmap.list[spaces.growing_cells, 0])]
        self._energy_dofs = points.dofmap.list[cells]
        self._energy_shares = assemble(spaces.compile.form(self._share_form(1.0, points)))[self._energy_dofs]
        self._weights = self._energy_shares / self._energy_shares.sum(axis=1, keepdims=True)

    def _share_form(self, quantity: Any, space: dolfinx.fem.FunctionSpace) -> ufl.Form:
        """∫ · dV of a quantity per volume over the part of a cell that belongs to each entry of a local space."""
        volume = with_mass_points(self._spaces, self._spaces.growing_volume)
        return quantity * ufl.TestFunction(space) * volume

    def _share(self, quantity: Any) -> Floats:
        return assemble(self._spaces.compile.form(self._share_form(quantity, self._spaces.density_space)))

    def _average(self, coefficient: Any) -> Floats:
        """Mean of a coefficient over the part of a cell that belongs to each density, shape (growing densities,)."""
        growing = self._spaces.growing
        return self._share(coefficient)[growing] / self._shares[growing]

    def _at_the_energies(self) -> LocalSource:
        """The mass source of each density at the running displacement."""
        energy = assemble(self._energy)[self._energy_dofs] / self._energy_shares
        growth: Any = self._growth
        past = self._state.past
        if past is not None:
            growth = replace(growth, set_point=past.x.array[self._spaces.growing])
        return LocalSource(growth, self._material, energy, self._weights)

    def solve(self) -> bool:
        """Solve the balance of mass for each density; whether all were found on this rank."""
        state, growing = self._state, self._spaces.growing
        self._source = source = self._at_the_energies()
        old, guess = state.old_density.x.array[growing], state.density.x.array[growing]
        density = solve_density(source, old, float(state.time_step.value), guess)
        state.density.x.array[growing] = density
        if self.free is not None:
            self.free.x.array[growing] = ~np.isin(density, self._spaces.scene.growth.limits)
        return bool(np.all(np.isfinite(density)))

    def mass_rate(self) -> float:
        """∫ R₀ dV; where a density has stopped at a bound, what of the source took effect in the step."""
        state, growing = self._state, self._spaces.growing
        rate = (self._source or self._at_the_energies()).rate(state.density.x.array[growing])
        if self.free is not None and self._source is not None:
            stopped = self.free.x.array[growing] == 0
            change = (state.density.x.array[growing] - state.old_density.x.array[growing]) / float(
                state.time_step.value
            )
            rate[stopped] = change[stopped]
        return self._spaces.comm.allreduce(float(self._spaces.volumes[growing] @ rate))

    def unloaded_resorption(self) -> float:
        """∫ of the source's rate without energy, dV."""
        rate, volumes = self._growth.resting_rate(self._material), self._spaces.volumes[self._spaces.growing]
        return self._spaces.comm.allreduce(float(np.sum(volumes * rate)))


def with_mass_points(spaces: Spaces, volume: ufl.Measure) -> ufl.Measure:
    """A measure with the integration points of the balance of mass."""
    return volume.reconstruct(metadata={"quadrature_degree": spaces.variant.mass_degree})
