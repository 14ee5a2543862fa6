"""`growthx help`: what a command, a name of a script, a page or the place that a message tells is about."""

from __future__ import annotations

import argparse
import difflib
import importlib
import inspect
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from growthx.cli.command import Command
from growthx.cli.machine import pages
from growthx.cli.machine.ranks import first_rank
from growthx.common.errors import InputError, shown
from growthx.common.installed import PACKAGE


def help_on(words: Mapping[str, argparse.ArgumentParser]) -> Command:
    """The command that explains; words: the commands, filled with their parsers later on."""

    def arguments(parser: argparse.ArgumentParser) -> None:
        parser.add_argument(
            "topic",
            metavar="TOPIC",
            nargs="?",
            help="a command (femur), a name of scripts (Scene, ct.read), a page (robustness), or what a message ends "
            "with (model.loads.Traction); without one: what there is",
        )

    def run(options: argparse.Namespace) -> int:
        told = _told(options.topic, words) if options.topic is not None else _overview(words)
        if first_rank():
            print("\n".join(told))
        return 0

    return Command("help", "what a command, a name, a page or a message is about", arguments, run)


def _overview(words: Mapping[str, argparse.ArgumentParser]) -> list[str]:
    import growthx

    listed = pages.titles()
    told = ["growthx help TOPIC, where the topic is", f"  a command: {', '.join(words)}"]
    told += [f"  a name of scripts: {', '.join(name for name in dir(growthx) if not name.startswith('_'))}"]
    told += ["  what a message ends with, as model.loads.Traction"]
    return told + (["  a page:", *(f"    {name}: {title}" for name, title in listed.items())] if listed else [])


def _told(topic: str, words: Mapping[str, argparse.ArgumentParser]) -> list[str]:
    """What there is to tell about a topic; InputError for what is none, with those that are near."""
    if topic in words:
        return [words[topic].format_help().rstrip()]
    for value, home in filter(None, (_public(topic), _place(topic))):
        return [*_docstring(topic, value), "", *_read_on(home)]
    if topic in pages.titles():
        return [_page(topic).read_text(encoding="utf-8").rstrip()]
    import growthx

    known = [*words, *dir(growthx), *pages.titles()]
    near = difflib.get_close_matches(topic, known, 3)
    right = " or ".join(near) if near else "one of those that `growthx help` lists"
    raise InputError(f"there is no help on {shown(topic)}: {right} would be right")


def _public(topic: str) -> tuple[Any, str] | None:
    """A public name's value and the module it lives in."""
    import growthx

    value: Any = growthx
    for part in topic.removeprefix("gx.").removeprefix("growthx.").split("."):
        if part.startswith("_") or not (value is not growthx or part in dir(growthx)):
            return None
        try:
            value = getattr(value, part)
        except AttributeError:
            return None
    home = value.__name__ if inspect.ismodule(value) else getattr(value, "__module__", type(value).__module__)
    return value, str(home).removeprefix("growthx.")


def _place(topic: str) -> tuple[Any, str] | None:
    """What a message's place names, and its module."""
    parts = topic.split(".")
    if not all(part.isidentifier() and part[0] != "_" for part in parts):
        return None
    for count in range(len(parts), 0, -1):
        file = PACKAGE.joinpath(*parts[:count])
        if not (file.with_suffix(".py").is_file() or (file / "__init__.py").is_file()):
            continue
        module = ".".join(parts[:count])
        value: Any = importlib.import_module(f"growthx.{module}")
        for part in parts[count:]:
            value = getattr(value, part, None)
        return None if value is None else (value, module)
    return None


def _docstring(topic: str, value: Any) -> list[str]:
    """The topic with its call, and what is written of it."""
    try:
        call = re.sub(r"'| at 0x[0-9a-f]+", "", str(inspect.signature(value))) if callable(value) else ""
    except (TypeError, ValueError):
        call = ""
    return [f"{topic}{call}", "", *(inspect.getdoc(value) or "").splitlines()]


def _read_on(module: str) -> list[str]:
    known = pages.titles()
    names = pages.pages_on(module)
    if not known:
        return [f"More in the documentation: {', '.join(f'docs/{name}.md' for name in names)}"]
    return ["More:", *(f"  growthx help {name}: {known[name]} ({_page(name)})" for name in names)]


def _page(name: str) -> Path:
    here = pages.folder()
    assert here is not None, "only where there are pages are there names of theirs"
    return here / f"{name}.md"
