"""What pictures of plane bodies and of bodies in space have in common: how they look, on which rank, their arrows."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import TYPE_CHECKING

from growthx.common.arrays import is_uniform
from growthx.common.checks import require_flag, require_kind, require_number
from growthx.common.errors import GrowthxError, InputError, OutputError, raise_on_all, shown

if TYPE_CHECKING:
    from growthx.discretisation.discretisation import Discretisation
    from growthx.model.arrows import Arrow

IMAGES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff")  # suffixes of the formats that pyvista writes
PICTURE_WIDTH = 1000  # pixels, of a picture of one body
PANEL_WIDTH = 620  # … and of one of several
TEXT_HEIGHT = 60  # pixels, above and below a body
ARROW_COLOURS = ("#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#000000")


def named(title: str, relative: bool) -> str:
    """The title that was asked for, or else what is drawn."""
    return title or ("[ρ − ρ*]/ρ*" if relative else "density")


def check_look(title: str, relative: bool, scale: str, smoothed: bool, magnification: float) -> None:
    """Refuse what says nothing of how to draw."""
    require_kind(title, str, "the title of a picture", "a text")
    require_flag(relative, "relative, of a picture,")
    require_kind(scale, str, "the title of a second scale", "a text")
    if scale and not relative:
        raise InputError(f"the second scale {scale!r} is for relative changes: with relative=True it would be right")
    require_flag(smoothed, "smoothed, of a picture,")
    require_number(magnification, "the magnification of the displacement", "a finite number", lambda _: True)


def second_scale(problems: list[Discretisation], title: str) -> tuple[str, float] | None:
    """The title, and the ρ* that all bodies have everywhere; None for no title."""
    if not title:
        return None
    found = [problem.scene.material.reference_density for problem in problems]
    for each in found:
        if not is_uniform(each) or each != found[0]:
            raise InputError(
                f"the second scale {title!r} is of densities whose ρ* are {shown(found[0])} and {shown(each)}: one "
                "number that all bodies have everywhere would be right"
            )
    return title, float(found[0])


def on_rank_0(problem: Discretisation, path: str | os.PathLike[str], draw: Callable[[], None]) -> None:
    """Draw on rank 0; an error there is one on all ranks, OutputError if the file is the reason."""
    trouble, failure = "", None
    if problem.comm.rank == 0:
        try:
            draw()
        except OSError as error:
            reason = error.strerror or str(error)
            trouble = f"the picture {path} cannot be written ({reason}): another folder would be right"
        except ImportError as error:
            trouble = (
                f"the picture {path} cannot be drawn, since a library does not import ({error}): `growthx doctor` "
                "tells which one is needed, and how it is installed"
            )
        except Exception as error:  # the other ranks must hear of it whatever it is
            failure = error
    raise_on_all(problem.comm, trouble, OutputError)
    if problem.comm.bcast(failure is not None):
        raise failure or GrowthxError(f"the picture {path} could not be drawn")


def arrows_of(problem: Discretisation) -> list[Arrow]:
    """What shows the dead loads of a body (collective)."""
    from growthx.model.arrows import Arrow

    mesh, found = problem.scene.mesh, []
    for load in problem.scene.dead_loads:
        arrow = load.arrow(mesh)
        require_kind(arrow, (Arrow, type(None)), f"the arrow of the load {load.place}", "an Arrow or None")
        if arrow is not None and arrow.size > 0:
            _check_entries(arrow, load.place, mesh.dim)
            found.append(arrow)
    return found


def _check_entries(arrow: Arrow, place: str, dim: int) -> None:
    """Refuse an arrow that has not the dimensions of the body."""
    for what, vector in (("force", arrow.force), ("place", arrow.place)):
        if len(vector) != dim:
            raise InputError(
                f"the arrow of the load {place} has {len(vector)} entries of its {what}: the mesh needs {dim}"
            )
