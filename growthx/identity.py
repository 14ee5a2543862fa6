"""By what a run is known again: all that its scene, its discretisation and its way through time are made of."""

from __future__ import annotations

import math
from dataclasses import fields, is_dataclass
from numbers import Real
from typing import TYPE_CHECKING, Any

import numpy as np
import ufl

from growthx import compat
from growthx.assembly import average_cells
from growthx.memory import Memory

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from growthx.arrays import Floats
    from growthx.discretisation import Discretisation
    from growthx.stepping import Stepping

ROUND_OFF = 1e-9  # relative, by which the same quantity may differ on other machines and numbers of ranks
FREE = ("mesh", "until", "requested")  # parts of a scene that are compared by their effect, or may change on the way
SAMPLES = 16  # times, in steps, at which histories of loads are compared


def identity(problem: Discretisation, stepping: Stepping, tolerance: float, full_newton: bool) -> Memory:
    """What a run must have in common with another to be the same run, but for its end (collective)."""
    scene = problem.scene
    parts = {
        "variant": problem.variant.name,
        "scene": scene,
        "stepping": stepping,
        "tolerance": tolerance,
        "full_newton": full_newton,
        "cells": f"{scene.mesh.cell_count} {scene.mesh.cell_name}s",
    }
    memory = Memory(numbers={name: value for part in parts for name, value in _leaves(part, parts[part])})
    x = ufl.SpatialCoordinate(scene.mesh.domain)
    values = {f"the place of a density, {axis}": x[i] for i, axis in enumerate("xyz"[: scene.mesh.dim])}
    for law in (problem.material, problem.growth):
        values.update({f"the field '{name}'": getattr(law, name) for name in law.coefficients})
    points = compat.interpolation_points(problem.density_space.element)
    for name, value in values.items():
        at_points = problem.evaluate(value, points)
        memory.densities[name] = average_cells(problem.density_space, at_points).x.array
    memory.unknowns["the nodal force of full dead loads"] = problem.nodal_load
    for number, (history, forces) in enumerate(problem.timed_loads, start=1):
        memory.unknowns[f"the nodal force of load {number} with a history"] = forces
        times = scene.program.step * np.arange(1, SAMPLES + 1)
        memory.numbers[f"history of load {number}"] = [float(history(time)) for time in times]
    memory.unknowns["the displacement prescribed at a support"] = _held(problem)
    return memory


def difference(one: Mapping[str, Any], here: Mapping[str, Any]) -> str:
    """What a run has otherwise than the one here, the first thing, as a part of a sentence; empty if nothing.

    one, here: numbers, and arrays in an order that both have, by names whose last part says what they are.
    """
    for name in {**one, **here}:
        if name not in one or name not in here:
            return f"there is {'a' if name in one else 'no'} value of {_plain(name)}, unlike here"
        a, b = one[name], here[name]
        if isinstance(a, np.ndarray):
            if a.shape != b.shape:
                return f"{_plain(name)} is one of {a.size}, here of {b.size}"
            apart = np.abs(a - b)
            apart[np.isnan(a) & np.isnan(b)] = 0.0
            limit = ROUND_OFF * max(np.abs(array[np.isfinite(array)]).max(initial=0.0) for array in (a, b))
            wrong = np.flatnonzero(~(apart <= limit))
            if len(wrong):
                return f"{_plain(name)} is {a[wrong[0]]:g} somewhere, here {b[wrong[0]]:g}"
        elif not _same(a, b):
            return f"{_plain(name)} is {a}, here {b}"
    return ""


def _plain(name: str) -> str:
    return name.rpartition("/")[2]


def _same(a: Any, b: Any) -> bool:
    if isinstance(a, list) and isinstance(b, list):
        return len(a) == len(b) and all(map(_same, a, b))
    if isinstance(a, (int, float)) and isinstance(b, (int, float)):
        return math.isclose(a, b, rel_tol=ROUND_OFF)
    return bool(a == b)


def _held(problem: Discretisation) -> Floats:
    values = np.full_like(problem.unknown.x.array, np.nan)
    for held in problem.held:
        values[held.dofs] = held.values
    return values


def _leaves(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    """What a value is made of: numbers and texts by the names that lead to them."""
    if is_dataclass(value) and not isinstance(value, type):
        yield name, type(value).__name__
        for part in fields(value):
            if part.name not in FREE:
                yield from _leaves(f"{name}.{part.name}", getattr(value, part.name))
    elif isinstance(value, (tuple, list)):
        yield f"{name} (count)", len(value)
        for place, part in enumerate(value):
            yield from _leaves(f"{name}[{place}]", part)
    elif isinstance(value, dict):
        for key, part in value.items():
            yield from _leaves(f"{name}[{key!r}]", part)
    elif value is None or isinstance(value, (str, bool)):
        yield name, value
    elif isinstance(value, Real):
        yield name, float(value)
    else:  # a function or a field: compared where it takes effect
        yield name, type(value).__name__
