"""Symmetric matrices that cells add up to, by node blocks of one half: without rows, search or what is held.

Each pair of nodes of a cell knows its block from the start, so that a cell costs its kernel and one addition for each
entry of that half.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import dolfinx
import numpy as np

from growthx.common.communicators import steady
from growthx.fem import compat, implicit, kernels

if TYPE_CHECKING:
    from collections.abc import Sequence

    from growthx.common.arrays import Floats, Indices

DECLARATIONS = """
void add(uintptr_t kernel, int count, uintptr_t x, uintptr_t corners, int corners_of_cell, uintptr_t w, int width,
         uintptr_t c, int nodes, int block, uintptr_t places, uintptr_t A, uintptr_t values);
"""

SOURCE = """
#include <stdint.h>
#include <string.h>

typedef void tabulate(double* restrict, const double* restrict, const double* restrict, const double* restrict,
                      const int* restrict, const uint8_t* restrict{extra_type});

enum {{ MOST = 64 }};

/* corners: of each cell that is added, rows of x.  places: of each pair of its nodes a ≥ b, twice its block, and one
   more where a is the higher one in the matrix, too.  A: room for the matrix of one cell. */
static void add(uintptr_t kernel, int count, uintptr_t x_, uintptr_t corners_, int corners_of_cell, uintptr_t w_,
                int width, uintptr_t c, int nodes, int block, uintptr_t places_, uintptr_t A_, uintptr_t values_)
{{
  const double *x = (const double*)x_, *w = (const double*)w_;
  const int32_t *corners = (const int32_t*)corners_, *place = (const int32_t*)places_;
  double *A = (double*)A_, *values = (double*)values_, coordinates[3 * MOST];
  const int size = nodes * block;
  for (int cell = 0; cell < count; ++cell)
  {{
    for (int i = 0; i < corners_of_cell; ++i)
      memcpy(coordinates + 3 * i, x + 3 * corners[cell * corners_of_cell + i], 3 * sizeof(double));
    memset(A, 0, size * size * sizeof(double));
    ((tabulate*)kernel)(A, w + (int64_t)cell * width, (const double*)c, coordinates, 0, 0{extra_pass});
    for (int a = 0; a < nodes; ++a)
      for (int b = 0; b <= a; ++b, ++place)
      {{
        double *to = values + (int64_t)(*place >> 1) * block * block;
        const int row = *place & 1 ? a : b, column = *place & 1 ? b : a;
        for (int i = 0; i < block; ++i)
          for (int j = 0; j < block; ++j)
            to[i * block + j] += A[(row * block + i) * size + column * block + j];
      }}
  }}
}}
"""
MOST_CORNERS = 64  # of a cell: as in the C code


class CellSums:
    """The sum of this rank's cells, as blocks of pairs of nodes.

    pairs: the higher and the lower node of each block, rising, by their global numbers, shape (blocks, 2).
    """

    def __init__(self, space: dolfinx.fem.FunctionSpace) -> None:
        """space: of a displacement (collective)."""
        topology = space.mesh.topology
        cells = topology.index_map(topology.dim).size_local
        self._library = _library(steady(space.mesh.comm))
        self._space, self._block = space, space.dofmap.bs
        dofs = space.dofmap.list[:cells]
        nodes = space.dofmap.index_map.local_to_global(dofs.ravel()).reshape(dofs.shape)
        first, second = np.tril_indices(dofs.shape[1])
        here, there = nodes[:, first], nodes[:, second]
        number = space.dofmap.index_map.size_global
        keys, places = np.unique(np.maximum(here, there) * number + np.minimum(here, there), return_inverse=True)
        self.pairs = np.column_stack([keys // number, keys % number])
        self._places = (2 * places.reshape(here.shape) + (here >= there)).astype(np.int32)
        self._corners = np.ascontiguousarray(compat.geometry_nodes(space.mesh)[:cells], dtype=np.int32)

    def __call__(self, forms: Sequence[Any]) -> Floats:
        """The sum of forms by `condensed_tangent` as they are now, shape (blocks, block, block)."""
        values = np.zeros((len(self.pairs), self._block, self._block))
        for form in forms:
            self._add(form, values)
        return values

    def _add(self, form: Any, values: Floats) -> None:
        cells: Indices = form.kernel_cells
        if not len(cells):
            return
        implicit.refresh(form)
        if form.sweep is not None:
            form.sweep(cells, self._places, values)
            return
        whole = len(cells) == len(self._places)
        corners, places = (each if whole else each[cells] for each in (self._corners, self._places))
        constants = dolfinx.cpp.fem.pack_constants(form._cpp_object)
        (coefficients,) = dolfinx.cpp.fem.pack_coefficients(form._cpp_object).values()
        coefficients, x = np.ascontiguousarray(coefficients), self._space.mesh.geometry.x
        nodes = self._space.dofmap.dof_layout.num_dofs
        matrix = np.empty((nodes * self._block) ** 2)
        self._library.add(
            form.kernel,
            len(cells),
            x.ctypes.data,
            corners.ctypes.data,
            corners.shape[1],
            coefficients.ctypes.data,
            coefficients.shape[-1] if coefficients.size else 0,
            constants.ctypes.data,
            nodes,
            self._block,
            places.ctypes.data,
            matrix.ctypes.data,
            values.ctypes.data,
        )


def can_be_added(space: dolfinx.fem.FunctionSpace) -> bool:
    """Whether cells of a space add up without turning its functions, as those of high degrees are."""
    few = compat.geometry_nodes(space.mesh).shape[1] <= MOST_CORNERS
    return few and not space.element.needs_dof_transformations


def _library(comm: Any) -> Any:
    source = SOURCE.format(extra_type=compat.KERNEL_EXTRA_TYPE, extra_pass=", 0" if compat.KERNEL_EXTRA_TYPE else "")
    return kernels.library(comm, source, DECLARATIONS, "cells")
