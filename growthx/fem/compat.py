"""The differences between DOLFINx 0.9, 0.10 and 0.11, all of them."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, Any

import dolfinx
import numpy as np
from mpi4py import MPI

from growthx.common.communicators import steady

if TYPE_CHECKING:
    from collections.abc import Sequence

    from mpi4py import MPI

    from growthx.common.arrays import Floats, Indices


DOLFINX_VERSION: str = dolfinx.__version__  # type: ignore[attr-defined]
VERSION = tuple(int(part) for part in DOLFINX_VERSION.split(".")[:2])

# Since 0.10 a compiled kernel takes one more argument, a pointer to data of the caller's.
KERNEL_EXTRA_TYPE = ", void*" if VERSION >= (0, 10) else ""


def integral_kernel_address(ufcx_form: Any, ffi: Any) -> int:
    """Address of the compiled double-precision kernel of a form's only integral."""
    return int(ffi.cast("uintptr_t", ufcx_form.form_integrals[0].tabulate_tensor_float64))


def cell_form(
    spaces: Sequence[dolfinx.fem.FunctionSpace],
    kernel: int,
    cells: Indices,
    coefficients: Sequence[dolfinx.fem.Function],
    constants: Sequence[dolfinx.fem.Constant],
) -> dolfinx.fem.Form:
    """A form over some cells with a kernel of our own, given by its address."""
    active = np.arange(len(coefficients), dtype=np.int8)
    integral_type = getattr(dolfinx.cpp.fem, "_IntegralType", None) or dolfinx.cpp.fem.IntegralType
    mesh = spaces[0].mesh
    return dolfinx.fem.Form(
        dolfinx.cpp.fem.Form_float64(
            [space._cpp_object for space in spaces],
            {integral_type.cell: [(0, kernel, cells, active)]},
            [coefficient._cpp_object for coefficient in coefficients],
            [constant._cpp_object for constant in constants],
            False,
            [] if VERSION >= (0, 10) else {},
            mesh._cpp_object,
        )
    )


CELLS_OF_INTEGRALS = VERSION < (0, 10)  # whether the next function is known to do what it says


def cells_of_integrals(form: dolfinx.fem.Form) -> list[Indices]:
    """The cells of each of a form's integrals over cells, in the order of what FFCx has written."""
    integral_type = getattr(dolfinx.cpp.fem, "_IntegralType", None) or dolfinx.cpp.fem.IntegralType
    ids = form._cpp_object.integral_ids(integral_type.cell)
    domains = [form._cpp_object.domains(integral_type.cell, each) for each in ids]
    return [np.ascontiguousarray(cells, dtype=np.int32) for cells in domains]


def interpolation_points(element: Any) -> Floats:
    """Points of the reference cell, shape (points, dim), that interpolation into an element needs."""
    points = element.interpolation_points
    return points() if callable(points) else points


def cell_name(domain: Any) -> str:
    """Name of a mesh's cells, of the mesh or of its `ufl_domain()`: an attribute since UFL 2025.3, a method before."""
    cell = domain.ufl_cell()
    return cell.cellname() if callable(cell.cellname) else cell.cellname


def geometry_nodes(domain: dolfinx.mesh.Mesh) -> Indices:
    """Nodes of the cells' geometry, shape (cells, nodes of a cell), as rows of `domain.geometry.x`."""
    geometry = domain.geometry
    return np.asarray(geometry.dofmaps[0] if VERSION >= (0, 11) else geometry.dofmap)  # type: ignore[attr-defined]


def places(space: dolfinx.fem.FunctionSpace, part: dolfinx.fem.FunctionSpace) -> Indices:
    """Where each degree of freedom of a space is in the mixed space that has a part of the same element."""
    block = space.dofmap.bs
    cells, nodes = space.dofmap.list.shape
    alone = (block * space.dofmap.list[:, :, np.newaxis] + np.arange(block)).reshape(cells, nodes * block)
    found = np.empty(block * (space.dofmap.index_map.size_local + space.dofmap.index_map.num_ghosts), dtype=np.int32)
    found[alone] = part.dofmap.list.reshape(alone.shape)
    return found


def let_dolfinx_compile_on_steady_ones() -> None:
    """Have DOLFINx tell the ranks of a mesh on a steady one whether a form was compiled: it does so in lower case."""
    compile_ = dolfinx.jit.ffcx_jit
    if hasattr(compile_, "steady"):
        return

    @functools.wraps(compile_)
    def compile_on_steady(comm: MPI.Comm, *arguments: Any, **options: Any) -> Any:
        return compile_(steady(comm), *arguments, **options)

    # What it wraps is what DOLFINx' own wraps: what one rank does.
    compile_on_steady.__wrapped__ = compile_.__wrapped__
    compile_on_steady.steady = True  # type: ignore[attr-defined]
    dolfinx.jit.ffcx_jit = compile_on_steady
