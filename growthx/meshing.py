"""Meshes from gmsh: a .geo script or a .msh file becomes a Mesh with named boundaries and regions.

gmsh runs on rank 0 only; every error there becomes one InputError sentence on all ranks.
"""

from __future__ import annotations

import json
import os
import re
import signal
import threading
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from numbers import Integral
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI

from growthx.errors import LARGEST, InputError, require_kind, shown
from growthx.mesh import Mesh
from growthx.mesh_parts import Parts, check_corners, check_facets, distribute, split

if TYPE_CHECKING:
    from growthx.arrays import Floats, Indices

# gmsh's first-order elements: name, and DOLFINx's node order (row by row where gmsh goes round).
_SHAPES = {
    1: ("interval", [0, 1]),
    2: ("triangle", [0, 1, 2]),
    3: ("quadrilateral", [0, 1, 3, 2]),
    4: ("tetrahedron", [0, 1, 2, 3]),
    5: ("hexahedron", [0, 1, 3, 2, 4, 5, 7, 6]),
}
PLANE_CELLS = ("quadrilateral", "triangle")
_OFF_PLANE = 1e-9  # height over the mesh's extent, below which a surface counts as plane
_NO_COMMAND = re.compile(rb'"[^"]*"|//[^\n]*|/\*.*?\*/', re.DOTALL)  # text and comments of a script
# gmsh is silent and reads a script to its end: if an error raised (AbortOnError = 2, its default in Python), its parser
# would keep the rest of the script and prepend it to the next file.
_OPTIONS = {"General.Terminal": 0, "General.AbortOnError": 1}


def load_gmsh() -> None:
    """Import gmsh ahead of its use, for a program that counts imports and set-up apart (rank 0 only, as elsewhere)."""
    if MPI.COMM_WORLD.rank == 0:
        import gmsh  # noqa: F401


def locate(name: str) -> Path:
    """Path of a file of growthx's own `meshes` folder, in a checkout or installed; InputError if there is none."""
    package = Path(__file__).resolve().parent
    folders = [folder for folder in (package / "meshes", package.parent / "meshes") if folder.is_dir()]
    for folder in folders:
        if (folder / name).is_file():
            return folder / name
    known = ", ".join(sorted(file.name for folder in folders for file in folder.iterdir() if file.is_file()))
    raise InputError(f"growthx has no mesh file '{name}'; it has {known or 'none at all'}")


def triangles(cells: str) -> bool:
    """The parameter `triangles` of growthx's own scripts for cells of that shape; InputError if they have none such."""
    if cells not in PLANE_CELLS:
        raise InputError(f"there are no cells '{cells}' in the plane: {' or '.join(PLANE_CELLS)} would be right")
    return cells == "triangle"


def read(path: str | Path, *, refine: int = 1, comm: MPI.Comm = MPI.COMM_WORLD, **parameters: float) -> Mesh:
    """Read a gmsh script (.geo) or mesh (.msh) and distribute it over the ranks of `comm` (collective).

    The cells are those in the physical groups of the highest dimension, which name the mesh's regions; the groups of
    one dimension less name its boundaries.  Lengths are in the file's unit.

    path: the file, looked up on rank 0
    refine: K splits every cell of a two-dimensional mesh uniformly into K x K, with straight sides
    parameters: values for the ONELAB parameters of a .geo script (DefineConstant with a Name), by the last part of
        their names

    InputError, on all ranks, if the file or a parameter is not usable.
    """
    parts: Parts | None = None
    problem: Exception | None = None
    if comm.rank == 0:
        try:
            require_kind(path, (str, Path), "the file of a mesh", "its path")
            _check_refine(refine)
            parts = split(_read_parts(Path(path), parameters), refine, path)
        except InputError as error:
            problem = error
        except OSError as error:
            problem = InputError(f"the file {path} cannot be read ({error.strerror}): check its path and permissions")
        except MemoryError:
            problem = InputError(f"the mesh of {path}, split by refine = {refine}, does not fit into memory")
        except Exception as error:  # not foreseen, but the other ranks must not wait for ever
            problem = RuntimeError(f"reading {path} failed: {error!r}")
            problem.__cause__ = error
    problem = comm.bcast(problem)
    if problem is not None:
        raise problem
    return distribute(parts, comm)


# --- gmsh, on rank 0 --------------------------------------------------------------------------------------------------


def _read_parts(path: Path, parameters: Mapping[str, float]) -> Parts:
    _check_file(path, parameters)
    with _gmsh_session(path) as gmsh:
        _open(gmsh, path)
        if parameters:
            _set_parameters(gmsh, path, parameters)
            gmsh.model.remove()
            _open(gmsh, path)
        dim = max((dim for dim, _ in gmsh.model.getPhysicalGroups()), default=None)
        if dim is None:
            raise InputError(f"{path} has no physical groups: named ones of cells and boundaries would be right")
        if dim < 2:
            raise InputError(
                f"the physical groups of {path} hold no cells but only curves or points: "
                "a named group of surfaces or volumes would be right"
            )
        _check_extent(gmsh, path)
        if len(gmsh.model.mesh.getElementTypes(dim)) == 0:
            with _gmsh_errors(gmsh, path):
                gmsh.model.mesh.generate(dim)
        return _extract(gmsh, path, dim)


