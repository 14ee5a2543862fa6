"""A scene as arrays: what its author gave, cell by cell, and where DOLFINx keeps which unknown.

Nothing here comes from growthx's forms: of DOLFINx, the coordinates and the numbers of cells' unknowns; of the scene,
the numbers that it was made with.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.robustness.random_scenes import reference
from benchmarks.robustness.random_scenes.laws import Source
from benchmarks.robustness.random_scenes.reference import Element

if TYPE_CHECKING:
    import growthx as gx
    from benchmarks.robustness.random_scenes.bodies import Body
    from growthx.common.arrays import Floats, Indices
    from growthx.discretisation.discretisation import Discretisation

# What the names mean: displacement and density as family and degree, "cell" or "points"; degrees of the two rules.
MEANING: dict[str, tuple[tuple[str, int], Any, int, int]] = {
    "Q1Q1": (("P", 1), ("P", 1), 3, 3),
    "Q2Q2": (("P", 2), ("P", 2), 5, 5),
    "S2Q1": (("S", 2), ("P", 1), 3, 3),
    "Q1P0": (("P", 1), "cell", 3, 3),
    "Q1": (("P", 1), "points", 3, 3),
    "Q2": (("P", 2), "points", 5, 5),
    "Q1sri": (("P", 1), "cell", 3, 1),
    "S2fri": (("S", 2), "points", 3, 3),
    "P1P1": (("P", 1), ("P", 1), 2, 2),
    "P2P2": (("P", 2), ("P", 2), 4, 4),
    "P2P1": (("P", 2), ("P", 1), 2, 2),
    "P1P0": (("P", 1), "cell", 1, 1),
    "P1": (("P", 1), "points", 1, 1),
    "P2": (("P", 2), "points", 2, 2),
}
GROWTH = {
    "EnergyDrivenGrowth": "energy",
    "SpecificEnergyDrivenGrowth": "specific",
    "StrainDrivenGrowth": "strain",
    "StressDrivenGrowth": "stress",
}


@dataclass(frozen=True)
class Model:
    """A scene on a variant as arrays; cells in DOLFINx's order.

    corners: (cells, corners, dim).  nodes: of the body as given, (cells, corners).  cells: their numbers as given.
    displacement, density: elements; of densities at points or per cell, None.
    dofs, density_dofs: unknowns of the cells, (cells, functions); counts: how many there are of each.
    """

    scene: gx.Scene
    variant: str
    lumped: tuple[bool, bool]  # storage, source
    shape: str
    body: Body
    corners: Floats
    nodes: Indices
    cells: Indices
    displacement: Element
    kind: Any
    degrees: tuple[int, int]
    dofs: Indices
    density_dofs: Indices
    counts: tuple[int, int]
    density_points: Floats  # of densities at points, in the order of the unknowns of a cell

    @classmethod
    def of(cls, problem: Discretisation, body: Body) -> Model:
        """From the arrays of a discretised scene."""
        domain, name = problem.scene.mesh.domain, problem.variant.name.partition(" ")[0]
        displacement, kind, momentum, mass = MEANING[name]
        shape, u, rho = body.shape, problem.displacement_space, problem.density_space
        dim = reference.DIMENSION[shape]
        corners = domain.geometry.x[domain.geometry.dofmap][:, :, :dim]
        nodes = body.nodes_at(corners)
        return cls(
            scene=problem.scene,
            variant=name,
            lumped=("lumped" in problem.variant.name, "with its source" in problem.variant.name),
            shape=shape,
            body=body,
            corners=corners,
            nodes=nodes,
            cells=body.cells_of(nodes),
            displacement=Element(shape, *displacement),
            kind=kind,
            degrees=(momentum, mass),
            dofs=u.dofmap.list,
            density_dofs=rho.dofmap.list,
            counts=(u.dofmap.index_map.size_local, rho.dofmap.index_map.size_local),
            density_points=problem.spaces.density_points,
        )

    @property
    def dim(self) -> int:
        """Directions."""
        return self.corners.shape[2]

    @property
    def density(self) -> Element | None:
        """The density's shape functions, if it has any."""
        return Element(self.shape, *self.kind) if isinstance(self.kind, tuple) else None

    @property
    def is_nodal(self) -> bool:
        """Whether cells share densities."""
        return isinstance(self.kind, tuple)

    def per_cell(self, given: Any) -> Floats:
        """A parameter in each cell, (cells,): a number, or one for each cell as given."""
        if isinstance(given, np.ndarray):
            return np.asarray(given[self.cells], dtype=float)
        return np.full(len(self.cells), float(given))

    @cached_property
    def grows(self) -> Any:
        """Which cells grow, (cells,)."""
        scene = self.scene
        if scene.growing is None:
            return np.ones(len(self.cells), dtype=bool)
        found = np.zeros(len(self.cells), dtype=bool)
        for name in scene.growing:
            found |= np.isin(self.cells, self.body.regions[name])
        return found

    @cached_property
    def parameters(self) -> dict[str, Floats]:
        """E, ν, ρ*, n, c and S* of the cells."""
        material, growth = self.scene.material, self.scene.growth
        given = {
            "young": material.young,
            "poisson": material.poisson,
            "reference": material.reference_density,
            "n": material.density_exponent,
            "rate": growth.rate,
            "attractor": growth.attractor,
        }
        return {name: self.per_cell(value) for name, value in given.items()}

    @cached_property
    def source(self) -> Source:
        """The law of growth."""
        growth = self.scene.growth
        return Source(GROWTH[type(growth).__name__], getattr(growth, "exponent", 0.0), growth.dead_zone)

    @cached_property
    def cases(self) -> list[tuple[float, tuple[Any, ...]]]:
        """Weight, with the sum one, and all loads of each load case."""
        cases, scene = self.scene.cases, self.scene
        if not cases:
            return [(1.0, scene.loads)]
        total = sum(case.weight for case in cases)
        return [(case.weight / total, scene.loads + case.loads) for case in cases]

    def sides(self, name: str) -> list[tuple[int, int]]:
        """Cell and side of each facet of a named boundary."""
        marked = np.isin(self.nodes, self.body.sides[name])
        found = []
        for side, ends in enumerate(reference.SIDES[self.shape]):
            found += [(int(cell), side) for cell in np.flatnonzero(marked[:, list(ends)].all(axis=1))]
        return found

    def dofs_on(self, name: str, *, density: bool = False) -> Indices:
        """Unknowns of a named boundary: of the displacement nodes, or of the density."""
        element, dofs = (self.density, self.density_dofs) if density else (self.displacement, self.dofs)
        assert element is not None
        found = set()
        for cell, side in self.sides(name):
            ends = set(reference.SIDES[self.shape][side])
            found |= {int(dofs[cell, i]) for i, support in enumerate(element.supports) if set(support) <= ends}
        return np.array(sorted(found), dtype=int)

    def dof_at(self, place: tuple[float, ...]) -> Indices:
        """The displacement node at a corner."""
        at = np.abs(self.corners - np.array(place)).max(axis=2) <= 1e-9 * np.abs(self.corners).max()
        cell, corner = np.argwhere(at)[0]
        return self.dofs[cell, corner : corner + 1]
