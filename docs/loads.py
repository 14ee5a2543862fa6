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
        "PointForce": "point",
        "LineForce": "muscle",
        "Moment": "bent",
        "Rotation": "turned",
        "Foundation": "bed",
        "Table": "walked",
    }
    problems = {title: found[name].problem for title, name in shown.items()}
    found["gx"].plots.densities(problems, HERE / "loads.png", columns=3)


if __name__ == "__main__":
    main()
