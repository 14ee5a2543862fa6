"""Writes growthx/__init__.pyi, from which editors and mypy know what the public names are.

./run python docs/public_types.py
"""

from __future__ import annotations

from pathlib import Path

import growthx

STUB = Path(growthx.__file__).with_suffix(".pyi")


def text() -> str:
    """The file, from the tables in growthx/__init__.py."""
    names = [f"from growthx.{home} import {name} as {name}" for name, home in growthx._HOME.items()]
    for name, home in growthx._MODULES.items():
        room, _, module = home.rpartition(".")
        names.append(f"from growthx{'.' * bool(room)}{room} import {module} as {name}")
    return "\n".join(("# Made by docs/public_types.py from __init__.py.", *sorted(names), "", "__version__: str", ""))


if __name__ == "__main__":
    STUB.write_text(text(), encoding="utf-8")
