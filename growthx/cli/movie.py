"""A movie of the states that a run has left, on the command line."""

from __future__ import annotations

import argparse

from growthx.cli.command import Command, add_option


def _arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("folder", metavar="FOLDER", help="of a run with --out and --every, --times or --frames")
    parser.add_argument(
        "--movie",
        metavar="FILE",
        help="a .gif, .ogv or, where imageio has ffmpeg, .mp4 (FOLDER.gif, beside the folder)",
    )
    add_option(parser, "--field", "density", str, "what is drawn, of the fields in the files")
    add_option(parser, "--per-second", 8.0, float, "states shown in a second")
    add_option(parser, "--magnification", 1.0, float, "of the displacement")
    parser.add_argument("--title", default="", help="of the colours, with a unit (the field)")


def _run(options: argparse.Namespace) -> int:
    from mpi4py import MPI

    from growthx.post.movie import movie

    of_it = {name: getattr(options, name) for name in ("field", "title", "per_second", "magnification")}
    file = movie(options.folder, options.movie, **of_it)
    if MPI.COMM_WORLD.rank == 0:
        print(f"the movie is {file}")
    return 0


MOVIE = Command("movie", "a movie of the states that a run has left", _arguments, _run)
