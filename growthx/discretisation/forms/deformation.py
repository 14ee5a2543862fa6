"""How displacements deform a body: as they say, or in the plane also as the thickness follows.

In plane stress the thickness stretch λ₃ follows at each point from P̄₃₃ = ∂Ψ₀ᵉˡ/∂λ₃ = 0, whatever the density, whose
weight is a factor.  As λ₃ makes the energy least, stress and source need no ∂λ₃/∂F; the tangent has it from the
implicit function theorem, dλ₃ = −[∂P̄₃₃/∂λ₃]⁻¹ ∂P̄₃₃/∂F : dF.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import ufl

from growthx.constitutive.kinematics import Plane, displacement_gradient, in_space
from growthx.fem.implicit import Implicit

if TYPE_CHECKING:
    from growthx.constitutive.energies import Elasticity
    from growthx.discretisation.spaces import Spaces


class Deformation:
    """The displacement gradients of displacements, and what follows from them."""

    def __init__(self, spaces: Spaces, material: Elasticity) -> None:
        """material: in UFL, as it is in the plane, too."""
        self._spaces, self._material = spaces, material
        self._thickens = spaces.scene.plane is Plane.STRESS
        self._thickness: dict[Any, Implicit] = {}  # by displacement

    def gradient(self, u: Any) -> Any:
        """H = ∇u of a displacement, shape (dim, dim); in plane stress (3, 3) with λ₃ − 1 as its last entry."""
        H = displacement_gradient(u)
        return in_space(H, self._of(u).symbol) if self._thickens else H

    def thickness(self, u: Any) -> Any:
        """The stretch λ₃ of the thickness, one but in plane stress."""
        return 1.0 + self._of(u).symbol if self._thickens else 1.0

    def derivative(self, form: ufl.Form, function: Any, direction: Any = None) -> ufl.Form:
        """The derivative of a form of these gradients by the function that the displacements are parts of."""
        if not self._thickens:
            return ufl.derivative(form, function, direction)
        direction = ufl.TrialFunction(function.function_space) if direction is None else direction
        found = ufl.derivative(form, function, direction)
        for implicit in self._thickness.values():
            if implicit.symbol in form.coefficients():
                follows = ufl.algorithms.expand_derivatives(ufl.derivative(implicit.equation, function, direction))
                if not isinstance(follows, ufl.constantvalue.Zero):
                    found += ufl.derivative(form, implicit.symbol, -follows / implicit.slope)
        return found

    def _of(self, u: Any) -> Implicit:
        """The thickness stretch less one of a displacement."""
        if u not in self._thickness:
            H, material = displacement_gradient(u), self._material

            def stress_across(change: Any) -> Any:
                return ufl.diff(material.energy_at(in_space(H, change)), change)

            size = ufl.sqrt(ufl.inner(H, H))
            above = not material.small_strain
            found = Implicit(self._spaces.scene.mesh.domain, stress_across, size, above=above)
            self._spaces.compile.implicits.append(found)
            self._thickness[u] = found
        return self._thickness[u]
