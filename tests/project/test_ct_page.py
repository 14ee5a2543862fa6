"""The page on scans shows what runs."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.serial
PAGE = (Path(__file__).parents[2] / "docs" / "ct.md").read_text(encoding="utf-8")


def test_the_script_of_the_page_on_scans(tmp_path):
    """A density goes out as an image, comes back and is compared with another run: near, and with a picture."""
    pytest.importorskip("nibabel", reason="nibabel, which is optional, is not installed")
    (script,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    run = subprocess.run([sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert run.returncode == 0, run.stderr
    r, rmse, bias = map(float, run.stdout.splitlines()[0].split())
    assert r > 0.85 and rmse < 0.15 and abs(bias) < 0.02
    assert len(run.stdout.splitlines()) == 11 and {path.name for path in tmp_path.iterdir()} == {
        "density.nii.gz",
        "difference.png",
    }
