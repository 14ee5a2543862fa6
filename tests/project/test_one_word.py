"""One word, one meaning, over all commands and calls: who has learnt it in one place has learnt it for all."""

import argparse
import inspect
import re
from collections import defaultdict

import pytest

import growthx as gx
from docs.site import contents
from growthx.cli.command import _Former
from growthx.cli.program import _parser

(COMMANDS,) = (each.choices for each in _parser()._actions if isinstance(each, argparse._SubParsersAction))

# Words whose argument comes in several forms of one meaning: a number or a field, the name of what is meant or itself.
ONE = {
    "above": "for densities higher than one: which one, or what holds there",
    "anatomy": "landmarks of a femur, plane or in space",
    "below": "for densities lower than one: which one, or what holds there",
    "boundaries": "parts of the boundary by name: how they are told, or their facets",
    "cells": "cells of a mesh, or shapes of cells that a variant takes",
    "comm": "the ranks",
    "density": "ρ, or how a variant knows it",
    "density_exponent": "n",
    "displacement": "u: prescribed, or how a variant knows it",
    "exact": "what a result should be",
    "extensions": "principal stretches less one",
    "field": "a derived field, or its name",
    "force": "a force, by its components or, of a scene, its size",
    "high": "an upper limit",
    "history": "share of a load through time",
    "low": "a lower limit",
    "mesh": "a mesh, or its file",
    "place": "where something is",
    "plane": "a plane, or its name",
    "points": "nodes of a mesh",
    "problem": "a scene that is discretised, or the result that has it",
    "rate": "how fast mass comes",
    "reference_density": "ρ*",
    "regions": "parts of a body by name: how they are told, or their cells",
    "result": "of a run",
    "rounding": "over how much a corner is rounded, of x or as a share of the set point",
    "rows": "of a table",
    "value": "of a load, or of a field",
    "values": "numbers, one for each of something",
    "weight": "the share of something: of a case in a day, of a place in a force",
    "weights": "shares of several",
    "x": "a number, or places",
    "young": "E",
    "zones": "zones whose means are told, or their file",
}
ONLY_IN_SCRIPTS = {"comm", "separate", "activities"}  # --combination is the command's word for `separate`
ONLY_IN_COMMANDS = {"combination"}
SCENES = {"bar": gx.scenes.bar, "femur": gx.scenes.femur, "femur3d": gx.scenes.femur3d, "plate": gx.scenes.plate}


def forms():
    """Words of all public calls, with the forms in which their arguments come."""
    found = defaultdict(set)
    for name in contents.documented() - {"__version__"}:
        value = contents.found(name)
        if not (inspect.isclass(value) or inspect.isroutine(value)):
            continue
        try:
            parameters = inspect.signature(value).parameters.values()
        except (TypeError, ValueError):
            continue
        for each in parameters:
            if each.kind not in (each.VAR_POSITIONAL, each.VAR_KEYWORD) and each.name != "self":
                found[each.name].add(plain(str(each.annotation)))
    return found


def plain(form):
    """A form without what is left out, and with one word for paths and for how a share through time is told."""
    form = re.sub(r" \| None|None \| ", "", form)
    form = re.sub(r"str \| os\.PathLike\[str\]|str \| Path|\bPath\b", "path", form)
    return form.replace("Callable[[float], float]", "History").replace("MPI.Intracomm", "MPI.Comm")


def options(name):
    """The options that a command's help shows."""
    return {
        option.removeprefix("--"): action
        for action in COMMANDS[name]._actions
        for option in action.option_strings
        if option.startswith("--") and action.help != argparse.SUPPRESS
    }


def test_a_word_has_one_meaning_in_all_calls():
    """What comes in several forms is judged by hand: a new word of that kind is given its meaning, or another name."""
    several = {word for word, found in forms().items() if len(found) > 1}
    assert several - set(ONE) == set()


def test_an_option_is_the_same_in_all_commands():
    """Of one type and one number of values: --n was cells in one and an exponent in another."""
    found = defaultdict(set)
    for name in COMMANDS:
        for option, action in options(name).items():
            found[option].add((getattr(action.type, "__name__", "text"), action.nargs))
    assert {option: kinds for option, kinds in found.items() if len(kinds) > 1 and option != "shape"} == {}


def test_old_names_are_nowhere_new():
    """But for the exponent n, whose name was also that of a number of cells."""
    old = {
        action.option_strings[0].removeprefix("--")
        for own in COMMANDS.values()
        for action in own._actions
        if isinstance(action, _Former)
    }
    shown = {option for name in COMMANDS for option in options(name)}
    assert old & shown == {"n"}


@pytest.mark.parametrize("name", SCENES)
def test_a_command_and_its_call_have_the_same_words(name):
    """What is learnt on the command line holds in a script."""
    call = {
        each.name.replace("_", "-")
        for each in inspect.signature(SCENES[name]).parameters.values()
        if each.kind is not each.VAR_KEYWORD
    }
    scripts = {word.replace("_", "-") for word in ONLY_IN_SCRIPTS} | ({"n", "m"} if name == "plate" else set())
    assert call - scripts <= set(options(name))
    common = set.intersection(*(set(options(each)) for each in ("bar", "femur", "femur3d", "plate", "weinans")))
    of_pictures = {"picture", "relative", "slice", "grey", "above", "cutaway"}
    of_script = {"head-radius", "neck-shaft-angle", "anteversion", "offset", "neck-width", "neck-height"}
    of_script |= {"shaft-width", "shaft-depth", "lean", "bow", "cut"}  # parameters of the femur's script
    of_scenes = {"plane"}  # of plane ones alone, a field of gx.Scene
    assert set(options(name)) - common - of_pictures - of_script - of_scenes - ONLY_IN_COMMANDS <= call
