"""Pictures of bodies in space: outside and inside, slices, what is above a value, a cut with the loads.

All are drawn on rank 0, on the deformed shape; planes cut the body at rest, and what they cut is drawn where it has
moved to.  Raises InputError, before anything is drawn, for what could not be drawn as asked for.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from growthx.common.checks import check_picture, require_flag, require_kind, require_number
from growthx.common.errors import InputError
from growthx.common.renamed import renamed
from growthx.discretisation.checks.arguments import require_problem
from growthx.post.colour_bars import Scale
from growthx.post.derived import FIELDS
from growthx.post.drawing import IMAGES, arrows_of, check_look, named, on_rank_0, second_scale
from growthx.post.space import panels
from growthx.post.space.body import SpaceBody, range_of, space_body
from growthx.post.space.planes import NORMALS, plane_of

if TYPE_CHECKING:
    from growthx.discretisation.discretisation import Discretisation
    from growthx.stepping.record import Result

COLUMNS = 3  # most panels in a row


@dataclass(frozen=True)
class Look:
    """What is drawn of a body, and how: see `growthx.plots.density`; field: what of `growthx.results.FIELDS`."""

    field: str = "density"
    title: str = ""
    relative: bool = False
    scale: str = ""
    smoothed: bool = False
    magnification: float = 1.0

    def check(self, given: Discretisation | Result, path: str | os.PathLike[str]) -> Discretisation:
        """The problem to be drawn; InputError for what could not be drawn or written (collective)."""
        problem = require_problem(given)
        dim = problem.scene.mesh.dim
        if dim != 3:
            raise InputError(f"the body has {dim} dimensions: gx.plots.density draws it, all of it lies in one plane")
        check_look(self.title, self.relative, self.scale, self.smoothed, self.magnification)
        check_picture(path, IMAGES, problem.comm)
        return problem

    def name(self) -> str:
        """The title that was asked for, or else what is drawn."""
        return self.title or (named("", self.relative) if self.field == "density" else FIELDS[self.field].title)

    def body(self, problem: Discretisation) -> SpaceBody:
        """The body with the field on it."""
        return space_body(problem, self.field, self.relative, self.smoothed, self.magnification)


def overview(problem: Discretisation, path: str | os.PathLike[str], look: Look, *, arrows: bool = True) -> None:
    """Draw a body from outside with its loads, and the middle slice across its shortest extent."""
    require_flag(arrows, "arrows, of a picture,")
    problem = look.check(problem, path)
    plane, pulls = plane_of(None, problem.scene.mesh), arrows_of(problem) if arrows else []
    _show(problem, path, look, lambda body: [panels.outside(body, pulls), panels.section(body, plane)])


def slices(
    problem: Discretisation | Result,
    path: str | os.PathLike[str],
    planes: Sequence[Any] = tuple(NORMALS),
    *,
    field: str = "density",
    title: str = "",
    relative: bool = False,
    smoothed: bool = False,
    magnification: float = 1.0,
    grey: bool = False,
) -> None:
    """Draw slices of a body in space, of a result or a problem, and save them, as the path's suffix says.

    planes: each 'coronal' (across y), 'axial' (across z) or 'sagittal' (across x), through the middle of the body, or a
    point and a normal, ((x, y, z), (x, y, z)); seen from where the normal points to.
    field: any of `growthx.results.FIELDS` that is one number; smoothed: averaged to nodes, else the density as the
    variant has it and all others as means over cells.
    grey: with each slice its like in grey beside it, from black at zero to white, as a CT shows bone.
    title, relative, magnification: as of `growthx.plots.density`.

    Example:
        >>> result = gx.solve(gx.scenes.block(2), gx.Q1P0)
        >>> gx.plots.slices(result, "slices.png", ["axial", ((0.5, 0.5, 0.5), (1.0, 1.0, 0.0))])
    """
    look = Look(field, title, relative, "", smoothed, magnification)
    problem = look.check(problem, path)
    require_flag(grey, "grey, of a picture,")
    require_kind(planes, (tuple, list), "the planes", "a tuple of planes")
    if not planes:
        raise InputError(f"no plane is named: one or more of {', '.join(NORMALS)}, or points with normals, are needed")
    found = [plane_of(each, problem.scene.mesh) for each in planes]

    def drawn(body: SpaceBody) -> list[panels.Panel]:
        seen = [panels.section(body, plane) for plane in found]
        if not grey:
            return seen
        low, high = panels.grey_range(body.limits)
        label = f"the same in grey, {low:.3g} to {high:.3g}"
        greys = [panels.section(body, plane, grey=True, label=label) for plane in found]
        return [panel for pair in zip(seen, greys, strict=True) for panel in pair]

    _show(problem, path, look, drawn, columns=2 if grey else COLUMNS)


def threshold(
    problem: Discretisation | Result,
    path: str | os.PathLike[str],
    above: float | None = None,
    below: float | None = None,
    *,
    field: str = "density",
    title: str = "",
    smoothed: bool = False,
    magnification: float = 1.0,
) -> None:
    """Draw what of a body in space has values above and below some, and the rest as a shade; options as of `slices`.

    Raises InputError, too, if there is nothing of it.

    Example:
        >>> result = gx.solve(gx.scenes.block(2), gx.Q1P0)
        >>> gx.plots.threshold(result, "dense.png", above=0.5)
    """
    look = Look(field, title, False, "", smoothed, magnification)
    problem = look.check(problem, path)
    for bound, what in ((above, "lower"), (below, "upper")):
        if bound is not None:
            require_number(bound, f"the {what} bound of what is drawn", "a finite number or None", lambda _: True)
    if above is None and below is None:
        raise InputError("neither a lower nor an upper bound is given: above= or below= a number would be right")
    words = [f"{word} {bound:g}" for word, bound in (("above", above), ("below", below)) if bound is not None]
    label = " and ".join(words)

    def check(body: SpaceBody) -> None:
        low, high = range_of(body, problem)
        if (above is not None and above > high) or (below is not None and below < low):
            raise InputError(f"nothing of the body is {label}: its {field} reaches from {low:.4g} to {high:.4g}")

    _show(
        problem,
        path,
        look,
        lambda body: [panels.threshold(body, above, below, f"{look.name()} {label}")],
        check=check,
        rests=False,
    )


@renamed(loads="arrows")
def cutaway(
    problem: Discretisation | Result,
    path: str | os.PathLike[str],
    plane: Any = None,
    *,
    field: str = "density",
    title: str = "",
    relative: bool = False,
    smoothed: bool = False,
    magnification: float = 1.0,
    arrows: bool = True,
) -> None:
    """Draw what of a body in space lies behind a plane, with its loads; options as of `slices`.

    arrows: draw those of the loads.  plane: one of `slices`; None: that across the shortest extent.

    Example:
        >>> result = gx.solve(gx.scenes.block(2), gx.Q1P0)
        >>> gx.plots.cutaway(result, "cut.png", "coronal")
    """
    look = Look(field, title, relative, "", smoothed, magnification)
    require_flag(arrows, "arrows, of a picture,")
    problem = look.check(problem, path)
    found, pulls = plane_of(plane, problem.scene.mesh), arrows_of(problem) if arrows else []
    _show(problem, path, look, lambda body: [panels.cut_away(body, found, pulls)])


def _show(
    problem: Discretisation,
    path: str | os.PathLike[str],
    look: Look,
    drawn: Callable[[SpaceBody], list[panels.Panel]],
    *,
    columns: int = COLUMNS,
    check: Callable[[SpaceBody], None] | None = None,
    rests: bool = True,
) -> None:
    """Gather the body, and draw the panels that are made of it on rank 0 (collective).

    rests: whether what does not grow is drawn.
    """
    second = second_scale([problem], look.scale)
    body = look.body(problem)
    if check is not None:
        check(body)

    def draw() -> None:
        low, high = body.limits
        scales = [Scale(look.name(), low, high)]
        if second is not None:
            scales.append(Scale(second[0], *(second[1] * (1 + limit) for limit in (low, high))))
        panels.render(drawn(body), scales, rests and bool((~body.grows).any()), Path(path), columns)

    on_rank_0(problem, path, draw)
