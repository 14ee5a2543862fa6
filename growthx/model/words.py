"""A scene in a few words, from what one rank knows: any rank may print it."""

from __future__ import annotations

from typing import Any

from growthx.common.words import (
    NAME,
    counted,
    cut,
    field_in_words,
    fields_in_words,
    how_many,
    line,
    listed,
    quoted,
    quoted_names,
)
from growthx.meshing.mesh import cells_in_words, mesh_in_words

# What may be one, of those who give a result or a scan for the density that it has.
A_DENSITY = "a positive number, a function, or a field as gx.transfer(…) or a scan's density(…) give,"


def scene_in_short(of: Any) -> str:
    """A scene's name and size, on one line."""
    parts = ", ".join([cells_in_words(of.mesh), how_many(of.supports, "support"), how_many(of.all_loads, "load")])
    return f"{quoted(of.name)}: {parts}"


def scene_in_words(of: Any) -> str:
    """What a scene is made of, on a line each."""
    return "\n".join([cut(of.name, NAME), *scene_lines(of)])


def scene_lines(of: Any) -> list[str]:
    """What a scene is made of, on indented lines."""
    grows = "everywhere" if of.growing is None else f"in {quoted_names(of.growing)}"
    program = of.program
    lines = [
        line("mesh", mesh_in_words(of.mesh) + (", in plane stress" if of.plane == "stress" else "")),
        line("material", fields_in_words(of.material)),
        line("growth", fields_in_words(of.growth)),
        line("start", f"density {field_in_words(of.start_density)}, grows {grows}"),
        line("held", counted(f"{type(support).__name__} {quoted(support.place)}" for support in of.supports)),
        line("loads", counted(f"{type(load).__name__} {load.place}" for load in of.all_loads)),
        line("program", f"Δt = {program.step:g} until t = {program.until:g}, ramp over {program.ramp:g}"),
    ]
    if of.cases:
        lines.append(line("cases", listed([f"{quoted(case.name)} × {case.weight:.3g}" for case in of.cases])))
    more = [of.flux, of.inertia, *of.influx, *of.prescribed_densities]
    if any(more):
        lines.append(line("also", counted(type(part).__name__ for part in more if part is not None)))
    return lines
