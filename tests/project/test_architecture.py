"""The page for newcomers says what is so: its table and picture are the code's, and what pages name is there."""

import importlib.util
import re
import subprocess
import sys
from pathlib import Path

import matplotlib.image
import pytest

import growthx as gx

ROOT = Path(__file__).parents[2]
PAGES = [*sorted((ROOT / "docs").glob("*.md")), ROOT / "README.md"]
REDRAW = "./run python docs/architecture.py brings it up to date"


@pytest.fixture(scope="module")
def architecture():
    """The script that draws the rooms."""
    spec = importlib.util.spec_from_file_location("architecture", ROOT / "docs" / "architecture.py")
    module = sys.modules["architecture"] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    yield module
    del sys.modules["architecture"]


def test_the_table_is_the_codes(architecture):
    """To the letter."""
    text = architecture.PAGE.read_text(encoding="utf-8")
    assert architecture.page(text) == text, REDRAW


def test_the_picture_is_the_codes(architecture):
    """It tells in its metadata what it shows."""
    from PIL import Image

    with Image.open(architecture.PICTURE) as picture:
        assert picture.text["Description"].splitlines() == architecture.drawn().splitlines(), REDRAW


def test_arrows_point_down_and_leave_out_what_follows(architecture):
    """By them, each room reaches all that it imports."""
    rooms, arrows = architecture.rooms(), architecture.arrows()
    assert {"common", "fem", "run", "cli"} <= rooms.keys()
    assert all(architecture.floor(start) > architecture.floor(end) for start, end in arrows)

    def reached(name):
        ends = {end for start, end in arrows if start == name}
        return ends.union(*map(reached, ends))

    assert all(room.knows <= reached(name) for name, room in rooms.items())
    assert len(arrows) < sum(len(room.knows) for room in rooms.values()) / 2


def test_rooms_do_not_hide_each_other(architecture):
    """Nor leave the picture, whatever rooms there will be."""
    boxes = list(architecture.boxes().values())
    for number, one in enumerate(boxes):
        assert one.x - one.width / 2 > 0 and one.x + one.width / 2 < architecture.WIDTH
        for other in boxes[:number]:
            apart = abs(one.x - other.x) > (one.width + other.width) / 2
            assert apart or one.bottom > other.top or other.bottom > one.top


def test_the_picture_can_be_drawn(architecture, tmp_path):
    """By the script, as by whoever changes a room; each rank its own, for the script knows of no others."""
    architecture.draw(tmp_path / "rooms.png")
    height, width = matplotlib.image.imread(tmp_path / "rooms.png").shape[:2]
    assert width > 1000 and height > 1000


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.name)
def test_modules_that_pages_name_exist(path):
    """Files by their place in the repository or in growthx, and public names as `gx.…`."""
    text = path.read_text(encoding="utf-8")
    for name in re.findall(r"`((?:[\w.-]+/)*\w+\.py)`", text):
        assert (ROOT / name).is_file() or (ROOT / "growthx" / name).is_file(), name
    for name in re.findall(r"`((?:[a-z]+/)+[a-z]+)`", text):
        assert (ROOT / name).exists() or (ROOT / "growthx" / name).exists(), name
    for name in set(re.findall(r"\bgx\.([\w.]+\w)", text)) - {"NAME"}:
        found = gx
        for part in name.split("."):
            found = getattr(found, part)
    for name in re.findall(r"from (growthx[\w.]*) import", text):
        importlib.import_module(name)
    assert not re.findall(r"`growthx\.\w+`", text), "a public name is gx.…"


@pytest.mark.serial
def test_the_script_leaves_what_is_up_to_date(architecture):
    """Run as it is told to be, without DOLFINx: nothing of the table changes."""
    code = (
        "import runpy, sys; found = runpy.run_path('docs/architecture.py'); "
        "print(found['table']()); assert 'dolfinx' not in sys.modules"
    )
    run = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    assert run.stdout.strip() == architecture.table()
