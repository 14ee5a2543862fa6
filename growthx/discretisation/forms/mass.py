"""The balance of mass of densities that are unknowns, as weak forms: storage, source, flux and influx."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import ufl

from growthx.constitutive.expressions import expression
from growthx.discretisation.forms import balances
from growthx.discretisation.forms.momentum import total
from growthx.fem.lumping import at_nodes, node_shares
from growthx.meshing.fields import law_as_ufl
from growthx.model.open_loads import check_sides

if TYPE_CHECKING:
    import dolfinx

    from growthx.constitutive.energies import Elasticity
    from growthx.constitutive.sources import MassSource
    from growthx.discretisation.spaces import Spaces
    from growthx.discretisation.state import State
    from growthx.discretisation.unknowns import Unknowns


class Mass:
    """The weak balance of mass of the density and displacements among the unknowns."""

    def __init__(
        self, spaces: Spaces, state: State, unknowns: Unknowns, energy: Any, growth: MassSource, material: Elasticity
    ) -> None:
        """energy: Ψ₀ⁿᵉᵒ of the unknowns, in UFL as the laws are."""
        self._spaces, self._state, self._unknowns = spaces, state, unknowns
        self._energy, self._growth, self._material = energy, growth, material
        self._degree = spaces.density_space.element.basix_element.degree

    def gains(self, test: Any) -> list[ufl.Form]:
        """What the nodes gain per time from the source and through the boundary."""
        return [self._source(test), *self.influx(test)]

    def terms(self, test: Any) -> list[tuple[ufl.Form, bool]]:
        """Storage and source, and whether each is lumped: points of its own want a form of its own."""
        variant, rho, state = self._spaces.variant, self._unknowns.density, self._state
        stored, dV = self._rule(test, variant.storage_at_corners)
        storage = balances.storage(rho, state.old_density, stored, state.time_step, dV)
        return [(storage, variant.storage_at_corners), (-self._source(test), variant.source_at_corners)]

    def lumped_instead(self, test: Any, where: Any) -> list[ufl.Form]:
        """What lumping storage and source changes of the balance in the cells of a condition, one form for each rule.

        None of a variant that lumps both.
        """
        state, unknowns, variant = self._state, self._unknowns, self._spaces.variant
        rho, inside = unknowns.density, ufl.conditional(where, 1.0, 0.0) * test
        # Elsewhere, where no number need exist at the nodes, any energy is as good.
        energy = ufl.conditional(where, self._energy, 1.0)
        forms = []
        for sign, lumped in ((1, True), (-1, False)):
            tested, dV = self._rule(sign * inside, lumped)
            parts = []
            if not variant.storage_at_corners:
                parts.append(balances.storage(rho, state.old_density, tested, state.time_step, dV))
            if not variant.source_at_corners:
                parts.append(-balances.source(rho, energy, tested, self._growth, self._material, dV))
            forms += [total(parts)] if parts else []
        return forms

    def flux(self, test: Any) -> ufl.Form | None:
        """The flux of mass inside the body; None if there is none."""
        spaces = self._spaces
        if spaces.scene.flux is None:
            return None
        law = law_as_ufl(spaces.scene.flux, spaces.scene.mesh)
        return balances.flux(self._unknowns.density, test, law, self._material, spaces.growing_volume)

    def influx(self, test: Any) -> list[ufl.Form]:
        """Mass that enters through boundaries, one form for each."""
        spaces, unknowns = self._spaces, self._unknowns
        mesh, degree = spaces.scene.mesh, 2 * spaces.density_space.element.basix_element.degree
        forms = []
        for influx in spaces.scene.influx:
            what = f"the influx on '{influx.on}'"
            rate = expression(influx.value(unknowns.displacements[0], unknowns.density, mesh), (), what)
            check_sides(rate, mesh, influx.on, what)
            forms.append(balances.influx(rate, test, mesh.boundary_measure(influx.on, degree)))
        return forms

    def _source(self, test: Any) -> ufl.Form:
        test, dV = self._rule(test, self._spaces.variant.source_at_corners)
        return balances.source(self._unknowns.density, self._energy, test, self._growth, self._material, dV)

    def _rule(self, test: Any, lumped: bool) -> tuple[Any, ufl.Measure]:
        """Test function and measure of a term: Gauss points or, lumped, the nodes of the cells."""
        return (self._shares * test, self.nodes) if lumped else (test, self._spaces.growing_volume)

    @property
    def nodes(self) -> ufl.Measure:
        """The nodes of the cells that grow, as points of integration."""
        return at_nodes(self._spaces.growing_volume, self._degree)

    @cached_property
    def _shares(self) -> dolfinx.fem.Function:
        return node_shares(self._spaces.scene.mesh.domain, self._degree)
