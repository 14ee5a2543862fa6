"""Densities that no two cells share: found by a local Newton iteration, eliminated from the global system.

until equilibrium of momentum:                       (the paper's integration-point based flow chart)
    for each density: solve ρ − ρₙ = Δt R₀(ρ, u)      local Newton
    solve [K_uu − K_uρ K_ρρ⁻¹ K_ρu] Δu = −G_u         global Newton, displacements only
"""

from __future__ import annotations

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
from growthx.fem.condensation import condensed_tangent

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
        us, tests, rho, space = unknowns.displacements, unknowns.tests, state.density, unknowns.space
        self._local = LocalDensities(spaces, state, momentum.mean_energy(us), material)
        growing = [momentum.inside(us, rho, tests, spaces.growing_volume)]
        growing += momentum.of_corners(us, rho, tests, spaces.growing_volume)
        # Neither knows a density that is solved for: their tangents need no condensation.
        resting, boundary = momentum.of_what_rests(us, tests), momentum.on_boundaries(us, rho, tests)
        residuals = [total(growing[:1] + resting[:1]), *growing[1:], *resting[1:], *boundary]
        self.residuals = [spaces.compile.form(form) for form in residuals]
        self.tangents = [self._condensed_tangent()]
        self.tangents += [spaces.compile.form(ufl.derivative(form, unknowns.function)) for form in resting + boundary]
        self.coupling = self.tangents[0]
        if resting:
            trial, test = ufl.TrialFunction(space), ufl.TestFunction(space)
            self.coupling = spaces.compile.form(ufl.inner(trial, test) * spaces.whole_volume)
        self.lumped: None = None
        self.conditions: list[dolfinx.fem.DirichletBC] = []
        self.constants: list[dolfinx.fem.Constant] = []

    def _condensed_tangent(self) -> dolfinx.fem.Form:
        spaces, rho, count = self._spaces, self._state.density, len(self._spaces.cases)
        elements = [spaces.displacement_space.ufl_element()] * count + [spaces.density_space.ufl_element()]
        space = ufl.FunctionSpace(spaces.scene.mesh.domain.ufl_domain(), basix.ufl.mixed_element(elements))
        *tests, test_rho = ufl.TestFunctions(space)
        *trials, trial_rho = ufl.TrialFunctions(space)
        trial = trials[0] if count == 1 else ufl.as_vector([component for each in trials for component in each])
        tangents = [
            ufl.derivative(each, self.unknowns.function, trial) + ufl.derivative(each, rho, trial_rho)
            for each in self._balances(tests, test_rho)
        ]
        densities = spaces.density_space.dofmap.dof_layout.num_dofs
        return spaces.compile(condensed_tangent, tangents, self.unknowns.space, densities, spaces.growing_cells)

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
