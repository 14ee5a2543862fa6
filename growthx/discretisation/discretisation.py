"""A scene discretised by a variant: its parts, built from below, and what is asked of them most, in one place."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from growthx.common.checks import require_vector
from growthx.common.errors import InputError
from growthx.constitutive.laws.remodelling import Remodelling
from growthx.discretisation import words
from growthx.discretisation.densities.condensed import EliminatedDensities
from growthx.discretisation.densities.monolithic import NodalDensities
from growthx.discretisation.densities.past import Past, with_past
from growthx.discretisation.forms.momentum import Momentum
from growthx.discretisation.laws import laws
from growthx.discretisation.measures import Expressions, Measures, Probes
from growthx.discretisation.spaces import Spaces
from growthx.discretisation.start import start
from growthx.discretisation.state import State
from growthx.discretisation.system import System

if TYPE_CHECKING:
    import dolfinx
    from mpi4py import MPI

    from growthx.common.arrays import Floats, Indices
    from growthx.constitutive.energies import Elasticity
    from growthx.constitutive.sources import MassSource
    from growthx.discretisation.variants import Variant
    from growthx.fem.assembly import Compiler
    from growthx.model.scene import Scene


class Discretisation:
    """A scene on elements, in the state of the last accepted step.

    spaces: what does not change.  state: what a step changes.  system: what Newton's method solves and what makes its
    iterate the state.  expressions, measures, probes: what is read off the state, in UFL, as numbers, at points.
    All other members are readings of these.
    """

    def __init__(self, scene: Scene, variant: Variant) -> None:
        """As it is; `discretise` looks at the scene before."""
        self.spaces = spaces = Spaces(scene, variant)
        functions = start(spaces)
        material, growth = laws(spaces)
        self.state = State(spaces, functions)
        growth = with_past(spaces, self.state, growth)
        momentum = Momentum(spaces, self.state, material)
        kind = EliminatedDensities if variant.density.local else NodalDensities
        densities = kind(spaces, self.state, momentum, material, growth)
        self.system = System(spaces, self.state, momentum, densities)
        if isinstance(growth, Remodelling) and growth.remembers:
            self.system.past = Past(spaces, self.state, momentum, material, growth)
        self.expressions = Expressions(spaces, self.state, momentum, material, growth)
        self.measures = Measures(spaces, self.state, self.expressions)
        self.probes = Probes(spaces, self.state, material)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({words.problem_in_short(self)})"

    def __str__(self) -> str:
        return words.problem_in_words(self)

    # -- what was discretised ------------------------------------------------------------------------------------------

    @property
    def scene(self) -> Scene:
        """What was discretised."""
        return self.spaces.scene

    @property
    def variant(self) -> Variant:
        """By what."""
        return self.spaces.variant

    @property
    def comm(self) -> MPI.Intracomm:
        """The ranks that share it."""
        return self.spaces.comm

    @property
    def compile(self) -> Compiler:
        """What compiles its forms, on the clock."""
        return self.spaces.compile

    @property
    def material(self) -> Elasticity:
        """The material of what grows, with its parameters in UFL."""
        return self.expressions.material

    @property
    def growth(self) -> MassSource:
        """The growth law, with its parameters in UFL."""
        return self.expressions.growth

    # -- its size ------------------------------------------------------------------------------------------------------

    @property
    def dofs(self) -> int:
        """Number of unknowns of the system on all ranks, supports included."""
        return self.system.densities.dofs

    @property
    def points(self) -> int:
        """Number of integration points on all ranks."""
        return self.spaces.points

    @property
    def displacement_space(self) -> dolfinx.fem.FunctionSpace:
        """Of one displacement."""
        return self.spaces.displacement_space

    @property
    def density_space(self) -> dolfinx.fem.FunctionSpace:
        """Of the density."""
        return self.spaces.density_space

    @property
    def volumes(self) -> Floats:
        """∫ N dV over what grows, for each owned density."""
        return self.spaces.volumes

    @property
    def growing_dofs(self) -> Indices:
        """Owned densities of cells that grow, as indices into the density's array."""
        return self.spaces.growing_dofs

    @property
    def growing_cells(self) -> Indices:
        """Owned cells that grow."""
        return self.spaces.growing_cells

    @property
    def rests(self) -> bool:
        """Whether a part of the body does not grow."""
        return self.spaces.rests

    @property
    def grows(self) -> dolfinx.fem.Function:
        """One in the cells that grow, zero in the others."""
        return self.spaces.grows

    def cells_of(self, regions: str | tuple[str, ...] | None) -> Indices:
        """Owned cells of one named region or of several, each once; None: those that grow."""
        return self.spaces.cells_of(regions)

    def evaluate(self, value: Any, X: Floats) -> Floats:
        """A scalar in UFL at points X of the reference cell, (points, dim), shape (owned cells, points)."""
        return self.spaces.evaluate(value, X)

    def density_positions(self) -> Floats:
        """Where the densities are, in the order of `density.x.array`, shape (densities, 3)."""
        return self.spaces.density_positions()

    # -- its state -----------------------------------------------------------------------------------------------------

    @property
    def time(self) -> float:
        """Where it is in its program."""
        return self.state.time

    @property
    def amplitude(self) -> float:
        """Share of the loads."""
        return self.state.amplitude

    @property
    def displacement(self) -> dolfinx.fem.Function:
        """Displacement; of several load cases, their weighted mean."""
        return self.state.displacement

    @property
    def displacements(self) -> list[dolfinx.fem.Function]:
        """Displacements of the load cases."""
        return self.state.displacements

    @property
    def density(self) -> dolfinx.fem.Function:
        """Density, as the variant knows it."""
        return self.state.density

    def densities_of_cells(self) -> Floats:
        """Densities of each owned cell, shape (owned cells, densities of a cell); at rest, its own at shared nodes."""
        return self.state.densities_of_cells()

    def mass_rate(self) -> float:
        """Mass that enters per time at the running iterate (per thickness in two dimensions).

        From the source, ∫ R₀ dV, and across the boundary; at a bound of density, what of the source took effect.
        """
        return self.system.densities.mass_rate(self.system.borne)

    def reactions(self) -> dict[str, Floats]:
        """Force on the body at each support, at the iterate whose balance was last looked at: `Supports.reactions`.

        Raises InputError before the first one.
        """
        return self.system.supports.reactions(self._borne())

    def reaction_moments(self, about: tuple[float, ...]) -> dict[str, Floats]:
        """Moment on the deformed body at each support about a place (dim,), in its last state: `Supports.moments`."""
        place = np.array(require_vector(about, "the place of reaction moments"))
        if len(place) != self.scene.mesh.dim:
            raise InputError(f"the place of reaction moments has {len(place)} entries: it needs {self.scene.mesh.dim}")
        return self.system.supports.moments(self._borne(), place, [u.x.array for u in self.displacements])

    def _borne(self) -> Floats:
        borne = self.system.borne
        if borne is None:
            raise InputError(
                f"the reactions of the scene '{self.scene.name}' are asked for before its first step, where nothing is "
                "borne yet: to march first would be right"
            )
        return borne

    def mean_energy(self) -> Any:
        """See `Expressions.energy`."""
        return self.expressions.energy()

    def mean_stress(self) -> Any:
        """See `Expressions.stress`."""
        return self.expressions.stress()

    def stimulus(self) -> Any:
        """See `Expressions.stimulus`."""
        return self.expressions.stimulus()

    def mass_source(self) -> Any:
        """See `Expressions.mass_source`."""
        return self.expressions.mass_source()

    # -- its measures --------------------------------------------------------------------------------------------------

    def mass(self, region: str | tuple[str, ...] | None = None) -> float:
        """See `Measures.mass`."""
        return self.measures.mass(region)

    def mean_density(self, region: str | tuple[str, ...] | None = None) -> float:
        """See `Measures.mean_density`."""
        return self.measures.mean_density(region)

    def density_range(self, region: str | tuple[str, ...] | None = None) -> tuple[float, float]:
        """See `Measures.density_range`."""
        return self.measures.density_range(region)

    def displacement_at(self, X: Floats) -> Floats:
        """See `Probes.displacement_at`."""
        return self.probes.displacement_at(X)

    def density_at(self, X: Floats) -> Floats:
        """See `Probes.density_at`."""
        return self.probes.density_at(X)

    def reference_density_at(self, X: Floats) -> Floats | float:
        """See `Probes.reference_density_at`."""
        return self.probes.reference_density_at(X)

    def density_changes_of_cells(self) -> Floats:
        """See `Probes.density_changes_of_cells`."""
        return self.probes.density_changes_of_cells()

    def sample_density(self, places: Floats) -> Floats:
        """See `Probes.sample_density`."""
        return self.probes.sample_density(places)

    def sample_density_change(self, places: Floats) -> Floats:
        """See `Probes.sample_density_change`."""
        return self.probes.sample_density_change(places)

    def sample_growing(self, places: Floats) -> Floats:
        """See `Probes.sample_growing`."""
        return self.probes.sample_growing(places)

    def sample_displacement(self, places: Floats) -> Floats:
        """See `Probes.sample_displacement`."""
        return self.probes.sample_displacement(places)
