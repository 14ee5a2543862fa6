"""Densities that no two cells share: found by a local Newton iteration, eliminated from the global system.

until equilibrium of momentum:                       (the paper's integration-point based flow chart)
    for each density: solve ρ − ρₙ = Δt R₀(ρ, u)      local Newton
    solve [K_uu − K_uρ K_ρρ⁻¹ K_ρu] Δu = −G_u         global Newton, displacements only
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import basix.ufl
import dolfinx
import numpy as np
import ufl

from growthx import balances, compat
from growthx.assembly import assemble
from growthx.condensation import condensed_tangent
from growthx.discretisation import Discretisation
from growthx.errors import InputError
from growthx.fields import law_as_arrays
from growthx.local_balance import LocalSource, solve_density
from growthx.momentum import total
from growthx.variants import AtPoints, right_ones

if TYPE_CHECKING:
    from growthx.arrays import Floats
    from growthx.loads import LoadCase
    from growthx.scene import Scene
    from growthx.variants import Variant


def _split(function: Any, cases: tuple[LoadCase, ...]) -> list[Any]:
    """The displacements of the load cases, of a function or argument of them all."""
    return [function] if len(cases) == 1 else list(ufl.split(function))


class PointBased(Discretisation):
    """One density per cell or per integration point, statically condensed; the unknown is the displacement."""

    def __init__(self, scene: Scene, variant: Variant) -> None:
        super().__init__(scene, variant)
        self._refuse_what_needs_gradients()
        # ∂R₀/∂F ∝ P̄ makes it so, where both balances are taken at the same points, and for a mean of R₀ if the
        # factor is the same at all of them.
        self._pointwise = isinstance(variant.density, AtPoints)
        linear = self._pointwise or scene.growth.is_linear
        self.symmetric = variant.one_rule and linear and not scene.open_loads and scene.inertia is None
        V = self._make_unknown()
        us, tests, rho = self._us, _split(ufl.TestFunction(V), self.cases), self.density
        growing = [self.momentum.inside(us, rho, tests, self.growing_volume)]
        growing += self.momentum.of_corners(us, rho, tests, self.growing_volume)
        # Neither knows a density that is solved for: their tangents need no condensation.
        resting, boundary = self._resting_momentum(us, tests), self.momentum.on_boundaries(us, rho, tests)
        residuals = [total(growing[:1] + resting[:1]), *growing[1:], *resting[1:], *boundary]
        self.residuals = [self.compile.form(form) for form in residuals]
        self.tangents = [self._condensed_tangent(V)]
        self.tangents += [self.compile.form(ufl.derivative(form, self.unknown)) for form in resting + boundary]
        self.coupling = self.tangents[0]
        if resting:
            self.coupling = self.compile.form(ufl.inner(ufl.TrialFunction(V), ufl.TestFunction(V)) * self.whole_volume)
        self._hold([V] if len(us) == 1 else [V.sub(case) for case in range(len(us))])
        self._load(tests, V)
        self._shares = self.volumes if variant.one_rule else self._share(1.0)
        self._prepare_energies()
        self._local_material = law_as_arrays(scene.material, scene.mesh, self._average)
        self._local_growth = law_as_arrays(scene.growth, scene.mesh, self._average)

    def _make_unknown(self) -> dolfinx.fem.FunctionSpace:
        """The unknown is the displacement itself or, of several load cases, all of them; returns its space."""
        V, count = self.displacement_space, len(self.cases)
        if count == 1:
            space, self.unknown, self.parts = V, self.displacement, [slice(None)]
        else:
            space = dolfinx.fem.functionspace(V.mesh, basix.ufl.mixed_element([V.ufl_element()] * count))
            self.unknown = dolfinx.fem.Function(space)
            self.parts = [compat.places(V, space.sub(case)) for case in range(count)]
        self._us = _split(self.unknown, self.cases)
        self._accepted = self.unknown.x.array.copy()
        return space

    def _refuse_what_needs_gradients(self) -> None:
        """Raise InputError for what only a density that is continuous between cells can do."""
        scene, name = self.scene, self.variant.name
        right = right_ones(scene.mesh.cell_name, lambda other: not other.density.local)
        if scene.moves_mass:
            raise InputError(
                f"{name} has densities that jump between cells, on which no flux, influx or prescribed density acts: "
                + right
            )
        for load in scene.open_loads:
            force = load.force(self.displacement, self.density, scene.mesh)
            if load.on is not None and self.density in ufl.algorithms.extract_coefficients(force):
                raise InputError(
                    f"the open load on '{load.on}' depends on the density, which {name} does not know at a boundary: "
                    + right
                )

    def _make_spaces(
        self, displacement: Any, density: Any
    ) -> tuple[dolfinx.fem.FunctionSpace, dolfinx.fem.FunctionSpace]:
        domain = self.scene.mesh.domain
        return dolfinx.fem.functionspace(domain, displacement), dolfinx.fem.functionspace(domain, density)

    def _prepare_energies(self) -> None:
        """Compile the elastic energies that drive the densities: their means, or each if the source is not linear."""
        energy = self.momentum.mean_energy(self._us)
        self._weights = None
        if self._pointwise or self.scene.growth.is_linear:
            self._energy = self._share_form(energy, self.density_space)
            self._energy_dofs, self._energy_shares = self.growing, self._shares[self.growing]
            return
        mesh, degree = self.scene.mesh, self.variant.mass_degree
        points = dolfinx.fem.functionspace(mesh.domain, basix.ufl.quadrature_element(mesh.cell_name, degree=degree))
        self._energy = self._share_form(energy, points)
        cells = self.growing_cells[np.argsort(self.density_space.dofmap.list[self.growing_cells, 0])]
        self._energy_dofs = points.dofmap.list[cells]
        self._energy_shares = assemble(self._share_form(1.0, points))[self._energy_dofs]
        self._weights = self._energy_shares / self._energy_shares.sum(axis=1, keepdims=True)

    def _condensed_tangent(self, V: dolfinx.fem.FunctionSpace) -> dolfinx.fem.Form:
        us, rho, count = self._us, self.density, len(self.cases)
        self._free = dolfinx.fem.Function(self.density_space) if self.scene.growth.is_bounded else None
        element = self.displacement_space.ufl_element()
        both = basix.ufl.mixed_element([element] * count + [self.density_space.ufl_element()])
        space = ufl.FunctionSpace(V.mesh.ufl_domain(), both)
        *tests, test_rho = ufl.TestFunctions(space)
        *trials, trial_rho = ufl.TrialFunctions(space)
        trial = trials[0] if count == 1 else ufl.as_vector([component for each in trials for component in each])
        dV = self.whole_volume  # of a cell: which cells, the form built from this one is told
        dM = self._with_mass_points(dV)
        momentum = self.momentum.inside(us, rho, tests, dV)
        # What has stopped at a bound does not follow the deformation.
        follows = test_rho if self._free is None else self._free * test_rho
        mass = balances.storage(rho, self.old_density, test_rho, self.time_step, dM) - balances.source(
            rho, self.momentum.mean_energy(us), follows, self.growth, self.material, dM
        )
        # Two rules in one form, one of them of a single point, would assemble wrongly and silently.
        residuals = [momentum + mass] if self.variant.one_rule else [momentum, mass]
        residuals += self.momentum.of_corners(us, rho, tests, dV)
        tangents = [
            ufl.derivative(each, self.unknown, trial) + ufl.derivative(each, rho, trial_rho) for each in residuals
        ]
        densities = self.density_space.dofmap.dof_layout.num_dofs
        return self.compile(condensed_tangent, tangents, V, densities, self.growing_cells)

    def _with_mass_points(self, volume: ufl.Measure) -> ufl.Measure:
        """The measure with the integration points of the balance of mass."""
        return volume.reconstruct(metadata={"quadrature_degree": self.variant.mass_degree})

    def _share_form(self, quantity: Any, space: dolfinx.fem.FunctionSpace) -> dolfinx.fem.Form:
        """∫ · dV of a quantity per volume over the part of a cell that belongs to each entry of a local space."""
        test = ufl.TestFunction(space)
        return self.compile.form(quantity * test * self._with_mass_points(self.growing_volume))

    def _share(self, quantity: Any) -> Floats:
        return assemble(self._share_form(quantity, self.density_space))

    def _average(self, coefficient: Any) -> Floats:
        """Mean of a coefficient over the part of a cell that belongs to each density, shape (growing densities,)."""
        return self._share(coefficient)[self.growing] / self._shares[self.growing]

    def _local_source(self) -> LocalSource:
        """The mass source of each density at the running displacement."""
        energy = assemble(self._energy)[self._energy_dofs] / self._energy_shares
        return LocalSource(self._local_growth, self._local_material, energy, self._weights)

    def update(self) -> bool:
        """Solve the balance of mass for each density at the running displacement."""
        dofs = self.growing
        self._source = source = self._local_source()
        time_step = float(self.time_step.value)
        density = solve_density(source, self.old_density.x.array[dofs], time_step, self.density.x.array[dofs])
        self.density.x.array[dofs] = density
        if self._free is not None:
            self._free.x.array[dofs] = ~np.isin(density, self.scene.growth.limits)
        return bool(np.all(np.isfinite(density)))

    def accept_step(self) -> None:
        """Make the running iterate the state."""
        super().accept_step()
        self.accepted_density[:] = self.density.x.array
        self._accepted[:] = self.unknown.x.array
        if len(self.cases) > 1:
            for case, u in enumerate(self.displacements):
                u.x.array[:] = self.iterate_displacement(case)
            self._show_mean_displacement()
        self.momentum.remember_motion(self.displacement.x.array)

    def reject_step(self) -> None:
        """Go back to the state at the start of the step."""
        super().reject_step()
        self.density.x.array[:] = self.accepted_density
        self.unknown.x.array[:] = self._accepted

    def iterate_density(self) -> Floats:
        """Density of the running iterate."""
        return self.density.x.array

    @property
    def dofs(self) -> int:
        """Number of displacements, supports included."""
        dofmap = self.unknown.function_space.dofmap
        return int(dofmap.index_map.size_global * dofmap.index_map_bs)

    def mass_rate(self) -> float:
        """∫ R₀ dV; where a density has stopped at a bound, what of the source took effect in the step."""
        dofs = self.growing
        source = self._source.rate(self.density.x.array[dofs])
        if self._free is not None:
            stopped = self._free.x.array[dofs] == 0
            change = (self.density.x.array[dofs] - self.old_density.x.array[dofs]) / float(self.time_step.value)
            source[stopped] = change[stopped]
        return self.comm.allreduce(float(self.volumes[dofs] @ source))
