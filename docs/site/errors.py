"""All messages that growthx ends with, from its code, on one page: each has an anchor that stays with its function.

A message is known by where it is written, module and function, and by its place among those of the function.
"""

from __future__ import annotations

import ast
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from docs.site.contents import ROOT
from growthx.cli.machine import pages

KINDS = ("InputError", "EndedEarly", "OutputError", "GrowthxError", "Interrupted", "RunNotWritten", "RunEndedEarly")
ADVICE = re.compile(
    r"\b(?:would|is right|are right|is needed|are needed|needs?|must be|is due|goes on|remains|it has|which has|"
    r"may name|name one|check its|should|reads format|are one|one each|set DISPLAY|is there|"
    r"has its own|has one|draws it|draw one of|may help|tells what there is)\b"
)
ELSEWHERE = re.compile(r"(?:…|:)$")  # it ends with what another sentence says, which is on the page as well


@dataclass(frozen=True)
class Message:
    """One message.

    anchor: on the page.  module: where it is written, without "growthx.".  text: with "…" for what it quotes.
    raised: whether the error is raised on the spot, of its whole text.
    """

    anchor: str
    module: str
    text: str
    raised: bool

    @property
    def advises(self) -> bool:
        """Whether it says what to do, or hands that over to a sentence that it quotes at its end."""
        return bool(ADVICE.search(self.text) or ELSEWHERE.search(self.text))


def messages() -> list[Message]:
    """All of them, in the order of the code."""
    found: list[Message] = []
    for path in sorted((ROOT / "growthx").rglob("*.py")):
        module = ".".join(path.relative_to(ROOT / "growthx").with_suffix("").parts)
        found += _of_module(module, path)
    return found


def _of_module(module: str, path: Path) -> Iterator[Message]:
    seen: Counter[str] = Counter()
    for function, text, raised in _texts(ast.parse(path.read_text(encoding="utf-8"))):
        if raised or " would be right" in text:
            name = f"{module}.{function}" if function else module
            seen[name] += 1
            anchor = f"{name}-{seen[name]}" if seen[name] > 1 else name
            yield Message(anchor.replace("_", "-").replace(".", "-").lower(), module, text, raised)


def _texts(tree: ast.AST, function: str = "", raised: bool = False) -> Iterator[tuple[str, str, bool]]:
    """Texts of the code but docstrings: the function around each, the text, and whether it is raised as an error."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            continue  # a docstring
        if isinstance(node, ast.JoinedStr) or (isinstance(node, ast.Constant) and isinstance(node.value, str)):
            text = _as_told(node)
            if len(text.split()) > 4:
                yield function, text, raised
            continue
        inside = function
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            inside = f"{function}.{node.name}" if function else node.name
        yield from _texts(node, inside, raised or _raises(node))


def _raises(node: ast.AST) -> bool:
    call = node.exc if isinstance(node, ast.Raise) else None
    return isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id in KINDS


def _as_told(node: ast.AST) -> str:
    if isinstance(node, ast.Constant):
        return " ".join(str(node.value).split())
    assert isinstance(node, ast.JoinedStr)
    parts = (part.value if isinstance(part, ast.Constant) else "…" for part in node.values)
    return " ".join("".join(map(str, parts)).split())


def page() -> str:
    """The page, in MyST's Markdown."""
    told = [
        "# Messages",
        "",
        "Every sentence that growthx ends with, as its code has it, with … for names and values; the search of this",
        "site finds them, too. The [exit status](exit_statuses.md) tells the kind: 2 is bad input, where the sentence",
        "says what is right, 3 a run that [ended early](docs/robustness.md), 1 results that could not be written.",
        "",
        "What a program prints ends with its place, as `(growthx help model.loads.Traction tells more)`: a heading of",
        "this page, and a name below it. `growthx help` tells what is written of that, and where to read on.",
    ]
    room = module = ""
    titles = pages.titles()
    for message in messages():
        if message.module.split(".")[0] != room:
            room = message.module.split(".")[0]
            told += ["", f"## {room}"]
        if message.module != module:
            module = message.module
            more = (f"[{titles[name]}](docs/{name}.md)" for name in pages.pages_on(module))
            told += ["", f"### {module}", "", f"Read on: {', '.join(more)}.", ""]
        told.append(f'- {_plain(message.text)} <a id="{message.anchor}" href="#{message.anchor}">¶</a>')
    return "\n".join(told) + "\n"


def _plain(text: str) -> str:
    return re.sub(r"([\\`*_\[\]<>|$#])", r"\\\1", text)
