"""Compiling weak forms, on the clock, and assembling linear ones."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import dolfinx

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
        return self(dolfinx.fem.form, form)


def assemble(form: dolfinx.fem.Form) -> Floats:
    """The entries of a linear form this rank owns, with the other ranks' parts of them added (collective)."""
    dofmap = form.function_spaces[0].dofmap
    vector = dolfinx.la.vector(dofmap.index_map, dofmap.index_map_bs)
    dolfinx.fem.assemble_vector(vector.array, form)
    vector.scatter_reverse(dolfinx.la.InsertMode.add)
    return vector.array[: dofmap.index_map.size_local * dofmap.index_map_bs]
