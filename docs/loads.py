"""Draws docs/loads.png: the strip of docs/loads.md under loads of each kind."""

import re
from pathlib import Path

HERE = Path(__file__).parent
SCRIPTS = re.findall(r"```python\n(.*?)```", (HERE / "loads.md").read_text(encoding="utf-8"), re.DOTALL)


def main() -> None:
    """Run the page's scripts and draw what they leave."""
    found: dict = {}
    for script in SCRIPTS:
        exec(script, found)
    shown = {
        "a force at a corner": "point",
        "a muscle along the upper side": "muscle",
        "a moment on the right": "bent",
        "the right end turned": "turned",
        "pressed on a foundation": "bed",
        "loads that follow histories": "walked",
    }
    problems = {title: found[name].problem for title, name in shown.items()}
    found["gx"].plots.densities(problems, HERE / "loads.png", columns=3)


if __name__ == "__main__":
    main()
