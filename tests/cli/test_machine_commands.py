"""Versions, the doctor and completion: what is asked when something does not work must itself always work."""

import json
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import pytest

import growthx
from growthx.cli import program
from growthx.cli.machine import doctor, needs, trial, versions
from growthx.cli.machine.completion import options_of
from growthx.common import installed

pytestmark = pytest.mark.serial


def told(*arguments, capsys, status=0):
    """What `growthx` prints in this process."""
    try:
        assert program.main(list(arguments)) == status
    except SystemExit as end:
        assert end.code in (0, None)
    return capsys.readouterr().out


def test_the_version_names_what_numbers_depend_on(capsys):
    """A report of a wrong number begins with it: own version, those of the libraries, and which growthx that was."""
    own, libraries, how = told("--version", capsys=capsys).splitlines()
    assert own == f"growthx {growthx.__version__}"
    assert f"DOLFINx {metadata.version('fenics-dolfinx')}" in libraries and "PETSc" in libraries and "gmsh" in libraries
    assert str(Path(growthx.__file__).parents[1]) in how


def test_the_version_loads_no_library():
    """It answers at once, and where a library is broken."""
    code = "import sys\nfrom growthx.cli.machine.versions import lines\nlines()\nprint('dolfinx' in sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout == "False\n"


def test_the_doctor_finds_this_machine_well(capsys):
    """Every test here needs what it looks for; the trial's mass does not depend on the machine."""
    answer = json.loads(told("doctor", "--json", capsys=capsys))
    assert answer["lacks"].keys() <= {"mpirun", "Xvfb"}
    assert answer["speed"]["right"] is True and answer["speed"]["gflops"] > 0
    assert answer["cores"] == trial.cores() >= 1


@pytest.mark.parametrize(("package", "status"), [("nibabel", 0), ("fenics-dolfinx", 1)])
def test_the_doctor_tells_what_a_lack_costs(package, status, capsys, monkeypatch):
    """A library that is not there, or broken: the doctor goes on, says what is lost, and fails if nothing runs."""
    there = needs.found

    def absent(need):
        return needs.Found(need, None, "libfoo.so is not there") if need.package == package else there(need)

    monkeypatch.setattr(needs, "found", absent)
    out = told("doctor", "--no-trial", capsys=capsys, status=status)
    (line,) = (line for line in out.splitlines() if "libfoo.so" in line)
    need = next(need for need in needs.LIBRARIES if need.package == package)
    assert need.lack in line and line.startswith("MISSING" if status else "missing")
    assert ("growthx cannot run here" in out) == bool(status)


def test_the_doctor_says_so_if_numbers_are_wrong(capsys, monkeypatch):
    """A library that computes nonsense is the worst lack of all."""
    monkeypatch.setattr(trial, "measure", lambda: trial.Speed(trial.BLAS_GFLOPS, trial.SECONDS, trial.MASS * 1.001))
    assert "WRONG" in told("doctor", capsys=capsys, status=1)
    monkeypatch.setattr(trial, "measure", lambda: trial.Speed(1.0, 9 * trial.SECONDS, trial.MASS))
    assert "slow BLAS" in told("doctor", capsys=capsys)


def test_what_the_doctor_looks_for_is_what_growthx_depends_on():
    """A new dependency must not be unknown to it."""
    import tomllib

    listed = tomllib.loads((Path(growthx.__file__).parents[1] / "pyproject.toml").read_text(encoding="utf-8"))
    names = {word.partition(">")[0] for word in listed["project"]["dependencies"]}
    assert names <= {need.package for need in needs.LIBRARIES}


def parsers():
    """The parser of each command."""
    return program._parser()._subparsers._group_actions[0].choices


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_knows_every_option(shell, capsys):
    """It is written from the parser, so that none can be forgotten."""
    out = told("completion", shell, capsys=capsys)
    for name, parser in parsers().items():
        for option in options_of(parser):
            assert (f"-l {option[2:]} " if shell == "fish" else option) in out, (name, option)


def test_completion_completes_in_bash(capsys):
    """Asked as bash asks it."""
    script = told("completion", "bash", capsys=capsys) + (
        'COMP_WORDS=(growthx fem); COMP_CWORD=1; _growthx; echo "${COMPREPLY[*]}"\n'
        'COMP_WORDS=(growthx bar --var); COMP_CWORD=2; _growthx; echo "${COMPREPLY[*]}"\n'
        'COMP_WORDS=(growthx mesh fem); COMP_CWORD=2; _growthx; echo "${COMPREPLY[*]}"\n'
    )
    run = subprocess.run(["bash", "-c", script], capture_output=True, text=True, check=True)
    assert run.stdout.splitlines() == ["femur femur3d", "--variant", ""]


def test_an_unknown_shell_is_refused(capsys):
    """With those there are."""
    assert program.main(["completion", "tcsh"]) == 2
    assert "bash, zsh, fish would be right" in capsys.readouterr().err


def test_doctor_has_a_word_for_each_way_of_installing(monkeypatch, tmp_path):
    """From a checkout it names the checkout; else the installer."""
    assert versions.how_installed().startswith("used from the checkout")
    package = tmp_path / "site" / "growthx"
    package.mkdir(parents=True)
    monkeypatch.setattr(installed, "PACKAGE", package)
    assert str(package) in versions.how_installed()
    assert doctor.DOCTOR.name == "doctor"
