"""What a command and a scene say of themselves on the command line, and options that several have."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from growthx.constitutive.elastic.base import ByModuli
    from growthx.model.scene import Scene
    from growthx.stepping.record import Result


CELLS = "shape of the cells: quadrilateral or triangle"


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
    add_option(parser, "--n", 2.0, float, "exponent n: Ψ₀ = [ρ/ρ*]ⁿ Ψ₀ⁿᵉᵒ")
    add_option(parser, "--m", 3.0, float, "exponent m: R₀ = c { [ρ/ρ*]^(−m) Ψ₀ − Ψ₀* }; well posed for m > n")


def add_energy(parser: argparse.ArgumentParser) -> None:
    """The option of a stored energy."""
    parser.add_argument(
        "--energy",
        metavar="NAME",
        help="stored energy: neo-hooke, saint-venant-kirchhoff, hencky, mooney-rivlin, ogden or linear, of the scene's "
        "Young's modulus and Poisson's ratio (neo-hooke)",
    )


def with_energy(scene: Scene, kind: type[ByModuli]) -> Scene:
    """The scene with another stored energy, of the same parameters."""
    material = scene.material
    return replace(scene, material=kind(**{part.name: getattr(material, part.name) for part in fields(material)}))


def add_option(parser: argparse.ArgumentParser, name: str, default: Any, kind: type, text: str) -> None:
    """An option with its default, which the help tells."""
    parser.add_argument(name, default=default, type=kind, metavar=name.strip("-").upper(), help=f"{text} ({default})")


def add_trust(parser: argparse.ArgumentParser) -> None:
    """The option that trusts a script."""
    parser.add_argument(
        "--trust", action="store_true", help="let a gmsh script run programs and write files: if you know its author"
    )
