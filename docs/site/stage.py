"""Sources of the site in one folder: the repository's pages at their own places, and the pages that are made."""

from __future__ import annotations

import argparse
import inspect
import os
import re
import shutil
import textwrap
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import growthx
from docs.site import contents, cost, errors, prose
from docs.site.contents import ROOT

WIDTH = 78  # characters of code that a page shows without scrolling
LINK = re.compile(r"(?P<text>\[[^\]]*\])\((?P<target>[^)\s#]+)(?P<anchor>#[^)\s]*)?\)")


def stage(folder: Path) -> None:
    """Fill a folder with all sources: pages, what they show, tutorials as notebooks, pages of the API and commands."""
    for name in contents.PROJECT:
        _page(ROOT / f"{name}.md", folder)
    tour = folder / "README.md"
    tour.write_text(tour.read_text(encoding="utf-8").replace("# growthx", "# A tour", 1), encoding="utf-8")
    for name in contents.EXPLANATIONS:
        _page(ROOT / "docs" / f"{name}.md", folder)
    for name in contents.HOWTOS:
        _page(ROOT / "docs" / "howto" / f"{name}.md", folder)
    for name in contents.RESULTS:
        _page(ROOT / "benchmarks" / "results" / f"{name}.md", folder)
    for name in contents.OWN:
        shutil.copy(contents.HERE / f"{name}.md", folder)
    _tutorials(folder / "tutorials")
    _write(folder / "api", dict(_api()))
    _write(folder, {"commands.md": _commands(), "messages.md": errors.page()})


def _page(page: Path, folder: Path) -> None:
    """A page at its place in the repository, with the pictures it shows; links to code become its name alone."""
    here = folder / page.relative_to(ROOT)
    here.parent.mkdir(parents=True, exist_ok=True)

    def linked(found: re.Match[str]) -> str:
        target = found["target"]
        file = Path(os.path.normpath(page.parent / target))
        if "://" in target or file.suffix == ".md":
            return found[0]
        if file.parent == ROOT / "docs" / "tutorials":
            notebook = folder / "tutorials" / f"{file.stem}.ipynb"
            return f"{found['text']}({os.path.relpath(notebook, here.parent)})"
        if file.is_dir() or file.suffix == ".py":
            return found["text"][1:-1]
        copy = folder / file.relative_to(ROOT)
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(file, copy)
        return found[0]

    here.write_text(LINK.sub(linked, page.read_text(encoding="utf-8")), encoding="utf-8")


def _tutorials(folder: Path) -> None:
    """Each as a notebook, which tells at its end what it took, and as the script that it is."""
    import jupytext
    from nbformat.v4 import new_code_cell

    folder.mkdir()
    for name in contents.TUTORIALS:
        script = ROOT / "docs" / "tutorials" / f"{name}.py"
        notebook = jupytext.read(script)
        notebook.metadata["kernelspec"] = {"name": "python3", "display_name": "Python 3", "language": "python"}
        notebook.cells.append(new_code_cell(cost.CELL, metadata={"tags": ["remove-input"]}))
        jupytext.write(notebook, folder / f"{name}.ipynb")
        shutil.copy(script, folder)


def offer(folder: Path) -> None:
    """In a site that is built, the notebooks to be downloaded: without the cell that measures."""
    import jupytext

    for name in contents.TUTORIALS:
        notebook = jupytext.read(folder / "_sources" / "tutorials" / f"{name}.ipynb")
        if notebook.cells[-1].source.strip() == cost.CELL.strip():
            del notebook.cells[-1]
            jupytext.write(notebook, folder / "_sources" / "tutorials" / f"{name}.ipynb")


def _write(folder: Path, pages: dict[str, str]) -> None:
    folder.mkdir(exist_ok=True)
    for name, text in pages.items():
        (folder / name).write_text(text, encoding="utf-8")


def _api() -> Iterator[tuple[str, str]]:
    """Pages of public names, by file."""
    for group in contents.GROUPS:
        yield f"{group.page}.rst", _names(group.title, "", contents.names_of(group))
    for module in sorted(growthx._MODULES):
        names = [f"{module}.{name}" for name in contents.members_of(module)]
        yield f"of_{module}.rst", _names(f"gx.{module}", inspect.getdoc(contents.found(module)) or "", names)


def _names(title: str, purpose: str, names: list[str]) -> str:
    told = [title, "=" * len(title), "", *prose.as_text(purpose.splitlines(), ())]
    for name in names:
        told += [*_name(name, contents.found(name)), ""]
    return "\n".join(told) + "\n"


def _name(name: str, value: Any) -> list[str]:
    if inspect.isclass(value):
        shown = ["   :show-inheritance:"] if contents.public_bases(value.__bases__) else []
        return [f".. autoclass:: growthx.{name}", *shown]
    if inspect.isroutine(value):
        return [f".. autofunction:: growthx.{name}"]
    if contents.is_module(value):
        text = (inspect.getdoc(value) or "").partition("\n")[0]
    else:
        text = ", ".join(map(str, value)) if isinstance(value, dict | tuple | set) else str(value)
    text = re.sub(" at 0x[0-9a-f]+", "", text)
    return [f".. py:data:: growthx.{name}", "", *(f"   {line}" for line in prose.as_text([text], ()))]


def _commands() -> str:
    """What `growthx COMMAND --help` tells, for every command, in lines that fit the page; what all end with, once."""
    from growthx.cli.program import _parser

    parser = _parser()
    parser.epilog = textwrap.fill(parser.epilog or "", WIDTH)
    (words,) = (each for each in parser._actions if isinstance(each, argparse._SubParsersAction))
    told = ["# Commands", "", "Each command's own help; [exit statuses](exit_statuses.md) have a page.", ""]
    for title, each in {"growthx": parser, **{f"growthx {name}": own for name, own in words.choices.items()}}.items():
        if each is not parser:
            each.epilog = None
        each.formatter_class = partial(argparse.RawDescriptionHelpFormatter, width=WIDTH)
        told += [f"## {title}", "", "```text", each.format_help().rstrip(), "```", ""]
    return "\n".join(told)
