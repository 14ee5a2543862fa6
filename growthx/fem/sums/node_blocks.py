"""Tangents of displacements and nodal densities that cells add up to, entry by entry of what two nodes share.

Each pair of nodes of a cell knows its place from the start, so that a cell costs its kernel and one addition for each
entry; and what is asked of single blocks, of the displacement or of the densities, lies there without being taken out.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import dolfinx
import numpy as np

from growthx.common.communicators import steady
from growthx.fem import compat, implicit, kernels
from growthx.fem.sums import lanes, sweeps

if TYPE_CHECKING:
    from collections.abc import Sequence

    import ufl

    from growthx.common.arrays import Floats, Indices

ADD_BLOCKS = """
int width(void);
void add_blocks(int integral, uintptr_t cells, int count, uintptr_t body, uintptr_t fields, uintptr_t c, int nodes,
                int block, uintptr_t order, uintptr_t places, int64_t pairs, uintptr_t K, uintptr_t values);
"""

OF_BLOCKS = """
typedef void kernel(lanes *restrict, const lanes *restrict, const double *restrict, const lanes *restrict);
static kernel *const kernels[] = {%(names)s};

/* order: of each node's unknowns, rows of a cell's matrix.  places: of all cells' pairs of nodes, as the values have
   them, an array of all pairs for each entry that two nodes share. */
static void add_blocks(int integral, uintptr_t cells_, int count, uintptr_t body_, uintptr_t fields, uintptr_t c,
                       int nodes, int block, uintptr_t order_, uintptr_t places, int64_t pairs, uintptr_t K_,
                       uintptr_t values_)
{
  const body *of = (const body *)body_;
  const int32_t *cells = (const int32_t *)cells_, *order = (const int32_t *)order_;
  const int size = nodes * block;
  lanes coordinates[3 * of->corners_of_cell], w[of->width + 1], *K = (lanes *)K_;
  for (int first = 0; first < count; first += LANES)
  {
    gather(of, (const field *)fields, cells, count, first, coordinates, w);
    memset(K, 0, size * size * sizeof(lanes));
    kernels[integral](K, w, (const double *)c, coordinates);
    for (int l = 0; l < LANES && first + l < count; ++l)
    {
      const int32_t *place = (const int32_t *)places + (int64_t)cells[first + l] * nodes * nodes;
      const double *from = (const double *)K + l;
      for (int a = 0; a < nodes; ++a)
        for (int b = 0; b < nodes; ++b)
        {
          double *to = (double *)values_ + *place++;
          for (int i = 0; i < block; ++i)
            for (int j = 0; j < block; ++j, to += pairs)
              *to += from[(order[a * block + i] * size + order[b * block + j]) * LANES];
        }
    }
  }
}
"""

TIMES = """
void times(int nodes, uintptr_t starts, uintptr_t columns, int64_t pairs, int block, int row, int rows, int column,
           int columns, uintptr_t values, uintptr_t x, uintptr_t y);
"""
PRODUCT = """
#include <stdint.h>

/* y = A x for some of the rows and columns of all blocks.  x, y: (nodes, columns) and (nodes, rows). */
static void times(int nodes, uintptr_t starts_, uintptr_t columns_, int64_t pairs, int block, int row, int rows,
                  int column, int columns, uintptr_t values_, uintptr_t x_, uintptr_t y_)
{
  const int32_t *starts = (const int32_t *)starts_, *other = (const int32_t *)columns_;
  const double *x = (const double *)x_;
  double *y = (double *)y_;
  for (int node = 0; node < nodes; ++node)
    for (int i = 0; i < rows; ++i)
    {
      double sum = 0.0;
      for (int j = 0; j < columns; ++j)
      {
        const double *values = (const double *)values_ + ((row + i) * block + column + j) * pairs;
        for (int k = starts[node]; k < starts[node + 1]; ++k)
          sum += values[k] * x[other[k] * columns + j];
      }
      y[node * rows + i] = sum;
    }
}
"""


@dataclass(frozen=True)
class _OfBlocks:
    """The recipe of a library that adds up a form's matrices."""

    declarations: str = ADD_BLOCKS

    @property
    def frame(self) -> str:
        return lanes.TYPES + lanes.FUNCTIONS + sweeps.GATHER + OF_BLOCKS

    def source(self, codes: list[str]) -> str | None:
        return sweeps.of_one_form(codes[0], OF_BLOCKS)


