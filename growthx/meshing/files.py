"""Meshes from files and arrays: read on rank 0, checked, split and spread over the ranks."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable, Mapping
from numbers import Integral
from pathlib import Path
from typing import Any, cast

from mpi4py import MPI

from growthx.common.checks import require_kind, require_name
from growthx.common.communicators import steady
from growthx.common.errors import InputError, shown
from growthx.common.installed import PACKAGE
from growthx.common.renamed import renamed
from growthx.meshing import formats
from growthx.meshing.assembly.arrays import as_content
from growthx.meshing.assembly.body import LARGEST, assemble
from growthx.meshing.content import Content
from growthx.meshing.distribution import distribute
from growthx.meshing.mesh import Mesh
from growthx.meshing.parts import Parts, check
from growthx.meshing.refinement import split

PLANE_CELLS = ("quadrilateral", "triangle")


def load_gmsh() -> None:
    """Import gmsh ahead of its use, for a program that counts imports and set-up apart (rank 0 only, as elsewhere).

    Example:
        >>> gx.meshing.load_gmsh()  # a second or so, once
        >>> gx.meshing.read(gx.meshing.locate("bar.geo")).dim
        2
    """
    if MPI.COMM_WORLD.rank == 0:
        from growthx.meshing.formats import gmsh

        gmsh.load()


def locate(name: str) -> Path:
    """Path of a file of growthx's own `meshes` folder, in a checkout or installed; InputError if there is none.

    Example:
        >>> gx.meshing.locate("femur.geo").name
        'femur.geo'
    """
    require_name(name, "the name of a mesh file")
    folders = [folder for folder in (PACKAGE / "meshes", PACKAGE.parent / "meshes") if folder.is_dir()]
    for folder in folders:
        if (folder / name).is_file():
            return folder / name
    known = ", ".join(sorted(file.name for folder in folders for file in folder.iterdir() if file.is_file()))
    raise InputError(f"growthx has no mesh file '{name}'; it has {known or 'none at all'}")


@renamed(cells="shape")
def triangles(shape: str) -> bool:
    """The parameter `triangles` of growthx's own scripts for cells of that shape; InputError if they have none such.

    Example:
        >>> gx.meshing.triangles("triangle"), gx.meshing.triangles("quadrilateral")
        (True, False)
    """
    if shape not in PLANE_CELLS:
        raise InputError(f"there are no cells '{shape}' in the plane: {' or '.join(PLANE_CELLS)} would be right")
    return shape == "triangle"


def read(
    path: str | Path,
    *,
    refine: int = 1,
    keep: str | None = None,
    merge: bool = False,
    trusted: bool = False,
    comm: MPI.Comm = MPI.COMM_WORLD,
    **parameters: float,
) -> Mesh:
    """Read a file of a mesh and distribute it over the ranks of `comm` (collective).

    Its suffix tells the format, see `formats` and docs/meshes.md.  Groups of cells (gmsh's physical groups, sets of
    elements, parts) name regions, cells in none are the region "all"; groups and sets of facets or nodes name
    boundaries, outside or inside the body.  A cell or facet may be in several, and a group without a name is named by
    its number.  Lengths are in the file's unit.  What is left out or changed in reading is logged as a warning.

    path: the file, looked up on rank 0
    refine: K splits every cell of a two-dimensional mesh uniformly into K x K, with straight sides
    keep: "largest" leaves out all cells that are not connected to most of the body
    merge: make one node of those that stand in one place
    trusted: let a script run programs and write files, as gmsh's can: for scripts whose author you know
    parameters: values for parameters of the file, such as those that a .geo script defines (DefineConstant with a
        Name), by the last part of their names or, where several end alike, their whole names

    InputError, on all ranks, if the file or a parameter is not usable.

    Example:
        >>> mesh = gx.meshing.read(gx.meshing.locate("femur_658.msh"))
        >>> mesh.cell_name, mesh.cell_count, sorted(mesh.regions), sorted(mesh.boundaries)
        ('quadrilateral', 658, ['bone'], ['distal', 'surface'])
    """

    def whole() -> Parts:
        require_kind(path, (str, Path), "the file of a mesh", "its path")
        check_options(refine, keep, merge, trusted)
        parts = _whole(Path(path), parameters, keep, merge, trusted)
        return split(parts, refine, path)

    return _on_all(whole, str(path), comm)


def from_arrays(
    points: Any,
    cells: Any,
    *,
    regions: Mapping[str, Any] | None = None,
    boundaries: Mapping[str, Any] | None = None,
    cell_data: Mapping[str, Any] | None = None,
    shape: str | None = None,
    refine: int = 1,
    keep: str | None = None,
    merge: bool = False,
    comm: MPI.Comm = MPI.COMM_WORLD,
) -> Mesh:
    """The mesh of arrays, as meshio, pyvista and trimesh have them, distributed over the ranks (collective).

    Those of rank 0 count.  All numbers count from 0.

    points: coordinates of the nodes, (nodes, 2) or (nodes, 3)
    cells: nodes of each cell, (cells, corners or more), in the order of VTK and gmsh, which goes round; what follows
        the corners is of elements of higher order and left out
    regions: cells of each named region, (cells of the region,), or True for each of them, (cells,)
    boundaries: for each named boundary the nodes of its facets, (facets, corners of a facet), or a set of nodes,
        (nodes of the set,), which is the boundary of the sides with all of their corners in it
    cell_data: one value for each cell by the name of the data, see `Mesh.cell_values`
    shape: of the cells, such as "tetrahedron"; None: from the number of their nodes
    refine, keep, merge: as in `read`

    InputError, on all ranks, if no mesh can be made of them.

    Example:
        >>> corners, cells = [(0, 0), (1, 0), (1, 1), (0, 1)], [(0, 1, 2), (0, 2, 3)]
        >>> gx.meshing.from_arrays(corners, cells, boundaries={"left": [(3, 0)]}, refine=2).cell_count
        8
    """

    def whole() -> Parts:
        check_options(refine, keep, merge)
        content = as_content(points, cells, regions or {}, boundaries or {}, cell_data or {}, shape)
        parts = assemble(content, "the arrays", keep, merge)
        check(parts, "the arrays")
        return split(parts, refine, "the arrays")

    return _on_all(whole, "arrays", comm)


def _on_all(whole: Callable[[], Parts], what: str, comm: MPI.Comm) -> Mesh:
    """The mesh whose parts rank 0 alone makes; what it raises is raised on all ranks (collective)."""
    parts: Parts | None = None
    problem: Exception | None = None
    comm = steady(comm)
    if comm.rank == 0:
        try:
            parts = whole()
        except InputError as error:
            problem = error
        except OSError as error:
            problem = InputError(
                f"the file {what} cannot be read ({error.strerror or error}): check its path and permissions"
            )
        except MemoryError:
            problem = InputError(f"the mesh of {what} does not fit into memory: a smaller one would be right")
        except Exception as error:  # not foreseen, but the other ranks must not wait for ever
            problem = RuntimeError(f"reading {what} failed: {shown(error)}")
            problem.__cause__ = error
    problem = comm.bcast(problem)
    if problem is not None:
        raise problem
    if parts is not None:
        for notice in parts.notices:
            logging.getLogger("growthx").warning("growthx: %s", notice)
    return distribute(parts, comm)


def _whole(path: Path, parameters: Mapping[str, float], keep: str | None, merge: bool, trusted: bool) -> Parts:
    """The whole mesh in a file, looked at."""
    parts = assembled(content_of(path, parameters, trusted), path, keep, merge)
    check(parts, path)
    return parts


def assembled(found: Content | Parts, path: Path, keep: str | None, merge: bool) -> Parts:
    """The whole mesh in what a file holds, not yet looked at; InputError if none can be made of it."""
    if isinstance(found, Content):
        return assemble(found, path, keep, merge)
    if keep is not None or merge:
        raise InputError(f"the format of {path} knows no keep and no merge: none would be right")
    return found


def content_of(path: Path, parameters: Mapping[str, float] | None = None, trusted: bool = False) -> Content | Parts:
    """What a file holds, read on this rank alone, not yet looked at: Parts where its format makes those itself."""
    form = formats.of(path)
    if not path.is_file():
        raise InputError(f"there is no file {path}: the path of {' or '.join(formats.in_words())} would be right")
    if not os.access(path, os.R_OK):
        raise InputError(f"the file {path} may not be read: check its permissions")
    if getattr(form, "IS_PROGRAM", False):
        return cast(formats.Program, form).read(path, parameters or {}, trusted)
    return form.read(path, parameters or {})


def check_options(refine: int, keep: str | None, merge: bool, trusted: bool = False) -> None:
    """Refuse options of `read` that are none."""
    if not isinstance(refine, Integral) or isinstance(refine, bool) or refine < 1:
        raise InputError(f"refine is {shown(refine)}: a whole number of at least 1 would be right")
    if keep not in (None, LARGEST):
        raise InputError(f'keep is {shown(keep)}: None, for all cells, or "{LARGEST}" would be right')
    for name, value in (("merge", merge), ("trusted", trusted)):
        if not isinstance(value, bool):
            raise InputError(f"{name} is {shown(value)}: True or False would be right")
