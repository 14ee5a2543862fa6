"""How-to pages: what they show runs, in the order of the page, in an empty folder."""

import re
import shlex
import subprocess
import sys

import pytest

from docs.site import contents

BLOCK = re.compile(r"^( *)```(python|sh)\n(.*?)^ *```", re.MULTILINE | re.DOTALL)


def blocks(name):
    """Language and text of each block, without the indentation of a list."""
    text = (contents.ROOT / "docs" / "howto" / f"{name}.md").read_text(encoding="utf-8")
    return [
        (language, "\n".join(line.removeprefix(indent) for line in code.splitlines()))
        for indent, language, code in BLOCK.findall(text)
    ]


@pytest.mark.serial
@pytest.mark.parametrize("name", contents.HOWTOS)
def test_what_a_page_shows_runs(name, tmp_path, monkeypatch):
    """Scripts as one, since later blocks of a page go on with what earlier ones have made; commands as they stand."""
    monkeypatch.chdir(tmp_path)
    found, known = blocks(name), {}
    assert found
    for language, text in found:
        if language == "python":
            exec(compile(text, f"{name}.md", "exec"), known)
            continue
        for line in text.splitlines():
            words = [sys.executable + " -m growthx" if word == "growthx" else word for word in shlex.split(line)]
            command = [part for word in words for part in word.split(" ")]
            run = subprocess.run(command, capture_output=True, text=True, timeout=300)
            assert (run.returncode, run.stderr) == (0, ""), line


@pytest.mark.parametrize("name", contents.HOWTOS)
def test_a_page_is_short(name):
    """One task, one screen or two: what is longer is an explanation, and has its place there."""
    text = (contents.ROOT / "docs" / "howto" / f"{name}.md").read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 60 and max(map(len, text.splitlines())) <= 125
