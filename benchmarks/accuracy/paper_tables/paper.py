"""What the paper prints of its two bars, and the rule by which a number of ours agrees with it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import growthx as gx

if TYPE_CHECKING:
    from collections.abc import Mapping

ELEMENTS = (10, 40, 100)
VARIANTS = gx.variants.suited("quadrilateral")
DIGITS = {"density": 6, "displacement": 5}  # printed after the point
CLOSE, CLOSER = 3e-5, "within 3·10⁻⁵"  # agrees but for the paper's own tolerance
# By problem and element: density change at mid-length and end displacement with 10, 40 and 100 elements.
PAPER: Mapping[str, Mapping[str, tuple[tuple[float, ...], tuple[float, ...]]]] = {
    "discontinuous": {
        "Q1Q1": ((0.321502, 0.297437, 0.305828), (2.32251, 2.37135, 2.36629)),
        "Q2Q2": ((0.256541, 0.302062, 0.306116), (2.37124, 2.37151, 2.37156)),
        "Q1P0": ((0.300028, 0.306185, 0.306171), (2.32239, 2.37122, 2.36624)),
        "S2Q1": ((0.318560, 0.305875, 0.306171), (2.37221, 2.37181, 2.37166)),
        "Q1": ((0.300028, 0.306185, 0.306418), (2.32239, 2.37122, 2.36624)),
        "Q2": ((0.306443, 0.306186, 0.306188), (2.37095, 2.37146, 2.37154)),
        "Q1sri": ((0.300028, 0.306168, 0.306171), (2.32239, 2.37135, 2.36630)),
        "S2fri": ((0.306504, 0.306282, 0.306171), (2.37156, 2.37155, 2.37155)),
    },
    "continuous": {
        "Q1Q1": ((0.509938, 0.525144, 0.527496), (2.92605, 2.92755, 2.92780)),
        "Q2Q2": ((0.527441, 0.527699, 0.534161), (2.92732, 2.92785, 2.92793)),
        "Q1P0": ((0.470753, 0.513734, 0.522864), (2.92554, 2.92752, 2.92780)),
        "S2Q1": ((0.526425, 0.528890, 0.529023), (2.92792, 2.92794, 2.92794)),
        "Q1": ((0.470754, 0.513734, 0.522864), (2.92548, 2.92751, 2.92780)),
        "Q2": ((0.514584, 0.526201, 0.529164), (2.92732, 2.92785, 2.92793)),
        "Q1sri": ((0.470753, 0.513734, 0.522864), (2.92599, 2.92765, 2.92786)),
        "S2fri": ((0.503670, 0.522526, 0.526427), (2.92789, 2.92794, 2.92794)),
    },
}


def papers(problem: str, variant: str, elements: int, quantity: str) -> float:
    """What the paper prints."""
    return PAPER[problem][variant][list(DIGITS).index(quantity)][ELEMENTS.index(elements)]


def to_print(value: float, printed: float, quantity: str) -> bool:
    """Whether a number, rounded as the paper's, differs from it by one unit of the last digit at most."""
    unit = 10 ** -DIGITS[quantity]
    return abs(round(value / unit) - round(printed / unit)) <= 1


def closely(value: float, printed: float) -> bool:
    """Whether a number is as near to the paper's as its tolerance."""
    return abs(value - printed) <= CLOSE
