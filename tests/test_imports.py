"""The architecture as imports: what may know of what."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import growthx

PACKAGE = Path(growthx.__file__).parent


def imported(path, at_top_only=False):
    """Names of all modules a file imports at run time."""
    tree = ast.parse(path.read_text())
    checking = [
        node for node in ast.walk(tree) if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)
    ]
    skipped = {id(inner) for node in checking for inner in ast.walk(node)}
    nodes = tree.body if at_top_only else ast.walk(tree)
    names = set()
    for node in nodes:
        if id(node) in skipped:
            continue
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            names |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    return names


def importers(library):
    """Modules of growthx that import a library."""
    return {
        path.relative_to(PACKAGE).with_suffix("").as_posix()
        for path in PACKAGE.rglob("*.py")
        if any(name.split(".")[0] == library for name in imported(path))
    }


@pytest.mark.parametrize(
    ("library", "homes"),
    [
        ("gmsh", {"meshing"}),
        ("petsc4py", {"newton", "linear_solvers"}),
        ("pyvista", {"plots"}),
        ("rich", {"report"}),
        ("ffcx", {"kernels"}),
        ("cffi", {"kernels"}),
    ],
)
def test_each_library_has_its_home(library, homes):
    """A library used in one place only can be replaced, and is loaded only by runs that need it."""
    assert importers(library) == homes


@pytest.mark.parametrize("library", ["gmsh", "pyvista", "matplotlib"])
def test_costly_libraries_are_imported_when_used(library):
    """A run that draws nothing, or meshes nothing, must not wait for the plotting or meshing library."""
    for module in importers(library):
        names = imported(PACKAGE / f"{module}.py", at_top_only=True)
        assert not any(name.split(".")[0] == library for name in names)


@pytest.mark.parametrize(
    ("module", "stranger"),
    [
        ("kinematics", "growthx."),
        ("material", "growthx.growth"),
        ("material", "dolfinx"),
        ("growth", "dolfinx"),
        ("growth", "growthx.mesh"),
        ("balances", "dolfinx"),
        ("scene", "growthx.variants"),
        ("scene", "growthx.newton"),
        ("variants", "growthx.balances"),
        ("newton", "growthx.growth"),
        ("newton", "growthx.material"),
        ("marching", "growthx.plots"),
        ("discretisation", "growthx.newton"),
        ("discretisation", "growthx.marching"),
        ("plots", "growthx.marching"),
    ],
)
def test_data_flows_one_way(module, stranger):
    """Physics knows no solver, solvers know no biology, nothing solves in order to draw."""
    assert not any(name.startswith(stranger) for name in imported(PACKAGE / f"{module}.py"))


@pytest.mark.serial
def test_importing_growthx_is_light():
    """`growthx --help` and scripts that only look at the version must not load DOLFINx."""
    code = "import sys, growthx, growthx.cli; print(*(n for n in ('dolfinx', 'numpy', 'mpi4py') if n in sys.modules))"
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert answer.stdout.split() == []


@pytest.mark.serial
def test_a_plain_run_loads_no_pictures():
    """A run that draws nothing loads no plotting library."""
    code = (
        "import sys; from growthx.cli import main; main(['plate', '--n', '4', '--json']); "
        "print(*(n for n in ('pyvista', 'vtk', 'matplotlib') if n in sys.modules), file=sys.stderr)"
    )
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert answer.stderr.split() == []


def test_public_names_are_there():
    """Every name growthx promises can be had, as often as asked."""
    for _ in range(2):
        for name in growthx.__all__:
            assert getattr(growthx, name) is not None
    with pytest.raises(AttributeError, match="growthx has no 'Q7'"):
        _ = growthx.Q7
