"""What is read off a state, as global numbers, as values at points, and in UFL: nothing here changes it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import ufl
from mpi4py import MPI

from growthx.common.arrays import is_uniform
from growthx.common.errors import InputError
from growthx.constitutive import kinematics, quantities
from growthx.constitutive.stimulus import StimulusDriven
from growthx.fem.assembly import assemble, integral
from growthx.fem.compat import interpolation_points
from growthx.meshing.sampling import as_places, cells_at

if TYPE_CHECKING:
    from collections.abc import Callable

    from growthx.common.arrays import Floats, Indices
    from growthx.constitutive.energies import Elasticity
    from growthx.constitutive.sources import MassSource
    from growthx.discretisation.forms.momentum import Momentum
    from growthx.discretisation.spaces import Spaces
    from growthx.discretisation.state import State

AT_BOUND = 1e-9  # of a bound: nearer, a density is at it


class Expressions:
    """Quantities of the state in UFL, over the whole body; material and growth: the laws of what grows, in UFL."""

    def __init__(
        self, spaces: Spaces, state: State, momentum: Momentum, material: Elasticity, growth: MassSource
    ) -> None:
        self.material, self.growth = material, growth
        self._spaces, self._state, self._momentum = spaces, state, momentum

    def energy(self) -> Any:
        """Elastic energy Ψ₀ⁿᵉᵒ of the state that drives the growth, energy per reference volume."""
        return self._momentum.mean_energy(self._state.displacements)

    def stress(self) -> Any:
        """Cauchy stress, the weighted mean over the load cases, shape (dim, dim)."""
        stress = self.mean_of(quantities.cauchy_stress)
        return stress if stress.ufl_shape[0] == self._spaces.scene.mesh.dim else kinematics.in_plane(stress)

    def mean_of(self, value: Callable[[Elasticity, Any, Any], Any], *, in_space: bool = False) -> Any:
        """The weighted mean over the load cases of a value of material, density and H = ∇u, as in `quantities`.

        in_space: of H with what it is out of the plane, for shapes (3, 3), as it is in plane stress in any case.  Where
        nothing grows, that of a stiffness without a weight.
        """
        us, rho, momentum = self._state.displacements, self._state.density, self._momentum

        def seen(material: Elasticity, density: Any, H: Any) -> Any:
            return value(material, density, kinematics.in_space(H) if in_space else H)

        found = momentum.mean_of(us, rho, seen)
        return (
            self._spaces.everywhere(found, momentum.mean_of(us, rho, seen, rests=True)) if self._spaces.rests else found
        )

    def stiffness(self) -> Any:
        """[ρ/ρ*]ⁿ E, Young's modulus as it is now (stress); where nothing grows, E."""
        rho, momentum = self._state.density, self._momentum
        found = momentum.stiffness(rho)
        return self._spaces.everywhere(found, momentum.stiffness(rho, rests=True)) if self._spaces.rests else found

    def density(self) -> Any:
        """Density; where nothing grows that of the start, whatever grows beside it."""
        return self._spaces.everywhere(self._state.density, self._state.resting_density)

    def stimulus(self) -> Any:
        """Stimulus; where nothing grows that of a stiffness without a weight, n = 0.

        Raises InputError for a mass source that has none.
        """
        energy, growth, state = self.energy(), self.growth, self._state
        if not isinstance(growth, StimulusDriven):
            raise InputError(f"{type(growth).__name__} is stated without a stimulus: mass_source() would be right")
        stimulus = growth.stimulus(state.density, energy, self.material)
        if not self._spaces.rests:
            return stimulus
        at_rest = growth.stimulus(state.resting_density, energy, self._momentum.at_rest)
        return self._spaces.everywhere(stimulus, at_rest)

    def mass_source(self) -> Any:
        """R₀, density per time; zero where nothing grows."""
        source = self.growth.mass_source(self._state.density, self.energy(), self.material)
        return self._spaces.everywhere(source, 0)


