"""Where in a body something is not as it should be, in words."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import dolfinx
import numpy as np
import ufl

from growthx.common.communicators import steady
from growthx.common.words import place_in_words
from growthx.fem.assembly import Compiler, assemble

if TYPE_CHECKING:
    from mpi4py import MPI

    from growthx.common.arrays import Floats, Marks


class Exceptions:
    """Cells with an integration point at which a condition does not hold, looked for as often as is asked."""

    def __init__(
        self, condition: Any, volume: ufl.Measure, space: dolfinx.fem.FunctionSpace, compile: Compiler
    ) -> None:
        """condition: in UFL; where a side of it is not a number it does not hold.  volume: with the points.

        space: any on the mesh.
        """
        self._domain, self._comm = space.mesh, steady(space.mesh.comm)
        each_cell = ufl.TestFunction(dolfinx.fem.functionspace(self._domain, ("DG", 0)))
        self._count = compile.form(ufl.conditional(condition, 0.0, 1.0) * each_cell * volume)

    def first(self) -> str:
        """Midpoint of the first such cell on any rank, as text; empty if there is none (collective)."""
        topology = self._domain.topology
        cells = np.arange(topology.index_map(topology.dim).size_local, dtype=np.int32)
        midpoints = dolfinx.mesh.compute_midpoints(self._domain, topology.dim, cells)
        return first_place(~(assemble(self._count) == 0), midpoints, topology.dim, self._comm)


def first_place(wrong: Marks, where: Floats, dim: int, comm: MPI.Intracomm) -> str:
    """Position of the first entry that is wrong on any rank, as text; empty if none is (collective)."""
    found = np.flatnonzero(wrong)
    places = comm.allgather(where[found[0]] if len(found) else None)
    place = next((place for place in places if place is not None), None)
    if place is None:
        return ""
    tidy = np.where(np.abs(place) < 1e-12 * np.abs(place).max(), 0.0, place)
    return place_in_words(tidy[:dim], 4)
