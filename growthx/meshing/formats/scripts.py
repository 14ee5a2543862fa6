"""What a script of gmsh (.geo) would do besides a mesh: it is a program, which may run others and write files.

A script is looked through before gmsh sees it, with all that it includes or merges, for what nobody needs for a mesh:
commands other than those known to be harmless, options that name files or programs, and ways to hide a command from a
reader.  A script of somebody known is trusted, and does what it likes.
"""

from __future__ import annotations

import os
import re
from dataclasses import dataclass, field
from pathlib import Path

from growthx.common.errors import InputError, shown

_TOKEN = re.compile(
    rb"""(?P<text>"[^"]*"|'[^']*')
    |(?P<comment>//[^\n]*|/\*.*?(?:\*/|\Z))
    |(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)
    |(?P<word>[A-Za-z_][A-Za-z_0-9]*)
    |(?P<sign>>>|[^\s])""",
    re.DOTALL | re.VERBOSE,
)

# What these do wherever they stand, and what the others do where a name or a text follows them.
_ALWAYS = {
    "SystemCall": "runs a program",
    "NonBlockingSystemCall": "runs a program",
    "OnelabRun": "runs a program",
    "ExternalProcess": "runs a program",
    "Plugin": "may write files",
    "StringToName": "makes a command of a text",
    "S2N": "makes a command of a text",
}
_BEFORE_NAMES = {
    "System": "runs a program",
    "Save": "writes a file",
    "Print": "writes a file",
    "CreateDir": "makes a folder",
    "SendToServer": "sends values to another program",
}
_OPENING = {"Include", "Merge", "MergeWithBoundingBox", "ShapeFromFile"}
_HARMLESS = {"SetName", "OptimizeMesh", "View", "Macro", "Function", "Call", "Hide", "Show"}  # before a text
# What gives a text where a text may stand.
_TEXTS = {
    *("Str", "StrCat", "StrPrefix", "StrRelative", "StrReplace", "StrSub", "StrChoice", "Sprintf", "UpperCase"),
    *("LowerCase", "LowerCaseIn", "GetEnv", "GetString", "GetStringValue", "GetForcedStr", "NameToString", "N2S"),
    *("NameStruct", "DirName", "AbsolutePath", "FixRelativePath", "CurrentDirectory", "CurrentDir"),
    *("CurrentFileName", "Today", "GmshExecutableName", "OnelabAction", "CodeName"),
}
_OPTIONS = {"General", "Solver", "Print", "PostProcessing", "View", "Geometry"}
_RISKY = re.compile(r"command|file|script|editor|browser|executable|watch|display|languag|session|options", re.I)
_PRINTING = {"Printf", "Warning", "Error"}
# After these gmsh goes on, or comes back, to the next line, whatever of theirs it has not read.
_JUMPS = {"For", "Macro", "Function", "Call", "Include", "Merge", "MergeWithBoundingBox"}

# gmsh reads these as data by their suffix, in small or in large letters; what has another one is a script for it.
_DATA = {
    *(".stl", ".nii", ".brep", ".rle", ".brp", ".xao", ".iges", ".igs", ".step", ".stp", ".sat", ".x_t", ".xmt_txt"),
    *(".x_b", ".xmt_bin", ".unv", ".vtk", ".wrl", ".vrml", ".iv", ".mesh", ".off", ".diff", ".med", ".mmed", ".rmed"),
    *(".bdf", ".nas", ".neu", ".dat", ".p3d", ".ply2", ".ply", ".geom", ".cgns", ".pch"),
}
_PROGRAMS = {".py", ".m", ".exe", ".gz", ".pro"}
_MESH = (b"$PTS", b"$NO", b"$PARA", b"$ELM", b"$MeshFormat", b"$Comments", b"$PostFormat", b"$View")
_LONGEST = 1000  # text or line: gmsh reads the rest of a longer one as something else


@dataclass(frozen=True)
class _Token:
    """A word, text, number or sign of a script, the lines on which it begins and ends, and how long the first is."""

    kind: str
    text: str
    line: int
    end: int
    width: int


@dataclass
class _Look:
    """One look at a script and all that it opens."""

    seen: set[Path] = field(default_factory=set)
    data: list[Path] = field(default_factory=list)