class Measures:
    """Numbers of the state, the same on all ranks.

    Those of regions raise InputError for one that the mesh does not have.
    """

    def __init__(self, spaces: Spaces, state: State, expressions: Expressions) -> None:
        self._spaces, self._state, self._expressions = spaces, state, expressions

    def mass(self, region: str | tuple[str, ...] | None = None) -> float:
        """∫ ρ dV over what grows, or over a named region, or several together (mass; per thickness in the plane)."""
        if region is not None:
            return self._mass_and_size(region)[0]
        spaces, dofs = self._spaces, self._spaces.growing
        return spaces.comm.allreduce(float(spaces.volumes[dofs] @ self._state.density.x.array[dofs]))

    def mean_density(self, region: str | tuple[str, ...] | None = None) -> float:
        """Mean of ρ over what grows, or over a named region, or several together."""
        whole = region is None
        mass, size = (self.mass(), self._spaces.growing_size()) if whole else self._mass_and_size(region)
        return mass / size

    def _mass_and_size(self, regions: str | tuple[str, ...] | None) -> tuple[float, float]:
        """∫ ρ dV and ∫ dV over named regions."""
        spaces = self._spaces
        cells, test = spaces.cells_of(regions), ufl.TestFunction(spaces.grows.function_space)
        values = (self._expressions.density(), 1.0)
        forms = (spaces.compile.form(value * test * spaces.whole_volume) for value in values)
        mass, size = spaces.comm.allreduce(np.array([assemble(form)[cells].sum() for form in forms]))
        return float(mass), float(size)

    def density_range(self, region: str | tuple[str, ...] | None = None) -> tuple[float, float]:
        """Lowest and highest of the density's own degrees of freedom, in what grows, a named region or several."""
        spaces, values = self._spaces, self._state.density.x.array[self._spaces.growing]
        if region is not None:
            values = self._state.densities_of_cells()[spaces.cells_of(region)]
        return (
            spaces.comm.allreduce(float(values.min(initial=np.inf)), MPI.MIN),
            spaces.comm.allreduce(float(values.max(initial=-np.inf)), MPI.MAX),
        )

    def shares_at_bounds(self) -> tuple[float, float]:
        """Shares of the volume that grows whose density is at its lowest and at its highest bound; zero without one."""
        spaces = self._spaces
        low, high = spaces.scene.growth.limits
        density = self._state.density.x.array[spaces.growing]
        # A density that has stopped at a bound is the bound; one that was found there is so to round-off.
        marks = [density <= low * (1 + AT_BOUND), density >= high * (1 - AT_BOUND), np.ones(len(density), dtype=bool)]
        weights = np.abs(spaces.volumes[spaces.growing])
        *held, volume = spaces.comm.allreduce(np.array([weights @ mark for mark in marks]))
        return float(held[0] / volume), float(held[1] / volume)

    def root_mean_square(self, values: Floats) -> float:
        """Root mean square over the volume that grows of values for each density, as `density.x.array`."""
        spaces = self._spaces
        # Volumes of nodes at the corners of quadratic simplices are zero or below.
        weights = np.abs(spaces.volumes[spaces.growing])
        squares = np.array([weights @ np.square(values[spaces.growing]), weights.sum()])
        total, volume = spaces.comm.allreduce(squares)
        return float(np.sqrt(total / volume))

    def resorption(self) -> float:
        """Root mean square over the volume that grows of the source's rate without energy, density per time."""
        spaces, expressions = self._spaces, self._expressions
        rate = expressions.growth.resting_rate(expressions.material)
        square = spaces.compile.form(rate**2 * spaces.growing_volume)
        total = spaces.comm.allreduce(integral(square))
        return float(np.sqrt(total / spaces.growing_size()))


