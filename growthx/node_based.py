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
from mpi4py import MPI

from growthx import balances, compat
from growthx.assembly import assemble
from growthx.discretisation import Discretisation
from growthx.errors import InputError
from growthx.fields import is_uniform, law_as_ufl
from growthx.momentum import at_corners, corner_shares, total

if TYPE_CHECKING:
    from growthx.arrays import Floats, Indices
    from growthx.scene import Scene
    from growthx.variants import Variant


LEAST_LEFT = 0.01  # of a density, by one Newton step


class NodeBased(Discretisation):
    """Nodal densities; the unknown is the pair of displacement and density."""

    symmetric = False

    def __init__(self, scene: Scene, variant: Variant) -> None:
        super().__init__(scene, variant)
        domain = scene.mesh.domain
        for influx in scene.influx:
            self._require_growth(influx.on, "influx")
        for prescribed in scene.prescribed_densities:
            self._require_growth(prescribed.on, "prescribed density")
        W = self._mixed_space
        self.unknown = dolfinx.fem.Function(W)
        self.unknown.x.array[self._density_part] = self.density.x.array

        *us, rho = ufl.split(self.unknown)
        *tests, test_rho = ufl.TestFunctions(W)
        energy = self.momentum.mean_energy(us)
        dV = self.growing_volume
        # The balance of mass is put in units of force, so that one norm weighs each balance on its own scale.
        scale = self._mass_to_force = dolfinx.fem.Constant(domain, np.float64(1.0))
        if variant.storage_at_corners or variant.source_at_corners:
            self._corners = corner_shares(scene.mesh)
        self._gains = [self.compile.form(form) for form in self._mass_gains(us, rho, energy, test_rho)]
        force_rho = scale * test_rho
        residual, at_nodes = self.momentum.inside(us, rho, tests, dV), []
        storing, sourcing = (
            self._mass_rule(force_rho, lumped) for lumped in (variant.storage_at_corners, variant.source_at_corners)
        )
        storage = balances.storage(rho, self.old_density, storing[0], self.time_step, storing[1])
        source = -balances.source(rho, energy, sourcing[0], self.growth, self.material, sourcing[1])
        # Terms with points of their own go into a form of their own.
        for term, lumped in ((storage, variant.storage_at_corners), (source, variant.source_at_corners)):
            if lumped:
                at_nodes.append(term)
            else:
                residual += term
        if scene.flux is not None:
            residual += balances.flux(rho, scale * test_rho, law_as_ufl(scene.flux, scene.mesh), self.material, dV)
        resting = self._resting_momentum(us, tests)
        forms = [sum(resting[:1], residual), *resting[1:], *self.momentum.of_corners(us, rho, tests, dV)]
        forms += [total(at_nodes)] if at_nodes else []
        forms += self.momentum.on_boundaries(us, rho, tests)
        forms += [-form for form in self._influx(us, rho, scale * test_rho)]
        self.residuals = [self.compile.form(form) for form in forms]
        self.tangents = [self.compile.form(ufl.derivative(form, self.unknown)) for form in forms]
        self.coupling = self.tangents[0]
        owned_size = W.dofmap.index_map.size_local * W.dofmap.index_map_bs
        self._owned_densities = self._density_part[self._density_part < owned_size]
        self._hold([W.sub(case) for case in range(len(us))])
        self._hold_densities(W)
        self._rest_densities(W)
        self._load(tests, W)
        self._force_scale, self._mass_scale = self.force_scale(), self._reference_mass()
        self._source_scale = self._reference_source(test_rho)

    def _make_spaces(
        self, displacement: Any, density: Any
    ) -> tuple[dolfinx.fem.FunctionSpace, dolfinx.fem.FunctionSpace]:
        count = len(self.scene.load_cases)
        mixed = basix.ufl.mixed_element([displacement] * count + [density])
        domain = self.scene.mesh.domain
        self._mixed_space = W = dolfinx.fem.functionspace(domain, mixed)
        # Spaces of their own rather than collapsed parts: collapsing takes the time of many steps where W is large.
        V, D = dolfinx.fem.functionspace(domain, displacement), dolfinx.fem.functionspace(domain, density)
        self.parts = [compat.places(V, W.sub(case)) for case in range(count)]
        self._density_part = compat.places(D, W.sub(count))
        return V, D

    def _influx(self, us: list[Any], rho: Any, test: Any) -> list[ufl.Form]:
        """Mass that enters through boundaries, one form for each."""
        mesh, degree = self.scene.mesh, 2 * self.density_space.element.basix_element.degree
        forms = []
        for influx in self.scene.influx:
            rate = influx.value(us[0], rho, mesh)
            forms.append(balances.influx(rate, test, mesh.boundary_measure(influx.on, degree)))
        return forms

    def _require_growth(self, boundary: str, what: str) -> None:
        """Raise InputError if some of the densities on a boundary lie in regions that do not grow."""
        mesh, space = self.scene.mesh, self.density_space
        dofs = dolfinx.fem.locate_dofs_topological(space, mesh.dim - 1, mesh.boundary(boundary))
        owned = dofs[dofs < space.dofmap.index_map.size_local]
        resting = self.comm.allreduce(int(np.count_nonzero(~np.isin(owned, self.density_dofs))))
        if resting:
            raise InputError(
                f"the boundary '{boundary}' has {resting} nodes in regions that do not grow, where no {what} can act: "
                "one that bounds growing regions alone would be right"
            )

    def _mass_rule(self, test: Any, lumped: bool) -> tuple[Any, ufl.Measure]:
        """Test function and measure of a term of the balance of mass: Gauss points or, lumped, the cells' corners."""
        if not lumped:
            return test, self.growing_volume
        return self._corners * test, at_corners(self.growing_volume)

    def _mass_gains(self, us: list[Any], rho: Any, energy: Any, test: Any) -> list[ufl.Form]:
        """What the nodes gain per time from the source and through the boundary."""
        test_source, dV = self._mass_rule(test, self.variant.source_at_corners)
        source = balances.source(rho, energy, test_source, self.growth, self.material, dV)
        return [source, *self._influx(us, rho, test)]

    def _hold_densities(self, W: dolfinx.fem.FunctionSpace) -> None:
        """Densities that are prescribed on boundaries."""
        self._prescribed = []
        mesh, part = self.scene.mesh, W.sub(len(self.cases))
        for prescribed in self.scene.prescribed_densities:
            value = dolfinx.fem.Function(self.density_space)
            value.x.array[:] = prescribed.density
            dofs = dolfinx.fem.locate_dofs_topological(
                (part, self.density_space), mesh.dim - 1, mesh.boundary(prescribed.on)
            )
            condition = dolfinx.fem.dirichletbc(value, dofs, part)
            self._prescribed.append((dofs[0], prescribed.density, condition))
            self.conditions.append(condition)

    def _rest_densities(self, W: dolfinx.fem.FunctionSpace) -> None:
        """Nodes whose cells all rest keep their density: no equation is solved for it."""
        growing = dolfinx.la.vector(self.density_space.dofmap.index_map, 1)
        growing.array[self.density_dofs] = 1.0
        growing.scatter_forward()
        self._resting = self.comm.allreduce(len(self.volumes) - len(self.density_dofs))
        if self._resting:
            dofs = np.sort(self._density_part[growing.array == 0])
            zero, part = dolfinx.default_scalar_type(0), W.sub(len(self.cases))
            self.conditions.append(dolfinx.fem.dirichletbc(zero, dofs, part))

    def _reference_mass(self) -> float:
        """‖nodal masses at the reference density‖₂, what the balance of mass is measured against (mass)."""
        density = self.scene.material.reference_density
        weights = self.volumes * (density if is_uniform(density) else self.density.x.array[: len(self.volumes)])
        return float(np.sqrt(self.comm.allreduce(float(weights @ weights))))

    def _reference_source(self, test: Any) -> float:
        """‖nodal shares of the source c S* without any stimulus‖₂ (mass per time)."""
        growth = self.scene.growth
        if is_uniform(growth.rate) and is_uniform(growth.attractor):
            shares = growth.rate * growth.attractor * self.volumes
        else:
            resorption = self.growth.rate * self.growth.attractor
            shares = assemble(self.compile.form(resorption * test * self.growing_volume))
        return float(np.sqrt(self.comm.allreduce(float(shares @ shares))))

    def begin_step(self, time_step: float, amplitude: float, time: float = 0.0, base: Floats | None = None) -> None:
        """Set the length, load and end of a step of implicit Euler, and put what is prescribed on the first iterate."""
        super().begin_step(time_step, amplitude, time, base)
        for dofs, density, _ in self._prescribed:
            self.unknown.x.array[dofs] = density
        # Long steps do not gain a multiple of the mass: the source is their scale.
        self._mass_to_force.value = self._force_scale / max(self._mass_scale / time_step, self._source_scale)

    def update(self) -> bool:
        """Whether all nodal densities are positive."""
        return bool(np.all(self.iterate_density() > 0))

    def accept_step(self) -> None:
        """Make the running iterate the state."""
        super().accept_step()
        self.momentum.remember_motion(self.iterate_displacement())
        for case, u in enumerate(self.displacements):
            u.x.array[:] = self.iterate_displacement(case)
        self._show_mean_displacement()
        self.density.x.array[:] = self.accepted_density[:] = self.iterate_density()

    def reject_step(self) -> None:
        """Go back to the state at the start of the step."""
        super().reject_step()
        for part, u in zip(self.parts, self.displacements, strict=True):
            self.unknown.x.array[part] = u.x.array
        self.unknown.x.array[self._density_part] = self.accepted_density

    def largest_share(self, position: Floats, step: Floats) -> float:
        """What leaves of each nodal density `LEAST_LEFT` of what it is."""
        dofs = self._owned_densities
        density, fall = position[dofs], -step[dofs]
        shares = (1 - LEAST_LEFT) * density[fall > 0] / fall[fall > 0]
        return float(self.comm.allreduce(shares.min(initial=1.0), MPI.MIN))

    def iterate_density(self) -> Floats:
        """Density of the running iterate."""
        return self.unknown.x.array[self._density_part]

    @property
    def dofs(self) -> int:
        """Number of displacements and of densities that grow, supports included."""
        dofmap = self.unknown.function_space.dofmap
        return int(dofmap.index_map.size_global * dofmap.index_map_bs) - self._resting

    def mass_rate(self) -> float:
        """∫ R₀ dV and the influx: the nodal shares, summed; and what holds densities where they are prescribed."""
        gains = sum(float(assemble(form).sum()) for form in self._gains)
        return self.comm.allreduce(gains) + self._supplied()

    def _supplied(self) -> float:
        """Mass per time that must be supplied to hold densities at their prescribed values or bounds."""
        held = self._held_densities()
        if held is None:
            return 0.0
        return self.comm.allreduce(float(self._borne[held].sum())) / float(self._mass_to_force.value)

    def _held_densities(self) -> Indices | None:
        """Owned unknowns that are densities at prescribed values or at bounds; None if the scene has neither."""
        size = len(self.nodal_load)
        held = [dofs[dofs < size] for dofs, _, _ in self._prescribed]
        if self.scene.growth.is_bounded:
            dofs = self._density_part[self.density_dofs]
            held.append(dofs[np.isin(self.unknown.x.array[dofs], self.scene.growth.limits)])
        return np.unique(np.concatenate(held)) if held else None

    def limits(self) -> tuple[Floats, Floats] | None:
        """Lowest and highest value of each owned unknown, if any has a bound."""
        if not self.scene.growth.is_bounded:
            return None
        low, high = (np.full(len(self.nodal_load), value) for value in (-np.inf, np.inf))
        dofs = self._density_part[self.density_dofs]
        low[dofs], high[dofs] = self.scene.growth.limits
        return low, high
