"""The benchmarks' list tells all of them, and no module of theirs is longer than one reads."""

import ast
import importlib.util
import subprocess
import sys

import pytest

from benchmarks.catalogue import CATALOGUE, ROOT

MODULES = sorted(ROOT.rglob("*.py"))
MOST_LINES = 400
NAMES = {each.module for each in CATALOGUE}


def module_name(path):
    return ".".join(path.relative_to(ROOT).with_suffix("").parts)


def is_program(path):
    """Whether a file ends with the lines that run it."""
    return any(
        isinstance(node, ast.If) and "__main__" in ast.unparse(node.test)
        for node in ast.parse(path.read_text(encoding="utf-8")).body
    )


@pytest.mark.parametrize("benchmark", CATALOGUE, ids=lambda each: each.module)
def test_what_is_listed_exists(benchmark):
    """The program, what it says of itself and of how it is run, and its page."""
    assert importlib.util.find_spec(f"benchmarks.{benchmark.module}")
    assert is_program(benchmark.file)
    assert 20 < len(benchmark.measures) < 120
    assert benchmark.command in ast.get_docstring(ast.parse(benchmark.file.read_text(encoding="utf-8")))
    assert (ROOT.parent / benchmark.path).is_file()
    assert importlib.util.find_spec(benchmark.renderer)


def test_every_program_is_listed():
    """What can be run can be found."""
    programs = {module_name(path).removesuffix(".__main__") for path in MODULES if is_program(path)}
    assert programs == NAMES | {"__main__", "compare"}
    assert len(NAMES) == len(CATALOGUE)


@pytest.mark.parametrize("path", MODULES, ids=module_name)
def test_modules_are_short_and_rooms_have_a_sign(path):
    """What is longer is two things; the door says what a room is for, and opens at once."""
    assert len(path.read_text(encoding="utf-8").splitlines()) <= MOST_LINES
    door = ast.parse((path.parent / "__init__.py").read_text(encoding="utf-8"))
    assert len(ast.get_docstring(door).split()) > 8
    assert len(door.body) == 1


@pytest.mark.serial
def test_the_list_is_told_at_once():
    """By Python alone: nobody waits for finite elements to read a list."""
    code = "import runpy, sys; runpy.run_module('benchmarks', run_name='__main__'); print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT.parent, capture_output=True, text=True, check=True)
    *told, modules = done.stdout.splitlines()
    assert not {"dolfinx", "numpy", "growthx", "rich"} & set(modules.split())
    assert all(each.command in told for each in CATALOGUE)