def check(path: Path, trusted: bool) -> tuple[Path, ...]:
    """Refuse a script that would do more than make a mesh, unless it is trusted; returns the data that it opens.

    Two things are refused of any script: what would end the whole program, and a last line that gmsh would skip.
    """
    content = path.read_bytes()
    if content.startswith(b"$"):
        raise InputError(f"{path} is no script but begins like a gmsh mesh: the suffix .msh would be right")
    if content.rpartition(b"\n")[2].strip():
        raise InputError(f"gmsh would skip the last line of {path}: a line break at its end would be right")
    look = _Look()
    _check(path, trusted, look)
    return tuple(look.data)


def _check(path: Path, trusted: bool, look: _Look) -> None:
    """The same of one file, and of all that it opens."""
    if path.resolve() in look.seen:
        return
    look.seen.add(path.resolve())
    content = path.read_bytes()
    tokens = _tokens(content)
    for token in tokens:
        if token.text == "Exit" and token.kind == "word":
            raise InputError(f"{path} has an Exit, with which gmsh would end the whole program: none would be right")
    if not trusted:
        _check_bytes(path, content, tokens)
        _check_jumps(path, tokens)
    tokens = [token for token in tokens if token.kind != "comment"]
    end = _Token("sign", ";", tokens[-1].end if tokens else 1, 0, 0)
    tokens += [end] * 4
    if not trusted:
        _check_commands(path, tokens)
    for number, token in enumerate(tokens[:-4]):
        if token.kind == "word" and token.text in _OPENING:
            _open(path, tokens[number : number + 4], trusted, look)
    _companion(path, trusted, look)


def _companion(path: Path, trusted: bool, look: _Look) -> None:
    """The options that gmsh reads after a file of that name."""
    options = path.with_name(f"{path.name}.opt")
    if options.is_file():
        _check(options, trusted, look)


def _tokens(content: bytes) -> list[_Token]:
    """All of a script, as gmsh parts it."""
    found = []
    line, at = 1, 0
    for match in _TOKEN.finditer(content):
        line += content.count(b"\n", at, match.start())
        at = match.start()
        more = match[0].count(b"\n")
        kind = match.lastgroup or "sign"
        width = 0
        if kind == "word" and match[0].decode() in _JUMPS:
            end = content.find(b"\n", at)
            width = (end if end >= 0 else len(content)) - content.rfind(b"\n", 0, at)
        found.append(_Token(kind, os.fsdecode(match[0]), line, line + more, width))
    return found


def _refuse(path: Path, line: int, what: str) -> InputError:
    return InputError(
        f"{path}, line {line}: {what}: trusted=True (--trusted) would let it, if you know who wrote the script"
    )


def _check_bytes(path: Path, content: bytes, tokens: list[_Token]) -> None:
    """Refuse what gmsh reads otherwise than it looks."""
    odd = re.search(rb"\0|\r(?!\n)", content)
    if odd is not None:
        line = 1 + content.count(b"\n", 0, odd.start())
        raise _refuse(path, line, "a byte that ends a text or a line for gmsh alone may hide a command")
    for token in tokens:
        if token.kind == "text" and len(token.text) > _LONGEST:
            raise _refuse(path, token.line, f"a text of more than {_LONGEST} characters may hide a command")


def _check_jumps(path: Path, tokens: list[_Token]) -> None:
    """Refuse comments and texts of several lines beside what gmsh jumps back from: to the next line, inside them."""
    last, depth, waiting = 0, 0, ""
    for number, token in enumerate(tokens):
        if token.kind in ("text", "comment") and token.end > token.line and (waiting or token.line <= last):
            raise _refuse(path, token.line, "a comment or text beside a loop, macro or call may hide a command")
        if token.width > _LONGEST:
            raise _refuse(path, token.line, f"a line of more than {_LONGEST} characters may hide a command")
        if token.kind == "comment":
            continue
        if token.kind == "word" and token.text in _JUMPS:
            waiting, depth = token.text, 0
            continue
        if not waiting:
            continue
        if token.text in "([{" and token.kind == "sign":
            depth += 1
        if token.text in ")]}" and token.kind == "sign":
            depth -= 1
        over = {"For": depth == 0 and tokens[number].text in ")]}", "Macro": True, "Function": True}
        if over.get(waiting, token.text == ";") or token.text == ";":
            last, waiting = token.end, ""


