"""What is installed: the wheel works without its checkout, and says the same of itself in every place."""

import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from importlib.util import find_spec
from pathlib import Path

import pytest

import growthx

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
SOURCES = ("growthx", "meshes", "pyproject.toml", "README.md", "LICENSE")
BUILD = "import sys; from setuptools.build_meta import build_wheel; print(build_wheel(sys.argv[1]))"


def copied(folder):
    """What a package is built of, copied."""
    folder.mkdir(exist_ok=True)
    for name in SOURCES:
        path = ROOT / name
        if path.is_dir():
            shutil.copytree(path, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            shutil.copy(path, folder / name)


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """The wheel, built from a copy: nothing of the build stays in the checkout."""
    folder = tmp_path_factory.mktemp("wheel")
    copied(folder)
    subprocess.run([sys.executable, "-c", BUILD, folder / "dist"], cwd=folder, check=True, capture_output=True)
    (made,) = (folder / "dist").glob("growthx-*.whl")
    return made


@pytest.mark.serial
@pytest.mark.slow
def test_the_wheel_has_every_file(wheel):
    """Modules, meshes and the mark of types: a forgotten one would break the installed package alone."""
    with zipfile.ZipFile(wheel) as content:
        names = {name for name in content.namelist() if ".dist-info" not in name}
    modules = {path.relative_to(ROOT).as_posix() for path in (ROOT / "growthx").rglob("*.py")}
    meshes = {f"growthx/meshes/{path.name}" for path in (ROOT / "meshes").iterdir() if path.is_file()}
    assert names == modules | meshes | {"growthx/py.typed", "growthx/__init__.pyi"}
    assert wheel.name.startswith(f"growthx-{growthx.__version__}-py3-none-any")


@pytest.mark.serial
@pytest.mark.slow
def test_the_wheel_runs_in_a_fresh_environment(wheel, tmp_path):
    """The paper's bar, without the checkout, in a virtual environment that sees the system's DOLFINx."""
    home = tmp_path / "environment"
    subprocess.run([sys.executable, "-m", "venv", "--system-site-packages", "--without-pip", home], check=True)
    python = home / "bin" / "python"
    outside = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "PYTHONHOME")}

    def run(*words):
        done = subprocess.run([python, *words], cwd=tmp_path, env=outside, capture_output=True, text=True, timeout=300)
        assert done.returncode == 0, done.stderr
        return done.stdout

    (site,) = run("-c", "import sysconfig; print(sysconfig.get_path('purelib'))").splitlines()
    with zipfile.ZipFile(wheel) as content:  # which is all that pip does with a wheel of Python files
        content.extractall(site)
    bar = json.loads(run("-m", "growthx", "bar", "--elements", "10", "--json"))
    assert bar["converged"] and bar["end_displacement"] == pytest.approx(2.37, abs=0.005)
    assert json.loads(run("-m", "growthx", "femur", "--until", "4", "--json"))["cells"] == 658
    assert site in run("-m", "growthx", "--version")


def find_pip():
    """pip as something that Python runs: a module, or the wheel of Debian or of GROWTHX_PIP; None if there is none."""
    if find_spec("pip"):
        return "-m", "pip"
    wheels = [os.environ.get("GROWTHX_PIP", ""), *map(str, Path("/usr/share/python-wheels").glob("pip-*.whl"))]
    return next(((f"{wheel}/pip",) for wheel in wheels if wheel and Path(wheel).is_file()), None)


