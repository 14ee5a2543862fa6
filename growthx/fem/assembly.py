"""Compiling weak forms, on the clock, and assembling: linear forms, and means of what cells say."""

from __future__ import annotations

import functools
import time
from typing import TYPE_CHECKING, Any

import dolfinx
import numpy as np
import ufl

from growthx.fem import implicit, kernels
from growthx.fem.condensation import Elimination, condensed_tangent
from growthx.fem.point_values import check_expression, check_form
from growthx.fem.sums import node_blocks, sweeps

if TYPE_CHECKING:
    from growthx.common.arrays import Floats, Indices


class Compiler:
    """Compiles weak forms and keeps the time it took: generating, compiling and loading them.

    implicits: values that forms may ask for by their symbols.
    """

    def __init__(self) -> None:
        self.seconds = 0.0
        self.implicits: list[implicit.Implicit] = []

    def __call__(self, build: Any, *arguments: Any) -> Any:
        """Call `build`, which compiles something, on the clock."""
        start = time.perf_counter()
        try:
            return build(*arguments)
        finally:
            self.seconds += time.perf_counter() - start

    def form(self, form: ufl.Form) -> dolfinx.fem.Form:
        """The compiled form."""
        return self._form(form)[1]

    def residual(self, form: ufl.Form) -> dolfinx.fem.Form:
        """A compiled linear form that is assembled often: `assemble` takes several of its cells at once, if it can."""
        form, compiled = self._form(form)
        compiled.sweep = self(sweeps.of_vectors, form, compiled)  # type: ignore[attr-defined]
        return compiled

    def tangent(self, form: ufl.Form) -> dolfinx.fem.Form:
        """A compiled bilinear form of all unknowns.  by_nodes: of it, what adds it up for `NodeBlocks`, if anything."""
        form, compiled = self._form(form)
        compiled.by_nodes = functools.cache(functools.partial(self, node_blocks.of_blocks, form, compiled))  # type: ignore[attr-defined]
        return compiled

    def _form(self, form: ufl.Form) -> tuple[ufl.Form, dolfinx.fem.Form]:
        """What was compiled, with values at points in the place of symbols, and the compiled form."""
        form, values = implicit.at_points(form, self.implicits, self.expression)
        check_form(form)
        return form, _with_values(self(kernels.form, form), values)

    def expression(self, value: Any, X: Floats) -> dolfinx.fem.Expression:
        """The compiled expression, for points X of the reference cell, (points, dim)."""
        value, values = implicit.at_places(value, X, self.implicits, self.expression)
        check_expression(value, X)
        return _with_values(self(kernels.expression, value, X), values)

    def condensed_tangent(self, tangents: list[ufl.Form], elimination: Elimination) -> dolfinx.fem.Form:
        """See `condensation.condensed_tangent`."""
        found = [implicit.at_points(form, self.implicits, self.expression) for form in tangents]
        compiled = self(condensed_tangent, [form for form, _ in found], elimination)
        return _with_values(compiled, [each for _, values in found for each in values])


def _with_values(compiled: Any, values: list[implicit.PointValues]) -> Any:
    compiled.implicit_values = values
    return compiled


def assemble(form: dolfinx.fem.Form) -> Floats:
    """The entries of a linear form this rank owns, with the other ranks' parts of them added (collective)."""
    implicit.refresh(form)
    dofmap = form.function_spaces[0].dofmap
    vector = _kept_vector(form, dofmap, dofmap.index_map_bs)
    sweep = getattr(form, "sweep", None)
    if sweep is None:
        dolfinx.fem.assemble_vector(vector.array, form)
    else:
        sweep(vector.array)
    vector.scatter_reverse(dolfinx.la.InsertMode.add)
    return np.array(vector.array[: dofmap.index_map.size_local * dofmap.index_map_bs])


def _kept_vector(owner: Any, dofmap: Any, block: int) -> Any:
    """A vector of zeros of a dofmap, which its owner keeps: each new one has MPI look for two communicators of its own.

    block: entries of each of its nodes.
    """
    kept = vars(owner).setdefault("_vectors", {})
    if block not in kept:
        kept[block] = dolfinx.la.vector(dofmap.index_map, block)
    kept[block].array[:] = 0.0
    return kept[block]


