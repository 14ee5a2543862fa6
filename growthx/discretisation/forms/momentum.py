"""The balance of momentum of all load cases as weak forms: stress, loads that depend on the state, inertia."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import dolfinx
import ufl

from growthx.constitutive import quantities
from growthx.constitutive.expressions import expression
from growthx.constitutive.functions import sqrt
from growthx.constitutive.kinematics import Plane
from growthx.discretisation.forms import balances
from growthx.discretisation.forms.deformation import Deformation
from growthx.discretisation.forms.sides import sides
from growthx.fem.lumping import at_nodes, node_shares
from growthx.model.open_loads import OpenLoad, Pressure, check_sides

if TYPE_CHECKING:
    from collections.abc import Callable

    from growthx.constitutive.energies import Elasticity
    from growthx.discretisation.spaces import Spaces
    from growthx.discretisation.state import State
    from growthx.model.loads import LoadCase


REST = 1e-20  # of the stiffness: an energy that is none in a mean by powers


class Momentum:
    """The weak balance of momentum, of the displacements `us` and test functions `tests` of the load cases.

    Each load case counts by its weight, which makes the condensed tangent of all of them symmetric.
    deformation: how displacements deform the body.
    """

    def __init__(self, spaces: Spaces, state: State, material: Elasticity) -> None:
        """material: in UFL."""
        scene = spaces.scene
        self._spaces, self._scene, self._state, self._material = spaces, scene, state, material
        # Where nothing grows stiffness has no weight: n = 0 and, should a law of one's own not heed n, ρ = ρ*.
        self.at_rest = material if scene.growing is None else replace(material, density_exponent=0)
        self._cases, self.deformation = spaces.cases, Deformation(spaces, material)
        if scene.inertia is not None and scene.inertia.lumped:
            self._corners = node_shares(scene.mesh.domain)

    def inside(self, us: list[Any], rho: Any, tests: list[Any], dV: ufl.Measure, *, rests: bool = False) -> ufl.Form:
        """What acts inside the body: stress, open body forces, the rate of momentum unless it is lumped.

        tests: None leaves a load case out.
        rests: whether nothing grows there: the density then counts for forces and inertia alone.
        """
        scene, terms = self._scene, []
        material, stiffening = self._stiffness(rho, rests)
        for case, u, test in zip(self._cases, us, tests, strict=True):
            if test is None:
                continue
            test = _weighted(case, test)
            terms.append(balances.internal_work(self.deformation.gradient(u), stiffening, test, material, dV))
            terms += [
                balances.external_work(-self._state.share_of(load) * self._force(load, u, rho), test, dV)
                for load in case.loads
                if isinstance(load, OpenLoad) and load.on is None
            ]
        if scene.inertia is not None and not scene.inertia.lumped:
            terms.append(self._inertia(us[0], rho, tests[0], dV))
        return total(terms)

    def _stiffness(self, rho: Any, rests: bool) -> tuple[Elasticity, Any]:
        """The material, and the density that stiffens it: where nothing grows neither is to weigh anything."""
        return (self.at_rest, self.at_rest.reference_density) if rests else (self._material, rho)

    def of_corners(self, us: list[Any], rho: Any, tests: list[Any], volume: ufl.Measure) -> list[ufl.Form]:
        """The rate of momentum of masses at the corners of the cells, a form of its own for its points; or nothing."""
        inertia = self._scene.inertia
        lumped = inertia is not None and inertia.lumped
        return [self._inertia(us[0], rho * self._corners, tests[0], at_nodes(volume))] if lumped else []

    def on_boundaries(self, us: list[Any], rho: Any, tests: list[Any]) -> list[ufl.Form]:
        """Minus the work of the loads on boundaries that depend on the state, one form for each."""
        mesh, degree = self._scene.mesh, 2 * self._spaces.displacement_space.element.basix_element.degree
        forms = []
        for case, u, test in zip(self._cases, us, tests, strict=True):
            for load in case.loads:
                if isinstance(load, OpenLoad) and load.on is not None:
                    force = self._force(load, u, rho)
                    check_sides(force, mesh, load.on, f"the {load.what} {load.place}")
                    if isinstance(load, Pressure) and self._scene.plane is Plane.STRESS:
                        forms += self._pressing(load, u, _weighted(case, test), degree)
                        continue
                    measure = mesh.boundary_measure(load.on, degree)
                    forms.append(
                        balances.external_work(-self._state.share_of(load) * force, _weighted(case, test), measure)
                    )
        return forms

    def _pressing(self, load: Pressure, u: Any, test: Any, degree: int) -> list[ufl.Form]:
        """Minus the work of a pressure in plane stress, one form for each side of a cell: λ₃ is of points of cells."""
        forms = []
        for measure, area in sides(self._scene.mesh, load.on, degree):
            force = load.force_on(u, area, self.deformation.thickness(u))
            forms.append(balances.external_work(-self._state.share_of(load) * force, test, measure))
        return forms

    def _force(self, load: OpenLoad, u: Any, rho: Any) -> Any:
        """The force of an open load; InputError if it is not a vector with an entry for each direction."""
        mesh = self._scene.mesh
        return expression(load.force(u, rho, mesh), (mesh.dim,), f"the open load {load.place}")

    def largest_stiffness(self) -> float:
        """The largest stiffness on this rank."""
        stiffness = self._material.stiffness
        if isinstance(stiffness, dolfinx.fem.Function):
            return float(stiffness.x.array.max(initial=0.0))
        if isinstance(stiffness, dolfinx.fem.Constant):
            return float(stiffness.value)
        points = self._spaces.variant.integration_points(self._scene.mesh.cell_name)
        return float(self._spaces.evaluate(ufl.as_ufl(stiffness), points).max(initial=0.0))

    def mean_energy(self, us: list[Any]) -> Any:
        """Ψ₀ⁿᵉᵒ, the weighted mean over the load cases, energy per reference volume: [Σ wᵢ Ψᵢ^p]^(1/p), mostly p = 1.

        Energies of nearly nothing, whose powers have no slope that is a number, are rounded.
        """
        energies = [self._material.energy_at(self.deformation.gradient(u)) for u in us]
        power = self._scene.growth.mean_exponent
        if len(us) == 1 or power == 1.0:
            return total([_weighted(case, energy) for case, energy in zip(self._cases, energies, strict=True)])
        rest = REST * self._material.stiffness
        powers = [sqrt(energy**2 + rest**2) ** power for energy in energies]
        mean = total([_weighted(case, value) for case, value in zip(self._cases, powers, strict=True)])
        return mean ** (1 / power)

    def mean_of(
        self, us: list[Any], rho: Any, value: Callable[[Elasticity, Any, Any], Any], *, rests: bool = False
    ) -> Any:
        """The weighted mean over the load cases of a value of material, density and H = ∇u; rests: as in `inside`."""
        material, stiffening = self._stiffness(rho, rests)
        values = [value(material, stiffening, self.deformation.gradient(u)) for u in us]
        return total([_weighted(case, value) for case, value in zip(self._cases, values, strict=True)])

    def stiffness(self, rho: Any, *, rests: bool = False) -> Any:
        """[ρ/ρ*]ⁿ E; rests: as in `inside`."""
        return quantities.stiffness(*self._stiffness(rho, rests))

    def of_what_rests(self, us: list[Any], tests: list[Any]) -> list[ufl.Form]:
        """What acts inside the regions that do not grow, at the density they have from the start; none if all grow."""
        if self._spaces.resting_volume is None:
            return []
        rho, volume = self._state.resting_density, self._spaces.resting_volume
        return [self.inside(us, rho, tests, volume, rests=True), *self.of_corners(us, rho, tests, volume)]

    def whole(self, us: list[Any], rho: Any, tests: list[Any]) -> list[ufl.Form]:
        """All of it but dead loads, tested by vectors in UFL, one for each load case: forms whose sum it is."""
        dV = self._spaces.growing_volume
        forms = [self.inside(us, rho, tests, dV), *self.of_corners(us, rho, tests, dV)]
        return forms + self.of_what_rests(us, tests) + self.on_boundaries(us, rho, tests)

    def _inertia(self, u: Any, rho: Any, test: Any, dV: ufl.Measure) -> ufl.Form:
        old_u, old_velocity = self._state.motion
        return balances.inertia(u, old_u, old_velocity, rho, test, self._state.time_step, dV)


def total(terms: list[Any]) -> Any:
    """The sum of UFL forms or expressions, of which there is one at least."""
    return sum(terms[1:], terms[0])


def _weighted(case: LoadCase, value: Any) -> Any:
    """A value by the weight of its load case; as it is where that is the only one."""
    return value if case.weight == 1.0 else case.weight * value
