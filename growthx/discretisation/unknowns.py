"""What Newton's method solves for: the displacements of the load cases, and nodal densities with them or not."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import basix.ufl
import dolfinx
import numpy as np
import ufl

from growthx.fem import compat

if TYPE_CHECKING:
    from growthx.common.arrays import Floats, Indices
    from growthx.discretisation.spaces import Spaces
    from growthx.discretisation.state import State


class Unknowns:
    """The running iterate, and its parts as UFL and as places in `function.x.array`.

    parts: places of each displacement, indices or a slice; density_part: those of the densities, None if they are not
    among the unknowns.
    displacements, density: in UFL, the density of the state where it is not among the unknowns.
    tests: test functions of the displacements; test_density: of the density, if it is among the unknowns.
    subspaces: of each displacement, for boundary conditions; density_subspace: of the density.
    """

    def __init__(self, spaces: Spaces, state: State, *, with_density: bool) -> None:
        """with_density: whether it is among the unknowns."""
        self._spaces, cases = spaces, len(spaces.cases)
        V, D, domain = spaces.displacement_space, spaces.density_space, spaces.scene.mesh.domain
        elements = [V.ufl_element()] * cases + ([D.ufl_element()] if with_density else [])
        self.alone = len(elements) == 1
        self.space = V if self.alone else dolfinx.fem.functionspace(domain, basix.ufl.mixed_element(elements))
        self.subspaces = [V] if self.alone else [self.space.sub(case) for case in range(cases)]
        # Spaces of their own rather than collapsed parts: collapsing takes the time of many steps where W is large.
        self.parts: list[Any] = [slice(None)] if self.alone else [compat.places(V, part) for part in self.subspaces]
        self.density_subspace: dolfinx.fem.FunctionSpace | None = None
        self.density_part: Indices | None = None
        if with_density:
            self.density_subspace = self.space.sub(cases)
            self.density_part = compat.places(D, self.density_subspace)
        # Of one displacement alone, that of the state is the running one.
        self.function = state.displacement if self.alone else dolfinx.fem.Function(self.space)
        if with_density:
            self.function.x.array[self.density_part] = state.density.x.array
        fields, tests = self.split(self.function), self.split(ufl.TestFunction(self.space))
        self.displacements, self.density = fields[:cases], fields[cases] if with_density else state.density
        self.tests, self.test_density = tests[:cases], tests[cases] if with_density else None
        self.owned = self.space.dofmap.index_map.size_local * self.space.dofmap.index_map_bs

    def split(self, whole: Any) -> list[Any]:
        """The parts of a function or an argument."""
        return [whole] if self.alone else list(ufl.split(whole))

    @cached_property
    def translations(self) -> Floats:
        """The owned unknowns that move the body by one, shape (load cases, directions, owned)."""
        dim = self._spaces.scene.mesh.dim
        return np.array([[self._translation(part, i) for i in range(dim)] for part in self.parts])

    @cached_property
    def places(self) -> Floats:
        """The displacement that is x itself, shape (local nodes, dim): where its values are, in Lagrange cells."""
        dim, places = self._spaces.scene.mesh.dim, dolfinx.fem.Function(self._spaces.displacement_space)
        places.interpolate(lambda x: x[:dim])
        return places.x.array.reshape(-1, dim)

    def _translation(self, part: Any, direction: int) -> Floats:
        dim = self._spaces.scene.mesh.dim
        moved = dolfinx.fem.Function(self._spaces.displacement_space)
        moved.interpolate(lambda x: np.outer(np.arange(dim) == direction, np.ones(x.shape[1])))
        unknown = np.zeros_like(self.function.x.array)
        unknown[part] = moved.x.array
        return unknown[: self.owned]

    def displacement_arrays(self) -> list[Floats]:
        """Displacements of the iterate, as `displacements[case].x.array` of the state."""
        return [self.function.x.array[part] for part in self.parts]

    def size(self) -> int:
        """Number of unknowns on all ranks, what is held included."""
        dofmap = self.space.dofmap
        return int(dofmap.index_map.size_global * dofmap.index_map_bs)
