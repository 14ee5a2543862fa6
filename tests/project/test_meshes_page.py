"""Each script of the page on meshes runs as it stands, on files as the page has them."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import meshio
import numpy as np
import pytest

pytestmark = pytest.mark.serial
ROOT = Path(__file__).parents[2]
FILES = ROOT / "tests" / "meshing" / "files"
PAGE = (ROOT / "docs" / "meshes.md").read_text(encoding="utf-8")
SCRIPTS = [
    (re.sub(r"\W+", " ", title).strip(), script)
    for title, text in re.findall(r"^## (.*?)\n(.*?)(?=^## |\Z)", PAGE, re.DOTALL | re.MULTILINE)
    for script in re.findall(r"```python\n(.*?)```", text, re.DOTALL)
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """One file of each kind."""
    import pyvista

    folder = tmp_path_factory.mktemp("page")
    shutil.copy(FILES / "two_good.msh", folder / "mine.msh")
    shutil.copy(FILES / "two.inp", folder / "mine.inp")
    points = [[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0], [1, 1, 0], [2, 1, 0]]
    (folder / "mine.feb").write_text(
        '<febio_spec version="4.0"><Mesh><Nodes>'
        + "".join(f'<node id="{i}">{x},{y},{z}</node>' for i, (x, y, z) in enumerate(points, start=1))
        + '</Nodes><Elements type="quad4" name="bone"><elem id="1">1,2,5,4</elem></Elements></Mesh></febio_spec>'
    )
    strip = meshio.Mesh(
        np.array(points, dtype=float),
        [("quad", [[0, 1, 4, 3], [1, 2, 5, 4]]), ("line", [[0, 3], [2, 5]])],
        cell_data={"MaterialIds": [[1, 2], [3, 4]], "rho": [[0.8, 1.1], [0.0, 0.0]]},
    )
    strip.write(folder / "mine.vtu")
    strip.write(folder / "mine.med")
    pyvista.Sphere(radius=10, theta_resolution=12, phi_resolution=12).save(folder / "bone.stl")
    grey = np.zeros((3, 4, 5))
    grey[:, 1:3, 1:3] = 900.0
    grey[0, 0, 4] = 700.0
    np.save(folder / "segmentation.npy", grey)
    return folder


def test_the_page_has_scripts():
    """For each kind of file."""
    assert len(SCRIPTS) >= 9


@pytest.mark.parametrize(("title", "script"), SCRIPTS, ids=[title for title, _ in SCRIPTS])
def test_scripts_of_the_page_run(folder, title, script):
    """As a newcomer copies them."""
    run = subprocess.run([sys.executable, "-c", script], cwd=folder, capture_output=True, text=True, timeout=300)
    assert run.returncode == 0, run.stderr
    assert run.stdout.strip()
    assert all(line.startswith("growthx: ") for line in run.stderr.splitlines())
