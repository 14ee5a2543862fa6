"""The growth law of a scene, and the exponents of its weight, as the command line asks for them."""

from __future__ import annotations

import argparse
from dataclasses import replace
from typing import TYPE_CHECKING

from growthx.common.errors import InputError, shown

if TYPE_CHECKING:
    from growthx.model.scene import Scene

LAW = (
    "growth law and values of its parameters: energy, specific-energy, strain or stress, of attractor, rate, dead_zone "
    "and, but for specific-energy, exponent; energy-remodelling, specific-energy-remodelling, strain-remodelling or "
    "daily-stress-remodelling, of set_point, formation, resorption, lazy_zone, relative_zone, most_formation, "
    "most_resorption, rounding, memory, factor (martin, martin:DENSITY or power:EXPONENT), exponent, and of the daily "
    "stress cycles, tissue_density and concentration; as --law strain attractor=0.002 rate=50 (the scene's own)"
)


class Default(float):
    """A number that nobody gave."""


def add_laws(parser: argparse.ArgumentParser) -> None:
    """The options of the growth law and of the weight."""
    parser.add_argument("--law", nargs="+", metavar=("NAME", "PARAMETER=VALUE"), help=LAW)
    parser.add_argument(
        "--exponents",
        type=float,
        nargs=4,
        metavar=("BELOW", "ABOVE", "FROM", "TO"),
        help="in place of n: the exponent below the density FROM, the one above the density TO, smooth between (n)",
    )


def check(options: argparse.Namespace) -> None:
    """Refuse what cannot be meant, before any scene is made."""
    from growthx.constitutive.laws import catalogue

    exponents = hasattr(options, "m")  # of a scene whose n and m are options
    if options.law is not None:
        name, *words = options.law
        catalogue.in_numbers(_split(words), catalogue.named(name))
        if exponents and not isinstance(options.m, Default):
            raise InputError(
                f"--m {options.m:g} is of the scene's own law: beside --law, exponent={options.m:g} after its name "
                "would be right"
            )
    if options.exponents is not None and exponents and not isinstance(options.n, Default):
        raise InputError(f"--n {options.n:g} is given beside --exponents, which say it: one of the two would be right")


def with_laws(scene: Scene, options: argparse.Namespace) -> Scene:
    """The scene with the growth law and the weight that the options ask for."""
    from growthx.constitutive.laws import catalogue
    from growthx.constitutive.weights import PiecewisePower

    if options.law is not None:
        name, *words = options.law
        kind = catalogue.named(name)
        growth = catalogue.made(kind, catalogue.in_numbers(_split(words), kind), scene.growth)
        scene = replace(scene, growth=growth)
    if options.exponents is not None:
        below, above, *between = options.exponents
        weight = PiecewisePower(below, above, (between[0], between[1]))
        scene = replace(scene, material=replace(scene.material, density_exponent=weight))
    return scene


def _split(words: list[str]) -> dict[str, str]:
    """Names and values of PARAMETER=VALUE."""
    found: dict[str, str] = {}
    for word in words:
        name, equals, value = word.partition("=")
        if name == "bounds":
            raise InputError("the bounds of density are no parameter of --law: --bounds LOW HIGH would be right")
        if not (equals and name and value):
            raise InputError(f"--law is followed by {shown(word)}: PARAMETER=VALUE would be right")
        if name in found:
            raise InputError(f"--law has two values of {name}, {found[name]} and {value}: one would be right")
        found[name] = value
    return found
