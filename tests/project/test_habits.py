"""What strangers look for before they take part: it is there, true, and calls what the checks here call."""

import re
from pathlib import Path

import pytest

import growthx
from benchmarks import compare

ROOT = Path(__file__).parents[2]


def test_the_changelog_has_this_version():
    """The newest one first, each with its date."""
    found = re.findall(r"^## \[(.+?)\](?: - (\d{4}-\d\d-\d\d))?$", (ROOT / "CHANGELOG.md").read_text("utf-8"), re.M)
    assert found[0] == ("Unreleased", "") and found[1][0] == growthx.__version__ and found[-1][0] == "0.1.0"
    assert all(date for _, date in found[1:])


@pytest.mark.parametrize(
    ("name", "command"),
    [("tests", ".ci/run"), ("docs", "./run docs"), ("wheel", "./run pytest -m '' tests/project/test_package.py")],
)
def test_workflows_call_what_is_called_here(name, command):
    """One script for a check, wherever it runs."""
    assert command in (ROOT / ".github" / "workflows" / f"{name}.yml").read_text("utf-8")
    assert (ROOT / command.split()[0]).is_file() and (ROOT / command.split()[-1].replace("docs", "run")).is_file()


def test_actions_of_workflows_are_those_of_one_commit():
    """A tag can be moved to other code; the release stands beside it, the same one everywhere."""
    pages = [path.read_text("utf-8") for path in (ROOT / ".github" / "workflows").glob("*.yml")]
    used = {line for page in pages for line in re.findall(r"uses: (.*)", page)}
    assert used and all(re.fullmatch(r"[\w-]+/[\w-]+@[0-9a-f]{40} # v\d+\.\d+\.\d+", line) for line in used), used
    assert len({line.partition("@")[0] for line in used}) == len(used)


def table(folder, name, rows):
    path = folder / name
    path.write_text("\n".join(["size,variant,seconds", *rows, ""]), encoding="utf-8")
    return path


def test_compare_finds_what_became_slower(tmp_path, capsys):
    """A regression ends with status 1, and is told with its row; less than the factor is noise."""
    old = table(tmp_path, "old.csv", ["8,Q1,1.0", "16,Q1,2.0", "32,Q1,9.0"])
    new = table(tmp_path, "new.csv", ["8,Q1,1.1", "16,Q1,5.0"])
    assert compare.main([str(old), str(new)]) == 1
    out = capsys.readouterr().out
    assert "2.50 x" in out and "16, Q1" in out and "8, Q1" not in out and "1 rows are not in the new one" in out
    assert compare.main([str(new), str(new)]) == 0


def test_compare_refuses_what_cannot_be_compared(tmp_path):
    """Rather than to say that nothing changed."""
    old, other = table(tmp_path, "a.csv", ["8,Q1,1.0"]), table(tmp_path, "b.csv", ["9,Q1,1.0"])
    with pytest.raises(SystemExit, match="no row in common"):
        compare.main([str(old), str(other)])
