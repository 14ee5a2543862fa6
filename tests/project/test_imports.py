"""The architecture as imports: what may know of what."""

import ast
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import growthx

PACKAGE = Path(growthx.__file__).parent


def imported(path, at_top_only=False):
    """Names of all modules a file imports at run time."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
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
        ("gmsh", {"meshing/formats/gmsh", "meshing/formats/apart/gmsh_reader", "meshing/formats/apart/stl_reader"}),
        ("meshio", {"meshing/formats/apart/meshio_reader", "meshing/formats/apart/stl_reader"}),
        ("vtkmodules", {"meshing/formats/apart/vtk_reader", "post/movie"}),
        ("defusedxml", {"meshing/formats/febio", "meshing/formats/apart/meshio_reader"}),
        ("petsc4py", {"solvers/newton", "solvers/linear_solvers", "solvers/tangent"}),
        ("pyvista", {"post/plots", "post/mesh_picture", "post/movie", "post/space/body", "post/space/panels"}),
        ("rich", {"cli/report"}),
        ("nibabel", {"meshing/images/nifti"}),
        ("ffcx", {"fem/kernels"}),
        ("cffi", {"fem/kernels"}),
    ],
)
def test_each_library_has_its_home(library, homes):
    """A library used in one place only can be replaced, and is loaded only by runs that need it."""
    assert importers(library) == homes


@pytest.mark.parametrize("library", ["gmsh", "pyvista", "matplotlib", "nibabel"])
def test_costly_libraries_are_imported_when_used(library):
    """A run that draws nothing, or meshes nothing, must not wait for the plotting or meshing library."""
    for module in importers(library):
        names = imported(PACKAGE / f"{module}.py", at_top_only=True)
        assert not any(name.split(".")[0] == library for name in names)


LAYERS = (  # a room may import rooms of earlier lines; those of one line do not know each other
    "common",
    "fem",
    "solvers constitutive",
    "meshing",
    "model",
    "discretisation",
    "stepping",
    "post",
    "results scenes baselines",
    "run",
    "cli",
)
FLOORS = {room: floor for floor, rooms in enumerate(LAYERS) for room in rooms.split()}
MODULES = sorted(PACKAGE.rglob("*.py"))
MOST_MODULES = 13  # in a room: more are two rooms


def module_name(path):
    return ".".join(("growthx", *path.relative_to(PACKAGE).with_suffix("").parts)).removesuffix(".__init__")


def known(path, modules):
    """The modules of growthx that a file imports, for types too: no circle hides behind TYPE_CHECKING."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "growthx":
            whole = (f"{node.module}.{alias.name}" for alias in node.names)
            found |= {name if name in modules else node.module for name in whole}
            assert node.module != "growthx" or {alias.name for alias in node.names} <= {"__version__"}, path
        elif isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names if alias.name.split(".")[0] == "growthx"}
    return found - {"growthx", module_name(path)}


@pytest.mark.parametrize("path", MODULES, ids=module_name)
def test_rooms_know_lower_ones_only(path):
    """Physics knows no solver, solvers know no physics, nothing solves in order to draw: data flows one way."""
    here = module_name(path).split(".")[1:2]
    if not here or here == ["__main__"]:
        return
    for name in known(path, ()):
        there = name.split(".")[1]
        assert there == here[0] or FLOORS[there] < FLOORS[here[0]], f"{module_name(path)} imports {name}"


def test_no_circles():
    """Within a room, too: what is below can be read, and tested, without what is above."""
    names = {module_name(path) for path in MODULES}
    imports = {module_name(path): known(path, names) for path in MODULES}
    while free := {name for name, others in imports.items() if not others & imports.keys()}:
        imports = {name: others for name, others in imports.items() if name not in free}
    assert not imports