class BlockSweep:
    """Adds up a bilinear form of displacements and densities."""

    def __init__(self, library: Any, form: dolfinx.fem.Form, space: Any, coefficients: list[Any]) -> None:
        """library: by `_OfBlocks`.  coefficients: of the compiled form, in its order."""
        self._library, self._form = library, form
        self._body, self._cells = sweeps.Body(space.mesh, coefficients), compat.cells_of_integrals(form)
        room = np.empty((sweeps.values_in_a_cell(space) ** 2 + 1) * library.width())
        self._matrix = room[-room.ctypes.data % 64 // room.itemsize :]

    def __call__(self, order: Indices, places: Indices, values: Floats) -> None:
        """Add what the form is now.

        order: (nodes, block).  places: (cells, nodes²).  values: (block, block, pairs).
        """
        implicit.refresh(self._form)
        constants = dolfinx.cpp.fem.pack_constants(self._form._cpp_object)
        body = self._body.look()
        for integral, cells in enumerate(self._cells):
            self._library.add_blocks(
                integral,
                cells.ctypes.data,
                len(cells),
                *body,
                constants.ctypes.data,
                *order.shape,
                order.ctypes.data,
                places.ctypes.data,
                values.shape[-1],
                self._matrix.ctypes.data,
                values.ctypes.data,
            )


def of_blocks(weak_form: ufl.Form, form: dolfinx.fem.Form) -> BlockSweep | None:
    """What adds up a bilinear form, given as it was compiled; None if nothing does (collective)."""
    if len(weak_form.arguments()) < 2:
        return None  # of a form that is zero
    space = weak_form.arguments()[0].ufl_function_space()
    entries = sweeps.values_in_a_cell(space) ** 2
    if entries > sweeps.MOST_ENTRIES:
        return None
    found = sweeps.compiled(weak_form, _OfBlocks(), sweeps.FEWEST * sweeps.FEWEST_ENTRIES / entries)
    return None if found is None else BlockSweep(found[0], form, space, found[1])


class NodeBlocks:
    """The sum of a rank's cells for unknowns that all belong to nodes: displacements, one after another, and a density.

    places: of each node's unknowns in the function of all of them, shape (nodes, block).
    starts, columns: of the pairs of nodes, by rows, rising.  values: shape (block, block, pairs).
    """

    def __init__(self, space: dolfinx.fem.FunctionSpace, whole: dolfinx.fem.FunctionSpace) -> None:
        """space: of a displacement.  whole: of all unknowns, see `are_of_nodes`; both on one rank."""
        cells, dofs = space.dofmap.list, whole.dofmap.list
        nodes, dim = cells.shape[1], space.dofmap.bs
        displacements = np.arange(dofs.shape[1] - nodes, dtype=np.int32).reshape(-1, nodes, dim)
        density = np.arange(dofs.shape[1] - nodes, dofs.shape[1], dtype=np.int32)
        self._order = np.ascontiguousarray(np.column_stack([*displacements, density]))
        count = space.dofmap.index_map.size_local
        self.places = np.empty((count, self._order.shape[1]), dtype=np.int32)
        self.places[cells] = dofs[:, self._order]
        keys = cells[:, :, np.newaxis].astype(np.int64) * count + cells[:, np.newaxis, :]
        keys, places = np.unique(keys.ravel(), return_inverse=True)
        self._pairs = np.ascontiguousarray(places.reshape(len(cells), -1), dtype=np.int32)
        rows = keys // count
        self.columns = (keys % count).astype(np.int32)
        self.starts = np.searchsorted(rows, np.arange(count + 1)).astype(np.int32)
        self.rows = rows.astype(np.int32)
        self.values = np.zeros((self._order.shape[1],) * 2 + (len(keys),))
        self._sweeps: dict[int, BlockSweep | None] = {}
        self._library = kernels.library(steady(space.mesh.comm), PRODUCT, TIMES, "node blocks")

    def add_up(self, forms: Sequence[Any]) -> bool:
        """The sum of forms by `Compiler.tangent` as they are now; whether each of them can be added so."""
        sweeps = [form.by_nodes() if hasattr(form, "by_nodes") else None for form in forms]
        self.values[:] = 0.0
        for sweep in sweeps:
            if sweep is None:
                return False
            sweep(self._order, self._pairs, self.values)
        return True

    def times(self, rows: slice, columns: slice, x: Floats) -> Floats:
        """The product of some rows and columns of all blocks with a vector, (nodes, columns): (nodes, rows)."""
        block = len(self.values)
        (row, row_end, _), (column, column_end, _) = rows.indices(block), columns.indices(block)
        x, y = np.ascontiguousarray(x), np.empty((len(self.places), row_end - row))
        self._library.times(
            len(y),
            self.starts.ctypes.data,
            self.columns.ctypes.data,
            self.values.shape[-1],
            block,
            row,
            row_end - row,
            column,
            column_end - column,
            self.values.ctypes.data,
            x.ctypes.data,
            y.ctypes.data,
        )
        return y


def are_of_nodes(space: dolfinx.fem.FunctionSpace, whole: dolfinx.fem.FunctionSpace, displacements: int) -> bool:
    """Whether all unknowns are those of a displacement's nodes, of so many displacements and a density."""
    nodes = space.dofmap.list.shape[1]
    return bool(whole.dofmap.bs == 1 and whole.dofmap.list.shape[1] == nodes * (displacements * space.dofmap.bs + 1))