def integral(form: dolfinx.fem.Form) -> float:
    """The number that a form of no argument is on this rank."""
    implicit.refresh(form)
    return float(dolfinx.fem.assemble_scalar(form).real)


def values_at_points(expression: dolfinx.fem.Expression, domain: dolfinx.mesh.Mesh, cells: Indices) -> Floats:
    """What an expression is at its points of some cells, as DOLFINx has it."""
    implicit.refresh(expression)
    return np.asarray(expression.eval(domain, cells))


def cell_means(domain: dolfinx.mesh.Mesh, values: list[Any], volume: ufl.Measure, compile: Compiler) -> Floats:
    """Means of UFL scalars over the owned cells by a measure of the whole volume, shape (cells, values)."""
    return CellMeans(domain, values, volume, compile)()


class CellMeans:
    """The same, compiled once for all that their coefficients may become."""

    def __init__(
        self,
        domain: dolfinx.mesh.Mesh,
        values: list[Any],
        volume: ufl.Measure,
        compile: Compiler,
        *,
        often: bool = False,
    ) -> None:
        """often: whether they are asked for often, see `Compiler.residual`."""
        space = dolfinx.fem.functionspace(domain, ("DG", 0, (len(values),)))
        test, ones = ufl.TestFunction(space), [1.0] * len(values)
        total, sizes = (ufl.inner(ufl.as_vector(each), test) * volume for each in (values, ones))
        self._total = compile.residual(total) if often else compile.form(total)
        self._shape = -1, len(values)
        self._volumes = assemble(compile.form(sizes)).reshape(self._shape)

    def __call__(self) -> Floats:
        """The means of what the values are now."""
        return np.asarray(assemble(self._total).reshape(self._shape) / self._volumes)


class CellAverages:
    """Means of what the cells around each degree of freedom of a scalar space say, for all that they may say.

    first: owned cells that alone are heard where there are any of them; None: all are.
    """

    def __init__(self, space: dolfinx.fem.FunctionSpace, first: Indices | None = None) -> None:
        """Collective."""
        topology = space.mesh.topology
        dofs = space.dofmap.list[: topology.index_map(topology.dim).size_local]
        heard = np.ones(dofs.shape)
        self._space, self._heard = space, None if first is None else heard
        if first is not None:
            heard[np.setdiff1d(np.arange(len(heard)), first)] = 0.0
            alone = sum_cells(space, heard[:, :, np.newaxis])[:, 0] == 0
            heard[alone[dofs]] = 1.0
        self._count = sum_cells(space, heard[:, :, np.newaxis])[:, 0]

    def __call__(self, values: Floats) -> Floats:
        """Those of values of each owned cell's degrees of freedom, (owned cells, dofs of a cell), as in `x.array`."""
        heard = values if self._heard is None else self._heard * values
        return np.asarray(sum_cells(self._space, heard[:, :, np.newaxis])[:, 0] / self._count)


def average_cells(
    space: dolfinx.fem.FunctionSpace, values: Floats, first: Indices | None = None
) -> dolfinx.fem.Function:
    """The function whose degrees of freedom are the means of what the cells around them say (collective).

    space: scalar.  values: of each owned cell's degrees of freedom, shape (owned cells, dofs of a cell).
    first: owned cells that alone are heard where there are any of them; None: all are.
    """
    mean = dolfinx.fem.Function(space)
    mean.x.array[:] = CellAverages(space, first)(values)
    return mean


def sum_cells(space: dolfinx.fem.FunctionSpace, values: Floats) -> Floats:
    """Sums of what the cells around each degree of freedom say, shape (local dofs, entries), the same on all ranks.

    space: scalar.  values: of each owned cell's degrees of freedom, shape (owned cells, dofs of a cell, entries).
    """
    dofmap, entries = space.dofmap, values.shape[2]
    total = _kept_vector(space, dofmap, entries)
    rows, columns = dofmap.list[: len(values)].ravel(), total.array.reshape(-1, entries)
    for entry in range(entries):
        columns[:, entry] = np.bincount(rows, values[:, :, entry].ravel(), len(columns))
    total.scatter_reverse(dolfinx.la.InsertMode.add)
    total.scatter_forward()
    return np.array(total.array.reshape(-1, entries))
