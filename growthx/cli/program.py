"""The command `growthx`: the benchmark scenes with their parameters, as tables for people or as JSON for programs."""

from __future__ import annotations

import argparse
import difflib
import re
import sys
from collections.abc import Sequence
from typing import Any, NoReturn

from growthx.cli.bar import BAR
from growthx.cli.femur import FEMUR
from growthx.cli.femur3d import FEMUR3D
from growthx.cli.implants.stem import STEM
from growthx.cli.implants.stem3d import STEM3D
from growthx.cli.machine.completion import completion, options_of
from growthx.cli.machine.doctor import DOCTOR
from growthx.cli.machine.help import help_on
from growthx.cli.machine.versions import VersionAction
from growthx.cli.mesh import MESH
from growthx.cli.movie import MOVIE
from growthx.cli.plate import PLATE, WEINANS
from growthx.cli.scene_run import of_scene
from growthx.common.errors import InputError
from growthx.common.exits import guarded

EPILOG = """\
Exit status: 0 done, 1 results could not be written, 2 bad input, 3 the run ended early (its last good state is kept in
a folder), 130, 138 and 143 it was ended by Ctrl-C, SIGUSR1 and SIGTERM (its state is kept: --resume goes on from it).
In parallel: mpirun -n 2 growthx …, which lets a run end in order after SIGUSR1 only; PETSc options under the prefix
-growthx_ go into the variable PETSC_OPTIONS.
"""


NEAR = 0.8  # likeness of two words, from 0 to 1, above which one may be meant by the other
LONGEST = 200  # characters of a word of an error: what is longer is no argument


NUMBER = re.compile(r"-(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?$")  # negative


class _Parser(argparse.ArgumentParser):
    """Bad arguments are bad input like any other, and -1e-3 is a number, which Python's parser takes for an option.

    Beginnings of options are none: --time would be --times today, and another one when there are more.
    """

    def __init__(self, *values: Any, **options: Any) -> None:
        super().__init__(*values, **{"allow_abbrev": False, **options})
        self._negative_number_matcher = NUMBER

    def error(self, message: str) -> NoReturn:
        words = (word if len(word) <= LONGEST else f"{word[:LONGEST]}…" for word in message.split(" "))
        raise InputError(f"{' '.join(words)} ({self.prog} --help tells what there is)")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit status."""
    return guarded(lambda: _main(sys.argv[1:] if arguments is None else arguments))


def _main(arguments: Sequence[str]) -> int:
    options, unknown = _parser().parse_known_args(arguments)
    if unknown:
        options.refuse(_unknown(unknown, options.known))
    status: int = options.run(options)
    return status


def _unknown(words: Sequence[str], known: Sequence[str]) -> str:
    """What is wrong about words that a command does not know, with the option that was meant, perhaps."""
    strange = (word.partition("=")[0] for word in words if word[:2] == "--" and 2 < len(word) < LONGEST)
    near = (
        [each for each in known if each.startswith(word)] or difflib.get_close_matches(word, known, 1, NEAR)
        for word in strange
    )
    meant = [f"{' or '.join(each)} {'is' if len(each) == 1 else 'are'} near" for each in near if each]
    return f"unrecognized arguments: {' '.join(words)}" + "".join(f", {each}" for each in meant)


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="growthx",
        description="Density growth of bone at finite strains (Kuhl, Menzel & Steinmann 2003).",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action=VersionAction)
    words = parser.add_subparsers(metavar="COMMAND", required=True, parser_class=_Parser)
    scenes = map(of_scene, (BAR, FEMUR, FEMUR3D, PLATE, WEINANS))
    others = (STEM, STEM3D, MESH, MOVIE, DOCTOR, completion(words.choices), help_on(words.choices))
    for command in (*scenes, *others):
        own = words.add_parser(
            command.name,
            help=command.help,
            description=command.help,
            epilog=EPILOG,
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        command.arguments(own)
        own.set_defaults(run=command.run, refuse=own.error, known=list(options_of(own)))
    return parser
