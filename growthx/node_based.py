"""A density continuous between cells: solved together with the displacement, monolithically.

until equilibrium of mass and momentum:               (the paper's node-based flow chart)
    | K_uu  K_uρ | | Δu |     | G_u |
    | K_ρu  K_ρρ | | Δρ |  = −| G_ρ |                  (27), (28)
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import basix.ufl
import dolfinx
import numpy as np
import ufl

from growthx import balances, compat
from growthx.assembly import assemble
from growthx.discretisation import Discretisation
from growthx.fields import is_uniform

if TYPE_CHECKING:
    from growthx.arrays import Floats
    from growthx.scene import Scene
    from growthx.variants import Variant


class NodeBased(Discretisation):
    """Nodal densities; the unknown is the pair of displacement and density."""

    symmetric = False

    def __init__(self, scene: Scene, variant: Variant) -> None:
        super().__init__(scene, variant)
        domain = scene.mesh.domain
        W = self._mixed_space
        self.unknown = dolfinx.fem.Function(W)
        self.unknown.x.array[self._density_part] = self.density.x.array

        u, rho = ufl.split(self.unknown)
        test_u, test_rho = ufl.TestFunctions(W)
        dV = self.growing_volume
        # The balance of mass is put in units of force, so that one norm weighs each balance on its own scale.
        scale = self._mass_to_force = dolfinx.fem.Constant(domain, np.float64(1.0))
        self._source = self.compile.form(balances.source(rho, u, test_rho, self.growth, self.material, dV))
        residual = (
            self._growing_work(u, rho, test_u)
            + balances.storage(rho, self.old_density, scale * test_rho, self.time_step, dV)
            - balances.source(rho, u, scale * test_rho, self.growth, self.material, dV)
        )
        resting = self._resting_work(u, test_u)
        residual = residual if resting is None else residual + resting
        self.residual = self.compile.form(residual)
        self.tangents = [self.compile.form(ufl.derivative(residual, self.unknown))]
        self.coupling = self.tangents[0]
        self._hold(W.sub(0))
        self._rest_densities(W)
        self._load(test_u, W)
        self._force_scale, self._mass_scale = self.force_scale(), self._reference_mass()

    def _make_spaces(
        self, displacement: Any, density: Any
    ) -> tuple[dolfinx.fem.FunctionSpace, dolfinx.fem.FunctionSpace]:
        mixed = basix.ufl.mixed_element([displacement, density])
        self._mixed_space = W = dolfinx.fem.functionspace(self.scene.mesh.domain, mixed)
        V, self._displacement_part = compat.collapse(W.sub(0))
        D, self._density_part = compat.collapse(W.sub(1))
        return V, D

    def _rest_densities(self, W: dolfinx.fem.FunctionSpace) -> None:
        """Nodes whose cells all rest keep their density: no equation is solved for it."""
        growing = dolfinx.la.vector(self.density_space.dofmap.index_map, 1)
        growing.array[self.density_dofs] = 1.0
        growing.scatter_forward()
        self._resting = self.comm.allreduce(len(self.volumes) - len(self.density_dofs))
        if self._resting:
            dofs = np.sort(self._density_part[growing.array == 0])
            self.conditions.append(dolfinx.fem.dirichletbc(dolfinx.default_scalar_type(0), dofs, W.sub(1)))

    def _reference_mass(self) -> float:
        """‖nodal masses at the reference density‖₂, what the balance of mass is measured against (mass)."""
        density = self.scene.material.reference_density
        weights = self.volumes * (density if is_uniform(density) else self.density.x.array[: len(self.volumes)])
        return float(np.sqrt(self.comm.allreduce(float(weights @ weights))))

    def begin_step(self, time_step: float, amplitude: float) -> None:
        """Set the step's length and load, and put the prescribed displacements on the first iterate."""
        super().begin_step(time_step, amplitude)
        self._mass_to_force.value = self._force_scale / (self._mass_scale / time_step)

    def update(self) -> bool:
        """Whether all nodal densities are positive."""
        return bool(np.all(self.iterate_density() > 0))

    def accept_step(self) -> None:
        """Make the running iterate the state."""
        self.displacement.x.array[:] = self.iterate_displacement()
        self.density.x.array[:] = self.iterate_density()
        self.old_density.x.array[:] = self.density.x.array

    def reject_step(self) -> None:
        """Go back to the state at the start of the step."""
        self.unknown.x.array[self._displacement_part] = self.displacement.x.array
        self.unknown.x.array[self._density_part] = self.density.x.array

    def iterate_density(self) -> Floats:
        """Density of the running iterate."""
        return self.unknown.x.array[self._density_part]

    def iterate_displacement(self) -> Floats:
        """Displacement of the running iterate."""
        return self.unknown.x.array[self._displacement_part]

    @property
    def dofs(self) -> int:
        """Number of displacements and of densities that grow, supports included."""
        dofmap = self.unknown.function_space.dofmap
        return int(dofmap.index_map.size_global * dofmap.index_map_bs) - self._resting

    def source_rate(self) -> float:
        """∫ R₀ dV: the nodal shares of the source, summed."""
        return self.comm.allreduce(float(assemble(self._source).sum()))

    def _in_unknown(self, displacement: Floats) -> Floats:
        unknown = np.zeros_like(self.unknown.x.array)
        unknown[self._displacement_part] = displacement
        return unknown
