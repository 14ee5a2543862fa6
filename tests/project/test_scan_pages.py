"""The pages on scans and on stems show what runs."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.serial
DOCS = Path(__file__).parents[2] / "docs"


def script(page):
    """The first one that a page has."""
    return re.findall(r"```python\n(.*?)```", (DOCS / page).read_text(encoding="utf-8"), re.DOTALL)[0]


def test_the_script_of_the_page_on_scans(tmp_path):
    """A density goes out as an image, comes back and is compared with another run: near, and with a picture."""
    pytest.importorskip("nibabel", reason="nibabel, which is optional, is not installed")
    run = subprocess.run(
        [sys.executable, "-c", script("ct.md")], cwd=tmp_path, capture_output=True, text=True, timeout=300
    )
    assert run.returncode == 0, run.stderr
    r, rmse, bias = map(float, run.stdout.splitlines()[0].split())
    assert r > 0.85 and rmse < 0.15 and abs(bias) < 0.02
    assert len(run.stdout.splitlines()) == 11 and {path.name for path in tmp_path.iterdir()} == {
        "density.nii.gz",
        "difference.png",
    }


def test_the_script_and_the_table_of_the_page_on_stems(tmp_path):
    """The first table of the page, of the plane, is of the run that it shows, in each zone."""
    run = subprocess.run(
        [sys.executable, "-c", script("stem.md")], cwd=tmp_path, capture_output=True, text=True, timeout=300
    )
    assert run.returncode == 0, run.stderr
    densities, energies = (ast.literal_eval(line) for line in run.stdout.splitlines())
    assert list(densities) == list(energies) == [f"Gruen {number}" for number in range(1, 8)]
    assert densities["Gruen 7"] == pytest.approx(1.162, abs=0.01)
    row = r"^\| \d[^|]*\| ([−+][\d.]+) % \| ([−+][\d.]+) % \|$"
    told = re.findall(row, (DOCS / "stem.md").read_text(encoding="utf-8"), re.MULTILINE)
    table = [[float(number.replace("−", "-")) for number in row] for row in told]
    assert len(table) == 7 and min(row[0] for row in table) == table[6][0] and table[6][1] < table[6][0]
