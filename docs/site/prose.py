"""Docstrings, which are prose with `code` and lines of "name: meaning", as reStructuredText."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterable

ENTRY = re.compile(r"(?P<names>[A-Za-z_]\w*(?:, (?:and )?[A-Za-z_]\w*)*): (?P<text>.*)")
NEXT = re.compile(r"(?<=[.;)])  +(?=[a-z_]\w*(?:, [a-z_]\w*)*: )")
SPECIAL = re.compile(r"([\\*|_])")


def as_text(lines: Iterable[str], known: Iterable[str]) -> list[str]:
    """A docstring's lines; what is `known` among public names, and stands between backticks, becomes a link."""
    public, text = set(known), "\n".join(lines).expandtabs().strip("\n")
    blocks = [block for block in re.split(r"\n\s*\n", text) if block.strip()]
    return [line for block in blocks for line in (*_block(block, public), "")]


def _block(block: str, known: set[str]) -> list[str]:
    lines = block.splitlines()
    shown = next((at for at, line in enumerate(lines) if line.lstrip().startswith(">>>")), len(lines))
    words, example = lines[:shown], textwrap.dedent("\n".join(lines[shown:])).splitlines()
    told = _words(words, known) if words else []
    return [*told, *([""] if told and example else []), *_code_block("pycon", example)]


def _code_block(language: str, lines: list[str]) -> list[str]:
    return [f".. code-block:: {language}", "", *(f"    {line}" for line in lines)] if lines else []


def _words(lines: list[str], known: set[str]) -> list[str]:
    if all(line.startswith(" ") for line in lines):
        return _code_block("text", textwrap.dedent("\n".join(lines)).splitlines())
    pieces = [piece for line in lines for piece in NEXT.split(line)]
    parts: list[tuple[str, list[str]]] = [("", [])]
    for piece in pieces:
        entry = ENTRY.match(piece)
        if entry:
            parts.append((entry["names"], [entry["text"]]))
        elif piece.startswith("Raises ") or piece == "Example:":
            parts.append(("", [piece]))
        else:
            parts[-1][1].append(piece.strip())
    told: list[str] = []
    for names, words in parts:
        if words:
            sentence = _inline(" ".join(words), known)
            told += [f"- **{_plain(names)}**: {sentence}" if names else sentence, ""]
    return told[:-1]


def _inline(text: str, known: set[str]) -> str:
    """A paragraph in one line: nothing in it is markup but what stands between backticks."""
    parts = text.split("`")
    if len(parts) % 2 == 0:
        return _plain(text.replace("`", "'"))
    return "".join(_code(part, known) if odd % 2 else _plain(part) for odd, part in enumerate(parts))


def _plain(text: str) -> str:
    return SPECIAL.sub(r"\\\1", text)


def _code(text: str, known: set[str]) -> str:
    name = text.removeprefix("growthx.").removeprefix("gx.")
    if not text.strip():
        return ""
    if name in known:
        return f"\\ :py:obj:`{text} <growthx.{name}>`\\ "
    return f"\\ ``{text.strip()}``\\ "
