"""Which states of a run are kept on its way, as options of a scene's command."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from growthx.common.errors import InputError

if TYPE_CHECKING:
    from mpi4py import MPI

    from growthx.stepping.record import Result


def add_states(parser: argparse.ArgumentParser) -> None:
    """The options."""
    parser.add_argument(
        "--every", type=int, metavar="K", help="keep the states at the start and after every K steps in --out, too"
    )
    parser.add_argument("--times", type=_times, metavar="A,B,C", help="keep the states at these times, too")
    parser.add_argument(
        "--frames",
        type=int,
        metavar="N",
        help="keep the state at the start and N at equal times to the end, for a movie",
    )
    parser.add_argument(
        "--vtkhdf", action="store_true", help="keep all states in one file, fields.vtkhdf, instead of many and a .pvd"
    )
    parser.add_argument(
        "--movie", metavar="FILE", help="draw them, with --frames or the like, as a .gif, .ogv or .mp4 at the end"
    )


def check(options: argparse.Namespace, comm: MPI.Comm) -> None:
    """Refuse, before a long run, a movie that could not be drawn (collective)."""
    if options.movie is None:
        return
    from growthx.post.movie import check_movie

    if options.out is None:
        raise InputError(f"the movie {options.movie} is of states in a folder: with --out FOLDER it would be right")
    if options.every is None and options.times is None and options.frames is None:
        raise InputError(f"the movie {options.movie} is of several states: --frames N, such as 50, would be right")
    check_movie(options.movie, comm)


def draw(options: argparse.Namespace, result: Result, unit: str) -> None:
    """Draw the movie that was asked for, if one was; unit: of the density, empty for none (collective)."""
    if options.movie is None or result.folder is None:
        return
    from growthx.cli import report
    from growthx.post.movie import movie

    movie(result.folder, options.movie, title=f"density ({unit})" if unit else "density", comm=result.problem.comm)
    if not options.json:
        report.say(result, f"the movie is {options.movie}")


def chosen(options: argparse.Namespace) -> dict[str, Any]:
    """What `solve` is to be told of them."""
    return {"every": options.every, "times": options.times, "frames": options.frames, "vtkhdf": options.vtkhdf}


def _times(text: str) -> tuple[float, ...]:
    """Times from the command line."""
    try:
        return tuple(float(part) for part in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"'{text}' are no times: numbers with commas between them would be right"
        ) from None
