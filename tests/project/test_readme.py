"""The README shows nothing that does not run."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.serial
ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```(\w+)\n(.*?)```", README, re.DOTALL)
COMMANDS = [line for language, block in BLOCKS if language == "sh" for line in block.splitlines()]
PROGRAMS = [shlex.split(line)[1:] for line in COMMANDS if line.startswith("./run ") and "pytest" not in line]
RESUMED = next(words for words in PROGRAMS if "--resume" in words)


def started(words, folder):
    """A command of the README, run to its end in a folder; its output."""
    where = {"python": [sys.executable], "growthx": [sys.executable, "-m", "growthx"]}
    command = [part for word in words for part in where.get(word, [word])]
    command = [str(ROOT / part) if part.startswith("demos/") else part for part in command]
    run = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=900)
    assert run.returncode == 0, run.stderr
    assert run.stderr == ""
    return run


@pytest.mark.parametrize("words", PROGRAMS, ids=" ".join)
def test_commands_run(words, tmp_path):
    """What a newcomer types first must work, and leave its files where it is told to."""
    if words == RESUMED:
        started(PROGRAMS[PROGRAMS.index(words) - 1], tmp_path)
    run = started(words, tmp_path)
    if words == RESUMED:
        rows = [
            (tmp_path / name / "history.csv").read_text(encoding="utf-8").splitlines() for name in ("long", "longer")
        ]
        assert rows[0] == rows[1][:41] and len(rows[1]) == 51
    if "demos/femur.py" in words:
        assert "whole bone" in run.stdout
        folder = tmp_path / "results" / "femur"
        assert {"fields.pvd", "history.csv", "density.png"} <= {path.name for path in folder.iterdir()}
        bone = re.search(r"whole bone +│ (\d\.\d{4})", run.stdout)
        assert bone and float(bone[1]) == pytest.approx(0.9296, abs=1e-3)
    if "demos/bar.py" in words:
        assert {path.name for path in (tmp_path / "results" / "bar").iterdir()} == {
            "discontinuous.png",
            "continuous.png",
        }


def test_script_runs(tmp_path):
    """The script of the README is complete: it runs as it stands from the repository's folder."""
    (script,) = (block for language, block in BLOCKS if language == "python")
    run = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, timeout=300)
    assert run.returncode == 0, run.stderr
    last = [float(word) for word in run.stdout.splitlines()[-1].split()]
    assert last[0] == 2.0 and 0.01 < last[2] < 0.02


def theory_scripts():
    """A scene, a law, a source of another form and an energy, in the order of the page."""
    return re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "theory.md").read_text(encoding="utf-8"), re.DOTALL)


def test_the_scene_of_the_theory_page_runs():
    """All optional ingredients in one scene: the page that explains them must not show what does not work together."""
    script = theory_scripts()[0]
    run = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, timeout=300)
    assert run.returncode == 0, run.stderr
    rows = [[float(word) for word in line.split()] for line in run.stdout.splitlines()]
    assert [row[0] for row in rows] == [0.1, 0.2, 0.3, 0.4, 0.5]
    assert all(defect < 1e-10 for _, _, defect in rows)


def test_the_law_of_ones_own_of_the_theory_page_runs():
    """The first thing that a reader of that page writes after it, in four variants that agree but for their errors."""
    script = theory_scripts()[1]
    run = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, timeout=300)
    assert run.returncode == 0, run.stderr
    found = dict(line.split() for line in run.stdout.splitlines())
    assert list(found) == ["Q1P0", "Q1", "Q1sri", "Q1Q1"]
    assert all(float(density) == pytest.approx(float(found["Q1"]), rel=2e-3) for density in found.values())


OWN = """
scene = replace(gx.scenes.plate(4), {})
for variant in (gx.Q1P0, gx.Q1, gx.Q1Q1):
    print(variant.name, gx.solve(scene, variant).problem.mean_density())
"""


@pytest.mark.parametrize(("number", "change"), [(2, "growth=TwoRates()"), (3, "material=SaintVenantKirchhoff()")])
def test_other_forms_of_the_theory_page_run(number, change):
    """A source and an energy that are none of growthx's, as the page has them, in variants that agree."""
    script = "from dataclasses import replace\n" + theory_scripts()[number] + OWN.format(change)
    run = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, timeout=300)
    assert run.returncode == 0, run.stderr
    found = [float(line.split()[1]) for line in run.stdout.splitlines()]
    assert len(found) == 3 and found == pytest.approx([found[1]] * 3, rel=2e-2)


def test_the_runs_of_the_page_on_speed():
    """The same bone by the paper's scheme, by a kept factor, and in steps from error, each with less work."""
    (script,) = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "speed.md").read_text(encoding="utf-8"), re.DOTALL)
    run = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, timeout=300)
    assert run.returncode == 0, run.stderr
    paper, fixed, adaptive = ([float(word) for word in row.split()] for row in run.stdout.splitlines())
    assert paper[0] == fixed[0] == 40 > 3 * adaptive[0]
    assert paper[2] == paper[1] > 3 * fixed[2] > 3 * adaptive[2]
    assert fixed[3] == pytest.approx(paper[3], rel=1e-9)
    assert adaptive[3] == pytest.approx(paper[3], rel=5e-3)


def test_the_scripts_of_the_page_on_loads_run():
    """One after another, as they stand there, with the numbers that they are to show."""
    scripts = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "loads.md").read_text(encoding="utf-8"), re.DOTALL)
    run = subprocess.run(
        [sys.executable, "-c", "\n".join(scripts)], cwd=ROOT, capture_output=True, text=True, timeout=300
    )
    assert run.returncode == 0, run.stderr
    reactions, times, moments, defects = run.stdout.splitlines()
    of_point, of_muscle = re.findall(r"\[(.*?)\]", reactions)
    assert [float(word) for word in of_point.split()] == pytest.approx([0.0, 0.01], abs=1e-9)
    assert [float(word) for word in of_muscle.split()] == pytest.approx([-0.01, -0.02], abs=1e-9)
    assert times.startswith("[0.1, 0.2, 0.25, 0.3"), "a step ends where the table jumps"
    left, right, bent = (float(word) for word in re.findall(r"\(\[(.*?)\]\)", moments))
    assert left == pytest.approx(-right, abs=1e-8) and bent == pytest.approx(-0.02, rel=0.05)
    assert all(float(defect) < 1e-9 for defect in defects.split())


def test_the_run_of_the_page_on_trouble():
    """An ill-posed femur ends early, by an error that tells where it has come to."""
    (script,) = re.findall(
        r"```python\n(.*?)```", (ROOT / "docs" / "robustness.md").read_text(encoding="utf-8"), re.DOTALL
    )
    run = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, timeout=300)
    assert run.returncode == 0, run.stderr
    sentence, numbers = run.stdout.splitlines()
    assert sentence.startswith("the run ended at t = 1") and "did not help" in sentence
    assert 100 < float(numbers.split()[0]) < 160


def test_what_is_named_is_there():
    """Files and options the README speaks of exist."""
    for name in re.findall(
        r"`((?:demos|meshes|docs)/[\w.]+|[\w.]+\.(?:cff|txt))`|\(((?:docs|benchmarks/results)/[\w.]+)\)", README
    ):
        assert (ROOT / (name[0] or name[1])).exists()
    (apt,) = (line for line in COMMANDS if "apt install" in line)
    packages = subprocess.run(
        ["bash", "-c", f"echo {apt.removeprefix('sudo apt install ')}"], cwd=ROOT, capture_output=True, text=True
    ).stdout.split()
    assert "python3-dolfinx" in packages and not any("#" in word for word in packages)
