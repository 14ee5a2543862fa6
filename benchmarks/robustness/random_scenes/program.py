"""Which program has run a scene: rows of several are kept beside one another."""

from __future__ import annotations

from functools import cache
from hashlib import sha256
from pathlib import Path

from growthx.common.installed import PACKAGE, __version__

# What tells of rows, and changes none of them.
TELLING = {"__init__.py", "__main__.py", "page.py", "storing.py", "kept.py", "working.py", "program.py"}


@cache
def program() -> str:
    """The version, and eight digits that change with growthx and with what makes, runs and checks scenes."""
    here = Path(__file__).parent
    files = sorted(PACKAGE.rglob("*.py")) + sorted(file for file in here.glob("*.py") if file.name not in TELLING)
    digest = sha256()
    for file in files:
        digest.update(file.name.encode() + b"\0" + file.read_bytes() + b"\0")
    return f"{__version__} {digest.hexdigest()[:8]}"
