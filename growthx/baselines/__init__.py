"""Baselines of the literature, to compare with: densities that are updated after equilibrium, and averages of them.

What users call is here by its name.
"""

from growthx.baselines.averaging import FAR, Averaging, NonLocal, Smoothed
from growthx.baselines.staggered import FLOOR, frozen, update
from growthx.post.checkerboards import checkerboard_index, high_frequency_index

__all__ = [
    "FAR",
    "FLOOR",
    "Averaging",
    "NonLocal",
    "Smoothed",
    "checkerboard_index",
    "frozen",
    "high_frequency_index",
    "update",
]