@pytest.mark.serial
@pytest.mark.slow
def test_pip_installs_the_checkout_beside_the_systems_packages(tmp_path):
    """`pip install .` as a user types it; it finds all that growthx needs among them, and fetches nothing else.

    What it would fetch could hide a part of what is there, and be one that the rest does not know.
    """
    pip = find_pip()
    if pip is None:
        pytest.skip("there is no pip: GROWTHX_PIP may name its wheel")
    checkout, home = tmp_path / "checkout", tmp_path / "environment"
    copied(checkout)
    subprocess.run([sys.executable, "-m", "venv", "--system-site-packages", "--without-pip", home], check=True)
    # Packages of its own to build with would be fetched: those of the system do.
    settings = {"PIP_NO_INDEX": "1", "PIP_NO_BUILD_ISOLATION": "0", "PIP_CONFIG_FILE": os.devnull}
    outside = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "PYTHONHOME")}

    def run(*words, **more):
        done = subprocess.run(words, env=outside | settings, capture_output=True, text=True, timeout=300, **more)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    installed = run(home / "bin" / "python", *pip, "install", ".", cwd=checkout)
    assert f"Successfully installed growthx-{growthx.__version__}\n" in installed
    program = home / "bin" / "growthx"
    bar = json.loads(run(program, "bar", "--elements", "10", "--json", cwd=tmp_path))
    assert bar["converged"] and bar["end_displacement"] == pytest.approx(2.37, abs=0.005)
    assert "installed by pip at " in run(program, "--version", cwd=tmp_path)
    run(program, "plate", "--elements", "2", "--picture", "plate.png", cwd=tmp_path)
    assert (tmp_path / "plate.png").stat().st_size > 1000


def test_one_version_everywhere():
    """Package, citation, changelog and recipe."""
    assert PROJECT["version"] == growthx.__version__
    for name, pattern in {
        "CITATION.cff": r"^version: (\S+)$",
        "conda/meta.yaml": r'set version = "(.+)"',
    }.items():
        assert re.search(pattern, (ROOT / name).read_text(encoding="utf-8"), re.MULTILINE)[1] == growthx.__version__


def test_the_recipe_names_the_dependencies_of_the_package():
    """By conda's names; and it is a file that can be read once its one variable is filled in."""
    conda = {"gmsh": "python-gmsh", "matplotlib": "matplotlib-base"}
    text = (ROOT / "conda" / "meta.yaml").read_text(encoding="utf-8")
    assert "\t" not in text and text.count("{{") == text.count("}}") and text.count("{%") == text.count("%}") == 1
    listed = re.search(r"^  run:\n((?:    - .+\n)+)", text, re.MULTILINE)[1]
    names = {line.split()[1] for line in listed.splitlines()}
    extras = PROJECT["optional-dependencies"]
    wanted = {re.split(r"[<>=\[ ]", word)[0] for word in PROJECT["dependencies"] + extras["pictures"]}
    assert {conda.get(name, name) for name in wanted} <= names
    for section in ("package", "source", "build", "requirements", "test", "about"):
        assert re.search(rf"^{section}:$", text, re.MULTILINE), section


def test_metadata_is_whole():
    """What a package index shows, and what extras promise."""
    assert {"ct", "docs", "mesh", "pictures", "dev"} <= set(PROJECT["optional-dependencies"])
    assert "Typing :: Typed" in PROJECT["classifiers"] and (ROOT / "growthx" / "py.typed").is_file()
    assert all(url.startswith("https://doi.org/") for url in PROJECT["urls"].values())  # no host that does not exist


SCRIPT = """\
import growthx as gx

scene = gx.scenes.bar(elements=10)
result: gx.Result = gx.solve(scene, gx.Q1P0)
mass: float = result.problem.mass()
wrong: str = result.problem.mass()
"""


@pytest.mark.serial
@pytest.mark.slow
def test_types_reach_a_users_file(tmp_path):
    """mypy knows gx's names in a script, so that an editor completes them and a wrong type is told."""
    path = tmp_path / "mine.py"
    path.write_text(SCRIPT, encoding="utf-8")
    run = subprocess.run(
        [sys.executable, "-m", "mypy", "--ignore-missing-imports", "--follow-imports", "silent", path],
        cwd=tmp_path,
        env={**os.environ, "MYPYPATH": str(ROOT)},
        capture_output=True,
        text=True,
    )
    complaints = [line for line in run.stdout.splitlines() if "error:" in line]
    assert len(complaints) == 1 and "mine.py:6:" in complaints[0], run.stdout


def test_the_types_of_public_names_are_theirs():
    """A new name is added by docs/public_types.py."""
    from docs import public_types

    assert public_types.STUB.read_text(encoding="utf-8") == public_types.text()
