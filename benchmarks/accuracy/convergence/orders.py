"""What is measured, and what theory says of the order in which it falls."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import growthx as gx

if TYPE_CHECKING:
    from benchmarks.accuracy.manufactured import Family

SLACK = 0.15  # an observed order this much below theory is still on its way to it
# What is measured in space, by its name in tables.
DISPLACEMENT, GRADIENT = "displacement, L²", "displacement, H¹"
EVERYWHERE, AT_POINTS = "density, everywhere", "density, at its points"
QUANTITIES = (DISPLACEMENT, GRADIENT, EVERYWHERE, AT_POINTS)
# … and in time.
END_DENSITY, END_DISPLACEMENT = "density at the end", "displacement at the end"


@dataclass(frozen=True)
class Order:
    """What theory says of an order: `guaranteed` on all meshes of the family; `smooth`, more, where points are special.

    The guaranteed order of a displacement of degree p is p + 1 in L² and p in H¹.  A density follows from ∇u, so that
    it gains nothing over p, and not more than its own space allows: 1 for a constant per cell or per point.
    """

    guaranteed: float
    smooth: float | None = None

    @property
    def expected(self) -> float:
        """The order to expect on meshes as smooth as ours."""
        return self.guaranteed if self.smooth is None else self.smooth

    def __str__(self) -> str:
        return f"{self.guaranteed:g}" if self.smooth is None else f"{self.guaranteed:g} → {self.smooth:g}"


def theory(variant: gx.Variant, family: Family) -> dict[str, Order]:
    """Orders in h of the four errors."""
    p = _gradient_order(variant, family)
    allowed = variant.density.degree + 1 if isinstance(variant.density, gx.variants.Nodal) else 1
    orders = {
        DISPLACEMENT: Order(p + 1),
        GRADIENT: Order(p),
        EVERYWHERE: Order(min(p, allowed)),
        AT_POINTS: Order(min(p, allowed) if isinstance(variant.density, gx.variants.Nodal) else p),
    }
    if family.smooth:
        for quantity, order in SUPERCONVERGENCE.get(variant.name, {}).items():
            orders[quantity] = replace(orders[quantity], smooth=order)
    return orders


def _gradient_order(variant: gx.Variant, family: Family) -> int:
    """Order of ∇u: the degree; but serendipity lacks x²y² and so, on cells that stay trapezoids, also x² and y²."""
    if variant.displacement == gx.variants.SERENDIPITY and not family.smooth:
        return 1
    return variant.displacement.degree


# Midpoints of linear cells and the 2 × 2 points of quadratic serendipity are points where ∇u is more exact than
# elsewhere, and averages around a node are, too; one order is lost again in the row of cells along loaded sides (where
# it is, half an order in the mean).
SUPERCONVERGENCE = {
    "Q1Q1": {EVERYWHERE: 1.5, AT_POINTS: 1.5},
    "P1P1": {EVERYWHERE: 1.5, AT_POINTS: 1.5},
    "Q1P0": {AT_POINTS: 2},
    "Q1sri": {AT_POINTS: 2},
    "S2fri": {AT_POINTS: 2.5},
}
