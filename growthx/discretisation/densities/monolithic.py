"""A density continuous between cells: solved together with the displacement, monolithically.

until equilibrium of mass and momentum:               (the paper's node-based flow chart)
    | K_uu  K_uρ | | Δu |     | G_u |
    | K_ρu  K_ρρ | | Δρ |  = −| G_ρ |                  (27), (28)
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

import dolfinx
import numpy as np
import ufl
from mpi4py import MPI

from growthx.common.arrays import is_uniform
from growthx.common.errors import InputError
from growthx.discretisation.densities.lumped_nodes import LumpedNodes
from growthx.discretisation.forms.mass import Mass
from growthx.discretisation.forms.momentum import total
from growthx.discretisation.unknowns import Unknowns
from growthx.fem.assembly import assemble
from growthx.fem.point_values import points_of

if TYPE_CHECKING:
    from growthx.common.arrays import Floats, Indices, Marks
    from growthx.constitutive.energies import Elasticity
    from growthx.constitutive.sources import MassSource
    from growthx.discretisation.forms.momentum import Momentum
    from growthx.discretisation.spaces import Spaces
    from growthx.discretisation.state import State

LEAST_LEFT = 0.01  # of a density, by one Newton step


class NodalDensities:
    """Densities among the unknowns, as `system.Densities`."""

    symmetric = False
    own_tangents: ClassVar[list[list[dolfinx.fem.Form]]] = []

    def __init__(
        self, spaces: Spaces, state: State, momentum: Momentum, material: Elasticity, growth: MassSource
    ) -> None:
        """material, growth: in UFL."""
        self._spaces, self._state, self._momentum = spaces, state, momentum
        self._material, self._growth = material, growth
        _require_growth(spaces)
        self.unknowns = unknowns = Unknowns(spaces, state, with_density=True)
        assert unknowns.density_part is not None and unknowns.density_subspace is not None
        self._part, self._subspace = unknowns.density_part, unknowns.density_subspace
        # The balance of mass is put in units of force, so that one norm weighs each balance on its own scale.
        self._mass_to_force = dolfinx.fem.Constant(spaces.scene.mesh.domain, np.float64(1.0))
        self.constants = [self._mass_to_force]
        energy = momentum.mean_energy(unknowns.displacements)
        self._mass = Mass(spaces, state, unknowns, energy, growth, material)
        self._gains = [spaces.compile.form(form) for form in self._mass.gains(unknowns.test_density)]
        forms = self._forms()
        self._residuals = [spaces.compile.residual(form) for form in forms]
        derivative = momentum.deformation.derivative
        self._tangents = [spaces.compile.tangent(derivative(form, unknowns.function)) for form in forms]
        self.coupling = self._tangents[0]
        variant = spaces.variant
        everywhere = variant.storage_at_corners and variant.source_at_corners
        at_points = any(points_of(field) is not None for form in forms for field in form.coefficients())
        self._can_be_lumped = not (everywhere or at_points) and spaces.scene.growth.bounds[0] is None
        self.lumped = LumpedNodes(spaces, state, unknowns, self._mass, self._mass_to_force * unknowns.test_density)
        self._owned_part = self._part[self._part < unknowns.owned]
        self.conditions: list[dolfinx.fem.DirichletBC] = []
        self._hold()
        self._rest()
        self._mass_scale = self._reference_mass()
        self._source_scale, self._resorption = self._reference_source()

    # -- set-up --------------------------------------------------------------------------------------------------------

    def _forms(self) -> list[ufl.Form]:
        """Both balances, as forms whose sum they are: one for each set of points."""
        momentum, spaces, state = self._momentum, self._spaces, self._state
        us, tests, rho = self.unknowns.displacements, self.unknowns.tests, self.unknowns.density
        test_rho, dV = self._mass_to_force * self.unknowns.test_density, spaces.growing_volume
        inside, at_nodes = momentum.inside(us, rho, tests, dV), []
        for term, lumped in self._mass.terms(test_rho):
            if lumped:
                at_nodes.append(term)
            else:
                inside += term
        if (flux := self._mass.flux(test_rho)) is not None:
            inside += flux
        resting = momentum.of_what_rests(us, tests)
        forms = [sum(resting[:1], inside), *resting[1:], *momentum.of_corners(us, rho, tests, dV)]
        forms += [total(at_nodes)] if at_nodes else []
        forms += momentum.on_boundaries(us, spaces.everywhere(rho, state.resting_density), tests)
        return forms + [-form for form in self._mass.influx(test_rho)]

    def _hold(self) -> None:
        """Densities that are prescribed on boundaries."""
        self._prescribed: list[tuple[Indices, float]] = []
        spaces, part = self._spaces, self._subspace
        mesh = spaces.scene.mesh
        for prescribed in spaces.scene.prescribed_densities:
            value = dolfinx.fem.Function(spaces.density_space)
            value.x.array[:] = prescribed.density
            dofs = dolfinx.fem.locate_dofs_topological(
                (part, spaces.density_space), mesh.dim - 1, mesh.boundary(prescribed.on)
            )
            self._prescribed.append((dofs[0], prescribed.density))
            self.conditions.append(dolfinx.fem.dirichletbc(value, dofs, part))

    def _rest(self) -> None:
        """Nodes whose cells all rest keep their density: no equation is solved for it."""
        spaces = self._spaces
        growing = dolfinx.la.vector(spaces.density_space.dofmap.index_map, 1)
        growing.array[spaces.growing_dofs] = 1.0
        growing.scatter_forward()
        self._resting = spaces.comm.allreduce(len(spaces.volumes) - len(spaces.growing_dofs))
        if self._resting:
            dofs = np.sort(self._part[growing.array == 0])
            zero = dolfinx.default_scalar_type(0)
            self.conditions.append(dolfinx.fem.dirichletbc(zero, dofs, self._subspace))

    def _reference_mass(self) -> float:
        """‖nodal masses at the reference density‖₂, what the balance of mass is measured against (mass)."""
        spaces, density = self._spaces, self._spaces.scene.material.reference_density
        weights = spaces.volumes * (
            density if is_uniform(density) else self._state.density.x.array[: len(spaces.volumes)]
        )
        return float(np.sqrt(spaces.comm.allreduce(float(weights @ weights))))

    def _reference_source(self) -> tuple[float, float]:
        """‖nodal shares of the source's rate without energy‖₂, and their sum (mass per time)."""
        spaces, growth, material = self._spaces, self._spaces.scene.growth, self._spaces.scene.material
        if growth.rests_uniformly(material):
            shares = growth.resting_rate(material) * spaces.volumes
        else:
            resorption = self._growth.resting_rate(self._material)
            form = resorption * self.unknowns.test_density * spaces.growing_volume
            shares = assemble(spaces.compile.form(form))
        square, whole = spaces.comm.allreduce(np.array([shares @ shares, shares.sum()]))
        return float(np.sqrt(square)), float(whole)

    # -- as `system.Densities` -----------------------------------------------------------------------------------------

    @property
    def residuals(self) -> list[dolfinx.fem.Form]:
        """Both balances, and what lumping changes where it does."""
        return self._residuals + self.lumped.residuals

    @property
    def tangents(self) -> list[dolfinx.fem.Form]:
        """Their derivatives."""
        return self._tangents + self.lumped.tangents

    @property
    def dofs(self) -> int:
        """Number of displacements and of densities that grow, supports included."""
        return self.unknowns.size() - self._resting

    def begin(self, force_scale: float) -> None:
        """Put prescribed densities on the first iterate, and the balance of mass in units of force."""
        for dofs, density in self._prescribed:
            self.unknowns.function.x.array[dofs] = density
        # Long steps do not gain a multiple of the mass: the source is their scale.
        time_step = float(self._state.time_step.value)
        self._mass_to_force.value = force_scale / max(self._mass_scale / time_step, self._source_scale)

    def update(self) -> bool:
        """Whether all nodal densities are positive."""
        return bool(np.all(self.iterate() > 0))

    def iterate(self) -> Floats:
        """Density of the running iterate."""
        return np.asarray(self.unknowns.function.x.array[self._part])

    def set_iterate(self, density: Floats) -> None:
        """Make a density that of the running iterate."""
        self.unknowns.function.x.array[self._part] = density

    def limits(self) -> tuple[Floats, Floats] | None:
        """Lowest and highest value of each owned unknown, if any has a bound."""
        growth = self._spaces.scene.growth
        if not growth.is_bounded:
            return None
        low, high = (np.full(self.unknowns.owned, value) for value in (-np.inf, np.inf))
        dofs = self._part[self._spaces.growing_dofs]
        # Zero is no bound: who stays there has no balance.
        low[dofs], high[dofs] = growth.limits if growth.bounds[0] is not None else (-np.inf, growth.limits[1])
        return low, high

    def largest_share(self, position: Floats, step: Floats) -> float:
        """What leaves of each nodal density `LEAST_LEFT` of what it is."""
        density, fall = position[self._owned_part], -step[self._owned_part]
        shares = (1 - LEAST_LEFT) * density[fall > 0] / fall[fall > 0]
        return float(self._spaces.comm.allreduce(shares.min(initial=1.0), MPI.MIN))

    def mass_rate(self, borne: Floats | None) -> float:
        """∫ R₀ dV and the influx: the nodal shares, summed; and what holds densities where they are prescribed."""
        gains = self._spaces.comm.allreduce(sum(float(assemble(form).sum()) for form in self._gains))
        gains += self.lumped.supplied() / float(self._mass_to_force.value)
        return gains + self._supplied(borne)

    def vanishing(self) -> Marks:
        """Densities of the running iterate that are gone, or nearly, marks as in `density.x.array`.

        None where densities keep to a lowest one, or where lumping is no help: where it is there already, or where a
        field has values at other points alone.
        """
        if not self._can_be_lumped:
            return np.zeros(len(self._part), dtype=bool)
        density, before = self.iterate(), self._state.accepted_density
        return np.asarray(~(density > LEAST_LEFT * before) | self.lumped.relapses(density, before))

    def _supplied(self, borne: Floats | None) -> float:
        """Mass per time that must be supplied to hold densities at their prescribed values or bounds."""
        held = self._held()
        if held is None:
            return 0.0
        if borne is None:
            raise InputError(
                f"the mass rate of the scene '{self._spaces.scene.name}' is asked for before its first step, where "
                "what holds its densities is not known yet: to march first would be right"
            )
        return self._spaces.comm.allreduce(float(borne[held].sum())) / float(self._mass_to_force.value)

    def _held(self) -> Indices | None:
        """Owned unknowns that are densities at prescribed values or at bounds; None if the scene has neither."""
        held = [dofs[dofs < self.unknowns.owned] for dofs, _ in self._prescribed]
        growth = self._spaces.scene.growth
        if growth.is_bounded:
            dofs = self._part[self._spaces.growing_dofs]
            bounds = [bound for bound in growth.bounds if bound is not None]
            held.append(dofs[np.isin(self.unknowns.function.x.array[dofs], bounds)])
        return np.unique(np.concatenate(held)) if held else None

    def unloaded_resorption(self) -> float:
        """∫ c S* dV."""
        return self._resorption

    def momentum_forms(self, tests: list[Any]) -> list[ufl.Form]:
        """The balance of momentum at the running iterate but dead loads, tested by vectors in UFL."""
        return self._momentum.whole(self.unknowns.displacements, self.unknowns.density, tests)


def _require_growth(spaces: Spaces) -> None:
    """Raise InputError if densities on a boundary where mass enters or is held lie in regions that do not grow."""
    scene, space = spaces.scene, spaces.density_space
    for what, parts in (("influx", scene.influx), ("prescribed density", scene.prescribed_densities)):
        for part in parts:
            facets = scene.mesh.boundary(part.on)
            dofs = dolfinx.fem.locate_dofs_topological(space, scene.mesh.dim - 1, facets)
            here = dofs[dofs < space.dofmap.index_map.size_local]
            resting = spaces.comm.allreduce(int(np.count_nonzero(~np.isin(here, spaces.growing_dofs))))
            if resting:
                raise InputError(
                    f"the boundary '{part.on}' has {resting} nodes in regions that do not grow, where no {what} can "
                    "act: one that bounds growing regions alone would be right"
                )
