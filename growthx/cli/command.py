"""What a command and a scene say of themselves on the command line, and options that several have."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any

from growthx.cli.changes.laws import Default
from growthx.cli.machine.ranks import first_rank

if TYPE_CHECKING:
    from growthx.constitutive.elastic.base import ByModuli
    from growthx.model.scene import Scene
    from growthx.stepping.record import Result


SHAPE = "shape of the cells: quadrilateral or triangle"


@dataclass(frozen=True)
class Command:
    """A word after `growthx`.

    arguments: puts its options into a parser.  run: does what they ask for, on all ranks, and returns the exit status.
    """

    name: str
    help: str
    arguments: Callable[[argparse.ArgumentParser], None]
    run: Callable[[argparse.Namespace], int]


@dataclass(frozen=True)
class SceneCommand:
    """A scene on the command line.

    build: the scene from the arguments.  read: what is read off the result for the JSON object, on all ranks.
    show: tables for people.  drawn_in: unit of the density in its picture.
    graph: what draws the density as a graph, of a result, a path and whether it is relative; None: the body is drawn.
    by_gmsh: whether its mesh is gmsh's, which is imported before the clock starts.
    in_space: whether its body is, which a picture may show in several ways.
    """

    name: str
    help: str
    arguments: Callable[[argparse.ArgumentParser], None]
    build: Callable[[argparse.Namespace], Scene]
    read: Callable[[Result], Mapping[str, Any]]
    show: Callable[[Result, Mapping[str, Any]], None]
    drawn_in: str = ""
    graph: Callable[[Result, str, bool], None] | None = None
    by_gmsh: bool = True
    in_space: bool = False


def add_exponents(parser: argparse.ArgumentParser) -> None:
    """The options n and m."""
    add_option(parser, "--n", Default(2.0), float, "exponent n: Ψ₀ = [ρ/ρ*]ⁿ Ψ₀ⁿᵉᵒ")
    add_option(parser, "--m", Default(3.0), float, "exponent m: R₀ = c { [ρ/ρ*]^(−m) Ψ₀ − Ψ₀* }; well posed for m > n")


def add_energy(parser: argparse.ArgumentParser) -> None:
    """The option of a stored energy."""
    parser.add_argument(
        "--energy",
        metavar="NAME",
        help="stored energy: neo-hooke, saint-venant-kirchhoff, hencky, mooney-rivlin, ogden or linear, of the scene's "
        "Young's modulus and Poisson's ratio (neo-hooke)",
    )


def add_plane(parser: argparse.ArgumentParser) -> None:
    """The option of plane stress."""
    parser.add_argument(
        "--plane",
        metavar="NAME",
        help="strain, without a change of thickness, or stress, with none across the plane (strain)",
    )


def with_energy(scene: Scene, kind: type[ByModuli]) -> Scene:
    """The scene with another stored energy, of the same parameters."""
    material = scene.material
    return replace(scene, material=kind(**{part.name: getattr(material, part.name) for part in fields(material)}))


def add_option(parser: argparse.ArgumentParser, name: str, default: Any, kind: type, text: str) -> None:
    """An option with its default, which the help tells."""
    parser.add_argument(name, default=default, type=kind, metavar=name.strip("-").upper(), help=f"{text} ({default})")


def add_former(parser: argparse.ArgumentParser, **names: str) -> None:
    """Old names of options that the parser has, as old="new": still understood, with a line on stderr."""
    for old, new in names.items():
        (option,) = (action for action in parser._actions if f"--{new}" in action.option_strings)
        parser.add_argument(
            f"--{old}", dest=option.dest, action=_Former, now=option, default=argparse.SUPPRESS, help=argparse.SUPPRESS
        )


class _Former(argparse.Action):
    """An option by its old name, which does what that of the new one does."""

    def __init__(self, option_strings: Sequence[str], dest: str, now: argparse.Action, **hidden: Any) -> None:
        kind: Any = now.type
        super().__init__(option_strings, dest, nargs=now.nargs, type=kind, **hidden)
        self.now = now

    def __call__(
        self, parser: argparse.ArgumentParser, namespace: argparse.Namespace, values: Any, option: str | None = None
    ) -> None:
        if first_rank():
            new = self.now.option_strings[0]
            print(f"growthx: {option} is called {new} now, and the old name will go", file=sys.stderr)
        self.now(parser, namespace, values, option)


def add_trusted(parser: argparse.ArgumentParser) -> None:
    """The option that trusts a script."""
    parser.add_argument(
        "--trusted", action="store_true", help="let a gmsh script run programs and write files: if you know its author"
    )
    add_former(parser, trust="trusted")
