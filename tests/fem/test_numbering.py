"""The order of degrees of freedom in checkpoints: the same on every number of ranks."""

import basix.ufl
import dolfinx
import numpy as np
import pytest
from blocks import COMM
from mpi4py import MPI

import growthx as gx
from growthx.fem.numbering import Numbering

ELEMENTS = {
    "one per cell": ("quadrilateral", basix.ufl.element("DG", "quadrilateral", 0)),
    "nodes": ("quadrilateral", basix.ufl.element("Lagrange", "quadrilateral", 2)),
    "nodes of triangles": ("triangle", basix.ufl.element("Lagrange", "triangle", 2)),
    "vectors": ("quadrilateral", basix.ufl.element("Lagrange", "quadrilateral", 1, shape=(2,))),
    "points": ("quadrilateral", basix.ufl.quadrature_element("quadrilateral", degree=3)),
}


def space(name, comm):
    """A space on the bar of gmsh, whose cells rank 0 has given to DOLFINx."""
    shape, element = ELEMENTS[name]
    mesh = gx.meshing.read(gx.meshing.locate("bar.geo"), comm=comm, elements=10, triangles=shape == "triangle")
    return dolfinx.fem.functionspace(mesh.domain, element)


def places(V):
    """x + √2 y of every degree of freedom of this rank, ghosts included; of a vector, its directions differ by 100."""
    coordinates = V.tabulate_dof_coordinates()
    directions = 100.0 * np.arange(V.dofmap.index_map_bs)
    return (coordinates[:, 0, np.newaxis] + np.sqrt(2) * coordinates[:, 1, np.newaxis] + directions).ravel()


@pytest.mark.parametrize("name", [name for name in ELEMENTS if name != "points"])
def test_the_order_is_that_of_one_rank(name):
    """Else a run could not go on with another number of ranks, or would with densities in wrong places."""
    V, alone = space(name, COMM), space(name, MPI.COMM_SELF)
    found, expected = Numbering(V).gather(places(V)), Numbering(alone).gather(places(alone))
    assert (found is None) == (COMM.rank > 0)
    if COMM.rank == 0:
        assert found == pytest.approx(expected, abs=1e-12)
        assert len(np.unique(found.round(9))) == len(found)


@pytest.mark.parametrize("name", ELEMENTS)
def test_what_was_gathered_is_given_back(name):
    """To the rank it came from, and to those that have it as a ghost."""
    V = space(name, COMM)
    function = dolfinx.fem.Function(V)
    function.x.array[:] = np.random.default_rng(COMM.rank).random(len(function.x.array))
    function.x.scatter_forward()
    numbering = Numbering(V)
    assert np.array_equal(numbering.scatter(numbering.gather(function.x.array)), function.x.array)
