"""A discretised scene in a few words, from what one rank knows: any rank may print it."""

from __future__ import annotations

from typing import Any

from growthx.common.words import NAME, cut, line, quoted
from growthx.model.words import scene_lines


def problem_in_short(of: Any) -> str:
    """A problem's scene, variant and size, on one line."""
    return f"{quoted(of.scene.name)} with {of.variant.name}: {of.dofs} unknowns, at t = {of.time:g}"


def problem_in_words(of: Any) -> str:
    """A discretised scene and where it is in its program."""
    return "\n".join(problem_lines(of))


def problem_lines(of: Any) -> list[str]:
    """A discretised scene and its size, on lines of which all but the first are indented."""
    densities = of.density_space.dofmap.index_map.size_global
    return [
        f"{cut(of.scene.name, NAME)} with {of.variant.name} ({of.variant.summary})",
        *scene_lines(of.scene),
        line("unknowns", f"{of.dofs}; {densities} densities, {of.points} integration points"),
        line("state", f"t = {of.time:g}, load {of.amplitude:.3g}"),
    ]
