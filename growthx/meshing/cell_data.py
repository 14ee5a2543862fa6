"""One value for each cell, in the order of the file or of the arrays that a mesh was made of."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from growthx.common.communicators import same_on_all
from growthx.common.errors import InputError, raise_on_all, shown
from growthx.common.words import quoted_names

if TYPE_CHECKING:
    from mpi4py import MPI

    from growthx.common.arrays import Floats
    from growthx.meshing.content import Origin


def of_cells(values: Any, origin: Origin, comm: MPI.Comm) -> Floats:
    """The values of the cells that this rank knows, (cells,), NaN where there is none.

    values: the name of data that came with the mesh, or one number for each cell there, the same on all ranks.

    InputError, on all ranks, if they are none (collective).
    """
    if not isinstance(values, str):
        return _of_file(values, origin.cell_count, comm)[origin.cells]
    known = sorted(set().union(*comm.allgather(list(origin.values))))
    if values not in known:
        raise InputError(f"the mesh came without values '{values}' of its cells; it has {quoted_names(known)}")
    return origin.values[values]


def _of_file(values: Any, count: int, comm: MPI.Comm) -> Floats:
    """Values for all cells that there were, as an array."""
    trouble = ""
    try:
        found = np.asarray(values)
        if found.dtype.kind not in "iuf" or found.shape != (count,):
            trouble = f"the values of cells are {shown(values)}, of shape {found.shape}"
    except ValueError:
        trouble = f"the values of cells are {shown(values)}"
    right = f"one number for each of the {count} cells of the file would be right"
    raise_on_all(comm, trouble and f"{trouble}: {right}")
    found = found.astype(float)
    if not same_on_all(found, comm):
        raise InputError("the values of cells differ from rank to rank: the same ones on all would be right")
    return found
