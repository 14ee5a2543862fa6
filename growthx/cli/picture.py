"""The picture of a scene's density, as options of its command."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from growthx.common.errors import InputError

if TYPE_CHECKING:
    from growthx.cli.command import SceneCommand
    from growthx.meshing.mesh import Mesh
    from growthx.stepping.record import Result

VIEWS = ("slice", "above", "cutaway")  # of bodies in space, one for a picture


def add_picture(parser: argparse.ArgumentParser, scene: SceneCommand) -> None:
    """The options of a picture of a scene."""
    drawn = "draw the density at the end on the deformed shape"
    if scene.graph is not None:
        drawn = "plot the density at the end along the body, which is too thin to be drawn"
    elif scene.in_space:
        drawn += ": the outside and the middle slice"
    parser.add_argument("--picture", metavar="FILE", help=drawn)
    relative = "with --picture, show [ρ − ρ*]/ρ*, as the paper does"
    parser.add_argument(
        "--relative", action="store_true", help=relative if scene.graph else f"{relative}; a scale has ρ, too"
    )
    if scene.in_space:
        _add_views(parser)


def _add_views(parser: argparse.ArgumentParser) -> None:
    """The options of a picture of a body in space."""
    parser.add_argument(
        "--slice",
        action="append",
        metavar="PLANE",
        help="with --picture, draw slices, one for each --slice: coronal, axial, sagittal, or a point and a normal as "
        "X,Y,Z,NX,NY,NZ (after an equals sign, where it begins with a minus)",
    )
    parser.add_argument("--grey", action="store_true", help="with --slice, each in grey beside it, as a CT shows bone")
    parser.add_argument("--above", type=float, metavar="RHO", help="with --picture, draw what is denser than this")
    parser.add_argument(
        "--cutaway", action="store_true", help="with --picture, draw the half behind the middle, with the loads"
    )


def check(options: argparse.Namespace, mesh: Mesh, scene: SceneCommand) -> None:
    """Refuse, before a long run, a picture that could not be drawn as asked for (collective)."""
    from growthx.common.checks import check_picture
    from growthx.post.drawing import IMAGES
    from growthx.post.plots import GRAPHS

    views = _views(options)
    if options.picture is None:
        for name in ("relative", *views, *(["grey"] if _value(options, "grey") else [])):
            if _value(options, name):
                raise InputError(f"--{name} is of a picture, and none is asked for: with --picture FILE would be right")
        return
    formats, by = (GRAPHS, "matplotlib") if scene.graph else (IMAGES, "pyvista")
    check_picture(options.picture, formats, mesh.comm, by=by)
    if len(views) > 1:
        raise InputError(f"--{' and --'.join(views)} are two pictures: one of them for each run would be right")
    if _value(options, "grey") and views != ["slice"]:
        raise InputError("--grey is of slices, and none is asked for: with --slice PLANE would be right")
    if views and mesh.dim != 3:
        raise InputError(f"--{views[0]} is of a body in space, and this one is plane: --picture alone would be right")
    if "above" in views and options.relative:
        raise InputError("--relative is no density to be above: --above or --relative alone would be right")
    if "slice" in views:
        from growthx.post.space.planes import plane_of

        for text in options.slice:
            plane_of(_plane(text), mesh)


def draw(options: argparse.Namespace, result: Result, scene: SceneCommand) -> None:
    """Draw what was asked for, if anything was (collective)."""
    from growthx.cli import report
    from growthx.post import plots

    if options.picture is None:
        return
    problem, path, views = result.problem, options.picture, _views(options)
    title = f"density ({scene.drawn_in})" if scene.drawn_in else "density"
    look: dict[str, Any] = {"relative": True} if options.relative else {"title": title}
    if scene.graph is not None:
        scene.graph(result, path, options.relative)
    elif "slice" in views:
        plots.slices(problem, path, [_plane(text) for text in options.slice], grey=options.grey, **look)
    elif "above" in views:
        plots.threshold(problem, path, options.above, title=title)
    elif "cutaway" in views:
        plots.cutaway(problem, path, **look)
    else:
        plots.density(problem, path, **(look | {"scale": title} if options.relative else look))
    if not options.json:
        report.say(result, f"the picture is {path}")


def _views(options: argparse.Namespace) -> list[str]:
    """The names of the views of a body in space that are asked for."""
    return [name for name in VIEWS if _value(options, name) not in (None, False)]


def _value(options: argparse.Namespace, name: str) -> Any:
    return getattr(options, name, None)  # commands of plane scenes do not have it


def _plane(text: str) -> Any:
    """The plane of a --slice: its name, or its point and normal."""
    if "," not in text:
        return text
    try:
        numbers = tuple(float(number) for number in text.split(","))
    except ValueError:
        numbers = ()
    if len(numbers) != 6:
        raise InputError(f"--slice {text} is no plane: six numbers with commas, a point and a normal, would be right")
    return numbers[:3], numbers[3:]