def _check_refine(refine: int) -> None:
    if not isinstance(refine, Integral) or isinstance(refine, bool) or refine < 1:
        raise InputError(f"refine is {shown(refine)}: a whole number of at least 1 would be right")


def _check_file(path: Path, parameters: Mapping[str, float]) -> None:
    if path.suffix not in (".geo", ".msh"):
        raise InputError(f"{path} is neither a gmsh script (.geo) nor a gmsh mesh (.msh)")
    if not path.is_file():
        raise InputError(f"there is no file {path}: the path of a gmsh script (.geo) or mesh (.msh) would be right")
    if not os.access(path, os.R_OK):
        raise InputError(f"the file {path} may not be read: check its permissions")
    content = path.read_bytes()
    if path.suffix == ".geo":
        if content.rpartition(b"\n")[2].strip():
            raise InputError(f"gmsh would skip the last line of {path}: a line break at its end would be right")
        if re.search(rb"\bExit\s*;", _NO_COMMAND.sub(b" ", content)):
            raise InputError(f"{path} has an Exit, with which gmsh would end the whole program: none would be right")
        return
    if parameters:
        raise InputError(f"{path} is a mesh and takes no parameters ({_quoted(parameters)}): a .geo script would")
    # gmsh would take a file without this header for a script
    if not content.startswith(b"$"):
        raise InputError(f"{path} is not a gmsh mesh: it should begin with $MeshFormat")


@contextmanager
def _gmsh_session(path: Path) -> Iterator[Any]:
    """The gmsh module, silent; a session of the user's own is left as it was, but for options set by the script."""
    try:
        import gmsh
    except (ImportError, OSError) as error:  # OSError: a system library gmsh needs is missing
        raise InputError(f"reading {path} needs gmsh's Python module, which does not load: {error}") from error
    nested = bool(gmsh.isInitialized())
    if not nested:
        gmsh.initialize(readConfigFiles=False, interruptible=False)
    options = {name: gmsh.option.getNumber(name) for name in _OPTIONS}
    model = gmsh.model.getCurrent()
    known = set(gmsh.onelab.getNames())
    for name, value in _OPTIONS.items():
        gmsh.option.setNumber(name, value)
    gmsh.logger.start()
    try:
        with _interruptible():
            yield gmsh
    finally:
        gmsh.logger.stop()
        if nested:
            for name in set(gmsh.onelab.getNames()) - known:
                gmsh.onelab.clear(name)
            gmsh.model.remove()
            gmsh.model.setCurrent(model)
            for name, value in options.items():
                gmsh.option.setNumber(name, value)
        else:
            gmsh.finalize()


@contextmanager
def _interruptible() -> Iterator[None]:
    """Let Ctrl-C and SIGTERM end the program at once: nothing else is heard while gmsh reads an endless script."""
    if threading.current_thread() is not threading.main_thread():  # which alone may say so
        yield
        return
    before = {number: signal.signal(number, signal.SIG_DFL) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _open(gmsh: Any, path: Path) -> None:
    gmsh.model.add("growthx")  # gmsh opens a file in the current model if that is empty
    with _gmsh_errors(gmsh, path):
        gmsh.open(str(path))


@contextmanager
def _gmsh_errors(gmsh: Any, path: Path) -> Iterator[None]:
    """Raise InputError with the first error gmsh reports."""
    earlier = len(gmsh.logger.get())
    raised = []
    try:
        yield
    except Exception as error:  # gmsh raises nothing more special
        raised = [str(error)]
    try:
        logged = [line.removeprefix("Error: ") for line in gmsh.logger.get()[earlier:] if line.startswith("Error: ")]
    except UnicodeDecodeError:  # gmsh quotes what it does not understand
        logged = ["it has bytes that are no text"]
    if messages := logged + raised:
        raise InputError(f"gmsh cannot make a mesh of {path}: {messages[0]}")


def _set_parameters(gmsh: Any, path: Path, parameters: Mapping[str, float]) -> None:
    """Give the ONELAB parameters of the opened script their values, which count when it is opened again."""
    own = [name for name in gmsh.onelab.getNames() if not name.startswith(("Gmsh/", "ONELAB/"))]
    known = {name.rsplit("/", 1)[-1]: name for name in own if len(gmsh.onelab.getNumber(name))}
    for name, value in parameters.items():
        if name not in known:
            raise InputError(f"{path} has no parameter '{name}'; it has {_quoted(known) or 'none at all'}")
        _check_value(json.loads(gmsh.onelab.get(known[name])), path, name, value)
        gmsh.onelab.setNumber(known[name], [float(value)])


def _check_extent(gmsh: Any, path: Path) -> None:
    """Refuse a geometry that reaches out to where gmsh would not come to an end."""
    box = gmsh.model.getBoundingBox(-1, -1) if gmsh.model.getEntities() else (0.0,)
    if not np.all(np.abs(box) <= LARGEST):
        raise InputError(
            f"{path} has points that are nowhere, or too far to be meant: finite coordinates would be right"
        )


def _check_value(parameter: Mapping[str, Any], path: Path, name: str, value: float) -> None:
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"the parameter '{name}' of {path} is {shown(value)}: a number would be right") from None
    low, high, choices = parameter["min"], parameter["max"], parameter.get("choices", [number])
    if not low <= number <= high:
        raise InputError(f"the parameter '{name}' of {path} is {number:g}: {low:g} to {high:g} would be right")
    if number not in choices:
        allowed = ", ".join(f"{choice:g}" for choice in choices)
        raise InputError(f"the parameter '{name}' of {path} is {number:g}: one of {allowed} would be right")


