"""Growth laws by their names, as the command line has them, made of parameters in words."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, fields
from typing import Any

from growthx.common.errors import InputError, shown
from growthx.constitutive.growth import (
    EnergyDrivenGrowth,
    SpecificEnergyDrivenGrowth,
    StrainDrivenGrowth,
    StressDrivenGrowth,
)
from growthx.constitutive.laws.rates import MartinSurface, PowerOfDensity, RateFactor
from growthx.constitutive.laws.stimuli import (
    DailyStressRemodelling,
    EnergyRemodelling,
    SpecificEnergyRemodelling,
    StrainRemodelling,
)
from growthx.constitutive.sources import MassSource

NAMED: dict[str, type[MassSource]] = {
    "energy": EnergyDrivenGrowth,
    "specific-energy": SpecificEnergyDrivenGrowth,
    "strain": StrainDrivenGrowth,
    "stress": StressDrivenGrowth,
    "energy-remodelling": EnergyRemodelling,
    "specific-energy-remodelling": SpecificEnergyRemodelling,
    "strain-remodelling": StrainRemodelling,
    "daily-stress-remodelling": DailyStressRemodelling,
}
FACTORS: dict[str, type[RateFactor]] = {"martin": MartinSurface, "power": PowerOfDensity}


def named(name: str) -> type[MassSource]:
    """The law of a name; InputError, with the names there are, if there is none."""
    if name not in NAMED:
        raise InputError(f"there is no growth law {shown(name)}: one of {', '.join(NAMED)} would be right")
    return NAMED[name]


def parameters(kind: type[MassSource]) -> tuple[str, ...]:
    """The names of a law's parameters, but for the bounds of the density, which are the scene's."""
    return tuple(part.name for part in fields(kind) if part.name != "bounds")


def in_numbers(words: Mapping[str, str], kind: type[MassSource]) -> dict[str, Any]:
    """Values of a law's parameters, of words; InputError for a name that it has not, and for what is no value of it."""
    for word in words:
        if word not in parameters(kind):
            raise InputError(
                f"the growth law {_name(kind)} has no parameter {shown(word)}: one of {', '.join(parameters(kind))} "
                "would be right"
            )
    return {word: _factor(text) if word == "factor" else _number(word, text) for word, text in words.items()}


def made(kind: type[MassSource], values: Mapping[str, Any], own: MassSource) -> MassSource:
    """A law with some parameters; the others are those of a scene's own law if it is of the kind, or the defaults.

    Bounds of the density stay as the scene has them.  InputError for a parameter that has no value then.
    """
    given = dict(values)
    if type(own) is kind:
        given = {**{name: getattr(own, name) for name in parameters(kind)}, **given}
    for part in fields(kind):
        if part.name not in given and part.default is MISSING and part.default_factory is MISSING:
            raise InputError(
                f"the growth law {_name(kind)} has no {part.name}, in the unit of its stimulus: {part.name}=NUMBER "
                "would be right"
            )
    return kind(**given, bounds=own.bounds)


def _name(kind: type[MassSource]) -> str:
    return next(name for name, other in NAMED.items() if other is kind)


def _number(word: str, text: str) -> float | None:
    """A number, or None for 'none'."""
    try:
        return None if text == "none" else float(text)
    except ValueError:
        raise InputError(
            f"{word} is {shown(text)}: a number, or 'none' where there may be none, would be right"
        ) from None


def _factor(text: str) -> RateFactor | None:
    """What the rate takes from the density: none, martin, martin:ρₜ or power:q."""
    if text == "none":
        return None
    name, _, number = text.partition(":")
    if name not in FACTORS:
        raise InputError(f"factor is {shown(text)}: martin, martin:DENSITY, power:EXPONENT or none would be right")
    values = [] if not number else [_number("factor", number)]
    return FACTORS[name](*values)
