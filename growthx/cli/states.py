"""Which states of a run are kept on its way, as options of a scene's command."""

from __future__ import annotations

import argparse
from typing import Any


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