def _check_commands(path: Path, tokens: list[_Token]) -> None:
    """Refuse the words and options by which a script runs programs or writes files."""
    depth = 0
    for number, token in enumerate(tokens[:-4]):
        if token.kind == "sign":
            if token.text in "([{":
                depth += 1
            elif token.text in ")]}":
                depth = max(0, depth - 1)
            elif token.text == ";":  # after a mistake gmsh goes on here, whatever is open
                depth = 0
            elif token.text == "." and number:
                _check_option(path, tokens, number)
            continue
        if token.kind != "word":
            continue
        if token.text in _ALWAYS:
            raise _refuse(path, token.line, f"{token.text} {_ALWAYS[token.text]}")
        after = tokens[number + 1]
        if token.text in _BEFORE_NAMES and after.kind in ("word", "text"):
            raise _refuse(path, token.line, f"{token.text} {_BEFORE_NAMES[token.text]}")
        is_text = after.kind == "text" or (after.kind == "word" and after.text in _TEXTS)
        if depth == 0 and is_text and token.text not in _HARMLESS | _OPENING | _TEXTS:
            raise _refuse(path, token.line, f"{token.text} is a command that is not known to be harmless")
        if token.text in _PRINTING:
            _check_printing(path, tokens, number)


def _check_printing(path: Path, tokens: list[_Token], number: int) -> None:
    """Refuse what prints into a file; number: of the command among the tokens."""
    depth = 0
    for place in range(number + 1, len(tokens) - 1):
        token, after = tokens[place], tokens[place + 1]
        if token.text == ";" or token.text in _PRINTING:  # these end it, if only as a mistake
            return
        if token.kind != "sign":
            continue
        depth += (token.text in "([{") - (token.text in ")]}")  # gmsh lets a ] end what a ( began
        if depth <= 0 and after.text in (">", ">>") and after.kind == "sign":
            raise _refuse(path, tokens[number].line, f"{tokens[number].text} writes a file")


def _check_option(path: Path, tokens: list[_Token], number: int) -> None:
    """Refuse to set an option that names a file or a program; number: of the point before its name."""
    group, _, name, *after = tokens[number - 1 : number + 4]
    if name.kind != "word" or not (after[0].text == "=" or (after[0].text in "+-*/" and after[1].text in "=+-")):
        return
    risky = _RISKY.search(name.text)
    if group.text == "]":  # of one of several views or fields: these read files, and may
        risky = risky if risky and risky[0].lower() == "command" else None
    elif group.text not in _OPTIONS:
        return
    if risky or group.text == "Solver":
        what = name.text if group.text == "]" else f"{group.text}.{name.text}"
        raise _refuse(path, name.line, f"{what} names a file or a program")


def _open(path: Path, tokens: list[_Token], trusted: bool, look: _Look) -> None:
    """Look at the file that a command opens, too; tokens: the command and what follows it."""
    command, *after = tokens
    if after[0].text == "(" and command.text == "ShapeFromFile":
        after = after[1:]
    if after[0].kind == "sign" and after[0].text != "(":  # a variable of that name, or nothing that gmsh would take
        return
    if after[0].kind != "text" or after[1].text not in (";", ")"):
        if trusted:
            return
        raise _refuse(path, command.line, f"{command.text} opens a file whose name the script makes up")
    file = path.parent / after[0].text[1:-1]
    if not file.is_file():
        return
    suffix = file.suffix if file.suffix in (file.suffix.lower(), file.suffix.upper()) else ""
    if command.text != "Include":
        with file.open("rb") as opened:
            is_mesh = opened.read(20).startswith(_MESH)
        if command.text == "ShapeFromFile" or suffix.lower() in _DATA or is_mesh:
            look.data.append(file)
            return _companion(file, trusted, look)
        if file.suffix.lower() in _PROGRAMS and not trusted:
            raise _refuse(path, command.line, f"{command.text} of {shown(file.name)} may run a program")
    return _check(file, trusted, look)
