"""Compiling weak forms, on the clock, and assembling: linear forms, and means of what cells say."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import dolfinx
import numpy as np

from growthx import kernels

if TYPE_CHECKING:
    import ufl

    from growthx.arrays import Floats


class Compiler:
    """Compiles weak forms and keeps the time it took: generating, compiling and loading them."""

    def __init__(self) -> None:
        self.seconds = 0.0

    def __call__(self, build: Any, *arguments: Any) -> Any:
        """Call `build`, which compiles something, on the clock."""
        start = time.perf_counter()
        try:
            return build(*arguments)
        finally:
            self.seconds += time.perf_counter() - start

    def form(self, form: ufl.Form) -> dolfinx.fem.Form:
        """The compiled form."""
        return self(kernels.form, form)

    def expression(self, value: Any, X: Floats) -> dolfinx.fem.Expression:
        """The compiled expression, for points X of the reference cell, (points, dim)."""
        return self(kernels.expression, value, X)


def assemble(form: dolfinx.fem.Form) -> Floats:
    """The entries of a linear form this rank owns, with the other ranks' parts of them added (collective)."""
    dofmap = form.function_spaces[0].dofmap
    vector = dolfinx.la.vector(dofmap.index_map, dofmap.index_map_bs)
    dolfinx.fem.assemble_vector(vector.array, form)
    vector.scatter_reverse(dolfinx.la.InsertMode.add)
    return vector.array[: dofmap.index_map.size_local * dofmap.index_map_bs]


def average_cells(space: dolfinx.fem.FunctionSpace, values: Floats) -> dolfinx.fem.Function:
    """The function whose degrees of freedom are the means of what the cells around them say (collective).

    space: scalar.  values: of each owned cell's degrees of freedom, shape (owned cells, dofs of a cell).
    """
    total, count = sum_cells(space, np.stack([values, np.ones_like(values)], axis=2)).T
    mean = dolfinx.fem.Function(space)
    mean.x.array[:] = total / count
    return mean


def sum_cells(space: dolfinx.fem.FunctionSpace, values: Floats) -> Floats:
    """Sums of what the cells around each degree of freedom say, shape (local dofs, entries), the same on all ranks.

    space: scalar.  values: of each owned cell's degrees of freedom, shape (owned cells, dofs of a cell, entries).
    """
    dofmap, entries = space.dofmap, values.shape[2]
    total = dolfinx.la.vector(dofmap.index_map, entries)
    total.array[:] = 0.0
    np.add.at(total.array.reshape(-1, entries), dofmap.list[: len(values)], values)
    total.scatter_reverse(dolfinx.la.InsertMode.add)
    total.scatter_forward()
    return np.array(total.array.reshape(-1, entries))