def _extract(gmsh: Any, path: Path, dim: int) -> Parts:
    """The checked arrays of gmsh's current mesh, its nodes numbered from 0 without gaps."""
    regions = _named_entities(gmsh, path, dim)
    boundaries = _named_entities(gmsh, path, dim - 1)
    shape, cells, cell_entities = _elements(gmsh, path, dim, regions)
    if not len(cells):
        raise InputError(f"the physical groups of {path} hold no cells: a meshed surface or volume would be right")
    _, facets, facet_entities = _elements(gmsh, path, dim - 1, boundaries)
    named_facets = {name: facets[np.isin(facet_entities, entities)] for name, entities in boundaries.items()}
    for name, nodes in named_facets.items():
        check_facets(path, name, nodes, shape, cells)
    used, numbers = np.unique(cells, return_inverse=True)
    cells = numbers.reshape(cells.shape)
    points = _coordinates(gmsh, path, dim, used)
    check_corners(path, shape, points[cells], cell_entities)
    return Parts(
        shape,
        points,
        cells,
        {name: np.searchsorted(used, nodes) for name, nodes in named_facets.items()},
        {name: np.flatnonzero(np.isin(cell_entities, entities)) for name, entities in regions.items()},
    )


def _named_entities(gmsh: Any, path: Path, dim: int) -> dict[str, list[int]]:
    """Tags of the geometric entities in each physical group of one dimension."""
    named: dict[str, list[int]] = {}
    for _, tag in gmsh.model.getPhysicalGroups(dim):
        name = gmsh.model.getPhysicalName(dim, tag)
        if not name:
            raise InputError(
                f"the physical group {tag} of dimension {dim} in {path} has no name: "
                'one like Physical Curve("left") would be right'
            )
        named.setdefault(name, []).extend(gmsh.model.getEntitiesForPhysicalGroup(dim, tag))
    return named


def _elements(gmsh: Any, path: Path, dim: int, named: Mapping[str, list[int]]) -> tuple[str, Indices, Indices]:
    """Shape, nodes (elements, corners) in DOLFINx's order and entity (elements,) of the elements in named groups."""
    counts: dict[int, int] = {}
    nodes, entities = [], []
    for entity in sorted({entity for group in named.values() for entity in group}):
        for kind, tags, flat in zip(*gmsh.model.mesh.getElements(dim, entity), strict=True):
            counts[kind] = counts.get(kind, 0) + len(tags)
            nodes.append(flat.astype(np.int64).reshape(len(tags), -1))
            entities.append(np.full(len(tags), entity, dtype=np.int64))
    if not counts:
        return "", np.empty((0, 0), dtype=np.int64), np.empty(0, dtype=np.int64)
    if len(counts) > 1 or not counts.keys() <= _SHAPES.keys():
        found = (f"{count} {gmsh.model.mesh.getElementProperties(kind)[0]}" for kind, count in counts.items())
        raise InputError(
            f"the mesh of {path} has elements of gmsh's types {' and '.join(found)}: first-order elements "
            "of one shape would be right, triangles, quadrilaterals, tetrahedra or hexahedra"
        )
    shape, order = _SHAPES[next(iter(counts))]
    return shape, np.concatenate(nodes)[:, order], np.concatenate(entities)


def _coordinates(gmsh: Any, path: Path, dim: int, nodes: Indices) -> Floats:
    """Coordinates (nodes, dim) of the nodes with these gmsh tags."""
    tags, flat, _ = gmsh.model.mesh.getNodes()
    order = np.argsort(tags)
    place = np.minimum(np.searchsorted(tags, nodes, sorter=order), len(tags) - 1)
    if not np.array_equal(np.asarray(tags)[order[place]], nodes):
        raise InputError(f"the cells of {path} have nodes that it does not tell: a file that is whole would be right")
    points: Floats = flat.reshape(-1, 3)[order[place]]
    if not np.all(np.abs(points) <= LARGEST):
        raise InputError(
            f"{path} has nodes that are nowhere, or too far to be meant: finite coordinates would be right"
        )
    if dim == 2 and np.abs(points[:, 2]).max() > _OFF_PLANE * np.ptp(points, axis=0).max():
        raise InputError(f"the surfaces of {path} leave the plane z = 0: a plane mesh or named volumes would be right")
    return points[:, :dim]


def _quoted(names: Iterable[str]) -> str:
    return ", ".join(f"'{name}'" for name in sorted(names))
