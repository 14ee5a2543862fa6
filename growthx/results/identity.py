"""By what a run is known again: all that its scene, its discretisation and its way through time are made of."""

from __future__ import annotations

import math
from dataclasses import fields, is_dataclass
from numbers import Real
from typing import TYPE_CHECKING, Any

import numpy as np
import ufl

from growthx.common.arrays import is_uniform, parameters
from growthx.common.memory import Memory
from growthx.discretisation.constraints.rigid_faces import is_of_a_rigid_face
from growthx.fem import compat
from growthx.fem.assembly import average_cells
from growthx.meshing.fields import as_ufl, law_as_ufl
from growthx.model.actions.histories import Table, share_at
from growthx.model.open_loads import OpenLoad
from growthx.model.supports import Held
from growthx.results.fingerprint import WRITER, WRITTEN, fingerprint

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from growthx.common.arrays import Floats
    from growthx.discretisation.discretisation import Discretisation
    from growthx.model.program import Program
    from growthx.solvers.settings import NewtonSettings
    from growthx.stepping.control import Stepping

ROUND_OFF = 1e-9  # relative, by which the same quantity may differ on other machines and numbers of ranks
# Parts that are compared by their effect, may change on the way, or are for the reader.
FREE = ("mesh", "until", "requested", "summary")
HISTORIES = ("the history of load", "the history of support")  # how names of histories begin
DENSE = 1.05  # from one time, in steps, to the next one at which histories of loads are compared


def identity(problem: Discretisation, stepping: Stepping, settings: NewtonSettings) -> Memory:
    """What a run must have in common with another to be the same run, but for its end (collective)."""
    scene = problem.scene
    parts = {
        "variant": problem.variant.name,
        "the variant": problem.variant,
        "scene": scene,
        "stepping": stepping,
        "tolerance": settings.tolerance,
        "full_newton": settings.full,
        "cells": f"{scene.mesh.cell_count} {scene.mesh.cell_name}s",
    }
    memory = Memory(numbers={name: value for part in parts for name, value in _leaves(part, parts[part])})
    x = ufl.SpatialCoordinate(scene.mesh.domain)
    values = {f"the place of a density, {axis}": x[i] for i, axis in enumerate("xyz"[: scene.mesh.dim])}
    laws: list[Any] = [problem.material, problem.growth]
    laws += [] if scene.flux is None else [law_as_ufl(scene.flux, scene.mesh)]
    for law in laws:
        varying = {name: value for name, value in parameters(law).items() if not is_uniform(value)}
        values.update({f"the field '{name}'": value for name, value in varying.items()})
    if not is_uniform(scene.start_density):
        values["the initial density"] = as_ufl(scene.start_density, scene.mesh)
    if problem.rests:
        values["the density of what does not grow"] = (1 - problem.grows) * problem.state.resting_density
    memory.densities["the volume that grows with a density"] = problem.volumes
    points = compat.interpolation_points(problem.density_space.element)
    for name, value in values.items():
        at_points = problem.evaluate(value, points)
        memory.densities[name] = average_cells(problem.density_space, at_points).x.array
    memory.unknowns["the nodal force of full dead loads"] = problem.system.loads.nodal_load
    for number, (history, forces) in enumerate(problem.system.loads.timed_loads, start=1):
        memory.unknowns[f"the nodal force of load {number} with a history"] = forces
        memory.numbers[f"{HISTORIES[0]} {number}"] = [float(history(time)) for time in _times(scene.program)]
    followed = [(HISTORIES[1], f"'{support.place}'", support.history) for support in scene.supports]
    # Of the dead loads only moments of rigid faces are no nodal forces.
    shares = [load for load in scene.all_loads if isinstance(load, OpenLoad) or is_of_a_rigid_face(load, scene)]
    followed += [(HISTORIES[0], load.place, load.history) for load in shares]
    for number, (what, place, course) in enumerate(followed, start=1):
        if course is not None:
            memory.numbers[f"{what} {place}, {number}"] = [share_at(course, time) for time in _times(scene.program)]
    memory.unknowns["the displacement prescribed at a support"] = _held(problem)
    memory.unknowns["the number of conditions on an unknown"] = _conditions(problem)
    memory.numbers.update(fingerprint(problem, stepping))
    return memory


def _times(program: Program) -> list[float]:
    """Times up to the end, closer at first, that two programs of the same step have in common until one ends."""
    count = int(program.until / program.step * (1 + 1e-12))
    powers = DENSE ** np.arange(math.ceil(math.log(max(count, 1)) / math.log(DENSE)) + 1)
    steps = np.unique(np.round(powers))
    return [float(time) for time in program.step * steps[steps <= count]]


def difference(one: Mapping[str, Any], here: Mapping[str, Any]) -> str:
    """What a run has otherwise than the one here, the first thing, as a part of a sentence; empty if nothing.

    one, here: numbers, and arrays in an order that both have, by names whose last part says what they are.
    """
    same_writer = one.get(WRITER) == here.get(WRITER)
    everything = {**one, **here}
    for name in sorted(everything, key=lambda name: _order(name, everything[name])):
        if name == WRITER or (name.startswith(WRITTEN) and not same_writer):
            continue
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
        elif name.startswith(WRITTEN) and a != b:
            return f"{name.removeprefix(WRITTEN)} is written otherwise"
        elif isinstance(a, list) and isinstance(b, list):
            if apart := _apart(a, b, partly=name.startswith(HISTORIES)):
                return f"{_plain(name)} is {apart}"
        elif not _same(a, b):
            return f"{_plain(name)} is {a}, here {b}"
    return ""


def _order(name: str, value: Any) -> int:
    """Parameters first, then fields: they say best what differs."""
    return 2 if isinstance(value, list) or name.startswith(WRITTEN) else int(isinstance(value, np.ndarray))


def _plain(name: str) -> str:
    return name.rpartition("/")[2]


def _same(a: Any, b: Any) -> bool:
    if isinstance(a, (int, float)) and isinstance(b, (int, float)):
        return math.isclose(a, b, rel_tol=ROUND_OFF) or (math.isnan(a) and math.isnan(b))
    return bool(a == b)


def _apart(one: list[Any], here: list[Any], *, partly: bool) -> str:
    """How two lists differ first, as a part of a sentence; partly: one may go on where the other ends."""
    if len(one) != len(here) and not partly:
        return f"one of {len(one)}, here of {len(here)}"
    pairs, where = zip(one, here, strict=not partly), " somewhere" if len(one) > 1 else ""
    return next((f"{a:g}{where}, here {b:g}" for a, b in pairs if not _same(a, b)), "")


def _conditions(problem: Discretisation) -> Floats:
    count = np.zeros_like(problem.system.unknown.x.array)
    for condition in problem.system.conditions:
        np.add.at(count, condition.dof_indices()[0], 1.0)
    return count


def _held(problem: Discretisation) -> Floats:
    values = np.full_like(problem.system.unknown.x.array, np.nan)
    for held in problem.system.supports.held:
        values[held.dofs] = held.values
    return values


def _leaves(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    """What a value is made of: numbers and texts by the names that lead to them."""
    if isinstance(value, Table):  # may go on longer: compared where it takes effect
        yield name, type(value).__name__
    elif is_dataclass(value) and not isinstance(value, type):
        yield name, type(value).__name__
        for part in fields(value):
            if part.name not in FREE and not (part.name == "history" and isinstance(value, Held)):
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
