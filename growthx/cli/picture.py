"""The picture of a scene's density, as options of its command."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from growthx.common.errors import InputError

if TYPE_CHECKING:
    from mpi4py import MPI

    from growthx.stepping.record import Result


def add_picture(parser: argparse.ArgumentParser) -> None:
    """The options of a picture."""
    parser.add_argument("--picture", metavar="FILE", help="draw the density at the end on the deformed shape")
    parser.add_argument(
        "--relative",
        action="store_true",
        help="with --picture, draw [ρ − ρ*]/ρ*, as the paper does; a scale has ρ, too",
    )


def check(options: argparse.Namespace, comm: MPI.Comm) -> None:
    """Refuse, before a long run, a picture that could not be drawn as asked for (collective)."""
    from growthx.common.checks import check_picture
    from growthx.post.drawing import IMAGES

    if options.picture is not None:
        check_picture(options.picture, IMAGES, comm)
    elif options.relative:
        raise InputError("--relative is of a picture, and none is asked for: with --picture FILE would be right")


def draw(options: argparse.Namespace, result: Result, unit: str) -> None:
    """Draw what was asked for, if anything was; unit: of the density, empty for none (collective)."""
    from growthx.cli import report
    from growthx.post.plots import density

    if options.picture is None:
        return
    title = f"density ({unit})" if unit else "density"
    if options.relative:
        density(result.problem, options.picture, relative=True, scale=title)
    else:
        density(result.problem, options.picture, title=title)
    if not options.json:
        report.say(result, f"the picture is {options.picture}")
