"""All curves of errors: every discretisation on every family of meshes, and over the time step."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

import growthx as gx
from benchmarks.accuracy.convergence.errors import errors_in_space, errors_in_time
from benchmarks.accuracy.convergence.orders import END_DENSITY, END_DISPLACEMENT, QUANTITIES, SLACK, Order, theory
from benchmarks.accuracy.manufactured import HEXAHEDRA, QUADRILATERALS, TETRAHEDRA, TRAPEZOIDS, TRIANGLES, Family
from benchmarks.shared.reporting import progress

if TYPE_CHECKING:
    from collections.abc import Callable

# Cells per side, for linear and for quadratic displacements: what shows the order and stays below some minutes.
LEVELS = {
    QUADRILATERALS: {1: (4, 8, 16, 32, 64), 2: (4, 8, 16, 32, 64)},
    TRAPEZOIDS: {2: (8, 16, 32, 64, 128)},
    TRIANGLES: {1: (4, 8, 16, 32, 64), 2: (4, 8, 16, 32, 64)},
    HEXAHEDRA: {1: (2, 4, 8, 16), 2: (2, 4, 8)},
    TETRAHEDRA: {1: (3, 6, 12, 24), 2: (3, 6, 12)},
}
FAMILIES = tuple(LEVELS)
STEPS = (4, 8, 16, 32, 64)


@dataclass(frozen=True)
class Curve:
    """Errors of one variant in one quantity on ever finer meshes of a family, or with ever smaller time steps."""

    family: str
    variant: str
    quantity: str
    theory: Order
    parts: tuple[int, ...]  # cells per side, or time steps
    errors: tuple[float, ...]

    @property
    def orders(self) -> np.ndarray:
        """Observed order from each refinement to the next, shape (parts − 1,)."""
        return -np.diff(np.log(self.errors)) / np.diff(np.log(self.parts))

    @property
    def order(self) -> float:
        """Observed order between the finest two."""
        return float(self.orders[-1])

    @property
    def below_theory(self) -> bool:
        """Whether the observed order is lower than what is guaranteed."""
        return self.order < self.theory.guaranteed - SLACK


def in_space(variant: gx.Variant, family: Family, levels: tuple[int, ...]) -> list[Curve]:
    """The four curves of a variant on a family of meshes."""
    errors = [errors_in_space(variant, family.mesh(cells)) for cells in levels]
    orders = theory(variant, family)
    return [
        Curve(family.name, variant.name, quantity, orders[quantity], levels, tuple(e[quantity] for e in errors))
        for quantity in QUANTITIES
    ]


def in_time(variant: gx.Variant, steps: tuple[int, ...]) -> list[Curve]:
    """The two curves of a variant: implicit Euler is of first order."""
    errors = [errors_in_time(variant, count) for count in steps]
    return [
        Curve("time steps", variant.name, quantity, Order(1), steps, tuple(e[quantity] for e in errors))
        for quantity in (END_DENSITY, END_DISPLACEMENT)
    ]


def members(family: Family) -> list[gx.Variant]:
    """The variants measured on a family: on trapezoids serendipity, and Q2 to compare it with."""
    return gx.variants.suited(family.cell) if family.smooth else [gx.S2Q1, gx.Q2, gx.S2fri]


def study(coarse: bool = False) -> list[Curve]:
    """All curves; `coarse` leaves out the finest level of each."""
    last = -1 if coarse else None
    jobs: list[tuple[str, Callable[[], list[Curve]]]] = []
    for family in FAMILIES:
        for variant in members(family):
            levels = LEVELS[family][variant.displacement.degree][:last]
            jobs.append((f"{variant.name} on {family.name}", lambda v=variant, f=family, n=levels: in_space(v, f, n)))
    for variant in gx.variants.CATALOGUE.values():
        jobs.append((f"{variant.name} in time", lambda v=variant: in_time(v, STEPS[:last])))
    with progress("convergence", len(jobs)) as begin:
        curves = []
        for name, job in jobs:
            begin(name)
            curves += job()
    return curves