def test_rooms_have_a_floor_a_sign_and_no_crowd():
    """A newcomer reads at the door what a room is for, and looks at no more than a dozen modules."""
    rooms = {path.parent for path in MODULES} - {PACKAGE}
    for room in rooms:
        assert room.relative_to(PACKAGE).parts[0] in FLOORS
        assert (
            len((ast.get_docstring(ast.parse((room / "__init__.py").read_text(encoding="utf-8"))) or "").split()) > 8
        ), room
        assert len(list(room.glob("*.py"))) <= MOST_MODULES + 1, room
    assert {path.name for path in PACKAGE.glob("*.py")} == {"__init__.py", "__main__.py", "run.py"}


def test_every_room_is_installed():
    """A forgotten one would break the installed package alone."""
    listed = tomllib.loads((PACKAGE.parent / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["setuptools"][
        "packages"
    ]
    rooms = {module_name(path) for path in MODULES if path.name == "__init__.py"}
    assert set(listed) == rooms | {"growthx.meshes"}


def definitions(kind):
    """All functions or classes of growthx, with their modules."""
    for path in MODULES:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, kind):
                yield module_name(path), node


def test_solvers_name_no_physics():
    """They know a system by the protocol alone, whatever it is a model of."""
    physics = {"scene", "variant", "growth", "material", "density", "law", "mesh"}
    for path in (PACKAGE / "solvers").glob("*.py"):
        named = {
            node.attr
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
            if isinstance(node, ast.Attribute)
        }
        assert not named & physics, path


def test_nothing_is_long():
    """What does not fit on a page or two has parts with names of their own."""
    for module, function in definitions(ast.FunctionDef):
        assert function.end_lineno - function.lineno < 65, f"{module}.{function.name}"
    for module, kind in definitions(ast.ClassDef):
        methods = [part for part in kind.body if isinstance(part, ast.FunctionDef) and not part.name.startswith("_")]
        asked = [part for part in methods if not any("property" in ast.unparse(each) for each in part.decorator_list)]
        assert kind.end_lineno - kind.lineno < 250, f"{module}.{kind.name}"
        # The facade: readings of a line each.
        assert len(asked) <= 12 or kind.name == "Discretisation", f"{module}.{kind.name}"


def test_attributes_are_there_from_the_start():
    """What is set in some other method than the constructor only is not there before somebody has called it."""
    for module, kind in definitions(ast.ClassDef):
        parts = {part.name: part for part in kind.body if isinstance(part, ast.FunctionDef)}
        if "__init__" not in parts:
            continue
        sets = {name: _set_by(part) for name, part in parts.items()}
        begun, waiting = set(), ["__init__"]
        known = set(sets["__init__"])
        while waiting:
            name = waiting.pop()
            begun.add(name)
            known |= sets[name]
            waiting += [called for called in _called_by(parts[name]) & parts.keys() if called not in begun]
        later = set().union(*sets.values()) - known
        assert not later, f"{module}.{kind.name}: {later}"


def _of_self(node):
    return isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "self"


def _set_by(function):
    return {node.attr for node in ast.walk(function) if _of_self(node) and isinstance(node.ctx, ast.Store)}


def _called_by(function):
    return {node.func.attr for node in ast.walk(function) if isinstance(node, ast.Call) and _of_self(node.func)}


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
        "import sys; from growthx.cli import main; main(['plate', '--elements', '4', '--json']); "
        "print(*(n for n in ('pyvista', 'vtk', 'matplotlib', 'nibabel') if n in sys.modules), file=sys.stderr)"
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


@pytest.mark.parametrize("folder", ["growthx", "tests", "benchmarks"])
def test_forms_are_compiled_where_they_are_kept(folder):
    """FFCx waits ten seconds for what another process compiles into DOLFINx's own cache, or has been killed at."""
    found = {
        path.relative_to(PACKAGE.parent).as_posix()
        for path in (PACKAGE.parent / folder).rglob("*.py")
        if re.search(r"\bfem\.(form|Expression)\(", path.read_text())
    }
    # A form of the user's, who knows of no other way, is tried in one test.
    assert found <= {"growthx/fem/kernels.py", "tests/common/test_communicators.py", "tests/project/test_imports.py"}
