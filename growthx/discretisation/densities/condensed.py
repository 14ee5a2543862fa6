"""Densities that no two cells share: found by a local Newton iteration, eliminated from the global system.

until equilibrium of momentum:                       (the paper's integration-point based flow chart)
    for each density: solve ρ − ρₙ = Δt R₀(ρ, u)      local Newton
    solve [K_uu − K_uρ K_ρρ⁻¹ K_ρu] Δu = −G_u         global Newton, displacements only
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import basix.ufl
import numpy as np
import ufl

from growthx.common.errors import InputError
from growthx.discretisation.densities.local import LocalDensities, with_mass_points
from growthx.discretisation.forms import balances
from growthx.discretisation.forms.momentum import total
from growthx.discretisation.unknowns import Unknowns
from growthx.discretisation.variants import AtPoints, right_ones
from growthx.fem.condensation import Elimination

if TYPE_CHECKING:
    import dolfinx

    from growthx.common.arrays import Floats, Marks
    from growthx.constitutive.energies import Elasticity
    from growthx.constitutive.sources import MassSource
    from growthx.discretisation.forms.momentum import Momentum
    from growthx.discretisation.spaces import Spaces
    from growthx.discretisation.state import State


class EliminatedDensities:
    """One density per cell or per integration point, statically condensed, as `system.Densities`."""

    def __init__(
        self, spaces: Spaces, state: State, momentum: Momentum, material: Elasticity, growth: MassSource
    ) -> None:
        """material, growth: in UFL.  Raises InputError for what needs gradients of the density."""
        self._spaces, self._state, self._momentum = spaces, state, momentum
        self._material, self._growth = material, growth
        scene, variant = spaces.scene, spaces.variant
        _refuse_what_needs_gradients(spaces, state)
        # ∂R₀/∂F ∝ P̄ makes it so, where both balances are taken at the same points, and for a mean of R₀ if the
        # factor is the same at all of them.
        linear = isinstance(variant.density, AtPoints) or scene.growth.is_linear
        linear &= len(spaces.cases) == 1 or scene.growth.mean_exponent == 1.0
        self.symmetric = variant.one_rule and linear and not scene.open_loads and scene.inertia is None
        self.unknowns = unknowns = Unknowns(spaces, state, with_density=False)
        us, tests, rho = unknowns.displacements, unknowns.tests, state.density
        self._local = LocalDensities(spaces, state, momentum.mean_energy(us), material)
        growing = [momentum.inside(us, rho, tests, spaces.growing_volume)]
        growing += momentum.of_corners(us, rho, tests, spaces.growing_volume)
        # Neither knows a density that is solved for: their tangents need no condensation.
        resting, boundary = momentum.of_what_rests(us, tests), momentum.on_boundaries(us, rho, tests)
        residuals = [total(growing[:1] + resting[:1]), *growing[1:], *resting[1:], *boundary]
        self.residuals = [spaces.compile.residual(form) for form in residuals]
        self._beside = resting + boundary
        self.lumped: None = None
        self.conditions: list[dolfinx.fem.DirichletBC] = []
        self.constants: list[dolfinx.fem.Constant] = []

    @cached_property
    def tangents(self) -> list[dolfinx.fem.Form]:
        """Of all displacements; compiled when they are asked for."""
        spaces = self._spaces
        inside = self.own_tangents[0][:1] if len(spaces.cases) == 1 and self.symmetric else [self._condensed_tangent()]
        derivatives = [self._momentum.deformation.derivative(form, self.unknowns.function) for form in self._beside]
        return inside + [spaces.compile.form(derivative) for derivative in derivatives]

    @cached_property
    def coupling(self) -> dolfinx.fem.Form:
        """Between all unknowns of a cell, whether it grows or rests."""
        if not self._spaces.rests:
            return self.tangents[0]
        trial, test = ufl.TrialFunction(self.unknowns.space), ufl.TestFunction(self.unknowns.space)
        return self._spaces.compile.form(ufl.inner(trial, test) * self._spaces.whole_volume)

    @cached_property
    def own_tangents(self) -> list[list[dolfinx.fem.Form]]:
        """Of each displacement, what grows and what rests of its own block; none where that is not symmetric."""
        cases = range(len(self._spaces.cases)) if self.symmetric else ()
        return [[self._condensed_tangent(case), *self._resting_tangent(case)] for case in cases]

    def _condensed_tangent(self, only: int | None = None) -> dolfinx.fem.Form:
        """Of all displacements, or of one alone."""
        spaces, rho, count = self._spaces, self._state.density, len(self._spaces.cases)
        used = range(count) if only is None else [only]
        elements = [spaces.displacement_space.ufl_element()] * len(used) + [spaces.density_space.ufl_element()]
        space = ufl.FunctionSpace(spaces.scene.mesh.domain.ufl_domain(), basix.ufl.mixed_element(elements))
        *tests, test_rho = ufl.TestFunctions(space)
        *trials, trial_rho = ufl.TrialFunctions(space)
        direction = self._direction(dict(zip(used, trials, strict=True)))
        own, derivative = dict(zip(used, tests, strict=True)), self._momentum.deformation.derivative
        tangents = [
            derivative(each, self.unknowns.function, direction) + ufl.derivative(each, rho, trial_rho)
            for each in self._balances([own.get(case) for case in range(count)], test_rho)
        ]
        densities = spaces.density_space.dofmap.dof_layout.num_dofs
        target = self.unknowns.space if only is None else spaces.displacement_space
        return spaces.compile.condensed_tangent(
            tangents, Elimination(target, densities, spaces.growing_cells, often=only is not None)
        )

    def _resting_tangent(self, case: int) -> list[dolfinx.fem.Form]:
        """Of one displacement alone where nothing grows, if that is anywhere; nothing is condensed there."""
        spaces, state = self._spaces, self._state
        if not spaces.rests:
            return []
        space, domain = spaces.displacement_space, spaces.scene.mesh.domain.ufl_domain()
        alone = ufl.FunctionSpace(domain, space.ufl_element())
        tests = [ufl.TestFunction(alone) if other == case else None for other in range(len(spaces.cases))]
        us, volume = self.unknowns.displacements, spaces.whole_volume
        form = self._momentum.inside(us, state.resting_density, tests, volume, rests=True)
        direction = self._direction({case: ufl.TrialFunction(alone)})
        tangent = self._momentum.deformation.derivative(form, self.unknowns.function, direction)
        elimination = Elimination(space, 0, spaces.resting_cells, often=True)
        return [spaces.compile.condensed_tangent([tangent], elimination)]

    def _direction(self, trials: dict[int, Any]) -> Any:
        """Of all displacements in UFL, zero but for those of some load cases."""
        if self.unknowns.alone:
            return trials[0]
        none = [0.0] * self._spaces.scene.mesh.dim
        cases = range(len(self._spaces.cases))
        return ufl.as_vector([component for case in cases for component in trials.get(case, none)])

    def _balances(self, tests: list[Any], test_rho: Any) -> list[ufl.Form]:
        """Both balances of a cell that grows, as forms of one rule each."""
        spaces, state, momentum, us = self._spaces, self._state, self._momentum, self.unknowns.displacements
        rho, dV = state.density, spaces.whole_volume  # of a cell: which cells, the form built from this one is told
        dM = with_mass_points(spaces, dV)
        of_momentum = momentum.inside(us, rho, tests, dV)
        # What has stopped at a bound does not follow the deformation.
        follows = test_rho if self._local.free is None else self._local.free * test_rho
        storage = balances.storage(rho, state.old_density, test_rho, state.time_step, dM)
        source = balances.source(rho, momentum.mean_energy(us), follows, self._growth, self._material, dM)
        of_mass = storage - source
        # Two rules in one form, one of them of a single point, would assemble wrongly and silently.
        both = [of_momentum + of_mass] if spaces.variant.one_rule else [of_momentum, of_mass]
        return both + momentum.of_corners(us, rho, tests, dV)

    # -- as `system.Densities` -----------------------------------------------------------------------------------------

    @property
    def dofs(self) -> int:
        """Number of displacements, supports included."""
        return self.unknowns.size()

    def begin(self, force_scale: float) -> None:
        """Nothing is prescribed."""

    def update(self) -> bool:
        """Solve the balance of mass for each density at the running displacement."""
        return self._local.solve()

    def iterate(self) -> Floats:
        """Density of the running iterate."""
        return self._state.density.x.array

    def set_iterate(self, density: Floats) -> None:
        """Make a density that of the running iterate, which the next one is found from."""
        self._state.density.x.array[:] = density

    def limits(self) -> tuple[Floats, Floats] | None:
        """None: densities are kept within their bounds where they are found."""
        return None

    def largest_share(self, position: Floats, step: Floats) -> float:
        """All of a step: a density that is found is positive."""
        return 1.0

    def vanishing(self) -> Marks:
        """None: where no positive density is found, none is there."""
        return np.zeros(len(self._state.density.x.array), dtype=bool)

    def mass_rate(self, borne: Floats | None) -> float:
        """∫ R₀ dV, see `LocalDensities.mass_rate`."""
        return self._local.mass_rate()

    def unloaded_resorption(self) -> float:
        """∫ c S* dV."""
        return self._local.unloaded_resorption()

    def momentum_forms(self, tests: list[Any]) -> list[ufl.Form]:
        """The balance of momentum at the running iterate but dead loads, tested by vectors in UFL."""
        return self._momentum.whole(self.unknowns.displacements, self._state.density, tests)


def _refuse_what_needs_gradients(spaces: Spaces, state: State) -> None:
    """Raise InputError for what only a density that is continuous between cells can do."""
    scene, name = spaces.scene, spaces.variant.name
    right = right_ones(scene.mesh.cell_name, lambda other: not other.density.local)
    if scene.moves_mass:
        raise InputError(
            f"{name} has densities that jump between cells, on which no flux, influx or prescribed density acts: "
            + right
        )
    for load in scene.open_loads:
        force = load.force(state.displacement, state.density, scene.mesh)
        if load.on is not None and state.density in ufl.algorithms.extract_coefficients(force):
            raise InputError(
                f"the open load on '{load.on}' depends on the density, which {name} does not know at a boundary: "
                + right
            )
