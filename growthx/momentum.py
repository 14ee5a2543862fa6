"""The balance of momentum of all load cases as weak forms: stress, loads that depend on the state, inertia."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import dolfinx
import numpy as np
import ufl

from growthx import balances, kernels
from growthx.assembly import assemble
from growthx.kinematics import deformation_gradient, volume_ratio
from growthx.memory import Memory
from growthx.open_loads import OpenLoad, expression

if TYPE_CHECKING:
    from growthx.arrays import Floats
    from growthx.loads import LoadCase
    from growthx.material import Material
    from growthx.mesh import Mesh
    from growthx.scene import Scene


class Momentum:
    """The weak balance of momentum, of the displacements `us` and test functions `tests` of the load cases.

    Each load case counts by its weight, which makes the condensed tangent of all of them symmetric.
    share: that of the loads, which grow with the program.
    """

    def __init__(
        self, scene: Scene, material: Material, space: dolfinx.fem.FunctionSpace, time_step: dolfinx.fem.Constant
    ) -> None:
        """material: in UFL.  space: of one displacement."""
        self._scene, self._material, self._space, self._time_step = scene, material, space, time_step
        self._cases = scene.load_cases
        self.share = dolfinx.fem.Constant(scene.mesh.domain, np.float64(0.0))
        if scene.inertia is not None:
            self._corners = corner_shares(scene.mesh) if scene.inertia.lumped else None
            self._old_displacement, self._old_velocity = dolfinx.fem.Function(space), dolfinx.fem.Function(space)

    def inside(self, us: list[Any], rho: Any, tests: list[Any], dV: ufl.Measure) -> ufl.Form:
        """What acts inside the body: stress, open body forces, the rate of momentum unless it is lumped."""
        scene, terms = self._scene, []
        for case, u, test in zip(self._cases, us, tests, strict=True):
            test = _weighted(case, test)
            terms.append(balances.internal_work(u, rho, test, self._material, dV))
            terms += [
                balances.external_work(-self.share * self._force(load, u, rho), test, dV)
                for load in case.loads
                if isinstance(load, OpenLoad) and load.on is None
            ]
        if scene.inertia is not None and not scene.inertia.lumped:
            terms.append(self._inertia(us[0], rho, tests[0], dV))
        return total(terms)

    def of_corners(self, us: list[Any], rho: Any, tests: list[Any], volume: ufl.Measure) -> list[ufl.Form]:
        """The rate of momentum of masses at the corners of the cells, a form of its own for its points; or nothing."""
        inertia = self._scene.inertia
        lumped = inertia is not None and inertia.lumped
        return [self._inertia(us[0], rho * self._corners, tests[0], at_corners(volume))] if lumped else []

    def on_boundaries(self, us: list[Any], rho: Any, tests: list[Any]) -> list[ufl.Form]:
        """Minus the work of the loads on boundaries that depend on the state, one form for each."""
        mesh, degree = self._scene.mesh, 2 * self._space.element.basix_element.degree
        return [
            balances.external_work(
                -self.share * self._force(load, u, rho), _weighted(case, test), mesh.boundary_measure(load.on, degree)
            )
            for case, u, test in zip(self._cases, us, tests, strict=True)
            for load in case.loads
            if isinstance(load, OpenLoad) and load.on is not None
        ]

    def _force(self, load: OpenLoad, u: Any, rho: Any) -> Any:
        """The force of an open load; InputError if it is not a vector with an entry for each direction."""
        mesh = self._scene.mesh
        return expression(load.force(u, rho, mesh), (mesh.dim,), f"the open load {load.place}")

    def mean_energy(self, us: list[Any]) -> Any:
        """Ψ₀ⁿᵉᵒ, the weighted mean over the load cases, energy per reference volume."""
        energies = [self._material.energy(deformation_gradient(u)) for u in us]
        return total([_weighted(case, energy) for case, energy in zip(self._cases, energies, strict=True)])

    def mean_stress(self, us: list[Any], rho: Any) -> Any:
        """Cauchy stress, the weighted mean over the load cases, shape (dim, dim)."""
        stresses = []
        for case, u in zip(self._cases, us, strict=True):
            F = deformation_gradient(u)
            stresses.append(_weighted(case, self._material.stress(F, rho) * F.T / volume_ratio(F)))
        return total(stresses)

    def remember_motion(self, displacement: Floats) -> None:
        """With inertia, make a displacement (the entries of its function) the old one of the next step."""
        if self._scene.inertia is not None:
            old = self._old_displacement.x.array
            self._old_velocity.x.array[:] = (displacement - old) / float(self._time_step.value)
            old[:] = displacement

    def memory(self) -> Memory:
        """With inertia, the motion at the start of the next step."""
        if self._scene.inertia is None:
            return Memory()
        motion = {"old_displacement": self._old_displacement, "old_velocity": self._old_velocity}
        return Memory(displacements={name: function.x.array.copy() for name, function in motion.items()})

    def recall(self, memory: Memory) -> None:
        """Know that again."""
        if self._scene.inertia is not None:
            self._old_displacement.x.array[:] = memory.displacements["old_displacement"]
            self._old_velocity.x.array[:] = memory.displacements["old_velocity"]

    def _inertia(self, u: Any, rho: Any, test: Any, dV: ufl.Measure) -> ufl.Form:
        return balances.inertia(u, self._old_displacement, self._old_velocity, rho, test, self._time_step, dV)


def at_corners(volume: ufl.Measure) -> ufl.Measure:
    """A measure of volume whose integration points are the corners of the cells, in equal shares."""
    return volume.reconstruct(metadata={"quadrature_rule": "vertex", "quadrature_degree": 1})


def corner_shares(mesh: Mesh) -> dolfinx.fem.Function:
    """A factor on integrands at the corners of cells that makes lumped matrices of row sums: ∫ Nᵢ dV at each corner.

    It is one on parallelograms and simplices; on other cells the corners' own shares are not those of Gauss points.
    """
    space = dolfinx.fem.functionspace(mesh.domain, ("DG", 1))
    shares, test = dolfinx.fem.Function(space), ufl.TestFunction(space)
    volume = ufl.Measure("dx", domain=mesh.domain, metadata={"quadrature_degree": 3})
    gauss, corners = (assemble(kernels.form(test * measure)) for measure in (volume, at_corners(volume)))
    shares.x.array[: len(gauss)] = gauss / corners
    shares.x.scatter_forward()
    return shares


def total(terms: list[Any]) -> Any:
    """The sum of UFL forms or expressions, of which there is one at least."""
    return sum(terms[1:], terms[0])


def _weighted(case: LoadCase, value: Any) -> Any:
    """A value by the weight of its load case; as it is where that is the only one."""
    return value if case.weight == 1.0 else case.weight * value
