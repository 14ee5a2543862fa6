"""Docstrings, which are prose with `code` and lines of "name: meaning", as reStructuredText."""

from __future__ import annotations

import re
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
    if lines[0].lstrip().startswith(">>>"):
        return lines
    if all(line.startswith(" ") for line in lines):
        return ["::", "", *(f"    {line}" for line in lines)]
    pieces = [piece for line in lines for piece in NEXT.split(line)]
    parts: list[tuple[str, list[str]]] = [("", [])]
    for piece in pieces:
        entry = ENTRY.match(piece)
        if entry:
            parts.append((entry["names"], [entry["text"]]))
        elif piece.startswith("Raises "):
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
