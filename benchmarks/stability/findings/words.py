"""Numbers of rows, and how they are said."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from statistics import median
from typing import Any

import growthx as gx
from benchmarks.stability.study import FINISHED, LUMPED, VARIANTS

HEALED = tuple(variant.name for variant in LUMPED)


def finished(rows: Iterable[Any]) -> str:
    """How many of them came to their end."""
    known = list(rows)
    return f"{sum(row.ended == FINISHED for row in known)} of {len(known)}"


def most(rows: Iterable[Any], name: str) -> float:
    """The largest of a number of the rows that is one."""
    return max((value for row in rows if not math.isnan(value := getattr(row, name))), default=math.nan)


def least(rows: Iterable[Any], name: str) -> float:
    """The smallest."""
    return min((value for row in rows if not math.isnan(value := getattr(row, name))), default=math.nan)


def middle(rows: Iterable[Any], name: str) -> float:
    """The median."""
    known = [value for row in rows if not math.isnan(value := getattr(row, name))]
    return median(known) if known else math.nan


def number(value: float, digits: int = 2) -> str:
    """A number, or a dash where there is none."""
    return "–" if math.isnan(value) else f"{value:.{digits}g}"


def named(names: Iterable[str]) -> str:
    """Names in a row, each once."""
    return ", ".join(dict.fromkeys(names)) or "none"


def is_local(variant: str) -> bool:
    """Whether densities are at points or in cells."""
    return variant in VARIANTS and gx.variants.named(variant).density.local


def set_minus(rows: Sequence[Any], without: Sequence[Any]) -> list[Any]:
    """The rows but for some."""
    return [row for row in rows if row not in without]