class Probes:
    """Values of the state at points: of the reference cell, for each owned cell, or in the body, for all ranks."""

    def __init__(self, spaces: Spaces, state: State, material: Elasticity) -> None:
        self._spaces, self._state, self._material = spaces, state, material

    def displacement_at(self, X: Floats) -> Floats:
        """Displacement (length) at points X of the reference cell, (points, dim), shape (owned cells, points, dim)."""
        space, mesh = self._spaces.displacement_space, self._spaces.scene.mesh
        basis = space.ufl_element().sub_elements[0].tabulate(0, X)[0]
        values = self._state.displacement.x.array.reshape(-1, mesh.dim)
        return np.asarray(np.einsum("pn,cni->cpi", basis, values[space.dofmap.list[: len(mesh.owned_cells)]]))

    def density_at(self, X: Floats) -> Floats:
        """Density, raw as the variant knows it, at points X of the reference cell, shape (owned cells, points).

        Where nothing grows, too.
        """
        shares = self._spaces.variant.density.shares(self._spaces.density_space.ufl_element(), X)
        return np.asarray(self._state.densities_of_cells() @ shares.T)

    def reference_density_at(self, X: Floats) -> Floats | float:
        """ρ* at points X of the reference cell, shape (owned cells, points), or the one number it is everywhere."""
        reference = self._spaces.scene.material.reference_density
        return float(reference) if is_uniform(reference) else self._spaces.evaluate(self._material.reference_density, X)

    def density_changes_of_cells(self) -> Floats:
        """[ρ − ρ*]/ρ* of each owned cell's densities, ρ* where each of them is, shape (owned cells, densities)."""
        points = interpolation_points(self._spaces.density_space.element)
        return self._state.densities_of_cells() / self.reference_density_at(points) - 1

    def sample_density(self, places: Floats) -> Floats:
        """Density, raw as the variant knows it, at places in the body at rest, (places, dim) (collective).

        Also where nothing grows; NaN outside the body.  Each rank may ask for places of its own, and be it for none, as
        in functions of position that DOLFINx calls with coordinates x, of shape (3, places): `x.T` is fine.
        Raises InputError for places of another shape, or without finite coordinates.
        """
        return self._sample_densities(self._state.densities_of_cells(), places)

    def sample_density_change(self, places: Floats) -> Floats:
        """[ρ − ρ*]/ρ* at places in the body at rest, as `sample_density`; between densities as the density is."""
        return self._sample_densities(self.density_changes_of_cells(), places)

    def _sample_densities(self, of_cells: Floats, places: Floats) -> Floats:
        """What is known as the densities are, (owned cells, densities of a cell), at places."""
        element, density = self._spaces.density_space.ufl_element(), self._spaces.variant.density

        def value(cells: Indices, X: Floats) -> Floats:
            return np.einsum("pd,pd->p", density.shares(element, X), of_cells[cells])

        return self._sample(value, places, ())

    def sample_growing(self, places: Floats) -> Floats:
        """One at places in the body at rest, (places, dim), where it grows, zero where not; NaN outside."""
        growing = self._spaces.growing_cells
        return self._sample(lambda cells, _: np.isin(cells, growing).astype(float), places, ())

    def sample_displacement(self, places: Floats) -> Floats:
        """Displacement (length) at places in the body at rest, (places, dim), shape (places, dim); NaN outside.

        Same errors as `sample_density`.
        """
        space, dim = self._spaces.displacement_space, self._spaces.scene.mesh.dim
        values = self._state.displacement.x.array.reshape(-1, dim)

        def displacement(cells: Indices, X: Floats) -> Floats:
            basis = space.ufl_element().sub_elements[0].tabulate(0, X)[0]
            return np.einsum("pn,pni->pi", basis, values[space.dofmap.list[cells]])

        return self._sample(displacement, places, (dim,))

    def _sample(self, value: Callable[[Indices, Floats], Floats], places: Floats, shape: tuple[int, ...]) -> Floats:
        """Values, each of that shape, by owned cells and reference points, gathered from the ranks that have them."""
        spaces, mesh = self._spaces, self._spaces.scene.mesh
        everyones, own = as_places(places, mesh.dim, spaces.comm)
        cells, X = cells_at(mesh, everyones)
        here = np.flatnonzero(cells >= 0)
        found = np.full((len(cells), *shape), -np.inf)
        if len(here):  # basix aborts when it is given no points at all
            found[here] = value(cells[here], X[here])
        spaces.comm.Allreduce(MPI.IN_PLACE, found, MPI.MAX)
        return np.where(np.isfinite(found), found, np.nan)[own]
