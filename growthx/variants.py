"""The discretisations of the literature as plain data (the paper's figures 1 and 4).

A variant says which functions the displacement and the density are made of, and at which points of a cell the two
balances are integrated.  Spaces, quadrature, names and the way to solve for the density follow from it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import basix.ufl
import numpy as np

from growthx.errors import InputError

if TYPE_CHECKING:
    from growthx.arrays import Floats


@dataclass(frozen=True)
class Lagrange:
    """A displacement of Lagrange elements, P or Q of the given degree."""

    degree: int

    def element(self, cell_name: str, dim: int) -> Any:
        """Vector-valued element."""
        return basix.ufl.element("Lagrange", cell_name, self.degree, shape=(dim,))


class DensitySpace(Protocol):
    """Where the densities of a cell live."""

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
class Nodal:
    """A density continuous between cells, with values at the nodes of a Lagrange element."""

    degree: int
    local = False

    def element(self, cell_name: str, mass_degree: int) -> Any:
        """Lagrange element of the given degree."""
        return basix.ufl.element("Lagrange", cell_name, self.degree)

    def shares(self, element: Any, X: Floats) -> Floats:
        """The shape functions."""
        return np.array(element.tabulate(0, X)[0])


@dataclass(frozen=True)
class PerCell:
    """One density for each cell."""

    local = True

    def element(self, cell_name: str, mass_degree: int) -> Any:
        """Constant on the cell."""
        return basix.ufl.element("DG", cell_name, 0)

    def shares(self, element: Any, X: Floats) -> Floats:
        """The one density everywhere."""
        return np.ones((len(X), 1))


@dataclass(frozen=True)
class AtPoints:
    """One density for each integration point of the balance of mass."""

    local = True

    def element(self, cell_name: str, mass_degree: int) -> Any:
        """Values at the quadrature points."""
        return basix.ufl.quadrature_element(cell_name, degree=mass_degree)

    def shares(self, element: Any, X: Floats) -> Floats:
        """The density of the nearest integration point."""
        points = element.custom_quadrature()[0]
        nearest = np.linalg.norm(X[:, np.newaxis] - points, axis=2).argmin(axis=1)
        return np.eye(len(points))[nearest]


@dataclass(frozen=True)
class Variant:
    """A discretisation: displacement element, density space and, per direction, the points of the two balances.

    displacement, density: what the two fields are made of.
    points: Gauss points per direction, the same for both balances.
    """

    name: str
    displacement: Lagrange
    density: DensitySpace
    points: int
    summary: str

    @property
    def degree(self) -> int:
        """Polynomial degree per direction that the Gauss rule integrates exactly."""
        return 2 * self.points - 1

    def displacement_element(self, cell_name: str, dim: int) -> Any:
        """Element of the displacement."""
        return self.displacement.element(cell_name, dim)

    def density_element(self, cell_name: str) -> Any:
        """Element of the density."""
        return self.density.element(cell_name, self.degree)

    def points_per_cell(self, cell_name: str) -> int:
        """Number of integration points in a cell."""
        return np.size(basix.make_quadrature(basix.CellType[cell_name], self.degree)[1])


Q1Q1 = Variant("Q1Q1", Lagrange(1), Nodal(1), 2, "node-based: continuous density, solved with the displacement")
Q1P0 = Variant("Q1P0", Lagrange(1), PerCell(), 2, "element-based: one density per cell, driven by its mean source")
Q1 = Variant("Q1", Lagrange(1), AtPoints(), 2, "integration-point based: a density at each of the 2 x 2 points")

CATALOGUE = {variant.name: variant for variant in (Q1Q1, Q1P0, Q1)}


def named(name: str) -> Variant:
    """The variant of that name, in upper or lower case; InputError if there is none."""
    for known, variant in CATALOGUE.items():
        if known.lower() == name.lower():
            return variant
    raise InputError(f"there is no variant '{name}': one of {', '.join(CATALOGUE)} would be right")
