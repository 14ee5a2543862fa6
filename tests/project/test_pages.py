"""The benchmarks' pages are what their scripts write from the numbers that are kept beside them: nothing by hand."""

import importlib
import re
from pathlib import Path

import pytest

from benchmarks.catalogue import CATALOGUE

ROOT = Path(__file__).parents[2]
RESULTS = ROOT / "benchmarks" / "results"

PAGES = {Path(each.page).stem: each for each in CATALOGUE}
TEXTS = {
    path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8")
    for folder in (ROOT, ROOT / "docs", RESULTS)
    for path in sorted(folder.glob("*.md"))
}
PROGRAMS = {
    path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8")
    for folder in (ROOT / "benchmarks", ROOT / "demos")
    for path in sorted(folder.rglob("*.py"))
}


@pytest.mark.parametrize("name", PAGES)
def test_a_page_is_what_its_script_writes(name):
    """To the letter, from the CSV files beside it: a text is changed in the script, which then writes `page()` anew."""
    page = importlib.import_module(PAGES[name].renderer).page(RESULTS)
    assert (ROOT / PAGES[name].path).read_text(encoding="utf-8").splitlines() == page.splitlines()


def test_every_page_has_its_script():
    """A new page must come with the function that renders it, and names the script that makes it."""
    assert {path.stem for path in RESULTS.glob("*.md")} <= set(PAGES)
    for each in PAGES.values():
        (made_by,) = re.findall(r"Made by `([^`]+)`", TEXTS[each.path])
        assert made_by.removesuffix(" --all") == each.command


def test_counts_of_the_page_on_large_steps():
    """The cells that it tells are no measured numbers: they are those of its scenes."""
    globalisation = importlib.import_module("benchmarks.robustness.globalisation")
    for name, cells in globalisation.CELLS.items():
        assert globalisation.SCENES[name](globalisation.SHAPES[0]).mesh.cell_count == cells


@pytest.mark.parametrize("name", [*TEXTS, *PROGRAMS])
def test_scripts_that_are_named_exist(name):
    """Commands that are told, in pages and in the scripts themselves."""
    text = {**TEXTS, **PROGRAMS}[name]
    for script in re.findall(r"\b((?:benchmarks|demos|tests)/[\w/]+\.py)\b", text):
        assert (ROOT / script).is_file(), script
    for module in re.findall(r"python -m (benchmarks[\w.]*\w)", text):
        path = ROOT / module.replace(".", "/")
        assert path.with_suffix(".py").is_file() or (path / "__main__.py").is_file(), module


@pytest.mark.parametrize("name", TEXTS)
def test_files_that_are_linked_exist(name):
    """Pictures and pages, relative to the page that shows them; and the CSV files that it names."""
    folder = (ROOT / name).parent
    for target in re.findall(r"\]\(([^)\s]+)\)", TEXTS[name]):
        if "://" not in target:
            assert (folder / target.partition("#")[0]).exists(), target
    for pattern in re.findall(r"`([\w*]+\.csv)`", TEXTS[name]) if folder == RESULTS else ():
        assert list(RESULTS.glob(pattern)), pattern
