"""The discretisations of the literature as plain data (the paper's figures 1 and 4, and their like on simplices).

A variant says which functions the displacement and the density are made of, and at which points of a cell the two
balances are integrated.  Spaces, quadrature, names and the way to solve for the density follow from it: another
discretisation is another row of the catalogue.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NoReturn, Protocol

import basix
import basix.ufl
import numpy as np

from growthx.common.checks import require_kind, require_name
from growthx.common.errors import InputError, no_such_name
from growthx.common.overrides import Sealed
from growthx.common.renamed import renamed
from growthx.fem.cells import PLURALS, SIMPLICES, TENSOR_CELLS, equal_sided

if TYPE_CHECKING:
    from collections.abc import Callable

    from growthx.common.arrays import Floats


@dataclass(frozen=True)
class Displacement(Sealed, replaceable=()):
    """What a displacement is made of: a family of basix elements (P is Q on tensor cells) and a degree.

    Example:
        >>> gx.Q2.displacement == gx.Q1.displacement, gx.Q2.displacement.degree
        (False, 2)
    """

    family: basix.ElementFamily
    degree: int

    def element(self, cell_name: str, dim: int) -> Any:
        """Vector-valued element."""
        return basix.ufl.element(self.family, cell_name, self.degree, shape=(dim,))


class DensitySpace(Protocol):
    """Where the densities of a cell live.

    Example:
        >>> [(variant.name, variant.density.local) for variant in (gx.Q1Q1, gx.Q1P0, gx.Q1)]
        [('Q1Q1', False), ('Q1P0', True), ('Q1', True)]
    """

    local: bool  # no density is shared between cells, so that it can be eliminated cell by cell

    def element(self, cell_name: str, mass_degree: int) -> Any:
        """The basix element of the density on one cell."""
        ...

    def shares(self, element: Any, X: Floats) -> Floats:
        """Share of each density of a cell at the points X of the reference cell, shape (points, densities).

        X has shape (points, dim).  Each row sums to one.
        """
        ...


@dataclass(frozen=True)
class Nodal(Sealed, replaceable=()):
    """A density continuous between cells, with values at the nodes of a Lagrange element.

    Example:
        >>> gx.Q2Q2.density.degree, isinstance(gx.Q2Q2.density, gx.variants.Nodal)
        (2, True)
    """

    degree: int
    local = False

    def element(self, cell_name: str, mass_degree: int) -> Any:
        """Lagrange element of the given degree."""
        return basix.ufl.element("Lagrange", cell_name, self.degree)

    def shares(self, element: Any, X: Floats) -> Floats:
        """The shape functions."""
        return np.array(element.tabulate(0, X)[0])


@dataclass(frozen=True)
class PerCell(Sealed, replaceable=()):
    """One density for each cell.

    Example:
        >>> isinstance(gx.Q1P0.density, gx.variants.PerCell)
        True
    """

    local = True

    def element(self, cell_name: str, mass_degree: int) -> Any:
        """Constant on the cell."""
        return basix.ufl.element("DG", cell_name, 0)

    def shares(self, element: Any, X: Floats) -> Floats:
        """The one density everywhere."""
        return np.ones((len(X), 1))


@dataclass(frozen=True)
class AtPoints(Sealed, replaceable=()):
    """One density for each integration point.

    Example:
        >>> isinstance(gx.Q1.density, gx.variants.AtPoints)
        True
    """

    local = True

    def element(self, cell_name: str, mass_degree: int) -> Any:
        """Values at the quadrature points."""
        return basix.ufl.quadrature_element(cell_name, degree=mass_degree)

    def shares(self, element: Any, X: Floats) -> Floats:
        """The density of the nearest integration point, measured so that all corners of the cell are alike."""
        points = element.custom_quadrature()[0]
        places, at = (equal_sided(element.cell_type, these) for these in (points, X))
        nearest = np.linalg.norm(at[:, np.newaxis] - places, axis=2).argmin(axis=1)
        return np.eye(len(points))[nearest]


@dataclass(frozen=True)
class Variant(Sealed, replaceable=()):
    """A discretisation: displacement element, density space and the points at which the two balances are integrated.

    cells: the shapes of cells it is made for.  displacement, density: what the two fields are made of.
    momentum_degree, mass_degree: of the polynomials that each balance's rule integrates exactly, per direction on
    tensor cells: 1, 3 and 5 are their 1, 2 and 3 Gauss points per direction.
    storage_at_corners, source_at_corners: integrate this part of the balance of mass at the corners of the cells
    instead, which makes its matrix diagonal: `lumped`.
    Raises InputError if the rules differ and the density is not one per cell: other densities tie both to one rule.

    Example:
        >>> from dataclasses import replace
        >>> reduced = replace(gx.Q1P0, name="reduced", momentum_degree=1)
        >>> reduced.momentum_degree, gx.Q1P0.momentum_degree
        (1, 3)
    """

    name: str
    cells: tuple[str, ...]
    displacement: Displacement
    density: DensitySpace
    momentum_degree: int
    mass_degree: int
    summary: str
    storage_at_corners: bool = False
    source_at_corners: bool = False

    def __post_init__(self) -> None:
        what = f"of the variant {self.name}"
        require_kind(self.displacement, Displacement, f"the displacement {what}", "a variants.Displacement")
        kinds = Nodal, PerCell, AtPoints
        require_kind(self.density, kinds, f"the density {what}", "a variants.Nodal, PerCell or AtPoints")
        if (self.storage_at_corners or self.source_at_corners) and self.density != Nodal(1):
            right = ", ".join(variant.name for variant in CATALOGUE.values() if variant.density == Nodal(1))
            raise InputError(
                f"{self.name} cannot lump the balance of mass at the corners of the cells, where some shares of its "
                f"densities are zero or below, or where it has none: {right} could"
            )
        if not (self.one_rule or isinstance(self.density, PerCell)):
            raise InputError(
                f"the variant {self.name} integrates momentum to degree {self.momentum_degree} and mass to degree "
                f"{self.mass_degree}: one degree for both, or one density per cell, would be right"
            )

    @renamed(source="with_source")
    def lumped(self, *, with_source: bool = False) -> Variant:
        """The same with a lumped density matrix (Remark 4.3) and, on request, the source at the corners, too."""
        name = f"{self.name} lumped" + (" with its source" if with_source else "")
        return replace(self, name=name, storage_at_corners=True, source_at_corners=with_source)

    @property
    def one_rule(self) -> bool:
        """Whether both balances are integrated at the same points."""
        return self.momentum_degree == self.mass_degree

    def check(self, cell_name: str) -> None:
        """Raise InputError if the variant is not made for this shape of cells."""
        if cell_name not in self.cells:
            made_for = " and ".join(PLURALS[shape] for shape in self.cells)
            right = ", ".join(variant.name for variant in suited(cell_name)) or "another mesh"
            raise InputError(
                f"{self.name} is a discretisation for {made_for}, and the mesh has {PLURALS.get(cell_name, cell_name)}:"
                f" {right} would be right"
            )

    def displacement_element(self, cell_name: str, dim: int) -> Any:
        """Element of the displacement."""
        return self.displacement.element(cell_name, dim)

    def density_element(self, cell_name: str) -> Any:
        """Element of the density."""
        return self.density.element(cell_name, self.mass_degree)

    def integration_points(self, cell_name: str) -> Floats:
        """The points of a reference cell at which the stress is evaluated, shape (points, dim)."""
        return np.asarray(basix.make_quadrature(basix.CellType[cell_name], self.momentum_degree)[0])

    def points_per_cell(self, cell_name: str) -> int:
        """Number of points in a cell at which the stress is evaluated."""
        return len(self.integration_points(cell_name))


LINEAR = Displacement(basix.ElementFamily.P, 1)
QUADRATIC = Displacement(basix.ElementFamily.P, 2)
SERENDIPITY = Displacement(basix.ElementFamily.serendipity, 2)

# fmt: off
#                name    cells         displacement density      momentum, mass
Q1Q1 = Variant("Q1Q1",  TENSOR_CELLS, LINEAR,      Nodal(1),    3, 3, "node-based, density linear")
Q2Q2 = Variant("Q2Q2",  TENSOR_CELLS, QUADRATIC,   Nodal(2),    5, 5, "node-based, density quadratic")
S2Q1 = Variant("S2Q1",  TENSOR_CELLS, SERENDIPITY, Nodal(1),    3, 3, "node-based, density one order lower")
Q1P0 = Variant("Q1P0",  TENSOR_CELLS, LINEAR,      PerCell(),   3, 3, "per cell, driven by the cell's mean source")
Q1 = Variant("Q1",      TENSOR_CELLS, LINEAR,      AtPoints(),  3, 3, "at the integration points")
Q2 = Variant("Q2",      TENSOR_CELLS, QUADRATIC,   AtPoints(),  5, 5, "at the integration points, quadratic")
Q1sri = Variant("Q1sri", TENSOR_CELLS, LINEAR,     PerCell(),   3, 1, "per cell, driven by the source at its midpoint")
S2fri = Variant("S2fri", TENSOR_CELLS, SERENDIPITY, AtPoints(), 3, 3, "at the integration points, reduced")
P1P1 = Variant("P1P1",  SIMPLICES,    LINEAR,      Nodal(1),    2, 2, "node-based, density linear")
P2P2 = Variant("P2P2",  SIMPLICES,    QUADRATIC,   Nodal(2),    4, 4, "node-based, density quadratic")
P2P1 = Variant("P2P1",  SIMPLICES,    QUADRATIC,   Nodal(1),    2, 2, "node-based, density one order lower")
P1P0 = Variant("P1P0",  SIMPLICES,    LINEAR,      PerCell(),   1, 1, "per cell, driven by the cell's mean source")
P1 = Variant("P1",      SIMPLICES,    LINEAR,      AtPoints(),  1, 1, "at the one integration point")
P2 = Variant("P2",      SIMPLICES,    QUADRATIC,   AtPoints(),  2, 2, "at the integration points, quadratic")

# fmt: on
CATALOGUE = {
    variant.name: variant for variant in (Q1Q1, Q2Q2, S2Q1, Q1P0, Q1, Q2, Q1sri, S2fri, P1P1, P2P2, P2P1, P1P0, P1, P2)
}
DEFAULTS = (Q1P0, P1P0)  # the cheapest for each family of cells


def suited(cell_name: str) -> list[Variant]:
    """The variants made for a shape of cells.

    Example:
        >>> [variant.name for variant in gx.variants.suited("triangle")]
        ['P1P1', 'P2P2', 'P2P1', 'P1P0', 'P1', 'P2']
    """
    return [variant for variant in CATALOGUE.values() if cell_name in variant.cells]


def right_ones(cell_name: str, wanted: Callable[[Variant], bool]) -> str:
    """The end of a refusal: the names of the variants for a shape of cells that would do.

    Example:
        >>> gx.variants.right_ones("triangle", lambda variant: variant.density.local)
        'P1P0, P1, P2 would be right'
    """
    return ", ".join(variant.name for variant in suited(cell_name) if wanted(variant)) + " would be right"


def default(cell_name: str) -> Variant:
    """The variant to take for a shape of cells unless there are reasons for another: one density per cell.

    Example:
        >>> gx.variants.default("triangle").name
        'P1P0'
    """
    for variant in DEFAULTS:
        if cell_name in variant.cells:
            return variant
    raise InputError(f"the mesh has {cell_name}s: {', '.join(PLURALS.values())} would be right")


def named(name: str) -> Variant:
    """The variant of that name, in upper or lower case; InputError if there is none.

    Example:
        >>> gx.variants.named("q1p0").name
        'Q1P0'
    """
    require_name(name, "the name of a variant")
    for known, variant in CATALOGUE.items():
        if known.lower() == name.lower():
            return variant
    raise InputError(f"there is no variant '{name}': one of {', '.join(CATALOGUE)} would be right")


def __getattr__(name: str) -> NoReturn:
    raise no_such_name("growthx.variants", name, [*CATALOGUE, "CATALOGUE", "Variant", "default", "named", "suited"])
