"""Loads that are changed as a whole."""

from __future__ import annotations

from dataclasses import replace

import growthx as gx


def times(load: gx.Traction | gx.DistributedForce, factor: float) -> gx.Traction | gx.DistributedForce:
    """A multiple of a load."""
    if isinstance(load, gx.Traction):
        return replace(load, value=tuple(factor * component for component in load.value))
    return replace(load, force=tuple(factor * component for component in load.force))
